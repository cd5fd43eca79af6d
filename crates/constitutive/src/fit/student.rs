//! Quantiles of Student's t, by its closed finite sums.

/// Probability that `|T| ≤ t` with `freedom` degrees of freedom (finite trigonometric sums, exact for whole numbers).
fn two_sided(t: f64, freedom: usize) -> f64 {
    let theta = (t / (freedom as f64).sqrt()).atan();
    let (sine, cosine) = theta.sin_cos();
    let square = cosine * cosine;
    if freedom % 2 == 1 {
        let (mut sum, mut term) = (0.0, cosine);
        for k in 0..freedom / 2 {
            sum += term;
            term *= square * (2 * k + 2) as f64 / (2 * k + 3) as f64;
        }
        (theta + sine * sum) * std::f64::consts::FRAC_2_PI
    } else {
        let (mut sum, mut term) = (0.0, 1.0);
        for k in 0..freedom / 2 {
            sum += term;
            term *= square * (2 * k + 1) as f64 / (2 * k + 2) as f64;
        }
        sine * sum
    }
}

/// Value below which Student's t with `freedom` degrees of freedom (at least 1) lies with probability `probability` in
/// `[0.5, 1)`.
#[must_use]
pub fn student_quantile(probability: f64, freedom: usize) -> f64 {
    let target = 2.0 * probability - 1.0;
    let freedom = freedom.max(1);
    let (mut low, mut high) = (0.0, 1.0);
    while two_sided(high, freedom) < target && high < 1e12 {
        high *= 2.0;
    }
    for _ in 0..120 {
        let middle = 0.5 * (low + high);
        if two_sided(middle, freedom) < target {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_usual_table() {
        for (freedom, expected) in
            [(1, 12.7062), (2, 4.30265), (5, 2.57058), (10, 2.22814), (30, 2.04227), (1000, 1.96234)]
        {
            approx::assert_relative_eq!(student_quantile(0.975, freedom), expected, max_relative = 5e-6);
        }
    }
}

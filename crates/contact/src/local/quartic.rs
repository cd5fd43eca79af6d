//! Positive real roots of a polynomial of degree four, found one by one between the roots of its derivatives.
//!
//! Closed formulas lose digits near double roots; isolating every root between two stationary points does not.

/// The positive real roots, ascending, of `c[0] + c[1] x + … + c[4] x⁴`. Double roots may be reported once or not at
/// all within round-off; leading zeros are allowed.
#[must_use]
pub fn positive_roots(c: &[f64; 5]) -> Vec<f64> {
    if c.iter().any(|v| !v.is_finite()) {
        return Vec::new();
    }
    roots(c)
}

fn evaluate(c: &[f64], x: f64) -> f64 {
    c.iter().rev().fold(0.0, |s, a| s * x + a)
}

fn roots(c: &[f64]) -> Vec<f64> {
    let degree = match c.iter().rposition(|a| *a != 0.0) {
        Some(d) if d > 0 => d,
        _ => return Vec::new(),
    };
    let c = &c[..=degree];
    if degree == 1 {
        let r = -c[0] / c[1];
        return if r > 0.0 { vec![r] } else { Vec::new() };
    }
    let derivative: Vec<f64> = c.iter().enumerate().skip(1).map(|(i, a)| i as f64 * a).collect();
    // Cauchy's bound on the size of the roots
    let bound = 1.0 + c[..degree].iter().fold(0.0_f64, |m, a| m.max((a / c[degree]).abs()));
    if !bound.is_finite() {
        return Vec::new();
    }
    let mut knots = vec![0.0];
    knots.extend(roots(&derivative));
    knots.push(bound * 1.01);
    let mut found: Vec<f64> = Vec::new();
    for pair in knots.windows(2) {
        let (mut lo, mut hi) = (pair[0], pair[1]);
        let (flo, fhi) = (evaluate(c, lo), evaluate(c, hi));
        if flo == 0.0 && lo > 0.0 && found.last() != Some(&lo) {
            found.push(lo);
        }
        if flo * fhi >= 0.0 {
            continue;
        }
        // bisection to the last digit: monotone between stationary points, so it cannot fail
        for _ in 0..200 {
            let mid = 0.5 * (lo + hi);
            if mid <= lo || mid >= hi {
                break;
            }
            if evaluate(c, mid) * flo > 0.0 { lo = mid } else { hi = mid }
        }
        found.push(0.5 * (lo + hi));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Polynomials built from known roots give them back.
        #[test]
        fn known_roots_are_found(r in proptest::array::uniform4(-3.0..3.0f64)) {
            let mut c = vec![1.0];
            for root in r {
                let mut next = vec![0.0; c.len() + 1];
                for (i, a) in c.iter().enumerate() { next[i + 1] += a; next[i] -= root * a; }
                c = next;
            }
            let mut expected: Vec<f64> = r.iter().copied().filter(|x| *x > 0.0).collect();
            expected.sort_by(f64::total_cmp);
            for i in 1..expected.len() { prop_assume!(expected[i] - expected[i - 1] > 1e-3); }
            prop_assume!(r.iter().all(|x| x.abs() > 1e-3));
            let found = positive_roots(&[c[0], c[1], c[2], c[3], c[4]]);
            prop_assert_eq!(found.len(), expected.len());
            for (a, b) in found.iter().zip(&expected) { prop_assert!((a - b).abs() < 1e-7); }
        }
    }
}

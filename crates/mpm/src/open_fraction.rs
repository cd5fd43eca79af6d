//! Which share of a segment or square lies outside a solid, from signed distances at its corners.
//!
//! Source: marching-squares areas, spec A.6.

/// Share of a segment with end values `a` and `b` that is inside (negative).
#[inline(always)]
#[must_use]
pub fn inside_of_segment(a: f64, b: f64) -> f64 {
    match (a < 0.0, b < 0.0) {
        (true, true) => 1.0,
        (true, false) => a / (a - b),
        (false, true) => b / (b - a),
        (false, false) => 0.0,
    }
}

/// Share of a square with corner values in cyclic order that is inside (negative).
#[must_use]
pub fn inside_of_square(c: [f64; 4]) -> f64 {
    let inside = c.map(|v| v < 0.0);
    let count = inside.iter().filter(|&&i| i).count();
    let corner = |k: usize| {
        // Triangle at corner k, from the cut points of its two edges.
        let (a, b, d) = (c[k], c[(k + 1) % 4], c[(k + 3) % 4]);
        0.5 * (a / (a - b)) * (a / (a - d))
    };
    match count {
        0 => 0.0,
        4 => 1.0,
        1 => corner(inside.iter().position(|&i| i).unwrap_or(0)),
        3 => 1.0 - corner(inside.iter().position(|&i| !i).unwrap_or(0)),
        _ => {
            if inside[0] == inside[2] {
                // Two opposite corners: the mean of the corners decides whether they join.
                let joined = c.iter().sum::<f64>() < 0.0;
                let parts = (0..4).filter(|&k| inside[k] != joined).map(corner).sum::<f64>();
                if joined { 1.0 - parts } else { parts }
            } else {
                // Two adjacent corners: mean of the two cut edges.
                let mut sum = 0.0;
                for k in 0..4 {
                    let n = (k + 1) % 4;
                    if inside[k] != inside[n] {
                        sum += inside_of_segment(c[k], c[n]);
                    }
                }
                0.5 * sum
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn planes_cut_their_exact_area(nx in -1.0..1.0f64, ny in -1.0..1.0f64, c in -1.5..1.5f64) {
            prop_assume!(nx.hypot(ny) > 0.1);
            let at = |x: f64, y: f64| nx * (x - 0.5) + ny * (y - 0.5) - c * 0.5;
            let share = inside_of_square([at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)]);
            // Exact on average over fine strips.
            let n = 400;
            let strips: f64 = (0..n)
                .map(|i| {
                    let x = (f64::from(i) + 0.5) / f64::from(n);
                    inside_of_segment(at(x, 0.0), at(x, 1.0))
                })
                .sum::<f64>() / f64::from(n);
            prop_assert!((share - strips).abs() < 3e-3, "{} {}", share, strips);
            let complement = inside_of_square([-at(0.0, 0.0), -at(1.0, 0.0), -at(1.0, 1.0), -at(0.0, 1.0)]);
            prop_assert!((share + complement - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn opposite_corners_join_or_part_by_their_mean() {
        let joined = inside_of_square([-3.0, 1.0, -3.0, 1.0]);
        let parted = inside_of_square([-1.0, 3.0, -1.0, 3.0]);
        assert!((joined - (1.0 - 2.0 * 0.5 * 0.25 * 0.25)).abs() < 1e-15);
        assert!((parted - 2.0 * 0.5 * 0.25 * 0.25).abs() < 1e-15);
    }
}

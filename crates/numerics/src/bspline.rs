//! Quadratic B-splines on regular grids whose nodes may be staggered.
//!
//! A node of integer index `I` of a field with offset `o` sits at `(I + o) dx` from the origin of the grid; `o` is `0` for face
//! normals and corners, `½` for centres. Three nodes per direction see a point. For every offset the weights sum to one, have
//! zero first moment and the second moment `dx²/4`, so that the affine inertia of a transfer is `dx²/4 I` everywhere.

/// Second moment of the kernel in units of `dx²`.
pub const SECOND_MOMENT: f64 = 0.25;

/// Value of the kernel at distance `x` [cells].
#[inline(always)]
#[must_use]
pub fn value(x: f64) -> f64 {
    let a = x.abs();
    if a < 0.5 {
        0.75 - a * a
    } else if a < 1.5 {
        0.5 * (1.5 - a) * (1.5 - a)
    } else {
        0.0
    }
}

/// Derivative of the kernel at distance `x` [cells].
#[inline(always)]
#[must_use]
pub fn derivative(x: f64) -> f64 {
    let a = x.abs();
    if a < 0.5 {
        -2.0 * x
    } else if a < 1.5 {
        -(1.5 - a) * x.signum()
    } else {
        0.0
    }
}

/// Integral of the kernel from minus infinity to `x` [cells]: the share of a half-space that a node at distance `x` inside sees.
#[inline(always)]
#[must_use]
pub fn integral(x: f64) -> f64 {
    let half = |t: f64| {
        // Integral from t to 3/2 for t >= 0.
        if t >= 1.5 {
            0.0
        } else if t >= 0.5 {
            let r = 1.5 - t;
            r * r * r / 6.0
        } else {
            0.5 - 0.75 * t + t * t * t / 3.0
        }
    };
    if x >= 0.0 { 1.0 - half(x) } else { half(-x) }
}

/// What [`Weights1::smeared`] takes for a segment of the given width [cells]: half of its second moment.
#[must_use]
pub fn smear_of(width: f64) -> f64 {
    width * width / 24.0
}

/// Inverse of [`integral`] on `[0, 1]`; values outside are clamped to `±3/2`.
#[must_use]
pub fn inverse_integral(share: f64) -> f64 {
    if share >= 0.5 { -inverse_upper(1.0 - share) } else { inverse_upper(share) }
}

/// `x ≤ 0` with `integral(x) = share`, for `share ≤ ½`.
fn inverse_upper(share: f64) -> f64 {
    if share <= 0.0 {
        return -1.5;
    }
    if share <= 1.0 / 6.0 {
        return (6.0 * share).cbrt() - 1.5;
    }
    // Solve 1/2 - 3t/4 + t³/3 = share on [0, 1/2]: convex and decreasing, Newton from the left end rises to the root.
    let mut t = 0.0;
    for _ in 0..8 {
        let f: f64 = 0.5 - 0.75 * t + t * t * t / 3.0 - share;
        let step = f / (0.75 - t * t);
        t += step;
        if step.abs() < 1e-16 {
            break;
        }
    }
    -t
}

/// The three weights of one direction and the index of the first node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights1 {
    /// Index of the first of three consecutive nodes.
    pub base: i32,
    /// Weights of the three nodes.
    pub weight: [f64; 3],
    /// Node minus point [cells], for the three nodes.
    pub distance: [f64; 3],
}

impl Weights1 {
    /// Weights for a point at `x` [cells from the origin] in a field of offset `offset` [cells].
    #[inline(always)]
    #[must_use]
    pub fn new(x: f64, offset: f64) -> Self {
        let base = (x - offset - 0.5).floor();
        // Distance of the point from the middle node, in [-1/2, 1/2).
        let f = x - offset - base - 1.0;
        let (a, b) = (0.5 - f, 0.5 + f);
        Self { base: base as i32, weight: [0.5 * a * a, 0.75 - f * f, 0.5 * b * b], distance: [-1.0 - f, -f, 1.0 - f] }
    }

    /// Mean weights of a segment around the point instead of the point itself: exact as long as no node's kernel has a knot in it. Samples
    /// that fill space side by side then add up to the integral of the kernel, which points miss by the error of the midpoint rule.
    ///
    /// - `smear`: see [`smear_of`]
    #[inline(always)]
    #[must_use]
    pub fn smeared(mut self, smear: f64) -> Self {
        self.weight[0] += smear;
        self.weight[1] -= 2.0 * smear;
        self.weight[2] += smear;
        self
    }

    /// Derivatives of the three weights with respect to the point [1/cell].
    #[inline(always)]
    #[must_use]
    pub fn derivative(&self) -> [f64; 3] {
        let f = -self.distance[1];
        [f - 0.5, -2.0 * f, f + 0.5]
    }
}

/// Weights of a point in `D` dimensions, one [`Weights1`] per direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights<const D: usize> {
    /// Directions x, y, z.
    pub axis: [Weights1; D],
}

impl<const D: usize> Weights<D> {
    /// Weights for a point `x` [cells from the origin] in a field of the given offsets [cells].
    #[inline(always)]
    #[must_use]
    pub fn new(x: &[f64; D], offset: &[f64; D]) -> Self {
        Self { axis: std::array::from_fn(|a| Weights1::new(x[a], offset[a])) }
    }

    /// Number of nodes, `3^D`.
    pub const COUNT: usize = 3usize.pow(D as u32);

    /// Digits of node `k` in the stencil, each in `0..3`, x fastest.
    #[inline(always)]
    #[must_use]
    pub fn digits(k: usize) -> [usize; D] {
        let mut rest = k;
        std::array::from_fn(|_| {
            let digit = rest % 3;
            rest /= 3;
            digit
        })
    }

    /// Index, weight and offset from the point [cells] of stencil node `k`.
    #[inline(always)]
    #[must_use]
    pub fn node(&self, k: usize) -> ([i32; D], f64, [f64; D]) {
        let digits = Self::digits(k);
        let mut weight = 1.0;
        for a in 0..D {
            weight *= self.axis[a].weight[digits[a]];
        }
        (
            std::array::from_fn(|a| self.axis[a].base + digits[a] as i32),
            weight,
            std::array::from_fn(|a| self.axis[a].distance[digits[a]]),
        )
    }

    /// Gradient with respect to the point of the weight of stencil node `k` [1/cell].
    #[inline(always)]
    #[must_use]
    pub fn gradient(&self, k: usize) -> [f64; D] {
        let digits = Self::digits(k);
        std::array::from_fn(|a| {
            let mut g = 1.0;
            for b in 0..D {
                g *= if a == b { self.axis[b].derivative()[digits[b]] } else { self.axis[b].weight[digits[b]] };
            }
            g
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn moments_hold_for_every_offset(x in prop::array::uniform3(-20.0..20.0f64), o in prop::array::uniform3(0..3usize)) {
            let offset = o.map(|k| 0.25 * k as f64);
            let w = Weights::<3>::new(&x, &offset);
            let (mut zero, mut first, mut second, mut gradient) = (0.0, [0.0; 3], [[0.0; 3]; 3], [0.0; 3]);
            for k in 0..Weights::<3>::COUNT {
                let (index, weight, d) = w.node(k);
                zero += weight;
                let g = w.gradient(k);
                for a in 0..3 {
                    first[a] += weight * d[a];
                    gradient[a] += g[a] * d[a];
                    prop_assert!((f64::from(index[a]) + offset[a] - x[a] - d[a]).abs() < 1e-13);
                    prop_assert!((value(d[a]) - w.axis[a].weight[Weights::<3>::digits(k)[a]]).abs() < 1e-14);
                    for b in 0..3 {
                        second[a][b] += weight * d[a] * d[b];
                    }
                }
            }
            prop_assert!((zero - 1.0).abs() < 1e-14);
            for a in 0..3 {
                prop_assert!(first[a].abs() < 1e-13);
                // Gradient of the interpolant of the coordinate itself is one.
                prop_assert!((gradient[a] - 1.0).abs() < 1e-13);
                for b in 0..3 {
                    let expected = if a == b { SECOND_MOMENT } else { 0.0 };
                    prop_assert!((second[a][b] - expected).abs() < 1e-13);
                }
            }
        }

        #[test]
        fn derivative_and_integral_match_the_kernel(x in -2.0..2.0f64) {
            let e = 1e-6;
            prop_assert!((derivative(x) - (value(x + e) - value(x - e)) / (2.0 * e)).abs() < 1e-5);
            prop_assert!((value(x) - (integral(x + e) - integral(x - e)) / (2.0 * e)).abs() < 1e-6);
            prop_assert!((integral(x) + integral(-x) - 1.0).abs() < 1e-15);
            if x.abs() < 1.49 {
                prop_assert!((inverse_integral(integral(x)) - x).abs() < 1e-9 / value(x));
            }
        }
    }

    #[test]
    fn inverse_of_the_integral_is_clamped() {
        assert_eq!(inverse_integral(-0.1), -1.5);
        assert_eq!(inverse_integral(1.2), 1.5);
        assert_eq!(inverse_integral(0.5), 0.0);
    }

    /// Samples that fill a half-space side by side add up to the integral of the kernel wherever the surface lies on the side of a cell,
    /// as smeared samples; as points they miss it by the error of the midpoint rule.
    #[test]
    fn smeared_samples_fill_space() {
        for per_cell in [1, 2, 3, 4] {
            let width = 1.0 / f64::from(per_cell);
            for below in [0.5, 1.5, -0.5] {
                let (mut smeared, mut points) = (0.0, 0.0);
                for k in 0..5 * per_cell {
                    // the node lies at zero, the surface `below` above it
                    let w = Weights1::new(below - (f64::from(k) + 0.5) * width, 0.0);
                    let s = w.smeared(smear_of(width));
                    for i in 0..3 {
                        if w.base + i as i32 == 0 {
                            smeared += width * s.weight[i];
                            points += width * w.weight[i];
                        }
                    }
                }
                // boxes that span a knot of the kernel, at odd halves, are not exact: one a cell has only such
                let bound = if per_cell == 2 || per_cell == 4 { 1e-14 } else { 0.02 };
                assert!((smeared - integral(below)).abs() < bound, "{per_cell} {below}: {smeared} {}", integral(below));
                if per_cell == 2 && below == 0.5 {
                    assert!((points - integral(below)).abs() > 0.01);
                }
            }
        }
        let w = Weights1::new(0.3, 0.5).smeared(smear_of(0.5));
        assert!((w.weight.iter().sum::<f64>() - 1.0).abs() < 1e-15 && w.weight.iter().all(|w| *w > 0.0));
    }
}

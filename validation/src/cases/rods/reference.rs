//! Independent answers: shooting with a fourth-order Runge–Kutta integrator, roots by bisection.
//!
//! Nothing here knows the discrete rod. Lengths are in units of the rod's length.

use std::f64::consts::{FRAC_PI_2, PI};

/// Integrates `y' = f(s, y)` from `a` to `b` in `n` steps; also returns the states at the step ends.
pub fn integrate<const D: usize>(
    f: impl Fn(f64, &[f64; D]) -> [f64; D],
    start: [f64; D],
    a: f64,
    b: f64,
    n: usize,
) -> [f64; D] {
    let h = (b - a) / n as f64;
    let mut y = start;
    let shifted = |y: &[f64; D], k: &[f64; D], c: f64| -> [f64; D] { std::array::from_fn(|i| y[i] + c * k[i]) };
    for step in 0..n {
        let s = a + h * step as f64;
        let k1 = f(s, &y);
        let k2 = f(s + 0.5 * h, &shifted(&y, &k1, 0.5 * h));
        let k3 = f(s + 0.5 * h, &shifted(&y, &k2, 0.5 * h));
        let k4 = f(s + h, &shifted(&y, &k3, h));
        for i in 0..D {
            y[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
        }
    }
    y
}

/// Root of a function that changes sign between `a` and `b`, by bisection to round-off.
pub fn bisect(f: impl Fn(f64) -> f64, mut a: f64, mut b: f64) -> Option<f64> {
    let fa = f(a);
    let fb = f(b);
    if fa == 0.0 {
        return Some(a);
    }
    if fa * fb > 0.0 || (fa * fb).is_nan() {
        return None;
    }
    for _ in 0..200 {
        let mid = 0.5 * (a + b);
        if mid == a || mid == b {
            break;
        }
        if f(mid) * fa > 0.0 {
            a = mid;
        } else {
            b = mid;
        }
    }
    Some(0.5 * (a + b))
}

/// First sign change of `f` on a scan of `n` intervals of `[a, b]`, refined by bisection.
pub fn first_root(f: impl Fn(f64) -> f64, a: f64, b: f64, n: usize) -> Option<f64> {
    let x = |i: usize| a + (b - a) * i as f64 / n as f64;
    let mut before = f(a);
    for i in 1..=n {
        let now = f(x(i));
        if before * now <= 0.0 && before != 0.0 {
            return bisect(&f, x(i - 1), x(i));
        }
        before = now;
    }
    None
}

/// Reach and drop of a horizontal cantilever of unit length.
#[derive(Clone, Copy, Debug)]
pub struct Reach {
    /// Horizontal distance of the tip from the clamp.
    pub x: f64,
    /// Distance of the tip below the clamp.
    pub drop: f64,
}

/// Shape of a planar cantilever: shear load `load(s)` (transverse force carried at `s`, in units `EI₀/L²`), bending
/// stiffness `stiffness(s)/EI₀`.
///
/// With the angle ψ to the downward vertical: `m = stiffness ψ'`, `m' = load(s) sin ψ`; `m(1) = 0`, `ψ(0) = π/2`.
/// Integrated from the tip with `ψ(1)` found by bisection on its logarithm, which stays well-conditioned when a heavy
/// rod hangs almost straight down.
pub fn cantilever(load: impl Fn(f64) -> f64, stiffness: impl Fn(f64) -> f64) -> Option<Reach> {
    let rhs = |s: f64, y: &[f64; 4]| {
        let (sin, cos) = y[0].sin_cos();
        [y[1] / stiffness(s), load(s) * sin, sin, cos]
    };
    let shoot = |tip: f64, steps: usize| integrate(rhs, [tip, 0.0, 0.0, 0.0], 1.0, 0.0, steps);
    let miss = |logarithm: f64, steps: usize| {
        let end = shoot(logarithm.exp(), steps)[0];
        if end.is_finite() { end - FRAC_PI_2 } else { f64::INFINITY }
    };
    // a heavy rod has further equilibria, curled up; the hanging one has the smallest angle at the tip
    let (mut low, mut high) = (-150.0, -149.5);
    while miss(high, 1000) < 0.0 {
        low = high;
        high = (high + 0.5).min(FRAC_PI_2.ln());
        if low == high {
            return None;
        }
    }
    let root = bisect(|l| miss(l, 4000), low - 0.01, high + 0.01)?;
    let y = shoot(root.exp(), 4000);
    // integrated backwards: the coordinates come out negative
    Some(Reach { x: -y[2], drop: -y[3] })
}

/// Cantilever under its own weight, `Γ = ρ g A L³/(E I)`.
pub fn heavy_cantilever(gamma: f64) -> Option<Reach> {
    cantilever(|s| gamma * (1.0 - s), |_| 1.0)
}

/// Cantilever under a dead load at its tip, `α = P L²/(E I)`.
pub fn tip_loaded_cantilever(alpha: f64) -> Option<Reach> {
    cantilever(|_| alpha, |_| 1.0)
}

/// Tip-loaded cantilever whose radius falls linearly to `ratio` of its root value; `α = P L²/(E I_root)`.
pub fn tapered_cantilever(alpha: f64, ratio: f64) -> Option<Reach> {
    cantilever(|_| alpha, |s| (1.0 - (1.0 - ratio) * s).powi(4))
}

/// Square root of the first clamped–free frequency coefficient: the root of `cos x cosh x = −1`.
pub fn clamped_free_root() -> f64 {
    bisect(|x| x.cos() * x.cosh() + 1.0, 1.0, 3.0).unwrap_or(f64::NAN)
}

/// Greenhill's column: critical `ρ g A L³/(E I)`. `ψ'' = −Γ (1 − s) ψ`, `ψ(0) = 0`, `ψ'(1) = 0`; 7.837347.
pub fn greenhill_column() -> f64 {
    let clamp =
        |gamma: f64| integrate(|s, y: &[f64; 2]| [y[1], -gamma * (1.0 - s) * y[0]], [1.0, 0.0], 1.0, 0.0, 2000)[0];
    first_root(clamp, 1.0, 20.0, 40).unwrap_or(f64::NAN)
}

/// Lateral buckling of a deep cantilever under an end load: critical `P L²/√(EI GJ)`; 4.012599.
///
/// Twist `φ'' + β² z² φ = 0` with the distance `z` from the tip, `φ'(0) = 0`, `φ(1) = 0`.
pub fn lateral_buckling() -> f64 {
    let twist =
        |beta: f64| integrate(|z, y: &[f64; 2]| [y[1], -beta * beta * z * z * y[0]], [1.0, 0.0], 0.0, 1.0, 2000)[0];
    first_root(twist, 0.5, 8.0, 40).unwrap_or(f64::NAN)
}

/// Critical total twist of a ring of a naturally straight circular rod, `2π√3 EI/GJ` (Michell 1889, Zajac 1962).
pub fn michell_twist(bend_over_twist: f64) -> f64 {
    2.0 * PI * 3f64.sqrt() * bend_over_twist
}

/// Critical moment of a straight rod clamped at both ends under tension, one end free to approach, in units of
/// `2√(EI T)`; `tension = T L²/EI`. Tends to one for a long rod (Greenhill).
///
/// Lateral displacement `y'''' − i M y''' − T y'' = 0` in complex notation; with `a, b = (M ± √(M² − 4T))/2` the clamped
/// solution symmetric about the middle exists where
/// `(a cos ah − sin ah/h) b sin bh = (b cos bh − sin bh/h) a sin ah`, `h = ½`.
pub fn twisted_rod_moment(tension: f64) -> Option<f64> {
    let h = 0.5;
    let condition = |m: f64| {
        let q = (m * m - 4.0 * tension).max(0.0).sqrt();
        let (a, b) = (0.5 * (m + q), 0.5 * (m - q));
        let side = |k: f64| k * (k * h).cos() - (k * h).sin() / h;
        side(a) * b * (b * h).sin() - side(b) * a * (a * h).sin()
    };
    let base = 2.0 * tension.sqrt();
    let start = if tension > 0.0 { base * (1.0 + 1e-9) } else { 1e-3 };
    first_root(condition, start.max(1e-3), base + 40.0, 40_000).map(|m| m / base)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cantilevers_agree_with_the_tables() {
        for (gamma, drop, x) in [
            (0.1, 0.012498, 0.999911),
            (1.0, 0.123471, 0.991246),
            (2.0, 0.238507, 0.966893),
            (5.0, 0.495905, 0.846657),
            (10.0, 0.700200, 0.656354),
            (20.0, 0.829881, 0.445232),
            (50.0, 0.907917, 0.245015),
            (100.0, 0.937524, 0.159223),
        ] {
            let r = heavy_cantilever(gamma).unwrap();
            assert!((r.drop - drop).abs() < 1e-6 && (r.x - x).abs() < 1e-6, "{gamma}: {r:?}");
        }
        for (alpha, drop, x) in [
            (0.1, 0.033295, 0.999335),
            (1.0, 0.301721, 0.943567),
            (2.0, 0.493457, 0.839358),
            (5.0, 0.713792, 0.612372),
            (10.0, 0.810609, 0.445004),
        ] {
            let r = tip_loaded_cantilever(alpha).unwrap();
            assert!((r.drop - drop).abs() < 1e-6 && (r.x - x).abs() < 1e-6, "{alpha}: {r:?}");
            let t = tapered_cantilever(alpha, 1.0).unwrap();
            assert!((t.drop - r.drop).abs() < 1e-12);
        }
        // a linear taper under a small load: ∫ (1−s)²/(1−cs)⁴ ds = 1/(3 (1−c)) for the unit load
        let r = tapered_cantilever(1e-6, 0.5).unwrap();
        assert!((r.drop / 1e-6 - 1.0 / (3.0 * 0.5)).abs() < 1e-6, "{}", r.drop / 1e-6);
    }

    #[test]
    fn buckling_loads_agree_with_the_literature() {
        assert!((clamped_free_root().powi(2) - 3.516_015).abs() < 1e-6);
        assert!((greenhill_column() - 7.837_347).abs() < 1e-6);
        assert!((lateral_buckling() - 4.012_599).abs() < 1e-6);
        assert!((michell_twist(1.0) - 10.8828).abs() < 1e-4);
        // long rods approach Greenhill's infinite rod from above
        let (near, far) = (twisted_rod_moment(100.0).unwrap(), twisted_rod_moment(10_000.0).unwrap());
        assert!(near > far && far > 1.0 && far < 1.01, "{near} {far}");
    }
}

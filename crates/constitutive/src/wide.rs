//! The law of one material point for four points at a time, in lanes ([`numerics::lanes`]).
//!
//! Covers what nearly every particle of every scene does in every step: the implicit flow map with exact determinant at strains that are
//! not extreme. Everything else is told by [`covers`] and by the `sound` mark of a trial, and goes through
//! [`crate::HerschelBulkley`], which is also what the tests compare with.

use crate::flow_map::FlowMap;
use crate::liquid_law::{DETERMINANT_RANGE, DeterminantPolicy, HerschelBulkley};
use crate::tensor::Tensor;
use numerics::lane_math::{exp, inverse_cbrt, ln, ln_1p};
use numerics::lanes::{F4, Lane, sin_cos};

/// Square matrices of four points, by row and column.
pub type Four<const D: usize, L> = [[L; D]; D];

/// Frobenius norm of strains above which principal values have to be inspected.
const EXTREME: f64 = 1e4;
/// Determinant of a moved strain below which it has no digits left.
const LEAST_DETERMINANT: f64 = 1e-4;

/// Reads four matrices that lie one after the other.
#[inline(always)]
#[must_use]
pub fn load<const D: usize, L: Lane<Memory = F4>>(from: &[Tensor<D>; 4]) -> Four<D, L> {
    // Plain loops throughout this file: closures handed to library functions are not compiled with the instructions of the lanes.
    let [a, b, c, d] = from;
    let (a, b, c, d) = (a.as_slice(), b.as_slice(), c.as_slice(), d.as_slice());
    let mut out = zeros::<D, L>();
    for i in 0..D {
        for j in 0..D {
            let k = j * D + i;
            out[i][j] = L::load(&F4([a[k], b[k], c[k], d[k]]));
        }
    }
    out
}

/// Matrices of zeros.
#[inline(always)]
#[must_use]
pub fn zeros<const D: usize, L: Lane>() -> Four<D, L> {
    [[L::splat(0.0); D]; D]
}

/// `I + factor a`.
#[inline(always)]
#[must_use]
pub fn identity_plus<const D: usize, L: Lane>(a: &Four<D, L>, factor: L) -> Four<D, L> {
    let mut out = zeros::<D, L>();
    for i in 0..D {
        for j in 0..D {
            out[i][j] = a[i][j] * factor;
        }
        out[i][i] += L::splat(1.0);
    }
    out
}

/// Four consecutive matrices.
#[inline(always)]
#[must_use]
pub fn four<const D: usize>(list: &[Tensor<D>], first: usize) -> [Tensor<D>; 4] {
    [list[first], list[first + 1], list[first + 2], list[first + 3]]
}

/// Writes four matrices one after the other.
#[inline(always)]
pub fn store<const D: usize, L: Lane<Memory = F4>>(from: &Four<D, L>, to: &mut [Tensor<D>; 4]) {
    for i in 0..D {
        for j in 0..D {
            let mut memory = F4::ZERO;
            from[i][j].store(&mut memory);
            for p in 0..4 {
                to[p].as_mut_slice()[j * D + i] = memory.0[p];
            }
        }
    }
}

/// Reads four numbers.
#[inline(always)]
#[must_use]
pub fn numbers<L: Lane<Memory = F4>>(from: &[f64; 4]) -> L {
    L::load(&F4(*from))
}

/// The four numbers.
#[inline(always)]
#[must_use]
pub fn parts<L: Lane<Memory = F4>>(x: L) -> [f64; 4] {
    let mut memory = F4::ZERO;
    x.store(&mut memory);
    memory.0
}

/// Whether `a > b` in any lane.
#[inline(always)]
fn any_above<L: Lane<Memory = F4>>(a: L, b: L) -> bool {
    parts(L::select_gt(a, b, L::splat(1.0), L::splat(0.0))) != [0.0; 4]
}

/// `a b`.
#[inline(always)]
#[must_use]
pub fn product<const D: usize, L: Lane>(a: &Four<D, L>, b: &Four<D, L>) -> Four<D, L> {
    let mut out = zeros::<D, L>();
    for i in 0..D {
        for j in 0..D {
            let mut sum = a[i][0] * b[0][j];
            for k in 1..D {
                sum += a[i][k] * b[k][j];
            }
            out[i][j] = sum;
        }
    }
    out
}

/// `a bᵀ`.
#[inline(always)]
#[must_use]
pub fn product_transposed<const D: usize, L: Lane>(a: &Four<D, L>, b: &Four<D, L>) -> Four<D, L> {
    let mut out = zeros::<D, L>();
    for i in 0..D {
        for j in 0..D {
            let mut sum = a[i][0] * b[j][0];
            for k in 1..D {
                sum += a[i][k] * b[j][k];
            }
            out[i][j] = sum;
        }
    }
    out
}

/// `Σ a_ij b_ij`.
#[inline(always)]
#[must_use]
pub fn contraction<const D: usize, L: Lane>(a: &Four<D, L>, b: &Four<D, L>) -> L {
    let mut sum = L::splat(0.0);
    for i in 0..D {
        for j in 0..D {
            sum += a[i][j] * b[i][j];
        }
    }
    sum
}

/// Sum of the diagonal.
#[inline(always)]
#[must_use]
pub fn trace<const D: usize, L: Lane>(a: &Four<D, L>) -> L {
    let mut sum = a[0][0];
    for i in 1..D {
        sum += a[i][i];
    }
    sum
}

/// Determinant, `D` = 2 or 3.
#[inline(always)]
#[must_use]
pub fn determinant<const D: usize, L: Lane>(a: &Four<D, L>) -> L {
    if D == 2 {
        a[0][0] * a[1][1] - a[0][1] * a[1][0]
    } else {
        a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) - a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0])
            + a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0])
    }
}

/// Transposed cofactors: `adjugate(a) a = det(a) I`.
#[inline(always)]
#[must_use]
pub fn adjugate<const D: usize, L: Lane>(a: &Four<D, L>) -> Four<D, L> {
    let mut out = zeros::<D, L>();
    if D == 2 {
        out[0][0] = a[1][1];
        out[1][1] = a[0][0];
        out[0][1] = -a[0][1];
        out[1][0] = -a[1][0];
        return out;
    }
    for i in 0..3 {
        for j in 0..3 {
            let (r0, r1) = ((j + 1) % 3, (j + 2) % 3);
            let (c0, c1) = ((i + 1) % 3, (i + 2) % 3);
            out[i][j] = a[r0][c0] * a[r1][c1] - a[r0][c1] * a[r1][c0];
        }
    }
    out
}

/// `x^{−1/D}` for positive numbers.
#[inline(always)]
#[must_use]
pub fn inverse_root<const D: usize, L: Lane>(x: L) -> L {
    if D == 2 { L::splat(1.0) / x.sqrt() } else { inverse_cbrt(x) }
}

/// Deviator and mean.
#[inline(always)]
#[must_use]
pub fn deviator<const D: usize, L: Lane>(a: &Four<D, L>) -> (Four<D, L>, L) {
    let mean = trace(a) * L::splat(1.0 / D as f64);
    let mut out = *a;
    for i in 0..D {
        out[i][i] -= mean;
    }
    (out, mean)
}

/// Strain carried through the deformation of a step.
#[derive(Clone, Copy)]
pub struct Trial<const D: usize, L> {
    /// Trial strain of determinant one.
    pub strain: Four<D, L>,
    /// Determinant of the deformation.
    pub factor: L,
    /// One where the result holds; zero where the scalar law must look (extreme strain, refused deformation, not a number).
    pub sound: L,
}

/// `b̄* = f b̄ fᵀ`, scaled to determinant one.
#[inline(always)]
#[must_use]
pub fn elastic_trial<const D: usize, L: Lane>(strain: &Four<D, L>, f: &Four<D, L>) -> Trial<D, L> {
    let factor = determinant(f);
    let half = product(f, strain);
    let mut moved = product_transposed(&half, f);
    for i in 0..D {
        for j in 0..i {
            let mean = (moved[i][j] + moved[j][i]) * L::splat(0.5);
            moved[i][j] = mean;
            moved[j][i] = mean;
        }
    }
    let det = determinant(&moved);
    let (one, zero) = (L::splat(1.0), L::splat(0.0));
    let mut sound = L::select_gt(factor, L::splat(DETERMINANT_RANGE.0), one, zero);
    sound = L::select_gt(L::splat(DETERMINANT_RANGE.1), factor, sound, zero);
    sound = L::select_gt(det, L::splat(LEAST_DETERMINANT), sound, zero);
    sound = L::select_gt(L::splat(EXTREME * EXTREME), contraction(&moved, &moved), sound, zero);
    let scale = inverse_root::<D, L>(L::select_gt(sound, zero, det, one));
    for i in 0..D {
        for j in 0..D {
            moved[i][j] *= scale;
        }
    }
    Trial { strain: moved, factor, sound }
}

/// Whether the lanes know this law.
#[must_use]
pub fn covers(law: &HerschelBulkley) -> bool {
    law.is_shear_elastic()
        && law.settings.flow_map == FlowMap::Implicit
        && law.settings.determinant == DeterminantPolicy::Exact
        && law.flow.consistency() > 0.0
}

/// A law in lanes, with the step.
#[derive(Clone, Copy)]
pub struct Law<L> {
    modulus: L,
    yield_norm: L,
    ln_consistency: L,
    index: L,
    inverse_index: L,
    /// `2 dt` [s].
    twice_dt: L,
}

/// What one step of flow leaves of a trial stress.
#[derive(Clone, Copy)]
pub struct Flowed<L> {
    /// Stress norm [Pa].
    pub stress: L,
    /// Radial factor.
    pub radial: L,
    /// Its derivative by the trial stress [1/Pa].
    pub radial_by_stress: L,
    /// Its derivative by the effective modulus [1/Pa].
    pub radial_by_modulus: L,
    /// One where the point flowed, else zero.
    pub yielded: L,
}

impl<L: Lane<Memory = F4>> Law<L> {
    /// The law of a liquid for which [`covers`] holds.
    #[inline(always)]
    #[must_use]
    pub fn new(law: &HerschelBulkley, dt: f64) -> Self {
        let flow = &law.flow;
        Law {
            modulus: L::splat(law.shear_modulus),
            yield_norm: L::splat(flow.yield_norm()),
            ln_consistency: L::splat(flow.ln_consistency()),
            index: L::splat(flow.index()),
            inverse_index: L::splat(flow.inverse_index()),
            twice_dt: L::splat(2.0 * dt),
        }
    }

    /// Shear modulus [Pa].
    #[inline(always)]
    #[must_use]
    pub fn modulus(&self) -> L {
        self.modulus
    }

    /// The implicit flow map, as [`crate::ShearFlow::return_map`] in radial form.
    #[inline(always)]
    #[must_use]
    pub fn flow(&self, trial: L, mu_hat: L) -> Flowed<L> {
        let (one, zero) = (L::splat(1.0), L::splat(0.0));
        let elastic =
            Flowed { stress: trial, radial: one, radial_by_stress: zero, radial_by_modulus: zero, yielded: zero };
        if !any_above(trial, self.yield_norm) {
            return elastic;
        }
        let tiny = L::splat(f64::MIN_POSITIVE);
        let excess = (trial - self.yield_norm).max(tiny);
        let ln_excess = ln(excess);
        let p = self.inverse_index;
        let ln_x = ln(self.twice_dt * mu_hat) - ln_excess + (ln_excess - self.ln_consistency) * p;
        let w = ln_fraction(ln_x, p, self.index);
        let fraction = exp(w);
        let lost = exp(ln_x + p * w);
        let by_trial = self.index * fraction / (self.index * fraction + lost);
        let stress = self.yield_norm + excess * fraction;
        let safe = trial.max(tiny);
        let radial = stress / safe;
        let limit = self.yield_norm;
        Flowed {
            stress: L::select_gt(trial, limit, stress, trial),
            radial: L::select_gt(trial, limit, radial, one),
            radial_by_stress: L::select_gt(trial, limit, (by_trial - radial) / safe, zero),
            radial_by_modulus: L::select_gt(trial, limit, -excess * lost / mu_hat * by_trial / safe, zero),
            yielded: L::select_gt(trial, limit, one, zero),
        }
    }

    /// Lets a trial strain of determinant one flow; returns the strain, again of determinant one, and what the flow did.
    #[inline(always)]
    #[must_use]
    pub fn relax<const D: usize>(&self, trial: &Four<D, L>) -> (Four<D, L>, Flowed<L>) {
        let (dev, mean) = deviator(trial);
        let square = contraction(&dev, &dev);
        let flowed = self.flow(self.modulus * square.sqrt(), self.modulus * mean);
        if !any_above(flowed.yielded, L::splat(0.0)) {
            return (*trial, flowed);
        }
        let mut strain = dev;
        for i in 0..D {
            for j in 0..D {
                strain[i][j] *= flowed.radial;
            }
        }
        let beta = unit_determinant_mean(&strain, square * flowed.radial * flowed.radial, mean);
        for i in 0..D {
            strain[i][i] += beta;
        }
        let zero = L::splat(0.0);
        for i in 0..D {
            for j in 0..D {
                strain[i][j] = L::select_gt(flowed.yielded, zero, strain[i][j], trial[i][j]);
            }
        }
        (strain, flowed)
    }
}

/// `w ≤ 0` with `e^w + e^{ln X + p w} = 1`, as [`crate::flow_map::ln_fraction`].
#[inline(always)]
fn ln_fraction<L: Lane<Memory = F4>>(ln_x: L, p: L, index: L) -> L {
    let (one, zero) = (L::splat(1.0), L::splat(0.0));
    let q = p - one;
    let mut w = (-ln_x * index).min(zero);
    for _ in 0..60 {
        let d = ln_x + q * w;
        let e = exp(-d.abs());
        let value = w + d.max(zero) + ln_1p(e);
        let inverse = one / (one + e);
        let (minor, major) = (e * inverse, inverse);
        let share = L::select_gt(d, zero, major, minor);
        let other = L::select_gt(d, zero, minor, major);
        let slope = one + q * share;
        let newton = value / slope;
        let bend = L::splat(0.5) * newton * q * q * share * other / slope;
        let step = newton / (one - bend).max(L::splat(0.5));
        w -= step;
        // third order: the next step would be below round-off
        if !any_above(step.abs(), L::splat(1e-5) * w.abs().min(one)) {
            break;
        }
    }
    w.min(zero)
}

/// Mean that gives a deviator of norm² `square` the determinant one, from `start` at or above it.
#[inline(always)]
fn unit_determinant_mean<const D: usize, L: Lane<Memory = F4>>(dev: &Four<D, L>, square: L, start: L) -> L {
    let one = L::splat(1.0);
    let half = square * L::splat(0.5);
    if D == 2 {
        return (one + half).sqrt();
    }
    let det = determinant(dev);
    let rest = det - one;
    let low = start.max((half * L::splat(1.0 / 3.0)).sqrt()).max(one);
    let mut beta = L::select_gt(L::splat(0.0), (low * low - half) * low + rest, one + half.sqrt(), low);
    for _ in 0..60 {
        let slope = (L::splat(3.0) * beta * beta - half).max(L::splat(1e-300));
        let step = (((beta * beta - half) * beta + rest) / slope).max(L::splat(0.0));
        beta -= step;
        if !any_above(step, beta * L::splat(1e-15)) {
            break;
        }
    }
    beta
}

/// Eigenvalues of symmetric matrices in descending order, in closed form: absolute accuracy relative to the largest.
#[inline(always)]
fn eigenvalues<const D: usize, L: Lane<Memory = F4>>(a: &Four<D, L>) -> [L; 3] {
    let (dev, mean) = deviator(a);
    if D == 2 {
        let r = (contraction(&dev, &dev) * L::splat(0.5)).sqrt();
        return [mean + r, mean - r, mean - r];
    }
    let square = contraction(&dev, &dev) * L::splat(1.0 / 6.0);
    let p = square.sqrt();
    let safe = p.max(L::splat(1e-150));
    let cosine = determinant(&dev) * L::splat(0.5) / (safe * safe * safe);
    let cosine = cosine.max(L::splat(-1.0)).min(L::splat(1.0));
    let sine = (L::splat(1.0) - cosine * cosine).max(L::splat(0.0)).sqrt();
    let third = numerics::lanes::atan2(sine, cosine) * L::splat(1.0 / 3.0);
    let (s, c) = sin_cos(third);
    let twice = p + p;
    let first = mean + twice * c;
    let last = mean - p * (c + L::splat(3f64.sqrt()) * s);
    [first, L::splat(3.0) * mean - first - last, last]
}

/// Plastic history `C^P = J^{−2/D} Fᵀ b̄⁻¹ F` of four particles whose strains have determinant one, and the determinants of `F`.
#[inline(always)]
#[must_use]
pub fn plastic_history<const D: usize, L: Lane>(gradient: &Four<D, L>, strain: &Four<D, L>) -> (Four<D, L>, L) {
    let j = determinant(gradient);
    let root = inverse_root::<D, L>(j);
    let inverse = adjugate(strain);
    let half = product(&inverse, gradient);
    let scale = root * root / determinant(strain);
    let mut history = zeros::<D, L>();
    for i in 0..D {
        for k in 0..D {
            let mut sum = gradient[0][i] * half[0][k];
            for m in 1..D {
                sum += gradient[m][i] * half[m][k];
            }
            history[i][k] = sum * scale;
        }
    }
    for i in 0..D {
        for k in 0..i {
            let mean = (history[i][k] + history[k][i]) * L::splat(0.5);
            history[i][k] = mean;
            history[k][i] = mean;
        }
    }
    (history, j)
}

/// Gradients with healed history, as [`crate::tearing::recover`]: `F (C^P)^q` with `q = (e^{−dt/t_r} − 1)/2`, scaled to its determinant.
/// The second value is one where the result holds; elsewhere the scalar law must look.
///
/// The power is the interpolation of `λ^q` through the eigenvalues: no vectors are needed, and where eigenvalues meet, the divided
/// differences lose digits exactly as the factors that they multiply vanish.
#[inline(always)]
#[must_use]
pub fn recover<const D: usize, L: Lane<Memory = F4>>(
    gradient: &Four<D, L>,
    strain: &Four<D, L>,
    exponent: L,
) -> (Four<D, L>, L) {
    let (one, zero) = (L::splat(1.0), L::splat(0.0));
    let (history, j) = plastic_history(gradient, strain);
    let [a, b, c] = eigenvalues(&history);
    // Small eigenvalues have lost their digits beside large ones.
    let mut sound = L::select_gt(c, a * L::splat(1e-7), one, zero);
    sound = L::select_gt(c, L::splat(1e-12), sound, zero);
    sound = L::select_gt(j, L::splat(1e-100), sound, zero);
    sound = L::select_gt(L::splat(1e100), j, sound, zero);
    let a = L::select_gt(sound, zero, a, one);
    let c = L::select_gt(sound, zero, c, one);
    let b = L::select_gt(sound, zero, b, one).max(c);
    let fc = exp(exponent * ln(c));
    let mut factor = zeros::<D, L>();
    if D == 2 {
        // the eigenvalues are a and c here
        let slope = divided_power(exponent, a, c, fc);
        for i in 0..D {
            for k in 0..D {
                factor[i][k] = history[i][k] * slope;
            }
            factor[i][i] += fc - slope * c;
        }
    } else {
        let fb = exp(exponent * ln(b));
        let lowest = divided_power(exponent, b, c, fc);
        let upper = divided_power(exponent, a, b, fb);
        let gap = a - c;
        let bend = L::select_gt(gap, a * L::splat(1e-12), (upper - lowest) / gap.max(L::splat(1e-300)), zero);
        let mut from_b = history;
        let mut from_c = history;
        for i in 0..D {
            from_b[i][i] -= b;
            from_c[i][i] -= c;
        }
        let square = product(&from_b, &from_c);
        for i in 0..D {
            for k in 0..D {
                factor[i][k] = from_c[i][k] * lowest + square[i][k] * bend;
            }
            factor[i][i] += fc;
        }
    }
    let healed = product(gradient, &factor);
    let scale = inverse_root::<D, L>(L::select_gt(sound, zero, determinant(&healed) / j, one));
    let mut out = healed;
    for i in 0..D {
        for k in 0..D {
            out[i][k] *= scale;
        }
    }
    (out, sound)
}

/// `(x^q − y^q)/(x − y)` for `x ≥ y > 0`; `fy = y^q`.
#[inline(always)]
fn divided_power<L: Lane>(q: L, x: L, y: L, fy: L) -> L {
    let one = L::splat(1.0);
    let t = ((x - y) / y).max(L::splat(0.0));
    let l = L::select_gt(t, one, ln(one + t), ln_1p(t.min(one)));
    let u = q * l;
    // e^u − 1: u is a small share of a logarithm, and small u need the series
    let small = u * (one + u * L::splat(0.5) * (one + u * L::splat(1.0 / 3.0) * (one + u * L::splat(0.25))));
    let grown = L::select_gt(u.abs(), L::splat(1e-3), exp(u) - one, small);
    let least = L::splat(1e-14);
    L::select_gt(t, least, fy * grown / (y * t.max(least)), q * fy / y)
}

#[cfg(test)]
mod tests;

//! The exact local solution by cases: take-off, stick, slip (Bonnefon and Daviet 2011, in a division-free form).
//!
//! Sliding: `u_N = 0`, `u_T = −α r_T` with `α > 0`. With `W̄ = W_TT − W_TN W_NT/W_NN`, `β = b_T − W_TN b_N/W_NN`,
//! `B = adj(W̄) β` the tangential impulse is `r_T = −(α β + B)/P(α)`, `P = α² + tr W̄ α + det W̄`, and the cone
//! condition becomes
//! `h(α) = |b_N| α² + (|b_N| tr W̄ + W_NT·β) α + |b_N| det W̄ + W_NT·B − (W_NN/ν) ‖α β + B‖ = 0`.
//! Squaring `h` gives the quartic of spec 7.4. Unsquared it has a sign change whenever sticking fails (`h(0) < 0`,
//! `h(∞) > 0`), so a bracketed Newton iteration cannot miss; the quartic's roots are only searched where coupling makes
//! `W̄` indefinite.

use super::quartic::positive_roots;
use crate::block::{Block, Vec3, tangential_norm};

/// Length of a tangential vector, safe from overflow and underflow.
#[inline(always)]
fn length(v: [f64; 2]) -> f64 {
    tangential_norm(&[0.0, v[0], v[1]])
}

/// The reduced tangential problem of one contact.
#[derive(Clone, Copy, Debug)]
struct Sliding {
    w_nn: f64,
    w_nt: [f64; 2],
    nu: f64,
    closing: f64,
    beta: [f64; 2],
    adj_beta: [f64; 2],
    trace: f64,
    det: f64,
    a1: f64,
    a0: f64,
    c: f64,
}

impl Sliding {
    fn new(w: &Block, b: &Vec3, nu: f64) -> Self {
        let w_nn = w[0];
        let w_nt = [w[1], w[2]];
        let w_tn = [w[3], w[6]];
        let wb = [
            w[4] - w_tn[0] * w_nt[0] / w_nn,
            w[5] - w_tn[0] * w_nt[1] / w_nn,
            w[7] - w_tn[1] * w_nt[0] / w_nn,
            w[8] - w_tn[1] * w_nt[1] / w_nn,
        ];
        let closing = -b[0];
        let beta = [b[1] - w_tn[0] * b[0] / w_nn, b[2] - w_tn[1] * b[0] / w_nn];
        let adj_beta = [wb[3] * beta[0] - wb[1] * beta[1], wb[0] * beta[1] - wb[2] * beta[0]];
        let trace = wb[0] + wb[3];
        let det = wb[0] * wb[3] - wb[1] * wb[2];
        let a1 = closing * trace + w_nt[0] * beta[0] + w_nt[1] * beta[1];
        let a0 = closing * det + w_nt[0] * adj_beta[0] + w_nt[1] * adj_beta[1];
        Sliding { w_nn, w_nt, nu, closing, beta, adj_beta, trace, det, a1, a0, c: w_nn / nu }
    }

    /// `h(α)` and `h'(α)`.
    #[inline]
    fn h(&self, alpha: f64) -> (f64, f64) {
        let v = [alpha * self.beta[0] + self.adj_beta[0], alpha * self.beta[1] + self.adj_beta[1]];
        let n = length(v);
        let value = (self.closing * alpha + self.a1) * alpha + self.a0 - self.c * n;
        let slope = 2.0 * self.closing * alpha + self.a1
            - if n > 0.0 { self.c * (v[0] * self.beta[0] + v[1] * self.beta[1]) / n } else { 0.0 };
        (value, slope)
    }

    /// Impulse at a slip rate: on the cone's boundary when sliding, from the normal equation when sticking.
    fn impulse(&self, alpha: f64, sliding: bool) -> Vec3 {
        let p = (alpha + self.trace) * alpha + self.det;
        let t = [-(alpha * self.beta[0] + self.adj_beta[0]) / p, -(alpha * self.beta[1] + self.adj_beta[1]) / p];
        if sliding {
            [length(t) / self.nu, t[0], t[1]]
        } else {
            [(self.closing - self.w_nt[0] * t[0] - self.w_nt[1] * t[1]) / self.w_nn, t[0], t[1]]
        }
    }
}

/// All candidate impulses worth judging, the likeliest first.
///
/// - `w`: the contact's own Delassus block (need not be symmetric) [1/kg]
/// - `b`: velocity of the contact with its own impulse zero [m/s]
/// - `nu`: friction, `≥ 0`
/// - `alpha_guess`: slip rate over impulse from the last visit, 0 if unknown [1/kg]
#[must_use]
pub fn candidates(w: &Block, b: &Vec3, nu: f64, alpha_guess: f64) -> Candidates {
    let mut out = Candidates { list: [[0.0; 3]; 5], len: 0 };
    if b[0] >= 0.0 || w[0] <= 0.0 {
        // take-off, or a contact that no impulse can move: inactive
        out.push([0.0; 3]);
        return out;
    }
    if nu == 0.0 {
        out.push([-b[0] / w[0], 0.0, 0.0]);
        return out;
    }
    let s = Sliding::new(w, b, nu);
    // where the tangential block is singular within round-off, stick is the limit of slip with a vanishing rate
    let floor =
        if s.det > 1e-13 * s.trace * s.trace { 0.0 } else { 1e-14 * s.trace.abs().max(w[4].abs() + w[8].abs()) };
    if s.h(floor).0 >= 0.0 && s.trace >= 0.0 {
        out.push(s.impulse(floor, false));
        return out;
    }
    if let Some(alpha) = sliding_root(&s, floor, alpha_guess) {
        out.push(s.impulse(alpha, true));
    }
    if s.det < 0.0 || s.trace <= 0.0 || out.len == 0 {
        // indefinite: enumerate every root of the squared equation
        let (bb, bd, dd) = (
            s.beta[0] * s.beta[0] + s.beta[1] * s.beta[1],
            s.beta[0] * s.adj_beta[0] + s.beta[1] * s.adj_beta[1],
            s.adj_beta[0] * s.adj_beta[0] + s.adj_beta[1] * s.adj_beta[1],
        );
        let c2 = s.c * s.c;
        let quartic = [
            s.a0 * s.a0 - c2 * dd,
            2.0 * (s.a0 * s.a1 - c2 * bd),
            s.a1 * s.a1 + 2.0 * s.closing * s.a0 - c2 * bb,
            2.0 * s.closing * s.a1,
            s.closing * s.closing,
        ];
        for alpha in positive_roots(&quartic) {
            out.push(s.impulse(alpha, true));
        }
    }
    out
}

/// Up to five candidate impulses.
#[derive(Clone, Copy, Debug)]
pub struct Candidates {
    list: [Vec3; 5],
    len: usize,
}

impl Candidates {
    fn push(&mut self, r: Vec3) {
        if self.len < 5 && r.iter().all(|v| v.is_finite()) {
            self.list[self.len] = r;
            self.len += 1;
        }
    }

    /// The candidates.
    #[must_use]
    pub fn as_slice(&self) -> &[Vec3] {
        &self.list[..self.len]
    }
}

/// The root of `h` above `floor`, bracketed; `h(floor) < 0` on entry.
fn sliding_root(s: &Sliding, floor: f64, guess: f64) -> Option<f64> {
    let beta = length(s.beta);
    let scale = (s.c * beta / s.closing).max(s.trace.abs());
    if !scale.is_finite() {
        return None;
    }
    let mut lo = floor;
    let mut hi = f64::INFINITY;
    let mut alpha = if guess > floor && guess.is_finite() { guess } else { scale.max(f64::MIN_POSITIVE) };
    for _ in 0..120 {
        let (h, slope) = s.h(alpha);
        if h == 0.0 {
            return Some(alpha);
        }
        if h < 0.0 {
            lo = alpha
        } else {
            hi = alpha
        }
        let newton = alpha - h / slope;
        let next = if newton > lo && newton < hi {
            newton
        } else if hi.is_infinite() {
            (alpha * 4.0).max(scale)
        } else if lo > 1e-3 * hi {
            0.5 * (lo + hi)
        } else {
            // the scales of α span many decades: halve the exponent
            (lo.max(1e-6 * hi) * hi).sqrt()
        };
        if (next - alpha).abs() <= 4e-16 * alpha.abs() || (hi - lo) <= 4e-16 * hi {
            return Some(next);
        }
        alpha = next;
    }
    if hi.is_finite() { Some(alpha) } else { None }
}

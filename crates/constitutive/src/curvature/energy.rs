//! Quadratic energy of curvature and twist of one element, with gradient and Hessian.
//!
//! `E = ½ c₀[(k₀−k̄₀)² + (k₂−k̄₂)²] + ½ c₁[(k₁−k̄₁)² + (k₃−k̄₃)²] + ½ c_m (m−m̄)²`.
//!
//! With the weights `w_q = c_q (k_q − k̄_q)`, `w_m = c_m (m − m̄)` and the weighted directors
//! `Pᵉ = w₀ m2ᵉ − w₁ m1ᵉ`, `Pᶠ = w₂ m2ᶠ − w₃ m1ᶠ`, `P = Pᵉ + Pᶠ`, the weighted sum of the four curvatures is
//! `K = κ·P`. Putting the corrected Hessians of the four curvatures (spec 4.3–4.5) into that sum, many terms cancel
//! (`tᵉ + t̃ + χₑℓₑ/χ = 2 t̃`, and the tangential parts of the mixed block), which leaves, with `P̃ = 2P/χ`,
//! `Qᵉ = tᶠ×P̃ − K t̃`, `Qᶠ = −tᵉ×P̃ − K t̃`:
//!
//! ```text
//! ℓₑ²   Hₑₑ = −2 sym(Qᵉ⊗t̃) − (K/χ)(I − tᵉ⊗tᵉ) + sym(κ⊗(Pᵉ − ½ w_m (tᵉ + t̃)))
//! ℓ_f²  H_ff = −2 sym(Qᶠ⊗t̃) − (K/χ)(I − tᶠ⊗tᶠ) + sym(κ⊗(Pᶠ − ½ w_m (tᶠ + t̃)))
//! ℓₑℓ_f Hₑ_f = −[ t̃⊗Qᶠ + (Qᵉ + ½ w_m κ)⊗t̃ + (K/χ)(I + tᵉ⊗tᶠ) + [P̃ − w_m tᵉ/χ]× ]
//! ```
//!
//! to which the Gauss–Newton part `Σ c_q ∇k_q⊗∇k_q + c_m ∇m⊗∇m` is added.

use super::kinematics::CurvatureElement;
use numerics::lanes::{Lane, V3};

/// Stiffness and rest state of one element.
#[derive(Clone, Copy, Debug)]
pub struct CurvatureLaw<L> {
    /// Stiffness of the curvatures 0 and 2, `B₁/(2L)` \[N m\], `B₁ = E π b a³/4`.
    pub c0: L,
    /// Stiffness of the curvatures 1 and 3, `B₂/(2L)` \[N m\], `B₂ = E π a b³/4`.
    pub c1: L,
    /// Stiffness of the twist, `k_t/L` \[N m\].
    pub cm: L,
    /// Rest curvatures.
    pub rest: [L; 4],
    /// Rest twist \[rad\].
    pub rest_twist: L,
}

/// Gradient in the unknowns `(e, f, θᵉ, θᶠ)`.
#[derive(Clone, Copy, Debug)]
pub struct ElementGradient<L> {
    /// With respect to the first edge vector \[N\].
    pub e: V3<L>,
    /// With respect to the second edge vector \[N\].
    pub f: V3<L>,
    /// With respect to the first angle \[N m\].
    pub te: L,
    /// With respect to the second angle \[N m\].
    pub tf: L,
}

/// Symmetric Hessian in the unknowns `(e, f, θᵉ, θᶠ)`.
#[derive(Clone, Copy, Debug)]
pub struct ElementHessian<L> {
    /// Block (e, e): xx, yx, yy, zx, zy, zz.
    pub ee: [L; 6],
    /// Block (f, f), same order.
    pub ff: [L; 6],
    /// Block (e, f), rows e.
    pub ef: [[L; 3]; 3],
    /// Column (e, θᵉ).
    pub e_te: V3<L>,
    /// Column (e, θᶠ).
    pub e_tf: V3<L>,
    /// Column (f, θᵉ).
    pub f_te: V3<L>,
    /// Column (f, θᶠ).
    pub f_tf: V3<L>,
    /// (θᵉ, θᵉ), (θᵉ, θᶠ), (θᶠ, θᶠ).
    pub tt: [L; 3],
}

/// Lower triangle of a symmetric 3×3 matrix: row, column of each of the six numbers.
pub const SYMMETRIC: [(usize, usize); 6] = [(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2)];

impl<L: Lane> CurvatureLaw<L> {
    /// Energy \[J\] at the twist `m` \[rad\].
    #[inline(always)]
    pub fn energy(&self, x: &CurvatureElement<L>, m: L) -> L {
        let [d0, d1, d2, d3] = self.deviations(x);
        let dm = m - self.rest_twist;
        L::splat(0.5) * (self.c0 * (d0 * d0 + d2 * d2) + self.c1 * (d1 * d1 + d3 * d3) + self.cm * dm * dm)
    }

    #[inline(always)]
    fn deviations(&self, x: &CurvatureElement<L>) -> [L; 4] {
        [x.k[0] - self.rest[0], x.k[1] - self.rest[1], x.k[2] - self.rest[2], x.k[3] - self.rest[3]]
    }

    /// Weights `w_q` and `w_m`: derivatives of the energy by the four curvatures and the twist.
    #[inline(always)]
    pub fn weights(&self, x: &CurvatureElement<L>, m: L) -> ([L; 4], L) {
        let [d0, d1, d2, d3] = self.deviations(x);
        ([self.c0 * d0, self.c1 * d1, self.c0 * d2, self.c1 * d3], self.cm * (m - self.rest_twist))
    }

    /// Gradient at the twist `m`.
    #[inline(always)]
    pub fn gradient(&self, x: &CurvatureElement<L>, m: L) -> ElementGradient<L> {
        let (w, wm) = self.weights(x, m);
        let p = Weighted::new(x, &w);
        p.gradient(x, &w, wm)
    }

    /// Gradient and Hessian at the twist `m`. With `EXACT = false` only the Gauss–Newton part of the Hessian, which is
    /// positive semi-definite.
    #[inline(always)]
    pub fn gradient_hessian<const EXACT: bool>(
        &self,
        x: &CurvatureElement<L>,
        m: L,
    ) -> (ElementGradient<L>, ElementHessian<L>) {
        let (w, wm) = self.weights(x, m);
        let p = Weighted::new(x, &w);
        let gradient = p.gradient(x, &w, wm);

        // gradients of the single curvatures and of the twist
        let two_chi = x.inv_chi + x.inv_chi;
        let (ae, af) = (two_chi * x.inv_le, two_chi * x.inv_lf);
        let (te, tf) = (x.te, x.tf);
        // te × m2e = −m1e and so on: only the mixed products need work
        let tilde_e = x.tilde.scale(x.inv_le);
        let tilde_f = x.tilde.scale(x.inv_lf);
        let ge = [
            tf.cross(x.m2e).scale(ae) - tilde_e.scale(x.k[0]),
            -(tf.cross(x.m1e).scale(ae) + tilde_e.scale(x.k[1])),
            -(x.m1f.scale(ae) + tilde_e.scale(x.k[2])),
            -(x.m2f.scale(ae) + tilde_e.scale(x.k[3])),
        ];
        let gf = [
            x.m1e.scale(af) - tilde_f.scale(x.k[0]),
            x.m2e.scale(af) - tilde_f.scale(x.k[1]),
            -(te.cross(x.m2f).scale(af) + tilde_f.scale(x.k[2])),
            te.cross(x.m1f).scale(af) - tilde_f.scale(x.k[3]),
        ];
        let half = L::splat(0.5);
        let gme = x.binormal.scale(half * x.inv_le);
        let gmf = x.binormal.scale(half * x.inv_lf);
        let c = [self.c0, self.c1, self.c0, self.c1];

        let mut ee = [L::splat(0.0); 6];
        let mut ff = [L::splat(0.0); 6];
        let mut ef = [[L::splat(0.0); 3]; 3];
        let ce: [V3<L>; 4] = [ge[0].scale(c[0]), ge[1].scale(c[1]), ge[2].scale(c[2]), ge[3].scale(c[3])];
        let cf: [V3<L>; 4] = [gf[0].scale(c[0]), gf[1].scale(c[1]), gf[2].scale(c[2]), gf[3].scale(c[3])];
        let (cme, cmf) = (gme.scale(self.cm), gmf.scale(self.cm));
        for (n, (i, j)) in SYMMETRIC.into_iter().enumerate() {
            ee[n] = ce[0].0[i] * ge[0].0[j]
                + ce[1].0[i] * ge[1].0[j]
                + (ce[2].0[i] * ge[2].0[j] + ce[3].0[i] * ge[3].0[j])
                + cme.0[i] * gme.0[j];
            ff[n] = cf[0].0[i] * gf[0].0[j]
                + cf[1].0[i] * gf[1].0[j]
                + (cf[2].0[i] * gf[2].0[j] + cf[3].0[i] * gf[3].0[j])
                + cmf.0[i] * gmf.0[j];
        }
        for i in 0..3 {
            for j in 0..3 {
                ef[i][j] = ce[0].0[i] * gf[0].0[j]
                    + ce[1].0[i] * gf[1].0[j]
                    + (ce[2].0[i] * gf[2].0[j] + ce[3].0[i] * gf[3].0[j])
                    + cme.0[i] * gmf.0[j];
            }
        }
        let zero = L::splat(0.0);
        let v = if EXACT { w } else { [zero; 4] };
        let (a0, a1) = (self.c0 * x.k[1] - v[1], v[0] - self.c1 * x.k[0]);
        let (a2, a3) = (self.c0 * x.k[3] - v[3], v[2] - self.c1 * x.k[2]);
        let e_te = ge[0].scale(a0) + ge[1].scale(a1) - cme;
        let f_te = gf[0].scale(a0) + gf[1].scale(a1) - cmf;
        let e_tf = ge[2].scale(a2) + ge[3].scale(a3) + cme;
        let f_tf = gf[2].scale(a2) + gf[3].scale(a3) + cmf;
        let tt = [
            self.c0 * x.k[1] * x.k[1] + self.c1 * x.k[0] * x.k[0] - v[0] * x.k[0] - v[1] * x.k[1] + self.cm,
            -self.cm,
            self.c0 * x.k[3] * x.k[3] + self.c1 * x.k[2] * x.k[2] - v[2] * x.k[2] - v[3] * x.k[3] + self.cm,
        ];

        if EXACT {
            let (iee, iff, ief) = (x.inv_le * x.inv_le, x.inv_lf * x.inv_lf, x.inv_le * x.inv_lf);
            let k_chi = p.k * x.inv_chi;
            let hw = half * wm;
            let re = p.pe - (te + x.tilde).scale(hw);
            let rf = p.pf - (tf + x.tilde).scale(hw);
            let (kb, tl) = (x.binormal, x.tilde);
            for (n, (i, j)) in SYMMETRIC.into_iter().enumerate() {
                let delta = if i == j { L::splat(1.0) } else { zero };
                ee[n] += iee
                    * (half * (kb.0[i] * re.0[j] + kb.0[j] * re.0[i])
                        - (p.qe.0[i] * tl.0[j] + p.qe.0[j] * tl.0[i])
                        - k_chi * (delta - te.0[i] * te.0[j]));
                ff[n] += iff
                    * (half * (kb.0[i] * rf.0[j] + kb.0[j] * rf.0[i])
                        - (p.qf.0[i] * tl.0[j] + p.qf.0[j] * tl.0[i])
                        - k_chi * (delta - tf.0[i] * tf.0[j]));
            }
            let left = p.qe + kb.scale(hw);
            let s = p.tilde - te.scale(wm * x.inv_chi);
            let skew = [[zero, -s.0[2], s.0[1]], [s.0[2], zero, -s.0[0]], [-s.0[1], s.0[0], zero]];
            for i in 0..3 {
                for j in 0..3 {
                    let delta = if i == j { L::splat(1.0) } else { zero };
                    ef[i][j] -= ief
                        * (tl.0[i] * p.qf.0[j]
                            + left.0[i] * tl.0[j]
                            + k_chi * (delta + te.0[i] * tf.0[j])
                            + skew[i][j]);
                }
            }
        }
        (gradient, ElementHessian { ee, ff, ef, e_te, e_tf, f_te, f_tf, tt })
    }
}

/// The weighted directors and what the gradient and Hessian share.
struct Weighted<L> {
    pe: V3<L>,
    pf: V3<L>,
    tilde: V3<L>,
    k: L,
    qe: V3<L>,
    qf: V3<L>,
}

impl<L: Lane> Weighted<L> {
    #[inline(always)]
    fn new(x: &CurvatureElement<L>, w: &[L; 4]) -> Self {
        let pe = x.m2e.scale(w[0]) - x.m1e.scale(w[1]);
        let pf = x.m2f.scale(w[2]) - x.m1f.scale(w[3]);
        let p = pe + pf;
        let k = x.binormal.dot(p);
        let tilde = p.scale(x.inv_chi + x.inv_chi);
        let kt = x.tilde.scale(k);
        Weighted { pe, pf, tilde, k, qe: x.tf.cross(tilde) - kt, qf: -(x.te.cross(tilde) + kt) }
    }

    #[inline(always)]
    fn gradient(&self, x: &CurvatureElement<L>, w: &[L; 4], wm: L) -> ElementGradient<L> {
        let twist = x.binormal.scale(L::splat(0.5) * wm);
        ElementGradient {
            e: (self.qe + twist).scale(x.inv_le),
            f: (self.qf + twist).scale(x.inv_lf),
            te: w[0] * x.k[1] - w[1] * x.k[0] - wm,
            tf: w[2] * x.k[3] - w[3] * x.k[2] + wm,
        }
    }
}

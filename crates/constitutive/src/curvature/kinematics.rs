//! From tangents and directors to the binormal, the four curvatures and the twist.

use numerics::lanes::{Lane, V3, atan2, sin_cos};
use numerics::transport::transport_normal;

/// Smallest admissible `χ = 1 + tᵉ·tᶠ` (a turn of 178.9°): the energy tends to infinity at 180°, so a trial state
/// beyond this is refused. The kinematics clamp χ to this value, so they stay finite whatever they are given.
pub const MIN_CHI: f64 = 1e-4;

/// One element: two unit tangents, the inverse edge lengths \[1/m\], the material directors, and what follows.
#[derive(Clone, Copy, Debug)]
pub struct CurvatureElement<L> {
    /// Unit tangent of the first edge.
    pub te: V3<L>,
    /// Unit tangent of the second edge.
    pub tf: V3<L>,
    /// Inverse length of the first edge \[1/m\].
    pub inv_le: L,
    /// Inverse length of the second edge \[1/m\].
    pub inv_lf: L,
    /// Material directors of the first edge.
    pub m1e: V3<L>,
    /// Second director of the first edge, `tᵉ × m1ᵉ`.
    pub m2e: V3<L>,
    /// Material directors of the second edge.
    pub m1f: V3<L>,
    /// Second director of the second edge, `tᶠ × m1ᶠ`.
    pub m2f: V3<L>,
    /// `χ = 1 + tᵉ·tᶠ` before clamping; below [`MIN_CHI`] the element is folded and its derivatives are not exact.
    pub chi: L,
    /// `1/χ`.
    pub inv_chi: L,
    /// Curvature binormal `2 tᵉ×tᶠ/χ`, of magnitude `2 tan(φ/2)` for a turn by φ.
    pub binormal: V3<L>,
    /// `(tᵉ + tᶠ)/χ`.
    pub tilde: V3<L>,
    /// The four curvatures `(m2ᵉ·κ, −m1ᵉ·κ, m2ᶠ·κ, −m1ᶠ·κ)`, dimensionless (integrated over the vertex).
    pub k: [L; 4],
}

impl<L: Lane> CurvatureElement<L> {
    /// Builds the element from tangents, inverse lengths and first material directors.
    #[inline(always)]
    pub fn new(te: V3<L>, tf: V3<L>, inv_le: L, inv_lf: L, e: (V3<L>, V3<L>), f: (V3<L>, V3<L>)) -> Self {
        let one = L::splat(1.0);
        let chi = one + te.dot(tf);
        let inv_chi = one / chi.max(L::splat(MIN_CHI));
        let binormal = te.cross(tf).scale(inv_chi + inv_chi);
        let tilde = (te + tf).scale(inv_chi);
        let k = [e.1.dot(binormal), -e.0.dot(binormal), f.1.dot(binormal), -f.0.dot(binormal)];
        Self { te, tf, inv_le, inv_lf, m1e: e.0, m2e: e.1, m1f: f.0, m2f: f.1, chi, inv_chi, binormal, tilde, k }
    }
}

/// Material directors `(m1, m2)` from the reference director `d1`, the tangent and the twist angle \[rad\]:
/// `m1 = cos θ d1 + sin θ d2`, `m2 = −sin θ d1 + cos θ d2`, `d2 = t × d1`.
#[inline(always)]
pub fn directors<L: Lane>(tangent: V3<L>, d1: V3<L>, theta: L) -> (V3<L>, V3<L>) {
    let (s, c) = sin_cos(theta);
    let d2 = tangent.cross(d1);
    (d1.scale(c) + d2.scale(s), d2.scale(c) - d1.scale(s))
}

/// Cosine and sine (times a common positive factor) of the angle from the transported director of the first edge to
/// the director of the second.
#[inline(always)]
pub fn reference_turn<L: Lane>(d1e: V3<L>, te: V3<L>, d1f: V3<L>, tf: V3<L>) -> (L, L) {
    let u = transport_normal(d1e, te, tf);
    (u.dot(d1f), u.cross(d1f).dot(tf))
}

/// Reference twist \[rad\]: the angle of [`reference_turn`], continued from `previous` by less than half a turn.
#[inline(always)]
pub fn reference_twist<L: Lane>(previous: L, d1e: V3<L>, te: V3<L>, d1f: V3<L>, tf: V3<L>) -> L {
    let (c, s) = reference_turn(d1e, te, d1f, tf);
    let (sp, cp) = sin_cos(previous);
    previous + atan2(s * cp - c * sp, c * cp + s * sp)
}

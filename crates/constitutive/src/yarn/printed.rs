//! The seed note's 2-D formulas as printed (errata E1 and E6), kept so that its trajectory can be reproduced and judged.

use nalgebra::SMatrix;

use super::frame::YarnFrame;
use super::law::YarnLaw;

/// The note's stress `Q A R⁻ᵀ` with `A = [[k(r₁₁−1), γ r₁₂], [γ r₁₂, M ln r₂₂ / r₂₂]]`, which is not the derivative of its energy.
pub(super) fn stress<const D: usize>(law: &YarnLaw, frame: &YarnFrame<D>) -> SMatrix<f64, D, D> {
    let (a, b, c) = (frame.stretch, frame.shear[0], frame.section[0].max(law.min_section));
    let a11 = law.stretch_modulus * (a - 1.0);
    let a12 = law.shear_modulus * b;
    let a22 = if c <= 1.0 { law.contact_modulus::<2>() * c.ln() / c } else { 0.0 };
    let (q1, q2) = (frame.tangent, frame.directions[0]);
    let lower = -b / (a * c);
    let mut stress = SMatrix::<f64, D, D>::zeros();
    stress.set_column(0, &(q1 * (a11 / a + a12 * lower) + q2 * (a12 / a + a22 * lower)));
    stress.set_column(1, &(q1 * (a12 / c) + q2 * (a22 / c)));
    stress
}

/// The note's bound on the shear, `c_f (1 − r₂₂)`.
pub(super) fn shear_bound(law: &YarnLaw, section: f64) -> f64 {
    (law.friction * (1.0 - section)).abs()
}

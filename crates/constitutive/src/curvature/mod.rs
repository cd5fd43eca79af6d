//! Curvature and twist energy of a polyline: one element is two consecutive edges.
//!
//! The element sees the edges `e`, `f` and the material directors on them. Its four curvatures are the components of
//! the curvature binormal in the directors of either edge; its twist is the turn of the directors about the tangent.
//!
//! ```text
//! kinematics  ── tangents, directors → binormal, four curvatures, twist of the reference directors
//! energy      ── quadratic law → energy, gradient, Hessian in the eight unknowns (e, f, θᵉ, θᶠ)
//! assembly    ── the same in the eleven unknowns (x₋, θᵉ, x₀, θᶠ, x₊) of three vertices; projection to definiteness
//! ```
//!
//! Everything is generic over [`Lane`](numerics::lanes::Lane): one element with `f64`, four with lanes.
//!
//! Source: Bergou et al. 2010 (time-parallel frames); Fei et al. 2019, supplemental S85–S105. Six of the printed
//! Hessians (S104a, b, g, n, s, t) are wrong; the forms used here are derived from the corrected ones and reduce, for
//! the weighted sum of all four curvatures, to one compact expression per block (see [`energy`]).

pub mod assembly;
pub mod energy;
pub mod kinematics;

pub use assembly::{project_positive, project_positive_lanes, vertex_gradient, vertex_hessian};
pub use energy::{CurvatureLaw, ElementGradient, ElementHessian};
pub use kinematics::{CurvatureElement, MIN_CHI, directors, reference_turn, reference_twist};

#[cfg(test)]
mod tests;

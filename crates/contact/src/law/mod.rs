//! The contact law at one contact: cone, projection, De Saxcé shift, natural map, state.
//!
//! Signorini–Coulomb: with relative velocity `u` and impulse `r` in the contact basis (normal first),
//! `K_{1/ν} ∋ u + ν‖u_T‖ e_N ⊥ r ∈ K_ν`, where `K_ν = {‖r_T‖ ≤ ν r_N}` (De Saxcé and Feng 1991). Cohesion shifts the
//! impulse: the law holds for `r + c_a e_N`.

pub mod coulomb;
pub mod fischer_burmeister;
pub mod jordan;

pub use coulomb::{ContactState, classify, de_saxce, natural_map, project_cone};

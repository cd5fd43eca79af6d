//! Laws of one material point or one element: liquid rheology, drag, curvature energy, yarn energy.

pub mod curvature;

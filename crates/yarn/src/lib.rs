//! Yarns by the material point method with anisotropic elastoplasticity.

//! The bulk liquid: particles, MAC fields, shear and pressure solves, resampling.

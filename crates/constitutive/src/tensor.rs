//! The two small-matrix helpers of the liquid law that the common ones do not have.

pub(crate) use numerics::eigen::{largest_eigenvalue, polar_rotation, symmetric_eigen};
pub(crate) use numerics::tensor::{Tensor, determinant, double_contraction as contract, inverse, symmetric_part};
use numerics::tensor::{dimension_root, trace};

/// Deviator `m − tr(m)/D I` and mean `tr(m)/D`.
#[inline]
pub(crate) fn deviator<const D: usize>(m: &Tensor<D>) -> (Tensor<D>, f64) {
    let mean = trace(m) / D as f64;
    let mut dev = *m;
    for i in 0..D {
        dev[(i, i)] -= mean;
    }
    (dev, mean)
}

/// `x^{-1/D}`.
#[inline]
pub(crate) fn inverse_root<const D: usize>(x: f64) -> f64 {
    1.0 / dimension_root::<D>(x)
}

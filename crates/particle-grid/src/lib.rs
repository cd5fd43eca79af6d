//! Sparse blocked grids, B-spline transfers and particle sorting.

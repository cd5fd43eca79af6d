//! Jordan algebra of the second-order cone in three dimensions: product, arrow matrix, spectral values, square root.
//!
//! `x ∘ y = [x·y; x_N y_T + y_N x_T]`; the cone is the set of squares; spectral values of `w` are `w_N ∓ ‖w_T‖`.

use crate::block::{Block, Vec3, dot, tangential_norm};

/// The Jordan product `x ∘ y`.
#[inline]
#[must_use]
pub fn product(x: &Vec3, y: &Vec3) -> Vec3 {
    [dot(x, y), x[0] * y[1] + y[0] * x[1], x[0] * y[2] + y[0] * x[2]]
}

/// The arrow matrix `L_x` with `L_x y = x ∘ y`.
#[inline]
#[must_use]
pub fn arrow(x: &Vec3) -> Block {
    [x[0], x[1], x[2], x[1], x[0], 0.0, x[2], 0.0, x[0]]
}

/// Spectral values `(w_N − ‖w_T‖, w_N + ‖w_T‖)`.
#[inline]
#[must_use]
pub fn spectral_values(w: &Vec3) -> (f64, f64) {
    let t = tangential_norm(w);
    (w[0] - t, w[0] + t)
}

/// Square root of an element of the cone; spectral values below zero (round-off) count as zero.
#[inline]
#[must_use]
pub fn square_root(w: &Vec3) -> Vec3 {
    let t = tangential_norm(w);
    let a = (w[0] - t).max(0.0).sqrt();
    let b = (w[0] + t).max(0.0).sqrt();
    let (d1, d2) = if t > 0.0 { (w[1] / t, w[2] / t) } else { (1.0, 0.0) };
    [0.5 * (a + b), 0.5 * (b - a) * d1, 0.5 * (b - a) * d2]
}

/// Spectral values of `x∘x + y∘y` and the unit direction of its tangential part.
///
/// The smaller one is not formed by subtraction, which loses half the digits when a slipping pair has very different
/// sizes, but as a quotient of terms that stay accurate at any ratio.
#[inline]
#[must_use]
pub fn sum_of_squares_spectrum(x: &Vec3, y: &Vec3) -> (f64, f64, [f64; 2]) {
    let xx = dot(x, x);
    let yy = dot(y, y);
    let t = [0.0, 2.0 * (x[0] * x[1] + y[0] * y[1]), 2.0 * (x[0] * x[2] + y[0] * y[2])];
    let n = tangential_norm(&t);
    let large = xx + yy + n;
    let xt = tangential_norm(x);
    let yt = tangential_norm(y);
    let dx = (x[0] - xt) * (x[0] + xt);
    let dy = (y[0] - yt) * (y[0] + yt);
    // |x|²|y|² − 4 x_N y_N x_T·y_T regrouped into squares so that nothing cancels when x and y are complementary:
    // = x_N² y_N² + x_N²|y_T|² + |x_T|² y_N² + |x_T|²|y_T|² − 4 x_N y_N x_T·y_T
    //   = (x_N y_N − x_T·y_T)² + |x_N y_T − y_N x_T|² + (x_T × y_T)²
    let a = x[0] * y[0] - x[1] * y[1] - x[2] * y[2];
    let b1 = x[0] * y[1] - y[0] * x[1];
    let b2 = x[0] * y[2] - y[0] * x[2];
    let c = x[1] * y[2] - x[2] * y[1];
    let cross = a * a + b1 * b1 + b2 * b2 + c * c;
    let numerator = dx * dx + dy * dy + 2.0 * cross;
    let small = if large > 0.0 { numerator / large } else { 0.0 };
    let direction = if n > 0.0 { [t[1] / n, t[2] / n] } else { [1.0, 0.0] };
    (small, large, direction)
}

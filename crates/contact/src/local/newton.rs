//! Damped Newton iteration on the Fischer–Burmeister form of one contact, from a warm start.

use crate::block::{Block, Vec3, invert, mat_mul, mat_vec, norm_squared, tangential_norm, transpose_vec};
use crate::law::fischer_burmeister::{linearise, value};

/// `F(r)` for one contact, scaled so that impulse and velocity have one unit.
///
/// `x = (r_N, r_T/ν)`, `y = ρ (u_N + ν‖u_T‖, ν u_T)`: both in the self-dual cone; the scaling stays regular as `ν → 0`.
#[inline]
fn pair(w: &Block, b: &Vec3, nu: f64, rho: f64, r: &Vec3) -> (Vec3, Vec3, Vec3) {
    let mut u = mat_vec(w, r);
    for i in 0..3 {
        u[i] += b[i];
    }
    let x = [r[0], r[1] / nu, r[2] / nu];
    let y = [rho * (u[0] + nu * tangential_norm(&u)), rho * nu * u[1], rho * nu * u[2]];
    (x, y, u)
}

/// Refines `start`; returns the iterate, the norm of `F` there [N s] and the iterations used.
///
/// - `rho`: weight of the velocity [kg]
/// - `tolerance`: on the norm of `F` [N s]
///
/// The merit `½‖F‖²` has gradient `Jᵀ F`; steps are halved until Armijo's condition holds.
#[must_use]
pub fn refine(
    w: &Block,
    b: &Vec3,
    nu: f64,
    rho: f64,
    start: &Vec3,
    tolerance: f64,
    max_iterations: usize,
) -> (Vec3, f64, usize) {
    let mut r = *start;
    let (x, y, mut u) = pair(w, b, nu, rho, &r);
    let mut lin = linearise(&x, &y, 0.0);
    let mut norm = norm_squared(&lin.value).sqrt();
    let mut iterations = 0;
    while iterations < max_iterations && norm > tolerance {
        iterations += 1;
        // chain rule: ∂x = diag(1, 1/ν, 1/ν), ∂y = ρ diag(1, ν, ν) (I + ν e_N (0, u_T/‖u_T‖)ᵀ) W
        let t = tangential_norm(&u);
        let mut dy = [0.0; 9];
        for j in 0..3 {
            let mut top = w[j];
            if t > 0.0 {
                top += nu * (u[1] * w[3 + j] + u[2] * w[6 + j]) / t;
            }
            dy[j] = rho * top;
            dy[3 + j] = rho * nu * w[3 + j];
            dy[6 + j] = rho * nu * w[6 + j];
        }
        let mut jacobian = mat_mul(&lin.by_y, &dy);
        for i in 0..3 {
            jacobian[3 * i] += lin.by_x[3 * i];
            jacobian[3 * i + 1] += lin.by_x[3 * i + 1] / nu;
            jacobian[3 * i + 2] += lin.by_x[3 * i + 2] / nu;
        }
        let gradient = transpose_vec(&jacobian, &lin.value);
        let step = match invert(&jacobian, 0.0) {
            Some(inverse) => mat_vec(&inverse, &lin.value),
            None => gradient,
        };
        let slope = gradient[0] * step[0] + gradient[1] * step[1] + gradient[2] * step[2];
        let mut factor = 1.0;
        let mut accepted = false;
        for _ in 0..9 {
            let trial = [r[0] - factor * step[0], r[1] - factor * step[1], r[2] - factor * step[2]];
            let (x, y, ut) = pair(w, b, nu, rho, &trial);
            let n = norm_squared(&value(&x, &y, 0.0));
            if n <= norm * norm - 2e-4 * factor * slope.abs().min(norm * norm) {
                r = trial;
                u = ut;
                lin = linearise(&x, &y, 0.0);
                norm = n.sqrt();
                accepted = true;
                break;
            }
            factor *= 0.5;
        }
        if !accepted {
            break;
        }
    }
    (r, norm, iterations)
}

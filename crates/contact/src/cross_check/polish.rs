//! The last digits of the second opinion.
//!
//! An interior-point method leaves velocities with the square root of its gap, about 1e-7. Which contacts are open, stick
//! and slip it knows well, and with that known the law is a smooth system: a few dense Newton steps of least change
//! from the cone solver's answer end at the solution it stands beside. Shares nothing with the production solvers.

use crate::block::{Vec3, norm_squared, trace};
use crate::law::de_saxce;
use crate::problem::{BlockMatrix, ContactProblem, Violation};
use nalgebra::{DMatrix, DVector};

/// Most Newton steps.
const STEPS: usize = 12;
/// Relative damping of the normal equations, for impulses that are not unique.
const DAMPING: f64 = 1e-13;

#[derive(Clone, Copy, PartialEq)]
enum Mode {
    Open,
    Stick,
    Slip,
}

/// The largest violation of the law by any contact.
pub(super) fn violation(w: &BlockMatrix, friction: &[f64], r: &[Vec3], u: &[Vec3]) -> f64 {
    (0..r.len())
        .map(|k| Violation::of(&r[k], &u[k], friction[k], trace(w.diagonal(k)) / 3.0).worst())
        .fold(0.0, f64::max)
}

/// Improves `r` and `u = W r + q` (scaled to order one) with the modes held; keeps the best and returns its violation.
pub(super) fn polish(w: &BlockMatrix, q: &[Vec3], friction: &[f64], r: &mut [Vec3], u: &mut [Vec3]) -> f64 {
    let n = r.len();
    let modes: Vec<Mode> = (0..n).map(|k| mode(&r[k], &u[k], friction[k])).collect();
    let mut best = violation(w, friction, r, u);
    let (mut x, mut v) = (r.to_vec(), u.to_vec());
    for _ in 0..STEPS {
        // derivative of the velocities of contact k: rows of W
        let mut jacobian = DMatrix::<f64>::zeros(3 * n, 3 * n);
        let mut rest = DVector::<f64>::zeros(3 * n);
        for (k, l, b) in w.iter() {
            let weight = weights(modes[k], &x[k], &v[k], friction[k]);
            for i in 0..3 {
                for j in 0..3 {
                    jacobian[(3 * k + i, 3 * l + j)] += (0..3).map(|c| weight[i][c] * b[3 * c + j]).sum::<f64>();
                }
            }
        }
        for k in 0..n {
            let speed = v[k][1].hypot(v[k][2]);
            let t = if speed > 0.0 { [v[k][1] / speed, v[k][2] / speed] } else { [0.0; 2] };
            let nu = friction[k];
            let f = match modes[k] {
                Mode::Open => x[k],
                Mode::Stick => v[k],
                Mode::Slip => [v[k][0], x[k][1] + nu * x[k][0] * t[0], x[k][2] + nu * x[k][0] * t[1]],
            };
            for i in 0..3 {
                rest[3 * k + i] = f[i];
            }
            match modes[k] {
                Mode::Open => (0..3).for_each(|i| jacobian[(3 * k + i, 3 * k + i)] += 1.0),
                Mode::Stick => {}
                Mode::Slip => {
                    for i in 1..3 {
                        jacobian[(3 * k + i, 3 * k + i)] += 1.0;
                        jacobian[(3 * k + i, 3 * k)] += nu * t[i - 1];
                    }
                }
            }
        }
        let gradient = jacobian.tr_mul(&rest);
        let mut normal = jacobian.tr_mul(&jacobian);
        let shift = DAMPING * normal.trace() / (3 * n) as f64;
        (0..3 * n).for_each(|i| normal[(i, i)] += shift);
        let Some(factor) = normal.cholesky() else { return best };
        let step = factor.solve(&gradient);
        for k in 0..n {
            for i in 0..3 {
                x[k][i] -= step[3 * k + i];
            }
        }
        w.apply(&x, q, &mut v);
        let now = violation(w, friction, &x, &v);
        if !now.is_finite() {
            return best;
        }
        if now < best {
            r.copy_from_slice(&x);
            u.copy_from_slice(&v);
            let enough = now > 0.5 * best || now < 1e-14;
            best = now;
            if enough {
                return best;
            }
        }
    }
    best
}

/// Takes an answer to the law's last digits by Newton steps with its modes held, which share nothing with the solver that
/// gave it. Returns the impulses (cohesive shift not included) and their largest violation of the law, relative to the
/// root mean square of the free velocities: near round-off, the answer stands beside a solution.
#[must_use]
pub fn refine(problem: &ContactProblem, impulses: &[Vec3]) -> (Vec<Vec3>, f64) {
    let n = problem.len();
    let d = super::dual::unit_scaling(problem);
    let triplets: Vec<_> =
        problem.delassus.iter().map(|(i, j, b)| (i as u32, j as u32, b.map(|v| v * d[i] * d[j]))).collect();
    let w = BlockMatrix::from_triplets(n, &triplets);
    let shifted = problem.shifted_velocity();
    let total: f64 = (0..n).map(|k| d[k] * d[k] * norm_squared(&shifted[k])).sum();
    let size = if total > 0.0 { (total / n as f64).sqrt() } else { 1.0 };
    let q: Vec<Vec3> = (0..n).map(|k| shifted[k].map(|v| v * d[k] / size)).collect();
    let mut r: Vec<Vec3> = (0..n)
        .map(|k| {
            let mut r = impulses[k];
            r[0] += problem.cohesion_of(k);
            r.map(|v| v / (d[k] * size))
        })
        .collect();
    let mut u = vec![[0.0; 3]; n];
    w.apply(&r, &q, &mut u);
    let violation = polish(&w, &q, &problem.friction, &mut r, &mut u);
    for (k, r) in r.iter_mut().enumerate() {
        *r = r.map(|v| v * d[k] * size);
        r[0] -= problem.cohesion_of(k);
    }
    (r, violation)
}

/// The side of the cone on which `r − ũ` lies tells the mode.
fn mode(r: &Vec3, u: &Vec3, nu: f64) -> Mode {
    if nu < 0.0 {
        return Mode::Stick;
    }
    let shifted = de_saxce(u, nu);
    let z = [r[0] - shifted[0], r[1] - shifted[1], r[2] - shifted[2]];
    let t = z[1].hypot(z[2]);
    if nu * t <= -z[0] {
        Mode::Open
    } else if t <= nu * z[0] {
        Mode::Stick
    } else {
        Mode::Slip
    }
}

/// Derivative of a contact's three equations by its velocity.
fn weights(mode: Mode, r: &Vec3, u: &Vec3, nu: f64) -> [[f64; 3]; 3] {
    match mode {
        Mode::Open => [[0.0; 3]; 3],
        Mode::Stick => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        Mode::Slip => {
            let speed = u[1].hypot(u[2]);
            if speed == 0.0 {
                return [[1.0, 0.0, 0.0], [0.0; 3], [0.0; 3]];
            }
            let (a, b) = (u[1] / speed, u[2] / speed);
            let s = nu * r[0] / speed;
            [[1.0, 0.0, 0.0], [0.0, s * b * b, -s * a * b], [0.0, -s * a * b, s * a * a]]
        }
    }
}

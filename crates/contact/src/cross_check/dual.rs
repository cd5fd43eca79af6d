//! The dual form: impulses unknown, `min ½ rᵀW r + (q + ς e_N)ᵀ r` over the product of Coulomb cones.

use super::outer::{ConvexSolve, OracleAnswer, OracleError, OracleSettings, fixed_point};
use super::polish::polish;
use crate::block::{Vec3, norm_squared, trace};
use crate::problem::{BlockMatrix, ContactProblem, Scaling, residual};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSettingsBuilder, DefaultSolver, IPSolver, NonnegativeConeT, SecondOrderConeT, SolverStatus,
    SupportedConeT, ZeroConeT,
};

/// Matrix entries by row and column.
type Entries = Vec<(usize, usize, f64)>;

/// Violation of the law, in velocities of order one, at which an answer counts as exact however the fixed point ended.
const SETTLED: f64 = 1e-10;

/// Largest relative asymmetry that counts as round-off.
const SYMMETRIC: f64 = 1e-10;

/// Settings that Clarabel needs here: quiet, no presolve (the data are updated), strict tolerances.
pub(super) fn clarabel_settings(tolerance: f64) -> Result<DefaultSettings<f64>, OracleError> {
    DefaultSettingsBuilder::default()
        .verbose(false)
        .presolve_enable(false)
        .tol_gap_abs(tolerance)
        .tol_gap_rel(tolerance)
        .tol_feas(tolerance)
        .max_iter(200)
        .build()
        .map_err(|e| OracleError::Refused(e.to_string()))
}

/// A sparse column matrix from triplets (sorted and summed here).
pub(super) fn csc(rows: usize, columns: usize, mut t: Vec<(usize, usize, f64)>) -> CscMatrix<f64> {
    t.sort_unstable_by_key(|(i, j, _)| (*j, *i));
    let mut colptr = vec![0; columns + 1];
    let mut rowval: Vec<usize> = Vec::with_capacity(t.len());
    let mut nzval: Vec<f64> = Vec::with_capacity(t.len());
    let mut last = (usize::MAX, usize::MAX);
    for (i, j, v) in t {
        if last == (i, j) {
            if let Some(x) = nzval.last_mut() {
                *x += v;
            }
        } else {
            rowval.push(i);
            nzval.push(v);
            colptr[j + 1] += 1;
            last = (i, j);
        }
    }
    for j in 0..columns {
        colptr[j + 1] += colptr[j];
    }
    CscMatrix::new(rows, columns, colptr, rowval, nzval)
}

struct Dual {
    /// Strict first, then as asked.
    solvers: [DefaultSolver<f64>; 3],
    w: BlockMatrix,
    q: Vec<Vec3>,
    linear: Vec<f64>,
}

impl ConvexSolve for Dual {
    fn solve(&mut self, shift: &[f64], r: &mut [Vec3], u: &mut [Vec3]) -> bool {
        for k in 0..self.q.len() {
            self.linear[3 * k..3 * k + 3].copy_from_slice(&self.q[k]);
            self.linear[3 * k] += shift[k];
        }
        let mut solved = None;
        for (i, solver) in self.solvers.iter_mut().enumerate() {
            if solver.update_q(&self.linear).is_err() {
                return false;
            }
            solver.solve();
            if solver.solution.status == SolverStatus::Solved {
                solved = Some(i);
                break;
            }
        }
        let Some(i) = solved else { return false };
        let solution = &self.solvers[i].solution;
        for (k, v) in r.iter_mut().enumerate() {
            v.copy_from_slice(&solution.x[3 * k..3 * k + 3]);
        }
        self.w.apply(r, &self.q, u);
        true
    }
}

/// Rows `s = −A x` that put an impulse into its cone; returns the cones in order.
pub(super) fn cone_rows(friction: &[f64]) -> (Entries, Vec<SupportedConeT<f64>>, usize) {
    let mut t = Vec::new();
    let mut cones = Vec::new();
    let mut row = 0;
    for (k, nu) in friction.iter().enumerate() {
        if *nu < 0.0 {
            continue;
        }
        if *nu < 1e-9 {
            t.push((row, 3 * k, -1.0));
            t.push((row + 1, 3 * k + 1, -1.0));
            t.push((row + 2, 3 * k + 2, -1.0));
            cones.push(NonnegativeConeT(1));
            cones.push(ZeroConeT(2));
        } else {
            t.push((row, 3 * k, -*nu));
            t.push((row + 1, 3 * k + 1, -1.0));
            t.push((row + 2, 3 * k + 2, -1.0));
            cones.push(SecondOrderConeT(3));
        }
        row += 3;
    }
    (t, cones, row)
}

/// Solves the problem independently and to the exact Coulomb law, from nothing (`ς = 0`).
///
/// Coulomb's law may have several solutions (a wedge may stick or slide): where this one differs from another, ask
/// [`certify`] whether the other is a solution too.
///
/// # Errors
/// If `W` is not symmetric (the convex form does not exist then) or the data are refused.
pub fn cross_check(problem: &ContactProblem, settings: &OracleSettings) -> Result<OracleAnswer, OracleError> {
    solve_from(problem, settings, None)
}

/// Lets the cone solver confirm a solution: the convex problem with the shift `ς = ν‖u_T‖` of `velocities` must give these
/// velocities back. The answer is that of the convex solve; compare its velocities.
///
/// # Errors
/// As [`cross_check`].
pub fn certify(
    problem: &ContactProblem,
    velocities: &[Vec3],
    settings: &OracleSettings,
) -> Result<OracleAnswer, OracleError> {
    let mut answer = solve_from(problem, &OracleSettings { max_outer: 1, ..*settings }, Some(velocities))?;
    if answer.status == numerics::Status::MaxIterations {
        answer.status = numerics::Status::Converged;
    }
    Ok(answer)
}

fn solve_from(
    problem: &ContactProblem,
    settings: &OracleSettings,
    start: Option<&[Vec3]>,
) -> Result<OracleAnswer, OracleError> {
    let n = problem.len();
    let asymmetry = problem.delassus.asymmetry();
    if asymmetry > SYMMETRIC {
        return Err(OracleError::NotSymmetric(asymmetry));
    }
    let shifted = problem.shifted_velocity();
    // scaled to order one, contact by contact: the cones do not change
    let d = unit_scaling(problem);
    let total: f64 = (0..n).map(|k| d[k] * d[k] * norm_squared(&shifted[k])).sum();
    let size = if total > 0.0 { (total / n as f64).sqrt() } else { 1.0 };
    let triplets: Vec<_> =
        problem.delassus.iter().map(|(i, j, b)| (i as u32, j as u32, b.map(|v| v * d[i] * d[j]))).collect();
    let w = BlockMatrix::from_triplets(n, &triplets);
    let q: Vec<Vec3> = (0..n).map(|k| shifted[k].map(|v| v * d[k] / size)).collect();
    let mut upper = Vec::new();
    for (i, j, b) in w.iter() {
        for r in 0..3 {
            for c in 0..3 {
                let (gi, gj) = (3 * i + r, 3 * j + c);
                if gi <= gj {
                    upper.push((gi, gj, b[3 * r + c]));
                }
            }
        }
    }
    let p = csc(3 * n, 3 * n, upper);
    let (rows, cones, m) = cone_rows(&problem.friction);
    let a = csc(m, 3 * n, rows);
    let linear = vec![0.0; 3 * n];
    let rhs = vec![0.0; m];
    let build = |tolerance: f64| {
        DefaultSolver::new(&p, &linear, &a, &rhs, &cones, clarabel_settings(tolerance)?)
            .map_err(|e| OracleError::Refused(e.to_string()))
    };
    let solvers = [build(0.01 * settings.tolerance)?, build(0.1 * settings.tolerance)?, build(settings.tolerance)?];
    let mut dual = Dual { solvers, w, q, linear };
    let mut r = vec![[0.0; 3]; n];
    let mut u = vec![[0.0; 3]; n];
    if let Some(start) = start {
        for k in 0..n {
            u[k] = start[k].map(|v| v * d[k] / size);
        }
    }
    let (mut status, outer_iterations, shift_change) =
        fixed_point(&mut dual, &problem.friction, settings, &mut r, &mut u);
    // the convex model alone (one outer iteration) is not a solution of the exact law and stays as it is
    if settings.max_outer > 1 && polish(&dual.w, &dual.q, &problem.friction, &mut r, &mut u) <= SETTLED {
        status = numerics::Status::Converged;
    }
    for k in 0..n {
        r[k] = r[k].map(|v| v * d[k] * size);
        u[k] = u[k].map(|v| v * size / d[k]);
    }
    let residual = residual(&problem.delassus, &shifted, &problem.friction, &r, Scaling::PerContact);
    for (k, v) in r.iter_mut().enumerate() {
        v[0] -= problem.cohesion_of(k);
    }
    Ok(OracleAnswer { status, impulses: r, velocities: u, outer_iterations, shift_change, residual })
}

/// The relaxed convex model (associated friction, `ς = 0`): sliding contacts lift off with `u_N = ν‖u_T‖`. Its error is
/// what exact Coulomb avoids.
///
/// # Errors
/// As [`cross_check`].
pub fn convex_model(problem: &ContactProblem, settings: &OracleSettings) -> Result<OracleAnswer, OracleError> {
    let mut answer = cross_check(problem, &OracleSettings { max_outer: 1, ..*settings })?;
    if answer.status == numerics::Status::MaxIterations {
        // the convex problem itself was solved; the shift was not asked to settle
        answer.status = numerics::Status::Converged;
    }
    Ok(answer)
}

/// Factors that bring every contact to order one, `1/√(tr W_kk / 3)`; that of the mean where a block is next to nothing.
pub(super) fn unit_scaling(problem: &ContactProblem) -> Vec<f64> {
    let mean = problem.delassus.mean_diagonal();
    (0..problem.len())
        .map(|k| {
            let own = trace(problem.delassus.diagonal(k)) / 3.0;
            1.0 / (if own > 1e-12 * mean { own } else { mean.max(f64::MIN_POSITIVE) }).sqrt()
        })
        .collect()
}

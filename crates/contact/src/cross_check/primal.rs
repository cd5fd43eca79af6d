//! The primal form: velocities unknown, `min ½ vᵀK v − (f − Hᵀc)ᵀ v` with every contact velocity in its dual cone.

use super::dual::{clarabel_settings, csc};
use super::outer::{ConvexSolve, OracleAnswer, OracleError, OracleSettings, fixed_point};
use crate::block::{Vec3, norm_squared};
use crate::law::natural_map;
use clarabel::solver::{DefaultSolver, IPSolver, SecondOrderConeT, SolverStatus, SupportedConeT};

/// A contact problem by its dynamics: `K v = f + Hᵀ r`, `u = H v + w`.
#[derive(Clone, Debug, PartialEq)]
pub struct PrimalProblem {
    /// Degrees of freedom.
    pub dofs: usize,
    /// Upper triangle of the symmetric positive definite `K`, as `(row, column, value)` [kg].
    pub stiffness: Vec<(usize, usize, f64)>,
    /// Right-hand side `f` [N s].
    pub force: Vec<f64>,
    /// Contact Jacobian `H` as `(3·contact + component, dof, value)`.
    pub jacobian: Vec<(usize, usize, f64)>,
    /// Prescribed velocity `w` [m/s].
    pub prescribed: Vec<Vec3>,
    /// Friction, positive.
    pub friction: Vec<f64>,
    /// Cohesive bounds [N s], or empty.
    pub cohesion: Vec<f64>,
}

struct Primal<'a> {
    problem: &'a PrimalProblem,
    /// Strict first, then as asked.
    solvers: [DefaultSolver<f64>; 3],
    b: Vec<f64>,
    velocity_unit: f64,
    impulse_unit: f64,
}

impl ConvexSolve for Primal<'_> {
    fn solve(&mut self, shift: &[f64], r: &mut [Vec3], u: &mut [Vec3]) -> bool {
        let p = self.problem;
        for (k, w) in p.prescribed.iter().enumerate() {
            let nu = p.friction[k];
            self.b[3 * k] = w[0] / self.velocity_unit + shift[k];
            self.b[3 * k + 1] = nu * w[1] / self.velocity_unit;
            self.b[3 * k + 2] = nu * w[2] / self.velocity_unit;
        }
        let mut solved = None;
        for (i, solver) in self.solvers.iter_mut().enumerate() {
            if solver.update_b(&self.b).is_err() {
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
        let (v, z) = (&solution.x, &solution.z);
        for k in 0..r.len() {
            let nu = p.friction[k];
            u[k] = p.prescribed[k].map(|w| w / self.velocity_unit);
            r[k] = [z[3 * k], nu * z[3 * k + 1], nu * z[3 * k + 2]];
        }
        for (row, dof, value) in &p.jacobian {
            u[row / 3][row % 3] += value * v[*dof];
        }
        true
    }
}

/// Solves by the velocities and to the exact Coulomb law.
///
/// # Errors
/// If the data are refused, or a friction coefficient is not positive (the primal cone degenerates then).
pub fn cross_check_primal(problem: &PrimalProblem, settings: &OracleSettings) -> Result<OracleAnswer, OracleError> {
    let n = problem.friction.len();
    if problem.friction.iter().any(|nu| !(*nu > 0.0)) {
        return Err(OracleError::Refused("friction must be positive in the primal form".into()));
    }
    let cohesion = |k: usize| problem.cohesion.get(k).copied().unwrap_or(0.0);
    // scaled to order one: mean of the diagonal of K, size of the prescribed and free velocities
    let diagonal: Vec<f64> = problem.stiffness.iter().filter(|(i, j, _)| i == j).map(|(_, _, v)| *v).collect();
    let mass = (diagonal.iter().sum::<f64>() / diagonal.len().max(1) as f64).max(f64::MIN_POSITIVE);
    let mut f = problem.force.clone();
    for (row, dof, value) in &problem.jacobian {
        if row % 3 == 0 {
            f[*dof] -= value * cohesion(row / 3);
        }
    }
    let force_size = (f.iter().map(|v| v * v).sum::<f64>() / problem.dofs.max(1) as f64).sqrt() / mass;
    let prescribed_size = (problem.prescribed.iter().map(norm_squared).sum::<f64>() / n.max(1) as f64).sqrt();
    let velocity_unit = if force_size + prescribed_size > 0.0 { force_size + prescribed_size } else { 1.0 };
    let impulse_unit = mass * velocity_unit;
    let p = csc(problem.dofs, problem.dofs, problem.stiffness.iter().map(|(i, j, v)| (*i, *j, v / mass)).collect());
    let linear: Vec<f64> = f.iter().map(|v| -v / impulse_unit).collect();
    let rows = problem
        .jacobian
        .iter()
        .map(|(row, dof, value)| (*row, *dof, -value * if row % 3 == 0 { 1.0 } else { problem.friction[row / 3] }))
        .collect();
    let a = csc(3 * n, problem.dofs, rows);
    let cones: Vec<SupportedConeT<f64>> = (0..n).map(|_| SecondOrderConeT(3)).collect();
    let b = vec![0.0; 3 * n];
    let build = |tolerance: f64| {
        DefaultSolver::new(&p, &linear, &a, &b, &cones, clarabel_settings(tolerance)?)
            .map_err(|e| OracleError::Refused(e.to_string()))
    };
    let solvers = [build(0.01 * settings.tolerance)?, build(0.1 * settings.tolerance)?, build(settings.tolerance)?];
    let mut primal = Primal { problem, solvers, b, velocity_unit, impulse_unit };
    let mut r = vec![[0.0; 3]; n];
    let mut u = vec![[0.0; 3]; n];
    let (status, outer_iterations, shift_change) =
        fixed_point(&mut primal, &problem.friction, settings, &mut r, &mut u);
    // exact-law residual in the scaled numbers, where K has unit diagonal and so ρ is of order one
    let (mut map, mut size) = (0.0, 0.0_f64);
    let (mut rr, mut uu) = (0.0, 0.0);
    for k in 0..n {
        map += norm_squared(&natural_map(&r[k], &u[k], problem.friction[k], 1.0));
        rr += norm_squared(&r[k]);
        uu += norm_squared(&u[k]);
    }
    size = size.max(rr).max(uu);
    let residual = if size > 0.0 { (map / size).sqrt() } else { map.sqrt() };
    let impulse_unit = primal.impulse_unit;
    for k in 0..n {
        r[k] = r[k].map(|v| v * impulse_unit);
        u[k] = u[k].map(|v| v * velocity_unit);
        r[k][0] -= cohesion(k);
    }
    Ok(OracleAnswer { status, impulses: r, velocities: u, outer_iterations, shift_change, residual })
}

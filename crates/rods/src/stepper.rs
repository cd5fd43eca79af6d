//! The implicit step of all strands: solve, look, correct, accept.

use crate::boundary::Boundary;
use crate::error::RodError;
use crate::group::{FixedDof, GoalSpring, Group, HistoryMut, LaneReport, Scheme, StrandMut, group_strands};
use crate::kernel::W;
use crate::loads::Loads;
use crate::newton::Scratch;
use crate::report::{RodReport, StepLimit, StepReason};
use crate::settings::{Integrator, RodSettings};
use crate::state::{History, RodSet};
use nalgebra::Vector3;
use numerics::Status;
use numerics::banded::Band;
use numerics::lanes::F4;
use rayon::prelude::*;
use std::sync::Mutex;

/// Advances strands by implicit steps. Holds scratch memory and the last solution, no physics.
///
/// A step is [`advance`](Self::advance), or its parts: [`solve`](Self::solve) without contact; then, if needed,
/// [`prepare_factors`](Self::prepare_factors), [`strand_inverse`](Self::strand_inverse) for Delassus columns, and
/// [`resolve`](Self::resolve) or [`correct`](Self::correct) with contact impulses; then [`accept`](Self::accept). Until `accept` the
/// strands are untouched, so a step that is refused costs nothing but its time.
///
/// Strands are worked four at a time in vector lanes and the groups in parallel; a strand's bits depend on neither.
pub struct RodStepper {
    /// Settings of the next solve.
    pub settings: RodSettings,
    groups: Vec<Group>,
    /// Group and lane of each strand.
    place: Vec<(usize, usize)>,
    layout: Vec<usize>,
    scheme: Option<Scheme>,
    pool: Mutex<Vec<Scratch>>,
}

/// The inverse of one strand's step matrix `K` (velocity from impulse), with prescribed entries at zero.
///
/// Unknowns are ordered `4 i + c` for component `c` of vertex `i` and `4 j + 3` for the angle of edge `j`; the very
/// last entry has no meaning.
#[derive(Clone, Debug)]
pub struct StrandInverse {
    factor: Band<W>,
    fixed: Vec<usize>,
    scale: f64,
}

impl StrandInverse {
    /// Number of unknowns, four per vertex.
    #[must_use]
    pub fn len(&self) -> usize {
        self.factor.columns.len()
    }

    /// Whether there are no unknowns.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.factor.columns.is_empty()
    }

    /// Turns an impulse \[N s\] (angles: N m s) into the change of velocity \[m/s\] (angles: rad/s), in place.
    pub fn apply(&self, x: &mut [f64]) {
        for &d in &self.fixed {
            x[d] = 0.0;
        }
        self.factor.solve(x);
        for v in x {
            *v *= self.scale;
        }
    }

    /// [`apply`](Self::apply) for four impulses at once, one per lane.
    pub fn apply_four(&self, x: &mut [F4]) {
        for &d in &self.fixed {
            x[d] = F4::ZERO;
        }
        self.factor.solve_four(x);
        for v in x {
            for l in 0..4 {
                v[l] *= self.scale;
            }
        }
    }
}

impl RodStepper {
    /// A stepper with checked settings.
    pub fn new(settings: RodSettings) -> Result<Self, RodError> {
        settings.check()?;
        Ok(Self {
            settings,
            groups: Vec::new(),
            place: Vec::new(),
            layout: Vec::new(),
            scheme: None,
            pool: Mutex::new(Vec::new()),
        })
    }

    /// Solves one step of length `dt` \[s\] and accepts it.
    pub fn advance(
        &mut self,
        rods: &mut RodSet,
        dt: f64,
        loads: &Loads,
        boundary: &Boundary,
    ) -> Result<RodReport, RodError> {
        let report = self.solve(rods, dt, loads, boundary)?;
        self.accept(rods)?;
        Ok(report)
    }

    /// Solves one step of length `dt` \[s\] without accepting it. The solution is read by [`velocity`](Self::velocity).
    pub fn solve(&mut self, rods: &RodSet, dt: f64, loads: &Loads, boundary: &Boundary) -> Result<RodReport, RodError> {
        self.scheme = None;
        self.settings.check()?;
        if !(dt.is_finite() && dt > 0.0) {
            return Err(RodError::Setting { field: "dt", range: "positive and finite [s]" });
        }
        loads.check(rods)?;
        boundary.check(rods)?;
        if self.layout != rods.first_vertex {
            self.groups = group_strands(rods);
            self.place = vec![(0, 0); rods.strand_count()];
            for (g, group) in self.groups.iter().enumerate() {
                for l in 0..group.count {
                    self.place[group.strands[l]] = (g, l);
                }
            }
            self.layout.clone_from(&rods.first_vertex);
        }
        self.distribute(rods, boundary);
        let scheme = Scheme::new(self.settings.integrator, dt, rods);
        let settings = self.settings;
        let pool = &self.pool;
        let chunk = chunk_size(self.groups.len());
        self.groups.par_chunks_mut(chunk).for_each(|groups| {
            let mut scratch = take(pool);
            for group in groups {
                group.gather(rods, &scheme, loads, settings.tolerance);
                group.newton(&mut scratch, &settings, [true; 4]);
            }
            give(pool, scratch);
        });
        self.scheme = Some(scheme);
        self.outcome(rods)
    }

    /// Hands the boundary conditions to the groups.
    fn distribute(&mut self, rods: &RodSet, boundary: &Boundary) {
        for g in &mut self.groups {
            g.fixed.clear();
            g.fixed_angles.clear();
            g.goals.clear();
        }
        for f in &boundary.vertices {
            let (strand, i) = rods.locate_vertex(f.vertex);
            let (g, lane) = self.place[strand];
            for c in (0..3).filter(|c| f.components[*c]) {
                let (dof, target) = (4 * i + c, f.position[c]);
                let fixed = &mut self.groups[g].fixed;
                match fixed.iter_mut().find(|k| k.lane == lane && k.dof == dof) {
                    Some(k) => k.target = target,
                    None => fixed.push(FixedDof { lane, dof, target, reaction: 0.0, pending: 0.0 }),
                }
            }
        }
        for f in &boundary.edges {
            let (strand, j) = rods.locate_edge(f.edge);
            let (g, lane) = self.place[strand];
            let angles = &mut self.groups[g].fixed_angles;
            match angles.iter_mut().find(|k| k.0 == lane && k.1 == j) {
                Some(k) => k.2 = f.angle,
                None => angles.push((lane, j, f.angle)),
            }
        }
        for goal in &boundary.goals {
            let (strand, vertex) = rods.locate_vertex(goal.vertex);
            let (g, lane) = self.place[strand];
            self.groups[g].goals.push(GoalSpring { lane, vertex, position: goal.position, stiffness: goal.stiffness });
        }
    }

    /// Sums up the lanes, and turns an unusable result into an error that names strand and vertex.
    fn outcome(&mut self, rods: &RodSet) -> Result<RodReport, RodError> {
        let mut out = RodReport::EMPTY;
        let mut worst = (-1.0, 0, 0);
        for s in 0..rods.strand_count() {
            let (g, l) = self.place[s];
            let r: &LaneReport = &self.groups[g].reports[l];
            out.total_iterations += r.iterations;
            out.solve.iterations = out.solve.iterations.max(r.iterations);
            out.halvings += r.halvings;
            out.indefinite += r.indefinite;
            out.hessian = out.hessian.max(r.hessian);
            if r.status.severity() > out.solve.status.severity() {
                out.solve.status = r.status;
            }
            let bad = if r.residual.is_finite() && r.status != Status::NonFinite && !r.folded {
                r.residual
            } else {
                f64::INFINITY
            };
            if bad > worst.0 {
                worst = (bad, g, l);
                out.worst_strand = s;
            }
        }
        if rods.strand_count() == 0 {
            return Ok(out);
        }
        let (_, g, l) = worst;
        let group = &self.groups[g];
        let (strand, report, tolerance) = (out.worst_strand, &group.reports[l], &group.tolerance[l]);
        let mut largest = -1.0;
        for (i, v) in group.gradient.iter().enumerate() {
            for c in 0..4 {
                let r = v[c][l].abs() / if c < 3 { tolerance.force } else { tolerance.torque };
                let r = if r.is_nan() { f64::INFINITY } else { r };
                if r > largest {
                    largest = r;
                    out.worst_vertex = i;
                }
            }
        }
        let vertex = out.worst_vertex;
        out.solve.residual = report.residual;
        out.solve.tolerance = 1.0;
        let refused = match report.status {
            Status::Converged => None,
            Status::NonFinite => Some(RodError::NonFinite { strand, vertex, what: "the energy" }),
            _ if report.folded => Some(RodError::Folded { strand, vertex }),
            // a line search that finds no descent is at round-off, and may be somewhat above what was asked for; iterations
            // that ran out are not
            status if report.residual > 1e3 || (status == Status::MaxIterations && report.residual > 1.0) => {
                Some(RodError::NotConverged {
                    strand,
                    vertex,
                    status: report.status,
                    iterations: report.iterations,
                    residual: report.residual * tolerance.force,
                    tolerance: tolerance.force,
                })
            }
            _ => None,
        };
        match refused {
            Some(error) => {
                self.scheme = None;
                Err(error)
            }
            None => Ok(out),
        }
    }

    /// Factors the step matrices of the given strands (of all where `None`) at the solution, for [`strand_inverse`](Self::strand_inverse).
    pub fn prepare_factors(&mut self, strands: Option<&[usize]>) {
        let mut wanted = vec![strands.is_none(); self.groups.len()];
        for &s in strands.unwrap_or(&[]) {
            wanted[self.place[s].0] = true;
        }
        let (mode, pool) = (self.settings.hessian, &self.pool);
        self.groups.par_iter_mut().zip(&wanted).for_each(|(group, wanted)| {
            if *wanted {
                let mut scratch = take(pool);
                group.keep_factor(&mut scratch, mode);
                give(pool, scratch);
            }
        });
    }

    /// The inverse of a strand's step matrix at the solution; `None` unless [`prepare_factors`](Self::prepare_factors) covered it.
    #[must_use]
    pub fn strand_inverse(&self, strand: usize) -> Option<StrandInverse> {
        let scheme = self.scheme?;
        let &(g, l) = self.place.get(strand)?;
        let group = &self.groups[g];
        group.factored.then(|| StrandInverse {
            factor: group.factor.extract(l),
            fixed: group.fixed.iter().filter(|f| f.lane == l).map(|f| f.dof).collect(),
            scale: 1.0 / (scheme.tau * scheme.tau),
        })
    }

    /// Velocity of a vertex over the step \[m/s\]: of its end for implicit Euler and BDF2, of its middle for the midpoint rule.
    ///
    /// It is the velocity that moves the vertex, the one a contact law constrains.
    #[must_use]
    pub fn velocity(&self, rods: &RodSet, vertex: usize) -> Vector3<f64> {
        let Some(scheme) = self.scheme else { return rods.velocity[vertex] };
        let (strand, i) = rods.locate_vertex(vertex);
        let (g, l) = self.place[strand];
        let u = &self.groups[g].u[i];
        Vector3::new(u[0][l], u[1][l], u[2][l]) * (1.0 / scheme.tau)
    }

    /// Velocities of all vertices over the step, into `out` (one per vertex).
    pub fn velocities_into(&self, rods: &RodSet, out: &mut Vec<Vector3<f64>>) {
        out.clear();
        let inv_tau = self.scheme.map_or(0.0, |s| 1.0 / s.tau);
        for s in 0..rods.strand_count() {
            if self.scheme.is_none() {
                out.extend(&rods.velocity[rods.vertices(s)]);
                continue;
            }
            let (g, l) = self.place[s];
            out.extend(self.groups[g].u.iter().map(|u| Vector3::new(u[0][l], u[1][l], u[2][l]) * inv_tau));
        }
    }

    /// Positions at the end of the step under the present solution \[m\], into `out` (one per vertex); the present ones
    /// unless a solve succeeded.
    pub fn ends_into(&self, rods: &RodSet, out: &mut Vec<Vector3<f64>>) {
        out.clear();
        out.extend(&rods.position);
        let Some(scheme) = self.scheme else { return };
        let factor = if scheme.integrator == Integrator::ImplicitMidpoint { 2.0 } else { 1.0 };
        let history = rods.history.as_ref().filter(|_| scheme.previous != 0.0);
        for s in 0..rods.strand_count() {
            let (g, l) = self.place[s];
            let group = &self.groups[g];
            for (i, v) in rods.vertices(s).enumerate() {
                let u = &group.u[i];
                if let Some(h) = history {
                    out[v] += (h.position[v] - rods.position[v]) * scheme.previous;
                }
                out[v] += Vector3::new(u[0][l], u[1][l], u[2][l]) * factor;
            }
            for f in group.fixed.iter().filter(|f| f.lane == l && f.dof % 4 < 3) {
                out[rods.first_vertex[s] + f.dof / 4][f.dof % 4] = f.target;
            }
        }
    }

    /// Length \[s\] of the equivalent Euler step of the last solve: an impulse `r` handed to [`correct`](Self::correct) or
    /// [`resolve`](Self::resolve) acts as the force `r / length` during the step.
    #[must_use]
    pub fn equivalent_step(&self) -> Option<f64> {
        self.scheme.map(|s| s.tau)
    }

    /// Sum of the forces on the free vertices of a strand that the present solution leaves unbalanced \[N\].
    ///
    /// After [`correct`](Self::correct) it is what the linearisation leaves out: the forces at the clamps of the linear step
    /// are the reactions plus this.
    #[must_use]
    pub fn unbalanced_force(&self, strand: usize) -> Vector3<f64> {
        let mut sum = Vector3::zeros();
        if let (Some(&(g, l)), Some(_)) = (self.place.get(strand), self.scheme) {
            for v in &self.groups[g].gradient {
                sum += Vector3::new(v[0][l], v[1][l], v[2][l]);
            }
        }
        sum
    }

    /// Adds impulses \[N s\], one per vertex, and solves again (nonlinear), starting from the present solution.
    /// Strands without impulse keep their bits.
    pub fn resolve(&mut self, rods: &RodSet, impulses: &[Vector3<f64>]) -> Result<RodReport, RodError> {
        self.add_impulses(rods, impulses, true)
    }

    /// Adds impulses \[N s\], one per vertex, and corrects the velocities by `K⁻¹ Hᵀ r` alone (linear), as the contact law
    /// was solved. Needs [`prepare_factors`](Self::prepare_factors) for every strand with an impulse.
    pub fn correct(&mut self, rods: &RodSet, impulses: &[Vector3<f64>]) -> Result<RodReport, RodError> {
        self.add_impulses(rods, impulses, false)
    }

    fn add_impulses(
        &mut self,
        rods: &RodSet,
        impulses: &[Vector3<f64>],
        nonlinear: bool,
    ) -> Result<RodReport, RodError> {
        let Some(scheme) = self.scheme else {
            return Err(RodError::Argument { what: "a solved step before impulses", expected: 1, got: 0 });
        };
        if impulses.len() != rods.vertex_count() {
            return Err(RodError::Argument { what: "impulses", expected: rods.vertex_count(), got: impulses.len() });
        }
        if let Some(v) = impulses.iter().position(|r| !r.iter().all(|c| c.is_finite())) {
            let (strand, vertex) = rods.locate_vertex(v);
            return Err(RodError::NonFinite { strand, vertex, what: "a contact impulse" });
        }
        let (settings, pool) = (self.settings, &self.pool);
        let chunk = chunk_size(self.groups.len());
        self.groups.par_chunks_mut(chunk).for_each(|groups| {
            let mut scratch = take(pool);
            for group in groups {
                let mut touched = [false; 4];
                for l in 0..group.count {
                    let first = rods.first_vertex[group.strands[l]];
                    for i in 0..group.nv {
                        for c in 0..3 {
                            let force = impulses[first + i][c] / scheme.tau;
                            touched[l] |= force != 0.0;
                            group.data[i].linear[c][l] += force;
                        }
                    }
                }
                if !touched.contains(&true) {
                    continue;
                }
                if nonlinear {
                    group.newton(&mut scratch, &settings, touched);
                } else {
                    group.correct(&mut scratch, &settings, rods, impulses, scheme.tau, touched);
                }
            }
            give(pool, scratch);
        });
        self.outcome(rods)
    }

    /// Writes the solution into the strands. Refused unless a solve succeeded since the last one.
    pub fn accept(&mut self, rods: &mut RodSet) -> Result<(), RodError> {
        let Some(scheme) = self.scheme.take() else {
            return Err(RodError::Argument { what: "a solved step to accept", expected: 1, got: 0 });
        };
        if self.layout != rods.first_vertex {
            return Err(RodError::Argument {
                what: "strands of the solved step",
                expected: self.place.len(),
                got: rods.strand_count(),
            });
        }
        let had_history = rods.history.is_some();
        if scheme.integrator == Integrator::Bdf2 {
            let (nv, ne) = (rods.vertex_count(), rods.edge_count());
            let history = rods.history.get_or_insert_with(|| History {
                dt: 0.0,
                position: vec![Vector3::zeros(); nv],
                velocity: vec![Vector3::zeros(); nv],
                twist_angle: vec![0.0; ne],
                twist_rate: vec![0.0; ne],
                strain: vec![[0.0; 5]; nv],
            });
            history.dt = scheme.dt;
        } else {
            rods.history = None;
        }
        let mut slots: Vec<Option<StrandMut>> = split(rods).into_iter().map(Some).collect();
        let jobs: Vec<(&mut Group, [Option<StrandMut>; 4])> = self
            .groups
            .iter_mut()
            .map(|g| {
                let parts = std::array::from_fn(|l| if l < g.count { slots[g.strands[l]].take() } else { None });
                (g, parts)
            })
            .collect();
        jobs.into_par_iter().with_min_len(chunk_size(self.place.len() / 4)).for_each(|(group, parts)| {
            for (l, part) in parts.into_iter().enumerate() {
                if let Some(part) = part {
                    group.scatter(l, &scheme, part, had_history);
                }
            }
        });
        Ok(())
    }

    /// Force \[N\] by which the boundary holds a vertex, over the last solved step (zero where it is free).
    #[must_use]
    pub fn reaction_force(&self, rods: &RodSet, vertex: usize) -> Vector3<f64> {
        let (strand, i) = rods.locate_vertex(vertex);
        let mut force = Vector3::zeros();
        if let Some(&(g, l)) = self.place.get(strand) {
            for f in self.groups[g].fixed.iter().filter(|f| f.lane == l && f.dof / 4 == i && f.dof % 4 < 3) {
                force[f.dof % 4] = f.reaction;
            }
        }
        force
    }

    /// Torque about the tangent \[N m\] by which the boundary holds the angle of an edge (zero where it is free).
    #[must_use]
    pub fn reaction_torque(&self, rods: &RodSet, edge: usize) -> f64 {
        let (strand, j) = rods.locate_edge(edge);
        self.place.get(strand).map_or(0.0, |&(g, l)| {
            let mut held = self.groups[g].fixed.iter().filter(|f| f.lane == l && f.dof == 4 * j + 3);
            held.next().map_or(0.0, |f| f.reaction)
        })
    }

    /// Total force \[N\] and torque \[N m\] about `point` by which the boundary holds a strand, over the last solved step.
    #[must_use]
    pub fn reaction(&self, rods: &RodSet, strand: usize, point: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        let (mut force, mut torque) = (Vector3::zeros(), Vector3::zeros());
        for v in rods.vertices(strand) {
            let f = self.reaction_force(rods, v);
            force += f;
            torque += (rods.position[v] - point).cross(&f);
        }
        for (j, e) in rods.edges(strand).enumerate() {
            torque += rods.tangent(strand, j).0 * self.reaction_torque(rods, e);
        }
        (force, torque)
    }

    /// The step at which no edge turns by more than [`RodSettings::max_turn`] at the present velocities.
    ///
    /// The implicit step is stable at any size; this is its accuracy limit (docs: work–precision of the rods).
    #[must_use]
    pub fn step_limit(&self, rods: &RodSet) -> StepLimit {
        let mut fastest = (0.0, 0);
        for s in 0..rods.strand_count() {
            let v = rods.vertices(s);
            for i in v.start..v.end - 1 {
                let rate = (rods.velocity[i + 1] - rods.velocity[i]).norm_squared()
                    / (rods.position[i + 1] - rods.position[i]).norm_squared();
                if rate > fastest.0 {
                    fastest = (rate, s);
                }
            }
        }
        if fastest.0 > 0.0 {
            StepLimit {
                seconds: self.settings.max_turn / fastest.0.sqrt(),
                reason: StepReason::Turn { strand: fastest.1 },
            }
        } else {
            StepLimit { seconds: f64::INFINITY, reason: StepReason::Unlimited }
        }
    }
}

/// The parts of a Newton iteration on their own, for benchmarks.
#[doc(hidden)]
impl RodStepper {
    /// Energy and gradient (and matrix) of every strand at the last solution; the sum of the energies.
    pub fn bench_evaluate(&mut self, matrix: bool) -> f64 {
        let mut scratch = take(&self.pool);
        let mode = matrix.then_some(self.settings.hessian);
        let sum = self.groups.iter().map(|g| g.bench_evaluate(&mut scratch, mode)).sum();
        give(&self.pool, scratch);
        sum
    }
}

/// Groups handed to a thread at a time: enough to hide the hand-over, few enough to share evenly.
fn chunk_size(groups: usize) -> usize {
    groups.div_ceil(64).clamp(1, 16)
}

fn take(pool: &Mutex<Vec<Scratch>>) -> Scratch {
    pool.lock().ok().and_then(|mut p| p.pop()).unwrap_or_default()
}

fn give(pool: &Mutex<Vec<Scratch>>, scratch: Scratch) {
    if let Ok(mut p) = pool.lock() {
        p.push(scratch);
    }
}

fn split(rods: &mut RodSet) -> Vec<StrandMut<'_>> {
    fn cut<'a, T>(rest: &mut &'a mut [T], n: usize) -> &'a mut [T] {
        let (head, tail) = std::mem::take(rest).split_at_mut(n);
        *rest = tail;
        head
    }
    let mut position = rods.position.as_mut_slice();
    let mut velocity = rods.velocity.as_mut_slice();
    let mut reference_twist = rods.reference_twist.as_mut_slice();
    let mut twist_angle = rods.twist_angle.as_mut_slice();
    let mut twist_rate = rods.twist_rate.as_mut_slice();
    let mut director = rods.reference_director.as_mut_slice();
    let mut history = rods.history.as_mut().map(|h| {
        (
            h.position.as_mut_slice(),
            h.velocity.as_mut_slice(),
            h.twist_angle.as_mut_slice(),
            h.twist_rate.as_mut_slice(),
            h.strain.as_mut_slice(),
        )
    });
    rods.first_vertex
        .windows(2)
        .map(|w| {
            let n = w[1] - w[0];
            StrandMut {
                position: cut(&mut position, n),
                velocity: cut(&mut velocity, n),
                reference_twist: cut(&mut reference_twist, n),
                twist_angle: cut(&mut twist_angle, n - 1),
                twist_rate: cut(&mut twist_rate, n - 1),
                reference_director: cut(&mut director, n - 1),
                history: history.as_mut().map(|h| HistoryMut {
                    position: cut(&mut h.0, n),
                    velocity: cut(&mut h.1, n),
                    twist_angle: cut(&mut h.2, n - 1),
                    twist_rate: cut(&mut h.3, n - 1),
                    strain: cut(&mut h.4, n),
                }),
            }
        })
        .collect()
}

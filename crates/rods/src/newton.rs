//! Newton's method on four strands at once: line search, ladder of matrices, convergence, lane by lane.
//!
//! The lanes share every pass over memory but no number: each has its own step length, ladder level and stopping
//! test, and a lane that has finished keeps its iterate. So a strand's result does not depend on its neighbours.

use crate::group::{Group, LaneReport};
use crate::kernel::{Evaluation, Frame, Value, VertexData, W};
use crate::retraction::{Anchor, Bend};
use crate::settings::{HessianMode, RodSettings};
use crate::state::RodSet;
use nalgebra::Vector3;
use numerics::Status;
use numerics::banded::BatchedBand;
use numerics::lanes::{F4, Lane, LaneKernel, V3, dispatch};

/// Memory reused from group to group.
#[derive(Default)]
pub(crate) struct Scratch {
    trial: Vec<[F4; 4]>,
    direction: Vec<[F4; 4]>,
    bent: Vec<[F4; 4]>,
    gradient: Vec<[F4; 4]>,
    frames: Vec<Frame>,
    band: BatchedBand<W>,
    spare: BatchedBand<W>,
    /// Exact and Gauss–Newton matrix of one iterate, where they are mixed.
    mixed: [Vec<[F4; W]>; 2],
}

impl Scratch {
    fn resize(&mut self, nv: usize) {
        self.trial.resize(nv, [F4::ZERO; 4]);
        self.direction.resize(nv, [F4::ZERO; 4]);
        self.bent.resize(nv, [F4::ZERO; 4]);
        self.gradient.resize(nv, [F4::ZERO; 4]);
        self.frames.resize(nv, Frame::default());
        self.band.columns.resize(4 * nv, [F4::ZERO; W]);
    }
}

/// Largest force and torque residual; not a number if any entry is not finite.
struct Residual<'a>(&'a [[F4; 4]]);
impl LaneKernel for Residual<'_> {
    type Output = (F4, F4);
    #[inline(always)]
    fn run<L: Lane<Memory = F4>>(self) -> (F4, F4) {
        let zero = L::splat(0.0);
        let (mut force, mut torque, mut poison) = (zero, zero, zero);
        for g in self.0 {
            for c in 0..4 {
                let r = L::load(&g[c]).abs();
                // a comparison would overlook what is not a number; its product with zero is not zero
                poison += r * zero;
                if c < 3 {
                    force = force.max(r);
                } else {
                    torque = torque.max(r);
                }
            }
        }
        let force = force + poison;
        let mut out = (F4::ZERO, F4::ZERO);
        force.store(&mut out.0);
        torque.store(&mut out.1);
        out
    }
}

/// Part of an edge's length, or angle [rad], beyond which a first guess is not trusted alone.
const SWEPT: f64 = 0.25;

/// Iterations after which a lane whose exact matrix is not positive definite is given as much of it as can be had.
///
/// Gauss–Newton alone holds a strand that buckles under drag too stiffly and takes a hundred iterations; strands that get there in fewer
/// are not helped by mixing.
const STUBBORN: usize = 15;

/// Shares of Gauss–Newton in what is tried then, in this order.
const SHARES: [f64; 4] = [0.125, 0.25, 0.5, 0.75];

/// What the line search needs to know of a direction.
#[derive(Clone, Copy, Default)]
struct Slope {
    /// Slope of Ψ along the direction.
    slope: F4,
    /// Slope and half curvature of its quadratic part.
    linear: F4,
    quadratic: F4,
    /// Largest change of an edge vector over its length, squared.
    turn: F4,
    /// Largest displacement, and largest present one; the same for angles.
    step: F4,
    size: F4,
    step_angle: F4,
}

struct Along<'a> {
    data: &'a [VertexData],
    u: &'a [[F4; 4]],
    gradient: &'a [[F4; 4]],
    direction: &'a [[F4; 4]],
}

impl LaneKernel for Along<'_> {
    type Output = Slope;
    #[inline(always)]
    fn run<L: Lane<Memory = F4>>(self) -> Slope {
        let zero = L::splat(0.0);
        let (mut slope, mut linear, mut quadratic) = (zero, zero, zero);
        let (mut turn, mut step, mut size, mut step_angle) = (zero, zero, zero, zero);
        let n = self.data.len();
        for i in 0..n {
            let (d, u, g, p) = (&self.data[i], &self.u[i], &self.gradient[i], &self.direction[i]);
            for c in 0..4 {
                let (p, a, u) = (L::load(&p[c]), L::load(&d.diagonal[c]), L::load(&u[c]));
                slope += L::load(&g[c]) * p;
                linear += (a * u - L::load(&d.linear[c])) * p;
                quadratic += a * p * p;
                if c < 3 {
                    step = step.max(p.abs());
                    size = size.max(u.abs());
                } else {
                    step_angle = step_angle.max(p.abs());
                }
            }
            if i + 1 < n {
                let get = |x: &[F4; 4]| V3([L::load(&x[0]), L::load(&x[1]), L::load(&x[2])]);
                let change = get(&self.direction[i + 1]) - get(p);
                let edge = V3::<L>::load(&d.edge) + get(&self.u[i + 1]) - get(u);
                let length = L::load(&d.length);
                let scale = edge.dot(edge).max(length * length);
                turn = turn.max(change.dot(change) / scale);
            }
        }
        let mut out = Slope::default();
        slope.store(&mut out.slope);
        linear.store(&mut out.linear);
        quadratic.store(&mut out.quadratic);
        turn.store(&mut out.turn);
        step.store(&mut out.step);
        size.store(&mut out.size);
        step_angle.store(&mut out.step_angle);
        out
    }
}

/// `trial = u + direction`.
struct Step<'a> {
    u: &'a [[F4; 4]],
    direction: &'a [[F4; 4]],
    trial: &'a mut [[F4; 4]],
}
impl LaneKernel for Step<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lane<Memory = F4>>(self) {
        for i in 0..self.u.len() {
            for c in 0..4 {
                let x = L::load(&self.u[i][c]) + L::load(&self.direction[i][c]);
                x.store(&mut self.trial[i][c]);
            }
        }
    }
}

fn copy_lanes(to: &mut [[F4; 4]], from: &[[F4; 4]], lanes: [bool; 4]) {
    for (t, f) in to.iter_mut().zip(from) {
        for c in 0..4 {
            for l in 0..4 {
                if lanes[l] {
                    t[c][l] = f[c][l];
                }
            }
        }
    }
}

fn copy_frame_lanes(to: &mut [Frame], from: &[Frame], lanes: [bool; 4]) {
    for (t, f) in to.iter_mut().zip(from) {
        for l in 0..4 {
            if lanes[l] {
                for c in 0..3 {
                    t.tangent[c][l] = f.tangent[c][l];
                    t.director[c][l] = f.director[c][l];
                }
                t.reference_twist[l] = f.reference_twist[l];
            }
        }
    }
}

/// Weaker matrices to try after `mode`.
fn weaker(mode: HessianMode) -> &'static [HessianMode] {
    use HessianMode::{ElementProjected, Exact, GaussNewton, Shifted};
    match mode {
        Exact => &[ElementProjected, GaussNewton, Shifted],
        ElementProjected => &[GaussNewton, Shifted],
        GaussNewton | Shifted => &[Shifted],
    }
}

impl Group {
    /// What to run for energy, gradient and matrix at the present iterate.
    fn at_iterate<'a>(&'a self, frames: &'a mut [Frame], gradient: &'a mut [[F4; 4]]) -> Evaluation<'a> {
        Evaluation { data: &self.data, base: &self.base, u: &self.u, frames, gradient }
    }

    fn evaluate_at_iterate(&mut self, s: &mut Scratch, mode: HessianMode) -> Value {
        self.at_iterate(&mut s.frames, &mut s.gradient).run(Some((&mut s.band.columns, mode)))
    }

    pub fn bench_evaluate(&self, s: &mut Scratch, mode: Option<HessianMode>) -> f64 {
        s.resize(self.nv);
        let band = mode.map(|m| (s.band.columns.as_mut_slice(), m));
        self.at_iterate(&mut s.frames, &mut s.gradient).run(band).energy[0]
    }

    /// Factors the matrix in `s.band`; where it is not positive definite, weaker ones of the same iterate.
    fn factor(&self, s: &mut Scratch, wanted: [bool; 4], mode: HessianMode) -> [HessianMode; 4] {
        let mut level = [mode; 4];
        Self::mask_band(&self.fixed, self.count, &mut s.band);
        let pivots = s.band.factor();
        let mut bad: [bool; 4] = std::array::from_fn(|l| wanted[l] && !pivots[l].is_positive_definite());
        if !bad.contains(&true) {
            return level;
        }
        s.spare.columns.resize(s.band.columns.len(), [F4::ZERO; W]);
        let stubborn: [bool; 4] = std::array::from_fn(|l| bad[l] && self.reports[l].iterations >= STUBBORN);
        if mode == HessianMode::Exact && stubborn.contains(&true) {
            self.factor_mixed(s, stubborn, &mut bad, &mut level);
            if !bad.contains(&true) {
                return level;
            }
        }
        for &next in weaker(mode) {
            let shifts = if next == HessianMode::Shifted { 30 } else { 1 };
            for k in 0..shifts {
                self.at_iterate(&mut s.frames, &mut s.gradient).run(Some((&mut s.spare.columns, next)));
                if next == HessianMode::Shifted {
                    let shift = 1e-12 * f64::powi(4.0, k);
                    for column in &mut s.spare.columns {
                        for l in 0..4 {
                            column[0][l] += shift * column[0][l].abs();
                        }
                    }
                }
                let left = bad;
                if self.take_spare(s, left, next, &mut bad, &mut level) {
                    return level;
                }
            }
        }
        level
    }

    /// For the given lanes, the first mixture of exact and Gauss–Newton matrix that is positive definite, if one of [`SHARES`] is.
    fn factor_mixed(&self, s: &mut Scratch, lanes: [bool; 4], bad: &mut [bool; 4], level: &mut [HessianMode; 4]) {
        for (mode, columns) in [HessianMode::Exact, HessianMode::GaussNewton].into_iter().zip(&mut s.mixed) {
            columns.resize(s.band.columns.len(), [F4::ZERO; W]);
            self.at_iterate(&mut s.frames, &mut s.gradient).run(Some((columns, mode)));
        }
        for share in SHARES {
            let [exact, gauss_newton] = &s.mixed;
            for ((to, a), b) in s.spare.columns.iter_mut().zip(exact).zip(gauss_newton) {
                for ((to, a), b) in to.iter_mut().zip(a).zip(b) {
                    for l in 0..4 {
                        to[l] = a[l] + share * (b[l] - a[l]);
                    }
                }
            }
            if self.take_spare(s, lanes, HessianMode::GaussNewton, bad, level) {
                return;
            }
        }
    }

    /// Factors the matrix in `s.spare` and takes it over, as of `mode`, for those of the lanes that are still bad and whose it is positive
    /// definite. Returns whether none of the lanes is bad any more.
    fn take_spare(
        &self,
        s: &mut Scratch,
        lanes: [bool; 4],
        mode: HessianMode,
        bad: &mut [bool; 4],
        level: &mut [HessianMode; 4],
    ) -> bool {
        Self::mask_band(&self.fixed, self.count, &mut s.spare);
        let pivots = s.spare.factor();
        for l in 0..4 {
            if lanes[l] && bad[l] && pivots[l].is_positive_definite() {
                s.band.copy_lane_from(&s.spare, l);
                bad[l] = false;
                level[l] = mode;
            }
        }
        !(0..4).any(|l| lanes[l] && bad[l])
    }

    /// Keeps a factor of the matrix at the accepted iterate, for Delassus columns.
    pub fn keep_factor(&mut self, s: &mut Scratch, mode: HessianMode) {
        if self.factored {
            return;
        }
        s.resize(self.nv);
        self.evaluate_at_iterate(s, mode);
        let wanted = std::array::from_fn(|l| l < self.count);
        self.factor(s, wanted, mode);
        self.factor.columns.clone_from(&s.band.columns);
        self.factored = true;
    }

    /// Moves the solution by `K⁻¹` times the impulses, which the linear part already holds, in one undamped step.
    pub fn correct(
        &mut self,
        s: &mut Scratch,
        settings: &RodSettings,
        rods: &RodSet,
        impulses: &[Vector3<f64>],
        tau: f64,
        lanes: [bool; 4],
    ) {
        s.resize(self.nv); // the scratch may come from a group of another size, and a kept factor does not touch it
        self.keep_factor(s, settings.hessian);
        let mut force = vec![[F4::ZERO; 4]; self.nv];
        for l in 0..self.count {
            let first = rods.first_vertex[self.strands[l]];
            for i in 0..self.nv {
                for c in 0..3 {
                    force[i][c][l] = impulses[first + i][c] / tau;
                }
            }
        }
        // not mask_gradient: the forces of the boundary must not be touched
        for f in &self.fixed {
            force[f.dof / 4][f.dof % 4][f.lane] = 0.0;
        }
        self.factor.solve(force.as_flattened_mut());
        for (u, d) in self.u.iter_mut().flatten().zip(force.iter().flatten()) {
            for l in 0..self.count {
                if lanes[l] {
                    u[l] += d[l];
                }
            }
        }
        let value = self.evaluate_at_iterate(s, settings.hessian);
        self.take_lanes(s, &value, lanes);
        for l in 0..self.count {
            if !lanes[l] {
                continue;
            }
            let report = &mut self.reports[l];
            report.folded = value.admissible[l] == 0.0;
            report.residual = 0.0; // the linear system was solved exactly; Newton's residual is not what was asked for
            report.status = if !value.energy[l].is_finite() {
                Status::NonFinite
            } else if report.folded {
                Status::Breakdown
            } else {
                Status::Converged
            };
        }
        self.factored = false;
    }

    /// Solves from the present displacement; leaves the solution in `u`, `base`, `gradient` and `reports`.
    ///
    /// `lanes`: the lanes to solve; the others keep what they have, bit for bit.
    pub fn newton(&mut self, s: &mut Scratch, settings: &RodSettings, lanes: [bool; 4]) {
        let mode = settings.hessian;
        s.resize(self.nv);
        self.factored = false;
        let mut running: [bool; 4] = std::array::from_fn(|l| l < self.count && lanes[l]);

        let value = self.first_evaluation(s, mode, running);
        self.take_lanes(s, &value, running);
        for l in 0..self.count {
            if !running[l] {
                continue;
            }
            self.reports[l] = LaneReport::NONE;
            let report = &mut self.reports[l];
            if !value.energy[l].is_finite() {
                report.status = Status::NonFinite;
                running[l] = false;
            } else if value.admissible[l] == 0.0 {
                report.status = Status::Breakdown;
                report.folded = true;
                running[l] = false;
            }
        }

        let anchor: [Anchor; 4] = std::array::from_fn(|l| Anchor::of(&self.fixed, l));
        let mut fresh = running;
        let mut alpha = F4::ZERO;
        let mut halvings = [0usize; 4];
        let mut slope = Slope::default();
        let mut last_exact = [false; 4];
        loop {
            // convergence of the lanes that have a new iterate
            let (force, torque) = dispatch(Residual(&self.gradient));
            for l in 0..4 {
                if !fresh[l] {
                    continue;
                }
                let (t, report) = (&self.tolerance[l], &mut self.reports[l]);
                let before = report.residual;
                // zero before the first iteration, where the tolerance is the strictest
                let far = slope.size[l];
                let allowed = (t.force + t.per_displacement[0] * far, t.torque + t.per_displacement[1] * far);
                report.residual = (force[l] / allowed.0).max(torque[l] / allowed.1);
                if force[l].is_nan() {
                    report.residual = f64::INFINITY;
                }
                // a full exact Newton step this small that no longer reduces the residual: round-off is all that is left
                let settled = last_exact[l]
                    && report.residual > 0.5 * before
                    && alpha[l] == 1.0
                    && slope.step[l] <= t.displacement + 1e-9 * slope.size[l]
                    && slope.step_angle[l] <= 1e-9;
                if report.residual <= 1.0 || settled {
                    report.status = Status::Converged;
                    (running[l], fresh[l]) = (false, false);
                } else if report.iterations >= settings.max_iterations {
                    report.status = Status::MaxIterations;
                    (running[l], fresh[l]) = (false, false);
                }
            }
            if !running.contains(&true) {
                return;
            }
            if fresh.contains(&true) {
                let levels = self.factor(s, fresh, mode);
                // `trial` holds the right-hand side for a moment
                for i in 0..self.nv {
                    for c in 0..4 {
                        for l in 0..4 {
                            s.trial[i][c][l] = -self.gradient[i][c][l];
                        }
                    }
                }
                s.band.solve(s.trial.as_flattened_mut());
                if fresh == running {
                    std::mem::swap(&mut s.direction, &mut s.trial);
                } else {
                    copy_lanes(&mut s.direction, &s.trial, fresh);
                }
                slope =
                    dispatch(Along { data: &self.data, u: &self.u, gradient: &self.gradient, direction: &s.direction });
                for l in 0..4 {
                    if fresh[l] {
                        let report = &mut self.reports[l];
                        report.hessian = report.hessian.max(levels[l]);
                        report.indefinite += usize::from(levels[l] > mode);
                        last_exact[l] = levels[l] == HessianMode::Exact;
                        // no edge may change by more than its own length in one iteration
                        let turn = slope.turn[l].sqrt();
                        alpha[l] = if turn > 1.0 { 1.0 / turn } else { 1.0 };
                        halvings[l] = 0;
                    }
                }
            }
            for l in 0..4 {
                if !running[l] {
                    alpha[l] = 0.0;
                }
            }
            dispatch(Bend {
                data: &self.data,
                u: &self.u,
                direction: &s.direction,
                alpha,
                turn: slope.turn,
                anchor,
                bent: &mut s.bent,
            });
            for f in &self.fixed {
                s.bent[f.dof / 4][f.dof % 4][f.lane] = 0.0;
            }
            let bent = dispatch(Along { data: &self.data, u: &self.u, gradient: &self.gradient, direction: &s.bent });
            dispatch(Step { u: &self.u, direction: &s.bent, trial: &mut s.trial });
            let value = Evaluation {
                data: &self.data,
                base: &self.base,
                u: &s.trial,
                frames: &mut s.frames,
                gradient: &mut s.gradient,
            }
            .run(Some((&mut s.band.columns, mode)));
            Self::mask_gradient(&mut self.fixed, self.count, &mut s.gradient);
            let mut accepted = [false; 4];
            for l in 0..4 {
                fresh[l] = false;
                if !running[l] {
                    continue;
                }
                let (a, old, new) = (alpha[l], self.energy[l], value.energy[l]);
                let change = bent.linear[l] + 0.5 * bent.quadratic[l] + (new - old);
                let noise = self.tolerance[l].energy;
                let slack =
                    4.0 * ((old + new) * noise).sqrt() + noise + 1e-15 * (bent.linear[l].abs() + bent.quadratic[l]);
                let decreased = change <= settings.armijo * a * slope.slope[l] + slack;
                if value.admissible[l] > 0.0 && new.is_finite() && decreased {
                    accepted[l] = true;
                    self.energy[l] = new;
                    self.reports[l].iterations += 1;
                } else if halvings[l] >= settings.max_halvings {
                    self.reports[l].status = Status::Stalled;
                    running[l] = false;
                } else {
                    alpha[l] *= 0.5;
                    halvings[l] += 1;
                    self.reports[l].halvings += 1;
                }
            }
            if accepted[..self.count] == [true; 4][..self.count] {
                std::mem::swap(&mut self.u, &mut s.trial);
            } else if accepted.contains(&true) {
                copy_lanes(&mut self.u, &s.trial, accepted);
            }
            self.take_state(s, accepted);
            fresh = accepted;
        }
    }

    /// Takes over energy, gradient and frames of the evaluation in `s` for the given lanes.
    fn take_lanes(&mut self, s: &mut Scratch, value: &Value, lanes: [bool; 4]) {
        Self::mask_gradient(&mut self.fixed, self.count, &mut s.gradient);
        for l in 0..4 {
            if lanes[l] {
                self.energy[l] = value.energy[l];
            }
        }
        self.take_state(s, lanes);
    }

    fn take_state(&mut self, s: &mut Scratch, lanes: [bool; 4]) {
        if lanes[..self.count] == [true; 4][..self.count] {
            std::mem::swap(&mut self.base, &mut s.frames);
            std::mem::swap(&mut self.gradient, &mut s.gradient);
        } else if lanes.contains(&true) {
            copy_lanes(&mut self.gradient, &s.gradient, lanes);
            copy_frame_lanes(&mut self.base, &s.frames, lanes);
        }
        for f in &mut self.fixed {
            if lanes[f.lane] {
                f.reaction = f.pending;
            }
        }
    }

    /// First evaluation. Where the inertial guess folds the strand, tears it away from what holds it or sweeps it far, the
    /// strand first follows its prescribed vertices rigidly, or stays where it is, whichever is admissible and lower.
    ///
    /// Descent from a guess no higher than "stays" ends no higher, which bounds the energy of the step; a guess swept far may
    /// lie beyond a barrier, and descent from there end in a state of more energy.
    fn first_evaluation(&mut self, s: &mut Scratch, mode: HessianMode, lanes: [bool; 4]) -> Value {
        let value = self.evaluate_at_iterate(s, mode);
        let wanted: [bool; 4] = std::array::from_fn(|l| {
            lanes[l]
                && (value.admissible[l] == 0.0 || !value.energy[l].is_finite() || self.torn(l) || self.swept(l))
                && self.u.iter().flatten().all(|v| v[l].is_finite())
        });
        if !wanted.contains(&true) {
            return value;
        }
        let inertial = self.u.clone();
        let mut best: Vec<[F4; 4]> = self.u.clone();
        let mut lowest: [f64; 4] = std::array::from_fn(|l| self.merit(&value, l));
        for candidate in 0..2 {
            for l in 0..4 {
                if wanted[l] {
                    self.guess(&inertial, l, candidate);
                }
            }
            let value = self.evaluate_at_iterate(s, mode);
            let better: [bool; 4] = std::array::from_fn(|l| {
                let merit = self.merit(&value, l);
                let better = wanted[l] && merit < lowest[l];
                if better {
                    lowest[l] = merit;
                }
                better
            });
            copy_lanes(&mut best, &self.u, better);
        }
        self.u = best;
        self.evaluate_at_iterate(s, mode)
    }

    /// Whether a first guess stretches an edge by more than a quarter.
    fn torn(&self, l: usize) -> bool {
        let held = |i: usize| self.fixed.iter().any(|f| f.lane == l && f.dof / 4 == i);
        (0..self.nv - 1).any(|i| {
            let (mut square, d) = (0.0, &self.data[i]);
            for c in 0..3 {
                let e = d.edge[c][l] + self.u[i + 1][c][l] - self.u[i][c][l];
                square += e * e;
            }
            let ratio = square / (d.length[l] * d.length[l]);
            !(0.5..1.6).contains(&ratio) && (held(i) || held(i + 1))
        })
    }

    /// Whether a first guess changes an edge vector, or the angle between neighbouring edges, by a quarter (of its length; in rad).
    fn swept(&self, l: usize) -> bool {
        (0..self.nv - 1).any(|i| {
            let (mut square, d) = (0.0, &self.data[i]);
            for c in 0..3 {
                let change = self.u[i + 1][c][l] - self.u[i][c][l];
                square += change * change;
            }
            let turned = i + 2 < self.nv && (self.u[i + 1][3][l] - self.u[i][3][l]).abs() > SWEPT;
            square > SWEPT * SWEPT * d.length[l] * d.length[l] || turned
        })
    }

    /// Value of Ψ at the present displacement; infinite where it is not admissible.
    fn merit(&self, value: &Value, l: usize) -> f64 {
        if value.admissible[l] == 0.0 || !value.energy[l].is_finite() {
            return f64::INFINITY;
        }
        let mut sum = value.energy[l];
        for (d, u) in self.data.iter().zip(&self.u) {
            for c in 0..4 {
                sum += (0.5 * d.diagonal[c][l] * u[c][l] - d.linear[c][l]) * u[c][l];
            }
        }
        sum
    }

    /// Sets the free displacements of lane `l`: 0 follows the nearest prescribed vertex, 1 stays.
    fn guess(&mut self, inertial: &[[F4; 4]], l: usize, candidate: usize) {
        let held: Vec<(usize, usize)> =
            self.fixed.iter().filter(|f| f.lane == l).map(|f| (f.dof / 4, f.dof % 4)).collect();
        for c in 0..4 {
            let vertices: Vec<usize> = held.iter().filter(|(_, k)| *k == c).map(|(i, _)| *i).collect();
            for i in 0..self.nv {
                if vertices.contains(&i) {
                    continue;
                }
                self.u[i][c][l] = match (candidate, vertices.iter().min_by_key(|v| v.abs_diff(i))) {
                    (0, Some(&v)) if c < 3 => inertial[v][c][l],
                    (0, _) if c == 3 => inertial[i][c][l],
                    _ => 0.0,
                };
            }
        }
    }
}

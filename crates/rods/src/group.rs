//! Four strands of equal vertex count, side by side: gathering their state and loads, and writing the result back.

use crate::boundary::{FixedAngle, angle_of_director};
use crate::coefficients::{bend_twist_stiffness, edge_inertia, stretch_stiffness, vertex_length, vertex_mass};
use crate::kernel::{Frame, VertexData, W};
use crate::loads::Loads;
use crate::settings::{HessianMode, Integrator};
use crate::state::RodSet;
use nalgebra::Vector3;
use numerics::Status;
use numerics::banded::BatchedBand;
use numerics::lanes::F4;
use numerics::transport::parallel_transport;

/// One step of an integrator, in the form "backward Euler of length `tau` from a predicted state".
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Scheme {
    pub integrator: Integrator,
    pub dt: f64,
    /// Length of the equivalent backward Euler step \[s\].
    pub tau: f64,
    /// Weight of the previous state in the prediction (zero for one-step schemes).
    pub previous: f64,
}

impl Scheme {
    /// Whether the solve gives the middle of the step.
    pub fn is_midpoint(&self) -> bool {
        self.previous == 0.0 && self.tau < self.dt
    }

    pub fn new(integrator: Integrator, dt: f64, rods: &RodSet) -> Self {
        match (integrator, &rods.history) {
            (Integrator::ImplicitMidpoint, _) => Scheme { integrator, dt, tau: 0.5 * dt, previous: 0.0 },
            (Integrator::Bdf2, Some(history)) if dt <= 2.0 * history.dt => {
                let w = dt / history.dt;
                let share = 1.0 / (1.0 + 2.0 * w);
                Scheme { integrator, dt, tau: dt * (1.0 + w) * share, previous: -w * w * share }
            }
            // the first step, and one that grows beyond the stability range of the variable-step formula, is one of implicit
            // Euler: its error enters once, so the order stays two, and unlike a midpoint step it leaves no stretch behind
            (Integrator::Bdf2, _) => Scheme { integrator, dt, tau: dt, previous: 0.0 },
            (Integrator::ImplicitEuler, _) => Scheme { integrator, dt, tau: dt, previous: 0.0 },
        }
    }
}

/// A degree of freedom that is prescribed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FixedDof {
    pub lane: usize,
    /// `4 i + c`: component `c` of vertex `i`, or (c = 3) the angle of edge `i`.
    pub dof: usize,
    /// Value at the end of the step.
    pub target: f64,
    /// Force (or torque) that holds it, of the accepted iterate.
    pub reaction: f64,
    pub pending: f64,
}

/// A spring to a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GoalSpring {
    pub lane: usize,
    pub vertex: usize,
    pub position: Vector3<f64>,
    pub stiffness: f64,
}

/// How one lane's solve ended.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LaneReport {
    pub status: Status,
    pub iterations: usize,
    /// Residual over tolerance.
    pub residual: f64,
    pub folded: bool,
    pub hessian: HessianMode,
    pub indefinite: usize,
    pub halvings: usize,
}

impl LaneReport {
    pub const NONE: LaneReport = LaneReport {
        status: Status::Converged,
        iterations: 0,
        residual: 0.0,
        folded: false,
        hessian: HessianMode::Exact,
        indefinite: 0,
        halvings: 0,
    };
}

/// Tolerances of one lane.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Tolerance {
    /// Residual force \[N\].
    pub force: f64,
    /// Residual torque \[N m\].
    pub torque: f64,
    /// Square of the relative round-off of the energy terms, as an energy \[J\].
    pub energy: f64,
    /// Length of a negligible displacement \[m\].
    pub displacement: f64,
    /// Parts of `force` and `torque` that are round-off, per displacement of the step \[N/m, N\]: displacements are known
    /// to their own last digit, which a stiff edge turns into a force, however small the edge.
    pub per_displacement: [f64; 2],
}

pub(crate) struct Group {
    pub strands: [usize; 4],
    /// Lanes in use; the others repeat lane 0.
    pub count: usize,
    pub nv: usize,
    pub data: Vec<VertexData>,
    pub base: Vec<Frame>,
    pub u: Vec<[F4; 4]>,
    pub gradient: Vec<[F4; 4]>,
    pub energy: F4,
    pub fixed: Vec<FixedDof>,
    pub fixed_angles: Vec<(usize, usize, FixedAngle)>,
    pub goals: Vec<GoalSpring>,
    pub reports: [LaneReport; 4],
    pub tolerance: [Tolerance; 4],
    pub factor: BatchedBand<W>,
    pub factored: bool,
    /// Start-of-step strains per vertex (length, four curvatures, twist), where internal viscosity needs them.
    pub strain: Vec<[F4; 6]>,
}

/// Groups strands of equal vertex count by four, in scene order.
pub(crate) fn group_strands(rods: &RodSet) -> Vec<Group> {
    let mut order: Vec<usize> = (0..rods.strand_count()).collect();
    order.sort_by_key(|s| rods.vertices(*s).len());
    let mut groups: Vec<Group> = Vec::new();
    for s in order {
        let nv = rods.vertices(s).len();
        match groups.last_mut() {
            Some(g) if g.nv == nv && g.count < 4 => {
                g.strands[g.count] = s;
                g.count += 1;
            }
            _ => groups.push(Group {
                strands: [s; 4],
                count: 1,
                nv,
                data: vec![VertexData::default(); nv],
                base: vec![Frame::default(); nv],
                u: vec![[F4::ZERO; 4]; nv],
                gradient: vec![[F4::ZERO; 4]; nv],
                energy: F4::ZERO,
                fixed: Vec::new(),
                fixed_angles: Vec::new(),
                goals: Vec::new(),
                reports: [LaneReport::NONE; 4],
                tolerance: [Tolerance::default(); 4],
                factor: BatchedBand::default(),
                factored: false,
                strain: Vec::new(),
            }),
        }
    }
    groups
}

impl Group {
    /// Gathers state, coefficients and loads of its strands and makes the first guess of the displacement.
    pub fn gather(&mut self, rods: &RodSet, scheme: &Scheme, loads: &Loads, relative: f64) {
        self.factored = false;
        for lane in 0..4 {
            let source = if lane < self.count { lane } else { 0 };
            self.gather_lane(rods, scheme, loads, relative, lane, source);
        }
    }

    fn gather_lane(&mut self, rods: &RodSet, scheme: &Scheme, loads: &Loads, relative: f64, l: usize, source: usize) {
        let s = self.strands[source];
        let (first, edges) = (rods.first_vertex[s], rods.edges(s));
        let material = &rods.material[s];
        let (tau, nv) = (scheme.tau, self.nv);
        let inv_tau = 1.0 / tau;
        let ne = nv - 1;
        let viscous = material.viscosity > 0.0;
        // c_v / c of the internal viscosity: bending and stretch 3η/(Eτ), torsion η/(Gτ)
        let damp = 3.0 * material.viscosity / (material.young_modulus * tau);
        let damp_twist = material.viscosity / (material.shear_modulus() * tau);
        let history = rods.history.as_ref().filter(|_| scheme.previous != 0.0);
        if viscous && self.strain.len() != nv {
            self.strain = vec![[F4::ZERO; 6]; nv];
        }
        let (mut heaviest, mut fastest, mut strongest) = (0.0f64, 0.0f64, 0.0f64);
        let (mut inertia_max, mut spin) = (0.0f64, 0.0f64);
        let (mut stiff_force, mut stiff_torque, mut energy) = (0.0f64, 0.0f64, 0.0f64);
        let (mut shortest, mut longest) = (f64::INFINITY, 0.0f64);
        let mut previous_tangent = Vector3::zeros();
        // a strand that nothing holds is first thought to fly, any other to go on as it did
        let held = self.fixed.iter().any(|f| f.lane == source) || self.goals.iter().any(|g| g.lane == source);
        let ballistic = if held { Vector3::zeros() } else { loads.gravity * (tau * tau) };
        for i in 0..nv {
            let v = first + i;
            let film = loads.film_mass.map_or(0.0, |m| m[v]);
            let mass = vertex_mass(rods, s, i) + film;
            let drag = loads.drag.map_or(0.0, |d| d[v]);
            let resistance = drag + material.air_drag * vertex_length(rods, s, i);
            let mut force = loads.gravity * mass;
            if let Some(f) = loads.force {
                force += f[v];
            }
            if let Some(p) = loads.impulse {
                force += p[v] / scheme.dt;
            }
            if let Some(f) = loads.fluid_velocity {
                force += f[v] * drag;
            }
            strongest = strongest.max(force.amax());
            let mut velocity = rods.velocity[v];
            fastest = fastest.max(velocity.amax());
            if let Some(h) = history {
                velocity += (h.velocity[v] - velocity) * scheme.previous;
            }
            heaviest = heaviest.max(mass);
            let data = &mut self.data[i];
            for c in 0..3 {
                data.diagonal[c][l] = (mass * inv_tau + resistance) * inv_tau;
                data.linear[c][l] = mass * inv_tau * velocity[c] + force[c];
                self.u[i][c][l] = tau * rods.velocity[v][c] + ballistic[c];
            }
            if i == ne {
                // the angle after the last edge does not exist: an identity row
                data.diagonal[3][l] = 1.0;
                data.linear[3][l] = 0.0;
                self.u[i][3][l] = 0.0;
                break;
            }
            let e = edges.start + i;
            let inertia = edge_inertia(rods, s, i, loads.film_mass, loads.film_height);
            inertia_max = inertia_max.max(inertia);
            let torque = loads.torque.map_or(0.0, |t| t[e]);
            let mut rate = rods.twist_rate[e];
            spin = spin.max(rate.abs());
            let mut theta = rods.twist_angle[e];
            stiff_torque = stiff_torque.max(torque.abs() * relative);
            let mut edge = rods.position[v + 1] - rods.position[v];
            let length_now = edge.norm();
            let tangent = edge / length_now;
            let mut length_before = length_now;
            if let Some(h) = history {
                let old = h.position[v + 1] - h.position[v];
                length_before = old.norm();
                edge += (old - edge) * scheme.previous;
                rate += (h.twist_rate[e] - rate) * scheme.previous;
                theta += (h.twist_angle[e] - theta) * scheme.previous;
            }
            data.diagonal[3][l] = inertia * inv_tau * inv_tau;
            data.linear[3][l] = inertia * inv_tau * rate + torque;
            self.u[i][3][l] = tau * rods.twist_rate[e];
            data.theta[l] = theta;
            for c in 0..3 {
                data.edge[c][l] = edge[c];
            }
            let rest = rods.rest_length[e];
            shortest = shortest.min(rest);
            longest = longest.max(rest);
            let ks = stretch_stiffness(rods, s, i);
            let stretch_damp = damp / material.stretch_multiplier;
            data.stretch[l] = ks / rest * (1.0 + stretch_damp);
            let shifted = length_now + (length_before - length_now) * scheme.previous;
            data.length[l] = (rest + stretch_damp * shifted) / (1.0 + stretch_damp);
            stiff_force = stiff_force.max(ks * (1.0 + stretch_damp));
            energy += 0.5 * ks * (1.0 + stretch_damp) * rest;

            let d1 = rods.reference_director[e];
            let frame = &mut self.base[i];
            for c in 0..3 {
                frame.tangent[c][l] = tangent[c];
                frame.director[c][l] = d1[c];
            }
            frame.reference_twist[l] = rods.reference_twist[v];
            if i > 0 {
                let (c0, c1, cm) = bend_twist_stiffness(rods, s, i);
                data.c0[l] = c0 * (1.0 + damp);
                data.c1[l] = c1 * (1.0 + damp);
                data.cm[l] = cm * (1.0 + damp_twist);
                let mut rest_k = rods.rest_curvature[v];
                let mut rest_m = rods.rest_twist[v];
                if viscous {
                    let (mut k, mut m) = rods.curvature_twist(s, i);
                    self.strain[i][4][l] = m;
                    for q in 0..4 {
                        self.strain[i][q][l] = k[q];
                    }
                    if let Some(h) = history {
                        for q in 0..4 {
                            k[q] += (h.strain[v][q] - k[q]) * scheme.previous;
                        }
                        m += (h.strain[v][4] - m) * scheme.previous;
                    }
                    for q in 0..4 {
                        rest_k[q] = (rest_k[q] + damp * k[q]) / (1.0 + damp);
                    }
                    rest_m = (rest_m + damp_twist * m) / (1.0 + damp_twist);
                }
                for q in 0..4 {
                    data.rest[q][l] = rest_k[q];
                }
                data.rest_twist[l] = rest_m;
                let bend = (c0 + c1) * (1.0 + damp);
                let around = cm * (1.0 + damp_twist) * (1.0 + theta.abs() + rods.reference_twist[v].abs());
                stiff_torque = stiff_torque.max(32.0 * f64::EPSILON * (bend + around));
                energy += bend * 4.0 + around * (1.0 + theta.abs());
                let arm = previous_tangent.dot(&tangent).min(1.0);
                let sharp = 2.0 / (1.0 + arm).max(1e-4);
                stiff_force = stiff_force.max(4.0 * (bend + around) * sharp / length_now.min(shortest));
            }
            previous_tangent = tangent;
        }
        for g in self.goals.iter().filter(|g| g.lane == source) {
            let v = first + g.vertex;
            let mut x = rods.position[v];
            if let Some(h) = history {
                x += (h.position[v] - x) * scheme.previous;
            }
            for c in 0..3 {
                self.data[g.vertex].diagonal[c][l] += g.stiffness;
                self.data[g.vertex].linear[c][l] += g.stiffness * (g.position[c] - x[c]);
            }
            strongest = strongest.max(g.stiffness * f64::EPSILON * g.position.amax());
        }
        // prescribed values
        if l == source {
            for k in 0..self.fixed_angles.len() {
                let (lane, edge, angle) = self.fixed_angles[k];
                if lane == l {
                    let target = self.angle_target(rods, s, lane, edge, angle);
                    self.fixed.push(FixedDof { lane, dof: 4 * edge + 3, target, reaction: 0.0, pending: 0.0 });
                }
            }
        }
        for k in 0..self.fixed.len() {
            let f = self.fixed[k];
            if f.lane != source {
                continue;
            }
            let predicted = self.predicted(rods, scheme, s, f.dof);
            let mut du = f.target - predicted;
            if scheme.is_midpoint() {
                du *= 0.5;
            }
            self.u[f.dof / 4][f.dof % 4][l] = du;
            if f.dof % 4 < 3 {
                fastest = fastest.max(du.abs() * inv_tau);
            } else {
                spin = spin.max(du.abs() * inv_tau);
            }
        }
        let thick = rods.radius[first..first + nv].iter().fold(0.0f64, |m, r| m.max(r[0]).max(r[1]));
        let scale = strongest.max(heaviest * fastest * inv_tau);
        self.tolerance[l] = Tolerance {
            force: relative * scale + 32.0 * f64::EPSILON * stiff_force,
            torque: relative * (scale * thick + inertia_max * spin * inv_tau) + stiff_torque,
            energy: 64.0 * f64::EPSILON * f64::EPSILON * energy,
            displacement: 1e-12 * longest,
            per_displacement: [32.0 * f64::EPSILON * stiff_force / shortest, stiff_torque / shortest],
        };
    }

    /// Predicted value of a degree of freedom, from which `u` is measured.
    pub fn predicted(&self, rods: &RodSet, scheme: &Scheme, strand: usize, dof: usize) -> f64 {
        let (i, c) = (dof / 4, dof % 4);
        let history = rods.history.as_ref().filter(|_| scheme.previous != 0.0);
        if c < 3 {
            let v = rods.first_vertex[strand] + i;
            let x = rods.position[v][c];
            history.map_or(x, |h| x + (h.position[v][c] - x) * scheme.previous)
        } else {
            let e = rods.edges(strand).start + i;
            let x = rods.twist_angle[e];
            history.map_or(x, |h| x + (h.twist_angle[e] - x) * scheme.previous)
        }
    }

    fn angle_target(&self, rods: &RodSet, s: usize, lane: usize, edge: usize, angle: FixedAngle) -> f64 {
        let e = rods.edges(s).start + edge;
        let present = rods.twist_angle[e];
        match angle {
            FixedAngle::Angle(a) => a,
            FixedAngle::Director(m1) => {
                let first = rods.first_vertex[s];
                let end = |i: usize| -> Vector3<f64> {
                    let mut x = rods.position[first + i];
                    for f in self.fixed.iter().filter(|f| f.lane == lane && f.dof / 4 == i && f.dof % 4 < 3) {
                        x[f.dof % 4] = f.target;
                    }
                    x
                };
                let (from, _) = rods.tangent(s, edge);
                let chord = end(edge + 1) - end(edge);
                let to = chord / chord.norm();
                let director = m1 - to * to.dot(&m1);
                angle_of_director(&director, &rods.reference_director[e], &from, &to, present)
            }
        }
    }

    /// Removes the prescribed entries from a gradient, remembering them as forces to come.
    pub fn mask_gradient(fixed: &mut [FixedDof], count: usize, gradient: &mut [[F4; 4]]) {
        for f in fixed {
            let g = &mut gradient[f.dof / 4][f.dof % 4];
            f.pending = g[f.lane];
            g[f.lane] = 0.0;
            if f.lane == 0 {
                for l in count..4 {
                    g[l] = 0.0;
                }
            }
        }
    }

    /// Turns the rows and columns of prescribed entries into those of the identity.
    pub fn mask_band(fixed: &[FixedDof], count: usize, band: &mut BatchedBand<W>) {
        let n = band.columns.len();
        for f in fixed {
            let mut clear = |l: usize| {
                band.columns[f.dof][0][l] = 1.0;
                for i in 1..W {
                    if f.dof + i < n {
                        band.columns[f.dof][i][l] = 0.0;
                    }
                    if f.dof >= i {
                        band.columns[f.dof - i][i][l] = 0.0;
                    }
                }
            };
            clear(f.lane);
            if f.lane == 0 {
                (count..4).for_each(clear);
            }
        }
    }
}

/// The parts of the state of one strand that an accepted step changes.
pub(crate) struct StrandMut<'a> {
    pub position: &'a mut [Vector3<f64>],
    pub velocity: &'a mut [Vector3<f64>],
    pub reference_twist: &'a mut [f64],
    pub twist_angle: &'a mut [f64],
    pub twist_rate: &'a mut [f64],
    pub reference_director: &'a mut [Vector3<f64>],
    /// Positions and velocities, angles and rates, strains before the step, where a two-step scheme keeps them.
    pub history: Option<HistoryMut<'a>>,
}

pub(crate) struct HistoryMut<'a> {
    pub position: &'a mut [Vector3<f64>],
    pub velocity: &'a mut [Vector3<f64>],
    pub twist_angle: &'a mut [f64],
    pub twist_rate: &'a mut [f64],
    pub strain: &'a mut [[f64; 5]],
}

impl Group {
    /// Writes the end-of-step state of lane `l`.
    pub fn scatter(&self, l: usize, scheme: &Scheme, out: StrandMut, had_history: bool) {
        let nv = self.nv;
        let inv_tau = 1.0 / scheme.tau;
        let midpoint = scheme.is_midpoint();
        let two_step = had_history && scheme.previous != 0.0;
        let StrandMut { position, velocity, reference_twist, twist_angle, twist_rate, reference_director, history } =
            out;
        let mut history = history;
        for i in 0..nv {
            let u = Vector3::new(self.u[i][0][l], self.u[i][1][l], self.u[i][2][l]);
            let (x, v) = (position[i], velocity[i]);
            if midpoint {
                position[i] = x + u * 2.0;
                velocity[i] = u * (2.0 * inv_tau) - v;
            } else {
                let mut start = x;
                if let (true, Some(h)) = (two_step, &history) {
                    start += (h.position[i] - x) * scheme.previous;
                }
                position[i] = start + u;
                velocity[i] = u * inv_tau;
            }
            if let Some(h) = &mut history {
                h.position[i] = x;
                h.velocity[i] = v;
                if !self.strain.is_empty() {
                    h.strain[i] = std::array::from_fn(|q| self.strain[i][q][l]);
                }
            }
            if i + 1 == nv {
                break;
            }
            let (a, r) = (twist_angle[i], twist_rate[i]);
            let du = self.u[i][3][l];
            if midpoint {
                twist_angle[i] = a + 2.0 * du;
                twist_rate[i] = 2.0 * du * inv_tau - r;
            } else {
                let mut start = a;
                if let (true, Some(h)) = (two_step, &history) {
                    start += (h.twist_angle[i] - a) * scheme.previous;
                }
                twist_angle[i] = start + du;
                twist_rate[i] = du * inv_tau;
            }
            if let Some(h) = &mut history {
                h.twist_angle[i] = a;
                h.twist_rate[i] = r;
            }
            let frame = &self.base[i];
            reference_director[i] = Vector3::new(frame.director[0][l], frame.director[1][l], frame.director[2][l]);
            if i > 0 {
                reference_twist[i] = frame.reference_twist[l];
            }
        }
        for f in self.fixed.iter().filter(|f| f.lane == l) {
            // exactly, so that a held vertex does not creep by round-off
            if f.dof % 4 < 3 {
                position[f.dof / 4][f.dof % 4] = f.target;
            } else {
                twist_angle[f.dof / 4] = f.target;
            }
        }
        if midpoint {
            self.carry_frames(l, position, reference_director, reference_twist);
        }
    }

    /// Carries the frames of the middle of the step to its end.
    fn carry_frames(
        &self,
        l: usize,
        position: &[Vector3<f64>],
        reference_director: &mut [Vector3<f64>],
        reference_twist: &mut [f64],
    ) {
        use constitutive::curvature::reference_twist as twist;
        use numerics::lanes::V3;
        let mut before = (Vector3::zeros(), Vector3::zeros());
        for i in 0..self.nv - 1 {
            let e = position[i + 1] - position[i];
            let t = e / e.norm();
            let frame = &self.base[i];
            let middle = Vector3::new(frame.tangent[0][l], frame.tangent[1][l], frame.tangent[2][l]);
            let (d, _) = parallel_transport(&reference_director[i], &middle, &t);
            let d = (d - t * t.dot(&d)).normalize();
            reference_director[i] = d;
            if i > 0 {
                let (t0, d0) = before;
                reference_twist[i] =
                    twist(frame.reference_twist[l], V3(d0.into()), V3(t0.into()), V3(d.into()), V3(t.into()));
            }
            before = (t, d);
        }
    }
}

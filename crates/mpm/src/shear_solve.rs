//! The implicit shear solve of stage 6: momentum of the faces under body force, shear stress, drag and pressure gradient.
//!
//! One Newton step of backward Euler about a reference motion `u_ref` (the motion of the last step) reads
//! `(M + dt 𝒟 + M^τ + dt² H)(u − u_ref) = dt (M g + f − dt H u_ref + 𝒟 (u_s − u_ref) − V ∇p) + added momentum − M^τ u_ref`,
//! where `H` is the tangent about `u_ref` and `f` the force of the stress carried back to no motion. Faces at walls are tied to faces in front of them; stress and tangent are
//! restricted to motions that obey the ties, so the system stays symmetric. Source: spec (6.3), (6.6), (6.7); Δ-form and ties are ours.

use crate::LiquidError;
use crate::arrays;
use crate::grid::LiquidGrid;
use crate::material::LiquidMaterial;
use crate::particles::Particles;
use crate::pressure_solve::{PressureReport, PressureSolver, Room};
use crate::settings::{LiquidSettings, ShearOperator, ShearSettings, Tangent};
use crate::shear_operator::{OperatorScratch, apply_particles, diagonal_particles};
use crate::shear_quadrature::Quadrature;
use crate::shear_state::{ShearState, linearise_particle, velocity_gradients};
use numerics::pcg::{self, PcgScratch, PreconditionedSystem};
use numerics::report::{SolveReport, Status};
use numerics::tensor::{Tensor, Vector, deviator, symmetric_part};
use particle_grid::{Contribution, Lanes, NONE, mac_offset, scatter};
use serde::{Deserialize, Serialize};

/// Share of its own mass that a face keeps at least when faces behind a wall, which move against it, are tied to it.
const LEAST_SHARE: f64 = 0.1;

/// Largest `4 dt² ι/(ρ dx²)`, with ι the elastic tangent, at which products through points in cells are safe.
///
/// Elastic forces come from the particles. A motion that the particles resist (by at most this ratio to its inertia) and the points do
/// not see is integrated explicitly, which is stable up to four. Beyond it such motions, at thinly sampled edges, would grow.
pub const SAFE_STIFFNESS: f64 = 4.0;
/// Shear energy of the pressure's last correction, over the kinetic energy, above which shear and pressure are solved once more.
const DISTURBED: f64 = 1e-2;
/// One particle in so many is asked how far its stress has left the linearisation.
const SAMPLED: usize = 8;
/// Rounds of shear and pressure at most, after the first.
const MOST_ROUNDS: usize = 8;

/// What other phases do to the faces, one slice per direction with one entry per node. Absent parts cost nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct FaceCoupling<'a, const D: usize> {
    /// Mass that moves with the face besides the liquid's own, and its momentum at the start of the step [kg], [kg m/s].
    pub added: Option<Added<'a, D>>,
    /// Drag coefficient [kg/s] and the velocity it pulls towards [m/s].
    pub drag: Option<Drag<'a, D>>,
}

/// Mass and momentum that join the faces.
#[derive(Clone, Copy, Debug)]
pub struct Added<'a, const D: usize> {
    /// Mass [kg].
    pub mass: [&'a [f64]; D],
    /// Momentum [kg m/s].
    pub momentum: [&'a [f64]; D],
}

/// Drag towards another phase.
#[derive(Clone, Copy, Debug)]
pub struct Drag<'a, const D: usize> {
    /// Coefficient [kg/s].
    pub coefficient: [&'a [f64]; D],
    /// Velocity of the other phase [m/s].
    pub velocity: [&'a [f64]; D],
}

/// What a shear solve says.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShearReport {
    /// The linear solves, added up; the residual is relative in the Euclidean norm.
    pub solve: SolveReport,
    /// Newton iterations.
    pub newton_iterations: usize,
    /// Relative residual of the nonlinear problem after the last iteration; zero where only one was asked for.
    pub nonlinear_residual: f64,
    /// Whether the symmetric tangent broke down and the positive definite one took over.
    pub fell_back: bool,
    /// Whether the system was diagonal: nothing resists shear.
    pub diagonal: bool,
}

/// The shear solve with everything it keeps between calls.
#[derive(Clone, Debug, Default)]
pub struct ShearSolver<const D: usize> {
    /// Stress and tangent of the particles.
    pub state: ShearState<D>,
    quadrature: Quadrature<D>,
    operator: OperatorScratch,
    krylov: PcgScratch,
    /// Mass of the system, liquid, carried and added, plus drag [kg]; zero for faces without a motion of their own.
    mass: Vec<f64>,
    /// Liquid mass and volume that move with each face, carried ones included [kg], [m³].
    liquid: Vec<[f64; 2]>,
    /// Force of the shear stress at the reference motion, ties folded [N].
    reference_force: Vec<f64>,
    inverse_diagonal: Vec<f64>,
    start: Vec<f64>,
    reference: Vec<f64>,
    delta: Vec<f64>,
    rhs: Vec<f64>,
    work: Vec<f64>,
    /// Forces that answer `work`.
    force: Vec<f64>,
    /// Faces that move on their own: the unknowns of the linear solves, few of all faces of a thin stream's blocks.
    active: Vec<u32>,
    /// Right-hand side and solution of these.
    active_rhs: Vec<f64>,
    active_delta: Vec<f64>,
    values: Vec<Vector<D>>,
    gradients: Vec<Tensor<D>>,
    resists: bool,
    /// Faces without liquid that points in cells see, and the faces whose motion they show.
    ghosts: Vec<Ghost>,
    /// The operator of this step: never [`ShearOperator::Automatic`].
    chosen: ShearOperator,
    /// Nothing has been solved since [`ShearSolver::begin`].
    fresh: bool,
}

/// Sets tied faces from the faces they follow; `prescribed` includes what walls add.
fn expand<const D: usize>(grid: &LiquidGrid<D>, v: &mut [f64], prescribed: bool) {
    let n = grid.blocks.node_count();
    for t in &grid.ties {
        let base = t.axis as usize * n;
        let followed = if t.source == NONE { 0.0 } else { t.ratio * v[base + t.source as usize] };
        v[base + t.face as usize] = followed + if prescribed { t.offset } else { 0.0 };
    }
}

/// Gives what acts on tied faces to the faces they follow.
fn fold<const D: usize>(grid: &LiquidGrid<D>, v: &mut [f64]) {
    let n = grid.blocks.node_count();
    for t in &grid.ties {
        let base = t.axis as usize * n;
        let value = std::mem::take(&mut v[base + t.face as usize]);
        if t.source != NONE {
            v[base + t.source as usize] += t.ratio * value;
        }
    }
}

/// A face without liquid that shows the motion of one beside it.
///
/// Points in cells reach faces that no particle of the cell reaches. Left at zero, these would hold the liquid to the frame of the grid; with
/// the motion of their neighbours a common velocity is free of stress again, and the forces on them go to those.
#[derive(Clone, Copy, Debug)]
struct Ghost {
    /// Place in the arrays of all components.
    face: u32,
    /// Place of the face that it shows.
    source: u32,
}

/// Lets faces without liquid show the motion of those beside them.
fn show(ghosts: &[Ghost], v: &mut [f64]) {
    for g in ghosts {
        v[g.face as usize] = v[g.source as usize];
    }
}

/// Gives what acts on them to those, and leaves nothing.
fn give_back(ghosts: &[Ghost], v: &mut [f64]) {
    for g in ghosts {
        let value = std::mem::take(&mut v[g.face as usize]);
        v[g.source as usize] += value;
    }
}

/// Imposes the ties on the face velocities: each source takes the velocity that fits its own momentum and that of the faces tied
/// to it best (least kinetic energy of the difference); ties follow.
///
/// At a wall that lets the liquid slip this is the common velocity; at one that holds it, the velocity whose mirror image the
/// faces behind the wall show.
pub fn impose_walls<const D: usize>(grid: &mut LiquidGrid<D>) {
    // (mass, momentum) that the ties add to each source.
    let mut gathered: Vec<(u8, u32, f64, f64)> = Vec::with_capacity(grid.ties.len());
    for t in grid.ties.iter().filter(|t| t.source != NONE && t.ratio != 0.0) {
        let face = &grid.face[t.axis as usize];
        let m = t.ratio * face.mass[t.face as usize];
        gathered.push((t.axis, t.source, t.ratio * m, m * (face.velocity[t.face as usize] - t.offset)));
    }
    gathered.sort_by_key(|g| (g.0, g.1));
    let mut k = 0;
    while k < gathered.len() {
        let (axis, source, ..) = gathered[k];
        let face = &mut grid.face[axis as usize];
        let s = source as usize;
        let (mut mass, mut momentum) = (face.mass[s], face.mass[s] * face.velocity[s]);
        while k < gathered.len() && (gathered[k].0, gathered[k].1) == (axis, source) {
            mass += gathered[k].2;
            momentum += gathered[k].3;
            k += 1;
        }
        face.velocity[s] = momentum / mass;
    }
    follow_walls(grid);
}

/// The system of the faces that move on their own; what the others do follows from these.
struct System<'a, const D: usize> {
    /// Places of the unknowns in the arrays of all components.
    active: &'a [u32],
    ghosts: &'a [Ghost],
    particles: &'a Particles<D>,
    grid: &'a LiquidGrid<D>,
    state: &'a ShearState<D>,
    quadrature: &'a Quadrature<D>,
    operator: &'a mut OperatorScratch,
    mass: &'a [f64],
    inverse_diagonal: &'a [f64],
    /// All faces: a motion, zero but for the unknowns and what follows them, and the forces that answer it.
    work: &'a mut Vec<f64>,
    force: &'a mut Vec<f64>,
    dt2: f64,
    which: ShearOperator,
}

impl<const D: usize> PreconditionedSystem for System<'_, D> {
    fn apply(&mut self, v: &[f64], out: &mut [f64]) {
        for (&k, v) in self.active.iter().zip(v) {
            self.work[k as usize] = *v;
        }
        expand(self.grid, self.work, false);
        show(self.ghosts, self.work);
        match self.which {
            ShearOperator::Particles => {
                apply_particles(self.particles, self.state, self.grid, self.work, self.force, self.operator);
            }
            _ => self.quadrature.apply(self.grid, self.work, self.force, self.operator),
        }
        give_back(self.ghosts, self.force);
        fold(self.grid, self.force);
        for ((o, v), &k) in out.iter_mut().zip(v).zip(self.active) {
            *o = self.mass[k as usize] * v + self.dt2 * self.force[k as usize];
        }
    }

    fn precondition(&mut self, r: &[f64], z: &mut [f64]) {
        for ((z, r), &k) in z.iter_mut().zip(r).zip(self.active) {
            *z = r * self.inverse_diagonal[k as usize];
        }
    }
}

impl<const D: usize> ShearSolver<D> {
    /// Lends the memory of the stresses to the sort of the next step: it needs room for one tensor per particle when nobody needs
    /// stresses yet. [`ShearSolver::reclaim`] brings it back; without either both hold their own.
    pub fn lend(&mut self, grid: &mut LiquidGrid<D>) {
        if grid.sort.tensors.capacity() == 0 {
            std::mem::swap(&mut self.state.stress, &mut grid.sort.tensors);
        }
    }

    /// Takes back, or over, the memory that [`ShearSolver::lend`] lends.
    pub fn reclaim(&mut self, grid: &mut LiquidGrid<D>) {
        if self.state.stress.capacity() == 0 {
            std::mem::swap(&mut self.state.stress, &mut grid.sort.tensors);
        }
    }

    /// Linearises the stress of all particles about their own affine matrices, before they are scattered. Returns whether
    /// anything resists shear: if so, hand `state` to [`crate::particles_to_grid::particles_to_grid`].
    ///
    /// # Errors
    /// Where a particle deforms too much in one step.
    pub fn prepare(
        &mut self,
        particles: &Particles<D>,
        materials: &[LiquidMaterial],
        dt: f64,
        settings: &ShearSettings,
    ) -> Result<bool, LiquidError> {
        compiled::prepare(self, particles, materials, dt, settings)
    }

    fn prepare_any(
        &mut self,
        particles: &Particles<D>,
        materials: &[LiquidMaterial],
        dt: f64,
        settings: &ShearSettings,
    ) -> Result<bool, LiquidError> {
        self.resists = settings.enabled && materials.iter().any(LiquidMaterial::resists_shear);
        if self.resists {
            self.state.build(particles, materials, &particles.affine, dt, settings.tangent)?;
        }
        Ok(self.resists)
    }

    /// Remembers the velocities of the faces, after the walls were imposed, as the start of the step, and builds the system.
    pub fn begin(
        &mut self,
        particles: &Particles<D>,
        grid: &LiquidGrid<D>,
        coupling: &FaceCoupling<'_, D>,
        dt: f64,
        settings: &ShearSettings,
    ) {
        compiled::begin(self, particles, grid, coupling, dt, settings)
    }

    fn begin_any(
        &mut self,
        particles: &Particles<D>,
        grid: &LiquidGrid<D>,
        coupling: &FaceCoupling<'_, D>,
        dt: f64,
        settings: &ShearSettings,
    ) {
        let n = grid.blocks.node_count();
        self.start.clear();
        self.mass.clear();
        self.liquid.clear();
        arrays::room(&mut self.liquid, D * n);
        arrays::resize(&mut self.force, D * n, 0.0);
        for array in [&mut self.start, &mut self.mass, &mut self.reference, &mut self.inverse_diagonal, &mut self.work]
        {
            arrays::room(array, D * n);
        }
        for face in &grid.face {
            self.start.extend_from_slice(&face.velocity);
            self.liquid.extend(
                face.mass.iter().zip(&face.volume).map(|(&m, &v)| if m > grid.mass_floor { [m, v] } else { [0.0; 2] }),
            );
        }
        // What acts on tied faces acts on their sources through the ratio, as for stress; inertia is lumped the same way, so
        // that liquid at rest under its pressure stays at rest.
        let own: Vec<[f64; 2]> = grid
            .ties
            .iter()
            .map(|t| if t.source == NONE { [0.0; 2] } else { self.liquid[t.axis as usize * n + t.source as usize] })
            .collect();
        for t in &grid.ties {
            let base = t.axis as usize * n;
            let [m, v] = std::mem::take(&mut self.liquid[base + t.face as usize]);
            if t.source != NONE {
                let source = &mut self.liquid[base + t.source as usize];
                source[0] += t.ratio * m;
                source[1] += t.ratio * v;
            }
        }
        for (t, own) in grid.ties.iter().zip(own) {
            if t.source != NONE {
                let source = &mut self.liquid[t.axis as usize * n + t.source as usize];
                if source[0] < LEAST_SHARE * own[0] {
                    *source = own.map(|x| x * LEAST_SHARE);
                }
            }
        }
        self.mass.extend(self.liquid.iter().map(|l| l[0]));
        for a in 0..D {
            let mass = &mut self.mass[a * n..(a + 1) * n];
            if let Some(added) = coupling.added {
                for (m, x) in mass.iter_mut().zip(added.mass[a]) {
                    *m += if *m > 0.0 { *x } else { 0.0 };
                }
            }
            if let Some(drag) = coupling.drag {
                for (m, x) in mass.iter_mut().zip(drag.coefficient[a]) {
                    *m += if *m > 0.0 { dt * x } else { 0.0 };
                }
            }
        }
        self.active.clear();
        self.active.extend((0..self.mass.len() as u32).filter(|&k| self.mass[k as usize] > 0.0));
        self.fresh = true;
        let dx = grid.lattice().dx;
        self.chosen = match settings.operator {
            ShearOperator::Automatic if 4.0 * dt * dt * self.state.wave <= SAFE_STIFFNESS * dx * dx => {
                ShearOperator::CellQuadrature
            }
            ShearOperator::Automatic => ShearOperator::Particles,
            fixed => fixed,
        };
        self.find_ghosts(grid);
        self.reference.clone_from(&self.start);
        show(&self.ghosts, &mut self.reference);
        self.delta.clear();
        arrays::resize(&mut self.delta, D * n, 0.0);
        self.build_system(particles, grid, dt);
    }

    /// Finds the faces without liquid beside faces that have some: where points in cells act, these are in their reach.
    fn find_ghosts(&mut self, grid: &LiquidGrid<D>) {
        self.ghosts.clear();
        if !self.resists || self.chosen != ShearOperator::CellQuadrature {
            return;
        }
        let n = grid.blocks.node_count();
        for a in 0..D {
            let mass = &grid.face[a].mass;
            // One direction after the other: faces across an edge or a corner show what the face between shows. Of two
            // neighbours along a direction the lower one is shown.
            let mut shown = vec![NONE; n];
            let mut showing: Vec<u32> = (0..n as u32).filter(|&i| mass[i as usize] > grid.mass_floor).collect();
            for &i in &showing {
                shown[i as usize] = i;
            }
            for axis in 0..D {
                let before = showing.len();
                for side in [1, -1] {
                    for k in 0..before {
                        let i = showing[k];
                        let o = grid.blocks.along(i as usize, axis, side);
                        if o != NONE && shown[o as usize] == NONE {
                            shown[o as usize] = shown[i as usize];
                            showing.push(o);
                        }
                    }
                }
            }
            for (i, source) in shown.iter().enumerate() {
                if *source != NONE && *source as usize != i {
                    let base = (a * n) as u32;
                    self.ghosts.push(Ghost { face: base + i as u32, source: base + source });
                }
            }
        }
    }

    fn build_system(&mut self, particles: &Particles<D>, grid: &LiquidGrid<D>, dt: f64) {
        let n = grid.blocks.node_count();
        let mut diagonal = std::mem::take(&mut self.work);
        diagonal.clear();
        diagonal.resize(D * n, 0.0);
        if self.resists {
            match self.chosen {
                ShearOperator::Particles => {
                    diagonal_particles(particles, &self.state, grid, &mut diagonal, &mut self.operator);
                }
                _ => {
                    self.quadrature.build(particles, &self.state, grid);
                    self.quadrature.diagonal(grid, &mut diagonal, &mut self.operator);
                }
            }
        }
        give_back(&self.ghosts, &mut diagonal);
        for t in &grid.ties {
            let base = t.axis as usize * n;
            let d = std::mem::take(&mut diagonal[base + t.face as usize]);
            if t.source != NONE {
                diagonal[base + t.source as usize] += t.ratio * t.ratio * d;
            }
        }
        for (d, m) in diagonal.iter_mut().zip(&self.mass) {
            // The geometric part may make an entry negative; the preconditioner must not.
            *d = if *m > 0.0 { m + dt * dt * d.max(0.0) } else { 0.0 };
        }
        self.inverse_diagonal.clear();
        self.inverse_diagonal.extend(diagonal.iter().map(|&d| if d > 0.0 { 1.0 / d } else { 0.0 }));
        self.work = diagonal;
        self.reference_force.clear();
        arrays::resize(&mut self.reference_force, D * n, 0.0);
        if self.resists {
            match self.chosen {
                ShearOperator::Particles => apply_particles(
                    particles,
                    &self.state,
                    grid,
                    &self.reference,
                    &mut self.reference_force,
                    &mut self.operator,
                ),
                _ => {
                    self.quadrature.apply(grid, &self.reference, &mut self.reference_force, &mut self.operator);
                }
            }
            for a in 0..D {
                let force = &mut self.reference_force[a * n..(a + 1) * n];
                for (f, s) in force.iter_mut().zip(&grid.face[a].shear_force) {
                    *f = s - dt * *f;
                }
            }
            give_back(&self.ghosts, &mut self.reference_force);
            fold(grid, &mut self.reference_force);
        }
    }

    /// Solves for the face velocities and writes them to the grid.
    ///
    /// - `body`: acceleration by body forces [m/s²]
    /// - `with_pressure`: whether the grid's pressure gradient acts (the solve after the pressure)
    ///
    /// # Errors
    /// Where numbers are not finite, or a particle deforms too much during Newton iterations.
    #[expect(clippy::too_many_arguments, reason = "one argument per physical ingredient of the momentum balance")]
    pub fn solve(
        &mut self,
        particles: &Particles<D>,
        materials: &[LiquidMaterial],
        grid: &mut LiquidGrid<D>,
        coupling: &FaceCoupling<'_, D>,
        body: &Vector<D>,
        dt: f64,
        with_pressure: bool,
        settings: &ShearSettings,
    ) -> Result<ShearReport, LiquidError> {
        compiled::solve(self, particles, materials, grid, coupling, body, dt, with_pressure, settings)
    }

    #[expect(clippy::too_many_arguments, reason = "one argument per physical ingredient of the momentum balance")]
    fn solve_any(
        &mut self,
        particles: &Particles<D>,
        materials: &[LiquidMaterial],
        grid: &mut LiquidGrid<D>,
        coupling: &FaceCoupling<'_, D>,
        body: &Vector<D>,
        dt: f64,
        with_pressure: bool,
        settings: &ShearSettings,
    ) -> Result<ShearReport, LiquidError> {
        let mut report = ShearReport {
            solve: SolveReport { tolerance: settings.pcg.tolerance, ..SolveReport::TRIVIAL },
            newton_iterations: 0,
            nonlinear_residual: 0.0,
            fell_back: false,
            diagonal: !self.resists,
        };
        // Viscosity alone is linear: one solve does.
        let elastic = self.resists && materials.iter().any(|m| m.law.is_shear_elastic());
        let iterations = if elastic { settings.newton_iterations.max(1) } else { 1 };
        let mut first_size = 0.0;
        for iteration in 0..iterations {
            if iteration > 0 {
                self.relinearise(particles, materials, grid, dt, settings)?;
            }
            self.right_hand_side(grid, coupling, body, dt, with_pressure);
            let size = numerics::reduce::norm(&self.rhs);
            if iteration == 0 {
                first_size = size;
            } else {
                report.nonlinear_residual = if first_size > 0.0 { size / first_size } else { 0.0 };
                if report.nonlinear_residual <= settings.newton_tolerance {
                    break;
                }
            }
            report.newton_iterations = iteration + 1;
            if std::mem::take(&mut self.fresh) {
                self.move_freely(grid, body, dt, with_pressure);
            }
            let solve = self.linear_solve(particles, materials, grid, dt, settings, &mut report)?;
            self.balance(grid, dt);
            report.solve = report.solve.combined(solve);
            let n = grid.blocks.node_count();
            let mut velocity = std::mem::take(&mut self.work);
            velocity.clear();
            velocity.extend(self.reference.iter().zip(&self.delta).map(|(r, d)| r + d));
            expand(grid, &mut velocity, true);
            for g in &self.ghosts {
                velocity[g.face as usize] = 0.0;
            }
            for a in 0..D {
                grid.face[a].velocity.copy_from_slice(&velocity[a * n..(a + 1) * n]);
            }
            self.work = velocity;
            if iteration == 0
                && iterations > 1
                && let Some(error) = self.estimated_error(particles, materials, grid, dt, settings, size)
                && error <= settings.newton_tolerance * size
            {
                report.nonlinear_residual = if size > 0.0 { error / size } else { 0.0 };
                break;
            }
        }
        Ok(report)
    }

    /// Nonlinear residual after the first iteration [N s], estimated from above without linearising anew. `None` where the operator cannot tell.
    ///
    /// At first a bound: whatever the liquid does, its stress cannot have left the linearisation by more than what it would have changed by if
    /// nothing had flowed. Where that is too much, the law is asked at some of the particles how much of it came true.
    fn estimated_error(
        &mut self,
        particles: &Particles<D>,
        materials: &[LiquidMaterial],
        grid: &LiquidGrid<D>,
        dt: f64,
        settings: &ShearSettings,
        size: f64,
    ) -> Option<f64> {
        if self.chosen != ShearOperator::CellQuadrature {
            return None;
        }
        self.work.clear();
        self.work.extend_from_slice(&self.delta);
        expand(grid, &mut self.work, false);
        show(&self.ghosts, &mut self.work);
        self.quadrature.apply_elastic(grid, &self.work, &mut self.force, &mut self.operator);
        let bound = dt * dt * numerics::reduce::norm(&self.force);
        if bound <= settings.newton_tolerance * size {
            return Some(bound);
        }
        let n = grid.blocks.node_count();
        let change: [&[f64]; D] = std::array::from_fn(|a| &self.work[a * n..(a + 1) * n]);
        let state = &self.state;
        // Squares of what the linearisation is off by, and of what the stress would have changed by if nothing had flowed.
        let judge = |p: usize, motion: &Tensor<D>, change: &Tensor<D>| {
            let volume = particles.rest_volume[p];
            let tangent = &state.tangent[p];
            let change = symmetric_part(change);
            let elastic = deviator(&change).norm() * tangent.elastic * dt * volume;
            let error = match linearise_particle(particles, materials, p, motion, dt, settings.tangent) {
                Ok((stress, now)) => {
                    (stress - state.stress[p] + (now.apply(motion) - tangent.apply(motion)) * dt).norm() * volume
                }
                // A motion that the law refuses is for the iteration to find.
                Err(_) => f64::INFINITY,
            };
            [error * error, elastic * elastic]
        };
        let [error, elastic] = particle_grid::sum_over_some(
            &grid.blocks,
            &grid.order,
            &particles.position,
            SAMPLED,
            [grid.velocities(), change],
            LiquidGrid::<D>::offsets(),
            judge,
        );
        Some(if elastic > 0.0 { bound * (error / elastic).sqrt() } else { bound })
    }

    /// Whether the last correction by the pressure strained the liquid so much that shear has to be solved for again: the energy that it
    /// gave the shear, against the kinetic energy of the step.
    fn is_disturbed(&mut self, particles: &Particles<D>, grid: &LiquidGrid<D>, body: &Vector<D>, dt: f64) -> bool {
        let n = grid.blocks.node_count();
        self.work.clear();
        self.work.extend(self.reference.iter().zip(&self.delta).map(|(r, d)| r + d));
        expand(grid, &mut self.work, true);
        let mut kinetic = 0.0;
        for a in 0..D {
            let range = a * n..(a + 1) * n;
            let velocity = &grid.face[a].velocity;
            let fall = dt * body[a];
            for ((w, u), m) in self.work[range.clone()].iter_mut().zip(velocity).zip(&grid.face[a].mass) {
                *w = if *m > grid.mass_floor { u - *w } else { 0.0 };
            }
            for (m, u) in self.mass[range.clone()].iter().zip(&self.start[range]) {
                kinetic += m * (u * u + fall * fall);
            }
        }
        show(&self.ghosts, &mut self.work);
        match self.chosen {
            ShearOperator::Particles => {
                apply_particles(particles, &self.state, grid, &self.work, &mut self.force, &mut self.operator);
            }
            _ => self.quadrature.apply(grid, &self.work, &mut self.force, &mut self.operator),
        }
        let shear = dt * dt * numerics::reduce::dot(&self.force, &self.work);
        shear > DISTURBED * kinetic
    }

    /// Solves for shear and pressure in turn until the pressure no longer strains the liquid. One round does for soft liquids; where elastic waves
    /// cross many cells in a step, what the pressure moves would otherwise be stored as elastic energy that nothing supplied.
    /// Returns the reports of the last round and how many there were.
    ///
    /// To be called after [`PressureSolver::correct`].
    ///
    /// # Errors
    /// Those of the two solves.
    #[expect(clippy::too_many_arguments, reason = "one argument per physical ingredient of the momentum balance")]
    pub fn settle(
        &mut self,
        pressure: &mut PressureSolver<D>,
        particles: &Particles<D>,
        materials: &[LiquidMaterial],
        grid: &mut LiquidGrid<D>,
        body: &Vector<D>,
        room: Option<Room<'_, D>>,
        dt: f64,
        settings: &LiquidSettings,
    ) -> Result<Option<(ShearReport, PressureReport, usize)>, LiquidError> {
        compiled::settle(self, pressure, particles, materials, grid, body, room, dt, settings)
    }

    #[expect(clippy::too_many_arguments, reason = "one argument per physical ingredient of the momentum balance")]
    fn settle_any(
        &mut self,
        pressure: &mut PressureSolver<D>,
        particles: &Particles<D>,
        materials: &[LiquidMaterial],
        grid: &mut LiquidGrid<D>,
        body: &Vector<D>,
        room: Option<Room<'_, D>>,
        dt: f64,
        settings: &LiquidSettings,
    ) -> Result<Option<(ShearReport, PressureReport, usize)>, LiquidError> {
        let mut last = None;
        let dx = grid.lattice().dx;
        if !self.resists || 4.0 * dt * dt * self.state.wave <= SAFE_STIFFNESS * dx * dx {
            return Ok(None);
        }
        for round in 1..=MOST_ROUNDS {
            if !self.is_disturbed(particles, grid, body, dt) {
                break;
            }
            let coupling = FaceCoupling::default();
            let shear = self.solve(particles, materials, grid, &coupling, body, dt, true, &settings.shear)?;
            let corrected = pressure.correct(grid, room, dt, &settings.pressure)?;
            last = Some((shear, corrected, round));
        }
        Ok(last)
    }

    /// First guess of the step: everything moves freely under body force and, where it is known, pressure. What is left to the solve
    /// is then internal.
    fn move_freely(&mut self, grid: &LiquidGrid<D>, body: &Vector<D>, dt: f64, with_pressure: bool) {
        let n = grid.blocks.node_count();
        for a in 0..D {
            let mass = &self.mass[a * n..(a + 1) * n];
            for (d, m) in self.delta[a * n..(a + 1) * n].iter_mut().zip(mass) {
                *d = if *m > 0.0 { dt * body[a] } else { 0.0 };
            }
            if with_pressure {
                let liquid = &self.liquid[a * n..(a + 1) * n];
                let delta = &mut self.delta[a * n..(a + 1) * n];
                for ((d, [_, v]), (m, g)) in
                    delta.iter_mut().zip(liquid).zip(mass.iter().zip(&grid.face[a].pressure_gradient))
                {
                    *d -= if *m > 0.0 { dt * v / m * g } else { 0.0 };
                }
            }
        }
    }

    /// Gives back the momentum that stress took though it is internal: what the stopped iteration left in its residual, and forces
    /// on faces around the liquid that hold none of it, which points of the quadrature reach and nothing answers. Stress does not see a
    /// common velocity, so one is added per direction; at walls there is none to add.
    fn balance(&mut self, grid: &LiquidGrid<D>, dt: f64) {
        if !grid.ties.is_empty() || !self.resists {
            return;
        }
        let n = grid.blocks.node_count();
        for a in 0..D {
            let range = a * n..(a + 1) * n;
            let outside = self.rhs[range.clone()].iter().zip(&self.reference_force[range.clone()]);
            let moved = self.mass[range.clone()].iter().zip(&self.delta[range.clone()]);
            let left: f64 =
                outside.zip(moved).filter(|(_, (m, _))| **m > 0.0).map(|((r, f), (m, d))| r - dt * f - m * d).sum();
            let mass: f64 = self.mass[range.clone()].iter().sum();
            if mass > 0.0 {
                let common = left / mass;
                for (d, m) in self.delta[range.clone()].iter_mut().zip(&self.mass[range.clone()]) {
                    *d += if *m > 0.0 { common } else { 0.0 };
                }
            }
        }
    }

    /// Moves the point of linearisation to the current face velocities.
    fn relinearise(
        &mut self,
        particles: &Particles<D>,
        materials: &[LiquidMaterial],
        grid: &mut LiquidGrid<D>,
        dt: f64,
        settings: &ShearSettings,
    ) -> Result<(), LiquidError> {
        let mut gradients = std::mem::take(&mut self.gradients);
        velocity_gradients(particles, grid, grid.velocities(), &mut self.values, &mut gradients);
        let built = self.state.build(particles, materials, &gradients, dt, settings.tangent);
        self.gradients = gradients;
        built?;
        scatter_forces(particles, &self.state, grid);
        self.reference.clear();
        for a in 0..D {
            self.reference.extend_from_slice(&grid.face[a].velocity);
        }
        show(&self.ghosts, &mut self.reference);
        self.delta.fill(0.0);
        self.build_system(particles, grid, dt);
        Ok(())
    }

    fn right_hand_side(
        &mut self,
        grid: &LiquidGrid<D>,
        coupling: &FaceCoupling<'_, D>,
        body: &Vector<D>,
        dt: f64,
        with_pressure: bool,
    ) {
        let n = grid.blocks.node_count();
        self.rhs.clear();
        arrays::resize(&mut self.rhs, D * n, 0.0);
        for a in 0..D {
            let gradient = &grid.face[a].pressure_gradient;
            for i in 0..n {
                let k = a * n + i;
                if self.mass[k] <= 0.0 {
                    continue;
                }
                let [m, v] = self.liquid[k];
                let mut force = m * body[a] + self.reference_force[k];
                if with_pressure {
                    force -= v * gradient[i];
                }
                let reference = self.reference[k];
                let mut r = m * (self.start[k] - reference) + dt * force;
                if let Some(drag) = coupling.drag {
                    r += dt * drag.coefficient[a][i] * (drag.velocity[a][i] - reference);
                }
                if let Some(added) = coupling.added {
                    r += added.momentum[a][i] - added.mass[a][i] * reference;
                    r += dt * added.mass[a][i] * body[a];
                }
                self.rhs[k] = r;
            }
        }
    }

    fn linear_solve(
        &mut self,
        particles: &Particles<D>,
        materials: &[LiquidMaterial],
        grid: &LiquidGrid<D>,
        dt: f64,
        settings: &ShearSettings,
        report: &mut ShearReport,
    ) -> Result<SolveReport, LiquidError> {
        if !self.resists {
            for ((d, r), i) in self.delta.iter_mut().zip(&self.rhs).zip(&self.inverse_diagonal) {
                *d = r * i;
            }
            return if self.delta.iter().all(|d| d.is_finite()) {
                Ok(SolveReport { tolerance: settings.pcg.tolerance, ..SolveReport::TRIVIAL })
            } else {
                Err(LiquidError::NonFinite { solve: "shear" })
            };
        }
        let mut total: Option<SolveReport> = None;
        loop {
            self.work.clear();
            self.work.resize(self.mass.len(), 0.0);
            for (compact, all) in [(&mut self.active_rhs, &self.rhs), (&mut self.active_delta, &self.delta)] {
                compact.clear();
                arrays::room(compact, self.active.len());
                compact.extend(self.active.iter().map(|&k| all[k as usize]));
            }
            let mut system = System {
                active: &self.active,
                ghosts: &self.ghosts,
                particles,
                grid,
                state: &self.state,
                quadrature: &self.quadrature,
                operator: &mut self.operator,
                mass: &self.mass,
                inverse_diagonal: &self.inverse_diagonal,
                work: &mut self.work,
                force: &mut self.force,
                dt2: dt * dt,
                which: self.chosen,
            };
            let (rhs, delta) = (&self.active_rhs, &mut self.active_delta);
            let mut solve = pcg::solve_system(&mut system, rhs, delta, &mut self.krylov, &settings.pcg);
            for (&k, d) in self.active.iter().zip(&self.active_delta) {
                self.delta[k as usize] = *d;
            }
            if let Some(before) = total {
                solve.iterations += before.iterations;
            }
            match solve.status {
                Status::NonFinite => return Err(LiquidError::NonFinite { solve: "shear" }),
                Status::Breakdown if self.state.may_be_indefinite => {
                    // The geometric part made the operator indefinite: start again with the positive part alone.
                    let gradients =
                        if report.newton_iterations > 1 { std::mem::take(&mut self.gradients) } else { Vec::new() };
                    let about = if gradients.is_empty() { &particles.affine } else { &gradients };
                    self.state.build(particles, materials, about, dt, Tangent::PositiveDefinite)?;
                    if !gradients.is_empty() {
                        self.gradients = gradients;
                    }
                    self.delta.fill(0.0);
                    self.build_system(particles, grid, dt);
                    report.fell_back = true;
                    total = Some(solve);
                }
                _ => return Ok(solve),
            }
        }
    }

    /// Changes the momentum at the start of the step by impulses on the faces [N s], one list per direction with one entry per
    /// node, so that the same step can be solved again (an outer iteration with another phase). Linearisation and first guess
    /// stay those of the last solve.
    pub fn push(&mut self, grid: &LiquidGrid<D>, impulse: [&[f64]; D]) {
        let mut push = std::mem::take(&mut self.work);
        push.clear();
        for a in 0..D {
            push.extend_from_slice(impulse[a]);
        }
        fold(grid, &mut push);
        for ((start, r), [mass, _]) in self.start.iter_mut().zip(&push).zip(&self.liquid) {
            if *mass > 0.0 {
                *start += r / mass;
            }
        }
        self.work = push;
    }

    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.state.bytes()
            + self.quadrature.bytes()
            + self.operator.bytes()
            + self.krylov.bytes()
            + 8 * (self.mass.capacity()
                + self.inverse_diagonal.capacity()
                + self.start.capacity()
                + self.reference.capacity()
                + self.delta.capacity()
                + self.rhs.capacity()
                + self.work.capacity()
                + self.force.capacity()
                + self.active_rhs.capacity()
                + self.active_delta.capacity()
                + self.active.capacity() / 2
                + self.reference_force.capacity()
                + 2 * self.liquid.capacity())
            + self.values.capacity() * size_of::<Vector<D>>()
            + self.gradients.capacity() * size_of::<Tensor<D>>()
    }
}

/// Scatters the shear force of all particles anew.
fn scatter_forces<const D: usize>(particles: &Particles<D>, state: &ShearState<D>, grid: &mut LiquidGrid<D>) {
    let dx = grid.lattice().dx;
    let affine_inverse = 4.0 / (dx * dx);
    for a in 0..D {
        let give = |p: usize| {
            let factor = -particles.rest_volume[p] * affine_inverse;
            let stress = &state.stress[p];
            Contribution {
                value: Lanes::ZERO,
                gradient: std::array::from_fn(|b| Lanes([factor * stress[(a, b)], 0.0, 0.0, 0.0])),
            }
        };
        let offset = mac_offset(a);
        scatter(&grid.blocks, &grid.order, &particles.position, &offset, 0.0, give, &mut grid.scatter, &mut grid.lanes);
        for (force, lanes) in grid.face[a].shear_force.iter_mut().zip(&grid.lanes) {
            *force = lanes.0[0];
        }
    }
}

/// Sets the velocities of tied faces from the faces they follow.
pub fn follow_walls<const D: usize>(grid: &mut LiquidGrid<D>) {
    for k in 0..grid.ties.len() {
        let t = grid.ties[k];
        let face = &mut grid.face[t.axis as usize];
        let followed = if t.source == NONE { 0.0 } else { t.ratio * face.velocity[t.source as usize] };
        face.velocity[t.face as usize] = followed + t.offset;
    }
}

numerics::compile_here! {
    mod compiled {
        fn prepare(this: &mut ShearSolver<D>, particles: &Particles<D>, materials: &[LiquidMaterial], dt: f64, settings: &ShearSettings) -> Result<bool, LiquidError> = ShearSolver::prepare_any;
        fn begin(this: &mut ShearSolver<D>, particles: &Particles<D>, grid: &LiquidGrid<D>, coupling: &FaceCoupling<'_, D>, dt: f64, settings: &ShearSettings)  = ShearSolver::begin_any;
        fn solve(this: &mut ShearSolver<D>, particles: &Particles<D>, materials: &[LiquidMaterial], grid: &mut LiquidGrid<D>, coupling: &FaceCoupling<'_, D>, body: &Vector<D>, dt: f64, with_pressure: bool, settings: &ShearSettings) -> Result<ShearReport, LiquidError> = ShearSolver::solve_any;
        fn settle(this: &mut ShearSolver<D>, pressure: &mut PressureSolver<D>, particles: &Particles<D>, materials: &[LiquidMaterial], grid: &mut LiquidGrid<D>, body: &Vector<D>, room: Option<Room<'_, D>>, dt: f64, settings: &LiquidSettings) -> Result<Option<(ShearReport, PressureReport, usize)>, LiquidError> = ShearSolver::settle_any;
    }
}

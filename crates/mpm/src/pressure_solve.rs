//! The pressure solve of stage 6: volume rate, compressibility, free surface inside cells, open shares of faces, moving solids.
//!
//! Backward Euler of the pressure law with `u = u* − dt ∇p/ρ` gives, for every liquid cell (spec 6.8),
//! `[ω/(dt κg) + (dt/dx²) Σ ω_g/(ρ_g θ_g)] p − (dt/dx²) Σ (ω_g/ρ_g) p_nb = ω p^n/(dt κg) − div u*`.
//! Liquid whose volume is rigid loses the compliance term; regions closed on all sides then determine the pressure up to a
//! constant, which is removed, and the part of the right-hand side that no pressure can meet is reported.
//!
//! *Room.* Where others take room ([`Room`]) the common volume is kept, `∇·(ε_f u_f + ε_s u_s) = ε_f J̇/J`, row by row times `ε_f` of
//! the cell, so that the matrix stays symmetric: faces let the liquid through by their share, `ω_g ε_g/ρ_g` instead of `ω_g/ρ_g`, and
//! what the others carry through them joins the divergence. Nothing of it waits for the liquid's new velocity. The pressure moves the
//! others too; left out, that answer would come a step late, and where they take more room than the liquid leaves (`ε_s/ρ_s > ε_f/ρ_f`)
//! each step would overshoot the last. So it stands in the matrix, lumped: `ω_g (ε_g/ρ_g + y_g)`.
//!
//! *Prediction.* A shear solve that knows nothing of the pressure lets the liquid fall freely for a step, and walls that hold it
//! then drag on this motion: liquid at rest creeps, at up to `g dt` where it is viscous. The pressure of the free motion is therefore
//! found first, to a loose tolerance, and acts in the shear solve; what is left is solved for after it. With `p = p₁ + δ` and
//! velocities `u*` that know `p₁`, the remainder obeys the same operator:
//! `[…] δ − … = ω (p^n − p₁)/(dt κg) − div u*`.

use crate::LiquidError;
use crate::grid::{FaceFields, LiquidGrid};
use crate::settings::PressureSettings;
use numerics::multigrid::{Multigrid, MultigridReport, MultigridSettings};
use numerics::multigrid_system::{CellRow, CellSystem, NO_CELL, ZeroFace};
use numerics::report::Status;
use numerics::tensor::Vector;
use particle_grid::NONE;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Layers of faces outside the liquid that its particles can reach.
const CONTINUED_LAYERS: usize = 2;

/// Relative residual at which the prediction stops: it only has to tell the shear solve what the pressure will balance.
const PREDICTION_TOLERANCE: f64 = 1e-3;

/// What others than the liquid, strands for instance, take of the room, and how they move.
#[derive(Clone, Copy, Debug)]
pub struct Room<'a, const D: usize> {
    /// Share of each cell that they take [1].
    pub taken: &'a [f64],
    /// Share of each face that they leave to the liquid [1].
    pub left: [&'a [f64]; D],
    /// Volume that they carry through each face per area and time, as if no pressure acted on them in the step [m/s].
    pub flux: [&'a [f64]; D],
    /// By how much a pressure gradient speeds that flux up [m³/kg]; at least as much as it truly does keeps the step stable.
    pub yields: [&'a [f64]; D],
}

/// What a pressure solve says.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PressureReport {
    /// Iterations, residual, closed regions and what they could not meet.
    pub multigrid: MultigridReport,
    /// Largest magnitude of the divergence of the given velocities in liquid cells [1/s].
    pub max_divergence: f64,
    /// Largest pressure [Pa].
    pub max_pressure: f64,
}

/// The pressure solve with everything it keeps between calls.
#[derive(Clone, Debug, Default)]
pub struct PressureSolver<const D: usize> {
    system: CellSystem<D>,
    multigrid: Multigrid<D>,
    /// Unknown of each cell node, or [`NO_CELL`].
    unknown: Vec<u32>,
    /// Cell node of each unknown.
    node: Vec<u32>,
    rhs: Vec<f64>,
    solution: Vec<f64>,
    known: Vec<bool>,
    continued: Vec<(u32, f64)>,
    built: bool,
    /// Pressure and gradient that already act on the velocities, where [`Self::correct`] solves for the rest only.
    first: Option<First<D>>,
    spare: First<D>,
    /// Largest right-hand side of the first solve of the step: what tolerances are relative to [1/s].
    size: f64,
}

/// Pressure per unknown and its gradient per face.
#[derive(Clone, Debug)]
struct First<const D: usize> {
    pressure: Vec<f64>,
    gradient: [Vec<f64>; D],
}

impl<const D: usize> Default for First<D> {
    fn default() -> Self {
        Self { pressure: Vec::new(), gradient: std::array::from_fn(|_| Vec::new()) }
    }
}

impl<const D: usize> PressureSolver<D> {
    /// Finds the liquid cells and assembles the operator. The face masses, open shares and distances must be up to date.
    pub fn build(&mut self, grid: &LiquidGrid<D>, room: Option<Room<'_, D>>, dt: f64, settings: &PressureSettings) {
        compiled::build(self, grid, room, dt, settings)
    }

    fn build_any(&mut self, grid: &LiquidGrid<D>, room: Option<Room<'_, D>>, dt: f64, settings: &PressureSettings) {
        let n = grid.blocks.node_count();
        let dx = grid.lattice().dx;
        self.unknown.clear();
        self.unknown.resize(n, NO_CELL);
        self.node.clear();
        self.system.clear();
        for cell in 0..n {
            if grid.cell.liquid_distance[cell] < 0.0 && self.has_open_face(grid, cell) {
                self.unknown[cell] = self.node.len() as u32;
                self.node.push(cell as u32);
                self.system.cells.push(grid.blocks.cell(cell));
            }
        }
        let unknown = &self.unknown;
        let base = dt / (dx * dx);
        self.system.rows.resize(self.node.len(), CellRow::default());
        self.system.rows.par_iter_mut().zip(&self.node).with_min_len(512).for_each(|(row, &cell)| {
            *row = CellRow::default();
            let cell = cell as usize;
            let level = grid.cell.liquid_distance[cell];
            let mut open_sum = 0.0;
            for a in 0..D {
                for side in 0..2 {
                    let (face, other) = across(grid, cell, a, side);
                    let Some(face) = face else { continue };
                    let open = grid.face[a].open[face];
                    open_sum += open;
                    let (mass, volume) = (grid.face[a].mass[face], grid.face[a].volume[face]);
                    if open <= 0.0 || mass <= grid.mass_floor {
                        continue;
                    }
                    let conductance = match room {
                        None => base * open * volume / mass,
                        Some(room) => base * open * (room.left[a][face] * volume / mass + room.yields[a][face]),
                    };
                    let neighbour = other.map_or(NO_CELL, |o| unknown[o]);
                    if neighbour != NO_CELL {
                        row.neighbour[a][side] = neighbour;
                        row.conductance[a][side] = conductance;
                    } else {
                        let beyond = other.map_or(1.5 * dx, |o| grid.cell.liquid_distance[o].max(0.0));
                        let fraction = (level / (level - beyond)).clamp(settings.ghost_floor, 1.0);
                        row.zero[a][side] = ZeroFace { conductance, fraction };
                    }
                }
            }
            let share = (open_sum / (2.0 * D as f64)).min(1.0);
            let j = grid.cell.volume_ratio[cell].clamp(0.1, 10.0);
            row.own = share * grid.cell.compliance[cell] / (dt * 0.5 * (j + 1.0 / j));
            if let Some(room) = room {
                row.own *= 1.0 - room.taken[cell];
            }
        });
        self.multigrid.build(&self.system, &settings.multigrid);
        self.built = true;
        self.forget();
    }

    /// Forgets what [`Self::predict`] found.
    fn forget(&mut self) {
        if let Some(first) = self.first.take() {
            self.spare = first;
        }
    }

    /// Keeps the pressure on the grid as the part that acts already.
    fn remember(&mut self, grid: &LiquidGrid<D>) {
        self.forget();
        let mut first = std::mem::take(&mut self.spare);
        first.pressure.clear();
        first.pressure.extend(self.node.iter().map(|&cell| grid.cell.pressure[cell as usize]));
        for (kept, face) in first.gradient.iter_mut().zip(&grid.face) {
            kept.clone_from(&face.pressure_gradient);
        }
        self.first = Some(first);
    }

    /// Solves for the pressure of the free motion over the step, from the velocities at its start, and leaves its gradient on the
    /// faces for the shear solve. [`Self::correct`] finds the rest. The face velocities are those of the free motion afterwards.
    ///
    /// # Errors
    /// Where numbers are not finite.
    pub fn predict(
        &mut self,
        grid: &mut LiquidGrid<D>,
        body: &Vector<D>,
        room: Option<Room<'_, D>>,
        dt: f64,
        settings: &PressureSettings,
    ) -> Result<PressureReport, LiquidError> {
        compiled::predict(self, grid, body, room, dt, settings)
    }

    fn predict_any(
        &mut self,
        grid: &mut LiquidGrid<D>,
        body: &Vector<D>,
        room: Option<Room<'_, D>>,
        dt: f64,
        settings: &PressureSettings,
    ) -> Result<PressureReport, LiquidError> {
        let floor = grid.mass_floor;
        for (a, face) in grid.face.iter_mut().enumerate() {
            for (u, m) in face.velocity.iter_mut().zip(&face.mass) {
                *u += if *m > floor { dt * body[a] } else { 0.0 };
            }
        }
        crate::shear_solve::follow_walls(grid);
        let loose = MultigridSettings {
            tolerance: settings.multigrid.tolerance.max(PREDICTION_TOLERANCE),
            ..settings.multigrid
        };
        let report = self.solve(grid, room, dt, &PressureSettings { multigrid: loose, ..*settings })?;
        self.remember(grid);
        Ok(report)
    }

    /// Solves for what is left of the pressure after velocities were found that know the pressure on the grid (of
    /// [`Self::predict`] or [`Self::solve`]), corrects them, and leaves the whole pressure and its gradient on the grid.
    ///
    /// # Errors
    /// Where numbers are not finite.
    pub fn correct(
        &mut self,
        grid: &mut LiquidGrid<D>,
        room: Option<Room<'_, D>>,
        dt: f64,
        settings: &PressureSettings,
    ) -> Result<PressureReport, LiquidError> {
        compiled::correct(self, grid, room, dt, settings)
    }

    fn correct_any(
        &mut self,
        grid: &mut LiquidGrid<D>,
        room: Option<Room<'_, D>>,
        dt: f64,
        settings: &PressureSettings,
    ) -> Result<PressureReport, LiquidError> {
        if self.first.is_none() {
            self.remember(grid);
        }
        let mut report = self.solve(grid, room, dt, settings)?;
        correct_velocities(grid, dt);
        if let Some(first) = &self.first {
            report.max_pressure = 0.0;
            for (&cell, p) in self.node.iter().zip(&first.pressure) {
                let pressure = &mut grid.cell.pressure[cell as usize];
                *pressure += p;
                report.max_pressure = report.max_pressure.max(*pressure);
            }
            for (face, kept) in grid.face.iter_mut().zip(&first.gradient) {
                for (g, k) in face.pressure_gradient.iter_mut().zip(kept) {
                    *g += k;
                }
            }
        }
        self.forget();
        Ok(report)
    }

    fn has_open_face(&self, grid: &LiquidGrid<D>, cell: usize) -> bool {
        (0..D).any(|a| {
            (0..2).any(|side| {
                across(grid, cell, a, side)
                    .0
                    .is_some_and(|f| grid.face[a].open[f] > 0.0 && grid.face[a].mass[f] > grid.mass_floor)
            })
        })
    }

    /// Divergence of the face velocities of a cell, moving solids and what takes room included [1/s].
    ///
    /// - `acting`: pressure gradient that the velocities know already
    fn divergence(
        grid: &LiquidGrid<D>,
        room: Option<&Room<'_, D>>,
        acting: Option<[&[f64]; D]>,
        dt: f64,
        cell: usize,
    ) -> f64 {
        let mut sum = 0.0;
        for a in 0..D {
            for side in 0..2 {
                let Some(face) = across(grid, cell, a, side).0 else { continue };
                let f = &grid.face[a];
                let carried = match room {
                    None => f.velocity[face],
                    Some(room) => {
                        let pressed = acting.map_or(0.0, |gradient| dt * room.yields[a][face] * gradient[a][face]);
                        room.left[a][face] * f.velocity[face] + room.flux[a][face] - pressed
                    }
                };
                let flux = f.open[face] * carried + (1.0 - f.open[face]) * f.solid_velocity[face];
                sum += if side == 0 { -flux } else { flux };
            }
        }
        sum / grid.lattice().dx
    }

    /// Solves for the pressure that corrects the current face velocities; writes pressure and its gradient to the grid.
    ///
    /// - `room`: what others take of it; the same as for [`PressureSolver::build`]
    ///
    /// # Errors
    /// Where numbers are not finite.
    pub fn solve(
        &mut self,
        grid: &mut LiquidGrid<D>,
        room: Option<Room<'_, D>>,
        dt: f64,
        settings: &PressureSettings,
    ) -> Result<PressureReport, LiquidError> {
        compiled::solve(self, grid, room, dt, settings)
    }

    fn solve_any(
        &mut self,
        grid: &mut LiquidGrid<D>,
        room: Option<Room<'_, D>>,
        dt: f64,
        settings: &PressureSettings,
    ) -> Result<PressureReport, LiquidError> {
        if !self.built {
            self.build(grid, room, dt, settings);
        }
        let n = self.node.len();
        self.rhs.resize(n, 0.0);
        self.solution.resize(n, 0.0);
        let view = &*grid;
        let first = self.first.as_ref().map(|f| f.pressure.as_slice());
        let acting = self.first.as_ref().map(|f| std::array::from_fn(|a| f.gradient[a].as_slice()));
        let max_divergence = self
            .rhs
            .par_iter_mut()
            .zip(self.solution.par_iter_mut())
            .zip(&self.node)
            .zip(&self.system.rows)
            .enumerate()
            .with_min_len(512)
            .map(|(k, (((b, x), &cell), row))| {
                let cell = cell as usize;
                let divergence = Self::divergence(view, room.as_ref(), acting, dt, cell);
                *b = -divergence;
                *x = 0.0;
                if view.cell.compliance[cell] > 0.0 {
                    let j = view.cell.volume_ratio[cell].clamp(0.1, 10.0);
                    let pressure = 0.5 * (1.0 - j) * (1.0 + j) / j / view.cell.compliance[cell];
                    // What acts already is no part of the unknown.
                    let acting = first.map_or(0.0, |p| p[k]);
                    *b += row.own * (pressure - acting);
                    *x = if first.is_some() { 0.0 } else { pressure };
                }
                room.map_or(divergence, |room| divergence / (1.0 - room.taken[cell])).abs()
            })
            .reduce(|| 0.0, f64::max);
        let own = numerics::reduce::norm_max(&self.rhs);
        let mut solver = settings.multigrid;
        if self.first.is_none() {
            self.size = own;
        } else if own < self.size {
            // A remainder needs no more digits than the whole.
            solver.tolerance = (solver.tolerance * self.size / own).min(0.5);
        }
        let mut multigrid = self.multigrid.solve(&self.rhs, &mut self.solution, &solver);
        if self.first.is_some() && own < self.size {
            multigrid.solve.residual *= own / self.size;
            multigrid.solve.tolerance = settings.multigrid.tolerance;
        }
        if multigrid.solve.status == Status::NonFinite || self.solution.iter().any(|p| !p.is_finite()) {
            return Err(LiquidError::NonFinite { solve: "pressure" });
        }
        grid.cell.pressure.fill(0.0);
        let mut max_pressure = 0.0f64;
        for (&cell, &p) in self.node.iter().zip(&self.solution) {
            grid.cell.pressure[cell as usize] = p;
            max_pressure = max_pressure.max(p);
        }
        self.write_gradient(grid);
        self.continue_gradient(grid);
        Ok(PressureReport { multigrid, max_divergence, max_pressure })
    }

    fn write_gradient(&self, grid: &mut LiquidGrid<D>) {
        let inverse_dx = 1.0 / grid.lattice().dx;
        for face in &mut grid.face {
            face.pressure_gradient.fill(0.0);
        }
        // Rows know neighbours and surface fractions; each face is written by the cell on its high side, or by the only one.
        for (row, &cell) in self.system.rows.iter().zip(&self.node) {
            let cell = cell as usize;
            let p = grid.cell.pressure[cell];
            for a in 0..D {
                for side in 0..2 {
                    let Some(face) = across(grid, cell, a, side).0 else { continue };
                    let neighbour = row.neighbour[a][side];
                    if neighbour != NO_CELL {
                        if side == 0 {
                            let q = grid.cell.pressure[self.node[neighbour as usize] as usize];
                            grid.face[a].pressure_gradient[face] = (p - q) * inverse_dx;
                        }
                    } else if row.zero[a][side].conductance > 0.0 {
                        let slope = p / row.zero[a][side].fraction * inverse_dx;
                        grid.face[a].pressure_gradient[face] = if side == 0 { slope } else { -slope };
                    }
                }
            }
        }
    }

    /// Continues the pressure gradient from the liquid into the faces just outside it.
    ///
    /// Particles at the surface also belong to faces between two cells that do not count as liquid. Left to themselves these
    /// would fall while the liquid under them is held; with the gradient continued the surface is carried like the rest.
    fn continue_gradient(&mut self, grid: &mut LiquidGrid<D>) {
        let LiquidGrid { blocks, face, mass_floor, .. } = grid;
        for a in 0..D {
            let FaceFields { mass, open, pressure_gradient: gradient, .. } = &mut face[a];
            self.known.clear();
            self.known.resize(gradient.len(), false);
            for (row, &c) in self.system.rows.iter().zip(&self.node) {
                let c = c as usize;
                for side in 0..2 {
                    if row.neighbour[a][side] != NO_CELL || row.zero[a][side].conductance > 0.0 {
                        let f = if side == 0 { c } else { blocks.along(c, a, 1) as usize };
                        self.known[f] = true;
                    }
                }
            }
            for _ in 0..CONTINUED_LAYERS {
                let known = &self.known;
                let view = &*gradient;
                self.continued.clear();
                self.continued.par_extend((0..view.len()).into_par_iter().with_min_len(4096).filter_map(|f| {
                    if known[f] || mass[f] <= *mass_floor || open[f] <= 0.0 {
                        return None;
                    }
                    let (mut sum, mut count) = (0.0, 0);
                    for b in 0..D {
                        for step in [-1, 1] {
                            let o = blocks.along(f, b, step);
                            if o != NONE && known[o as usize] {
                                sum += view[o as usize];
                                count += 1;
                            }
                        }
                    }
                    (count > 0).then(|| (f as u32, sum / f64::from(count)))
                }));
                for &(f, value) in &self.continued {
                    gradient[f as usize] = value;
                    self.known[f as usize] = true;
                }
            }
        }
    }

    /// Largest rate at which liquid and what takes room in a cell of the pressure solve change their common volume with the face
    /// velocities and pressures as they are now: the divergence of `ε_f u_f + ε_s u_s` over `ε_f` [1/s].
    ///
    /// - `room`: as for [`PressureSolver::solve`]
    #[must_use]
    pub fn mixture_divergence(&self, grid: &LiquidGrid<D>, room: Option<Room<'_, D>>, dt: f64) -> f64 {
        compiled::mixture_divergence(self, grid, room, dt)
    }

    fn mixture_divergence_any(&self, grid: &LiquidGrid<D>, room: Option<Room<'_, D>>, dt: f64) -> f64 {
        let acting = Some(std::array::from_fn(|a| grid.face[a].pressure_gradient.as_slice()));
        let one = |&cell: &u32| {
            let cell = cell as usize;
            let rate = Self::divergence(grid, room.as_ref(), acting, dt, cell);
            room.map_or(rate, |room| rate / (1.0 - room.taken[cell])).abs()
        };
        self.node.par_iter().with_min_len(512).map(one).reduce(|| 0.0, f64::max)
    }

    /// Number of liquid cells.
    #[must_use]
    pub fn unknowns(&self) -> usize {
        self.node.len()
    }

    /// Forgets the operator: the next solve assembles it anew.
    pub fn invalidate(&mut self) {
        self.built = false;
    }
}

/// The face of a cell on a side of a direction and the cell beyond it, where they are active.
#[inline(always)]
fn across<const D: usize>(
    grid: &LiquidGrid<D>,
    cell: usize,
    axis: usize,
    side: usize,
) -> (Option<usize>, Option<usize>) {
    if side == 0 {
        let other = grid.blocks.along(cell, axis, -1);
        (Some(cell), (other != NONE).then_some(other as usize))
    } else {
        let other = grid.blocks.along(cell, axis, 1);
        let other = (other != NONE).then_some(other as usize);
        (other, other)
    }
}

/// Adds `−dt V ∇p/m` to the velocities of the faces: the correction by the pressure alone.
pub fn correct_velocities<const D: usize>(grid: &mut LiquidGrid<D>, dt: f64) {
    let floor = grid.mass_floor;
    for face in &mut grid.face {
        for i in 0..face.mass.len() {
            if face.mass[i] > floor {
                face.velocity[i] -= dt * face.volume[i] / face.mass[i] * face.pressure_gradient[i];
            }
        }
    }
    crate::shear_solve::follow_walls(grid);
}

numerics::compile_here! {
    mod compiled {
        fn build(this: &mut PressureSolver<D>, grid: &LiquidGrid<D>, room: Option<Room<'_, D>>, dt: f64, settings: &PressureSettings)  = PressureSolver::build_any;
        fn predict(this: &mut PressureSolver<D>, grid: &mut LiquidGrid<D>, body: &Vector<D>, room: Option<Room<'_, D>>, dt: f64, settings: &PressureSettings) -> Result<PressureReport, LiquidError> = PressureSolver::predict_any;
        fn correct(this: &mut PressureSolver<D>, grid: &mut LiquidGrid<D>, room: Option<Room<'_, D>>, dt: f64, settings: &PressureSettings) -> Result<PressureReport, LiquidError> = PressureSolver::correct_any;
        fn solve(this: &mut PressureSolver<D>, grid: &mut LiquidGrid<D>, room: Option<Room<'_, D>>, dt: f64, settings: &PressureSettings) -> Result<PressureReport, LiquidError> = PressureSolver::solve_any;
        fn mixture_divergence(this: &PressureSolver<D>, grid: &LiquidGrid<D>, room: Option<Room<'_, D>>, dt: f64) -> f64 = PressureSolver::mixture_divergence_any;
    }
}

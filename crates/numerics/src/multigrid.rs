//! Conjugate gradients preconditioned by geometric multigrid, for a scalar on the cells of a sparse regular grid.
//!
//! Made for the pressure equation of a staggered grid with a free surface inside cells, partly open faces, density jumps and
//! compressibility. Levels are lists of cells with their neighbours, so a stream or a few drops cost what they hold. The cycle
//! is symmetric: red–black Gauss–Seidel down, black–red up, restriction the transpose of interpolation, a dense factorisation
//! at the bottom. See [`crate::multigrid_system`] for the equation.

use crate::multigrid_coarsen::{coarsen, interpolation};
use crate::multigrid_level::{Level, Links, Row};
use crate::multigrid_system::{CellSystem, ClosedRegions, NO_CELL};
use crate::pcg::{self, PcgScratch, PcgSettings, PreconditionedSystem, ResidualNorm};
use crate::report::{SolveReport, Status};
use serde::{Deserialize, Serialize};

/// Settings of the multigrid-preconditioned solve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MultigridSettings {
    /// Largest residual over largest right-hand side at which the solve has converged [1]; smaller is costlier and closer.
    pub tolerance: f64,
    /// Largest number of conjugate gradient iterations [1].
    pub max_iterations: usize,
    /// Gauss–Seidel sweeps before and after each coarse correction [1]; more lower the iterations and cost proportionally.
    pub sweeps: usize,
    /// Number of unknowns at which coarsening stops and a dense factorisation takes over [1].
    pub coarsest: usize,
}

impl Default for MultigridSettings {
    fn default() -> Self {
        Self { tolerance: 1e-8, max_iterations: 200, sweeps: 2, coarsest: 64 }
    }
}

/// What a solve says.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MultigridReport {
    /// How the solve ended; the residual is in the maximum norm, relative to the right-hand side.
    pub solve: SolveReport,
    /// Number of unknowns.
    pub unknowns: usize,
    /// Levels of the hierarchy.
    pub levels: usize,
    /// Number of closed regions, in which a constant was projected out.
    pub closed_regions: usize,
    /// Largest mean of the right-hand side in a closed region, relative to its largest entry: a closed region that is asked to
    /// change its volume.
    pub incompatibility: f64,
}

/// A hierarchy for one system, reusable for the next.
#[derive(Clone, Debug, Default)]
pub struct Multigrid<const D: usize> {
    levels: Vec<Level<D>>,
    coarsest: Dense,
    /// For each unknown of the caller its place on the finest level.
    place: Vec<u32>,
    regions: ClosedRegions,
    rhs: Vec<f64>,
    solution: Vec<f64>,
    scratch: PcgScratch,
}

impl<const D: usize> Multigrid<D> {
    /// An empty hierarchy.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Builds the hierarchy of a system.
    pub fn build(&mut self, system: &CellSystem<D>, settings: &MultigridSettings) {
        self.levels.clear();
        self.regions = system.closed_regions();
        let mut current = std::borrow::Cow::Borrowed(system);
        let mut order = colour(&current);
        let mut place = places(&order.cells);
        self.place.clone_from(&place);
        while current.rows.len() > settings.coarsest.max(1) {
            let (coarse, parent) = coarsen(&current);
            if coarse.rows.len() == current.rows.len() {
                break;
            }
            let next = colour(&coarse);
            let next_place = places(&next.cells);
            let mut level = level_of(&current, &order, &place);
            level.prolongation = interpolation(&current, &coarse, &parent, &order.cells[..order.red], &next_place);
            level.restriction = level.prolongation.transposed(coarse.rows.len());
            self.levels.push(level);
            (current, order, place) = (std::borrow::Cow::Owned(coarse), next, next_place);
        }
        self.coarsest = Dense::factorise(&current, &place);
        let mut level = level_of(&current, &order, &place);
        level.prolongation = Links::default();
        self.levels.push(level);
        // The labels must follow the order of the finest level.
        if !self.regions.size.is_empty() {
            let mut label = vec![NO_CELL; self.regions.label.len()];
            for (i, &l) in self.regions.label.iter().enumerate() {
                label[self.place[i] as usize] = l;
            }
            self.regions.label = label;
        }
    }

    /// Solves the system of the last [`Multigrid::build`]; `x` holds the first guess and receives the solution.
    ///
    /// In closed regions the mean of the right-hand side is removed (and reported) and the solution has zero mean.
    pub fn solve(&mut self, b: &[f64], x: &mut [f64], settings: &MultigridSettings) -> MultigridReport {
        let n = b.len();
        let mut report = MultigridReport {
            solve: SolveReport { tolerance: settings.tolerance, ..SolveReport::TRIVIAL },
            unknowns: n,
            levels: self.levels.len(),
            closed_regions: self.regions.size.len(),
            incompatibility: 0.0,
        };
        if n == 0 {
            return report;
        }
        if n != self.place.len() {
            report.solve.status = Status::Breakdown;
            return report;
        }
        let mut rhs = std::mem::take(&mut self.rhs);
        let mut solution = std::mem::take(&mut self.solution);
        rhs.clear();
        rhs.resize(n, 0.0);
        solution.clear();
        solution.resize(n, 0.0);
        for i in 0..n {
            rhs[self.place[i] as usize] = b[i];
            solution[self.place[i] as usize] = x[i];
        }
        let size = crate::reduce::norm_max(&rhs);
        let removed = self.regions.project(&mut rhs);
        if size > 0.0 {
            report.incompatibility = removed / size;
        }
        self.regions.project(&mut solution);
        let mut scratch = std::mem::take(&mut self.scratch);
        let pcg_settings = PcgSettings {
            tolerance: settings.tolerance,
            max_iterations: settings.max_iterations,
            norm: ResidualNorm::Maximum,
            refresh: 50,
        };
        let mut system = Cycled { hierarchy: self, sweeps: settings.sweeps.max(1) };
        report.solve = pcg::solve_system(&mut system, &rhs, &mut solution, &mut scratch, &pcg_settings);
        self.regions.project(&mut solution);
        self.scratch = scratch;
        for i in 0..n {
            x[i] = solution[self.place[i] as usize];
        }
        self.rhs = rhs;
        self.solution = solution;
        report
    }

    /// One V-cycle from a zero guess: `z ≈ A⁻¹ r`.
    fn cycle(&mut self, r: &[f64], z: &mut [f64], sweeps: usize) {
        let last = self.levels.len() - 1;
        self.levels[0].b.copy_from_slice(r);
        for l in 0..last {
            let (fine, coarse) = self.levels.split_at_mut(l + 1);
            fine[l].smooth_down(sweeps);
            fine[l].restrict(&mut coarse[0].b);
        }
        let bottom = &mut self.levels[last];
        self.coarsest.solve(&bottom.b, &mut bottom.x);
        for l in (0..last).rev() {
            let (fine, coarse) = self.levels.split_at_mut(l + 1);
            fine[l].smooth_up(&coarse[0].x, sweeps);
        }
        z.copy_from_slice(&self.levels[0].x);
    }
}

/// The finest level as operator, the whole hierarchy as preconditioner.
struct Cycled<'a, const D: usize> {
    hierarchy: &'a mut Multigrid<D>,
    sweeps: usize,
}

impl<const D: usize> PreconditionedSystem for Cycled<'_, D> {
    fn apply(&mut self, v: &[f64], out: &mut [f64]) {
        self.hierarchy.levels[0].apply(v, out);
    }

    fn precondition(&mut self, r: &[f64], z: &mut [f64]) {
        self.hierarchy.cycle(r, z, self.sweeps);
        self.hierarchy.regions.project(z);
    }
}

/// Cells with the red ones first.
struct Coloured {
    cells: Vec<u32>,
    red: usize,
    two_coloured: bool,
}

fn is_black<const D: usize>(cell: &[i32; D]) -> bool {
    cell.iter().fold(0, |s, c| s ^ (c & 1)) == 1
}

fn colour<const D: usize>(system: &CellSystem<D>) -> Coloured {
    let proper = system.rows.iter().enumerate().all(|(i, row)| {
        row.neighbour
            .iter()
            .flatten()
            .all(|&j| j == NO_CELL || is_black(&system.cells[i]) != is_black(&system.cells[j as usize]))
    });
    let n = system.cells.len() as u32;
    if !proper {
        return Coloured { cells: (0..n).collect(), red: n as usize, two_coloured: false };
    }
    let mut cells: Vec<u32> = (0..n).filter(|&i| !is_black(&system.cells[i as usize])).collect();
    let red = cells.len();
    if red == 0 || red == n as usize {
        // Isolated cells of one colour: there is no other half to read.
        return Coloured { cells: (0..n).collect(), red: n as usize, two_coloured: false };
    }
    cells.extend((0..n).filter(|&i| is_black(&system.cells[i as usize])));
    Coloured { cells, red, two_coloured: true }
}

fn places(order: &[u32]) -> Vec<u32> {
    let mut place = vec![0; order.len()];
    for (k, &i) in order.iter().enumerate() {
        place[i as usize] = k as u32;
    }
    place
}

fn level_of<const D: usize>(system: &CellSystem<D>, order: &Coloured, place: &[u32]) -> Level<D> {
    let n = system.rows.len();
    let red = order.red as u32;
    let rows = order
        .cells
        .iter()
        .enumerate()
        .map(|(k, &i)| {
            let from_red = (k as u32) < red;
            Row::new(&system.rows[i as usize], |j| {
                let p = place[j as usize];
                if order.two_coloured && from_red { p - red } else { p }
            })
        })
        .collect();
    Level {
        rows,
        red: order.red,
        two_coloured: order.two_coloured,
        x: vec![0.0; n],
        b: vec![0.0; n],
        r: vec![0.0; n],
        ..Level::default()
    }
}

/// Dense `LDLᵀ` of the coarsest level. A pivot that is zero to rounding belongs to a constant of a closed region: that
/// unknown is left at zero.
#[derive(Clone, Debug, Default)]
struct Dense {
    n: usize,
    factor: Vec<f64>,
    inverse: Vec<f64>,
}

impl Dense {
    fn factorise<const D: usize>(system: &CellSystem<D>, place: &[u32]) -> Self {
        let n = system.rows.len();
        let mut a = vec![0.0; n * n];
        for (i, row) in system.rows.iter().enumerate() {
            let pi = place[i] as usize;
            a[pi * n + pi] += row.diagonal();
            for axis in 0..D {
                for side in 0..2 {
                    let j = row.neighbour[axis][side];
                    if j != NO_CELL {
                        a[pi * n + place[j as usize] as usize] -= row.conductance[axis][side];
                    }
                }
            }
        }
        let mut inverse = vec![0.0; n];
        for k in 0..n {
            let original = system_diagonal(&a, n, k);
            let mut d = a[k * n + k];
            for j in 0..k {
                d -= a[k * n + j] * a[k * n + j] * pivot(inverse[j]);
            }
            inverse[k] = if d > 1e-13 * original { 1.0 / d } else { 0.0 };
            for i in k + 1..n {
                let mut s = a[i * n + k];
                for j in 0..k {
                    s -= a[i * n + j] * a[k * n + j] * pivot(inverse[j]);
                }
                a[i * n + k] = s * inverse[k];
            }
        }
        Self { n, factor: a, inverse }
    }

    fn solve(&self, b: &[f64], x: &mut [f64]) {
        let n = self.n;
        for i in 0..n {
            let mut s = b[i];
            for j in 0..i {
                s -= self.factor[i * n + j] * x[j];
            }
            x[i] = s;
        }
        for i in 0..n {
            x[i] *= self.inverse[i];
        }
        for i in (0..n).rev() {
            for j in i + 1..n {
                x[i] -= self.factor[j * n + i] * x[j];
            }
        }
    }
}

fn system_diagonal(a: &[f64], n: usize, k: usize) -> f64 {
    a[k * n + k].abs()
}

fn pivot(inverse: f64) -> f64 {
    if inverse == 0.0 { 0.0 } else { 1.0 / inverse }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::multigrid_system::{CellRow, ZeroFace};
    use std::collections::HashMap;

    /// A system on the cells where `level(x) < 0` inside `[0, 1]^D`, with a free surface at `level = 0` and walls elsewhere.
    fn system<const D: usize>(
        n: i32,
        own: f64,
        level: impl Fn(&[f64; D]) -> f64,
        coefficient: impl Fn(&[f64; D]) -> f64,
    ) -> CellSystem<D> {
        let centre = |c: &[i32; D]| -> [f64; D] { c.map(|i| (f64::from(i) + 0.5) / f64::from(n)) };
        let mut s = CellSystem::<D>::default();
        let mut index = HashMap::new();
        for k in 0..(n as usize).pow(D as u32) {
            let mut rest = k;
            let cell: [i32; D] = std::array::from_fn(|_| {
                let d = rest % n as usize;
                rest /= n as usize;
                d as i32
            });
            if level(&centre(&cell)) < 0.0 {
                index.insert(cell, s.cells.len() as u32);
                s.cells.push(cell);
            }
        }
        for &cell in &s.cells {
            let mut row = CellRow { own, ..CellRow::default() };
            for a in 0..D {
                for side in 0..2 {
                    let mut other = cell;
                    other[a] += if side == 0 { -1 } else { 1 };
                    if other[a] < 0 || other[a] >= n {
                        continue;
                    }
                    let (x, y) = (centre(&cell), centre(&other));
                    let k = coefficient(&std::array::from_fn(|b| 0.5 * (x[b] + y[b])));
                    if let Some(&j) = index.get(&other) {
                        row.neighbour[a][side] = j;
                        row.conductance[a][side] = k;
                    } else {
                        let (p, q) = (level(&x), level(&y));
                        row.zero[a][side] = ZeroFace { conductance: k, fraction: (p / (p - q)).clamp(0.01, 1.0) };
                    }
                }
            }
            s.rows.push(row);
        }
        s
    }

    fn iterations<const D: usize>(s: &CellSystem<D>) -> usize {
        let settings = MultigridSettings::default();
        let mut m = Multigrid::new();
        m.build(s, &settings);
        let n = s.cells.len();
        let b: Vec<f64> = (0..n).map(|i| (i as f64 * 0.7).sin() + 0.3).collect();
        let mut x = vec![0.0; n];
        let report = m.solve(&b, &mut x, &settings);
        assert_eq!(report.solve.status, Status::Converged, "{report:?}");
        let mut back = vec![0.0; n];
        s.apply(&x, &mut back);
        let size = b.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        let worst = b.iter().zip(&back).fold(0.0, |m: f64, (b, a)| m.max((b - a).abs()));
        assert!(worst <= 2e-8 * size, "true residual {worst}");
        report.solve.iterations
    }

    fn dam<const D: usize>(x: &[f64; D]) -> f64 {
        let sphere = x.iter().map(|t| (t - 0.45) * (t - 0.45)).sum::<f64>().sqrt() - 0.41;
        let wave = x[D - 1] - 0.37 - 0.1 * (7.0 * x[0]).sin();
        sphere.min(wave)
    }

    #[test]
    fn the_cycle_is_symmetric_and_positive() {
        let s = system::<2>(24, 1e-4, dam, |x| if x[0] > 0.5 { 1.0 } else { 30.0 });
        let settings = MultigridSettings { coarsest: 8, ..Default::default() };
        let mut m = Multigrid::new();
        m.build(&s, &settings);
        assert!(m.levels.len() > 2);
        let n = s.cells.len();
        let (mut za, mut zb) = (vec![0.0; n], vec![0.0; n]);
        for k in 0..5 {
            let a: Vec<f64> = (0..n).map(|i| ((i * (k + 3)) as f64 * 0.7).sin()).collect();
            let b: Vec<f64> = (0..n).map(|i| ((i * (k + 5)) as f64 * 1.3).cos()).collect();
            m.cycle(&a, &mut za, 2);
            m.cycle(&b, &mut zb, 2);
            let (ab, ba) = (crate::reduce::dot(&za, &b), crate::reduce::dot(&zb, &a));
            assert!((ab - ba).abs() < 1e-12 * ab.abs().max(crate::reduce::dot(&za, &a)), "{ab} {ba}");
            assert!(crate::reduce::dot(&za, &a) > 0.0);
        }
    }

    #[test]
    fn iterations_do_not_grow_with_resolution() {
        let counts: Vec<usize> = [16, 32, 64].iter().map(|&n| iterations(&system::<3>(n, 0.0, dam, |_| 1.0))).collect();
        assert!(counts.iter().all(|&c| c <= 15) && counts[2] <= counts[0] + 3, "{counts:?}");
        let counts: Vec<usize> =
            [32, 64, 128, 256].iter().map(|&n| iterations(&system::<2>(n, 0.0, dam, |_| 1.0))).collect();
        assert!(counts.iter().all(|&c| c <= 15) && counts[3] <= counts[0] + 3, "{counts:?}");
    }

    #[test]
    #[ignore = "two million unknowns: run by hand to see the scaling"]
    fn iterations_at_one_hundred_and_twenty_eight_cubed() {
        let counts: Vec<usize> =
            [32, 64, 128].iter().map(|&n| iterations(&system::<3>(n, 0.0, dam, |_| 1.0))).collect();
        println!("iterations at 32³, 64³, 128³: {counts:?}");
        assert!(counts.iter().all(|&c| c <= 15) && counts[2] <= counts[0] + 3, "{counts:?}");
    }

    #[test]
    fn density_jumps_and_compressibility_keep_it_short() {
        for jump in [1e-3, 1e3] {
            let n = iterations(&system::<3>(32, 0.0, dam, |x| if x[0] + x[1] > 0.8 { jump } else { 1.0 }));
            assert!(n <= 40, "{n} iterations at a jump of {jump}");
        }
        for own in [1e-9, 1e-3, 1.0, 1e6] {
            assert!(iterations(&system::<2>(64, own, dam, |_| 1.0)) <= 15);
        }
    }

    #[test]
    fn closed_regions_lose_their_constant_and_say_so() {
        // Two closed boxes: the whole square with a dividing wall.
        let s = system::<2>(32, 0.0, |_| -1.0, |x| if (x[0] - 0.5).abs() < 1e-9 { 0.0 } else { 1.0 });
        let settings = MultigridSettings::default();
        let mut m = Multigrid::new();
        m.build(&s, &settings);
        let n = s.cells.len();
        let b: Vec<f64> = s.cells.iter().map(|c| (f64::from(c[0]) * 0.3).sin() + f64::from(c[1]) * 0.1).collect();
        let mut x = vec![7.0; n];
        let report = m.solve(&b, &mut x, &settings);
        assert_eq!(report.solve.status, Status::Converged, "{report:?}");
        assert_eq!(report.closed_regions, 2);
        assert!(report.incompatibility > 0.1);
        assert!(report.solve.iterations <= 15, "{report:?}");
        let mut left = 0.0;
        for (c, x) in s.cells.iter().zip(&x) {
            left += if c[0] < 16 { *x } else { 0.0 };
        }
        assert!(left.abs() < 1e-6, "each region has zero mean: {left}");
    }

    #[test]
    fn odd_periods_and_isolated_cells() {
        // A ring of 12 × 3 cells: the period three admits no two-colouring.
        let mut s = CellSystem::<2>::default();
        for y in 0..3 {
            for x in 0..12 {
                s.cells.push([x, y]);
            }
        }
        for y in 0..3i32 {
            for x in 0..12i32 {
                let at = |x: i32, y: i32| (y.rem_euclid(3) * 12 + x.rem_euclid(12)) as u32;
                s.rows.push(CellRow {
                    neighbour: [[at(x - 1, y), at(x + 1, y)], [at(x, y - 1), at(x, y + 1)]],
                    conductance: [[1.0; 2]; 2],
                    own: 1e-3,
                    ..CellRow::default()
                });
            }
        }
        let settings = MultigridSettings { coarsest: 4, ..Default::default() };
        let mut m = Multigrid::new();
        m.build(&s, &settings);
        let b: Vec<f64> = (0..36).map(|i| f64::from(i).sin()).collect();
        let mut x = vec![0.0; 36];
        assert_eq!(m.solve(&b, &mut x, &settings).solve.status, Status::Converged);
        // Drops of one cell, far apart.
        let drops =
            system::<3>(40, 0.0, |x| if x.iter().all(|t| (t * 40.0) as i32 % 8 == 3) { -1.0 } else { 1.0 }, |_| 2.0);
        assert_eq!(drops.cells.len(), 125);
        assert!(iterations(&drops) <= 15);
        let mut empty = Multigrid::<3>::new();
        empty.build(&CellSystem::default(), &settings);
        assert_eq!(empty.solve(&[], &mut [], &settings).unknowns, 0);
    }

    #[test]
    fn the_same_bits_for_any_thread_count() {
        let s = system::<3>(40, 1e-6, dam, |_| 1.0);
        let run = |threads: usize| {
            rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| {
                let settings = MultigridSettings::default();
                let mut m = Multigrid::new();
                m.build(&s, &settings);
                let b: Vec<f64> = (0..s.cells.len()).map(|i| (i as f64).sin()).collect();
                let mut x = vec![0.0; b.len()];
                m.solve(&b, &mut x, &settings);
                x.iter().map(|v| v.to_bits()).collect::<Vec<_>>()
            })
        };
        let one = run(1);
        assert!(one == run(2) && one == run(4));
    }
}

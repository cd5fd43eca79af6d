//! What the liquid looks like: particles with their fields, cuts through the grid, outlines of solids in the plane.

use mpm::{LiquidGrid, Solid as _, Vector, particles_to_grid};
use particle_grid::{BLOCK, NONE};

use super::measure::{torn, yielded};
use super::solids::{self, PosedBody};
use super::{Flow, FlowState, lift};
use crate::record::frame::{Field, Piece, Topology};
use crate::scene::Scene;
use crate::world::solids::SceneSolid;

/// A plane of which frames show a cut.
#[derive(Clone, Debug, PartialEq)]
pub struct Slice {
    /// Name of the piece.
    pub name: String,
    /// Direction of the normal: 0, 1, 2 for x, y, z.
    pub axis: usize,
    /// Place along it [m].
    pub at: f64,
}

/// The cuts that a scene asks for.
#[must_use]
pub fn slices(scene: &Scene) -> Vec<Slice> {
    let one = |(k, slice): (usize, &crate::scene::output::Slice)| Slice {
        name: slice.name.clone().map_or_else(|| format!("slice{k}"), |name| format!("slice-{name}")),
        axis: slice.normal.0.iamax(),
        at: slice.at,
    };
    scene.output.slices.iter().enumerate().map(one).collect()
}

impl<const D: usize> Flow<D> {
    /// The particles: `id`, `material`, `radius` [m] of a ball (disc) of the same volume, `velocity` [m/s], `volume_ratio`,
    /// and where a liquid bears shear `shear_stress` [Pa], `yielded`, and where one tears `torn` and `plastic_history`.
    #[must_use]
    pub fn particles(&self, state: &FlowState<D>) -> Piece {
        let p = &state.particles;
        let spread = |v: &Vector<D>| {
            let v = lift(v);
            [v.x, v.y, v.z]
        };
        let radius = |i: usize| {
            let volume = p.volume(i);
            if D == 2 { (volume / std::f64::consts::PI).sqrt() } else { (volume * 0.75 / std::f64::consts::PI).cbrt() }
        };
        let velocity: Vec<[f64; 3]> = p.velocity.iter().map(spread).collect();
        let mut fields = vec![
            Field::integer("id", p.id.iter().map(|id| *id as i64).collect()),
            Field::scalar("radius", (0..p.len()).map(radius).collect()),
            Field::vector("velocity", &velocity),
            Field::scalar("volume_ratio", p.volume_ratio.clone()),
        ];
        if self.materials.len() > 1 {
            fields.push(Field::integer("material", p.material.iter().map(|m| i64::from(*m)).collect()));
        }
        if p.carried.strain {
            let flag = |seen: fn(u8) -> bool| p.flags.iter().map(|f| i64::from(seen(*f))).collect();
            fields.push(Field::scalar("shear_stress", p.shear_stress_norm(&self.materials).collect()));
            fields.push(Field::integer("yielded", flag(yielded)));
            if p.carried.history {
                fields.push(Field::integer("torn", flag(torn)));
                fields.push(Field::scalar("plastic_history", self.histories(state)));
            }
        }
        Piece {
            name: "particles".to_owned(),
            topology: Topology::Points,
            positions: p.position.iter().map(spread).collect(),
            point_fields: fields,
            cell_fields: Vec::new(),
        }
    }

    /// The cuts through the grid of the last step; before the first step through a grid made of the particles as they are.
    #[must_use]
    pub fn cuts(&self, state: &FlowState<D>) -> Vec<Piece> {
        if self.slices.is_empty() || state.particles.is_empty() {
            return Vec::new();
        }
        if self.grid.blocks.block_count() > 0 {
            return self.slices.iter().filter_map(|slice| cut(&self.grid, slice)).collect();
        }
        let mut particles = state.particles.clone();
        let mut grid = LiquidGrid::new(*self.grid.lattice());
        grid.particle_width = self.grid.particle_width;
        if particles_to_grid::activate(&mut particles, &self.materials, &[], &mut grid).is_err() {
            return Vec::new();
        }
        particles_to_grid::particles_to_grid(&particles, &self.materials, None, &mut grid);
        self.slices.iter().filter_map(|slice| cut(&grid, slice)).collect()
    }

    /// Outlines of the solids in the plane, within a box; none in space, where solids are meshes.
    #[must_use]
    pub fn outlines(&self, scene: &[SceneSolid], time: f64, extent: f64) -> Option<Piece> {
        if D != 2 || scene.is_empty() {
            return None;
        }
        let posed: Vec<PosedBody<'_, D>> = solids::at(scene, &self.bodies, time);
        let (mut positions, mut pairs, mut of) = (Vec::new(), Vec::new(), Vec::new());
        let half = extent;
        let cells = 256;
        let step = 2.0 * half / f64::from(cells);
        for (index, solid) in posed.iter().enumerate() {
            let at = |i: i32, j: i32| {
                let x = [f64::from(i) * step - half, f64::from(j) * step - half];
                (x, solid.distance(&Vector::<D>::from_fn(|a, _| x[a])))
            };
            for j in 0..cells {
                for i in 0..cells {
                    let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                    if corners[0].1.abs() > 2.0 * step {
                        continue;
                    }
                    let mut crossings = Vec::with_capacity(4);
                    for k in 0..4 {
                        let ((a, da), (b, db)) = (corners[k], corners[(k + 1) % 4]);
                        if (da < 0.0) != (db < 0.0) {
                            let s = da / (da - db);
                            crossings.push([a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]), 0.0]);
                        }
                    }
                    for pair in crossings.chunks_exact(2) {
                        let first = positions.len() as u32;
                        positions.extend_from_slice(pair);
                        pairs.push([first, first + 1]);
                        of.push(index as i64);
                    }
                }
            }
        }
        Some(Piece {
            name: "solids".to_owned(),
            topology: Topology::Segments(pairs),
            positions,
            point_fields: Vec::new(),
            cell_fields: vec![Field::integer("solid", of)],
        })
    }
}

/// Values at the cell centres of one layer of the active grid, as an image: `velocity` [m/s], `speed`, `pressure` [Pa],
/// `liquid_fraction`, `volume_ratio`.
fn cut<const D: usize>(grid: &LiquidGrid<D>, slice: &Slice) -> Option<Piece> {
    let lattice = grid.lattice();
    let dx = lattice.dx;
    // directions across and along the cut; in the plane there is one layer
    let layer = (D == 3).then(|| ((slice.at - lattice.origin[slice.axis]) / dx).floor() as i32);
    let blocks = grid.blocks.blocks();
    let occupied = grid.blocks.occupied();
    let (mut low, mut high) = ([i32::MAX; 3], [i32::MIN; 3]);
    for &block in occupied {
        let coordinates = blocks[block as usize];
        for a in 0..D {
            low[a] = low[a].min(coordinates[a] * BLOCK as i32 - 1);
            high[a] = high[a].max((coordinates[a] + 1) * BLOCK as i32 + 1);
        }
    }
    if occupied.is_empty() {
        return None;
    }
    match layer {
        Some(layer) => (low[slice.axis], high[slice.axis]) = (layer, layer + 1),
        None => (low[2], high[2]) = (0, 1),
    }
    let counts: [u32; 3] = std::array::from_fn(|a| (high[a] - low[a]).max(1) as u32);
    let total = counts.iter().map(|c| *c as usize).product();
    let place = |index: usize| -> [i32; 3] {
        let (nx, ny) = (counts[0] as usize, counts[1] as usize);
        [low[0] + (index % nx) as i32, low[1] + (index / nx % ny) as i32, low[2] + (index / (nx * ny)) as i32]
    };
    let center = |cell: [i32; 3]| -> [f64; 3] {
        std::array::from_fn(|a| if a < D { lattice.origin[a] + (f64::from(cell[a]) + 0.5) * dx } else { 0.0 })
    };
    let mut positions = Vec::with_capacity(total);
    let mut velocity = Vec::with_capacity(total);
    let (mut speed, mut pressure) = (Vec::with_capacity(total), Vec::with_capacity(total));
    let (mut fraction, mut ratio) = (Vec::with_capacity(total), Vec::with_capacity(total));
    for index in 0..total {
        let cell = place(index);
        positions.push(center(cell));
        let node = grid.blocks.node(&std::array::from_fn(|a| cell[a]));
        let node = (node != NONE).then_some(node as usize);
        let filled = node.map_or(0.0, |n| grid.cell.liquid_fraction.get(n).copied().unwrap_or(0.0));
        let v: [f64; 3] = std::array::from_fn(|a| {
            let (Some(n), true) = (node, a < D && filled > 0.0) else { return 0.0 };
            let other = grid.blocks.along(n, a, 1);
            let face = &grid.face[a];
            let value = |n: usize| (face.mass[n] > grid.mass_floor).then(|| face.velocity[n]);
            match (value(n), (other != NONE).then(|| value(other as usize)).flatten()) {
                (Some(u), Some(w)) => 0.5 * (u + w),
                (Some(u), None) | (None, Some(u)) => u,
                (None, None) => 0.0,
            }
        });
        speed.push((v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt());
        velocity.push(v);
        let of = |list: &[f64], empty: f64| match node {
            Some(n) if filled > 0.0 => list.get(n).copied().unwrap_or(empty),
            _ => empty,
        };
        pressure.push(of(&grid.cell.pressure, 0.0));
        ratio.push(of(&grid.cell.volume_ratio, 1.0));
        fraction.push(filled);
    }
    Some(Piece {
        name: slice.name.clone(),
        topology: Topology::Lattice { origin: positions[0], spacing: dx, counts },
        positions,
        point_fields: vec![
            Field::vector("velocity", &velocity),
            Field::scalar("speed", speed),
            Field::scalar("pressure", pressure),
            Field::scalar("liquid_fraction", fraction),
            Field::scalar("volume_ratio", ratio),
        ],
        cell_fields: Vec::new(),
    })
}

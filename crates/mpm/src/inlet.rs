//! Stage 4, the mouths of sources: faces inside them carry the velocity that the source prescribes.
//!
//! A stream that falls or is drawn away pulls on the liquid that follows. Were only the new particles given the velocity of the
//! source, the stream would drag them off at its own in their first step, with gaps in between that no velocity gradient has
//! opened: it would lose volume at the mouth by the ratio of the two speeds. Held faces let the grid see the difference as
//! stretching, to which pressure answers with a thinner stream.
//!
//! ```text
//!        │ ↓ ↓ ↓ │      faces inside the mouth: closed to the pressure, tied to the velocity of the source
//!        ├─┼─┼─┼─┤
//!        │       │      faces below: free
//! ```

use crate::grid::{LiquidGrid, WallTie};
use numerics::tensor::Vector;
use particle_grid::lattice::local_digits;
use particle_grid::{BLOCK, NONE, cells_per_block, mac_offset};

/// The mouth of a source at one instant.
pub trait Inlet<const D: usize> {
    /// Whether a position lies inside [m].
    fn holds(&self, x: &Vector<D>) -> bool;
    /// A box around it [m].
    fn bounds(&self) -> (Vector<D>, Vector<D>);
    /// Velocity of the liquid at a position inside [m/s].
    fn velocity(&self, x: &Vector<D>) -> Vector<D>;
}

/// Closes the faces inside the mouths and ties them to the velocity of the source; returns how many.
///
/// Comes after [`weights`](crate::weights::weights), whose open shares and ties it overrides.
pub fn hold_inlets<const D: usize>(grid: &mut LiquidGrid<D>, inlets: &[impl Inlet<D>]) -> usize {
    let mut held: Vec<WallTie> = Vec::new();
    for inlet in inlets {
        find(grid, inlet, &mut held);
    }
    if held.is_empty() {
        return 0;
    }
    // where mouths overlap the first holds
    held.sort_by_key(|tie| (tie.axis, tie.face));
    held.dedup_by_key(|tie| (tie.axis, tie.face));
    for tie in &held {
        let face = &mut grid.face[tie.axis as usize];
        face.open[tie.face as usize] = 0.0;
        face.solid_velocity[tie.face as usize] = tie.offset;
    }
    let offset_of = |axis: u8, face: u32| {
        held.binary_search_by_key(&(axis, face), |tie| (tie.axis, tie.face)).ok().map(|found| held[found].offset)
    };
    grid.ties.retain(|tie| offset_of(tie.axis, tie.face).is_none());
    for tie in &mut grid.ties {
        if let Some(velocity) = offset_of(tie.axis, tie.source) {
            *tie = WallTie { source: NONE, ratio: 0.0, offset: tie.offset + tie.ratio * velocity, ..*tie };
        }
    }
    grid.ties.extend_from_slice(&held);
    grid.ties.sort_by_key(|tie| (tie.axis, tie.face));
    held.len()
}

/// The faces with liquid inside one mouth.
fn find<const D: usize>(grid: &LiquidGrid<D>, inlet: &impl Inlet<D>, held: &mut Vec<WallTie>) {
    let lattice = grid.lattice();
    let (low, high) = inlet.bounds();
    let per = cells_per_block::<D>();
    for (block, coordinates) in grid.blocks.blocks().iter().enumerate() {
        let first: [i32; D] = std::array::from_fn(|a| coordinates[a] * BLOCK as i32);
        let (from, to) = (lattice.node_position(&first, &[0.0; D]), lattice.node_position(&first, &[BLOCK as f64; D]));
        if (0..D).any(|a| from[a] > high[a] || to[a] < low[a]) {
            continue;
        }
        for local in 0..per {
            let digits = local_digits::<D>(local);
            let cell: [i32; D] = std::array::from_fn(|a| first[a] + digits[a] as i32);
            let node = block * per + local;
            for axis in 0..D {
                let x = lattice.node_position(&cell, &mac_offset(axis));
                if grid.face[axis].mass[node] > grid.mass_floor && inlet.holds(&x) {
                    let offset = inlet.velocity(&x)[axis];
                    held.push(WallTie { axis: axis as u8, face: node as u32, source: NONE, ratio: 0.0, offset });
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{HalfSpace, LiquidMaterial, LiquidSettings, Particle, Particles, fill, particles_to_grid, weights};
    use constitutive::{LawSettings, Liquid};
    use particle_grid::Lattice;

    /// A box through which liquid flows downwards.
    struct Mouth;

    impl Inlet<2> for Mouth {
        fn holds(&self, x: &Vector<2>) -> bool {
            x.x.abs() < 0.021 && x.y.abs() < 0.006
        }
        fn bounds(&self) -> (Vector<2>, Vector<2>) {
            (Vector::<2>::new(-0.021, -0.006), Vector::<2>::new(0.021, 0.006))
        }
        fn velocity(&self, _: &Vector<2>) -> Vector<2> {
            Vector::<2>::new(0.0, -0.7)
        }
    }

    #[test]
    fn faces_in_the_mouth_keep_the_velocity_of_the_source_beside_a_wall_too() {
        let lattice = Lattice::<2>::new(1e-2);
        let liquid = Liquid::preset("shaving-cream").unwrap();
        let materials = vec![LiquidMaterial::new(&liquid, LawSettings::default()).unwrap()];
        let settings = LiquidSettings::default();
        let mut particles = Particles::new(&materials);
        let (low, high) = (Vector::<2>::new(-0.02, -0.05), Vector::<2>::new(0.02, 0.02));
        for x in fill::fill(&lattice, 4, &low, &high, |_| true) {
            let mut p = Particle::new(x, fill::sample_volume(&lattice, 4), 0, liquid.density);
            p.velocity = Vector::<2>::new(0.1, -1.1);
            particles.push(p);
        }
        let wall = [HalfSpace { point: Vector::<2>::new(-0.02, 0.0), normal: Vector::<2>::x(), stick: 1.0 }];
        let mut grid = LiquidGrid::new(lattice);
        grid.particle_width = settings.particle_width();
        particles_to_grid::activate(&mut particles, &materials, &[], &mut grid).unwrap();
        particles_to_grid::particles_to_grid(&particles, &materials, None, &mut grid);
        weights::weights(&mut grid, &wall, None, &settings.pressure).unwrap();
        let held = hold_inlets(&mut grid, &[Mouth]);
        // across: five faces at y = ±5 mm; along: four at y = 0
        assert_eq!(held, 14, "{:?}", grid.ties);
        assert!(grid.ties.is_sorted_by_key(|tie| (tie.axis, tie.face)));
        crate::shear_solve::impose_walls(&mut grid);
        let lattice = *grid.lattice();
        for (block, coordinates) in grid.blocks.blocks().iter().enumerate() {
            for local in 0..cells_per_block::<2>() {
                let digits = local_digits::<2>(local);
                let cell: [i32; 2] = std::array::from_fn(|a| coordinates[a] * BLOCK as i32 + digits[a] as i32);
                for axis in 0..2 {
                    let (face, node) = (&grid.face[axis], block * cells_per_block::<2>() + local);
                    let x = lattice.node_position(&cell, &mac_offset(axis));
                    if face.mass[node] > grid.mass_floor && Mouth.holds(&x) {
                        assert_eq!(face.velocity[node], Mouth.velocity(&x)[axis], "{x:?}");
                        assert_eq!(face.open[node], 0.0);
                    } else if axis == 1 && x.x > 0.0 && x.x < 0.02 && (-0.04..-0.01).contains(&x.y) {
                        assert!(face.velocity[node] < -0.9, "{x:?} {}", face.velocity[node]);
                    }
                }
            }
        }
    }
}

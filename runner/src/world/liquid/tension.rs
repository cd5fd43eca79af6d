//! Volume ratios that no pressure watches.
//!
//! The pressure solve sees the average volume ratio of a cell. Two things escape it, and left to themselves both grow until
//! they are set free as energy:
//!
//! * *Particles outside liquid cells* (spray, threads thinner than a cell, the outermost layer) have no equation for their
//!   pressure, which is zero there: their volume ratio is `J(0) = 1`. Their velocity field opens and closes gaps between them, and
//!   a ratio that followed it would leave all bounds.
//! * *Differences within a cell* bear no pressure. They even out, by half each step; the volume of the cell stays, and its elastic
//!   energy, convex in the ratio, can only fall.

use particle_grid::NONE;

use super::{Flow, FlowState};

/// Part of its distance from the average of its cell that a volume ratio gives up in a step.
///
/// A block of 10⁵ Pa dropped at 1 m/s should compress to 0.955: with a tenth its particles reach 0.88, with a half 0.954, with all
/// 0.966; the height of the rebound is the same within a hundredth of the block.
const EVENING: f64 = 0.5;

impl<const D: usize> Flow<D> {
    /// Gives particles that lie in no liquid cell the volume of no pressure and evens out volume ratios within cells; returns how many
    /// particles were released.
    ///
    /// Particles must still be where they were when the grid was made.
    pub fn settle_volume(&self, state: &mut FlowState<D>) -> usize {
        let acts = self.settings.pressure.enabled
            && self.settings.compressibility
            && self.materials.iter().any(|material| !material.rigid_volume);
        if !acts {
            return 0;
        }
        let grid = &self.grid;
        let lattice = grid.lattice();
        let particles = &mut state.particles;
        let (n, mut released, mut start) = (particles.len(), 0, 0);
        let cell_of = |p: usize| -> [i32; D] {
            let cells = lattice.to_cells(&particles.position[p]);
            std::array::from_fn(|a| cells[a].floor() as i32)
        };
        let ratio = &mut particles.volume_ratio;
        // particles are sorted by cell: those of one follow each other
        while start < n {
            let cell = cell_of(start);
            let mut end = start + 1;
            while end < n && cell_of(end) == cell {
                end += 1;
            }
            let node = grid.blocks.node(&cell);
            if node == NONE || grid.cell.liquid_distance[node as usize] >= 0.0 {
                let free = |m: u16| !self.materials[m as usize].rigid_volume;
                for (j, _) in
                    ratio[start..end].iter_mut().zip(&particles.material[start..end]).filter(|(_, m)| free(**m))
                {
                    released += usize::from(*j != 1.0);
                    *j = 1.0;
                }
            }
            even_out(
                &particles.material[start..end],
                &particles.rest_volume[start..end],
                &mut ratio[start..end],
                |m| self.materials[m as usize].rigid_volume,
            );
            start = end;
        }
        released
    }
}

/// Moves the ratios of each material towards their average by rest volume.
fn even_out(material: &[u16], rest_volume: &[f64], ratio: &mut [f64], rigid: impl Fn(u16) -> bool) {
    let mut done = 0u64;
    for k in 0..material.len() {
        let m = material[k];
        // more materials than that in one scene stay as they are
        if m >= 64 || done & (1 << m) != 0 || rigid(m) {
            continue;
        }
        let (mut volume, mut rest) = (0.0, 0.0);
        for i in (k..material.len()).filter(|i| material[*i] == m) {
            volume += rest_volume[i] * ratio[i];
            rest += rest_volume[i];
        }
        let average = volume / rest;
        for i in (k..material.len()).filter(|i| material[*i] == m) {
            ratio[i] += EVENING * (average - ratio[i]);
        }
        done |= 1 << m;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn evening_out_keeps_volume_and_leaves_other_materials_alone() {
        let material = [0, 1, 0, 0, 2, 2];
        let rest = [1.0, 2.0, 3.0, 1.0, 1.0, 1.0];
        let before = [0.5, 0.7, 1.2, 2.0, 0.4, 1.6];
        let mut after = before;
        even_out(&material, &rest, &mut after, |m| m == 2);
        let volume = |ratio: &[f64]| [0, 2, 3].iter().map(|&i| rest[i] * ratio[i]).sum::<f64>();
        assert!((volume(&after) - volume(&before)).abs() < 1e-15);
        assert!((after[1] - 0.7).abs() < 1e-15 && after[4..] == before[4..]);
        assert!(after[0] > 0.5 && after[3] < 2.0);
    }
}

//! How deep the vertices of strands are below the surface of the liquid.

use mpm::Solid as _;
use numerics::bspline;

use super::Hands;
use crate::stages::Step;
use crate::world::liquid::solids;
use crate::world::solids::SceneSolid;
use crate::world::submersion::{DENSEST, Submersion};

/// Finds the level of the surface over every vertex: the share of its surroundings filled with liquid, as the pressure solve
/// takes it for cells (stage 4), from the particles as they are now.
pub(super) fn find(hands: &mut Hands<'_>, scene: &[SceneSolid], step: Step) {
    let Hands { rods, flow, fluid, submersion, .. } = hands;
    let lattice = flow.grid.lattice();
    let particles = &fluid.particles;
    let positions = &rods.position;
    let posed = solids::at::<3>(scene, &flow.bodies, step.time);
    let Submersion { particles: near, vertices: others, volume, level, crowds, .. } = &mut **submersion;
    near.gather(lattice, positions.iter().copied(), &particles.position);
    if *crowds {
        others.gather(lattice, positions.iter().copied(), positions);
    }
    let dx = lattice.dx;
    let cell = dx * dx * dx;
    let shift = bspline::inverse_integral(flow.settings.pressure.liquid_threshold);
    for (v, x) in positions.iter().enumerate() {
        let mut filled = 0.0;
        near.around(lattice, x, &particles.position, |n| {
            filled += n.weight * particles.rest_volume[n.index] * particles.volume_ratio[n.index] / cell;
        });
        level[v] = if filled <= 0.0 {
            1.5 * dx
        } else {
            let distance = posed.iter().map(|solid| solid.distance(x)).fold(f64::INFINITY, f64::min);
            let open = bspline::integral((distance / dx).clamp(-1.5, 1.5)).max(1.0 / 48.0);
            let mut strands = 0.0;
            if *crowds {
                others.around(lattice, x, positions, |n| strands += n.weight * volume[n.index] / cell);
            }
            filled /= open * (1.0 - strands.min(DENSEST));
            -dx * (bspline::inverse_integral(filled.min(1.0)) - shift)
        };
    }
}

//! The largest sound step of the liquid, and why. Stiffness is implicit and bounds no step; where a slightly shorter step spares
//! the dear form of the shear operator, it is the shorter one.

use mpm::settings::ShearOperator;
use mpm::{elastic_wave_step, step_limit};

use super::{Flow, FlowState, solids};
use crate::system::StepLimit;
use crate::world::solids::SceneSolid;

/// Steps through particles cost some six times those through points in cells, so that up to four times as many of these are cheaper;
/// they are more accurate too.
const WORTH: f64 = 4.0;
/// Compressed liquid is a little stiffer than at rest.
const MARGIN: f64 = 0.9;

impl<const D: usize> Flow<D> {
    /// Appends the limits of a step that starts at `time` [s].
    pub fn step_limits(&self, state: &FlowState<D>, scene: &[SceneSolid], time: f64, out: &mut Vec<StepLimit>) {
        let dx = self.grid.lattice().dx;
        let reach = self.settings.step.cfl * dx;
        let inflow =
            self.sources.iter().map(|s| s.speed(time, reach / s.velocity.norm().max(1e-300))).fold(0.0, f64::max);
        if inflow > 0.0 {
            out.push(StepLimit { seconds: reach / inflow, reason: "liquid: a source" });
        }
        if state.particles.is_empty() || !self.settings.advection {
            return;
        }
        let limit = step_limit(&state.particles, dx, 0.0, &self.settings.step);
        // the speed at the end of the step counts too: v h + a h² = reach
        let (speed, body) = (reach / limit.advection, self.body.norm());
        if speed > 0.0 || body > 0.0 {
            let seconds = 2.0 * reach / (speed + (speed * speed + 4.0 * body * reach).sqrt());
            out.push(StepLimit { seconds, reason: "liquid: advection" });
        }
        if limit.deformation.is_finite() {
            out.push(StepLimit { seconds: limit.deformation, reason: "liquid: deformation" });
        }
        let fastest = scene.iter().map(|solid| solids::speed(solid, time)).fold(0.0, f64::max);
        if fastest > 0.0 {
            out.push(StepLimit { seconds: reach / fastest, reason: "liquid: motion of a solid" });
        }
        let others = out.iter().map(|limit| limit.seconds).fold(self.largest_step, f64::min);
        let waves = MARGIN * elastic_wave_step(&self.materials, dx);
        if self.settings.shear.enabled
            && self.settings.shear.operator == ShearOperator::Automatic
            && (others / WORTH..others).contains(&waves)
        {
            out.push(StepLimit { seconds: waves, reason: "liquid: elastic waves" });
        }
    }
}

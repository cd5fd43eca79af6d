//! Stress tensors of the evaluated directed sample, before the kick.

use super::state::DirectedSample;
use crate::stress::StressTensors;
use crate::tensor::Tensor2;

impl DirectedSample {
    /// Returns all tensors; call between [`Self::evaluate`] and [`Self::integrate`].
    pub fn stresses(&self) -> StressTensors {
        let g = &self.grains;
        let (n, cell) = (g.len(), &self.cell);
        let centre = [cell.width / 2.0, cell.height / 2.0];
        let scale = cell.stress_scale();
        let movable: Vec<bool> = (0..n).map(|i| self.movable(i)).collect();
        let mut s = StressTensors::default();
        let mut virial = Tensor2::ZERO;
        let (mut internal_torque, mut all_torque) = (0.0, 0.0);
        for v in &self.scratch.visits {
            let (i, j) = (v.i as usize, v.other as usize);
            let half = v.tangential / 2.0;
            let t = [-v.n[1] * half, v.n[0] * half];
            let own = [v.central * v.n[0] + t[0], v.central * v.n[1] + t[1]];
            let back = [-t[0], -t[1]];
            let torque = v.d * half;
            // Each visit registers a force on both ends; every pair is visited from both sides, hence the halves.
            virial +=
                Tensor2::dyad(own, v.separation.map(|c| -0.5 * c)) + Tensor2::dyad(back, v.separation.map(|c| 0.5 * c));
            all_torque += torque;
            for (target, source, force) in [(i, j, own), (j, i, back)] {
                if !movable[target] {
                    continue;
                }
                if movable[source] && !v.wrapped {
                    let arm = [0.5 * (g.x[target] - g.x[source]), 0.5 * (g.y[target] - g.y[source])];
                    s.love_weber += Tensor2::dyad(force, arm);
                    internal_torque += torque * (g.radius[target] / (g.radius[i] + g.radius[j]));
                } else {
                    let arm = [g.x[target] - centre[0], g.y[target] - centre[1]];
                    s.external += -Tensor2::dyad(force, arm);
                }
            }
        }
        let (mut net_torque, mut spin, mut all_spin) = (0.0, 0.0, 0.0);
        for i in 0..n {
            net_torque += self.torque[i];
            let k = 0.5 * g.inertia[i] * g.omega[i] * g.omega[i];
            all_spin += k;
            if movable[i] {
                s.linear += Tensor2::dyad([self.fx[i], self.fy[i]], [g.x[i] - centre[0], g.y[i] - centre[1]]);
                spin += k;
                let p = [g.mass[i] * (g.vx[i] - cell.rate * (g.y[i] - centre[1])), g.mass[i] * g.vy[i]];
                s.otsuki += -Tensor2::dyad(p, p.map(|c| c / g.mass[i]));
            }
        }
        s.love_weber = s.love_weber * scale;
        s.external = s.external * scale;
        s.linear = s.linear * scale;
        s.otsuki = s.otsuki * scale;
        s.torque = Tensor2::torque(net_torque * scale);
        s.internal_torque = Tensor2::torque(internal_torque * scale);
        s.centrifugal = Tensor2::isotropic(-spin * scale);
        s.overall = s.love_weber + s.internal_torque + s.centrifugal;
        s.bulk = virial * scale + Tensor2::torque(all_torque * scale) + Tensor2::isotropic(-all_spin * scale);
        s
    }
}

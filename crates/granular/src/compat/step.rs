//! Kick, damp, move: the second half of a time step, in the published order.

use super::state::DirectedSample;
use crate::error::GranularError;
use crate::model::ContactKind;

impl DirectedSample {
    /// Sets a new shear rate and shifts all velocities so that peculiar ones stay the same.
    pub fn set_rate(&mut self, rate: f64) {
        let change = rate - self.cell.rate;
        let mid = self.cell.height / 2.0;
        for i in 0..self.grains.len() {
            self.grains.vx[i] += (self.grains.y[i] - mid) * change;
            self.grains.omega[i] -= change / 2.0;
        }
        self.cell.rate = rate;
    }

    /// Moves the evaluated sample on by `dt` (steps 6–13): kick, plates, damping by the factor `damping`, drift, shear, wrap.
    ///
    /// `zero_forces` clears the forces of carried grains as well, as the oscillation protocol does.
    ///
    /// # Errors
    /// [`GranularError::NonFinite`] if a grain's state overflows.
    pub fn integrate(&mut self, dt: f64, damping: f64, zero_forces: bool) -> Result<(), GranularError> {
        let n = self.grains.len();
        let (height, mid) = (self.cell.height, self.cell.height / 2.0);
        let rate = self.cell.rate;
        for i in 0..n {
            let movable = self.movable(i);
            let g = &mut self.grains;
            if movable {
                g.vx[i] += self.fx[i] / g.mass[i] * dt;
                g.vy[i] += self.fy[i] / g.mass[i] * dt;
                self.fx[i] = 0.0;
                self.fy[i] = 0.0;
            } else {
                g.vy[i] = 0.0;
                g.vx[i] = if g.y[i] > mid { rate * height / 2.0 } else { -rate * height / 2.0 };
            }
            g.omega[i] += self.torque[i] / g.inertia[i] * dt;
            self.torque[i] = 0.0;
            let flow = (g.y[i] - mid) * rate;
            g.vx[i] = flow + (g.vx[i] - flow) * damping;
            g.vy[i] *= damping;
            g.omega[i] *= damping;
        }
        for i in 0..n {
            self.grains.angle[i] += self.grains.omega[i] * dt;
            for k in 0..self.contacts[i].len() {
                let c = self.contacts[i][k];
                if matches!(c.kind, ContactKind::Stick | ContactKind::Permanent) {
                    // Positions are a mix of moved and unmoved grains here (fault F3).
                    self.contacts[i][k].spring += self.sliding_speed(i, c.other as usize) * dt;
                }
            }
            let g = &mut self.grains;
            let moved = &mut self.candidates.moved[i];
            moved[0] += (g.vx[i] - (g.y[i] - mid) * rate) * dt;
            moved[1] += g.vy[i] * dt;
            g.x[i] += g.vx[i] * dt;
            g.y[i] += g.vy[i] * dt;
        }
        self.cell.strain += rate * dt;
        self.time += dt;
        let mut sum = 0.0;
        for i in 0..n {
            let g = &mut self.grains;
            let ([x, y], kick) = self.cell.wrap(g.x[i], g.y[i]);
            g.x[i] = x;
            g.y[i] = y;
            g.vx[i] += kick;
            sum += x + y + g.vx[i] + g.vy[i] + g.omega[i];
        }
        if zero_forces {
            self.fx.fill(0.0);
            self.fy.fill(0.0);
        }
        if !sum.is_finite() {
            self.grains.check(self.time)?;
            return Err(GranularError::NonFinite { grain: 0, time: self.time });
        }
        Ok(())
    }

    fn sliding_speed(&mut self, i: usize, j: usize) -> f64 {
        let g = &self.grains;
        let ([dx, dy], rows, _) = self.cell.nearest(g.x[j] - g.x[i], g.y[j] - g.y[i]);
        let shift = -f64::from(rows) * self.cell.height * self.cell.rate;
        let (rvx, rvy) = (g.vx[j] - g.vx[i] + shift, g.vy[j] - g.vy[i]);
        let spin = g.radius[i] * g.omega[i] + g.radius[j] * g.omega[j];
        let d = (dx * dx + dy * dy).sqrt();
        let n = if d > 0.0 {
            [dx / d, dy / d]
        } else {
            let angle = std::f64::consts::TAU * self.random.uniform();
            [angle.cos(), angle.sin()]
        };
        rvx * -n[1] + rvy * n[0] - spin
    }
}

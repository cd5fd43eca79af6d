//! Friction of the film on the strand.
//!
//! With the perimeter `A/h`, momentum of an edge reads `ρh (u − u*) + dt τ_w(u) = 0`: a scalar equation, solved to round-off. The
//! film sticks exactly where the momentum per area is below `dt τ_w(0⁺)`, so the threshold is crossed without chatter.
//!
//! Source: supplemental S43 and the authors' program for [`WallLaw::Paper`]; the plane Herschel–Bulkley film for
//! [`WallLaw::Lubrication`]. Slip adds `b` times the shear rate at the wall: the same for a Newtonian film, and continuous at
//! yield where a slip viscosity taken from the mean speed would jump.

use constitutive::flow_map::ln_fraction;

use crate::liquid::FilmLiquid;
use crate::settings::WallLaw;

/// Friction of one liquid on a strand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wall {
    law: WallLaw,
    slip: f64,
    density: f64,
    yield_stress: f64,
    consistency: f64,
    index: f64,
}

impl Wall {
    /// Friction of the liquid under the law, with the slip length `slip` [m].
    #[must_use]
    pub fn new(law: WallLaw, liquid: &FilmLiquid, slip: f64) -> Self {
        let (yield_stress, consistency, index) = match law {
            WallLaw::Lubrication => liquid.shear,
            WallLaw::Paper => liquid.paper,
        };
        Wall { law, slip, density: liquid.density, yield_stress, consistency, index }
    }

    /// Wall stress [Pa] at which a film of the given height [m] begins to move.
    #[inline]
    #[must_use]
    pub fn yield_stress(&self, height: f64) -> f64 {
        match self.law {
            WallLaw::Lubrication => self.yield_stress,
            WallLaw::Paper => height / (self.slip + height / 3.0) * self.yield_stress,
        }
    }

    /// Mean speed [m/s] of a film of the given height [m] under the wall stress `stress` [Pa]; infinite without viscosity.
    #[must_use]
    pub fn mean_speed(&self, stress: f64, height: f64) -> f64 {
        let excess = stress - self.yield_stress(height);
        if excess <= 0.0 || height <= 0.0 {
            return 0.0;
        }
        match self.law {
            WallLaw::Paper => {
                let factor = height / (self.slip + height / 3.0);
                height * ((excess / (factor * self.consistency)).ln() / self.index).exp()
            }
            WallLaw::Lubrication => {
                let rate = ((excess / self.consistency).ln() / self.index).exp();
                rate * self.gap(excess, height).0
            }
        }
    }

    /// Mean speed over wall shear rate [m] under the lubrication law, and its derivative by the logarithm of that rate.
    #[inline]
    fn gap(&self, excess: f64, height: f64) -> (f64, f64) {
        let n = self.index;
        let (c1, c2) = (n / (n + 1.0), n / (2.0 * n + 1.0));
        let flowing = excess / (self.yield_stress + excess);
        let gap = self.slip + c1 * height * flowing * (1.0 - c2 * flowing);
        (gap, c1 * height * (1.0 - 2.0 * c2 * flowing) * n * flowing * (1.0 - flowing))
    }

    /// Speed after the friction of a step; 0 where the film sticks.
    ///
    /// - `speed`: speed before friction [m/s]
    /// - `height`: height of the film [m]
    /// - `dt`: step [s]
    #[inline]
    #[must_use]
    pub fn rub(&self, speed: f64, height: f64, dt: f64) -> f64 {
        let size = speed.abs();
        let inertia = self.density * height;
        let drive = inertia * size - dt * self.yield_stress(height);
        if drive <= 0.0 || height <= 0.0 {
            return 0.0;
        }
        let free = drive / inertia;
        if self.consistency == 0.0 {
            return free.copysign(speed);
        }
        let n = self.index;
        let slowed = match self.law {
            // linear in the speed: no power to solve
            WallLaw::Paper if n == 1.0 => drive / (inertia + dt * self.consistency / (self.slip + height / 3.0)),
            WallLaw::Lubrication if n == 1.0 && self.yield_stress == 0.0 => {
                drive / (inertia + dt * self.consistency / (self.slip + height / 3.0))
            }
            WallLaw::Paper => {
                let ln_damping = (dt * height / (self.slip + height / 3.0) * self.consistency).ln()
                    + n * (free.ln() - height.ln())
                    - drive.ln();
                free * ln_fraction(ln_damping, n).exp()
            }
            WallLaw::Lubrication if self.yield_stress == 0.0 => {
                // the gap is constant: speed and wall stress are powers of the wall shear rate
                let gap = self.gap(1.0, height).0;
                let ln_damping = (dt * self.consistency).ln() + n * (free / gap).ln() - drive.ln();
                free * ln_fraction(ln_damping, n).exp()
            }
            WallLaw::Lubrication => self.rub_yielding(inertia, drive, height, dt),
        };
        slowed.min(size).copysign(speed)
    }

    /// Lubrication with a yield stress: `ρh U(w) + dt K wⁿ = drive` for the wall shear rate `w`, in its logarithm.
    fn rub_yielding(&self, inertia: f64, drive: f64, height: f64, dt: f64) -> f64 {
        let n = self.index;
        let ln_drive = drive.ln();
        let ln_damping = (dt * self.consistency).ln();
        // friction alone bounds the rate from above
        let mut high = (ln_drive - ln_damping) / n;
        let mut low = f64::NEG_INFINITY;
        let mut x = high;
        let mut speed = 0.0;
        for _ in 0..80 {
            let excess = self.consistency * (n * x).exp();
            let (gap, gap_slope) = self.gap(excess, height);
            speed = x.exp() * gap;
            let (inertial, viscous) = (inertia * speed, dt * excess);
            let total = inertial + viscous;
            let miss = total.ln() - ln_drive;
            if miss > 0.0 {
                high = x;
            } else {
                low = x;
            }
            let slope = (inertial * (1.0 + gap_slope / gap.max(f64::MIN_POSITIVE)) + n * viscous) / total;
            let mut next = x - miss / slope;
            if !(next >= low && next <= high) {
                next = if low.is_finite() { 0.5 * (low + high) } else { high - 2.0 };
            }
            let step = (next - x).abs();
            x = next;
            if step <= 1e-14 * (1.0 + x.abs()) || miss.abs() <= 4.0 * f64::EPSILON {
                break;
            }
        }
        speed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use constitutive::{FlowCurve, Liquid};
    use proptest::prelude::*;

    fn wall(law: WallLaw, yield_stress: f64, consistency: f64, index: f64, slip: f64) -> Wall {
        let flow = FlowCurve::Rheometer { yield_stress, consistency, index };
        let liquid = Liquid { flow, ..Liquid::preset("oyster-sauce").unwrap() };
        Wall::new(law, &FilmLiquid::new(&liquid).unwrap(), slip)
    }

    /// Plane films, from quadrature of the velocity profile.
    #[test]
    fn mean_speed_is_that_of_the_profile() {
        for (tau, k, n, slip) in
            [(1.0, 0.4, 0.5173, 0.0), (0.0, 1.0, 1.0, 1e-5), (5.0, 2.0, 0.22, 2e-5), (3.0, 0.1, 1.6, 0.0)]
        {
            let law = wall(WallLaw::Lubrication, tau, k, n, slip);
            let (h, stress) = (1e-3, 2.5 * tau + 1.0);
            // shear stress falls linearly from the wall; integrate the rate twice by the midpoint rule
            let count = 200_000;
            let (mut speed, mut mean) = (0.0, 0.0);
            for i in 0..count {
                let y = (i as f64 + 0.5) / count as f64;
                let rate = (((stress * (1.0 - y) - tau) / k).max(0.0)).powf(1.0 / n);
                mean += (speed + 0.5 * rate * h / count as f64) / count as f64;
                speed += rate * h / count as f64;
            }
            mean += slip * ((stress - tau) / k).powf(1.0 / n);
            approx::assert_relative_eq!(law.mean_speed(stress, h), mean, max_relative = 1e-6);
            assert_eq!(law.mean_speed(tau, h), 0.0);
        }
    }

    #[test]
    fn both_laws_agree_for_a_newtonian_film() {
        let (a, b) = (wall(WallLaw::Lubrication, 0.0, 0.3, 1.0, 1e-5), wall(WallLaw::Paper, 0.0, 0.3, 1.0, 1e-5));
        approx::assert_relative_eq!(a.mean_speed(2.0, 1e-4), b.mean_speed(2.0, 1e-4), max_relative = 1e-13);
        approx::assert_relative_eq!(a.rub(0.2, 1e-4, 1e-3), b.rub(0.2, 1e-4, 1e-3), max_relative = 1e-12);
        assert_eq!(a.rub(0.2, 0.0, 1e-3), 0.0);
    }

    proptest! {
        #[test]
        fn friction_balances_and_never_turns_the_film_round(
            paper in any::<bool>(), tau in prop_oneof![Just(0.0), 0.01f64..100.0], ln_k in -7.0f64..5.0, n in 0.1f64..2.5,
            slip in prop_oneof![Just(0.0), 1e-7f64..1e-4], ln_u in -12.0f64..4.0, ln_h in -16.0f64..-4.0, ln_dt in -12.0f64..2.0,
        ) {
            let law = wall(if paper { WallLaw::Paper } else { WallLaw::Lubrication }, tau, ln_k.exp(), n, slip);
            let (u, h, dt) = (ln_u.exp(), ln_h.exp(), ln_dt.exp());
            let out = law.rub(u, h, dt);
            prop_assert!((0.0..=u).contains(&out));
            prop_assert_eq!(law.rub(-u, h, dt), -out);
            let inertia = law.density * h;
            if out == 0.0 {
                prop_assert!(inertia * u <= dt * law.yield_stress(h) * (1.0 + 1e-12) || law.mean_speed((inertia * u) / dt, h) < 1e-290);
            } else {
                // backward error: momenta off by 1e-12 enclose the speed found, however steep the law
                let stress = inertia * (u - out) / dt;
                let off = 1e-12 * inertia * u / dt;
                let (low, high) = (law.mean_speed(stress - off, h), law.mean_speed(stress + off, h));
                prop_assert!(low <= out * (1.0 + 1e-9) && out <= high * (1.0 + 1e-9), "{} <= {} <= {}", low, out, high);
            }
        }
    }
}

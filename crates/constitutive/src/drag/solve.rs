//! Speed after a step in which drag acts implicitly.

use serde::{Deserialize, Serialize};

use super::{DragGeometry, DragLaw, voidage_exponent};

/// Result of one implicit step of drag between a piece of strand and the liquid around it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DragStep {
    /// Relative speed after the step [m/s]; exactly 0 when stuck.
    pub speed: f64,
    /// Secant coefficient 𝒟 [kg/s]: the force is `𝒟 (u_f − u_s)` with the relative velocity after the step. Capped at
    /// `10⁸ m/dt` when stuck.
    pub coefficient: f64,
    /// Impulse exchanged along the relative velocity [N·s].
    pub impulse: f64,
    /// Whether the liquid holds the strand: the momentum to be lost is below the yield force times the step.
    pub stuck: bool,
}

impl DragLaw {
    /// Solves `m (U − U*) + dt F(U) = 0` for the relative speed `U` after a step; sticks when `m U* ≤ dt F_Y`.
    ///
    /// - `speed`: relative speed before drag `U*` [m/s]
    /// - `reduced_mass`: `(1/m_s + 1/m_f)⁻¹` of strand and entrained liquid [kg]
    /// - `dt`: step [s]
    /// - `porosity`: liquid fraction `ε_f` in (0, 1]
    ///
    /// The exponent of the voidage function is frozen at `U*`, which makes the force monotone. Nothing overshoots: the speed
    /// stays within `[0, U*]` for any step. Input that is not finite gives no drag.
    #[must_use]
    pub fn solve(&self, speed: f64, reduced_mass: f64, dt: f64, geometry: &DragGeometry, porosity: f64) -> DragStep {
        let free = DragStep { speed: speed.max(0.0), coefficient: 0.0, impulse: 0.0, stuck: false };
        let momentum = reduced_mass * speed;
        if !(speed > 0.0 && momentum > 0.0 && dt > 0.0 && momentum.is_finite() && porosity > 0.0) {
            return free;
        }
        let exponent = voidage_exponent(self.reynolds(speed, geometry.diameter, porosity));
        let begin = self.force(speed, geometry, porosity, exponent);
        let cap = 1e8 * reduced_mass / dt;
        let drive = momentum - dt * begin.yield_force;
        if drive <= 0.0 {
            return DragStep { speed: 0.0, coefficient: cap, impulse: momentum, stuck: true };
        }
        // the yield force is taken off both sides, so speeds just above sticking keep their digits;
        // unknown ln U, equation ln(m U + dt F_viscous) = ln drive
        let ln_drive = drive.ln();
        let mut high = speed.ln();
        let mut low = f64::NEG_INFINITY;
        let mut x = high - (dt * begin.viscous_force / momentum).ln_1p();
        for _ in 0..100 {
            let now = x.exp();
            let force = self.force(now, geometry, porosity, exponent);
            let total = reduced_mass * now + dt * force.viscous_force;
            if total <= 0.0 {
                break; // speed underflowed: as good as stuck
            }
            let miss = total.ln() - ln_drive;
            if miss > 0.0 {
                high = x;
            } else {
                low = x;
            }
            let slope = (reduced_mass * now + dt * force.by_ln_speed) / total;
            let mut next = x - miss / slope;
            if !(next >= low && next <= high) {
                next = if low.is_finite() { 0.5 * (low + high) } else { high - 4.0 };
            }
            let step = (next - x).abs();
            x = next;
            if step <= 1e-14 * (1.0 + x.abs()) || miss.abs() <= 4.0 * f64::EPSILON {
                break;
            }
        }
        let end = x.exp().min(speed);
        let impulse = reduced_mass * (speed - end);
        DragStep { speed: end, coefficient: (impulse / (dt * end)).min(cap), impulse, stuck: false }
    }

    /// Steady speed [m/s] at which drag balances the force `load` [N]; 0 below the yield force.
    #[must_use]
    pub fn terminal_speed(&self, load: f64, geometry: &DragGeometry, porosity: f64) -> f64 {
        // the exponent depends on the speed sought: bisect for both together (the force is monotone but for small dips)
        let force = |ln_u: f64| {
            let u = ln_u.exp();
            self.force(u, geometry, porosity, voidage_exponent(self.reynolds(u, geometry.diameter, porosity))).total()
        };
        if load <= self.yield_force(geometry, porosity, 3.7) || !load.is_finite() {
            return 0.0;
        }
        let (mut low, mut high) = (-345.0, 60.0);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if force(middle) > load {
                high = middle;
            } else {
                low = middle;
            }
        }
        (0.5 * (low + high)).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drag::DragSettings;
    use crate::flow_curve::FlowCurve;
    use proptest::prelude::*;

    fn law(density: f64, curve: FlowCurve) -> DragLaw {
        DragLaw::new(density, &curve, DragSettings::default()).unwrap()
    }

    proptest! {
        #[test]
        fn the_step_balances_and_never_overshoots(n in 0.1f64..2.0, tau in prop_oneof![Just(0.0), 0.0f64..30.0], ln_eta in -7.0f64..4.0,
                                                  ln_u in -9.0f64..4.0, ln_m in -25.0f64..0.0, ln_dt in -12.0f64..3.0, porosity in 0.1f64..1.0) {
            let law = law(1000.0, FlowCurve::Rheometer { yield_stress: tau, consistency: ln_eta.exp(), index: n });
            let body = DragGeometry::capsule(5e-5, 2e-3, 0.6);
            let (u, m, dt) = (ln_u.exp(), ln_m.exp(), ln_dt.exp());
            let step = law.solve(u, m, dt, &body, porosity);
            prop_assert!(step.speed >= 0.0 && step.speed <= u && step.coefficient.is_finite() && step.coefficient >= 0.0);
            let exponent = voidage_exponent(law.reynolds(u, body.diameter, porosity));
            if step.stuck {
                prop_assert!(m * u <= dt * law.yield_force(&body, porosity, exponent) && step.speed == 0.0);
            } else if step.speed > 0.0 {
                let balance = m * (step.speed - u) + dt * law.force(step.speed, &body, porosity, exponent).total();
                prop_assert!(balance.abs() <= 1e-9 * m * u, "{balance} of {}", m * u);
            }
        }
    }

    /// Glass sphere in water, the cases of the specification (in SI).
    #[test]
    fn terminal_speed_of_a_sphere_in_water() {
        let law = law(1000.0, FlowCurve::newtonian(8.9e-4));
        for (d, expected) in [(2e-3, 0.29048), (1e-4, 0.008_173_1)] {
            let body = DragGeometry::sphere(d);
            let weight = 1500.0 * 9.81 * std::f64::consts::PI * d.powi(3) / 6.0;
            approx::assert_relative_eq!(law.terminal_speed(weight, &body, 1.0), expected, max_relative = 1e-4);
        }
    }

    #[test]
    fn a_light_body_sticks_and_a_heavy_one_sinks() {
        let law = law(200.0, FlowCurve::J2 { yield_stress: 31.9, consistency: 27.2, index: 0.22 });
        let body = DragGeometry::sphere(1e-2);
        let hold = law.yield_force(&body, 1.0, 3.7);
        assert_eq!(law.terminal_speed(0.999 * hold, &body, 1.0), 0.0);
        assert!(law.terminal_speed(1.001 * hold, &body, 1.0) > 0.0);
        let (m, dt) = (1e-3, 1e-3);
        assert!(law.solve(0.999 * dt * hold / m, m, dt, &body, 1.0).stuck);
        let moving = law.solve(1.001 * dt * hold / m, m, dt, &body, 1.0);
        assert!(!moving.stuck && moving.speed > 0.0);
    }
}

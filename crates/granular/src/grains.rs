//! The grains: one array per quantity, the state both modes start from and report.

use crate::error::GranularError;
use serde::{Deserialize, Serialize};

/// Discs in the plane (cylinders per metre of depth); one entry per grain in every array.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Grains {
    /// Position along the flow [µm].
    pub x: Vec<f64>,
    /// Position along the gradient [µm].
    pub y: Vec<f64>,
    /// Velocity along the flow [µm/s].
    pub vx: Vec<f64>,
    /// Velocity along the gradient [µm/s].
    pub vy: Vec<f64>,
    /// Angular velocity [rad/s].
    pub omega: Vec<f64>,
    /// Angle [rad], output only.
    pub angle: Vec<f64>,
    /// Radius [µm].
    pub radius: Vec<f64>,
    /// Mass [mg/m].
    pub mass: Vec<f64>,
    /// Moment of inertia [mg µm²/m].
    pub inertia: Vec<f64>,
}

impl Grains {
    /// Number of grains.
    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// True without any grain.
    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }

    /// Adds a disc at rest with the inertia of a homogeneous cylinder.
    pub fn push(&mut self, position: [f64; 2], radius: f64, mass: f64) {
        self.x.push(position[0]);
        self.y.push(position[1]);
        self.vx.push(0.0);
        self.vy.push(0.0);
        self.omega.push(0.0);
        self.angle.push(-std::f64::consts::FRAC_PI_2);
        self.radius.push(radius);
        self.mass.push(mass);
        self.inertia.push(0.5 * mass * radius * radius);
    }

    /// Checks lengths, finiteness and signs.
    ///
    /// # Errors
    /// [`GranularError::State`] or [`GranularError::NonFinite`].
    pub fn check(&self, time: f64) -> Result<(), GranularError> {
        let n = self.len();
        let all =
            [&self.x, &self.y, &self.vx, &self.vy, &self.omega, &self.angle, &self.radius, &self.mass, &self.inertia];
        if all.iter().any(|a| a.len() != n) {
            return Err(GranularError::State("arrays of grains differ in length".into()));
        }
        for i in 0..n {
            if all.iter().any(|a| !a[i].is_finite()) {
                return Err(GranularError::NonFinite { grain: i, time });
            }
            if self.radius[i] <= 0.0 || self.mass[i] <= 0.0 || self.inertia[i] <= 0.0 {
                return Err(GranularError::State(format!("grain {i} has no size, mass or inertia")));
            }
        }
        Ok(())
    }

    /// Linear momentum and angular momentum about the origin, `[p_x, p_y, L]`.
    pub fn momenta(&self) -> [f64; 3] {
        let mut p = [0.0; 3];
        for i in 0..self.len() {
            let (px, py) = (self.mass[i] * self.vx[i], self.mass[i] * self.vy[i]);
            p[0] += px;
            p[1] += py;
            p[2] += self.x[i] * py - self.y[i] * px + self.inertia[i] * self.omega[i];
        }
        p
    }

    /// Kinetic energy of translation and rotation relative to the homogeneous shear flow about mid height [µm² mg s⁻²/m].
    pub fn kinetic_energy(&self, rate: f64, mid: f64) -> f64 {
        (0..self.len())
            .map(|i| {
                let vx = self.vx[i] - rate * (self.y[i] - mid);
                0.5 * self.mass[i] * (vx * vx + self.vy[i] * self.vy[i])
                    + 0.5 * self.inertia[i] * self.omega[i] * self.omega[i]
            })
            .sum()
    }

    /// Summed disc area over box area, the realised packing.
    pub fn packing(&self, area: f64) -> f64 {
        self.radius.iter().map(|r| std::f64::consts::PI * r * r).sum::<f64>() / area
    }
}

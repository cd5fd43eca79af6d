//! Closed forms of steady Herschel–Bulkley flow between plates, in a pipe, and of a layer on a plane.

use constitutive::{FlowCurve, Liquid};

/// Yield stress τ_s, consistency K and index n in simple shear.
#[derive(Clone, Copy, Debug)]
pub struct Shear {
    pub tau: f64,
    pub k: f64,
    pub n: f64,
}

impl Shear {
    /// The simple-shear reading of a liquid.
    pub fn of(liquid: &Liquid) -> Shear {
        match liquid.flow {
            FlowCurve::Rheometer { yield_stress, consistency, index } => {
                Shear { tau: yield_stress, k: consistency, n: index }
            }
            FlowCurve::J2 { yield_stress, consistency, index } => {
                Shear { tau: yield_stress / 3f64.sqrt(), k: consistency * 2f64.powf(-0.5 * (index + 1.0)), n: index }
            }
        }
    }

    /// Half-width of the plug at the pressure gradient `g`.
    pub fn plug(&self, g: f64) -> f64 {
        self.tau / g
    }

    /// Velocity at the distance `y` from the plane of symmetry (or the free surface), walls at `h`.
    pub fn velocity(&self, g: f64, h: f64, y: f64) -> f64 {
        let y0 = self.plug(g);
        if y0 >= h {
            return 0.0;
        }
        let e = 1.0 + 1.0 / self.n;
        let scale = (g / self.k).powf(1.0 / self.n) / e;
        scale * ((h - y0).powf(e) - (y.abs() - y0).max(0.0).powf(e))
    }

    /// Mean velocity between plates at `±h`.
    pub fn mean(&self, g: f64, h: f64) -> f64 {
        let y0 = self.plug(g);
        if y0 >= h {
            return 0.0;
        }
        self.velocity(g, h, 0.0) * (1.0 - self.n / (2.0 * self.n + 1.0) * (1.0 - y0 / h))
    }

    /// Mean velocity in a pipe of radius `a`.
    pub fn pipe_mean(&self, g: f64, a: f64) -> f64 {
        let wall = 0.5 * g * a;
        let phi = self.tau / wall;
        if phi >= 1.0 {
            return 0.0;
        }
        let n = self.n;
        let f = 1.0 - phi;
        a * (wall / self.k).powf(1.0 / n)
            * f.powf(1.0 + 1.0 / n)
            * (n * f * f / (3.0 * n + 1.0) + 2.0 * n * phi * f / (2.0 * n + 1.0) + n * phi * phi / (n + 1.0))
    }

    /// Velocity in a pipe at the radius `r`.
    pub fn pipe_velocity(&self, g: f64, a: f64, r: f64) -> f64 {
        self.velocity(0.5 * g, a, r)
    }

    /// Pressure gradient that drives the mean velocity `mean` between plates at `±h`.
    pub fn gradient_for(&self, mean: f64, h: f64) -> f64 {
        let (mut low, mut high) = (self.tau / h, 2.0 * self.tau / h + 1e-12);
        while self.mean(high, h) < mean {
            high *= 2.0;
        }
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if self.mean(middle, h) < mean {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tabulated_channels_and_pipes() {
        // Gradients and speeds of the specification, in CGS; rows share 2H = 1 cm and a mean of 1 cm/s.
        for (name, g, u_max, y0, pipe) in [
            ("drilling-mud", 46.876, 1.17502, 0.2071, 0.866549),
            ("shaving-cream", 1049.35, 1.11006, 0.1755, 0.908871),
            ("milk-chocolate", 630.10, 1.17517, 0.2749, 0.86406),
        ] {
            let shear = Shear::of(&Liquid::preset(name).unwrap());
            let found = shear.gradient_for(0.01, 0.005);
            assert!((found / (10.0 * g) - 1.0).abs() < 1e-4, "{name} {found}");
            assert!((shear.velocity(found, 0.005, 0.0) / (0.01 * u_max) - 1.0).abs() < 1e-4);
            assert!((shear.plug(found) / (0.01 * y0) - 1.0).abs() < 1e-3);
            assert!((shear.pipe_mean(2.0 * found, 0.005) / (0.01 * pipe) - 1.0).abs() < 1e-4);
        }
    }
}

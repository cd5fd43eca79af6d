//! Steady Herschel–Bulkley flow between plates, in a pipe, and of a layer on a plane: the closed forms, and the flow of the elastic
//! liquid itself.
//!
//! The closed forms hold for small elastic strain. At finite strain the deviator `D` of `b̄` in steady shear is not along the
//! shear alone; with `q` the ratio of shear rate to rate of relaxation, `∇u b̄ + b̄ ∇uᵀ` balances the flow for
//! `τ = μ q (1 + q²)^{-1/d}` and `γ̇ = √2 √(1+q²) γ̇_p(√2 μ q)` in the plane (`d = 2`),
//! `γ̇ = 2 (1 + ⅔q²)/√(2 + 8q²/3) γ̇_p(μ‖D‖)`, `‖D‖ = q (1+q²)^{-1/3} √(2 + 8q²/3)` in space.

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

    /// Shear rate under the shear stress `tau`.
    pub fn rate(&self, tau: f64) -> f64 {
        ((tau - self.tau).max(0.0) / self.k).powf(1.0 / self.n)
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

/// Steady shear flow of the liquid with its shear modulus, in two dimensions or three.
#[derive(Clone, Copy, Debug)]
pub struct Elastic {
    pub shear: Shear,
    /// Shear modulus [Pa]; zero for a liquid without elasticity.
    pub modulus: f64,
    /// Dimensions of the strain.
    pub dimensions: usize,
}

/// Panels of the integrals over the profile.
const PANELS: usize = 200;

impl Elastic {
    /// Shear rate under the shear stress `tau`; infinite where the liquid cannot bear it.
    pub fn rate(&self, tau: f64) -> f64 {
        if self.modulus <= 0.0 {
            return self.shear.rate(tau);
        }
        let wanted = tau / self.modulus;
        if self.dimensions == 2 {
            if wanted >= 1.0 {
                return f64::INFINITY;
            }
            let q = wanted / (1.0 - wanted * wanted).sqrt();
            return (1.0 + q * q).sqrt() * self.shear.rate(self.modulus * q);
        }
        // q (1 + q²)^{-1/3} grows without bound.
        let (mut low, mut high) = (0.0, 1.0 + wanted * wanted * wanted);
        for _ in 0..100 {
            let q = 0.5 * (low + high);
            if q * (1.0 + q * q).powf(-1.0 / 3.0) < wanted { low = q } else { high = q }
        }
        let q = 0.5 * (low + high);
        let stretch = (2.0 + 8.0 * q * q / 3.0).sqrt();
        let norm = q * (1.0 + q * q).powf(-1.0 / 3.0) * stretch;
        // γ̇ = √2 γ̇_p(√2 τ) at small strain turns the plastic rate of a norm into that of simple shear.
        2.0 * (1.0 + 2.0 * q * q / 3.0) / stretch / 2f64.sqrt() * self.shear.rate(self.modulus * norm / 2f64.sqrt())
    }

    /// `∫ rate(slope·y) weight(y) dy` over `low..high` (Simpson, panels doubled towards the wall).
    fn integral(&self, slope: f64, low: f64, high: f64, weight: impl Fn(f64) -> f64) -> f64 {
        let low = low.max(0.9 * self.shear.tau / slope).min(high);
        let h = (high - low) / PANELS as f64;
        let f = |y: f64| self.rate(slope * y) * weight(y);
        (0..PANELS)
            .map(|k| {
                let a = low + k as f64 * h;
                h / 6.0 * (f(a) + 4.0 * f(a + 0.5 * h) + f(a + h))
            })
            .sum()
    }

    /// Velocity at the distance `y` from the middle where the shear stress is `slope·y` and the wall is at `h`.
    pub fn velocity(&self, slope: f64, h: f64, y: f64) -> f64 {
        self.integral(slope, y.abs(), h, |_| 1.0)
    }

    /// Mean velocity between plates at `±h`, or of a layer of the height `h`.
    pub fn mean(&self, slope: f64, h: f64) -> f64 {
        self.integral(slope, 0.0, h, |y| y) / h
    }

    /// Mean velocity in a pipe of radius `a` with the pressure gradient `g`.
    pub fn pipe_mean(&self, g: f64, a: f64) -> f64 {
        self.integral(0.5 * g, 0.0, a, |r| r * r) / (a * a)
    }
}

/// Factor on the shear modulus of a case: the one asked for, or for zero the one that keeps elastic strains below a fortieth at
/// the wall stress `wall`, where the closed forms of small strain hold.
pub fn stiffening(asked: f64, modulus: f64, wall: f64) -> f64 {
    if asked > 0.0 {
        asked
    } else if modulus > 0.0 {
        (40.0 * wall / modulus).max(1.0)
    } else {
        1.0
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

    #[test]
    fn elastic_flow_is_that_of_the_tensor_equation() {
        let liquid = Liquid::preset("shaving-cream").unwrap();
        let law = liquid.law(constitutive::LawSettings::default()).unwrap();
        let elastic = Elastic { shear: Shear::of(&liquid), modulus: liquid.shear_modulus, dimensions: 3 };
        for rate in [1.0, 10.0, 60.0] {
            let (stress, ..) = constitutive::viscometer::TensorReference::new(&law).steady(rate).unwrap();
            assert!((elastic.rate(stress) / rate - 1.0).abs() < 1e-6, "{rate} {}", elastic.rate(stress));
        }
    }

    #[test]
    fn stiff_liquids_flow_as_the_closed_forms() {
        let shear = Shear::of(&Liquid::preset("drilling-mud").unwrap());
        for dimensions in [2, 3] {
            let elastic = Elastic { shear, modulus: 1e6, dimensions };
            let g = 468.76;
            assert!((elastic.velocity(g, 0.005, 0.001) / shear.velocity(g, 0.005, 0.001) - 1.0).abs() < 1e-5);
            assert!((elastic.mean(g, 0.005) / shear.mean(g, 0.005) - 1.0).abs() < 1e-5);
            assert!((elastic.pipe_mean(2.0 * g, 0.005) / shear.pipe_mean(2.0 * g, 0.005) - 1.0).abs() < 1e-5);
        }
    }
}

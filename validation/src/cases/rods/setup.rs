//! What the rod cases share: slender rods built from dimensionless groups, observed orders, two ways to an onset.

use crate::case::{CaseError, Curve, Outcome, Table};
use nalgebra::Vector3;
use rods::{
    Boundary, End, EquilibriumSettings, Integrator, Loads, RodSet, RodSettings, RodStepper, StrandMaterial, StrandSpec,
    equilibrium,
};

pub type V = Vector3<f64>;

/// Standard gravity \[m/s²\].
pub const GRAVITY: f64 = 9.81;

/// A rod of unit length: so thin that stretch and shear of the section are below the tolerances.
pub const THIN: f64 = 2e-4;

/// A material of the given bending stiffness for a circular rod of radius [`THIN`].
pub fn thin_material(bending: f64) -> StrandMaterial {
    StrandMaterial {
        young_modulus: bending / (std::f64::consts::FRAC_PI_4 * THIN.powi(4)),
        poisson_ratio: 0.3,
        density: 1000.0,
        ..StrandMaterial::default()
    }
}

/// Weight per length of the thin rod under standard gravity \[N/m\].
pub fn thin_weight() -> f64 {
    1000.0 * std::f64::consts::PI * THIN * THIN * GRAVITY
}

/// A cantilever whose effective clamp, the middle of its first edge, is at the origin and whose free length is one.
pub struct Cantilever {
    pub rods: RodSet,
    pub boundary: Boundary,
}

/// Builds a straight cantilever along `axis` with `vertices` vertices; `shape` may change the specification.
pub fn cantilever(
    vertices: usize,
    axis: V,
    material: StrandMaterial,
    shape: impl FnOnce(&mut StrandSpec, f64),
) -> Result<Cantilever, CaseError> {
    let edge = 1.0 / (vertices as f64 - 1.5);
    let mut spec = StrandSpec::straight(axis * (-0.5 * edge), axis, vertices, THIN, material);
    shape(&mut spec, edge);
    let mut rods = RodSet::new();
    rods.add_strand(&spec).map_err(CaseError::failed)?;
    let mut boundary = Boundary::default();
    boundary.clamp(&rods, 0, End::Root);
    Ok(Cantilever { rods, boundary })
}

/// Brings the rods to rest.
pub fn settle(rods: &mut RodSet, loads: &Loads, boundary: &Boundary) -> Result<rods::EquilibriumReport, CaseError> {
    equilibrium(rods, loads, boundary, &EquilibriumSettings::default()).map_err(CaseError::failed)
}

/// Four vertex counts up to `vertices`, their numbers of edges about √2 apart.
pub fn resolutions(vertices: usize) -> [usize; 4] {
    let edges = vertices as f64 - 1.0;
    [0.35, 0.5, 0.71, 1.0].map(|share: f64| (share * edges).round() as usize + 1)
}

/// Observed order: least-squares slope of log error against log spacing. Errors at round-off are left out.
pub fn observed_order(points: &[(f64, f64)], floor: f64) -> f64 {
    let p: Vec<(f64, f64)> = points.iter().filter(|(_, e)| *e > floor).map(|(h, e)| (h.ln(), e.ln())).collect();
    if p.len() < 2 {
        return f64::NAN;
    }
    let n = p.len() as f64;
    let (mx, my) = (p.iter().map(|q| q.0).sum::<f64>() / n, p.iter().map(|q| q.1).sum::<f64>() / n);
    let above: f64 = p.iter().map(|q| (q.0 - mx) * (q.1 - my)).sum();
    above / p.iter().map(|q| (q.0 - mx).powi(2)).sum::<f64>()
}

/// Reports the errors of one measure over resolutions and judges their order.
pub fn report_order(out: &mut Outcome, name: &str, points: &[(f64, f64)], floor: f64) {
    out.table(Table {
        title: format!("error of {name} against edge length"),
        columns: vec!["edge length / rod length".into(), "error".into()],
        rows: points.iter().map(|(h, e)| vec![format!("{h:.5}"), format!("{e:.3e}")]).collect(),
    });
    out.curve(Curve {
        title: format!("convergence of {name}"),
        x_label: "edge length / rod length".into(),
        y_label: "error".into(),
        log_x: true,
        log_y: true,
        series: vec![(name.into(), points.iter().map(|(h, e)| [*h, *e]).collect())],
    });
    let above = points.iter().filter(|p| p.1 > floor).count();
    let order = observed_order(points, floor);
    let label = format!("order_{name}");
    if above < 2 {
        out.info(&label, f64::NAN);
        out.note(format!("{name}: errors are at round-off, no order to observe"));
    } else {
        if points.last().is_some_and(|p| p.1 < 3e-3) {
            out.measure(&label, order, |o| o > 1.75, "an observed order above 1.75 (second order)");
        } else {
            out.measure(
                &label,
                order,
                |o| o > 1.4,
                "an observed order above 1.4 (errors still too large for the limit)",
            );
        }
    }
}

/// A family of loaded rods with one load parameter.
pub struct Family<F> {
    /// State (first guess of the fundamental equilibrium), gravity, forces per vertex and boundary for a parameter.
    pub build: F,
}

/// One member of a family.
pub struct Member {
    pub rods: RodSet,
    pub gravity: V,
    pub force: Vec<V>,
    /// Boundary under which stability is asked for.
    pub boundary: Boundary,
    /// Stricter boundary that keeps the fundamental equilibrium, where one is needed to stay on it.
    pub symmetric: Option<Boundary>,
}

impl Member {
    pub fn loads(&self) -> Loads<'_> {
        Loads { gravity: self.gravity, force: Some(&self.force), ..Loads::default() }
    }
}

impl<F: Fn(f64) -> Result<Member, CaseError>> Family<F> {
    /// The member at its fundamental equilibrium.
    pub fn at(&self, parameter: f64) -> Result<Member, CaseError> {
        let mut member = (self.build)(parameter)?;
        let mut rods = std::mem::take(&mut member.rods);
        let boundary = member.symmetric.as_ref().unwrap_or(&member.boundary);
        settle(&mut rods, &member.loads(), boundary)?;
        member.rods = rods;
        Ok(member)
    }

    /// Parameter at which the smallest eigenvalue of the exact stiffness at the fundamental equilibrium turns negative,
    /// between a stable `low` and an unstable `high`.
    pub fn static_onset(&self, mut low: f64, mut high: f64, relative: f64) -> Result<f64, CaseError> {
        let unstable = |p: f64| -> Result<bool, CaseError> {
            let m = self.at(p)?;
            Ok(m.rods.unstable_modes(0, &m.loads(), &m.boundary) > 0)
        };
        if unstable(low)? {
            return Err(CaseError::failed(format!("unstable already at the low end {low} of the bracket")));
        }
        if !unstable(high)? {
            return Err(CaseError::failed(format!("still stable at the high end {high} of the bracket")));
        }
        while high - low > relative * high.abs() {
            let mid = 0.5 * (low + high);
            if unstable(mid)? {
                high = mid;
            } else {
                low = mid;
            }
        }
        Ok(0.5 * (low + high))
    }

    /// Parameter at which a perturbed rod starts to move away: the growth rates seen in dynamic runs at two parameters
    /// beyond the onset, extrapolated to zero (the square of the rate grows linearly with the load).
    ///
    /// `beyond`: distances past the expected onset, relative. Runs start from the fundamental equilibrium with small
    /// lateral velocities; the rate is the slope of the logarithm of the distance from equilibrium in its last third.
    pub fn dynamic_onset(&self, expected: f64, beyond: [f64; 2]) -> Result<f64, CaseError> {
        let mut squares = [0.0; 2];
        let mut at = [0.0; 2];
        for k in 0..2 {
            at[k] = expected * (1.0 + beyond[k]);
            squares[k] = self.growth(at[k])?.powi(2);
        }
        Ok(at[0] - squares[0] * (at[1] - at[0]) / (squares[1] - squares[0]))
    }

    /// Growth rate \[1/s\] of a small perturbation of the fundamental equilibrium, seen in a dynamic run.
    fn growth(&self, parameter: f64) -> Result<f64, CaseError> {
        // the step must resolve the growth: shorter until it takes sixty of them
        let mut step = 0.01;
        for _ in 0..6 {
            if let Some(rate) = self.growth_with(parameter, step)? {
                return Ok(rate);
            }
            step *= 0.2;
        }
        Err(CaseError::failed(format!("no growth seen at {parameter}")))
    }

    /// The growth rate seen with a step given in units of the rod's slow time; `None` if it went too fast to see.
    fn growth_with(&self, parameter: f64, step: f64) -> Result<Option<f64>, CaseError> {
        let mut member = self.at(parameter)?;
        let mut rods = std::mem::take(&mut member.rods);
        let loads = member.loads();
        let rest = rods.position.clone();
        let length: f64 = rods.rest_length.iter().sum();
        // the unit of time: slowest vibration of the rod's own stiffness, from its bending force scale
        let mass = rods.momentum(&loads).mass;
        let unit = (mass * length / rods.bending_force_scale(0)).sqrt();
        let free = rods.free_unknowns(0, &member.boundary);
        let small = 1e-7 * length / unit;
        for (i, v) in rods.velocity.iter_mut().enumerate() {
            let s = i as f64;
            let kick = V::new((1.3 * s).sin() + 0.4, (0.9 * s + 0.5).cos() + 0.3, (0.7 * s + 1.0).sin());
            for c in 0..3 {
                if free[4 * i + c] {
                    v[c] = small * kick[c];
                }
            }
        }
        let settings =
            RodSettings { integrator: Integrator::ImplicitMidpoint, tolerance: 1e-10, ..RodSettings::default() };
        let mut stepper = RodStepper::new(settings).map_err(CaseError::failed)?;
        let distance = |rods: &RodSet| -> f64 {
            rods.position.iter().zip(&rest).map(|(x, y)| (x - y).norm_squared()).sum::<f64>().sqrt()
        };
        let dt = step * unit;
        let mut seen: Vec<(f64, f64)> = Vec::new();
        for step in 1..=6000 {
            // a step too long for the motion shows as a solve that fails, or as growth in a few steps
            if stepper.advance(&mut rods, dt, &loads, &member.boundary).is_err() {
                return Ok(None);
            }
            let d = distance(&rods);
            seen.push((dt * f64::from(step), d.ln()));
            if d > 1e-4 * length {
                break;
            }
        }
        // the last third in logarithm of the distance: the growing mode has outrun the others by then
        let end = seen.last().map_or(0.0, |p| p.1);
        let begin = seen.iter().map(|p| p.1).fold(f64::INFINITY, f64::min);
        let from = seen.iter().position(|p| p.1 > end - (end - begin) / 3.0).unwrap_or(0);
        let fit = &seen[from..];
        if end < (1e-4 * length).ln() {
            return Err(CaseError::failed(format!("no growth seen at {parameter}")));
        }
        if seen.len() < 60 {
            return Ok(None);
        }
        let n = fit.len() as f64;
        let (mt, md) = (fit.iter().map(|p| p.0).sum::<f64>() / n, fit.iter().map(|p| p.1).sum::<f64>() / n);
        let above: f64 = fit.iter().map(|p| (p.0 - mt) * (p.1 - md)).sum();
        Ok(Some(above / fit.iter().map(|p| (p.0 - mt).powi(2)).sum::<f64>()))
    }
}

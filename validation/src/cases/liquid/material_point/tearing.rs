use constitutive::{HerschelBulkley, LawSettings, MaterialPoint, TornRule};
use nalgebra::{Matrix3, Vector3};

use super::liquid_choice::preset;
use crate::case::{Case, CaseError, Curve, Outcome, Param, Params};

pub const CASE: Case = Case {
    id: "liquid/tearing",
    about: "A thread drawn out at a constant rate tears when its plastic history reaches the tearing strain, computed from \
            the scalar equation of uniaxial flow, and bears no tension afterwards.",
    params: &[
        Param::text("material", "shaving-cream", "preset with a shear modulus"),
        Param::number("rate", 10.0, "1/s", "rate of extension"),
        Param::number("tearing_strain", 10.0, "1", "norm of the plastic history at which the liquid tears"),
        Param::count("steps_per_strain", 4000, "steps per unit of logarithmic strain"),
    ],
    run,
};

/// Logarithmic strain at which the history of a thread reaches the limit: the elastic stretch `θ` (`b̄ = diag(e^{2θ}, e^{−θ},
/// e^{−θ})`) follows one scalar equation, integrated here by the classical fourth-order method.
fn expected_strain(law: &HerschelBulkley, rate: f64, limit: f64) -> f64 {
    let rhs = |theta: f64| {
        let (b1, b2) = ((2.0 * theta).exp(), (-theta).exp());
        let beta = (b1 + 2.0 * b2) / 3.0;
        let flow = law.flow.rate(law.shear_modulus * (2.0f64 / 3.0).sqrt() * (b1 - b2).abs());
        // axial: 2θ' b1 = 2 ε' b1 − 2βγ √(2/3) + χ, with χ keeping the determinant
        let push = 2.0 * beta * flow;
        let along = (2.0f64 / 3.0).sqrt() / b1 - 2.0 * (1.0f64 / 6.0).sqrt() / b2;
        let chi = push * along / (1.0 / b1 + 2.0 / b2);
        rate + 0.5 * (chi - push * (2.0f64 / 3.0).sqrt()) / b1
    };
    let history = |strain: f64, theta: f64| {
        // axial and radial principal values of C^P
        let (a, r) = ((2.0 * (strain - theta)).exp(), (theta - strain).exp());
        (2.0f64 / 3.0).sqrt() * (a - r)
    };
    // small against the memory of the liquid, which RK4 resolves to far below the tolerance
    let dt = 2e-5 / rate;
    let (mut theta, mut strain) = (0.0, 0.0);
    while history(strain, theta) < limit && strain < 40.0 {
        let k1 = rhs(theta);
        let k2 = rhs(theta + 0.5 * dt * k1);
        let k3 = rhs(theta + 0.5 * dt * k2);
        let k4 = rhs(theta + dt * k3);
        theta += dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
        strain += rate * dt;
    }
    strain
}

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let liquid = preset(p, "material")?;
    if liquid.shear_modulus == 0.0 {
        return Err(p.reject("material", "a liquid with a shear modulus"));
    }
    let rate = p.number_in("rate", 1e-2, 1e3)?;
    let limit = p.number_in("tearing_strain", 0.1, 1e5)?;
    let per_strain = p.count_in("steps_per_strain", 100, 1_000_000)?;
    let law = liquid.law(LawSettings::default()).map_err(CaseError::failed)?;
    let increment = 1.0 / per_strain as f64;
    let dt = increment / rate;
    let draw =
        Matrix3::from_diagonal(&Vector3::new(increment.exp(), (-0.5 * increment).exp(), (-0.5 * increment).exp()));
    let mut point = MaterialPoint::<3>::default();
    let tension = |q: &MaterialPoint<3>| {
        let s = law.cauchy_stress(q.volume_ratio, &q.elastic_strain);
        s[(0, 0)] - s[(1, 1)]
    };
    let mut course = Vec::new();
    let mut strain = 0.0;
    let mut steps = 0usize;
    while !point.detect_tearing(limit).map_err(CaseError::failed)? && strain < 40.0 {
        point.advance(&law, &draw, dt).map_err(CaseError::failed)?;
        strain += increment;
        steps += 1;
        if steps.is_multiple_of((per_strain / 50).max(1)) {
            course.push([strain, tension(&point)]);
        }
    }
    let mut out = Outcome::new();
    let reference = expected_strain(&law, rate, limit);
    out.compare("strain_at_tearing", strain, reference, 2e-3f64.max(4.0 * increment / reference));
    // pull on, with dilation: no tension may be left, and the volume must not open
    let at_tear = point;
    let opening = draw * 1.001;
    let mut volume = point.volume_ratio;
    let mut largest = [0.0f64; 2];
    for (k, torn) in [TornRule::Release, TornRule::Hold].into_iter().enumerate() {
        let law = liquid.law(LawSettings { torn, ..LawSettings::default() }).map_err(CaseError::failed)?;
        point = at_tear;
        let mut after = strain;
        for step in 0..per_strain {
            point.advance(&law, &opening, dt).map_err(CaseError::failed)?;
            let pull = match torn {
                // axial Kirchhoff stress: shear and pressure
                TornRule::Release => law.kirchhoff_stress(point.volume_ratio, &point.elastic_strain)[(0, 0)],
                TornRule::Hold => law.shear_stress_norm(&point.elastic_strain),
            };
            largest[k] = largest[k].max(pull);
            volume = volume.max(point.volume_ratio);
            after += increment;
            if torn == TornRule::Release && step % (per_strain / 50).max(1) == 0 {
                course.push([after, tension(&point)]);
            }
        }
    }
    out.measure(
        "tension_when_torn",
        largest[0] / law.shear_modulus,
        |t| t < 1e-9,
        "a torn thread bears no axial stress (over the shear modulus)",
    );
    out.measure(
        "held_stress_growth",
        largest[1] / law.shear_stress_norm(&at_tear.elastic_strain) - 1.0,
        |g| g <= 1e-12,
        "under the published rule the shear stress of a torn particle does not grow",
    );
    out.info("tension_before_over_yield", tension(&at_tear) / law.flow.yield_norm().max(1e-300));
    out.compare("volume_ratio_when_torn", volume, at_tear.volume_ratio.max(1.0), 1e-9);
    out.curve(Curve {
        title: "Thread drawn out until it tears".to_owned(),
        x_label: "logarithmic strain".to_owned(),
        y_label: "tension [Pa]".to_owned(),
        log_x: false,
        log_y: false,
        series: vec![(p.text("material")?.to_owned(), course)],
    });
    Ok(out)
}

use constitutive::MaterialPoint;
use constitutive::tearing::{log_norm, plastic_history};
use nalgebra::Matrix3;

use super::liquid_choice::preset;
use crate::case::{Case, CaseError, Outcome, Param, Params};
use constitutive::LawSettings;

pub const CASE: Case = Case {
    id: "liquid/recovery",
    about: "The logarithm of the plastic history decays by exp(-t/t_r) whatever the steps; elastic strain and volume stay.",
    params: &[
        Param::text("material", "shaving-cream", "preset with a shear modulus"),
        Param::number("strain", 2.0, "1", "shear that makes the history"),
        Param::number("recovery_time", 0.35, "s", "time of recovery"),
        Param::number("time", 1.0, "s", "time of healing"),
        Param::count("steps", 100, "steps of healing"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let liquid = preset(p, "material")?;
    if liquid.shear_modulus == 0.0 {
        return Err(p.reject("material", "a liquid with a shear modulus"));
    }
    let (recovery_time, time) = (p.positive("recovery_time")?, p.positive("time")?);
    let steps = p.count_in("steps", 1, 1_000_000)?;
    let strain = p.number_in("strain", -50.0, 50.0)?;
    let law = liquid.law(LawSettings::default()).map_err(CaseError::failed)?;
    let mut point = MaterialPoint::<3>::default();
    for _ in 0..100 {
        let f = Matrix3::new(1.0, 0.01 * strain, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.001);
        point.advance(&law, &f, 1e-3).map_err(CaseError::failed)?;
    }
    let history = |q: &MaterialPoint<3>| {
        plastic_history(&q.deformation_gradient, &q.elastic_strain).map(|c| log_norm(&c)).map_err(CaseError::failed)
    };
    let (before, begin) = (point, history(&point)?);
    for _ in 0..steps {
        point.recover(time / steps as f64, recovery_time).map_err(CaseError::failed)?;
    }
    let mut out = Outcome::new();
    // the logarithm of a tensor next to the identity carries the round-off of the tensor
    let floor = 1e-10f64.max(1e-13 * steps as f64 / (begin * (-time / recovery_time).exp()).max(1e-300));
    out.compare("log_history", history(&point)?, begin * (-time / recovery_time).exp(), floor);
    out.compare("elastic_strain_change", (point.elastic_strain - before.elastic_strain).norm(), 0.0, 0.0);
    let volume = point.deformation_gradient.determinant() / before.deformation_gradient.determinant();
    out.compare("volume", volume, 1.0, 1e-12 * (steps as f64).max(1.0));
    out.info("log_history_begin", begin);
    Ok(out)
}

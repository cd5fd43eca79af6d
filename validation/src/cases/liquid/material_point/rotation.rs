use constitutive::MaterialPoint;
use constitutive::{FlowCurve, HerschelBulkley, LawSettings};
use nalgebra::{Matrix3, Rotation3, Unit, Vector3};

use crate::case::{Case, CaseError, Outcome, Param, Params};

pub const CASE: Case = Case {
    id: "liquid/rotation",
    about: "A stressed particle turned as a rigid body: its strain turns with it, stress and volume do not change.",
    params: &[
        Param::number("shear", 0.6, "1", "shear before the rotation"),
        Param::number("stretch", 1.1, "1", "volume ratio before the rotation"),
        Param::number("angle", 75.0, "deg", "angle of the rotation"),
        Param::count("steps", 1, "equal steps of the rotation"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let (shear, stretch) = (p.number_in("shear", -20.0, 20.0)?, p.number_in("stretch", 0.06, 19.0)?);
    let steps = p.count_in("steps", 1, 100_000)?;
    let angle = p.number("angle")?.to_radians();
    // stiff against flow, so that what is seen is the rotation alone
    let curve = FlowCurve::J2 { yield_stress: 1e8, consistency: 1.0, index: 0.5 };
    let law = HerschelBulkley::new(1e5, 300.0, &curve, LawSettings::default()).map_err(CaseError::failed)?;
    let mut point = MaterialPoint::<3>::default();
    let f = Matrix3::new(1.0, shear, 0.1 * shear, 0.0, 1.0, 0.2 * shear, 0.0, 0.0, 1.0) * stretch.cbrt();
    point.advance(&law, &f, 1e-3).map_err(CaseError::failed)?;
    let before = point;
    let axis = Unit::new_normalize(Vector3::new(0.3, -0.5, 0.8));
    let turn = Rotation3::from_axis_angle(&axis, angle / steps as f64).into_inner();
    for _ in 0..steps {
        point.advance(&law, &turn, 1e-3).map_err(CaseError::failed)?;
    }
    let whole = Rotation3::from_axis_angle(&axis, angle).into_inner();
    let expected = whole * before.elastic_strain * whole.transpose();
    let tolerance = 1e-13 * (steps as f64).sqrt().max(1.0);
    let relative = (point.elastic_strain - expected).norm() / expected.norm();
    let mut out = Outcome::new();
    out.compare_absolute("strain_error", relative, 0.0, tolerance);
    let stress = |q: &MaterialPoint<3>| law.shear_stress_norm(&q.elastic_strain);
    out.compare("stress", stress(&point), stress(&before), 2.0 * tolerance);
    out.compare("volume_ratio", point.volume_ratio, before.volume_ratio, tolerance);
    out.compare("determinant", point.elastic_strain.determinant(), 1.0, tolerance.max(1e-12 * expected.norm().powi(2)));
    Ok(out)
}

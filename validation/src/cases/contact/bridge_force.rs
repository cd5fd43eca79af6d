//! Capillary bridges: table of forces and the work identity.

use crate::case::{Case, CaseError, Outcome, Param, Params};
use contact::cohesion::{Bridge, Side, UnequalBridge};

/// Force of a liquid bridge against the derivative of its energy.
pub const CASE: Case = Case {
    id: "contact/bridge-force",
    about: "Capillary bridge between cylinders: force against the energy derivative, the table of spec 11 (51), the work identity (52)",
    params: &[
        Param::number("radius", 0.004, "m", "radius of the cylinders"),
        Param::number("contact_angle", 45.0, "deg", "contact angle"),
        Param::number("area", 3e-5, "m^2", "liquid cross-section"),
        Param::number("gap", 0.0095, "m", "distance of the axes"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let radius = p.positive("radius")?;
    let contact_angle = p.number_in("contact_angle", 0.0, 170.0)?.to_radians();
    let area = p.positive("area")?;
    let gap = p.positive("gap")?;
    if gap < 2.02 * radius || gap > 4.0 * radius {
        return Err(p.reject("gap", "between 2.02 and 4 radii"));
    }
    let bridge = |g: f64| Bridge { radius, contact_angle, gap: g };
    let m = bridge(gap).meniscus(area);
    let mut out = Outcome::new();
    if (m.area / area - 1.0).abs() > 1e-9 {
        return Err(p.reject("area", "an area that the gap can hold"));
    }
    let h = 1e-5 * radius;
    let e = |g: f64| bridge(g).meniscus(area).energy;
    let slope = (8.0 * (e(gap + h) - e(gap - h)) - (e(gap + 2.0 * h) - e(gap - 2.0 * h))) / (12.0 * h);
    out.compare("force", m.force, slope, 1e-6);
    out.info("wetting_angle", m.wetting_angle);
    // the printed table, always at its own radius
    for (name, theta, a, g, expected) in [
        ("table_45deg", 45f64.to_radians(), 3e-5, 0.0095, 0.825_567),
        ("table_40deg", 40f64.to_radians(), 3e-5, 0.0095, 1.005_034),
        ("table_60deg", 60f64.to_radians(), 3e-5, 0.0095, 0.217_134),
        ("table_0.1rad", 0.1, 1.5e-5, 0.0082, 2.002_502),
    ] {
        out.compare_absolute(name, Bridge { radius: 0.004, contact_angle: theta, gap: g }.force(a), expected, 1e-6);
    }
    let pair = UnequalBridge {
        sides: [Side { radius: 0.004, contact_angle: 0.5 }, Side { radius: 0.006, contact_angle: 0.9 }],
        clearance: 0.0112 - 0.010,
    };
    out.compare_absolute("unequal", pair.force(9.294_335e-6), 2.785_058, 2e-6);
    // work along an opening at fixed area: five-point Gauss rule on 32 panels
    let (g0, g1) = (gap, gap + 0.1 * radius);
    let x = [0.0, 0.538_469_310_105_683_1, 0.906_179_845_938_664];
    let w = [0.568_888_888_888_888_9, 0.478_628_670_499_366_47, 0.236_926_885_056_189_08];
    let mut work = 0.0;
    for i in 0..32 {
        let half = 0.5 * (g1 - g0) / 32.0;
        let mid = g0 + (2.0 * f64::from(i) + 1.0) * half;
        for (xi, wi) in [(x[0], w[0]), (x[1], w[1]), (-x[1], w[1]), (x[2], w[2]), (-x[2], w[2])] {
            work += half * wi * bridge(mid + half * xi).force(area);
        }
    }
    out.compare("work", work, e(g1) - e(g0), 1e-8);
    Ok(out)
}

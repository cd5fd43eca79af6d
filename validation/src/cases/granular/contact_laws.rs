//! The compression laws side by side, as in the manual's figure S1-3.

use crate::case::{Case, CaseError, Curve, Outcome, Param, Params};
use granular::law::{CentralLaw, HERTZ_LAYERED, Table as LawTable};

/// Case.
pub const CASE: Case = Case {
    id: "granular/contact-laws",
    about: "Linear, divergent, plateau, Hertz and tabulated compression laws against their formulas (manual S1-4 … S1-13, figure \
            S1-3: E 8 kPa, radius 10 µm).",
    params: &[
        Param::number("young_modulus", 8000.0, "Pa", "modulus of the grains"),
        Param::number("radius", 10.0, "µm", "radius of both grains"),
        Param::number("repulsion", 1.0, "1", "central repulsion coefficient of the divergent law"),
        Param::number("plateau_begin", 0.3, "1", "relative distance where the sponge is crushed"),
        Param::number("plateau_end", 0.8, "1", "relative distance where the plateau starts"),
        Param::number("plateau_slope", 0.1, "1", "slope of the effective distance on the plateau"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let (e, r) = (p.positive("young_modulus")?, p.positive("radius")?);
    let c = p.number_in("repulsion", 0.0, 1.0)?;
    let end = p.number_in("plateau_end", 0.01, 1.0)?;
    let begin = p.number_in("plateau_begin", 0.001, 0.999 * end)?;
    let slope = p.number_in("plateau_slope", 1e-6, 1.0)?;
    let k = std::f64::consts::PI / 8.0 * e * 1e6;
    let d0 = 2.0 * r;
    let linear = CentralLaw::Blend { repulsion: 0.0 };
    let divergent = CentralLaw::Blend { repulsion: c };
    let plateau = CentralLaw::Plateau { repulsion: c, begin, end, slope };
    let hertz = CentralLaw::Hertz { coefficient: HERTZ_LAYERED };
    let samples: Vec<f64> = (0..=32).map(|i| f64::from(i) / 32.0 * 0.95).collect();
    let table = LawTable::new(
        samples.clone(),
        samples.iter().map(|x| -divergent.force(d0 * (1.0 - x), d0, k) / (k * d0)).collect(),
    )
    .map_err(CaseError::failed)?;
    let tabulated = CentralLaw::Tabulated(table);

    let mut worst = [0.0f64; 5];
    let scale = k * d0;
    for i in 1..=95 {
        let dx = d0 * f64::from(i) / 100.0;
        let d = d0 - dx;
        let relative = |a: f64, b: f64| (a - b).abs() / b.abs().max(1e-9 * scale);
        worst[0] = worst[0].max(relative(-linear.force(d, d0, k), k * dx));
        let exact = k * (1.0 - c) * dx + c * k * dx * d0 / d;
        worst[1] = worst[1].max(relative(-divergent.force(d, d0, k), exact));
        // Sponge: the divergent law at the effective distance.
        let effective = if d >= end * d0 {
            d
        } else if d >= begin * d0 {
            end * d0 - (end * d0 - d) * slope
        } else {
            d / begin * (end - (end - begin) * slope)
        };
        let crushed = k * (1.0 - c) * (d0 - effective) + c * k * (d0 - effective) * d0 / effective;
        worst[2] = worst[2].max(relative(-plateau.force(d, d0, k), crushed));
        // Two equal spheres of modulus E and Poisson number 0, 10.7 contacts instead of 4, one layer per 2R/√3.
        let sphere = 2f64.sqrt() / 3.0 * e * (r * 1e-6).sqrt() * (dx * 1e-6).powf(1.5);
        let layered = sphere * 10.7 / 4.0 / (2.0 * r * 1e-6 / 3f64.sqrt());
        worst[3] = worst[3].max(relative(-hertz.force(d, d0, k) * 1e-12, layered));
        worst[4] = worst[4].max((tabulated.force(d, d0, k) / divergent.force(d, d0, k) - 1.0).abs());
    }
    let mut out = Outcome::new();
    out.compare("linear", worst[0], 0.0, 1e-12);
    out.compare("divergent", worst[1], 0.0, 1e-12);
    out.compare("plateau", worst[2], 0.0, 1e-11);
    out.compare("hertz", worst[3], 0.0, 1e-12);
    out.measure("tabulated", worst[4], |w| w < 0.1, "a table of 33 points follows the law within 10 %");
    let slope = -linear.force(d0 * (1.0 - 1e-7), d0, k) / (k * d0 * 1e-7);
    out.compare("slope_at_touch", slope, 1.0, 1e-6);
    let coefficient = -hertz.force(d0 - 1.0, d0, k) * 1e-12 / (e * (r * 1e-6).powf(-0.5) * 1e-9);
    out.compare("hertz_coefficient", coefficient, 1.1, 0.01);
    out.compare("largest_force", -CentralLaw::default().force(0.0, d0, k) / (k * d0), 999.0, 1e-12);
    let curve = |law: &CentralLaw| -> Vec<[f64; 2]> {
        (0..=190).map(|i| f64::from(i) / 200.0 * d0).map(|dx| [dx, -law.force(d0 - dx, d0, k) * 1e-12]).collect()
    };
    out.curve(Curve {
        title: "Repulsion against compression".into(),
        x_label: "compression [µm]".into(),
        y_label: "force per depth [N/m]".into(),
        log_x: false,
        log_y: true,
        series: [("linear", &linear), ("divergent", &divergent), ("plateau", &plateau), ("Hertz", &hertz)]
            .into_iter()
            .map(|(name, law)| (name.to_owned(), curve(law).into_iter().skip(1).collect()))
            .collect(),
    });
    Ok(out)
}

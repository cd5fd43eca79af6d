//! Shear modulus of a triangular lattice of linked grains without pre-stress.

use crate::case::{Case, CaseError, Outcome, Param, Params};
use granular::cell::Cell;
use granular::compat::DirectedSample;
use granular::grains::Grains;
use granular::law::{CentralLaw, Tension};
use granular::model::ContactModel;
use granular::physical::{Rules, Sample};

/// Case.
pub const CASE: Case = Case {
    id: "granular/lattice-modulus",
    about: "A triangular lattice of grains linked at touching distance has the exact shear modulus G = (√3/4)(k_n + k_t) at small \
            strain.",
    params: &[
        Param::number("spring", 3.14e9, "mg/s²/m", "central spring constant k_n"),
        Param::number("tangential_ratio", 0.4, "1", "k_t/k_n"),
        Param::number("strain", 1e-8, "1", "shear strain"),
        Param::number("diameter", 50.0, "µm", "diameter of the grains; the modulus does not depend on it"),
        Param::count("columns", 8, "grains per row, at least 4"),
        Param::count("rows", 6, "rows, even, at least 4"),
        Param::text("mode", "physical", "physical or compat"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let kn = p.positive("spring")?;
    let kt = kn * p.number_in("tangential_ratio", 0.0, 100.0)?;
    let strain = p.number_in("strain", 1e-10, 1e-3)?;
    let l = p.positive("diameter")?;
    let (columns, rows) = (p.count_in("columns", 4, 400)?, p.count_in("rows", 4, 400)?);
    if rows % 2 == 1 {
        return Err(p.reject("rows", "an even number from 4 to 400"));
    }
    let row = l * 3f64.sqrt() / 2.0;
    let cell = Cell::new(columns as f64 * l, rows as f64 * row);
    let mut grains = Grains::default();
    for r in 0..rows {
        for c in 0..columns {
            grains.push([(c as f64 + 0.5 * (r % 2) as f64 + 0.25) * l, (r as f64 + 0.5) * row], l / 2.0, 0.1);
        }
    }
    let model = ContactModel {
        spring: kn,
        viscosity: 0.0,
        tangential_spring: kt,
        tangential_viscosity: 0.0,
        friction: 0.0,
        law: CentralLaw::Blend { repulsion: 0.0 },
        tension: Tension::Linear,
        permanent_ratio_central: 1.0,
        permanent_ratio_tangential: 1.0,
        keep_viscosity: false,
    };
    let mut links = Vec::new();
    for r in 0..rows {
        for c in 0..columns {
            let i = r * columns + c;
            let above = (r + 1) % rows * columns;
            let shift = r % 2;
            links.push([i, r * columns + (c + 1) % columns]);
            links.push([i, above + (c + shift) % columns]);
            links.push([i, above + (c + shift + columns - 1) % columns]);
        }
    }
    // One step of homogeneous flow from the stress-free lattice, then the stress at rest.
    let dt = 1e-9;
    let stress = match p.text("mode")? {
        "physical" => {
            let mut s = Sample::new(&grains, cell, model, Rules::default()).map_err(CaseError::failed)?;
            for [i, j] in links {
                if !s.link(i, j, l) {
                    return Err(CaseError::Failed(format!("grains {i} and {j} are not neighbours")));
                }
            }
            s.set_rate(strain / dt);
            s.advance(dt, 1.0).map_err(CaseError::failed)?;
            s.set_rate(0.0);
            s.observe().stress.bulk
        }
        "compat" => {
            let mut s = DirectedSample::new(grains, cell, model, 1);
            for [i, j] in links {
                s.link(i, j);
            }
            s.set_rate(strain / dt);
            s.evaluate();
            s.integrate(dt, 1.0, true).map_err(CaseError::failed)?;
            s.set_rate(0.0);
            s.evaluate();
            s.stresses().bulk
        }
        _ => return Err(p.reject("mode", "physical or compat")),
    };
    let mut out = Outcome::new();
    // Beyond the linear regime the error grows with the strain itself.
    let tolerance = 1e-6_f64.max(10.0 * strain);
    out.compare("shear_modulus", stress.shear() / strain, 3f64.sqrt() / 4.0 * (kn + kt) * 1e-6, tolerance);
    out.compare("transposed_modulus", -stress.0[2] / strain, 3f64.sqrt() / 4.0 * (kn + kt) * 1e-6, tolerance);
    Ok(out)
}

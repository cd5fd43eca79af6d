//! Shear modulus of a face-centred cubic lattice of linked spheres.

use crate::case::{Case, CaseError, Outcome, Param, Params};
use granular::cell::Cell;
use granular::law::{CentralLaw, Tension};
use granular::model::ContactModel;
use granular::physical::Rules;
use granular::spheres::{Ball, SphereSample};

/// Case.
pub const CASE: Case = Case {
    id: "granular/spheres-lattice",
    about: "A face-centred cubic lattice of linked spheres has the exact modulus G = (k_n + k_t)/(√2 d) for shear along its cube \
            edges (sum over the twelve bonds of homogeneous deformation).",
    params: &[
        Param::number("spring", 1.7e5, "mg/s²", "central spring constant k_n"),
        Param::number("tangential_ratio", 0.4, "1", "k_t/k_n"),
        Param::number("diameter", 50.0, "µm", "diameter d"),
        Param::number("strain", 1e-8, "1", "shear strain"),
        Param::count("cells", 3, "cubes along each edge"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let kn = p.positive("spring")?;
    let kt = kn * p.number_in("tangential_ratio", 0.0, 100.0)?;
    let d = p.positive("diameter")?;
    let strain = p.number_in("strain", 1e-10, 1e-3)?;
    let cells = p.count_in("cells", 2, 20)?;
    let a = d * 2f64.sqrt();
    let side = a * cells as f64;
    let mut balls = Vec::new();
    for z in 0..cells {
        for y in 0..cells {
            for x in 0..cells {
                for base in [[0.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]] {
                    let at = |cell: usize, part: f64| (cell as f64 + part + 0.25) * a;
                    balls.push(Ball {
                        position: [at(x, base[0]), at(y, base[1]), at(z, base[2])],
                        velocity: [0.0; 3],
                        omega: [0.0; 3],
                        radius: d / 2.0,
                        inverse_mass: 10.0,
                        inverse_inertia: 10.0 / (0.4 * d * d / 4.0),
                    });
                }
            }
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
    let n = balls.len();
    let mut s =
        SphereSample::new(balls, Cell::new(side, side), side, model, Rules::default()).map_err(CaseError::failed)?;
    s.observe();
    let close: Vec<[usize; 2]> = s
        .pairs()
        .iter()
        .filter(|q| s.separation(q).iter().map(|c| c * c).sum::<f64>().sqrt() < 1.01 * d)
        .map(|q| [q.i as usize, q.j as usize])
        .collect();
    for [i, j] in &close {
        s.link(*i, *j, d);
    }
    let dt = 1e-9;
    s.set_rate(strain / dt);
    s.advance(dt, 1.0).map_err(CaseError::failed)?;
    s.set_rate(0.0);
    s.observe();
    let stress = s.bulk_stress();
    let mut out = Outcome::new();
    out.compare("bonds_per_sphere", close.len() as f64 / n as f64, 6.0, 0.0);
    let exact = (kn + kt) / (2f64.sqrt() * d);
    let tolerance = 1e-6_f64.max(10.0 * strain);
    out.compare("shear_modulus", -stress[1] / strain, exact, tolerance);
    out.compare("transposed_modulus", -stress[3] / strain, exact, tolerance);
    out.compare_absolute("stress_out_of_plane", (stress[2].abs() + stress[5].abs()) / (exact * strain), 0.0, 1e-6);
    Ok(out)
}

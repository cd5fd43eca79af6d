//! Momentum of two crossing yarns with random velocities.

use super::setup::{SEGMENT, build, material, plane, polyline};
use crate::case::{Case, CaseError, Outcome, Param, Params, Table};

/// Momentum.
pub const CASE: Case = Case {
    id: "yarn/momentum",
    about: "Two crossing yarns with random velocities: with hand-back linear momentum is exact; without it (the note's rule) it drifts.",
    params: &[
        Param::count("steps", 200, "steps of 5e-5 s"),
        Param::number("speed", 0.5, "m/s", "size of the random velocities"),
        Param::count("seed", 1, "seed of the velocities"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    super::setup::alone(|| experiment(p))
}

fn experiment(p: &Params) -> Result<Outcome, CaseError> {
    let steps = p.count_in("steps", 1, 100_000)?;
    let speed = p.positive("speed")?;
    let seed = p.count("seed")? as u64;
    let mut out = Outcome::new();
    let mut rows = Vec::new();
    for (name, share, hand_back) in [("hand_back", 0.5, true), ("massless", 0.0, false), ("as_printed", 0.5, false)] {
        let mut random = seed;
        let yarns = [(0.4, 0.5, 0.2f64), (0.42, 0.49, -0.3)]
            .iter()
            .map(|&(x, y, angle)| {
                let (s, c) = angle.sin_cos();
                let points =
                    (0..20).map(|i| vec![x + f64::from(i) * SEGMENT * c, y + f64::from(i) * SEGMENT * s]).collect();
                let mut noise = || {
                    random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                    speed * 1.7 * ((random >> 11) as f64 / (1u64 << 52) as f64 - 1.0)
                };
                let velocities = (0..20).map(|_| vec![noise(), noise()]).collect();
                polyline(points, vec![], velocities)
            })
            .collect();
        let mut settings = plane(material(0.05), yarns);
        settings.quadrature_mass_share = share;
        settings.momentum_hand_back = hand_back;
        let mut system = build(&settings)?;
        let before = system.momentum();
        let scale = system.model().total_mass() * speed;
        let first_energy = system.energy().total();
        let (mut linear, mut angular) = (0.0f64, 0.0f64);
        for _ in 0..steps {
            system.advance(5e-5).map_err(CaseError::failed)?;
            let now = system.momentum();
            let lost = system.state().ledger.lost;
            linear = linear.max((now.linear - before.linear - lost).norm() / scale);
            angular = angular.max((now.angular[2] - before.angular[2]).abs() / (0.1 * scale));
        }
        let kept = system.energy().total() / first_energy;
        rows.push(vec![name.to_owned(), format!("{linear:.2e}"), format!("{angular:.2e}"), format!("{kept:.4}")]);
        match name {
            "as_printed" => out.measure(
                "linear_as_printed",
                linear,
                |d| d > 1e-6,
                "the printed rule must show its drift (erratum E15)",
            ),
            _ => out.compare_absolute(&format!("linear_{name}"), linear, 0.0, 1e-12),
        }
        if name == "hand_back" {
            out.measure(
                "angular_hand_back",
                angular,
                |d| d < 1e-2,
                "angular momentum drifts only through the mean of the ends",
            );
            out.measure("energy_kept", kept, |e| e < 1.0, "energy does not rise");
        } else {
            out.info(&format!("angular_{name}"), angular);
        }
    }
    out.table(Table {
        title: "Largest drift relative to mass × speed (× 0.1 m)".to_owned(),
        columns: ["rule", "linear", "angular", "energy kept"].map(str::to_owned).to_vec(),
        rows,
    });
    Ok(out)
}

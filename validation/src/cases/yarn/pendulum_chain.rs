//! Period of a swinging chain.

use geometry::Motion;
use yarn::YarnMaterial;
use yarn::settings::{Bending, Drive};

use super::setup::{CELL, build, material, plane, polyline};
use crate::case::{Case, CaseError, Outcome, Param, Params};

/// Swinging chain.
pub const CASE: Case = Case {
    id: "yarn/pendulum-chain",
    about: "A hanging yarn swings in its first mode: period against 2π/(1.2024 √(g/L)), half the first Bessel zero.",
    params: &[
        Param::count("cells", 24, "length of the yarn in cells"),
        Param::number("stretch_modulus", 4000.0, "Pa", "stretch modulus"),
    ],
    run,
};

/// Bessel function J₀ by its series, for arguments up to 3.
fn bessel0(x: f64) -> f64 {
    let (mut term, mut sum) = (1.0, 1.0);
    for k in 1..30 {
        term *= -0.25 * x * x / (k * k) as f64;
        sum += term;
    }
    sum
}

fn run(p: &Params) -> Result<Outcome, CaseError> {
    super::setup::alone(|| experiment(p))
}

fn experiment(p: &Params) -> Result<Outcome, CaseError> {
    let cells = p.count_in("cells", 8, 100)?;
    let modulus = p.number_in("stretch_modulus", 500.0, 1e6)?;
    let gravity = 98.0;
    let n = 2 * cells + 1;
    let length = cells as f64 * CELL;
    let rest = length / (n - 1) as f64;
    // Vertices from the pivot down, stretched as the weight below stretches them; amplitude 5 % of the length.
    let offset = |i: usize| {
        0.05 * length * bessel0(2.404_825_557_695_773 * ((length - i as f64 * rest) / length).max(0.0).sqrt())
    };
    let mut y = 0.0;
    let points: Vec<Vec<f64>> = (0..n)
        .map(|i| {
            if i > 0 {
                // The weight below the middle of the segment stretches it; its ends lie on the mode.
                let below = length - (i as f64 - 0.5) * rest;
                let stretched = rest * (1.0 + gravity * below / modulus);
                y -= (stretched * stretched - (offset(i) - offset(i - 1)).powi(2)).max(0.0).sqrt();
            }
            vec![0.5 + offset(i), 0.7 + y]
        })
        .collect();
    let mut settings = plane(
        YarnMaterial { stretch_modulus: modulus, bending: Bending::Rod { stiffness: Some(1e-6) }, ..material(0.05) },
        vec![polyline(points, vec![rest; n - 1], vec![])],
    );
    settings.gravity = vec![0.0, -gravity];
    settings.drives = vec![Drive { yarn: 0, vertex: 0, motion: Motion::default() }];
    let mut system = build(&settings)?;
    let exact = std::f64::consts::TAU / (1.202_412_778_847_886 * (gravity / length).sqrt());
    let dt = system.tightest_limit().map_or(1e-4, |l| l.seconds).min(exact / 500.0) * 0.95;
    let shape: Vec<f64> = (0..n).map(offset).collect();
    let project = |system: &yarn::YarnSystem<2>| {
        system.state().position.iter().zip(&shape).map(|(x, a)| (x[0] - 0.5) * a).sum::<f64>()
    };
    let mut crossings = Vec::new();
    let mut last = project(&system);
    let mut time = 0.0;
    while crossings.len() < 3 && time < 2.0 * exact {
        system.advance(dt).map_err(CaseError::failed)?;
        let now = project(&system);
        if last * now < 0.0 {
            crossings.push(time + dt * last / (last - now));
        }
        time += dt;
        last = now;
    }
    if crossings.len() < 3 {
        return Err(CaseError::failed("the chain did not swing through a whole period"));
    }
    let mut out = Outcome::new();
    let strain = 0.5 * gravity * length / modulus;
    out.compare("period", crossings[2] - crossings[0], exact * (1.0 + strain).sqrt(), 0.02);
    out.info("period_inextensible", exact);
    Ok(out)
}

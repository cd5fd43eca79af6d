//! A string around a bollard.

use crate::case::{Case, CaseError, Outcome, Param, Params, Table};
use contact::block::{Block, ZERO};
use contact::{BlockMatrix, ContactProblem, ContactSettings, solve};
use nalgebra::{DMatrix, DVector};

/// Ratio of tensions e^{νφ}.
pub const CASE: Case = Case {
    id: "contact/capstan",
    about: "Elastic string around a cylinder, dragged steadily: ratio of end tensions e^{νφ} (Euler–Eytelwein), second order in the spacing",
    params: &[
        Param::number("nu", 0.3, "1", "friction coefficient"),
        Param::number("angle", 180.0, "deg", "angle of wrap"),
        Param::count("vertices", 33, "vertices on the cylinder"),
        Param::count("steps", 60, "time steps"),
    ],
    run,
};

/// Drags a string of `n` vertices until it slides everywhere; returns the ratio of the end tensions and the worst residual.
fn ratio(nu: f64, angle: f64, n: usize, steps: usize) -> Result<(f64, f64), CaseError> {
    // Vertices at half spacings from the ends of the arc, so that every vertex turns the string by the same Δφ.
    let step_angle = angle / n as f64;
    let phi = |i: f64| (i + 0.5) * step_angle;
    let dofs = 2 * n;
    let (mass, dt, pull) = (1e-6, 1e-2, 1.0);
    let stiffness = 1e3 * pull * n as f64;
    // unit vectors along the pieces: piece i joins vertex i − 1 and i; pieces 0 and n are the loaded ends
    let piece = |i: usize| {
        let a = i as f64 * step_angle;
        [-a.sin(), a.cos()]
    };
    let mut k = DMatrix::<f64>::zeros(dofs, dofs);
    for d in 0..dofs {
        k[(d, d)] = mass;
    }
    for i in 1..n {
        let e = piece(i);
        for r in 0..2 {
            for c in 0..2 {
                let v = dt * dt * stiffness * e[r] * e[c];
                k[(2 * (i - 1) + r, 2 * (i - 1) + c)] += v;
                k[(2 * i + r, 2 * i + c)] += v;
                k[(2 * (i - 1) + r, 2 * i + c)] -= v;
                k[(2 * i + r, 2 * (i - 1) + c)] -= v;
            }
        }
    }
    // the far end is dragged by a spring whose other end moves on
    let drag = stiffness;
    let e_last = piece(n);
    for r in 0..2 {
        for c in 0..2 {
            k[(dofs - 2 + r, dofs - 2 + c)] += dt * dt * drag * e_last[r] * e_last[c];
        }
    }
    let inverse = k.clone().try_inverse().ok_or_else(|| CaseError::Failed("singular string matrix".into()))?;
    let normal = |i: usize| [phi(i as f64).cos(), phi(i as f64).sin()];
    let tangent = |i: usize| [-phi(i as f64).sin(), phi(i as f64).cos()];
    let mut triplets: Vec<(u32, u32, Block)> = Vec::new();
    for a in 0..n {
        for b in 0..n {
            let (ea, eb) = ([normal(a), tangent(a)], [normal(b), tangent(b)]);
            let mut block = ZERO;
            for i in 0..2 {
                for j in 0..2 {
                    for r in 0..2 {
                        for c in 0..2 {
                            block[3 * i + j] += ea[i][r] * inverse[(2 * a + r, 2 * b + c)] * eb[j][c];
                        }
                    }
                }
            }
            if a == b {
                block[8] = 0.5 * (block[0] + block[4]);
            }
            triplets.push((a as u32, b as u32, block));
        }
    }
    let delassus = BlockMatrix::from_triplets(n, &triplets);
    let settings = ContactSettings { tolerance: 1e-9, ..ContactSettings::default() };
    let mut tension = vec![pull; n + 1];
    let mut velocity = DVector::<f64>::zeros(dofs);
    let mut warm: Option<Vec<[f64; 3]>> = None;
    let mut worst = 0.0_f64;
    // drag slowly: the last spring stretches by a fortieth of the final load a step
    let target = pull * (nu * angle).exp();
    let drag_speed = 2.0 * target / (drag * dt * steps as f64) * n as f64 * 0.2;
    for _ in 0..steps {
        let mut f = &velocity * mass;
        for i in 0..n {
            let (before, after) = (piece(i), piece(i + 1));
            for r in 0..2 {
                f[2 * i + r] += dt * (tension[i + 1] * after[r] - tension[i] * before[r]);
            }
        }
        for r in 0..2 {
            f[dofs - 2 + r] += dt * dt * drag * drag_speed * e_last[r];
        }
        let free = &inverse * &f;
        let q: Vec<[f64; 3]> = (0..n)
            .map(|i| {
                let (m, t) = (normal(i), tangent(i));
                [m[0] * free[2 * i] + m[1] * free[2 * i + 1], t[0] * free[2 * i] + t[1] * free[2 * i + 1], 0.0]
            })
            .collect();
        let problem = ContactProblem::new(delassus.clone(), q, vec![nu; n]).map_err(CaseError::failed)?;
        let s = solve(&problem, warm.as_deref(), &settings);
        worst = worst.max(s.report.solve.residual);
        let mut impulse = f;
        for i in 0..n {
            let (m, t, r) = (normal(i), tangent(i), s.impulses[i]);
            for c in 0..2 {
                impulse[2 * i + c] += m[c] * r[0] + t[c] * r[1];
            }
        }
        velocity = &inverse * impulse;
        for i in 1..n {
            let e = piece(i);
            let stretch = (0..2).map(|c| e[c] * (velocity[2 * i + c] - velocity[2 * (i - 1) + c])).sum::<f64>();
            tension[i] += dt * stiffness * stretch;
        }
        let end = (0..2).map(|c| e_last[c] * velocity[dofs - 2 + c]).sum::<f64>();
        tension[n] += dt * drag * (drag_speed - end);
        warm = Some(s.impulses);
    }
    Ok((tension[n] / pull, worst))
}

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let nu = p.number_in("nu", 0.0, 1.5)?;
    let angle = p.number_in("angle", 10.0, 720.0)?.to_radians();
    let n = p.count_in("vertices", 4, 400)?;
    let steps = p.count_in("steps", 10, 10_000)?;
    let expected = (nu * angle).exp();
    let mut out = Outcome::new();
    let (coarse, r1) = ratio(nu, angle, n.div_ceil(2), steps)?;
    let (fine, r2) = ratio(nu, angle, n.div_ceil(2) * 2, steps)?;
    out.compare("tension_ratio", fine, expected, 0.02);
    let order = ((coarse - expected).abs() / (fine - expected).abs()).log2();
    if nu > 0.0 {
        out.measure("order", order, |v| v > 1.7, "second order in the spacing");
    }
    out.measure("residual", r1.max(r2), |v| v <= 1e-8, "every step solved");
    out.table(Table {
        title: "Tension ratio".into(),
        columns: vec!["vertices".into(), "ratio".into(), "relative error".into()],
        rows: [(n.div_ceil(2), coarse), (n.div_ceil(2) * 2, fine)]
            .iter()
            .map(|(n, v)| vec![n.to_string(), format!("{v:.6}"), format!("{:.2e}", v / expected - 1.0)])
            .collect(),
    });
    Ok(out)
}

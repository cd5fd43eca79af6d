//! Cantilevers: own weight, tip load, taper.

use super::reference::{Reach, heavy_cantilever, tapered_cantilever, tip_loaded_cantilever};
use super::setup::{Cantilever, GRAVITY, V, cantilever, report_order, resolutions, settle, thin_material, thin_weight};
use crate::case::{Case, CaseError, Outcome, Param, Params};
use rods::Loads;

/// Own weight.
pub const HEAVY: Case = Case {
    id: "rods/cantilever-heavy",
    about: "A cantilever under its own weight takes the shape of the elastica; reference by shooting (table: Romero et al. 2021).",
    params: &[
        Param::number("gamma", 10.0, "1", "weight over bending stiffness, rho g A L^3 / (E I)"),
        Param::count("vertices", 81, "vertices of the finest rod"),
    ],
    run: run_heavy,
};

/// Dead load at the tip.
pub const TIP_LOAD: Case = Case {
    id: "rods/cantilever-tip-load",
    about: "A weightless cantilever with a dead load at its tip takes the shape of the elastica; reference by shooting.",
    params: &[
        Param::number("alpha", 2.0, "1", "load over bending stiffness, P L^2 / (E I)"),
        Param::count("vertices", 81, "vertices of the finest rod"),
    ],
    run: run_tip_load,
};

/// Radius that falls towards the tip.
pub const TAPERED: Case = Case {
    id: "rods/tapered-cantilever",
    about: "A tip-loaded cantilever of linearly falling radius; reference by shooting with the stiffness of each section.",
    params: &[
        Param::number("alpha", 0.5, "1", "load over bending stiffness of the root, P L^2 / (E I)"),
        Param::number("ratio", 0.4, "1", "radius of the tip over that of the root"),
        Param::count("vertices", 81, "vertices of the finest rod"),
    ],
    run: run_tapered,
};

fn tip(c: &Cantilever) -> Reach {
    let x = c.rods.position[c.rods.vertex_count() - 1];
    Reach { x: x.x, drop: -x.z }
}

/// Solves on four resolutions and compares the tip of the finest.
fn study(
    vertices: usize,
    reference: Reach,
    coarse: f64,
    solve: impl Fn(usize) -> Result<Reach, CaseError>,
) -> Result<Outcome, CaseError> {
    let mut out = Outcome::new();
    let (mut ex, mut ed) = (Vec::new(), Vec::new());
    let mut finest = Reach { x: f64::NAN, drop: f64::NAN };
    for n in resolutions(vertices) {
        finest = solve(n)?;
        let h = 1.0 / (n as f64 - 1.5);
        ex.push((h, (finest.x - reference.x).abs()));
        ed.push((h, (finest.drop - reference.drop).abs()));
    }
    // second order: the tolerance is that of 80 edges, and grows as the square of the spacing on coarser rods
    let scale = (80.0 / (vertices as f64 - 1.0)).max(1.0).powi(2);
    let tolerance = coarse * scale;
    out.compare("tip_x", finest.x, reference.x, tolerance / reference.x.abs().clamp(0.02, 1.0));
    out.compare("tip_drop", finest.drop, reference.drop, tolerance / reference.drop.abs().clamp(0.02, 1.0));
    let both: Vec<(f64, f64)> = ex.iter().zip(&ed).map(|(a, b)| (a.0, a.1.hypot(b.1))).collect();
    report_order(&mut out, "tip", &both, 1e-7);
    Ok(out)
}

fn run_heavy(p: &Params) -> Result<Outcome, CaseError> {
    let gamma = p.number_in("gamma", 1e-3, 1000.0)?;
    let vertices = p.count_in("vertices", 9, 2001)?;
    let reference = heavy_cantilever(gamma).ok_or_else(|| p.reject("gamma", "a value with a hanging shape"))?;
    study(vertices, reference, 1e-3 * (1.0 + gamma / 50.0), |n| {
        let mut c = cantilever(n, V::x(), thin_material(thin_weight() / gamma), |_, _| ())?;
        settle(&mut c.rods, &Loads::gravity(V::new(0.0, 0.0, -GRAVITY)), &c.boundary)?;
        Ok(tip(&c))
    })
}

fn run_tip_load(p: &Params) -> Result<Outcome, CaseError> {
    let alpha = p.number_in("alpha", 1e-3, 200.0)?;
    let vertices = p.count_in("vertices", 9, 2001)?;
    let reference = tip_loaded_cantilever(alpha).ok_or_else(|| p.reject("alpha", "a value with a hanging shape"))?;
    study(vertices, reference, 1e-3 * (1.0 + alpha / 20.0), |n| loaded(n, alpha, 1.0))
}

fn run_tapered(p: &Params) -> Result<Outcome, CaseError> {
    let alpha = p.number_in("alpha", 1e-3, 20.0)?;
    let ratio = p.number_in("ratio", 0.1, 1.0)?;
    let vertices = p.count_in("vertices", 9, 2001)?;
    let reference =
        tapered_cantilever(alpha, ratio).ok_or_else(|| p.reject("alpha", "a value with a hanging shape"))?;
    study(vertices, reference, 1e-3 * (1.0 + alpha) / ratio.powi(2), |n| loaded(n, alpha, ratio))
}

fn loaded(vertices: usize, alpha: f64, ratio: f64) -> Result<Reach, CaseError> {
    let load = thin_weight();
    let mut c = cantilever(vertices, V::x(), thin_material(load / alpha), |spec, edge| {
        let root = spec.radii[0][0];
        spec.radii = (0..vertices)
            .map(|i| {
                let r = root * (1.0 - (1.0 - ratio) * (i as f64 - 0.5) * edge);
                [r, r]
            })
            .collect();
    })?;
    let mut force = vec![V::zeros(); vertices];
    force[vertices - 1] = V::new(0.0, 0.0, -load);
    settle(&mut c.rods, &Loads { force: Some(&force), ..Loads::default() }, &c.boundary)?;
    Ok(tip(&c))
}

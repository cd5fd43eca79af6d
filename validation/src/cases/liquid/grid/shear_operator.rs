use mpm::settings::Tangent;
use mpm::shear_operator::{OperatorScratch, apply_particles};
use mpm::shear_quadrature::Quadrature;
use mpm::shear_state::{ShearState, linearise};
use mpm::{LiquidGrid, Tensor, Vector, particles_to_grid};
use numerics::reduce::{dot, norm};
use numerics::tensor::{deviator, inverse, unimodular_part};
use particle_grid::Lattice;

use super::setup;
use crate::case::{Case, CaseError, Outcome, Param, Params};

pub const CASE: Case = Case {
    id: "liquid/shear-operator",
    about: "The implicit shear operator: symmetry, agreement of the tangent with differences of the stress, and the cell \
            quadrature against the particles.",
    params: &[
        Param::text("material", "shaving-cream", "name of a shear-elastic liquid"),
        Param::number("strain", 0.1, "1", "size of the elastic strain"),
        Param::count("per_axis", 4, "particles per cell and direction"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let liquid = setup::preset(p)?;
    if liquid.shear_modulus <= 0.0 {
        return Err(p.reject("material", "a shear-elastic liquid"));
    }
    let size = p.number_in("strain", 1e-6, 0.3)?;
    let per_axis = p.count_in("per_axis", 2, 6)?;
    let mut out = Outcome::new();
    dimension::<2>(&mut out, &liquid, size, per_axis)?;
    dimension::<3>(&mut out, &liquid, size, per_axis)?;
    Ok(out)
}

fn random(a: u64, b: u64) -> f64 {
    mpm::random::uniform(&[a, b]) - 0.5
}

fn dimension<const D: usize>(
    out: &mut Outcome,
    liquid: &constitutive::Liquid,
    size: f64,
    per_axis: usize,
) -> Result<(), CaseError> {
    let material = setup::material(liquid)?;
    let materials = [material];
    let dt = 1e-3;
    let name = |what: &str| format!("{what}_{D}d");
    // Differences of τ f^{-T} about the strained state.
    let law = &material.law;
    let (mut worst, mut definite) = (0.0f64, 0.0f64);
    for i in 0..20u64 {
        let f = Tensor::<D>::identity() + Tensor::from_fn(|a, b| size * random(i, (3 * a + b) as u64));
        let raw = f * f.transpose();
        let Some((_, strain)) = unimodular_part(&((raw + raw.transpose()) * 0.5)) else { continue };
        let b = Tensor::<D>::from_fn(|a, b| random(i + 100, (3 * a + b) as u64));
        let stress = |e: f64| -> Result<Tensor<D>, CaseError> {
            let f = Tensor::<D>::identity() + b * e;
            let moved = constitutive::liquid_law::elastic_trial(&strain, &f).map_err(CaseError::failed)?.strain;
            let relaxed = law.relax(&moved, &strain, dt).map_err(CaseError::failed)?;
            let back = inverse(&f).unwrap_or_else(Tensor::<D>::identity).transpose();
            Ok(deviator(&moved) * (law.shear_modulus * relaxed.radial) * back)
        };
        let e = 1e-5;
        let exact = (stress(e)? - stress(-e)?) / (2.0 * e);
        let zero = Tensor::<D>::zeros();
        for (kind, error) in [(Tangent::Symmetric, &mut worst), (Tangent::PositiveDefinite, &mut definite)] {
            let (_, t) = linearise(&material, &strain, 1.0, false, &zero, dt, kind).map_err(CaseError::failed)?;
            *error = error.max((t.apply(&b) - exact).norm() / exact.norm().max(1e-9 * law.shear_modulus));
        }
    }
    if D == 2 {
        out.compare_absolute(&name("tangent_error"), worst, 0.0, 1e-7);
    } else {
        out.measure(
            &name("tangent_error"),
            worst,
            |e| e < 5.0 * size * size + 1e-7,
            "second order in the elastic strain",
        );
    }
    out.measure(
        &name("definite_tangent_error"),
        definite,
        |e| e < 5.0 * size + 1e-7,
        "first order in the elastic strain",
    );
    // Symmetry of the assembled products.
    let dx = 0.01;
    let lattice = Lattice::<D>::new(dx);
    let mut particles =
        setup::region(&lattice, per_axis, Vector::repeat(2.0 * dx), Vector::repeat(5.0 * dx), |_| true, &materials);
    for i in 0..particles.len() {
        let x = particles.position[i] / dx;
        let f = Tensor::<D>::identity()
            + Tensor::from_fn(|a, b| size * (3.0 * a as f64 + 5.0 * b as f64 + x[(a + b) % D]).sin());
        let b = f * f.transpose();
        if let Some((_, strain)) = unimodular_part(&((b + b.transpose()) * 0.5)) {
            particles.elastic_strain[i] = strain;
        }
        particles.position[i] += Vector::from_fn(|a, _| 0.2 * dx / per_axis as f64 * random(i as u64, 7 + a as u64));
    }
    let mut grid = LiquidGrid::new(lattice);
    particles_to_grid::activate(&mut particles, &materials, &[], &mut grid).map_err(CaseError::failed)?;
    let mut state = ShearState::default();
    state.build(&particles, &materials, &particles.affine, dt, Tangent::Symmetric).map_err(CaseError::failed)?;
    let mut quadrature = Quadrature::default();
    quadrature.build(&particles, &state, &grid);
    let mut scratch = OperatorScratch::default();
    let nodes = grid.blocks.node_count();
    let n = D * nodes;
    let field = |seed: u64| -> Vec<f64> { (0..n).map(|i| random(seed, i as u64)).collect() };
    let (u, v) = (field(1), field(2));
    let (mut hu, mut hv) = (vec![0.0; n], vec![0.0; n]);
    apply_particles(&particles, &state, &grid, &u, &mut hu, &mut scratch);
    apply_particles(&particles, &state, &grid, &v, &mut hv, &mut scratch);
    let asymmetry = |hu: &[f64], hv: &[f64]| (dot(&v, hu) - dot(&u, hv)).abs() / (norm(&u) * norm(hv));
    out.compare_absolute(&name("asymmetry"), asymmetry(&hu, &hv), 0.0, 1e-12);
    quadrature.apply(&grid, &u, &mut hu, &mut scratch);
    quadrature.apply(&grid, &v, &mut hv, &mut scratch);
    out.compare_absolute(&name("asymmetry_quadrature"), asymmetry(&hu, &hv), 0.0, 1e-12);
    // The quadrature on a smooth motion.
    let mut smooth = vec![0.0; n];
    for a in 0..D {
        for i in 0..nodes {
            let x = grid.face_position(a, i) / (4.0 * dx);
            smooth[a * nodes + i] = x[(a + 1) % D].sin() + 0.5 * x[a].cos();
        }
    }
    apply_particles(&particles, &state, &grid, &smooth, &mut hu, &mut scratch);
    quadrature.apply(&grid, &smooth, &mut hv, &mut scratch);
    let difference: Vec<f64> = hu.iter().zip(&hv).map(|(a, b)| a - b).collect();
    let error = norm(&difference) / norm(&hu);
    out.measure(
        &name("quadrature_error"),
        error,
        |e| e < 0.15,
        "force of a smooth motion within 15 % of the particles'",
    );
    Ok(())
}

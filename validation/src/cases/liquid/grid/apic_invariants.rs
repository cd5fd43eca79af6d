use mpm::{LiquidGrid, Particles, Tensor, Vector, grid_to_particles, particles_to_grid};
use numerics::bspline::Weights;
use numerics::tensor::wedge;
use particle_grid::{Lattice, mac_offset};

use super::setup;
use crate::case::{Case, CaseError, Outcome, Param, Params};

pub const CASE: Case = Case {
    id: "liquid/apic-invariants",
    about: "Transfers between particles and the staggered grid: moments of the kernel, linear and angular momentum both ways, \
            affine fields.",
    params: &[
        Param::count("particles", 200, "random particles"),
        Param::number("cell", 0.3, "m", "cell size"),
        Param::count("seed", 4, "seed of the positions"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let count = p.count_in("particles", 1, 1_000_000)?;
    let dx = p.positive("cell")?;
    let seed = p.count("seed")? as u64;
    let mut out = Outcome::new();
    moments(&mut out, count.min(500), seed);
    dimension::<2>(&mut out, count, dx, seed)?;
    dimension::<3>(&mut out, count, dx, seed)?;
    Ok(out)
}

fn random(seed: u64, i: usize, k: usize) -> f64 {
    mpm::random::uniform(&[seed, i as u64, k as u64]) - 0.5
}

fn moments(out: &mut Outcome, count: usize, seed: u64) {
    let (mut zero, mut first, mut second) = (0.0f64, 0.0f64, 0.0f64);
    for i in 0..count {
        let x: [f64; 3] = std::array::from_fn(|k| 20.0 * random(seed, i, k));
        for axis in 0..3 {
            let w = Weights::<3>::new(&x, &mac_offset(axis));
            let (mut m0, mut m1, mut m2) = (0.0, [0.0; 3], [[0.0; 3]; 3]);
            for k in 0..Weights::<3>::COUNT {
                let (_, weight, d) = w.node(k);
                m0 += weight;
                for a in 0..3 {
                    m1[a] += weight * d[a];
                    for b in 0..3 {
                        m2[a][b] += weight * d[a] * d[b];
                    }
                }
            }
            zero = zero.max((m0 - 1.0f64).abs());
            for a in 0..3 {
                first = first.max(m1[a].abs());
                for b in 0..3 {
                    second = second.max((m2[a][b] - if a == b { 0.25 } else { 0.0f64 }).abs());
                }
            }
        }
    }
    out.compare_absolute("partition_of_unity", zero, 0.0, 1e-12);
    out.compare_absolute("first_moment", first, 0.0, 1e-12);
    out.compare_absolute("second_moment", second, 0.0, 1e-12);
}

fn dimension<const D: usize>(out: &mut Outcome, count: usize, dx: f64, seed: u64) -> Result<(), CaseError> {
    let water = constitutive::Liquid::preset("water").map_err(CaseError::failed)?;
    let materials = [setup::material(&water)?];
    let lattice = Lattice::<D>::new(dx);
    let mut particles = Particles::<D>::new(&materials);
    for i in 0..count {
        let x = Vector::<D>::from_fn(|a, _| 10.0 * dx * random(seed, i, a));
        let mut q = mpm::Particle::new(x, 0.5 + random(seed, i, 10), 0, 1.0);
        q.velocity = Vector::from_fn(|a, _| random(seed, i, 20 + a));
        q.affine = Tensor::from_fn(|a, b| random(seed, i, 30 + 3 * a + b) / dx);
        particles.push(q);
    }
    let mut grid = LiquidGrid::new(lattice);
    particles_to_grid::activate(&mut particles, &materials, &[], &mut grid).map_err(CaseError::failed)?;
    particles_to_grid::particles_to_grid(&particles, &materials, None, &mut grid);
    let before = particles.totals(&materials, dx);
    let mut angular = [0.0; 3];
    let mut mass_error = 0.0f64;
    for a in 0..D {
        let face = &grid.face[a];
        mass_error = mass_error.max((face.mass.iter().sum::<f64>() / before.mass - 1.0).abs());
        for node in 0..grid.blocks.node_count() {
            let mut u = Vector::<D>::zeros();
            u[a] = face.mass[node] * face.velocity[node];
            let l = wedge(&grid.face_position(a, node), &u);
            for k in 0..3 {
                angular[k] += l[k];
            }
        }
    }
    let scale = before.mass * before.max_speed;
    let linear_error = (grid.momentum() - before.momentum).norm() / scale;
    let turning = |l: [f64; 3]| {
        (0..3).fold(0.0f64, |m, k| m.max((l[k] - before.angular_momentum[k]).abs())) / (scale * 10.0 * dx)
    };
    let there = turning(angular);
    grid_to_particles::grid_to_particles(&mut particles, &grid, &Default::default());
    let after = particles.totals(&materials, dx);
    let name = |what: &str| format!("{what}_{D}d");
    out.compare_absolute(&name("mass"), mass_error, 0.0, 1e-12);
    out.compare_absolute(&name("momentum_to_grid"), linear_error, 0.0, 1e-12);
    out.compare_absolute(&name("momentum_to_particles"), (after.momentum - before.momentum).norm() / scale, 0.0, 1e-12);
    out.compare_absolute(&name("angular_to_grid"), there, 0.0, 1e-12);
    out.compare_absolute(&name("angular_to_particles"), turning(after.angular_momentum), 0.0, 1e-12);
    // An affine motion comes back as it was.
    let gradient = Tensor::<D>::from_fn(|a, b| random(seed, 1, 50 + 3 * a + b));
    for i in 0..count {
        particles.velocity[i] = gradient * particles.position[i];
        particles.affine[i] = gradient;
    }
    particles_to_grid::particles_to_grid(&particles, &materials, None, &mut grid);
    grid_to_particles::grid_to_particles(&mut particles, &grid, &Default::default());
    let worst = (0..count).fold(0.0f64, |m, i| {
        m.max((particles.velocity[i] - gradient * particles.position[i]).norm() / (10.0 * dx))
            .max((particles.affine[i] - gradient).norm())
    });
    out.compare_absolute(&name("affine_round_trip"), worst, 0.0, 1e-11);
    Ok(())
}

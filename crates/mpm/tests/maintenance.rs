//! Splitting, merging and spreading keep what they must.

mod common;
use common::{block, preset, stream};
use mpm::resample::{ResampleScratch, resample, sampling};
use mpm::{LiquidGrid, LiquidSettings, NoSolid, Particles, Tensor, Totals, Vector, particles_to_grid};
use numerics::tensor::unimodular_part;
use particle_grid::Lattice;
use proptest::prelude::*;

fn restless<const D: usize>(lattice: &Lattice<D>, per_axis: usize, seed: u64) -> Particles<D> {
    let materials = [preset("shaving-cream")];
    let mut particles =
        block(lattice, per_axis, Vector::repeat(0.05), Vector::repeat(0.05 + 4.0 * lattice.dx), &materials);
    let mut r = stream(seed);
    for i in 0..particles.len() {
        particles.velocity[i] = Vector::from_fn(|_, _| 3.0 * r() + 1.0);
        particles.affine[i] = Tensor::from_fn(|_, _| 5.0 * r());
        particles.position[i] += Vector::from_fn(|_, _| 0.2 * r() * lattice.dx);
        let f = Tensor::<D>::identity() + Tensor::from_fn(|_, _| 0.1 * r());
        let b = f * f.transpose();
        particles.elastic_strain[i] = unimodular_part(&((b + b.transpose()) * 0.5)).unwrap().1;
        // Volumes from a tenth to five times the nominal one.
        let factor = 10f64.powf(1.7 * r() - 0.15);
        particles.mass[i] *= factor;
        particles.rest_volume[i] *= factor;
    }
    particles
}

fn kept<const D: usize>(before: &Totals<D>, after: &Totals<D>) {
    let close = |a: f64, b: f64, scale: f64| assert!((a - b).abs() <= 1e-11 * scale, "{a} {b}");
    close(before.mass, after.mass, before.mass);
    close(before.rest_volume, after.rest_volume, before.rest_volume);
    close(before.volume, after.volume, before.volume);
    close((before.momentum - after.momentum).norm(), 0.0, before.momentum.norm());
    close((before.centre - after.centre).norm(), 0.0, before.centre.norm());
    let size =
        before.angular_momentum.iter().fold(0.0f64, |m, x| m.max(x.abs())) + before.mass * before.max_speed * 0.1;
    for k in 0..3 {
        close(before.angular_momentum[k], after.angular_momentum[k], size);
    }
}

fn pass<const D: usize>(seed: u64) -> usize {
    let lattice = Lattice::<D>::new(0.01);
    let materials = [preset("shaving-cream")];
    let mut particles = restless(&lattice, 3, seed);
    let mut settings = LiquidSettings { particles_per_axis: 3, ..Default::default() };
    let before = particles.totals(&materials, lattice.dx);
    let mut grid = LiquidGrid::new(lattice);
    let mut scratch = ResampleScratch::default();
    // Splitting and merging alone.
    settings.resample.relaxation_rate = 0.0;
    let report =
        resample::<D, NoSolid>(&mut particles, &materials, &mut grid, &[], 1e-3, 1, &settings, &mut scratch).unwrap();
    assert!(report.split > 0 && report.merged > 0 && report.trimmed > 0, "{report:?}");
    particles.check().unwrap();
    let after = particles.totals(&materials, lattice.dx);
    kept(&before, &after);
    assert!(after.kinetic_energy <= before.kinetic_energy * (1.0 + 1e-12));
    let mut ids = particles.id.clone();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), particles.len(), "identities stay unique");
    // Spreading alone.
    settings.resample.relaxation_rate = 10.0;
    let before = after;
    let report =
        resample::<D, NoSolid>(&mut particles, &materials, &mut grid, &[], 5e-3, 2, &settings, &mut scratch).unwrap();
    kept(&before, &particles.totals(&materials, lattice.dx));
    report.spread
}

/// Crowded particles are spread in some samples at least; a regular one has nothing to spread.
#[test]
fn crowded_particles_are_spread() {
    let spread = |seed: u64| pass::<2>(seed) + pass::<3>(seed);
    assert!((1..=6).map(spread).sum::<usize>() > 0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]
    #[test]
    fn mass_volume_and_both_momenta_are_kept(seed in 1u64..100_000) {
        pass::<2>(seed);
        pass::<3>(seed);
    }
}

#[test]
fn spreading_evens_out_a_crowd_and_parts_coincident_particles() {
    let lattice = Lattice::<2>::new(0.01);
    let materials = [preset("water")];
    let mut particles = block(&lattice, 4, Vector::<2>::zeros(), Vector::<2>::repeat(0.12), &materials);
    let mut r = stream(8);
    for x in &mut particles.position {
        *x += Vector::<2>::new(r(), r()) * 0.01;
    }
    particles.position[1000] = particles.position[1001];
    let settings = LiquidSettings::default();
    let mut grid = LiquidGrid::new(lattice);
    let mut scratch = ResampleScratch::default();
    particles_to_grid::activate(&mut particles, &materials, &[], &mut grid).unwrap();
    let (_, start) = sampling(&grid, 4);
    for k in 0..40 {
        resample::<2, NoSolid>(&mut particles, &materials, &mut grid, &[], 4e-3, k, &settings, &mut scratch).unwrap();
    }
    particles_to_grid::activate(&mut particles, &materials, &[], &mut grid).unwrap();
    let (_, end) = sampling(&grid, 4);
    assert!(end < 0.85 * start, "{start} {end}");
    let mut nearest = f64::INFINITY;
    for i in 0..particles.len() {
        for j in 0..i {
            nearest = nearest.min((particles.position[i] - particles.position[j]).norm());
        }
    }
    assert!(nearest > 0.0);
}

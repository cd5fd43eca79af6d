//! Small set-ups shared by the tests.
#![allow(dead_code, reason = "each test file uses its own part")]

use constitutive::{FlowCurve, LawSettings, Liquid};
use mpm::{LiquidMaterial, Particle, Particles, Vector, fill};
use particle_grid::Lattice;

pub fn liquid(density: f64, bulk: f64, shear: f64, flow: FlowCurve) -> LiquidMaterial {
    let mut l = Liquid::preset("water").unwrap();
    l.density = density;
    l.bulk_modulus = bulk;
    l.shear_modulus = shear;
    l.flow = flow;
    LiquidMaterial::new(&l, LawSettings::default()).unwrap()
}

pub fn preset(name: &str) -> LiquidMaterial {
    LiquidMaterial::new(&Liquid::preset(name).unwrap(), LawSettings::default()).unwrap()
}

pub fn inviscid_water() -> LiquidMaterial {
    liquid(1000.0, 2e9, 0.0, FlowCurve::newtonian(0.0))
}

pub fn block<const D: usize>(
    lattice: &Lattice<D>,
    per_axis: usize,
    low: Vector<D>,
    high: Vector<D>,
    materials: &[LiquidMaterial],
) -> Particles<D> {
    let volume = fill::sample_volume(lattice, per_axis);
    let mut particles = Particles::new(materials);
    for x in fill::fill(lattice, per_axis, &low, &high, |_| true) {
        particles.push(Particle::new(x, volume, 0, materials[0].density));
    }
    particles
}

/// A cheap deterministic stream of numbers in (−½, ½).
pub fn stream(seed: u64) -> impl FnMut() -> f64 {
    let mut s = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    move || {
        s ^= s << 13;
        s ^= s >> 7;
        s ^= s << 17;
        (s >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    }
}

//! The total grid force is the derivative of the total energy.

use nalgebra::{SMatrix, SVector};

use super::{Noise, build, pair_settings};
use crate::forces::{Forces, bending_energy};
use crate::grid::{lanes, momentum};
use crate::settings::Bending;
use crate::step::Scratch;
use crate::{YarnMaterial, YarnSystem};

fn check<const D: usize>(bending: Bending) {
    let mut settings = pair_settings::<D>(0.0);
    settings.materials.insert("yarn".to_owned(), YarnMaterial { bending, ..YarnMaterial::default() });
    let mut system: YarnSystem<D> = build(&settings);
    let mut noise = Noise(5);
    let n = system.model().len();
    for i in 0..n {
        // Compressed sections, off the kink at zero area change; shear and stretch at random.
        let kick = SMatrix::<f64, D, D>::from_fn(|_, _| 0.04 * noise.next());
        let f = &mut system.state_mut().deformation[i];
        *f += kick * *f;
        for a in 1..D {
            let squeezed = f.column(a) * 0.8;
            f.set_column(a, &squeezed);
        }
        system.state_mut().position[i] += noise.vector::<D>() * 2e-4;
    }
    let (model, state) = (system.model().clone(), system.state().clone());
    let deformation_at = |position: &[SVector<f64, D>], i: usize, f: SMatrix<f64, D, D>| {
        let mut f = f;
        if model.has_segment(i) {
            f.set_column(0, &((position[i + 1] - position[i]) / model.rest_length[i]));
        }
        f
    };
    let deformation: Vec<_> = (0..n).map(|i| deformation_at(&state.position, i, state.deformation[i])).collect();

    let mut scratch = Scratch::<D>::new(particle_grid::Lattice::new(model.cell));
    scratch.transfer.rebuild(&model, &state.position).unwrap();
    let mut forces = Forces::default();
    forces.evaluate(&model, &state.position, &deformation, &deformation, &[]);
    let mut still = state.clone();
    still.velocity.fill(SVector::zeros());
    crate::step::particles_to_grid(&model, &still, Some((&forces, 1.0)), &[], &mut scratch.transfer);
    let force: Vec<SVector<f64, D>> = scratch.transfer.nodes.iter().map(momentum).collect();
    let displacement: Vec<SVector<f64, D>> = force.iter().map(|_| noise.vector()).collect();
    let packed: Vec<_> = displacement.iter().map(|u| lanes(u, 0.0)).collect();
    scratch.transfer.gather_from(&packed);
    let energy = |t: f64| {
        let position: Vec<_> = (0..n).map(|i| state.position[i] + scratch.transfer.value(i) * t).collect();
        (0..n)
            .map(|i| {
                let mut sum = bending_energy(&model, i, &position);
                if model.has_segment(i) {
                    let f = deformation[i] + scratch.transfer.gradient(n + i) * deformation[i] * t;
                    let law = &model.materials[model.material[i] as usize].law;
                    sum += model.volume[i] * law.energy(&deformation_at(&position, i, f));
                }
                sum
            })
            .sum::<f64>()
    };
    let h = 1e-5;
    let slope = (45.0 * (energy(h) - energy(-h)) - 9.0 * (energy(2.0 * h) - energy(-2.0 * h))
        + (energy(3.0 * h) - energy(-3.0 * h)))
        / (60.0 * h);
    let exact: f64 = -force.iter().zip(&displacement).map(|(f, u)| f.dot(u)).sum::<f64>();
    let scale: f64 = force.iter().map(|f| f.norm()).sum::<f64>();
    assert!((slope - exact).abs() < 1e-8 * scale.max(exact.abs()), "{slope} {exact} {scale}");
    // Internal forces sum to zero.
    let sum: SVector<f64, D> = force.iter().sum();
    assert!(sum.norm() < 1e-12 * scale, "{sum}");
}

#[test]
fn grid_force_is_the_derivative_of_the_energy() {
    for bending in [Bending::Rod { stiffness: Some(1e-5) }, Bending::Spring { stiffness: None }, Bending::None] {
        check::<2>(bending);
        check::<3>(bending);
    }
}

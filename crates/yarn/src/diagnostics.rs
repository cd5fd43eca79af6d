//! Energies, momenta and what the yarns look like.

use constitutive::yarn::{YarnForm, YarnFrame};
use nalgebra::SVector;
use numerics::reduce::compensated_sum;
use rayon::prelude::*;

use crate::forces::{CHUNK, bending_energy, stress};
use crate::model::YarnModel;
use crate::report::{Energy, Momentum, YarnFrameData};
use crate::state::YarnState;

/// Energies of a state [J].
#[must_use]
pub fn energy<const D: usize>(model: &YarnModel<D>, state: &YarnState<D>, gravity: &SVector<f64, D>) -> Energy {
    let inertia = 0.25 * model.cell * model.cell;
    let n = model.len();
    let middle = |i: usize| (state.velocity[i] + state.velocity[i + 1]) * 0.5;
    let kinetic = compensated_sum((0..n).map(|i| {
        let mut sum =
            model.vertex_mass[i] * (state.velocity[i].norm_squared() + inertia * state.affine[i].norm_squared());
        if model.has_segment(i) {
            sum += model.quadrature_mass[i]
                * (middle(i).norm_squared() + inertia * state.quadrature_affine[i].norm_squared());
        }
        0.5 * sum
    }));
    let of_segment = |i: usize| {
        if !model.has_segment(i) {
            return [0.0; 3];
        }
        let law = &model.materials[model.material[i] as usize].law;
        let f = match &model.world_frame {
            Some(frames) if law.form == YarnForm::Printed => state.deformation[i] * frames[i].transpose(),
            _ => state.deformation[i],
        };
        let frame = YarnFrame::new(&f);
        let stretch = 0.5 * law.stretch_modulus * (frame.stretch - 1.0).powi(2);
        let shear = 0.5 * law.shear_modulus * (frame.shear[0] * frame.shear[0] + frame.shear[1] * frame.shear[1]);
        [law.energy(&f), stretch, shear].map(|density| model.volume[i] * density)
    };
    // Handing out a small job takes longer than doing it.
    let parts: Vec<[f64; 3]> =
        if n < 20_000 { (0..n).map(of_segment).collect() } else { (0..n).into_par_iter().map(of_segment).collect() };
    let [elastic, stretch, shear] = std::array::from_fn(|k| compensated_sum(parts.iter().map(|part| part[k])));
    let bending = compensated_sum((0..n).map(|i| bending_energy(model, i, &state.position)));
    let potential = compensated_sum((0..n).map(|i| {
        let mut sum = model.vertex_mass[i] * gravity.dot(&state.position[i]);
        if model.has_segment(i) {
            sum += 0.5 * model.quadrature_mass[i] * gravity.dot(&(state.position[i] + state.position[i + 1]));
        }
        -sum
    }));
    Energy { kinetic, elastic, stretch, shear, bending, gravity: potential }
}

/// Linear and angular momentum of a state.
#[must_use]
pub fn momentum<const D: usize>(model: &YarnModel<D>, state: &YarnState<D>) -> Momentum<D> {
    let inertia = 0.25 * model.cell * model.cell;
    let n = model.len();
    let mut linear = SVector::<f64, D>::zeros();
    for a in 0..D {
        linear[a] = compensated_sum((0..n).map(|i| {
            let mut sum = model.vertex_mass[i] * state.velocity[i][a];
            if model.has_segment(i) {
                sum += 0.5 * model.quadrature_mass[i] * (state.velocity[i][a] + state.velocity[i + 1][a]);
            }
            sum
        }));
    }
    let mut angular = [0.0; 3];
    let planes: &[(usize, usize, usize)] = if D == 2 { &[(0, 1, 2)] } else { &[(1, 2, 0), (2, 0, 1), (0, 1, 2)] };
    for &(a, b, out) in planes {
        angular[out] = compensated_sum((0..n).map(|i| {
            let spin = |x: &SVector<f64, D>, v: &SVector<f64, D>, c: &nalgebra::SMatrix<f64, D, D>| {
                x[a] * v[b] - x[b] * v[a] + inertia * (c[(b, a)] - c[(a, b)])
            };
            let mut sum = model.vertex_mass[i] * spin(&state.position[i], &state.velocity[i], &state.affine[i]);
            if model.has_segment(i) {
                let x = (state.position[i] + state.position[i + 1]) * 0.5;
                let v = (state.velocity[i] + state.velocity[i + 1]) * 0.5;
                sum += model.quadrature_mass[i] * spin(&x, &v, &state.quadrature_affine[i]);
            }
            sum
        }));
    }
    Momentum { linear, angular }
}

/// Sum of the magnitudes of all momenta [N s] by plain sums, for use as a scale; the same bits for any number of threads.
pub(crate) fn size_of_momentum<const D: usize>(model: &YarnModel<D>, state: &YarnState<D>) -> f64 {
    let chunk = |k: usize| {
        let range = k * CHUNK..((k + 1) * CHUNK).min(model.len());
        range.fold(0.0, |sum, i| sum + state.velocity[i].norm() * model.lumped_mass(i))
    };
    let parts: Vec<f64> = (0..model.len().div_ceil(CHUNK)).into_par_iter().map(chunk).collect();
    parts.iter().sum()
}

/// Tension [N] of segment `i`, positive in tension: axial traction of its ends.
#[must_use]
pub fn tension<const D: usize>(model: &YarnModel<D>, state: &YarnState<D>, i: usize) -> f64 {
    let f = &state.deformation[i];
    let edge: SVector<f64, D> = f.column(0).into_owned();
    let length = edge.norm().max(f64::MIN_POSITIVE);
    let traction: SVector<f64, D> = stress(model, i, f).column(0).into_owned();
    traction.dot(&edge) / length * model.volume[i] / model.rest_length[i]
}

/// Pressure [Pa] of the cross-section of segment `i`, positive in compression.
#[must_use]
pub fn pressure<const D: usize>(model: &YarnModel<D>, state: &YarnState<D>, i: usize) -> f64 {
    model.materials[model.material[i] as usize].law.pressure(&YarnFrame::new(&state.deformation[i]))
}

/// Plain arrays of what the yarns look like.
#[must_use]
pub fn frame_data<const D: usize>(model: &YarnModel<D>, state: &YarnState<D>) -> YarnFrameData {
    let n = model.len();
    let point = |v: &SVector<f64, D>| {
        let mut p = [0.0; 3];
        p[..D].copy_from_slice(v.as_slice());
        p
    };
    let segments: Vec<[f64; 3]> = (0..n)
        .map(|i| {
            if model.has_segment(i) {
                [tension(model, state, i), pressure(model, state, i), state.slip[i]]
            } else {
                [0.0; 3]
            }
        })
        .collect();
    let at_vertex = |k: usize| -> Vec<f64> {
        (0..n)
            .map(|i| match (i > 0 && model.has_segment(i - 1), model.has_segment(i)) {
                (true, true) => 0.5 * (segments[i - 1][k] + segments[i][k]),
                (true, false) => segments[i - 1][k],
                _ => segments[i][k],
            })
            .collect()
    };
    YarnFrameData {
        yarn_start: model.yarn_start.clone(),
        id: (0..n as u64).collect(),
        yarn: (0..n).map(|i| model.locate(i).0 as u32).collect(),
        position: state.position.iter().map(point).collect(),
        velocity: state.velocity.iter().map(point).collect(),
        tension: at_vertex(0),
        pressure: at_vertex(1),
        slip: at_vertex(2),
        segment_tension: segments.iter().map(|s| s[0]).collect(),
        segment_pressure: segments.iter().map(|s| s[1]).collect(),
        segment_slip: segments.iter().map(|s| s[2]).collect(),
        width: model.material.iter().map(|m| model.materials[*m as usize].width).collect(),
    }
}

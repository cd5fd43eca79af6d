//! The room that strands take from the liquid (spec 6.1, 6.2, 6.9).
//!
//! Liquid and strands together keep their volume, `∇·(ε_f u_f + ε_s u_s) = 0`, in terms of what flows through the faces of a cell: the
//! liquid's share of every face, and the volume that strands carry through it. (Spec 6.9 has the same as a rate of the liquid's share
//! following the liquid; that rate needs the liquid's velocity before its pressure is known, and throws it off dense bundles.)

use nalgebra::Vector3;
use rods::RodSet;

use super::Both;
use crate::stages::Step;
use crate::system::Rejection;
use crate::world::film::FilmWorld;
use crate::world::liquid::coupling::{Crowd, FaceNumbers};
use crate::world::submersion::volume::{add_shares, faces_around};
use crate::world::submersion::{DENSEST, Submersion};
use crate::world::{StrandWorld, World};

/// Share of every cell and every face that strands take, for stages 4 and 6.
pub fn crowd(world: &mut World) -> Result<(), Rejection> {
    let Some(both) = Both::of(world) else { return Ok(()) };
    let Both { rods, flow, submersion, .. } = both;
    submersion.densest = 0.0;
    // a step that was refused may have left something
    flow.coupling.clear();
    if !submersion.crowds {
        return Ok(());
    }
    let (blocks, fraction) = (&flow.grid.blocks, &mut flow.coupling.solid_fraction);
    let n = blocks.node_count();
    fraction.resize(n, 0.0);
    add_shares(blocks, &rods.position, &submersion.volume, fraction);
    submersion.densest = fraction.iter().copied().fold(0.0, f64::max);
    if submersion.densest == 0.0 {
        // no strand near the liquid
        fraction.clear();
        return Ok(());
    }
    fraction.iter_mut().for_each(|share| *share = share.min(DENSEST));
    let zeros = || FaceNumbers::<3>::zeros(n);
    let mut crowd = Crowd { left: zeros(), counted: zeros(), flux: zeros(), yields: zeros() };
    let cell = flow.grid.cell_volume();
    for a in 0..3 {
        let (left, counted) = (&mut crowd.left.0[a], &mut crowd.counted.0[a]);
        for (x, volume) in rods.position.iter().zip(&submersion.volume) {
            faces_around(blocks, x, a, |node, weight| left[node] += weight * volume / cell);
        }
        for (share, counted) in left.iter_mut().zip(counted) {
            let taken = share.min(DENSEST);
            *counted = if *share > taken { taken / *share } else { 1.0 };
            *share = 1.0 - taken;
        }
    }
    flow.coupling.crowd = Some(crowd);
    Ok(())
}

/// Volume that strands carry through faces, from their velocities of step 4, and how that answers to the pressure.
///
/// Those velocities know the pressure of the last step. It is taken off them here, so that the new one can act on strands and liquid
/// alike: strands that fill most of the room are moved by it as much as the liquid is. They are taken for free to move, vertex by
/// vertex; what bends or holds them makes them yield less, and is felt through the pressure of the next step.
pub fn carry_volume(world: &mut World, step: Step) -> Result<(), Rejection> {
    let Some(both) = Both::of(world) else { return Ok(()) };
    let Both { rods, strands, film, flow, submersion, memory, .. } = both;
    let Some(crowd) = &mut flow.coupling.crowd else { return Ok(()) };
    strands.stepper.velocities_into(rods, &mut submersion.vectors);
    let answers = answers(rods, strands, film, submersion);
    let (blocks, cell) = (&flow.grid.blocks, flow.grid.cell_volume());
    for a in 0..3 {
        let (flux, yields) = (&mut crowd.flux.0[a], &mut crowd.yields.0[a]);
        flux.fill(0.0);
        yields.fill(0.0);
        for (v, x) in rods.position.iter().enumerate() {
            let (share, answer) = (submersion.volume[v] / cell, answers[v][a]);
            let unpressed = submersion.vectors[v][a] + step.dt * answer * memory.pressure_gradient[v][a];
            faces_around(blocks, x, a, |node, weight| {
                flux[node] += weight * share * unpressed;
                yields[node] += weight * share * answer;
            });
        }
        for ((flux, yields), counted) in flux.iter_mut().zip(yields).zip(&crowd.counted.0[a]) {
            *flux *= counted;
            *yields *= counted;
        }
    }
    Ok(())
}

/// Acceleration of every vertex per pressure gradient, were it by itself [m³/kg]; none where it is held.
fn answers(rods: &RodSet, strands: &StrandWorld, film: &FilmWorld, submersion: &Submersion) -> Vec<Vector3<f64>> {
    let mut answers = vec![Vector3::zeros(); rods.vertex_count()];
    if !submersion.presses {
        return answers;
    }
    for strand in 0..rods.strand_count() {
        for (i, v) in rods.vertices(strand).enumerate() {
            let volume = submersion.volume[v] + film.mass[v] / film.density[strand];
            answers[v] = Vector3::repeat(volume / (rods.vertex_mass(strand, i) + film.mass[v]));
        }
    }
    for held in &strands.boundary.vertices {
        for a in (0..3).filter(|a| held.components[*a]) {
            answers[held.vertex][a] = 0.0;
        }
    }
    answers
}

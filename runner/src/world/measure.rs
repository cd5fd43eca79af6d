//! Figures of the strands for the record.

use nalgebra::Vector3;
use rods::RodSet;

use super::{StrandWorld, World};
use crate::system::Column;

/// Columns of the strands.
pub fn columns(world: &World, columns: &mut Vec<Column>) {
    let Some(strands) = &world.strands else { return };
    for (name, unit, meaning) in [
        ("rod_iterations", "1", "Newton iterations, most of any strand"),
        ("rod_residual", "1", "largest residual over its tolerance"),
        ("strand_mass", "kg", "mass of the strands"),
        ("momentum_x", "N s", "momentum of the strands and what they carry"),
        ("momentum_y", "N s", "momentum of the strands and what they carry"),
        ("momentum_z", "N s", "momentum of the strands and what they carry"),
        ("angular_momentum_x", "N m s", "angular momentum about the origin"),
        ("angular_momentum_y", "N m s", "angular momentum about the origin"),
        ("angular_momentum_z", "N m s", "angular momentum about the origin"),
        ("kinetic_energy", "J", "kinetic energy"),
        ("stretch_energy", "J", "elastic energy of stretching"),
        ("bend_energy", "J", "elastic energy of bending"),
        ("twist_energy", "J", "elastic energy of twisting"),
        ("gravity_energy", "J", "energy in the gravity field, zero at the origin"),
        ("total_energy", "J", "sum of all energies"),
    ] {
        columns.push(Column::new(name, unit, meaning));
    }
    if keeps_momentum_ledger(strands) {
        let meaning = "momentum that no impulse accounts for, relative to the impulses so far";
        columns.push(Column::new("momentum_defect", "1", meaning));
    }
    let clamps: Vec<String> = match strands.held.len() {
        0 => Vec::new(),
        many if many > MOST_CLAMP_COLUMNS => vec!["clamps".to_owned()],
        few => (0..few).map(|place| format!("clamp{place}")).collect(),
    };
    for clamp in clamps {
        for axis in ["x", "y", "z"] {
            columns.push(Column::new(format!("{clamp}_force_{axis}"), "N", "force by which the clamp holds"));
        }
        for axis in ["x", "y", "z"] {
            let meaning = "torque of the clamp about its centre";
            columns.push(Column::new(format!("{clamp}_torque_{axis}"), "N m", meaning));
        }
    }
    for probe in &world.probes {
        probe.columns(columns);
    }
}

/// With more held parts than this only their sum is written: a wisp of a thousand strands has a thousand clamps.
const MOST_CLAMP_COLUMNS: usize = 16;

/// Values of those columns.
pub fn row(world: &World, out: &mut Vec<f64>) {
    let Some(strands) = &world.strands else { return };
    let rods = &world.state.rods;
    let loads = world.loads();
    let momentum = rods.momentum(&loads);
    let energy = rods.energy(&loads);
    out.push(strands.report.solve.iterations as f64);
    out.push(strands.report.solve.residual);
    out.push(momentum.mass - world.film.as_ref().map_or(0.0, |film| film.mass.iter().sum()));
    out.extend(momentum.linear.iter());
    out.extend(momentum.angular.iter());
    out.extend([energy.kinetic, energy.stretch, energy.bend, energy.twist, energy.gravity, energy.total()]);
    if keeps_momentum_ledger(strands) {
        out.push(momentum_defect(world, &momentum.linear));
    }
    if strands.held.len() > MOST_CLAMP_COLUMNS {
        let zero = super::Reaction::default();
        let sum = strands
            .reactions
            .iter()
            .fold(zero, |sum, r| super::Reaction { force: sum.force + r.force, torque: sum.torque + r.torque });
        out.extend(sum.force.iter().chain(sum.torque.iter()));
    } else {
        for reaction in &strands.reactions {
            out.extend(reaction.force.iter().chain(reaction.torque.iter()));
        }
    }
    for probe in &world.probes {
        probe.row(rods, out);
    }
}

/// Momentum that the impulses so far do not account for, relative to their magnitudes.
#[must_use]
pub fn momentum_defect(world: &World, momentum: &Vector3<f64>) -> f64 {
    let ledger = &world.state.ledger;
    let scale = ledger.impulse_scale.max(ledger.initial_momentum.norm()).max(momentum.norm());
    if scale == 0.0 { 0.0 } else { (momentum - ledger.initial_momentum - ledger.impulse).norm() / scale }
}

/// Whether momentum changes by the impulses of one step alone. A two-step formula weighs two steps, and its sum of
/// impulses means nothing.
#[must_use]
pub fn keeps_momentum_ledger(strands: &StrandWorld) -> bool {
    strands.stepper.settings.integrator != rods::Integrator::Bdf2
}

/// Impulse of everything outside on the strands over a step just solved and accepted [N s], and the sum of magnitudes.
///
/// Gravity and holding forces act as in the step's equation; air drag acts on the velocity that moves the vertices.
#[must_use]
pub fn outside_impulse(
    rods: &RodSet,
    moving: &[Vector3<f64>],
    gravity: &Vector3<f64>,
    reactions: &Vector3<f64>,
    film_mass: Option<&[f64]>,
    dt: f64,
) -> (Vector3<f64>, f64) {
    let (mut weight, mut drag) = (Vector3::zeros(), Vector3::zeros());
    for strand in 0..rods.strand_count() {
        let resistance = rods.material[strand].air_drag;
        for (i, vertex) in rods.vertices(strand).enumerate() {
            weight += gravity * (rods.vertex_mass(strand, i) + film_mass.map_or(0.0, |mass| mass[vertex]));
            if resistance > 0.0 {
                drag -= moving[vertex] * (resistance * rods.vertex_length(strand, i));
            }
        }
    }
    ((weight + drag + reactions) * dt, (weight.norm() + drag.norm() + reactions.norm()) * dt)
}

//! Figures of the strands for the record.

use nalgebra::Vector3;
use rods::{Loads, RodSet};

use super::World;
use crate::system::Column;

/// Momentum of all strands [N s].
#[must_use]
pub fn momentum(rods: &RodSet) -> Vector3<f64> {
    rods.momentum(&Loads::default()).linear
}

/// Columns of the strands.
pub fn columns(world: &World, columns: &mut Vec<Column>) {
    let Some(strands) = &world.strands else { return };
    for (name, unit, meaning) in [
        ("rod_iterations", "1", "Newton iterations, most of any strand"),
        ("rod_residual", "1", "largest residual over its tolerance"),
        ("strand_mass", "kg", "mass of the strands"),
        ("momentum_x", "N s", "momentum of the strands"),
        ("momentum_y", "N s", "momentum of the strands"),
        ("momentum_z", "N s", "momentum of the strands"),
        ("angular_momentum_x", "N m s", "angular momentum about the origin"),
        ("angular_momentum_y", "N m s", "angular momentum about the origin"),
        ("angular_momentum_z", "N m s", "angular momentum about the origin"),
        ("kinetic_energy", "J", "kinetic energy"),
        ("stretch_energy", "J", "elastic energy of stretching"),
        ("bend_energy", "J", "elastic energy of bending"),
        ("twist_energy", "J", "elastic energy of twisting"),
        ("gravity_energy", "J", "energy in the gravity field, zero at the origin"),
        ("total_energy", "J", "sum of all energies"),
        ("momentum_defect", "1", "momentum that no impulse accounts for, relative to the impulses so far"),
    ] {
        columns.push(Column::new(name, unit, meaning));
    }
    for (place, _) in strands.held.iter().enumerate() {
        for axis in ["x", "y", "z"] {
            columns.push(Column::new(format!("clamp{place}_force_{axis}"), "N", "force by which the clamp holds"));
        }
        for axis in ["x", "y", "z"] {
            let name = format!("clamp{place}_torque_{axis}");
            columns.push(Column::new(name, "N m", "torque of the clamp about its centre"));
        }
        if strands.held.len() > MOST_CLAMP_COLUMNS {
            break;
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
    let loads = Loads::gravity(world.gravity);
    let momentum = rods.momentum(&loads);
    let energy = rods.energy(&loads);
    out.push(strands.report.solve.iterations as f64);
    out.push(strands.report.solve.residual);
    out.push(momentum.mass);
    out.extend(momentum.linear.iter());
    out.extend(momentum.angular.iter());
    out.extend([energy.kinetic, energy.stretch, energy.bend, energy.twist, energy.gravity, energy.total()]);
    out.push(momentum_defect(world, &momentum.linear));
    if strands.held.len() > MOST_CLAMP_COLUMNS {
        let zero = super::Reaction::default();
        let sum = strands.reactions.iter().fold(zero, |sum, r| super::Reaction {
            force: sum.force + r.force,
            torque: sum.torque + r.torque,
        });
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

//! Figures of the liquid for the record.

use constitutive::tearing::plastic_history;
use mpm::{LedgerReport, TORN, Totals, Vector, YIELDED};
use numerics::tensor::deviator;
use serde_json::{Map, Value, json};

use super::sources::Source;
use super::{Flow, FlowState};
use crate::system::Column;

const AXES: [&str; 3] = ["x", "y", "z"];

impl<const D: usize> Flow<D> {
    /// Columns of the liquid.
    pub fn columns(&self, out: &mut Vec<Column>) {
        let mut add =
            |name: &str, unit: &'static str, meaning: &'static str| out.push(Column::new(name, unit, meaning));
        add("liquid_particles", "1", "particles");
        add("liquid_cells", "1", "cells that count as liquid");
        add("liquid_mass", "kg", "mass of the liquid (per metre of depth in two dimensions)");
        add("liquid_volume", "m³", "volume of the liquid now");
        add("liquid_mass_defect", "1", "mass that the books do not account for, relative");
        add("liquid_volume_defect", "1", "volume at rest that the books do not account for, relative");
        for axis in &AXES[..D] {
            add(&format!("liquid_momentum_{axis}"), "N s", "momentum of the liquid");
        }
        for axis in turns::<D>() {
            add(&format!("liquid_angular_momentum_{axis}"), "N m s", "angular momentum about the origin");
        }
        for axis in &AXES[..D] {
            let meaning = "momentum that neither sources, drains nor body forces account for: what solids and the mouths of sources gave so far";
            add(&format!("liquid_solid_impulse_{axis}"), "N s", meaning);
        }
        for axis in &AXES[..D] {
            let meaning = "momentum that the pressure gave so far: what walls and strands answered";
            add(&format!("liquid_pressure_impulse_{axis}"), "N s", meaning);
        }
        if self.is_alone() {
            let meaning =
                "momentum that sources, drains, body forces, strands and the pressure do not account for, relative";
            add("liquid_momentum_defect", "1", meaning);
        }
        add("liquid_transfer_defect", "1", "momentum changed by the transfers of the step, relative");
        add("liquid_kinetic_energy", "J", "kinetic energy");
        add("liquid_elastic_energy", "J", "elastic energy of volume and shear");
        add("liquid_gravity_energy", "J", "energy in the gravity field, zero at the origin");
        add("liquid_total_energy", "J", "sum of all energies");
        for axis in &AXES[..D] {
            add(&format!("liquid_center_{axis}"), "m", "centre of mass");
        }
        for axis in &AXES[..D] {
            add(&format!("liquid_low_{axis}"), "m", "lowest place of a particle");
            add(&format!("liquid_high_{axis}"), "m", "highest place of a particle");
        }
        add("liquid_max_speed", "m/s", "fastest particle");
        add("liquid_max_stress", "Pa", "largest norm of the shear stress after flow");
        add("liquid_min_volume_ratio", "1", "smallest volume over volume at rest");
        add("liquid_max_volume_ratio", "1", "largest volume over volume at rest");
        add("liquid_max_pressure", "Pa", "largest pressure of the step");
        add("liquid_max_divergence", "1/s", "largest rate of volume before the pressure acts");
        if self.resists_shear() {
            add("liquid_yielded", "1", "particles that flowed in the step");
            add("shear_iterations", "1", "conjugate gradient iterations of both shear solves");
            add("shear_residual", "1", "relative residual of the shear solves");
        }
        if self.tears() {
            add("liquid_torn", "1", "torn particles");
        }
        if self.settings.pressure.enabled {
            add("pressure_iterations", "1", "iterations of the pressure solve");
            add("pressure_residual", "1", "relative residual of the pressure solve");
            let meaning = "largest rate of volume of liquid and strands together at the end of the step";
            add("liquid_mixture_divergence", "1/s", meaning);
        }
        if self.settings.resample.enabled {
            add("liquid_split", "1", "particles split in the step");
            add("liquid_merged", "1", "particles given to their neighbours in the step");
        }
        if !self.sources.is_empty() {
            add("liquid_emitted_mass", "kg", "mass that flowed in so far");
        }
        if !self.drains.is_empty() || self.domain.is_some() {
            add("liquid_drained_mass", "kg", "mass that disappeared in drains or outside the domain so far");
        }
        for probe in &self.probes {
            probe.columns(out);
        }
    }

    /// Values of those columns.
    pub fn row(&self, state: &FlowState<D>, out: &mut Vec<f64>) {
        let Seen { totals, books, low, high, ratio } = self.look(state);
        let report = &self.report;
        let gravity = self.gravity_energy(&totals);
        out.extend([state.particles.len() as f64, report.weights.liquid_cells as f64, totals.mass, totals.volume]);
        out.extend([books.mass_defect, books.volume_defect]);
        out.extend(totals.momentum.iter());
        out.extend(if D == 2 { vec![totals.angular_momentum[0]] } else { totals.angular_momentum.to_vec() });
        out.extend(books.solid_impulse.iter());
        out.extend(state.pressure_impulse.iter());
        if self.is_alone() {
            out.push(self.momentum_defect(state, &totals, &books));
        }
        out.push(report.transfer_defect);
        out.extend([totals.kinetic_energy, totals.elastic_energy, gravity]);
        out.push(totals.kinetic_energy + totals.elastic_energy + gravity);
        out.extend(totals.centre.iter());
        for a in 0..D {
            out.extend([low[a], high[a]]);
        }
        out.extend([totals.max_speed, report.plasticity.max_stress, ratio[0], ratio[1]]);
        let (mut peak, mut divergence) = (0.0, 0.0);
        if let Some(pressure) = &report.pressure {
            (peak, divergence) = (pressure.max_pressure, pressure.max_divergence);
        }
        out.extend([peak, divergence]);
        let shear = [report.shear, report.shear_again].into_iter().flatten();
        if self.resists_shear() {
            let (iterations, residual) =
                shear.fold((0, 0.0), |(n, r), s| (n + s.solve.iterations, f64::max(r, s.solve.residual)));
            out.extend([report.plasticity.yielded as f64, iterations as f64, residual]);
        }
        if self.tears() {
            out.push(report.torn as f64);
        }
        if self.settings.pressure.enabled {
            let predicted = report.prediction.map_or(0, |p| p.multigrid.solve.iterations);
            let pressure = [report.pressure, report.projection].into_iter().flatten();
            let (iterations, residual) = pressure.fold((predicted, 0.0), |(n, r), p| {
                (n + p.multigrid.solve.iterations, f64::max(r, p.multigrid.solve.residual))
            });
            out.extend([iterations as f64, residual, report.mixture_divergence]);
        }
        if self.settings.resample.enabled {
            out.extend([report.resample.split as f64, report.resample.merged as f64]);
        }
        if !self.sources.is_empty() {
            out.push(state.ledger.emitted_mass);
        }
        if !self.drains.is_empty() || self.domain.is_some() {
            out.push(state.ledger.terminated_mass);
        }
        for probe in &self.probes {
            let seen = self.at_point(state, &probe.at);
            out.extend(seen.velocity);
            out.extend([seen.pressure, seen.stress, seen.fraction]);
        }
    }

    /// Figures for the summary.
    pub fn summary(&self, state: &FlowState<D>, out: &mut Map<String, Value>) {
        let Seen { totals, books, ratio, .. } = self.look(state);
        let mut put = |name: &str, value: Value| out.insert(name.to_owned(), value);
        put("dimensions", json!(D));
        put("particles", json!(state.particles.len()));
        put("liquid_mass", json!(totals.mass));
        put("liquid_mass_defect", json!(books.mass_defect.abs()));
        put("liquid_volume_defect", json!(books.volume_defect.abs()));
        put("liquid_volume", json!(totals.volume));
        put("liquid_volume_ratio", json!(ratio));
        put("liquid_removed_mass", json!(state.ledger.removed_mass));
        put("liquid_drained_mass", json!(state.ledger.terminated_mass));
        if !self.sources.is_empty() {
            let swept: f64 = state.sources.iter().map(|source| source.analytic_volume).sum();
            put("liquid_emitted_mass", json!(state.ledger.emitted_mass));
            put("liquid_emitted_volume", json!(state.ledger.emitted_volume));
            put("liquid_swept_volume", json!(swept));
        }
        put("liquid_solid_impulse", json!(books.solid_impulse.as_slice()));
        if self.is_alone() {
            // nothing holds the liquid: what the books miss is the error of the method
            put("liquid_momentum_defect", json!(self.momentum_defect(state, &totals, &books)));
            // what the pressure gave to the liquid though nothing outside pushed: strands, or the error of the free surface
            let pressed = state.pressure_impulse.norm() / self.momentum_scale(state, &totals);
            put("liquid_pressure_impulse", json!(pressed));
        }
        put("liquid_kinetic_energy", json!(totals.kinetic_energy));
        let energy = totals.kinetic_energy + totals.elastic_energy + self.gravity_energy(&totals);
        put("liquid_total_energy", json!(energy));
        let bytes = state.particles.bytes() as f64 / state.particles.len().max(1) as f64;
        put("bytes_per_particle", json!(bytes.round()));
    }

    /// Magnitude that momentum defects are measured against [N s].
    fn momentum_scale(&self, state: &FlowState<D>, totals: &Totals<D>) -> f64 {
        let ledger = &state.ledger;
        let sum = ledger.initial_momentum.norm()
            + ledger.emitted_momentum.norm()
            + ledger.terminated_momentum.norm()
            + ledger.exchanged_momentum.norm()
            + ledger.body_impulse.norm();
        sum.max((2.0 * totals.mass * totals.kinetic_energy).sqrt()).max(f64::MIN_POSITIVE)
    }

    /// Whether nothing holds the liquid: neither solids nor the mouths of sources.
    fn is_alone(&self) -> bool {
        self.bodies.is_empty() && !self.sources.iter().any(Source::flows)
    }

    /// Momentum that no booked impulse accounts for where nothing holds the liquid, relative.
    fn momentum_defect(&self, state: &FlowState<D>, totals: &Totals<D>, books: &LedgerReport<D>) -> f64 {
        (books.solid_impulse - state.pressure_impulse).norm() / self.momentum_scale(state, totals)
    }

    fn gravity_energy(&self, totals: &Totals<D>) -> f64 {
        -totals.mass * self.body.dot(&totals.centre)
    }

    /// Whether a liquid of the scene resists shear.
    #[must_use]
    pub fn resists_shear(&self) -> bool {
        self.settings.shear.enabled && self.materials.iter().any(mpm::LiquidMaterial::resists_shear)
    }

    /// Whether a liquid of the scene can tear.
    #[must_use]
    pub fn tears(&self) -> bool {
        self.settings.tearing && self.materials.iter().any(mpm::LiquidMaterial::has_history)
    }

    fn look(&self, state: &FlowState<D>) -> Seen<D> {
        let particles = &state.particles;
        let totals = particles.totals(&self.materials, self.grid.lattice().dx);
        let (mut low, mut high) = (Vector::<D>::repeat(f64::INFINITY), Vector::<D>::repeat(f64::NEG_INFINITY));
        for x in &particles.position {
            low = low.inf(x);
            high = high.sup(x);
        }
        let mut ratio = [f64::INFINITY, f64::NEG_INFINITY];
        for j in &particles.volume_ratio {
            ratio = [ratio[0].min(*j), ratio[1].max(*j)];
        }
        if particles.is_empty() {
            (low, high, ratio) = (Vector::zeros(), Vector::zeros(), [1.0; 2]);
        }
        Seen { books: state.ledger.report(&totals), totals, low, high, ratio }
    }

    /// Norm of the plastic history of each particle, zero for one that never flowed; empty where none is kept.
    #[must_use]
    pub fn histories(&self, state: &FlowState<D>) -> Vec<f64> {
        let p = &state.particles;
        p.deformation_gradient
            .iter()
            .zip(&p.elastic_strain)
            .map(|(f, b)| plastic_history(f, b).map_or(0.0, |history| deviator(&history).norm()))
            .collect()
    }
}

/// What a look at all particles shows.
struct Seen<const D: usize> {
    totals: Totals<D>,
    books: LedgerReport<D>,
    low: Vector<D>,
    high: Vector<D>,
    ratio: [f64; 2],
}

/// Axes about which things turn.
fn turns<const D: usize>() -> &'static [&'static str] {
    if D == 2 { &AXES[2..] } else { &AXES }
}

/// Whether a particle flowed in the last step.
#[must_use]
pub fn yielded(flags: u8) -> bool {
    flags & YIELDED != 0
}

/// Whether a particle is torn.
#[must_use]
pub fn torn(flags: u8) -> bool {
    flags & TORN != 0
}

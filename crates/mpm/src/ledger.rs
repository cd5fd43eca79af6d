//! What entered, what left, what is there: the books of the liquid.

use crate::particles::Totals;
use crate::resample::ResampleReport;
use crate::source::{Emission, Terminated};
use numerics::tensor::Vector;
use serde::{Deserialize, Serialize};

/// Running sums since the start of a run; part of its state.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ledger<const D: usize> {
    /// Mass at the start [kg].
    pub initial_mass: f64,
    /// Rest volume at the start [m³].
    pub initial_rest_volume: f64,
    /// Momentum at the start [kg m/s].
    pub initial_momentum: Vector<D>,
    /// Mass emitted by sources [kg].
    pub emitted_mass: f64,
    /// Volume emitted by sources [m³].
    pub emitted_volume: f64,
    /// Momentum that came with it [kg m/s].
    pub emitted_momentum: Vector<D>,
    /// Mass taken by terminators [kg].
    pub terminated_mass: f64,
    /// Volume at rest taken by terminators [m³].
    pub terminated_volume: f64,
    /// Momentum that went with it [kg m/s].
    pub terminated_momentum: Vector<D>,
    /// Mass of particles without volume that were removed [kg].
    pub removed_mass: f64,
    /// Mass exchanged with other phases, positive into the liquid [kg].
    pub exchanged_mass: f64,
    /// Rest volume exchanged with other phases [m³].
    pub exchanged_volume: f64,
    /// Momentum exchanged with other phases [kg m/s].
    pub exchanged_momentum: Vector<D>,
    /// Impulse of body forces [N s].
    pub body_impulse: Vector<D>,
}

/// The state of the books at one time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LedgerReport<const D: usize> {
    /// Mass that is there less the mass that should be, over the mass that ever was there [1].
    pub mass_defect: f64,
    /// The same for the volume at rest [1].
    pub volume_defect: f64,
    /// Momentum not explained by sources, terminators, exchange and body forces: what solids gave, and in free flight the
    /// defect of the method [kg m/s].
    pub solid_impulse: Vector<D>,
}

impl<const D: usize> Ledger<D> {
    /// Opens the books on a state.
    #[must_use]
    pub fn open(totals: &Totals<D>) -> Self {
        Self {
            initial_mass: totals.mass,
            initial_rest_volume: totals.rest_volume,
            initial_momentum: totals.momentum,
            emitted_mass: 0.0,
            emitted_volume: 0.0,
            emitted_momentum: Vector::zeros(),
            terminated_mass: 0.0,
            terminated_volume: 0.0,
            terminated_momentum: Vector::zeros(),
            removed_mass: 0.0,
            exchanged_mass: 0.0,
            exchanged_volume: 0.0,
            exchanged_momentum: Vector::zeros(),
            body_impulse: Vector::zeros(),
        }
    }

    /// Books an emission.
    pub fn emitted(&mut self, e: &Emission<D>) {
        self.emitted_mass += e.mass;
        self.emitted_volume += e.volume;
        self.emitted_momentum += e.momentum;
    }

    /// Books what a terminator took.
    pub fn terminated(&mut self, t: &Terminated<D>) {
        self.terminated_mass += t.mass;
        self.terminated_volume += t.rest_volume;
        self.terminated_momentum += t.momentum;
    }

    /// Books the maintenance of particles.
    pub fn resampled(&mut self, r: &ResampleReport) {
        self.removed_mass += r.removed_mass;
    }

    /// Books an exchange with another phase, positive into the liquid.
    pub fn exchanged(&mut self, mass: f64, rest_volume: f64, momentum: &Vector<D>) {
        self.exchanged_mass += mass;
        self.exchanged_volume += rest_volume;
        self.exchanged_momentum += momentum;
    }

    /// Books the body force `body` [m/s²] on `mass` [kg] over `dt` [s].
    pub fn fell(&mut self, mass: f64, body: &Vector<D>, dt: f64) {
        self.body_impulse += body * (mass * dt);
    }

    /// Compares the books with what is there.
    #[must_use]
    pub fn report(&self, totals: &Totals<D>) -> LedgerReport<D> {
        let mass =
            self.initial_mass + self.emitted_mass + self.exchanged_mass - self.terminated_mass - self.removed_mass;
        let volume = self.initial_rest_volume + self.emitted_volume + self.exchanged_volume - self.terminated_volume;
        let ever = self.initial_mass + self.emitted_mass + self.exchanged_mass.abs();
        let ever_volume = self.initial_rest_volume + self.emitted_volume + self.exchanged_volume.abs();
        let relative = |difference: f64, scale: f64| if scale > 0.0 { difference / scale } else { 0.0 };
        LedgerReport {
            mass_defect: relative(totals.mass - mass, ever),
            volume_defect: relative(totals.rest_volume - volume, ever_volume),
            solid_impulse: totals.momentum
                - self.initial_momentum
                - self.emitted_momentum
                - self.exchanged_momentum
                - self.body_impulse
                + self.terminated_momentum,
        }
    }
}

//! Averaged stress of the sample: the decomposition of the published method (Nicot et al. 2013) and the bulk virial.
//!
//! All tensors in Pa with compression positive; rows are force components, columns position components.

use crate::tensor::Tensor2;
use serde::{Deserialize, Serialize};

/// All stress tensors of one instant [Pa].
///
/// Two identities hold at any time: `love_weber = external + linear` and `overall = love_weber + internal_torque + centrifugal`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct StressTensors {
    /// Contacts between two movable grains that do not reach across an edge (S1-19).
    pub love_weber: Tensor2,
    /// `-Σ p pᵀ/m` of the peculiar momenta; for comparison only.
    pub otsuki: Tensor2,
    /// Forces that reach movable grains across edges and from plates (S1-16).
    pub external: Tensor2,
    /// Net forces on movable grains (S1-17).
    pub linear: Tensor2,
    /// Net torques of all grains (S1-23).
    pub torque: Tensor2,
    /// Torques of internal contacts (S1-22, S1-24).
    pub internal_torque: Tensor2,
    /// Centrifugal part of spinning grains (S1-21).
    pub centrifugal: Tensor2,
    /// `love_weber + internal_torque + centrifugal`; symmetric (S1-24).
    pub overall: Tensor2,
    /// As `overall`, but with every contact once along its image vector, plate and edge contacts included.
    pub bulk: Tensor2,
}

impl StressTensors {
    /// Largest violation of the two identities and of the symmetry of `overall`, relative to the largest entry involved.
    pub fn identity_defect(&self) -> f64 {
        let scale = [self.love_weber, self.external, self.linear, self.internal_torque, self.centrifugal]
            .iter()
            .fold(0.0f64, |m, t| m.max(t.max_abs()));
        if scale == 0.0 {
            return self.overall.max_abs();
        }
        let first = (self.love_weber - self.external - self.linear).max_abs();
        let second = (self.overall - self.love_weber - self.internal_torque - self.centrifugal).max_abs();
        first.max(second).max(self.overall.asymmetry().abs()) / scale
    }
}

/// Names of the 42 columns of the published table, in order.
pub const COLUMNS: [&str; 42] = [
    "index",
    "t",
    "strain",
    "strain_rate",
    "stress_measured_at_surface",
    "shear_stress_internal_stress-tensor",
    "stress_tensor_Love_Weber_00",
    "stress_tensor_Love_Weber_01",
    "stress_tensor_Love_Weber_10",
    "stress_tensor_Love_Weber_11",
    "stress_tensor_peculiar_acceleration_otsuki_00",
    "stress_tensor_peculiar_acceleration_otsuki_01",
    "stress_tensor_peculiar_acceleration_otsuki_10",
    "stress_tensor_peculiar_acceleration_otsuki_11",
    "stress_tensor_from_external_forces_00",
    "stress_tensor_from_external_forces_01",
    "stress_tensor_from_external_forces_10",
    "stress_tensor_from_external_forces_11",
    "stress_tensor_linear_acceleration_00",
    "stress_tensor_linear_acceleration_01",
    "stress_tensor_linear_acceleration_10",
    "stress_tensor_linear_acceleration_11",
    "stress_tensor_unbalanced_linear_forces_00",
    "stress_tensor_unbalanced_linear_forces_01",
    "stress_tensor_unbalanced_linear_forces_10",
    "stress_tensor_unbalanced_linear_forces_11",
    "stress_tensor_tangential_torque_00",
    "stress_tensor_tangential_torque_01",
    "stress_tensor_tangential_torque_10",
    "stress_tensor_tangential_torque_11",
    "stress_tensor_internal_tangential_torque_00",
    "stress_tensor_internal_tangential_torque_01",
    "stress_tensor_internal_tangential_torque_10",
    "stress_tensor_internal_tangential_torque_11",
    "stress_tensor_centrifugal_00",
    "stress_tensor_centrifugal_01",
    "stress_tensor_centrifugal_10",
    "stress_tensor_centrifugal_11",
    "stress_tensor_overall_00",
    "stress_tensor_overall_01",
    "stress_tensor_overall_10",
    "stress_tensor_overall_11",
];

/// One row of the time series.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Row {
    /// Number of the recorded step, from 0.
    pub index: u64,
    /// Time since the start of the experiment [s].
    pub time: f64,
    /// Shear strain at the beginning of the step [-].
    pub strain: f64,
    /// Shear rate of the step [1/s].
    pub rate: f64,
    /// Compressive strain (height lost over the initial height) [-]; zero except in compression.
    pub compression: f64,
    /// Stress tensors [Pa].
    pub stress: StressTensors,
    /// Contacts (each counted once).
    pub contacts: u32,
    /// Transient contacts at the Coulomb limit.
    pub slipping: u32,
    /// Kinetic energy relative to the shear flow [µm² mg s⁻²/m].
    pub kinetic_energy: f64,
    /// Elastic energy of the contacts [µm² mg s⁻²/m]; recorded where asked for, else zero.
    pub elastic_energy: f64,
}

impl Row {
    /// Shear stress by surface force, `τ = -σ_ext,xy` [Pa].
    pub fn surface_stress(&self) -> f64 {
        self.stress.external.shear()
    }

    /// Shear stress of the overall tensor [Pa].
    pub fn overall_stress(&self) -> f64 {
        self.stress.overall.shear()
    }

    /// The 42 values of the published table, in the order of [`COLUMNS`].
    pub fn columns(&self) -> [f64; 42] {
        let s = &self.stress;
        let mut row = [0.0; 42];
        row[..6].copy_from_slice(&[
            self.index as f64,
            self.time,
            self.strain,
            self.rate,
            self.surface_stress(),
            self.overall_stress(),
        ]);
        let tensors = [
            s.love_weber,
            s.otsuki,
            s.external,
            s.linear,
            s.linear,
            s.torque,
            s.internal_torque,
            s.centrifugal,
            s.overall,
        ];
        for (chunk, t) in row[6..].chunks_exact_mut(4).zip(tensors) {
            chunk.copy_from_slice(&t.0);
        }
        row
    }
}

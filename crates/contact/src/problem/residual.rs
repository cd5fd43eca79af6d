//! The natural-map residual: the one measure by which every solver, the cross-check and the peers are judged.

use super::BlockMatrix;
use crate::block::{Vec3, norm_squared, trace};
use crate::law::natural_map;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// How velocity and impulse are brought to one unit in the residual.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Scaling {
    /// `ρ = 1`: as the public problems are judged by their library. Only sensible when `W` is of order one.
    UnitStep,
    /// `ρ_k = 3/tr W_kk`: both sides in impulse units, so that the choice of units does not decide (spec 7.4).
    #[default]
    PerContact,
}

impl Scaling {
    /// The weight `ρ_k` of contact `k`; 0 where no impulse can move the contact.
    #[inline]
    #[must_use]
    pub fn weight(self, w: &BlockMatrix, k: usize) -> f64 {
        match self {
            Scaling::UnitStep => 1.0,
            Scaling::PerContact => {
                let t = trace(w.diagonal(k));
                if t > 0.0 { 3.0 / t } else { 0.0 }
            }
        }
    }
}

/// Sums from which the relative residual follows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ResidualParts {
    /// Squared norm of the natural map over all contacts.
    pub map_squared: f64,
    /// Squared norm of `ρ q`.
    pub free_squared: f64,
    /// Squared norm of `r`.
    pub impulse_squared: f64,
    /// Squared norm of `ρ u`.
    pub velocity_squared: f64,
}

impl ResidualParts {
    /// Adds one contact.
    #[inline]
    pub fn add(&mut self, r: &Vec3, u: &Vec3, q: &Vec3, friction: f64, rho: f64) {
        self.map_squared += norm_squared(&natural_map(r, u, friction, rho));
        self.free_squared += rho * rho * norm_squared(q);
        self.impulse_squared += norm_squared(r);
        self.velocity_squared += rho * rho * norm_squared(u);
    }

    /// Adds what was gathered elsewhere.
    pub fn merge(&mut self, other: &ResidualParts) {
        self.map_squared += other.map_squared;
        self.free_squared += other.free_squared;
        self.impulse_squared += other.impulse_squared;
        self.velocity_squared += other.velocity_squared;
    }

    /// Size of the problem, `max(‖ρ q‖, ‖r‖, ‖ρ u‖)`.
    #[must_use]
    pub fn size(&self) -> f64 {
        self.free_squared.max(self.impulse_squared).max(self.velocity_squared).sqrt()
    }

    /// Size by which a solver judges itself: as [`size`](Self::size), but in scaled problems at most a thousand times the
    /// free velocity. Where no solution is near, impulses run away and would make any violation look small beside them.
    #[must_use]
    pub fn guarded_size(&self, scaling: Scaling) -> f64 {
        match scaling {
            Scaling::PerContact if self.free_squared > 0.0 => self.size().min(RUNAWAY * self.free_squared.sqrt()),
            _ => self.size(),
        }
    }

    /// Whether the law is broken by more than a hundredth of the free velocity, whatever the impulses are.
    #[must_use]
    pub fn breaks_the_law(&self) -> bool {
        self.map_squared > (JAMMED * JAMMED) * self.free_squared
    }

    /// The relative residual (absolute if everything vanishes); NaN stays NaN.
    #[must_use]
    pub fn relative(&self) -> f64 {
        let s = self.size();
        if s > 0.0 { self.map_squared.sqrt() / s } else { self.map_squared.sqrt() }
    }
}

/// Violation of the law relative to the free velocity above which a problem counts as jammed.
const JAMMED: f64 = 1e-2;

/// Contacts that one task looks at; the sums are taken in this order for any number of threads.
const CHUNK: usize = 512;

/// Impulses over free velocity (in one unit) above which the size no longer counts.
const RUNAWAY: f64 = 1e3;

/// Relative natural-map residual of impulses `r` (with the cohesive shift) for `u = W r + q`.
///
/// `√Σ‖r_k − P_K(r_k − ρ_k (u_k + ν‖u_T‖ e_N))‖² / max(‖ρq‖, ‖r‖, ‖ρu‖)`.
#[must_use]
pub fn residual(w: &BlockMatrix, q: &[Vec3], friction: &[f64], r: &[Vec3], scaling: Scaling) -> f64 {
    residual_parts(w, q, friction, r, scaling).relative()
}

/// The sums behind [`residual`].
#[must_use]
pub fn residual_parts(w: &BlockMatrix, q: &[Vec3], friction: &[f64], r: &[Vec3], scaling: Scaling) -> ResidualParts {
    let chunk = |begin: usize| {
        let mut parts = ResidualParts::default();
        for k in begin..(begin + CHUNK).min(w.len()) {
            let s = w.row_product_sparse(k, r);
            let u = [s[0] + q[k][0], s[1] + q[k][1], s[2] + q[k][2]];
            parts.add(&r[k], &u, &q[k], friction[k], scaling.weight(w, k));
        }
        parts
    };
    if w.len() <= CHUNK {
        return chunk(0);
    }
    let mut parts = ResidualParts::default();
    let chunks: Vec<ResidualParts> =
        (0..w.len().div_ceil(CHUNK)).into_par_iter().with_max_len(1).map(|c| chunk(c * CHUNK)).collect();
    chunks.iter().for_each(|part| parts.merge(part));
    parts
}

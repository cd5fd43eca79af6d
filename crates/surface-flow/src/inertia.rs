//! Impulse that film moving along a moving strand exerts on it.
//!
//! Film of mass `m` that slides from a place where the strand moves at `u_s` to one where it moves otherwise has to take up the
//! new motion; the strand pays for it. [`InertiaForm::SemiLagrangian`] is the published form, [`InertiaForm::Advective`] and
//! [`InertiaForm::Flux`] use the volumes that really crossed the edges:
//!
//! `m^{n+1} u + Advective = m^n u + Flux` to round-off, the equivalence of S57–S63; the sum of `Flux` over a strand with closed
//! ends is zero, so momentum is conserved.
//!
//! Source: Fei et al. 2019, main-paper (9), supplemental S57–S63.

use std::ops::{Add, Mul, Sub};

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::error::FilmError;
use crate::state::{FilmState, StrandSlices};

/// Form of the additional inertia.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum InertiaForm {
    /// `m [u_s(x − dt u) − u_s(x)]`, back-traced by the midpoint rule; nothing where the foot lies beyond an end. The published
    /// form: not conservative.
    SemiLagrangian,
    /// Upwind, with the volumes that crossed the edges, beside the film mass *after* the step: zero for uniform motion.
    #[default]
    Advective,
    /// The momentum carried across the edges, beside the film mass *before* the step: sums to zero over a closed strand.
    Flux,
}

/// Impulses on the vertices of all strands [N·s], written to `impulse`.
///
/// - `crossed`: volume that crossed each edge during the step [m³] (`FilmSolver::crossed_volume`); not read by the
///   semi-Lagrangian form
/// - `velocity`: velocity of the strand at each vertex [m/s]
/// - `density`: of the film on each strand [kg/m³]; one value: the same for all
/// - `dt`: step [s]; read by the semi-Lagrangian form alone
///
/// # Errors
/// [`FilmError::Shape`] if a slice does not fit.
#[allow(clippy::too_many_arguments)]
pub fn impulses(
    form: InertiaForm,
    state: &FilmState,
    strands: StrandSlices<'_>,
    crossed: &[f64],
    velocity: &[Vector3<f64>],
    density: &[f64],
    dt: f64,
    impulse: &mut [Vector3<f64>],
) -> Result<(), FilmError> {
    let density_of = densities(density, state.strands())?;
    state.check_shapes(&strands)?;
    let require = |what, expected: usize, found: usize| {
        if expected == found { Ok(()) } else { Err(FilmError::Shape { what, expected, found }) }
    };
    require("crossed volume", state.velocity.len(), crossed.len())?;
    require("velocity", state.area.len(), velocity.len())?;
    require("impulse", state.area.len(), impulse.len())?;
    for s in 0..state.strands() {
        let (v, e) = (state.vertices(s), state.edges(s));
        let motion = &velocity[v.clone()];
        let out = &mut impulse[v.clone()];
        let density = density_of(s);
        if form == InertiaForm::SemiLagrangian {
            let length = &strands.edge_length[e.clone()];
            let film = Film { area: &state.area[v], speed: &state.velocity[e], length };
            film.back_trace(motion, density, dt, out);
        } else {
            transfer(form, &crossed[e], motion, density, out);
        }
    }
    Ok(())
}

/// The density of each strand from one value or one for each.
fn densities(density: &[f64], strands: usize) -> Result<impl Fn(usize) -> f64 + '_, FilmError> {
    if density.len() != 1 && density.len() != strands {
        return Err(FilmError::Shape { what: "density", expected: strands, found: density.len() });
    }
    Ok(move |strand: usize| density[if density.len() == 1 { 0 } else { strand }])
}

/// Impulses from the volumes that crossed the edges of one strand.
fn transfer(form: InertiaForm, crossed: &[f64], motion: &[Vector3<f64>], density: f64, out: &mut [Vector3<f64>]) {
    out.fill(Vector3::zeros());
    for j in 0..crossed.len() {
        let mass = density * crossed[j];
        let carried = if mass > 0.0 { motion[j] } else { motion[j + 1] };
        let (left, right) = match form {
            InertiaForm::Flux => (carried, carried),
            _ => (carried - motion[j], carried - motion[j + 1]),
        };
        out[j] -= mass * left;
        out[j + 1] += mass * right;
    }
}

/// One film for back-tracing.
struct Film<'a> {
    area: &'a [f64],
    speed: &'a [f64],
    length: &'a [f64],
}

impl Film<'_> {
    fn vertex_speed(&self, i: usize) -> f64 {
        let edges = self.speed.len();
        0.5 * (self.speed[i.saturating_sub(1)] + self.speed[i.min(edges - 1)])
    }

    /// Value of vertex data a signed distance away from vertex `i`; none beyond the ends.
    fn at<T>(&self, value: impl Fn(usize) -> T, i: usize, distance: f64) -> Option<T>
    where
        T: Add<Output = T> + Sub<Output = T> + Mul<f64, Output = T> + Copy,
    {
        let (mut i, mut left) = (i, distance);
        loop {
            if left == 0.0 {
                return Some(value(i));
            }
            let (edge, next) = if left > 0.0 { (i, i + 1) } else { (i.checked_sub(1)?, i.checked_sub(1)?) };
            let length = *self.length.get(edge)?;
            if left.abs() <= length {
                return Some(value(i) + (value(next) - value(i)) * (left.abs() / length));
            }
            left -= length.copysign(left);
            i = next;
        }
    }

    /// Foot of the path that ends at vertex `i` after `dt`, as a distance from it; none beyond the ends.
    fn foot(&self, i: usize, dt: f64) -> Option<f64> {
        let middle = self.at(|k| self.vertex_speed(k), i, -0.5 * dt * self.vertex_speed(i))?;
        Some(-dt * middle)
    }

    fn back_trace(&self, motion: &[Vector3<f64>], density: f64, dt: f64, out: &mut [Vector3<f64>]) {
        let edges = self.length.len();
        for i in 0..self.area.len() {
            out[i] = Vector3::zeros();
            if edges == 0 {
                continue;
            }
            let before = if i > 0 { self.length[i - 1] } else { 0.0 };
            let after = if i < edges { self.length[i] } else { 0.0 };
            let mass = density * self.area[i] * 0.5 * (before + after);
            if let Some(there) = self.foot(i, dt).and_then(|d| self.at(|k| motion[k], i, d)) {
                out[i] = mass * (there - motion[i]);
            }
        }
    }
}

/// Impulses of moment on the edges of all strands [N·m·s] from film carrying the rotation of one edge to the next:
/// `I [θ̇(x − dt u) − θ̇(x)]` with the film's rotary inertia, back-traced edge by edge; written to `impulse`.
///
/// - `spin`: rotation rate of the strand about its tangent on each edge [1/s]
/// - `density`: as for [`impulses`]
///
/// # Errors
/// [`FilmError::Shape`] if a slice does not fit.
pub fn twist_impulses(
    state: &FilmState,
    strands: StrandSlices<'_>,
    spin: &[f64],
    density: &[f64],
    dt: f64,
    impulse: &mut [f64],
) -> Result<(), FilmError> {
    let density_of = densities(density, state.strands())?;
    state.check_shapes(&strands)?;
    for (what, found) in [("spin", spin.len()), ("impulse", impulse.len())] {
        if found != state.velocity.len() {
            return Err(FilmError::Shape { what, expected: state.velocity.len(), found });
        }
    }
    for s in 0..state.strands() {
        let (v, e) = (state.vertices(s), state.edges(s));
        let density = density_of(s);
        let (area, axes) = (&state.area[v.clone()], &strands.semi_axes[v]);
        let (speed, length) = (&state.velocity[e.clone()], &strands.edge_length[e.clone()]);
        let (spin, out) = (&spin[e.clone()], &mut impulse[e]);
        for j in 0..spin.len() {
            // one edge upstream: films do not pass more than one edge in a step once their speed is limited
            let upstream = if speed[j] > 0.0 { j.checked_sub(1) } else { Some(j + 1).filter(|k| *k < spin.len()) };
            out[j] = upstream.map_or(0.0, |k| {
                let distance = 0.5 * (length[j] + length[k]);
                let share = (dt * speed[j].abs() / distance).min(1.0);
                let area = 0.5 * (area[j] + area[j + 1]);
                let mean = [0.5 * (axes[j][0] + axes[j + 1][0]), 0.5 * (axes[j][1] + axes[j + 1][1])];
                rotary_inertia(density * area * length[j], area, mean) * share * (spin[k] - spin[j])
            });
        }
    }
    Ok(())
}

/// Inertia of a film about the axis of its strand [kg·m²]: `¼ m (a² + b² + (a + h)² + (b + h)²)`.
///
/// - `mass`: [kg]; `area`: cross-section of the film [m²]; `axes`: semi-axes of the strand [m]
#[must_use]
pub fn rotary_inertia(mass: f64, area: f64, axes: [f64; 2]) -> f64 {
    let h = crate::state::film_height(area, axes[0] + axes[1]);
    let [a, b] = axes;
    0.25 * mass * (a * a + b * b + (a + h) * (a + h) + (b + h) * (b + h))
}

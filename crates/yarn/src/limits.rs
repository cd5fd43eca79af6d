//! Largest stable and sensible steps.
//!
//! The stability bounds are proved, not fitted. With quadratic weights that sum to one, `|Σ w v|² ≤ Σ w |v|²` and
//! `|C|² ≤ (4/dx²) Σ w |v|²`; so the elastic energy of a velocity field is bounded by its kinetic energy, vertex masses
//! answering for edges and bending, quadrature masses for the sections:
//!
//! ```text
//! ω² ≤ 4 K_e/((1 − s₃) ρ l²) + 16 B φ⁻²/((1 − s₃) ρ A l⁴),   K_e = max(k, k (1 − 1/a) + G/a²)
//! ω² ≤ 4 K_c/(s₃ ρ dx²),                                   K_c = max((2μ + λ)(1 − ln s), G)
//! ```
//!
//! and symplectic Euler is stable for `ω dt < 2`. `G = 2 γ |F₂|² + |h'|` is the shear that edges and sections share, `a` the
//! stretch, `s` the most compressed section, `φ = (1 + cos θ)/2` the sharpest bend.

use constitutive::yarn::{YarnFrame, bend};
use rayon::prelude::*;

use crate::boundary::Boundary;
use crate::forces::CHUNK;
use crate::model::{BendingLaw, YarnModel};
use crate::report::StepLimit;
use crate::settings::{Integrator, YarnSettings};
use crate::state::YarnState;

/// Limit of edges and bending.
pub const STRETCH_WAVES: &str = "yarn: stretch and bending waves";
/// Limit of the cross-sections.
pub const CONTACT_WAVES: &str = "yarn: contact and shear waves";
/// Limit of the motion of vertices.
pub const MOTION: &str = "yarn: motion";
/// Limit of the motion of obstacles, pins and drives.
pub const OBSTACLE_MOTION: &str = "yarn: obstacle motion";

/// What the limits need of a state, gathered in one pass over it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rates {
    /// Step at which the fastest edge or bend is at the limit of stability [s].
    edge: f64,
    /// The same for cross-sections [s].
    section: f64,
    /// Largest speed of a vertex [m/s].
    fastest: f64,
}

/// Gathers the rates of a state.
pub(crate) fn rates<const D: usize>(settings: &YarnSettings, model: &YarnModel<D>, state: &YarnState<D>) -> Rates {
    let (edge, section) = wave_limits(settings, model, state);
    let fastest = state
        .velocity
        .par_chunks(CHUNK)
        .map(|v| v.iter().map(|v| v.norm_squared()).fold(0.0, f64::max))
        .reduce(|| 0.0, f64::max)
        .sqrt();
    Rates { edge, section, fastest }
}

/// All limits that apply now; `rates` are those of [`rates`] for this state.
pub(crate) fn step_limits<const D: usize>(
    settings: &YarnSettings,
    rates: Rates,
    boundary: &Boundary<D>,
    state: &YarnState<D>,
) -> Vec<StepLimit> {
    let mut limits = Vec::with_capacity(4);
    let mut add = |seconds: f64, reason| {
        if seconds.is_finite() {
            limits.push(StepLimit { seconds, reason });
        }
    };
    if settings.step.integrator == Integrator::Explicit {
        add(settings.step.safety * rates.edge, STRETCH_WAVES);
        add(settings.step.safety * rates.section, CONTACT_WAVES);
    }
    let reach = settings.step.motion * settings.cell;
    add(reach / rates.fastest, MOTION);
    let mut led = 0.0f64;
    for obstacle in &boundary.obstacles {
        led = led.max(obstacle.at(state.time).speed());
    }
    for (pin, _) in &boundary.pins {
        led = led.max(pin.at(state.time).1.norm());
    }
    for (_, drive) in &boundary.drives {
        led = led.max(drive.at(state.time).1.norm());
    }
    add(reach / led, OBSTACLE_MOTION);
    limits
}

/// Steps at which `ω dt = 2` may be reached, for edges and for sections; of no interest to implicit steps.
fn wave_limits<const D: usize>(settings: &YarnSettings, model: &YarnModel<D>, state: &YarnState<D>) -> (f64, f64) {
    if settings.step.integrator != Integrator::Explicit {
        return (f64::INFINITY, f64::INFINITY);
    }
    let share = settings.quadrature_mass_share;
    let section_share = if share > 0.0 { share } else { 0.5 };
    let cell2 = model.cell * model.cell;
    (0..model.len().div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let (mut edge_rate2, mut section_rate2) = (0.0f64, 0.0f64);
            for i in chunk * CHUNK..((chunk + 1) * CHUNK).min(model.len()) {
                if !model.has_segment(i) {
                    continue;
                }
                let material = &model.materials[model.material[i] as usize];
                let law = &material.law;
                let length2 = model.rest_length[i] * model.rest_length[i];
                let mass = (1.0 - share) * material.density * model.volume[i];
                let frame = YarnFrame::new(&state.deformation[i]);
                let (mut least, mut most) = (1.0f64, 0.0f64);
                for a in 0..D - 1 {
                    least = least.min(frame.section[a].max(law.min_section));
                    most = most.max(frame.section[a] * frame.section[a]);
                }
                let contact = 2.0 * law.mu + law.lambda;
                let pressure = -contact * least.ln();
                let section2 = most + frame.shear[0] * frame.shear[0] + frame.shear[1] * frame.shear[1];
                let shear = 2.0 * law.shear_modulus * section2 + pressure / least;
                let taut = law.stretch_modulus * (1.0 - 1.0 / frame.stretch).max(0.0);
                let across = taut + shear / (frame.stretch * frame.stretch).max(1e-2);
                let stiffness = law.stretch_modulus.max(across) * model.volume[i];
                let mut rate2 = 4.0 * stiffness / (mass * length2);
                if model.is_inner(i) {
                    rate2 += match material.bending {
                        BendingLaw::None => 0.0,
                        BendingLaw::Spring(k) => 4.0 * k / mass,
                        BendingLaw::Rod(b) => {
                            let (e, f) =
                                (state.position[i] - state.position[i - 1], state.position[i + 1] - state.position[i]);
                            let open = bend(&e, &f, b, 1.0).openness.max(1e-2);
                            let length = model.rest_length[i].min(model.rest_length[i - 1]);
                            16.0 * b / (mass * length.powi(3) * open * open)
                        }
                    };
                }
                edge_rate2 = edge_rate2.max(rate2);
                let modulus = (contact + pressure).max(shear);
                section_rate2 = section_rate2.max(4.0 * modulus / (section_share * material.density * cell2));
            }
            (2.0 / edge_rate2.sqrt(), 2.0 / section_rate2.sqrt())
        })
        .reduce(|| (f64::INFINITY, f64::INFINITY), |a, b| (a.0.min(b.0), a.1.min(b.1)))
}

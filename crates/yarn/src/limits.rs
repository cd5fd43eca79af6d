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
use nalgebra::SVector;
use rayon::prelude::*;

use crate::boundary::Boundary;
use crate::forces::{CHUNK, Forces, bending_force, section_moment, stress_of_frame};
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
    let sums = if settings.step.integrator == Integrator::Explicit {
        let waves = Waves::new(settings, model);
        (0..model.len().div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let mut sums = Sums::default();
                for i in chunk * CHUNK..((chunk + 1) * CHUNK).min(model.len()) {
                    sums.moves(&state.velocity[i]);
                    if model.has_segment(i) {
                        let frame = YarnFrame::new(&state.deformation[i]);
                        sums.segment(&waves, i, &frame, || openness(model, state, i));
                    }
                }
                sums
            })
            .reduce(Sums::default, Sums::max)
    } else {
        fastest(state)
    };
    sums.rates(settings)
}

/// Gathers the rates of a state and evaluates the forces of an explicit step from it, in one pass over the segments.
pub(crate) fn rates_and_forces<const D: usize>(
    settings: &YarnSettings,
    model: &YarnModel<D>,
    state: &YarnState<D>,
    forces: &mut Forces<D>,
) -> Rates {
    let waves = Waves::new(settings, model);
    forces.resize(model.len());
    let sums = forces
        .traction
        .par_chunks_mut(CHUNK)
        .zip(forces.section.par_chunks_mut(CHUNK))
        .zip(forces.bending.par_chunks_mut(CHUNK))
        .enumerate()
        .map(|(chunk, ((traction, section), bending))| {
            let mut sums = Sums::default();
            for k in 0..traction.len() {
                let i = chunk * CHUNK + k;
                sums.moves(&state.velocity[i]);
                let bend = bending_force(model, i, &state.position);
                bending[k] = bend.gradients;
                if model.has_segment(i) {
                    let f = &state.deformation[i];
                    let frame = YarnFrame::new(f);
                    let stress = stress_of_frame(model, i, f, &frame);
                    traction[k] = stress.column(0) * (model.volume[i] / model.rest_length[i]);
                    section[k] = section_moment(&stress, f, model.volume[i]);
                    sums.segment(&waves, i, &frame, || bend.openness);
                }
            }
            sums
        })
        .reduce(Sums::default, Sums::max);
    sums.rates(settings)
}

/// What does not change about the waves.
struct Waves<'a, const D: usize> {
    model: &'a YarnModel<D>,
    share: f64,
    section_share: f64,
}

impl<'a, const D: usize> Waves<'a, D> {
    fn new(settings: &YarnSettings, model: &'a YarnModel<D>) -> Self {
        let share = settings.quadrature_mass_share;
        Self { model, share, section_share: if share > 0.0 { share } else { 0.5 } }
    }
}

/// Largest squared rates [1/s²] and speed [m²/s²] so far.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    edge: f64,
    section: f64,
    speed: f64,
}

impl Sums {
    fn max(self, other: Self) -> Self {
        Self {
            edge: self.edge.max(other.edge),
            section: self.section.max(other.section),
            speed: self.speed.max(other.speed),
        }
    }

    #[inline(always)]
    fn moves<const D: usize>(&mut self, velocity: &SVector<f64, D>) {
        self.speed = self.speed.max(velocity.norm_squared());
    }

    /// Takes in segment `i`; `open` gives the openness of the bend at its first vertex.
    #[inline(always)]
    fn segment<const D: usize>(
        &mut self,
        waves: &Waves<'_, D>,
        i: usize,
        frame: &YarnFrame<D>,
        open: impl FnOnce() -> f64,
    ) {
        let model = waves.model;
        let material = &model.materials[model.material[i] as usize];
        let law = &material.law;
        let length2 = model.rest_length[i] * model.rest_length[i];
        let mass = (1.0 - waves.share) * material.density * model.volume[i];
        let (mut least, mut most) = (1.0f64, 0.0f64);
        for a in 0..D - 1 {
            least = least.min(frame.section[a].max(law.min_section));
            most = most.max(frame.section[a] * frame.section[a]);
        }
        let contact = 2.0 * law.mu + law.lambda;
        // Most sections are open, and a logarithm is dear.
        let pressure = if least < 1.0 { -contact * least.ln() } else { 0.0 };
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
                    let open = open().max(1e-2);
                    let length = model.rest_length[i].min(model.rest_length[i - 1]);
                    16.0 * b / (mass * length.powi(3) * open * open)
                }
            };
        }
        self.edge = self.edge.max(rate2);
        let modulus = (contact + pressure).max(shear);
        let cell2 = model.cell * model.cell;
        self.section = self.section.max(4.0 * modulus / (waves.section_share * material.density * cell2));
    }

    /// Steps at which `ω dt = 2` may be reached; of no interest to implicit steps.
    fn rates(&self, settings: &YarnSettings) -> Rates {
        let explicit = settings.step.integrator == Integrator::Explicit;
        let step = |rate2: f64| if explicit { 2.0 / rate2.sqrt() } else { f64::INFINITY };
        Rates { edge: step(self.edge), section: step(self.section), fastest: self.speed.sqrt() }
    }
}

fn fastest<const D: usize>(state: &YarnState<D>) -> Sums {
    state
        .velocity
        .par_chunks(CHUNK)
        .map(|velocity| {
            let mut sums = Sums::default();
            velocity.iter().for_each(|v| sums.moves(v));
            sums
        })
        .reduce(Sums::default, Sums::max)
}

/// Openness of the bend at inner vertex `i`.
fn openness<const D: usize>(model: &YarnModel<D>, state: &YarnState<D>, i: usize) -> f64 {
    let x = &state.position;
    match model.materials[model.material[i] as usize].bending {
        BendingLaw::Rod(b) => bend(&(x[i] - x[i - 1]), &(x[i + 1] - x[i]), b, 1.0).openness,
        _ => 1.0,
    }
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

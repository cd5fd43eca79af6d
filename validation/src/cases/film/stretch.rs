use constitutive::{FlowCurve, Liquid};
use surface_flow::{FilmSettings, FilmState, film_area};

use super::strand::{Strand, solver};
use crate::case::{Case, CaseError, Curve, Outcome, Param, Params};

pub const CASE: Case = Case {
    id: "film/stretch",
    about: "Axial stress of a film in steady stretching: mu c = sqrt 2 (sigma_Y + eta (sqrt 2 rate)^n), for a Newtonian film \
            2 eta rate, from the reduced strain equation.",
    params: &[
        Param::number("yield_stress", 0.0, "Pa", "uniaxial yield stress of the model"),
        Param::number("consistency", 1.0, "Pa s^n", "consistency of the model"),
        Param::number("index", 1.0, "1", "flow index"),
        Param::number("mu", 100.0, "Pa", "shear modulus"),
        Param::number("rate", 1.0, "1/s", "rate of stretching"),
        Param::number("step", 0.0, "s", "time step; 0: 1/2000 of strain"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let (tau, eta, n) =
        (p.number_in("yield_stress", 0.0, 1e6)?, p.positive("consistency")?, p.number_in("index", 0.05, 5.0)?);
    let (mu, rate) = (p.positive("mu")?, p.number("rate")?);
    let step = p.number_in("step", 0.0, 1e3)?;
    let dt = if step > 0.0 { step } else { 5e-4 / rate.abs() };
    if rate == 0.0 || rate.abs() * dt > 0.1 {
        return Err(p.reject("rate", "not 0, and at most a tenth of strain a step"));
    }
    let flow = FlowCurve::J2 { yield_stress: tau, consistency: eta, index: n };
    let cream = Liquid::preset("shaving-cream").map_err(CaseError::failed)?;
    let liquid = Liquid { flow, shear_modulus: mu, ..cream };
    let mut film = solver(&liquid, FilmSettings::default())?;
    let strand = Strand::new(5, 1e-4, |_| 1e-3);
    let mut state = FilmState::new(&[5]);
    state.area.fill(film_area(1e-4, 2e-4));
    for j in 0..4 {
        state.velocity[j] = rate * (j as f64 + 0.5) * 1e-3;
    }
    let expected =
        2f64.sqrt() * ((2.0f64 / 3.0).sqrt() * tau + eta * (2f64.sqrt() * rate.abs()).powf(n)) * rate.signum();
    // elastic build-up to the steady strain, then the memory of the flow, several times over
    let theta = (expected.abs() / (2.0 * mu)).asinh();
    let excess = eta * (2f64.sqrt() * rate.abs()).powf(n);
    let strain = 4.0 * theta + 4.0 * n * excess / (mu * theta.cosh()) + 1e-3;
    let steps = ((strain / (rate.abs() * dt)).ceil() as usize).clamp(100, 200_000);
    let stress = |state: &FilmState| mu * 2.0 * state.log_strain[2].sinh();
    let mut course = vec![[0.0, 0.0]];
    for k in 1..=steps {
        film.relax(&mut state, strand.view(), dt).map_err(CaseError::failed)?;
        if k % (steps / 100).max(1) == 0 {
            course.push([k as f64 * dt, stress(&state)]);
        }
    }
    let mut out = Outcome::new();
    out.compare("axial_stress", stress(&state), expected, 1e-2);
    if n == 1.0 && tau == 0.0 {
        out.compare("newtonian", stress(&state), 2.0 * eta * rate, 1e-2);
    }
    out.info("steps", steps as f64);
    out.curve(Curve {
        title: "Start-up of stretching".to_owned(),
        x_label: "time [s]".to_owned(),
        y_label: "axial stress [Pa]".to_owned(),
        log_x: false,
        log_y: false,
        series: vec![("film".to_owned(), course)],
    });
    Ok(out)
}

use constitutive::Liquid;
use surface_flow::{FilmSettings, FilmState, film_area};

use super::strand::{Strand, solver};
use crate::case::{Case, CaseError, Outcome, Param, Params};

pub const CASE: Case = Case {
    id: "film/strain",
    about: "Elastic strain of a film stretched at a constant rate: c = 2 sinh(asinh(c0/2) + 2 rate t), whatever the steps and \
            the spacing.",
    params: &[
        Param::number("c0", 0.4, "1", "reduced strain at the start"),
        Param::number("rate", 3.0, "1/s", "rate of stretching"),
        Param::number("time", 0.25, "s", "time"),
        Param::count("steps", 50, "steps"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let (c0, rate, time) = (p.number_in("c0", -1e3, 1e3)?, p.number("rate")?, p.positive("time")?);
    let steps = p.count_in("steps", 1, 1_000_000)?;
    if (rate * time).abs() > 50.0 {
        return Err(p.reject("rate", "a strain rate*time of at most 50"));
    }
    let strand = Strand::new(12, 1e-4, |j| 1e-3 * (1.0 + 0.5 * (j as f64 * 1.9).sin()));
    let mut state = FilmState::new(&[12]);
    state.area.fill(film_area(1e-4, 2e-4));
    state.log_strain.fill((0.5 * c0).asinh());
    // a linear velocity, given at the middles of the edges
    let mut x = 0.0;
    for (j, length) in strand.edge_length().iter().enumerate() {
        state.velocity[j] = rate * (x + 0.5 * length);
        x += length;
    }
    let settings = FilmSettings { plasticity: false, ..FilmSettings::default() };
    let cream = Liquid::preset("shaving-cream").map_err(CaseError::failed)?;
    let mut film = solver(&cream, settings)?;
    for _ in 0..steps {
        film.relax(&mut state, strand.view(), time / steps as f64).map_err(CaseError::failed)?;
    }
    let expected = (0.5 * c0).asinh() + 2.0 * rate * time;
    let worst = state.log_strain[1..11].iter().map(|t| (t - expected).abs()).fold(0.0, f64::max);
    let mut out = Outcome::new();
    let tolerance = 1e-12f64.max(1e-15 * steps as f64);
    out.compare("c", 2.0 * state.log_strain[5].sinh(), 2.0 * expected.sinh(), tolerance * (1.0 + expected.abs()));
    out.compare_absolute("log_strain_worst_error", worst, 0.0, tolerance * (1.0 + expected.abs()));
    Ok(out)
}

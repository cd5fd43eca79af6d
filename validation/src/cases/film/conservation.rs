use nalgebra::Vector3;
use surface_flow::{Advection, End, FilmSettings, FilmState, film_area};

use super::strand::{Strand, preset, solver};
use crate::case::{Case, CaseError, Outcome, Param, Params};

pub const CASE: Case = Case {
    id: "film/conservation",
    about: "A film with dry beds runs down a strand into the reservoir of its tip: volume of film and reservoirs is constant, \
            no cross-section turns negative.",
    params: &[
        Param::text("material", "water", "preset name"),
        Param::number("time", 10.0, "s", "time"),
        Param::number("step", 1e-3, "s", "time step"),
        Param::count("vertices", 60, "vertices"),
        Param::text("advection", "conservative", "conservative or semi-lagrangian"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let liquid = preset(p)?;
    let (time, dt) = (p.positive("time")?, p.positive("step")?);
    let vertices = p.count_in("vertices", 2, 10_000)?;
    let advection = match p.text("advection")? {
        "conservative" => Advection::Conservative,
        "semi-lagrangian" => Advection::SemiLagrangian,
        _ => return Err(p.reject("advection", "conservative or semi-lagrangian")),
    };
    if time / dt > 1e7 {
        return Err(p.reject("step", "at most 1e7 steps"));
    }
    let mut film = solver(&liquid, FilmSettings { advection, ..FilmSettings::default() })?;
    let strand = Strand::new(vertices, 1e-4, |j| 5e-4 * (1.0 + 0.4 * (j as f64 * 1.1).sin()));
    let mut state = FilmState::new(&[vertices]);
    state.ends[0] = [End::Closed, End::Open];
    for i in 0..vertices {
        let bump = (i as f64 * 0.35).sin();
        state.area[i] = if bump > 0.1 { film_area(2e-4 * bump, 2e-4) } else { 0.0 };
    }
    let begin = state.total_volume(strand.edge_length());
    let (mut drift, mut least, mut fastest, mut out_flow) = (0.0f64, f64::INFINITY, 0.0f64, 0.0);
    for _ in 0..(time / dt).round() as usize {
        let gravity = Vector3::new(9.81, 0.0, 0.0);
        let report = film.advance(&mut state, strand.view(), gravity, dt).map_err(CaseError::failed)?;
        film.relax(&mut state, strand.view(), dt).map_err(CaseError::failed)?;
        drift = drift.max((state.total_volume(strand.edge_length()) / begin - 1.0).abs());
        least = state.area.iter().copied().fold(least, f64::min);
        fastest = fastest.max(report.max_speed);
        out_flow += report.outflow;
    }
    let mut out = Outcome::new();
    out.compare_absolute("volume_drift", drift, 0.0, 1e-12);
    out.measure("least_area", least, |a| a >= 0.0, "no cross-section negative");
    out.compare("outflow", out_flow, state.reservoir[0][1], 1e-12);
    out.compare("flow_back", state.reservoir[0][0], 0.0, 0.0);
    out.info("share_drained", state.reservoir[0][1] / begin);
    out.info("fastest", fastest);
    Ok(out)
}

use nalgebra::Vector3;
use surface_flow::{FilmSettings, FilmSolver, FilmState, WallLaw, film_area};

use super::strand::{Strand, preset, solver};
use crate::case::{Case, CaseError, Curve, Outcome, Param, Params};

pub const CASE: Case = Case {
    id: "film/incline",
    about: "Mean speed of a uniform film on an inclined strand against the plane Herschel-Bulkley film, and its exact stop \
            below the critical height.",
    params: &[
        Param::text("material", "drilling-mud", "preset name"),
        Param::number("height", 5e-4, "m", "height of the film"),
        Param::number("angle", 45.0, "deg", "slope of the strand"),
        Param::number("radius", 1e-4, "m", "radius of the strand"),
        Param::number("slip_length", 0.0, "m", "slip length"),
        Param::text("law", "lubrication", "wall law: lubrication or paper"),
        Param::number("gravity", 9.81, "m/s2", "acceleration of gravity"),
    ],
    run,
};

/// Steady speed of a film of the given height: accelerated and rubbed until it changes no more.
fn steady_speed(film: &mut FilmSolver, height: f64, radius: f64, pull: f64, time_scale: f64) -> Result<f64, CaseError> {
    let strand = Strand::new(4, radius, |_| 1e-3);
    let mut state = FilmState::new(&[4]);
    state.area.fill(film_area(height, 2.0 * radius));
    let gravity = Vector3::new(pull, 0.0, 0.0);
    let mut last = f64::NAN;
    // implicit in the friction: any step converges to the same speed
    for _ in 0..20_000 {
        film.accelerate(&mut state, strand.view(), gravity, time_scale).map_err(CaseError::failed)?;
        film.rub(&mut state, strand.view(), time_scale).map_err(CaseError::failed)?;
        let now = state.velocity[1];
        if (now - last).abs() <= 1e-14 * now.abs() {
            break;
        }
        last = now;
    }
    Ok(state.velocity[1])
}

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let liquid = preset(p)?;
    let (height, radius, slip) = (p.positive("height")?, p.positive("radius")?, p.number_in("slip_length", 0.0, 1.0)?);
    let pull = p.positive("gravity")? * p.number_in("angle", 0.1, 90.0)?.to_radians().sin();
    let wall = match p.text("law")? {
        "lubrication" => WallLaw::Lubrication,
        "paper" => WallLaw::Paper,
        _ => return Err(p.reject("law", "lubrication or paper")),
    };
    let mut film = solver(&liquid, FilmSettings { wall, slip_length: slip, ..FilmSettings::default() })?;
    let rho = liquid.density;
    // reference: closed forms with plain powers
    let (speed_of, critical): (Box<dyn Fn(f64) -> f64>, f64) = match wall {
        WallLaw::Lubrication => {
            let (tau, k, n) = liquid.flow.rheometer();
            let critical = tau / (rho * pull);
            let speed = move |h: f64| {
                let sheared = h - critical;
                if sheared <= 0.0 {
                    return 0.0;
                }
                let surface = n / (n + 1.0) * (rho * pull / k).powf(1.0 / n) * sheared.powf(1.0 + 1.0 / n);
                surface * (1.0 - n / (2.0 * n + 1.0) * sheared / h) + slip * ((rho * pull * sheared) / k).powf(1.0 / n)
            };
            (Box::new(speed), critical)
        }
        WallLaw::Paper => {
            let (tau, k, n) = liquid.flow.boundary();
            let critical = (3.0 * tau / (rho * pull) - 3.0 * slip).max(0.0);
            let speed = move |h: f64| {
                let drive = rho * pull * (slip + h / 3.0) - tau;
                if drive <= 0.0 { 0.0 } else { h * (drive / k).powf(1.0 / n) }
            };
            (Box::new(speed), critical)
        }
    };
    let scale = |h: f64| (10.0 * speed_of(h) / pull).clamp(1e-3, 1e3);
    let expected = speed_of(height);
    let mut out = Outcome::new();
    let measured = steady_speed(&mut film, height, radius, pull, scale(height))?;
    if expected == 0.0 {
        out.compare("mean_speed", measured, 0.0, 0.0);
    } else {
        out.compare("mean_speed", measured, expected, 1e-3);
    }
    out.info("critical_height", critical);
    if critical > 0.0 {
        let below = steady_speed(&mut film, 0.999 * critical, radius, pull, 1.0)?;
        out.compare("speed_below_critical", below, 0.0, 0.0);
        let above = steady_speed(&mut film, 1.02 * critical, radius, pull, scale(1.02 * critical))?;
        let reference = speed_of(1.02 * critical);
        if reference > 1e-250 {
            out.compare("speed_above_critical", above, reference, 1e-3);
        }
    }
    let top = 3.0 * height.max(critical);
    let mut series = Vec::new();
    for i in 1..=40 {
        let h = top * f64::from(i) / 40.0;
        series.push([h, speed_of(h)]);
    }
    out.curve(Curve {
        title: format!("Film of {} on a slope", p.text("material")?),
        x_label: "height [m]".to_owned(),
        y_label: "mean speed [m/s]".to_owned(),
        log_x: false,
        log_y: false,
        series: vec![("reference".to_owned(), series), ("measured".to_owned(), vec![[height, measured]])],
    });
    Ok(out)
}

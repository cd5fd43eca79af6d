use nalgebra::Vector3;
use surface_flow::inertia::{InertiaForm, impulses};
use surface_flow::{FilmSettings, FilmState, film_area};

use super::strand::{Strand, preset, solver};
use crate::case::{Case, CaseError, Outcome, Param, Params};

pub const CASE: Case = Case {
    id: "film/inertia",
    about: "Impulse of film moving along a moving strand: none in uniform motion, none in sum over a closed strand; momentum \
            carried across edges and inertia of the film agree to round-off; both tend to -dt m u du_s/dx.",
    params: &[
        Param::text("material", "shaving-cream", "preset name"),
        Param::count("vertices", 60, "vertices"),
        Param::number("speed", 0.2, "m/s", "scale of the film's speed"),
        Param::number("step", 1e-4, "s", "time step"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let liquid = preset(p)?;
    let vertices = p.count_in("vertices", 8, 100_000)?;
    let (speed, dt) = (p.number("speed")?, p.positive("step")?);
    let rho = liquid.density;
    let mut film = solver(&liquid, FilmSettings::default())?;
    let mut out = Outcome::new();
    // uneven strand, uneven film
    let strand = Strand::new(vertices, 1e-4, |j| 1e-3 * (1.0 + 0.3 * (j as f64 * 1.7).sin()));
    let mut before = FilmState::new(&[vertices]);
    for i in 0..vertices {
        before.area[i] = film_area(1e-4 * (1.2 + (0.4 * i as f64).sin()), 2e-4);
    }
    for j in 0..vertices - 1 {
        before.velocity[j] = speed * (0.8 * j as f64).cos();
    }
    let mut after = before.clone();
    film.advect(&mut after, strand.view(), dt).map_err(CaseError::failed)?;
    let crossed = film.crossed_volume().to_vec();
    let impulse = |form, motion: &[Vector3<f64>]| {
        let mut out = vec![Vector3::zeros(); motion.len()];
        impulses(form, &before, strand.view(), &crossed, motion, &[rho], dt, &mut out)
            .map(|()| out)
            .map_err(CaseError::failed)
    };
    let motion: Vec<Vector3<f64>> = (0..vertices)
        .map(|i| Vector3::new((0.2 * i as f64).sin(), 1.0 + 0.02 * i as f64, (0.13 * i as f64).cos()))
        .collect();
    let scale = rho * before.total_volume(strand.edge_length());
    let length = |i: usize| {
        let e = strand.edge_length();
        0.5 * (if i > 0 { e[i - 1] } else { 0.0 } + e.get(i).copied().unwrap_or(0.0))
    };
    let (advective, flux) = (impulse(InertiaForm::Advective, &motion)?, impulse(InertiaForm::Flux, &motion)?);
    let difference = (0..vertices)
        .map(|i| {
            let (new, old) = (rho * after.area[i] * length(i), rho * before.area[i] * length(i));
            (new * motion[i] + advective[i] - old * motion[i] - flux[i]).norm()
        })
        .fold(0.0, f64::max);
    out.compare_absolute("transfer_minus_inertia", difference / (scale / vertices as f64), 0.0, 1e-12);
    let sum: Vector3<f64> = flux.iter().sum();
    out.compare_absolute("flux_sum", sum.norm() / scale, 0.0, 1e-13);
    let uniform = vec![Vector3::new(0.7, -1.0, 2.0); vertices];
    for (name, form) in [("advective", InertiaForm::Advective), ("semi_lagrangian", InertiaForm::SemiLagrangian)] {
        let worst = impulse(form, &uniform)?.iter().map(Vector3::norm).fold(0.0, f64::max);
        out.compare_absolute(&format!("uniform_{name}"), worst / (scale / vertices as f64), 0.0, 1e-13);
    }
    // convergence to −dt m u ∂u_s/∂x for a smooth film and a smooth motion, on finer and finer strands
    let error = |n: usize, form: InertiaForm| -> Result<f64, CaseError> {
        let (total, step) = (0.06, 1e-4 * 60.0 / n as f64);
        let dx = total / (n - 1) as f64;
        let strand = Strand::new(n, 1e-4, |_| dx);
        let mut state = FilmState::new(&[n]);
        let (k, u0) = (std::f64::consts::TAU / total, 0.2);
        state.area.iter_mut().enumerate().for_each(|(i, a)| {
            *a = film_area(1e-4 * (1.5 + (k * i as f64 * dx).sin()), 2e-4);
        });
        state.velocity.iter_mut().enumerate().for_each(|(j, u)| *u = u0 * (2.0 + (k * (j as f64 + 0.5) * dx).cos()));
        let motion: Vec<Vector3<f64>> = (0..n).map(|i| Vector3::y() * (2.0 * k * i as f64 * dx).sin()).collect();
        let old = state.clone();
        let cream = preset(p)?;
        let mut film = solver(&cream, FilmSettings::default())?;
        film.advect(&mut state, strand.view(), step).map_err(CaseError::failed)?;
        let mut out = vec![Vector3::zeros(); n];
        impulses(form, &old, strand.view(), film.crossed_volume(), &motion, &[rho], step, &mut out)
            .map_err(CaseError::failed)?;
        let mut worst = 0.0f64;
        let unit = rho * film_area(1e-4, 2e-4) * dx * step * u0 * k;
        for i in n / 10..n - n / 10 {
            let x = i as f64 * dx;
            let mass = rho * old.area[i] * dx;
            let exact = -step * mass * u0 * (2.0 + (k * x).cos()) * 2.0 * k * (2.0 * k * x).cos();
            worst = worst.max((out[i].y - exact).abs() / unit);
        }
        Ok(worst)
    };
    for (name, form) in [("advective", InertiaForm::Advective), ("semi_lagrangian", InertiaForm::SemiLagrangian)] {
        let errors = [error(60, form)?, error(120, form)?, error(240, form)?];
        let order = (errors[1] / errors[2]).log2();
        out.measure(&format!("order_{name}"), order, |o| o > 0.8, "tends to the equation at first order or better");
        out.info(&format!("error_{name}_240"), errors[2]);
    }
    Ok(out)
}

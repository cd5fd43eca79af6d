use constitutive::{FlowCurve, Liquid};
use nalgebra::Vector3;
use surface_flow::{End, FilmSettings, FilmSolver, FilmState, film_area, film_height};

use super::strand::{Strand, solver};
use crate::case::{Case, CaseError, Curve, Outcome, Param, Params, Table};

pub const CASE: Case = Case {
    id: "film/drain",
    about: "Draining water film on a vertical strand: speed of the uniform film, of a small wave on it, and of the shock into \
            a thinner film, against the kinematic wave theory.",
    params: &[
        Param::number("radius", 1e-4, "m", "radius of the strand"),
        Param::number("height", 4e-5, "m", "height of the film"),
        Param::number("ahead", 0.2, "1", "cross-section ahead of the shock over the film's"),
        Param::number("viscosity", 8.9e-4, "Pa s", "viscosity"),
        Param::number("slip_length", 2e-6, "m", "slip length"),
        Param::count("edges", 400, "edges of the finest of three strands"),
        Param::number("gravity", 9.81, "m/s2", "acceleration of gravity"),
    ],
    run,
};

/// The experiment.
struct Drain {
    radius: f64,
    gravity: f64,
    /// Cross-section of the film and speed, wave speed, as functions of the cross-section.
    area: f64,
    rho: f64,
    eta: f64,
    slip: f64,
}

impl Drain {
    fn speed(&self, area: f64) -> f64 {
        let h = film_height(area, 2.0 * self.radius);
        self.rho * self.gravity * h * (self.slip + h / 3.0) / self.eta
    }

    fn wave_speed(&self) -> f64 {
        let e = 1e-5 * self.area;
        let flux = |a: f64| a * self.speed(a);
        (flux(self.area + e) - flux(self.area - e)) / (2.0 * e)
    }

    /// Runs a profile of cross-sections `start(x/length)` for `time` on `edges` edges; returns the state and the spacing.
    fn run(
        &self,
        film: &mut FilmSolver,
        edges: usize,
        length: f64,
        time: f64,
        start: impl Fn(f64) -> f64,
    ) -> Result<(FilmState, f64), CaseError> {
        let dx = length / edges as f64;
        let strand = Strand::new(edges + 1, self.radius, |_| dx);
        let mut state = FilmState::new(&[edges + 1]);
        state.ends[0] = [End::Closed, End::Open];
        for i in 0..=edges {
            state.area[i] = start(i as f64 / edges as f64);
        }
        for j in 0..edges {
            state.velocity[j] = self.speed(0.5 * (state.area[j] + state.area[j + 1]));
        }
        let steps = ((time * self.wave_speed() / (0.4 * dx)).ceil() as usize).max(10);
        for _ in 0..steps {
            let gravity = Vector3::new(self.gravity, 0.0, 0.0);
            film.advance(&mut state, strand.view(), gravity, time / steps as f64).map_err(CaseError::failed)?;
        }
        Ok((state, dx))
    }
}

/// Travel of the waves in lengths of inertial adaptation.
const INERTIA_LENGTHS: f64 = 600.0;

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let radius = p.positive("radius")?;
    let height = p.positive("height")?;
    let ahead = p.number_in("ahead", 0.01, 0.99)?;
    let edges = p.count_in("edges", 64, 20_000)?;
    let (eta, slip) = (p.positive("viscosity")?, p.number_in("slip_length", 0.0, 1e-3)?);
    let water = Liquid::preset("water").map_err(CaseError::failed)?;
    let liquid = Liquid { flow: FlowCurve::newtonian(eta), ..water };
    let case = Drain {
        radius,
        gravity: p.positive("gravity")?,
        area: film_area(height, 2.0 * radius),
        rho: liquid.density,
        eta,
        slip,
    };
    let settings = FilmSettings { slip_length: slip, ..FilmSettings::default() };
    let mut film = solver(&liquid, settings)?;
    let mut out = Outcome::new();
    let area = case.area;
    let (u, wave) = (case.speed(area), case.wave_speed());
    let relax = case.rho * height * (slip + height / 3.0) / eta;
    // 1. uniform film: from rest to the steady speed
    let strand = Strand::new(3, radius, |_| 1e-3);
    let mut state = FilmState::new(&[3]);
    state.area.fill(area);
    for _ in 0..400 {
        let gravity = Vector3::new(case.gravity, 0.0, 0.0);
        film.accelerate(&mut state, strand.view(), gravity, relax).map_err(CaseError::failed)?;
        film.rub(&mut state, strand.view(), relax).map_err(CaseError::failed)?;
    }
    out.compare("speed", state.velocity[0], u, 1e-9);
    // 2. a very small wave: its centroid travels at d(uA)/dA. Length and time in terms of the wave's travel, far
    //    enough from the root that the film draining away there is not met
    //    enough from the root that the film draining away there is not met. The theory neglects the film's inertia: cells
    //    must be longer than the way a wave gains on the film while its speed adapts, or roll waves (which the film does
    //    have) grow out of the shock
    let travel = (40.0 * height.max(radius)).max(INERTIA_LENGTHS * (wave - u) * relax);
    let (length, time) = (8.0 * travel, travel / wave);
    let bump = |s: f64| area * (1.0 + 1e-4 * (-((s - 0.45) / 0.04f64).powi(2)).exp());
    let centroid = |state: &FilmState| {
        let count = state.area.len();
        let (mut mass, mut moment) = (0.0, 0.0);
        for i in 0..count {
            let s = i as f64 / (count - 1) as f64;
            // within the window where nothing but the wave disturbs the film
            if (0.25..0.9).contains(&s) {
                let excess = state.area[i] - area;
                mass += excess;
                moment += excess * s;
            }
        }
        moment / mass * length
    };
    let wave_speed = |film: &mut FilmSolver, edges: usize| -> Result<f64, CaseError> {
        let (state, _) = case.run(film, edges, length, time, bump)?;
        Ok((centroid(&state) - 0.45 * length) / time)
    };
    // 3. a shock into a thinner film: where the cross-section passes the mean of both sides, between half time and the end
    let thin = ahead * area;
    let shock = (u * area - case.speed(thin) * thin) / (area - thin);
    let step = |s: f64| if s < 0.55 { area } else { thin };
    let front = |state: &FilmState, dx: f64| {
        let (count, level) = (state.area.len(), 0.5 * (area + thin));
        let i = (count / 3..count - 1).find(|i| state.area[i + 1] < level && state.area[*i] >= level).unwrap_or(0);
        (i as f64 + (state.area[i] - level) / (state.area[i] - state.area[i + 1])) * dx
    };
    let shock_speed = |film: &mut FilmSolver, edges: usize| -> Result<(f64, FilmState), CaseError> {
        let (half, dx) = case.run(film, edges, length, 0.5 * time, step)?;
        let (whole, _) = case.run(film, edges, length, time, step)?;
        Ok(((front(&whole, dx) - front(&half, dx)) / (0.5 * time), whole))
    };
    let mut rows = Vec::new();
    let mut errors = Vec::new();
    let mut profile = Vec::new();
    for k in [4, 2, 1] {
        let n = edges / k;
        let w = wave_speed(&mut film, n)?;
        let (s, state) = shock_speed(&mut film, n)?;
        errors.push([(w / wave - 1.0).abs(), (s / shock - 1.0).abs()]);
        rows.push(vec![n.to_string(), format!("{w:.6e}"), format!("{s:.6e}")]);
        if k == 1 {
            out.compare("wave_speed", w, wave, 2e-2);
            out.compare("shock_speed", s, shock, 2e-2);
            profile = (0..=n).map(|i| [i as f64 / n as f64 * length, state.area[i] / area]).collect();
        }
    }
    out.info("wave_error_coarsest", errors[0][0]);
    out.info("shock_error_coarsest", errors[0][1]);
    out.table(Table {
        title: format!("Speeds over resolution; theory {wave:.6e}, {shock:.6e} m/s"),
        columns: ["edges", "wave [m/s]", "shock [m/s]"].map(String::from).to_vec(),
        rows,
    });
    out.curve(Curve {
        title: "Shock into a thinner film".to_owned(),
        x_label: "x [m]".to_owned(),
        y_label: "A/A0".to_owned(),
        log_x: false,
        log_y: false,
        series: vec![("film".to_owned(), profile)],
    });
    Ok(out)
}

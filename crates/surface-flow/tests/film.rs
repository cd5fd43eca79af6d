//! Properties of whole film steps.

use constitutive::Liquid;
use nalgebra::Vector3;
use proptest::prelude::*;
use surface_flow::inertia::{InertiaForm, impulses};
use surface_flow::{Advection, End, FilmLiquid, FilmSettings, FilmSolver, FilmState, StrandSlices, WallLaw, film_area};

/// Strands of the same shape, straight along x.
struct Strands {
    edge_length: Vec<f64>,
    tangent: Vec<Vector3<f64>>,
    semi_axes: Vec<[f64; 2]>,
    acceleration: Vec<Vector3<f64>>,
}

impl Strands {
    fn new(counts: &[usize], length: impl Fn(usize) -> f64) -> Self {
        let vertices: usize = counts.iter().sum();
        let edges = vertices - counts.len();
        Strands {
            edge_length: (0..edges).map(length).collect(),
            tangent: vec![Vector3::x(); edges],
            semi_axes: vec![[1e-4, 1e-4]; vertices],
            acceleration: vec![Vector3::zeros(); vertices],
        }
    }

    fn view(&self) -> StrandSlices<'_> {
        StrandSlices {
            edge_length: &self.edge_length,
            tangent: &self.tangent,
            semi_axes: &self.semi_axes,
            acceleration: &self.acceleration,
        }
    }
}

fn solver(material: &str, settings: FilmSettings) -> FilmSolver {
    FilmSolver::new(FilmLiquid::new(&Liquid::preset(material).unwrap()).unwrap(), settings).unwrap()
}

/// A film of bumps and dry beds with scattered speeds.
fn bumpy(counts: &[usize], seed: f64) -> FilmState {
    let mut state = FilmState::new(counts);
    for (i, a) in state.area.iter_mut().enumerate() {
        let x = (i as f64 * 0.37 + seed).sin();
        *a = if x > 0.2 { film_area(2e-4 * x, 2e-4) } else { 0.0 };
    }
    for (j, u) in state.velocity.iter_mut().enumerate() {
        *u = 0.3 * (j as f64 * 1.7 + 3.0 * seed).sin();
    }
    for (i, t) in state.log_strain.iter_mut().enumerate() {
        *t = 0.05 * (i as f64 * 0.9).cos();
    }
    state
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn advection_keeps_volume_and_momentum_and_stays_positive(seed in 0.0f64..100.0, open in any::<bool>(), stretch in 0.0f64..0.9) {
        let counts = [41, 2, 1, 20];
        let strands = Strands::new(&counts, |j| 1e-3 * (1.0 + stretch * (j as f64 * 2.3).sin()));
        let mut state = bumpy(&counts, seed);
        if open {
            state.ends.fill([End::Open, End::Open]);
        }
        let mut solver = solver("shaving-cream", FilmSettings::default());
        let volume = state.total_volume(&strands.edge_length);
        let momentum = |s: &FilmState| (0..4).map(|k| s.momentum(k, &strands.edge_length, 200.0)).sum::<f64>();
        let scale = 200.0 * volume * 0.3;
        for _ in 0..20 {
            // speeds of edges between dry vertices are no momentum; they are cleared by the step
            let before = momentum(&state);
            let report = solver.advect(&mut state, strands.view(), 2e-3).unwrap();
            state.check().unwrap();
            prop_assert!((momentum(&state) + report.outflow_momentum - before).abs() < 1e-4 * scale);
            prop_assert!(report.max_speed <= 0.3 * (1.0 + 1e-12));
        }
        prop_assert!((state.total_volume(&strands.edge_length) / volume - 1.0).abs() < 1e-13);
    }

    #[test]
    fn a_whole_step_stays_finite_and_conserves_for_every_material(seed in 0.0f64..100.0, material in 0usize..11, ln_dt in -9.0f64..-1.0,
                                                                  paper in any::<bool>(), semi in any::<bool>()) {
        let counts = [25, 7];
        let strands = Strands::new(&counts, |_| 2e-3);
        let mut state = bumpy(&counts, seed);
        let settings = FilmSettings {
            wall: if paper { WallLaw::Paper } else { WallLaw::Lubrication },
            advection: if semi { Advection::SemiLagrangian } else { Advection::Conservative },
            ..FilmSettings::default()
        };
        let mut solver = solver(constitutive::presets::LIQUID_NAMES[material], settings);
        let volume = state.total_volume(&strands.edge_length);
        for _ in 0..30 {
            solver.advance(&mut state, strands.view(), Vector3::new(9.81, 0.0, 0.0), ln_dt.exp()).unwrap();
            solver.relax(&mut state, strands.view(), ln_dt.exp()).unwrap();
            state.check().unwrap();
        }
        prop_assert!((state.total_volume(&strands.edge_length) / volume - 1.0).abs() < 1e-12);
    }
}

#[test]
fn momentum_of_a_wet_film_is_kept_to_round_off() {
    let counts = [80];
    let strands = Strands::new(&counts, |j| 1e-3 * (1.0 + 0.4 * (j as f64).sin()));
    let mut state = FilmState::new(&counts);
    for i in 0..80 {
        state.area[i] = film_area(1e-4 * (1.5 + (0.3 * i as f64).sin()), 2e-4);
    }
    for j in 0..79 {
        state.velocity[j] = 0.01 * (0.5 * j as f64).cos();
    }
    let mut solver = solver("water", FilmSettings::default());
    let scale: f64 = 1000.0 * state.total_volume(&strands.edge_length) * 0.01;
    for step in 0..200 {
        let before = state.momentum(0, &strands.edge_length, 1000.0);
        solver.advect(&mut state, strands.view(), 1e-3).unwrap();
        let change = state.momentum(0, &strands.edge_length, 1000.0) - before;
        assert!(change.abs() < 1e-14 * scale, "step {step}: {} of {scale}", change / scale);
    }
}

#[test]
fn uniform_flow_of_a_uniform_film_stays_uniform_inside() {
    let counts = [60];
    let strands = Strands::new(&counts, |j| 1e-3 * (1.0 + 0.5 * (j as f64 * 1.3).sin()));
    let mut state = FilmState::new(&counts);
    state.area.fill(film_area(1e-4, 2e-4));
    state.velocity.fill(0.1);
    state.log_strain.fill(0.02);
    solver("mayonnaise", FilmSettings::default()).advect(&mut state, strands.view(), 1e-3).unwrap();
    for i in 5..50 {
        assert!((state.area[i] / film_area(1e-4, 2e-4) - 1.0).abs() < 1e-13);
        assert!((state.velocity[i] - 0.1).abs() < 1e-14 && (state.log_strain[i] - 0.02).abs() < 1e-15);
    }
}

#[test]
fn the_result_does_not_depend_on_the_number_of_threads() {
    let counts: Vec<usize> = (0..60).map(|s| 20 + (s * 7) % 90).collect();
    let strands = Strands::new(&counts, |_| 1e-3);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut state = bumpy(&counts, 1.0);
            state.ends.fill([End::Closed, End::Open]);
            let mut solver = solver("drilling-mud", FilmSettings::default());
            let mut reports = Vec::new();
            for _ in 0..10 {
                reports.push(solver.advance(&mut state, strands.view(), Vector3::new(5.0, 0.0, 0.0), 1e-3).unwrap());
                solver.relax(&mut state, strands.view(), 1e-3).unwrap();
            }
            (state, reports)
        })
    };
    let one = run(1);
    assert_eq!(one, run(2));
    assert_eq!(one, run(4));
}

#[test]
fn elastic_waves_far_beyond_the_explicit_limit_do_not_grow() {
    // shear waves of the cream run at 2√(μ/ρ) = 2.4 m/s: eight edges a step
    let counts = [50];
    let strands = Strands::new(&counts, |_| 3e-4);
    let mut state = FilmState::new(&counts);
    state.area.fill(film_area(2e-4, 2e-4));
    for (i, t) in state.log_strain.iter_mut().enumerate() {
        *t = 0.02 * (i as f64 * 2.9).sin();
    }
    let settings = FilmSettings { plasticity: false, steepness: None, slip_length: 1e3, ..FilmSettings::default() };
    let mut solver = solver("shaving-cream", settings);
    let energy = |s: &FilmState| {
        let elastic: f64 =
            s.area.iter().zip(&s.log_strain).map(|(a, t)| a * 290.0 * 2.0 * (t.cosh() - 1.0) * 3e-4).sum();
        let kinetic: f64 = s.velocity.iter().map(|u| 0.5 * 200.0 * s.area[0] * 3e-4 * u * u).sum();
        elastic + kinetic
    };
    let begin = energy(&state);
    for _ in 0..200 {
        solver.advance(&mut state, strands.view(), Vector3::zeros(), 1e-3).unwrap();
        solver.relax(&mut state, strands.view(), 1e-3).unwrap();
        assert!(energy(&state) <= 1.01 * begin);
    }
}

#[test]
fn a_yield_stress_film_starts_without_chatter_when_its_load_grows() {
    // load raised slowly through the threshold: exactly still below it, then faster at every step
    for wall in [WallLaw::Lubrication, WallLaw::Paper] {
        let strands = Strands::new(&[4], |_| 1e-3);
        let mut state = FilmState::new(&[4]);
        state.area.fill(film_area(5e-4, 2e-4));
        let mut solver = solver("drilling-mud", FilmSettings { wall, ..FilmSettings::default() });
        let threshold = solver.wall().yield_stress(5e-4) / (1220.0 * 5e-4);
        let mut last = 0.0;
        for k in 0..400 {
            let pull = threshold * (0.9 + 0.2 * f64::from(k) / 400.0);
            solver.accelerate(&mut state, strands.view(), Vector3::new(pull, 0.0, 0.0), 1e-3).unwrap();
            solver.rub(&mut state, strands.view(), 1e-3).unwrap();
            let now = state.velocity[1];
            assert!(if pull < threshold { now == 0.0 } else { now >= last }, "{wall:?} {k}: {now} after {last}");
            last = now;
        }
        assert!(last > 0.0);
    }
}

#[test]
fn a_vanishing_film_is_held_by_the_strand() {
    let strands = Strands::new(&[6], |_| 1e-3);
    for height in [1e-6, 1e-9, 1e-12, 1e-18, 0.0] {
        let mut state = FilmState::new(&[6]);
        state.area.fill(film_area(height, 2e-4));
        state.velocity.fill(0.5);
        let mut solver = solver("water", FilmSettings::default());
        for _ in 0..50 {
            solver.advance(&mut state, strands.view(), Vector3::new(9.81, 0.0, 0.0), 1e-3).unwrap();
            solver.relax(&mut state, strands.view(), 1e-3).unwrap();
        }
        // the first step may heap the film up somewhere; nothing moves faster than the highest heap would
        let highest = state.area.iter().map(|a| surface_flow::film_height(*a, 2e-4)).fold(0.0, f64::max);
        let bound = solver.wall().mean_speed(1000.0 * 9.81 * highest, highest) * 1.01;
        assert!(state.velocity.iter().all(|u| u.abs() <= bound), "{height}: {:?}", state.velocity);
    }
}

#[test]
fn a_front_stays_monotone_and_a_heap_at_a_closed_end_pulls_nothing() {
    let strands = Strands::new(&[201], |_| 5e-4);
    let mut state = FilmState::new(&[201]);
    let thin = film_area(5e-5, 2e-4);
    for i in 0..201 {
        state.area[i] = if i < 100 { 1.5 * thin } else { thin };
    }
    let mut solver = solver("water", FilmSettings::default());
    for _ in 0..400 {
        solver.advance(&mut state, strands.view(), Vector3::new(9.81, 0.0, 0.0), 2e-3).unwrap();
    }
    let front = (60..199).find(|i| state.area[*i] < 1.25 * thin).unwrap();
    assert!(front > 110, "the front has moved: {front}");
    // no overshoot behind it, nothing ahead of it, up to the heap in the last vertex
    assert!((80..front).all(|i| state.area[i] < 1.51 * thin));
    let ahead: Vec<(usize, f64)> =
        (front + 6..199).map(|i| (i, state.area[i] / thin - 1.0)).filter(|(_, e)| e.abs() > 1e-3).collect();
    assert!(ahead.is_empty(), "front {front}: {ahead:?}");
    assert!(state.area[200] > 5.0 * thin);
}

#[test]
fn both_forms_of_inertia_say_the_same() {
    let counts = [40, 17];
    let strands = Strands::new(&counts, |j| 1e-3 * (1.0 + 0.3 * (j as f64).cos()));
    let mut state = bumpy(&counts, 4.0);
    let mut solver = solver("shaving-cream", FilmSettings::default());
    let before = state.clone();
    solver.advect(&mut state, strands.view(), 1e-3).unwrap();
    let motion: Vec<Vector3<f64>> =
        (0..57).map(|i| Vector3::new((i as f64).sin(), 1.0 + 0.1 * i as f64, (0.3 * i as f64).cos())).collect();
    let run = |form, motion: &[Vector3<f64>]| {
        let mut out = vec![Vector3::zeros(); 57];
        let crossed = solver.crossed_volume();
        impulses(form, &before, strands.view(), crossed, motion, &[200.0], 1e-3, &mut out).unwrap();
        out
    };
    let (advective, flux) = (run(InertiaForm::Advective, &motion), run(InertiaForm::Flux, &motion));
    let length = |s: usize, i: usize| {
        let e = &strands.edge_length[before.edges(s)];
        0.5 * (if i > 0 { e[i - 1] } else { 0.0 } + e.get(i).copied().unwrap_or(0.0))
    };
    let scale = 200.0 * before.total_volume(&strands.edge_length);
    for s in 0..2 {
        for (i, v) in before.vertices(s).enumerate() {
            let mass = |state: &FilmState| 200.0 * state.area[v] * length(s, i);
            let difference = mass(&state) * motion[v] + advective[v] - (mass(&before) * motion[v] + flux[v]);
            assert!(difference.norm() < 1e-12 * scale);
        }
        let sum: Vector3<f64> = flux[before.vertices(s)].iter().sum();
        assert!(sum.norm() < 1e-13 * scale);
    }
    let uniform = vec![Vector3::new(0.3, -2.0, 1.0); 57];
    for form in [InertiaForm::Advective, InertiaForm::SemiLagrangian] {
        assert!(run(form, &uniform).iter().all(|i| i.norm() < 1e-15 * scale));
    }
}

#[test]
fn shapes_and_settings_are_checked() {
    let strands = Strands::new(&[5], |_| 1e-3);
    let mut state = FilmState::new(&[6]);
    let mut solver = solver("water", FilmSettings::default());
    let error = solver.advect(&mut state, strands.view(), 1e-3).unwrap_err().to_string();
    assert!(error.contains("edge length"), "{error}");
    let mut state = FilmState::new(&[5]);
    assert!(solver.advect(&mut state, strands.view(), -1.0).is_err());
    state.velocity[2] = f64::INFINITY;
    state.area.fill(1e-8);
    assert!(solver.advect(&mut state, strands.view(), 1e-3).unwrap_err().to_string().contains("strand 0"));
    let liquid = FilmLiquid::new(&Liquid::preset("water").unwrap()).unwrap();
    assert!(FilmSolver::new(liquid, FilmSettings { courant: 2.0, ..FilmSettings::default() }).is_err());
}

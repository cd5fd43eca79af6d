//! Whole runs: every experiment does what it prescribes, restarts bit for bit, and hard cases end in numbers or typed errors.

use granular::GranularError;
use granular::assembly::Plates;
use granular::cell::Boundary;
use granular::experiment::{
    Drive, Experiment, GateLevel, MicrogelSettings, Oscillation, Progress, Rheometer, Summary, Tone, run_ensemble,
};
use granular::frame::frame;
use granular::law::CentralLaw;
use granular::model::{Mode, ModelSettings};
use granular::physical::StepGuard;
use granular::preparation::{Cut, PreparationSettings};

/// A small, quickly prepared sample.
fn quick(experiment: Experiment) -> MicrogelSettings {
    MicrogelSettings {
        seed: 2,
        model: ModelSettings { grains: 60, ..ModelSettings::default() },
        preparation: PreparationSettings { cut: Cut::None, relaxation: 0.15, ..PreparationSettings::default() },
        experiment,
        step_factor: 2.0,
        ..MicrogelSettings::default()
    }
}

fn short() -> Oscillation {
    Oscillation { pre_periods: 0.5, periods: 1.0, post_periods: 0.4, ..Oscillation::default() }
}

fn finish(settings: &MicrogelSettings) -> (Rheometer, Summary) {
    let mut r = Rheometer::new(settings).unwrap();
    r.run(|row| assert!(row.columns().iter().all(|v| v.is_finite()))).unwrap();
    let s = r.summary().unwrap();
    (r, s)
}

#[test]
fn oscillation_restarts_bit_for_bit_in_both_modes() {
    for mode in [Mode::Physical, Mode::Compat] {
        let settings = MicrogelSettings { mode, ..quick(Experiment::Oscillation(short())) };
        let mut whole = Rheometer::new(&settings).unwrap();
        let mut saved = Vec::new();
        let mut rows = Vec::new();
        let mut steps = 0;
        loop {
            if steps == 100 || rows.len() == 900 {
                saved.push((rows.len(), serde_json::to_string(&whole).unwrap()));
            }
            steps += 1;
            match whole.advance().unwrap() {
                Progress::Finished => break,
                Progress::Recorded(row) => rows.push(row),
                Progress::Prepared => {}
            }
        }
        assert_eq!(saved.len(), 2);
        for (done, text) in saved {
            let mut again: Rheometer = serde_json::from_str(&text).unwrap();
            let mut tail = Vec::new();
            again.run(|row| tail.push(*row)).unwrap();
            assert_eq!(tail, rows[done..], "{mode:?} resumed at row {done}");
            assert_eq!(again.summary().unwrap(), whole.summary().unwrap());
        }
        let (taken, total) = whole.progress();
        assert_eq!(taken, total);
        assert!(rows.iter().all(|r| r.stress.identity_defect() < 1e-9));
    }
}

#[test]
fn physical_strain_lies_on_the_sine_and_several_tones_are_told_apart() {
    let tones = vec![Tone { amplitude: 0.01, relative_frequency: 0.1 }];
    let o = Oscillation { amplitude: 0.02, relative_frequency: 0.05, overtones: tones, periods: 2.0, ..short() };
    let (r, s) = finish(&quick(Experiment::Oscillation(o)));
    let segment = &r.segments()[0];
    let Drive::Oscillation { window, waves } = &segment.drive else { panic!("an oscillation") };
    let signal = &r.signals()[0];
    for i in (0..signal.time.len()).step_by(97) {
        let t = (signal.time[i] - window.pre / window.frequency).clamp(0.0, window.periods / window.frequency);
        let exact: f64 = waves.iter().map(|w| w.amplitude * (std::f64::consts::TAU * w.frequency * t).sin()).sum();
        assert!((signal.strain[i] - exact).abs() < 1e-3 * 0.03, "{i}");
    }
    // A linked body in its linear range: both tones see nearly the same modulus.
    let [a, b] = [&s.segments[0].moduli[0].bulk, &s.segments[0].moduli[1].bulk];
    assert!((a.g_prime / b.g_prime - 1.0).abs() < 0.25, "{} {}", a.g_prime, b.g_prime);
    assert_eq!(a.harmonics.len(), 2);
}

#[test]
fn sweeps_give_one_result_per_point() {
    let (_, s) = finish(&quick(Experiment::AmplitudeSweep { amplitudes: vec![0.05, 0.2], base: short() }));
    assert_eq!(s.segments.len(), 2);
    let [a, b] = [&s.segments[0].moduli[0], &s.segments[1].moduli[0]];
    assert_eq!((a.amplitude, b.amplitude), (0.05, 0.2));
    assert!(a.bulk.g_prime > 500.0 && (a.bulk.g_prime / b.bulk.g_prime - 1.0).abs() < 0.3);
    let (_, s) = finish(&quick(Experiment::FrequencySweep { relative_frequencies: vec![0.05, 0.1], base: short() }));
    assert!((s.segments[1].moduli[0].frequency / s.segments[0].moduli[0].frequency - 2.0).abs() < 1e-12);
}

#[test]
fn steady_shear_of_loose_grains_flows_and_start_up_peaks() {
    let mut settings = quick(Experiment::SteadyShear { relative_rate: 0.02, strain: 2.0 });
    settings.preparation.links = false;
    let (r, s) = finish(&settings);
    let flow = &s.segments[0];
    assert!((flow.strain / 2.0 - 1.0).abs() < 0.01 && flow.stress > 0.0, "{flow:?}");
    let tau = settings.model.constants().time;
    assert!((flow.rate * tau / 0.02 - 1.0).abs() < 1e-9);
    assert!(r.assembly().cell().strain > 1.9);
    settings.experiment = Experiment::StartUp { relative_rate: 0.02, strain: 1.0 };
    let (_, s) = finish(&settings);
    assert!(s.segments[0].peak[0] > s.segments[0].stress && s.segments[0].peak[1] < 1.0);
}

#[test]
fn step_strain_relaxes_towards_the_elastic_stress() {
    let (r, s) = finish(&quick(Experiment::StepStrain { strain: 0.05, rise: 2.0, hold: 60.0 }));
    let signal = &r.signals()[0];
    assert!((signal.strain.last().unwrap() - 0.05).abs() < 1e-9);
    let modulus = s.segments[0].stress / 0.05;
    assert!(modulus > 500.0 && modulus < 8000.0, "{modulus}");
    let peak = s.segments[0].peak[0];
    assert!(peak > s.segments[0].stress, "viscous and inertial overshoot");
}

#[test]
fn creep_holds_its_stress_and_an_elastic_body_recovers() {
    let (r, s) = finish(&quick(Experiment::Creep { stress: 100.0, duration: 200.0, recovery: 200.0 }));
    let held = &s.segments[0];
    assert!((held.stress / 100.0 - 1.0).abs() < 0.1, "{held:?}");
    // The sample has a residual stress of its own, so it recovers towards the strain that frees it of that; the difference of
    // the two strains is the elastic compliance.
    let recovered = *r.signals()[1].strain.last().unwrap();
    let modulus = 100.0 / (held.strain - recovered);
    assert!(modulus > 800.0 && modulus < 4000.0, "{modulus}");
    assert!(s.segments[1].stress.abs() < 10.0, "{:?}", s.segments[1]);
}

#[test]
fn compression_raises_the_normal_stress() {
    let mut settings = quick(Experiment::Compression { strain: 0.1, relative_rate: 0.002, hold: 20.0 });
    let (r, s) = finish(&settings);
    let signal = &r.signals()[0];
    assert!((signal.compression.last().unwrap() - 0.1).abs() < 1e-3, "{:?}", signal.compression.last());
    assert!(s.segments[0].normal_stress > signal.normal[0] + 300.0);
    assert!((r.assembly().cell().height / 450.0 - 1.0).abs() < 1e-3);
    settings.boundary = Boundary::Walls;
    let (r, _) = finish(&settings);
    let signal = &r.signals()[0];
    assert!(signal.normal.last().unwrap() > &(signal.normal[0] + 200.0));
}

#[test]
fn ensembles_do_not_depend_on_threads_and_compare() {
    let mut settings = quick(Experiment::Oscillation(short()));
    settings.model.grains = 40;
    settings.seeds = 3;
    let run = |threads: usize, settings: &MicrogelSettings| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run_ensemble(settings, |_| {}).unwrap())
    };
    let a = run(1, &settings);
    assert_eq!(a, run(3, &settings));
    assert_eq!(a.g_prime.count, 3);
    assert!(a.g_prime.sd > 0.0 && a.g_prime.half_width > a.g_prime.sd);
    settings.model.young_modulus *= 4.0;
    let b = run(2, &settings);
    // Four times the modulus: four times the stress, to round-off, in half the time.
    assert!((b.g_prime.mean / a.g_prime.mean - 4.0).abs() < 1e-6, "{}", b.g_prime.mean / a.g_prime.mean);
    assert!(a.compare(&b)[0].p < 0.01);
}

#[test]
fn plates_carry_and_frames_hold_together() {
    let mut settings = quick(Experiment::Oscillation(short()));
    settings.plates = Some(Plates::Fixed);
    let mut r = Rheometer::new(&settings).unwrap();
    let mut rows = 0;
    while rows < 700 {
        if let Progress::Recorded(_) = r.advance().unwrap() {
            rows += 1;
        }
    }
    let f = frame(r.assembly());
    let carried: Vec<usize> = (0..60).filter(|&i| f.plate[i] != 0).collect();
    assert!(carried.len() > 5 && carried.len() < 50);
    assert!(carried.iter().all(|&i| f.grains.omega[i] == 0.0));
    assert!(f.in_chain.iter().any(|c| *c) && !f.in_chain.iter().all(|c| *c));
    // The grains' stresses, weighted by their areas, make up the bulk pressure.
    let area: f64 = f.grains.radius.iter().map(|r| std::f64::consts::PI * r * r).sum();
    let mean = (0..60).map(|i| f.stress[i].pressure() * std::f64::consts::PI * f.grains.radius[i].powi(2)).sum::<f64>()
        / 250_000.0;
    let bulk = r.last_row().stress.bulk.pressure();
    assert!((mean / bulk - 1.0).abs() < 0.02, "{mean} {bulk}, area {area}");
    let contacts = f.coordination.iter().sum::<u32>() as usize;
    assert_eq!(contacts, 2 * f.contacts.len());
}

#[test]
fn hard_cases_end_in_numbers() {
    let base = quick(Experiment::Oscillation(short()));
    let mut cases: Vec<(&str, MicrogelSettings)> = Vec::new();
    let mut with = |name, change: &dyn Fn(&mut MicrogelSettings)| {
        let mut s = base.clone();
        change(&mut s);
        cases.push((name, s));
    };
    let amplitude = |a| Experiment::Oscillation(Oscillation { amplitude: a, ..short() });
    with("packing 2.5", &|s| s.model.packing = 2.5);
    with("amplitude 2", &|s| s.experiment = amplitude(2.0));
    with("amplitude 5", &|s| s.experiment = amplitude(5.0));
    with("amplitude 2 unlinked", &|s| {
        s.experiment = amplitude(2.0);
        s.preparation.links = false;
    });
    with("frictionless", &|s| s.model.friction = 0.0);
    with("friction 10", &|s| s.model.friction = 10.0);
    with("step 20 times too large", &|s| s.step_factor = 20.0);
    with("two grains", &|s| {
        s.model.grains = 2;
        s.model.packing = 0.5;
    });
    with("stiffness contrast", &|s| {
        s.model.grains = 20;
        s.model.reinforcement_central = 1e4;
        s.model.keep_viscosity = true;
        s.preparation.relaxation = 0.05;
    });
    with("plateau", &|s| s.model.law = CentralLaw::Plateau { repulsion: 1.0, begin: 0.3, end: 0.8, slope: 0.1 });
    with("walls", &|s| s.boundary = Boundary::Walls);
    for (name, settings) in cases {
        let mut r = Rheometer::new(&settings).unwrap();
        r.run(|_| {}).unwrap_or_else(|e| panic!("{name}: {e}"));
        let s = r.summary().unwrap();
        assert!(s.g_prime.is_finite() && s.g_double_prime.is_finite(), "{name}");
        assert!(s.identity_defect < 1e-6, "{name}: {:e}", s.identity_defect);
    }
    let mut refused = base.clone();
    refused.rules.guard = StepGuard::Refuse;
    refused.step_factor = 400.0;
    let result = Rheometer::new(&refused).unwrap().run(|_| {});
    assert!(matches!(result, Err(GranularError::StepTooLarge { .. })), "{result:?}");
}

#[test]
fn gates_flag_a_moving_baseline() {
    // No relaxation to speak of: the sample still rings when it is measured.
    let mut settings = quick(Experiment::Oscillation(Oscillation { amplitude: 0.001, ..short() }));
    settings.preparation.relaxation = 0.01;
    settings.preparation.links = false;
    let (_, s) = finish(&settings);
    let missed = s.segments[0].gates.iter().filter(|g| g.level == GateLevel::Missed).count();
    assert!(missed > 0 && !s.credible(), "{:?}", s.segments[0].gates);
}

#[test]
fn cutting_by_lines_and_removal_leave_whole_particles() {
    let mut settings = quick(Experiment::Oscillation(short()));
    settings.model.grains = 150;
    settings.preparation.cut = Cut::Lines { count: 4, avoid_horizontal: 15.0 };
    settings.preparation.remove_links = 0.3;
    settings.preparation.cut_top_bottom = true;
    for mode in [Mode::Physical, Mode::Compat] {
        settings.mode = mode;
        let mut r = Rheometer::new(&settings).unwrap();
        while r.preparing() {
            r.advance().unwrap();
        }
        let facts = *r.facts();
        assert!(facts.particles > 2 && facts.links > 100, "{facts:?}");
        assert!((facts.removed_fraction - 0.3).abs() < 0.02, "{facts:?}");
    }
}

#[test]
fn binary_checkpoints_resume_bit_for_bit() {
    for mode in [Mode::Physical, Mode::Compat] {
        let mut settings = MicrogelSettings { mode, ..quick(Experiment::Oscillation(short())) };
        settings.model.law = CentralLaw::Tabulated(
            granular::law::Table::new(vec![0.0, 0.2, 0.5, 0.9], vec![0.0, 0.25, 1.0, 9.0]).unwrap(),
        );
        let mut whole = Rheometer::new(&settings).unwrap();
        for _ in 0..700 {
            whole.advance().unwrap();
        }
        let bytes = postcard::to_stdvec(&whole).unwrap();
        let mut again: Rheometer = postcard::from_bytes(&bytes).unwrap();
        for _ in 0..100 {
            assert_eq!(whole.advance().unwrap(), again.advance().unwrap());
        }
    }
}

/// Every experiment that does not oscillate has figures, and they are what the records say by elementary arithmetic.
#[test]
fn experiments_without_oscillation_state_their_figures() {
    let of = |s: &Summary, name: &str| {
        s.figures.iter().find(|f| f.name == name).unwrap_or_else(|| panic!("{name}: {:?}", s.figures)).value
    };
    let tau = quick(Experiment::default()).model.constants().time;
    let (_, s) = finish(&quick(Experiment::SteadyShear { relative_rate: -0.02, strain: 0.5 }));
    assert!(
        (of(&s, "viscosity") * -0.02 / tau / of(&s, "shear_stress") - 1.0).abs() < 1e-9 && of(&s, "viscosity") > 0.0
    );
    let (_, s) = finish(&quick(Experiment::StepStrain { strain: 0.05, rise: 2.0, hold: 60.0 }));
    let relaxed = of(&s, "relaxation_modulus");
    assert!(relaxed < of(&s, "peak_modulus"));
    // compliance and relaxation modulus of the same nearly elastic body
    let (_, s) = finish(&quick(Experiment::Creep { stress: 100.0, duration: 200.0, recovery: 200.0 }));
    assert!((of(&s, "elastic_modulus") / relaxed - 1.0).abs() < 0.35, "{} {relaxed}", of(&s, "elastic_modulus"));
    let (r, s) = finish(&quick(Experiment::Compression { strain: 0.05, relative_rate: 0.002, hold: 50.0 }));
    let normal = &r.signals()[0].normal;
    assert_eq!(of(&s, "normal_stress_change"), normal.last().unwrap() - normal[0]);
    assert!(of(&s, "compression_modulus") > 1000.0, "{:?}", s.figures);
    let (_, s) = finish(&quick(Experiment::default()));
    assert!(s.figures.is_empty());
}

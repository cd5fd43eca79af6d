//! Properties of the default mode: exact modulus of a lattice, symmetries, conservation, identities, restart.

use granular::cell::{Boundary, Cell};
use granular::compat::DirectedSample;
use granular::grains::Grains;
use granular::law::{CentralLaw, Tension};
use granular::model::{ContactKind, ContactModel, Mode, ModelSettings};
use granular::physical::{Rules, Sample, SlipRule, StepGuard};
use granular::preparation::random_packing;
use granular::random::Random;

fn springs(normal: f64, tangential: f64, repulsion: f64) -> ContactModel {
    ContactModel {
        spring: normal,
        viscosity: 0.0,
        tangential_spring: tangential,
        tangential_viscosity: 0.0,
        friction: 0.5,
        law: CentralLaw::Blend { repulsion },
        tension: Tension::Linear,
        permanent_ratio_central: 1.0,
        permanent_ratio_tangential: 1.0,
        keep_viscosity: false,
    }
}

/// A relaxed dense packing with friction, some of it linked.
fn packed(grains: usize, seed: u64, linked: bool) -> (Sample, f64) {
    let side = 500.0 * (grains as f64 / 150.0).sqrt();
    let settings = ModelSettings { grains, width: side, height: side, friction: 0.3, ..ModelSettings::default() };
    let discs = random_packing(&settings, Mode::Physical, &mut Random::new(seed));
    let mut sample = Sample::new(&discs, Cell::new(side, side), settings.contact_model(), Rules::default()).unwrap();
    let tau = settings.constants().time;
    for _ in 0..150 {
        sample.advance(0.1 * tau, 0.5).unwrap();
    }
    if linked {
        for [i, j] in sample.contacts().map(|(p, ..)| [p.i as usize, p.j as usize]).step_by(3).collect::<Vec<_>>() {
            let g = sample.grains();
            sample.link(i, j, g.radius[i] + g.radius[j]);
        }
    }
    (sample, tau)
}

#[test]
fn triangular_lattice_has_the_exact_modulus() {
    let (columns, rows, l) = (8usize, 6usize, 50.0);
    let (kn, kt, strain) = (3.0e9, 1.2e9, 1e-8);
    let (width, height) = (columns as f64 * l, rows as f64 * l * 3f64.sqrt() / 2.0);
    let mut grains = Grains::default();
    for r in 0..rows {
        for c in 0..columns {
            let x = (c as f64 + 0.5 * (r % 2) as f64 + 0.25) * l;
            grains.push([x, (r as f64 + 0.5) * l * 3f64.sqrt() / 2.0], l / 2.0, 0.1);
        }
    }
    let mut sample = Sample::new(&grains, Cell::new(width, height), springs(kn, kt, 0.0), Rules::default()).unwrap();
    sample.observe();
    let mut links = 0;
    for i in 0..grains.len() {
        for j in i + 1..grains.len() {
            let ([dx, dy], ..) = sample.cell().nearest(grains.x[j] - grains.x[i], grains.y[j] - grains.y[i]);
            if dx.hypot(dy) < 1.01 * l {
                assert!(sample.link(i, j, l));
                links += 1;
            }
        }
    }
    assert_eq!(links, 3 * grains.len());
    let dt = 1e-9;
    sample.set_rate(strain / dt);
    sample.advance(dt, 1.0).unwrap();
    sample.set_rate(0.0);
    let report = sample.observe();
    let modulus = report.stress.bulk.shear() / strain;
    let exact = 3f64.sqrt() / 4.0 * (kn + kt) * 1e-6;
    assert!((modulus / exact - 1.0).abs() < 1e-6, "{modulus} {exact}");
    assert!((report.stress.bulk.0[2] / report.stress.bulk.0[1] - 1.0).abs() < 1e-6);
}

#[test]
fn frictionless_collision_conserves_energy_to_second_order() {
    let energies = |dt: f64| {
        let mut grains = Grains::default();
        grains.push([150.0, 200.0], 60.0, 1.0);
        grains.push([290.0, 230.0], 45.0, 0.7);
        grains.vx = vec![15.0, -15.0];
        let mut model = springs(1.0, 0.0, 1.0);
        model.friction = 0.0;
        let rules = Rules { guard: StepGuard::Off, ..Rules::default() };
        let mut sample = Sample::new(&grains, Cell::new(500.0, 500.0), model, rules).unwrap();
        let energy = |s: &Sample| s.grains().kinetic_energy(0.0, 0.0) + s.elastic_energy();
        let (start, mut worst) = (energy(&sample), 0.0f64);
        let steps = (12.0 / dt) as usize;
        for _ in 0..steps {
            sample.advance(dt, 1.0).unwrap();
            worst = worst.max((energy(&sample) / start - 1.0).abs());
        }
        assert!(sample.contacts().next().is_none(), "the grains have parted");
        (worst, (energy(&sample) / start - 1.0).abs())
    };
    let (coarse, end_coarse) = energies(0.02);
    let (fine, end_fine) = energies(0.005);
    assert!(coarse < 0.02 && fine < coarse / 3.5, "{coarse} {fine}");
    // After the encounter the error is that of entering and leaving between steps: no drift.
    assert!(end_coarse < 2e-3 && end_fine < 2e-4, "{end_coarse} {end_fine}");
}

#[test]
fn linked_pair_spinning_rigidly_loses_nothing() {
    // An overlapped linked pair in rigid rotation: with the lever of the torque nothing slides.
    let mut grains = Grains::default();
    grains.push([200.0, 250.0], 30.0, 1.0);
    grains.push([255.0, 250.0], 40.0, 1.6);
    let (omega, total) = (0.02, 2.6);
    let centre = (200.0 + 1.6 * 255.0) / total;
    for i in 0..2 {
        grains.vy[i] = omega * (grains.x[i] - centre);
        grains.omega[i] = omega;
    }
    let mut model = springs(1.0, 1.0, 0.0);
    (model.viscosity, model.tangential_viscosity) = (1.0, 1.0);
    let mut sample = Sample::new(&grains, Cell::new(500.0, 500.0), model, Rules::default()).unwrap();
    assert!(sample.link(0, 1, 55.0));
    let start = sample.grains().kinetic_energy(0.0, 0.0);
    for _ in 0..2000 {
        sample.advance(0.01, 1.0).unwrap();
    }
    let end = sample.grains().kinetic_energy(0.0, 0.0);
    assert!((end / start - 1.0).abs() < 2e-3, "{}", end / start);
}

#[test]
fn momenta_are_conserved_and_identities_hold() {
    let (mut sample, tau) = packed(150, 3, true);
    let total: f64 = sample.grains().mass.iter().sum();
    let p0 = sample.momenta();
    let speed = sample.grains().vx.iter().fold(0.0f64, |m, v| m.max(v.abs())).max(1.0);
    for _ in 0..200 {
        let r = sample.advance(tau / 56.0, 1.0).unwrap();
        assert!(r.stress.identity_defect() < 1e-12, "{:e}", r.stress.identity_defect());
        let b = r.stress.bulk;
        assert!(b.asymmetry().abs() < 1e-12 * b.max_abs());
    }
    let p1 = sample.momenta();
    for k in 0..2 {
        assert!((p1[k] - p0[k]).abs() < 1e-10 * total * speed);
    }
}

#[test]
fn galilean_motion_changes_nothing_but_positions() {
    let (mut a, tau) = packed(120, 5, true);
    let mut b = a.clone();
    b.boost(2.0e5);
    for _ in 0..300 {
        let ra = a.advance(tau / 56.0, 1.0).unwrap();
        let rb = b.advance(tau / 56.0, 1.0).unwrap();
        // The identities hold in either frame; the bulk tensor is the same.
        assert!((ra.stress.bulk - rb.stress.bulk).max_abs() < 1e-7 * ra.stress.bulk.max_abs());
    }
}

#[test]
fn strain_by_one_box_width_is_the_unsheared_lattice() {
    let (a, _) = packed(150, 7, false);
    let mut grains = a.grains();
    grains.vx.fill(0.0);
    grains.vy.fill(0.0);
    let stress = |turns: f64| {
        let mut s = Sample::new(&grains, *a.cell(), a.model().clone(), Rules::default()).unwrap();
        s.set_strain(turns * a.cell().width / a.cell().height);
        s.observe().stress.bulk
    };
    let zero = stress(0.0);
    for turns in [1.0, -1.0, 7.0] {
        assert!((stress(turns) - zero).max_abs() < 1e-9 * zero.max_abs());
    }
    assert!((stress(0.5) - zero).max_abs() > 1e-3 * zero.max_abs(), "half a box is another lattice");
}

#[test]
fn relabelling_and_a_quarter_turn_change_nothing_beyond_round_off() {
    let (a, tau) = packed(130, 11, false);
    let g = a.grains();
    let n = g.len();
    let mut order: Vec<usize> = (0..n).collect();
    Random::new(1).shuffle(&mut order);
    let side = a.cell().width;
    let pick = |v: &[f64]| order.iter().map(|&i| v[i]).collect::<Vec<_>>();
    let shuffled = Grains {
        x: pick(&g.x),
        y: pick(&g.y),
        vx: pick(&g.vx),
        vy: pick(&g.vy),
        omega: pick(&g.omega),
        angle: pick(&g.angle),
        radius: pick(&g.radius),
        mass: pick(&g.mass),
        inertia: pick(&g.inertia),
    };
    let mut turned = g.clone();
    turned.x = g.y.iter().map(|y| side - y).collect();
    turned.y = g.x.clone();
    turned.vx = g.vy.iter().map(|v| -v).collect();
    turned.vy = g.vx.clone();
    let run = |grains: &Grains| {
        let mut s = Sample::new(grains, *a.cell(), a.model().clone(), Rules::default()).unwrap();
        let mut last = s.observe();
        for _ in 0..200 {
            last = s.advance(tau / 56.0, 0.999).unwrap();
        }
        (s.grains(), last.stress.bulk)
    };
    let (ga, sa) = run(&g);
    let (gb, sb) = run(&shuffled);
    assert!((sa - sb).max_abs() < 1e-10 * sa.max_abs());
    for (k, &i) in order.iter().enumerate() {
        assert!((ga.y[i] - gb.y[k]).abs() < 1e-9 * side);
    }
    let (_, sc) = run(&turned);
    let t = granular::tensor::Tensor2([sc.0[3], -sc.0[2], -sc.0[1], sc.0[0]]);
    assert!((sa - t).max_abs() < 1e-8 * sa.max_abs(), "{sa:?} {sc:?}");
}

#[test]
fn stress_is_continuous_where_grains_cross_edges() {
    let (mut sample, tau) = packed(150, 13, true);
    sample.boost(500.0 / (2000.0 * tau / 56.0));
    sample.lift(500.0 / (2000.0 * tau / 56.0));
    sample.set_rate(1e-3 / tau);
    let mut last = sample.advance(tau / 56.0, 1.0).unwrap().stress.bulk;
    let (mut largest, mut sum) = (0.0f64, 0.0);
    for _ in 0..600 {
        let now = sample.advance(tau / 56.0, 1.0).unwrap().stress.bulk;
        let jump = (now - last).max_abs() / now.max_abs();
        largest = largest.max(jump);
        sum += jump;
        last = now;
    }
    assert!(largest < 20.0 * sum / 600.0 + 1e-4, "largest {largest:e}, mean {:e}", sum / 600.0);
}

#[test]
fn any_number_of_threads_gives_the_same_bits_and_restart_too() {
    let (sample, tau) = packed(9000, 17, true);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut s = sample.clone();
            s.set_rate(1e-2 / tau);
            let mut last = s.advance(tau / 56.0, 0.999).unwrap();
            for _ in 0..30 {
                last = s.advance(tau / 56.0, 0.999).unwrap();
            }
            (serde_json::to_string(&s).unwrap(), last)
        })
    };
    let (one, ra) = run(1);
    let (four, rb) = run(4);
    assert_eq!(ra, rb);
    assert!(one == four, "states differ between 1 and 4 threads");
    // Saved in the middle of a sheared box, restarted, continued.
    let mut a: Sample = serde_json::from_str(&one).unwrap();
    let mut b = a.clone();
    b = serde_json::from_str(&serde_json::to_string(&b).unwrap()).unwrap();
    for _ in 0..5 {
        assert_eq!(a.advance(tau / 56.0, 0.999).unwrap(), b.advance(tau / 56.0, 0.999).unwrap());
    }
}

#[test]
fn sliding_force_stays_at_the_coulomb_limit() {
    // Two grains forced past each other: with the spring kept, the sliding force is the limit at every step.
    let mut grains = Grains::default();
    grains.push([200.0, 200.0], 60.0, 1.0);
    grains.push([290.0, 200.0], 60.0, 1.0);
    grains.vy = vec![10.0, -10.0];
    let ratios = |slip: SlipRule| {
        let mut model = springs(1.0, 1.0, 0.0);
        model.friction = 0.3;
        let rules = Rules { slip, ..Rules::default() };
        let mut s = Sample::new(&grains, Cell::new(500.0, 500.0), model, rules).unwrap();
        let mut ratios = Vec::new();
        for _ in 0..300 {
            s.advance(0.01, 1.0).unwrap();
            if s.observe().slipping == 1 {
                let (pair, _, spring) = s.contacts().next().unwrap();
                let [dx, dy] = s.separation(pair);
                ratios.push(spring.abs() / (0.3 * (120.0 - dx.hypot(dy))));
            }
        }
        ratios
    };
    let kept = ratios(SlipRule::KeepAtLimit);
    assert!(kept.len() > 20 && kept.iter().all(|r| (r - 1.0).abs() < 1e-9), "{kept:?}");
    assert!(ratios(SlipRule::Reset).iter().all(|r| *r == 0.0));
}

#[test]
fn too_large_a_step_is_cut_or_refused() {
    let (sample, tau) = packed(150, 19, false);
    let mut refused = sample.clone();
    refused.rules_mut().guard = StepGuard::Refuse;
    assert!(matches!(refused.advance(20.0 * tau / 5.6, 1.0), Err(granular::GranularError::StepTooLarge { .. })));
    let mut cut = sample.clone();
    let mut free = sample.clone();
    free.rules_mut().guard = StepGuard::Off;
    let energy = |s: &Sample| s.elastic_energy() + s.grains().kinetic_energy(0.0, 0.0);
    let start = energy(&cut);
    for _ in 0..20 {
        let r = cut.advance(20.0 * tau / 56.0, 1.0).unwrap();
        assert!(r.substeps > 1);
    }
    assert!(energy(&cut) < 1.01 * start);
    let exploded = (0..20).any(|_| free.advance(20.0 * tau / 5.6, 1.0).is_err() || energy(&free) > 10.0 * start);
    assert!(exploded, "without the guard this step is unstable");
}

#[test]
fn walls_and_open_boxes_hold_their_grains() {
    let settings = ModelSettings { packing: 0.7, ..ModelSettings::default() };
    let discs = random_packing(&settings, Mode::Physical, &mut Random::new(2));
    let tau = settings.constants().time;
    let mut cell = Cell::new(500.0, 500.0);
    cell.boundary = Boundary::Walls;
    let mut walled = Sample::new(&discs, cell, settings.contact_model(), Rules::default()).unwrap();
    for _ in 0..400 {
        walled.advance(0.1 * tau, 0.7).unwrap();
    }
    let g = walled.grains();
    assert!((0..g.len()).all(|i| g.y[i] > 0.3 * g.radius[i] && g.y[i] < 500.0 - 0.3 * g.radius[i]));
    walled.set_rate(1e-2 / tau);
    let mut sum = 0.0;
    for _ in 0..400 {
        sum += walled.advance(0.05 * tau, 0.99).unwrap().stress.identity_defect();
    }
    assert!(sum / 400.0 < 1e-10, "{sum}");

    cell.boundary = Boundary::Open;
    let mut open = Sample::new(&discs, cell, settings.contact_model(), Rules::default()).unwrap();
    let p0 = open.momenta();
    for _ in 0..300 {
        open.advance(0.05 * tau, 1.0).unwrap();
    }
    let (p1, g) = (open.momenta(), open.grains());
    let scale = g.mass.iter().zip(&g.vx).map(|(m, v)| m * v.abs()).sum::<f64>();
    assert!((p1[0] - p0[0]).abs() < 1e-11 * scale && (p1[1] - p0[1]).abs() < 1e-11 * scale);
    assert!((p1[2] - p0[2]).abs() < 1e-11 * scale * 500.0);
    assert!(g.x.iter().any(|x| *x < 0.0), "nothing holds an open heap together");
}

#[test]
fn coincident_grains_part() {
    let mut grains = Grains::default();
    grains.push([250.0, 250.0], 40.0, 1.0);
    grains.push([250.0, 250.0], 30.0, 1.0);
    let mut sample = Sample::new(&grains, Cell::new(500.0, 500.0), springs(1.0, 1.0, 1.0), Rules::default()).unwrap();
    let mut directed = DirectedSample::new(grains.clone(), Cell::new(500.0, 500.0), springs(1.0, 1.0, 1.0), 3);
    let p0 = sample.momenta();
    for _ in 0..200 {
        sample.advance(0.05, 0.5).unwrap();
        directed.evaluate();
        directed.integrate(0.05, 0.5, false).unwrap();
    }
    for g in [sample.grains(), directed.grains] {
        let ([dx, dy], ..) = sample.cell().nearest(g.x[1] - g.x[0], g.y[1] - g.y[0]);
        assert!(dx.hypot(dy) > 1.0, "{dx} {dy}");
    }
    assert!((sample.momenta()[0] - p0[0]).abs() < 1e-9);
}

#[test]
fn a_link_longer_than_half_the_box_keeps_its_image() {
    let mut grains = Grains::default();
    grains.push([200.0, 250.0], 60.0, 1.0);
    grains.push([310.0, 250.0], 60.0, 1.0);
    grains.vx = vec![-20.0, 20.0];
    let mut model = springs(1e-3, 0.0, 0.0);
    model.friction = 0.0;
    let mut sample = Sample::new(&grains, Cell::new(500.0, 500.0), model, Rules::default()).unwrap();
    assert!(sample.link(0, 1, 120.0));
    let mut longest = 0.0f64;
    for _ in 0..3000 {
        sample.advance(0.02, 1.0).unwrap();
        let (pair, ..) = sample.contacts().find(|c| c.1 == ContactKind::Permanent).unwrap();
        longest = longest.max(sample.separation(pair)[0]);
    }
    // Speed 40 against the spring of the relative motion: 110 + 40 sqrt(m/2k) beyond rest, past half of the box.
    let reach = 120.0 + ((40.0f64).powi(2) * 0.5 / 1e-3 + 100.0).sqrt();
    assert!(longest > 250.0 && (longest / reach - 1.0).abs() < 0.01, "{longest} {reach}");
}

#[test]
fn stress_is_continuous_where_a_grain_enters_the_band_of_fixed_plates() {
    let (mut sample, tau) = packed(150, 23, false);
    let carried = sample.attach_plates().unwrap();
    sample.set_rate(5e-3 / tau);
    let mut last = sample.advance(tau / 56.0, 0.999).unwrap().stress.bulk;
    let (mut largest, mut sum) = (0.0f64, 0.0);
    for _ in 0..1500 {
        let now = sample.advance(tau / 56.0, 0.999).unwrap().stress.bulk;
        let jump = (now - last).max_abs() / now.max_abs();
        largest = largest.max(jump);
        sum += jump;
        last = now;
    }
    assert_eq!(sample.carried(), carried, "nobody is captured");
    assert!(largest < 20.0 * sum / 1500.0 + 1e-3, "largest {largest:e}, mean {:e}", sum / 1500.0);
}

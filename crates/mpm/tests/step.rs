//! The whole step on cases with a known answer.

mod common;
use common::{block, inviscid_water, preset, stream};
use mpm::{HalfSpace, LiquidSettings, LiquidStepper, NoSolid, Vector};
use particle_grid::Lattice;

fn tank<const D: usize>(width: f64, depth: f64, stick: f64) -> Vec<HalfSpace<D>> {
    let mut walls = Vec::new();
    for a in 0..D - 1 {
        for (at, sign) in [(0.0, 1.0), (if a == 0 { width } else { depth }, -1.0)] {
            let (mut point, mut normal) = (Vector::<D>::zeros(), Vector::<D>::zeros());
            point[a] = at;
            normal[a] = sign;
            walls.push(HalfSpace { point, normal, stick });
        }
    }
    let mut up = Vector::<D>::zeros();
    up[D - 1] = 1.0;
    walls.push(HalfSpace { point: Vector::zeros(), normal: up, stick });
    walls
}

fn hydrostatic<const D: usize>(dx: f64, size: Vector<D>, shift: f64) -> (f64, f64, f64) {
    let mut lattice = Lattice::<D>::new(dx);
    lattice.origin = Vector::repeat(shift * dx);
    let materials = [inviscid_water()];
    let mut particles = block(&lattice, 4, Vector::zeros(), size, &materials);
    // A lattice that does not start at the walls leaves the particles where they are: only the grid shifts.
    let base = Lattice::<D>::new(dx);
    if shift != 0.0 {
        particles = block(&base, 4, Vector::zeros(), size, &materials);
    }
    let walls = tank::<D>(size[0], if D == 3 { size[1] } else { 0.0 }, 0.0);
    let mut body = Vector::<D>::zeros();
    body[D - 1] = -9.81;
    let mut stepper = LiquidStepper::new(lattice);
    let settings = LiquidSettings::default();
    let mut report = None;
    for k in 0..4 {
        report = Some(stepper.advance(&mut particles, &materials, &walls, &walls, &body, 1e-3, k, &settings).unwrap());
    }
    let report = report.unwrap();
    let totals = particles.totals(&materials, dx);
    // Pressure at the floor by extrapolating the lowest cell.
    let mut floor = 0.0f64;
    for node in 0..stepper.grid.blocks.node_count() {
        let p = stepper.grid.cell.pressure[node];
        if p > 0.0 {
            let height = stepper.grid.cell_position(node)[D - 1];
            floor = floor.max(p + 1000.0 * 9.81 * height);
        }
    }
    assert!(report.pressure.unwrap().multigrid.solve.status.is_converged());
    (floor, totals.max_speed, 1000.0 * 9.81 * size[D - 1])
}

#[test]
fn resting_water_rests_and_weighs_what_it_should() {
    let (p, speed, expected) = hydrostatic::<2>(0.01, Vector::<2>::new(0.16, 0.2), 0.0);
    assert!((p / expected - 1.0).abs() < 1e-3, "{p} {expected}");
    assert!(speed < 1e-3 * (9.81 * 0.01f64).sqrt(), "{speed}");
    let (p, speed, expected) = hydrostatic::<3>(0.02, Vector::<3>::new(0.16, 0.12, 0.2), 0.0);
    assert!((p / expected - 1.0).abs() < 1e-3, "{p} {expected}");
    assert!(speed < 1e-3 * (9.81 * 0.01f64).sqrt(), "{speed}");
    // A surface that lies inside a cell: 20.3 cells high.
    let (p, speed, expected) = hydrostatic::<2>(0.01, Vector::<2>::new(0.16, 0.2025), 0.0);
    assert!((p / expected - 1.0).abs() < 2e-3, "{p} {expected}");
    assert!(speed < 0.03 * (9.81 * 0.01f64).sqrt(), "{speed}");
}

#[test]
fn walls_anywhere_in_a_cell_hold_the_water() {
    let (p, speed, expected) = hydrostatic::<2>(0.01, Vector::<2>::new(0.16, 0.2), 0.3);
    assert!((p / expected - 1.0).abs() < 1e-2, "{p} {expected}");
    assert!(speed < 0.05 * (9.81f64 * 0.01).sqrt(), "{speed}");
}

#[test]
fn a_drop_in_free_fall_keeps_its_momentum_balance() {
    let lattice = Lattice::<3>::new(0.02);
    for name in ["water", "shaving-cream", "drilling-mud"] {
        let materials = [preset(name)];
        let mut particles =
            block(&lattice, 2, Vector::<3>::repeat(0.101), Vector::<3>::new(0.2, 0.18, 0.24), &materials);
        let mut r = stream(3);
        for v in &mut particles.velocity {
            *v = Vector::<3>::new(0.1, 0.0, -0.2) + Vector::from_fn(|_, _| 0.01 * r());
        }
        let before = particles.totals(&materials, lattice.dx);
        let body = Vector::<3>::new(0.0, 0.0, -9.81);
        let mut stepper = LiquidStepper::new(lattice);
        let mut settings = LiquidSettings::default();
        settings.resample.enabled = false;
        settings.pressure.enabled = false;
        let (dt, steps) = (1e-3, 10);
        for k in 0..steps {
            stepper.advance::<NoSolid>(&mut particles, &materials, &[], &[], &body, dt, k, &settings).unwrap();
            particles.check().unwrap();
        }
        let after = particles.totals(&materials, lattice.dx);
        assert_eq!(before.mass, after.mass);
        let gained = body * before.mass * dt * steps as f64;
        assert!(
            (after.momentum - before.momentum - gained).norm() < 1e-12 * gained.norm(),
            "{name}: {} {}",
            after.momentum - before.momentum,
            gained
        );
    }
}

#[test]
fn one_two_and_four_threads_step_to_the_same_bits() {
    let lattice = Lattice::<3>::new(0.02);
    let materials = [preset("shaving-cream")];
    let run = |threads: usize| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| {
            let mut particles =
                block(&lattice, 3, Vector::<3>::new(0.02, 0.02, 0.0), Vector::<3>::new(0.2, 0.2, 0.2), &materials);
            let floor = [HalfSpace { point: Vector::<3>::zeros(), normal: Vector::<3>::z(), stick: 1.0 }];
            let body = Vector::<3>::new(0.0, 1.0, -9.81);
            let mut stepper = LiquidStepper::new(lattice);
            for k in 0..3 {
                stepper
                    .advance(&mut particles, &materials, &floor, &floor, &body, 1e-3, k, &LiquidSettings::default())
                    .unwrap();
            }
            particles
        })
    };
    let one = run(1);
    assert!(one == run(2) && one == run(4));
}

/// What some particles say of the error of a linearisation is not less than what linearising anew finds, and not a hundred times more.
#[test]
fn newtons_check_asks_enough_particles() {
    for rate in [5.0, 12.0, 40.0] {
        let residual = |tolerance: f64| {
            let lattice = Lattice::<2>::new(0.005);
            let materials = [preset("shaving-cream")];
            let mut particles = block(&lattice, 4, Vector::repeat(0.0), Vector::<2>::new(0.02, 0.08), &materials);
            let mut r = stream(4);
            for i in 0..particles.len() {
                let x = particles.position[i] - Vector::<2>::new(0.01, 0.04);
                particles.velocity[i] = Vector::<2>::new(-rate * x[0], rate * x[1]);
                particles.affine[i] = nalgebra::Matrix2::new(-rate, 0.0, 0.0, rate);
                particles.position[i] += Vector::<2>::new(r(), r()) * 5e-4;
            }
            let mut settings = LiquidSettings::default();
            settings.shear.newton_iterations = 2;
            settings.shear.newton_tolerance = tolerance;
            let (mut stepper, body) = (LiquidStepper::new(lattice), Vector::<2>::new(0.0, -9.81));
            let mut advance = |k| {
                let none: [NoSolid; 0] = [];
                stepper.advance(&mut particles, &materials, &none, &none, &body, 1e-3, k, &settings).unwrap().shear
            };
            // with the stress of some steps, the liquid flows
            for k in 0..20 {
                advance(k);
            }
            let shear = advance(20);
            (shear.newton_iterations, shear.nonlinear_residual)
        };
        let (iterations, found) = residual(1e-14);
        assert_eq!(iterations, 2);
        // less than what the liquid's stress would have changed by if nothing had flowed, so particles are asked
        let (iterations, estimated) = residual(0.05);
        assert_eq!(iterations, 1, "{rate}");
        assert!(estimated >= found && estimated <= 100.0 * found, "{rate}: {estimated} {found}");
    }
}

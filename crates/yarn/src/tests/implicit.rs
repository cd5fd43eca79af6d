//! The implicit step: exact derivatives, agreement with the explicit one, stiff yarns at the advection step.

use geometry::{Motion, ShapeDescription, Vector3};

use super::{build, pair_settings, settings};
use crate::generate::{YarnGroup, YarnShape};
use crate::settings::*;
use crate::{YarnMaterial, YarnSettings, YarnSystem};

fn implicit(mut settings: YarnSettings, tolerance: f64) -> YarnSettings {
    settings.step.integrator =
        Integrator::Implicit(ImplicitSettings { tolerance, max_cg: 400, ..ImplicitSettings::default() });
    settings
}

#[test]
fn small_steps_agree_with_the_explicit_method() {
    // Both are of first order: the difference after a fixed time falls with the step.
    let difference = |dt: f64| {
        let settings = pair_settings::<2>(2.0);
        let (mut a, mut b): (YarnSystem<2>, YarnSystem<2>) =
            (build(&settings), build(&implicit(settings.clone(), 1e-9)));
        for _ in 0..(4e-3 / dt).round() as usize {
            a.advance(dt).unwrap();
            b.advance(dt).unwrap();
        }
        assert!(b.momentum_defect() < 1e-12, "{:e}", b.momentum_defect());
        (0..a.model().len()).map(|i| (a.state().position[i] - b.state().position[i]).norm()).fold(0.0, f64::max)
    };
    let (coarse, fine) = (difference(8e-5), difference(4e-5));
    // 8 mm of motion; backward Euler damps the waves of the impact.
    assert!(fine < 0.7 * coarse && coarse < 2e-3, "{coarse:e} {fine:e}");
}

#[test]
fn newton_converges_quadratically_so_the_hessian_is_exact() {
    // One step of a violent state at a large step; a wrong Hessian would need many iterations to 1e-11.
    for hand_back in [true, false] {
        let mut scene = implicit(pair_settings::<3>(3.0), 1e-11);
        scene.momentum_hand_back = hand_back;
        // Plastic flow takes its limits from the last iterate: that part converges linearly.
        scene.plastic = false;
        let mut system: YarnSystem<3> = build(&scene);
        for _ in 0..5 {
            let report = system.advance(1e-3).unwrap();
            assert!(report.newton_iterations <= 12 && report.residual <= 1e-11, "{report:?}");
        }
    }
}

#[test]
fn stiff_yarn_runs_at_the_advection_step() {
    let line = YarnShape::Line { from: vec![0.3, 0.5], to: vec![0.7, 0.5] };
    let mut scene = implicit(settings::<2>(vec![YarnGroup::new(line)]), 1e-4);
    scene.materials.insert("yarn".to_owned(), YarnMaterial { stretch_modulus: 1e6, ..YarnMaterial::default() });
    scene.gravity = vec![0.0, -9.8];
    scene.pins = vec![Pin {
        at: PinPlace::Vertex { yarn: 0, vertex: 0 },
        half_width: 1.5,
        half_size: vec![],
        motion: Motion::default(),
    }];
    let mut explicit = scene.clone();
    explicit.step.integrator = Integrator::Explicit;
    let bound = build::<2>(&explicit).tightest_limit().unwrap().seconds;
    let mut system: YarnSystem<2> = build(&scene);
    let dt = 1e-3;
    assert!(dt > 100.0 * bound, "{bound:e}");
    let mut stretch = 0.0f64;
    for _ in 0..150 {
        let report = system.advance(dt).unwrap();
        assert!(report.substeps <= 2, "{report:?}");
        let state = system.state();
        for i in 4..system.model().len() - 1 {
            stretch = stretch.max((state.deformation[i].column(0).norm() - 1.0).abs());
        }
    }
    // The free end swings down; the yarn hardly stretches.
    assert!(system.state().position.last().unwrap().y < 0.43);
    assert!(stretch < 0.02, "{stretch}");
}

#[test]
fn contact_lets_go_and_rubs() {
    // A short yarn on a plane: it slides to rest with friction, and leaves the plane when thrown up.
    let line = YarnShape::Line { from: vec![0.4, 0.52], to: vec![0.6, 0.52] };
    let mut scene = implicit(settings::<2>(vec![YarnGroup { velocity: vec![0.5, 0.0], ..YarnGroup::new(line) }]), 1e-5);
    scene.gravity = vec![0.0, -9.8];
    // Rougher inside than the plane: otherwise it would shear instead of sliding.
    scene.materials.insert("yarn".to_owned(), YarnMaterial { friction: 1.0, ..YarnMaterial::default() });
    scene.obstacles = vec![ObstacleSettings {
        shape: ShapeDescription::HalfSpace { point: Vector3::new(0.0, 0.5, 0.0), normal: Vector3::y() },
        motion: Motion::default(),
        friction: 0.4,
        restitution: 0.0,
    }];
    let mut system: YarnSystem<2> = build(&scene);
    for _ in 0..400 {
        system.advance(1e-3).unwrap();
    }
    // v0/(mu g) = 0.128 s: it must be at rest by 0.4 s, having moved about v0²/(2 mu g) = 32 mm.
    let state = system.state();
    assert!(state.velocity.iter().all(|v| v.x.abs() < 1e-3 && v.norm() < 1e-2), "{:?}", state.velocity[10]);
    let slid = state.position[13].x - (0.4 + 13.0 / 26.0 * 0.2);
    assert!((0.02..0.05).contains(&slid), "{slid}");
    assert!(system.momentum_defect() < 1e-4, "{:e}", system.momentum_defect());
    for v in &mut system.state_mut().velocity {
        v.y = 1.0;
    }
    for _ in 0..50 {
        system.advance(1e-3).unwrap();
    }
    let rise = 1.0 * 0.05 - 0.5 * 9.8 * 0.05 * 0.05;
    let height = system.state().position[13].y;
    assert!(height > 0.5 + 0.8 * rise, "{height}");
}

/// A yarn drawn slowly over a plane: friction over normal force on the plane in steady sliding.
fn drawn_over_a_plane(dt: f64, friction: f64) -> f64 {
    let line = YarnShape::Line { from: vec![0.3, 0.505], to: vec![0.5, 0.505] };
    let mut scene = implicit(settings::<2>(vec![YarnGroup::new(line)]), 1e-4);
    scene.gravity = vec![0.0, -9.8];
    // Rougher inside than the plane, so that it slides as a whole.
    let material =
        YarnMaterial { stretch_modulus: 1e4, friction: 2.0, bending: Bending::None, ..YarnMaterial::default() };
    scene.materials.insert("yarn".to_owned(), material);
    scene.obstacles = vec![ObstacleSettings {
        shape: ShapeDescription::HalfSpace { point: Vector3::new(0.0, 0.5, 0.0), normal: Vector3::y() },
        motion: Motion::default(),
        friction,
        restitution: 0.0,
    }];
    let glide = serde_json::from_str(r#"[{"Translate": {"by": [0.01, 0.0, 0.0], "during": [0.05, 0.25]}}]"#).unwrap();
    scene.drives = vec![Drive { yarn: 0, vertex: -1, motion: glide }];
    let mut system: YarnSystem<2> = build(&scene);
    let (mut along, mut normal) = (0.0, 0.0);
    while system.state().time < 0.25 - 0.5 * dt {
        let report = system.advance(dt).unwrap();
        if system.state().time > 0.15 {
            along += report.obstacle_force[0][0];
            normal -= report.obstacle_force[0][1];
        }
    }
    along / normal
}

#[test]
fn long_steps_rub_as_much_as_short_ones() {
    // Friction after the solve can only stop a node: in long steps most of what a static load asks for would be missing.
    for friction in [0.1, 0.5] {
        for dt in [4e-3, 1e-3, 2.5e-4] {
            let measured = drawn_over_a_plane(dt, friction);
            assert!((measured / friction - 1.0).abs() < 0.02, "{friction} at {dt}: {measured}");
        }
    }
}

/// Layers of yarns under gravity on a rough plane, the lowest at rest and the others sliding: the deceleration by their own friction.
fn sliding_layers(dt: f64, friction: f64) -> f64 {
    let cell = 1.0 / 64.0;
    let layer = |y: f64, speed: f64| {
        let line = YarnShape::Line { from: vec![0.3, 0.5 + y * cell], to: vec![0.45, 0.5 + y * cell] };
        YarnGroup { velocity: vec![speed, 0.0], ..YarnGroup::new(line) }
    };
    let mut scene = implicit(settings::<2>(vec![layer(0.5, 0.0), layer(1.5, 0.3), layer(2.5, 0.3)]), 1e-4);
    scene.gravity = vec![0.0, -9.8];
    let material = YarnMaterial { friction, bending: Bending::None, ..YarnMaterial::default() };
    scene.materials.insert("yarn".to_owned(), material);
    scene.obstacles = vec![ObstacleSettings {
        shape: ShapeDescription::HalfSpace { point: Vector3::new(0.0, 0.5, 0.0), normal: Vector3::y() },
        motion: Motion::default(),
        friction: 5.0,
        restitution: 0.0,
    }];
    let mut system: YarnSystem<2> = build(&scene);
    for _ in 0..(0.1 / dt).round() as usize {
        system.advance(dt).unwrap();
    }
    system.momentum().linear[0] / system.model().total_mass()
}

#[test]
fn yarns_rub_each_other_alike_in_long_and_short_steps() {
    // Two thirds of the mass at 0.3 m/s, slowed by 0.1 g for 0.1 s; elastic trial stresses within the step would stop them far sooner.
    let (long, short) = (sliding_layers(2e-3, 0.1), sliding_layers(2.5e-4, 0.1));
    assert!((long - short).abs() < 0.1 * short, "{long} {short}");
    assert!((0.12..0.14).contains(&short), "{short}");
}

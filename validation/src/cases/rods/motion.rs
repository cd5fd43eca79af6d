//! Motion: vibration, free fall, spin, and a rod hanging by its own weight.

use super::reference::clamped_free_root;
use super::setup::{GRAVITY, V, report_order, resolutions, settle};
use crate::case::{Case, CaseError, Outcome, Param, Params};
use rods::{Boundary, Integrator, Loads, RodSet, RodSettings, RodStepper, StrandMaterial, StrandSpec};

/// First frequency of a cantilever.
pub const VIBRATION: Case = Case {
    id: "rods/vibration",
    about: "First clamped-free bending frequency, from the exact stiffness and from a released rod; omega = 3.51602 sqrt(EI/(rho A L^4)).",
    params: &[
        Param::count("vertices", 41, "vertices of the finest rod"),
        Param::number("young_modulus", 3.747e9, "Pa", "Young's modulus"),
        Param::number("radius", 5e-5, "m", "radius"),
        Param::number("length", 0.05, "m", "free length"),
        Param::number("density", 1320.0, "kg/m^3", "density"),
        Param::number("viscosity", 0.0, "Pa s", "internal viscosity; damping ratio 3 eta omega / (2 E)"),
        Param::count("steps_per_period", 200, "time steps in one period"),
    ],
    run: run_vibration,
};

/// Extension under own weight.
pub const HANGING: Case = Case {
    id: "rods/hanging-extension",
    about: "A rod hanging by its own weight extends by rho g L^2 / (2 E).",
    params: &[
        Param::number("young_modulus", 3.727e9, "Pa", "Young's modulus"),
        Param::number("density", 1320.0, "kg/m^3", "density"),
        Param::number("length", 0.1, "m", "length"),
        Param::count("vertices", 21, "vertices"),
    ],
    run: run_hanging,
};

/// Free fall.
pub const FREE_FALL: Case = Case {
    id: "rods/free-fall",
    about: "A free curl falls by the exact discrete parabola of implicit Euler, x_k = x_0 - g h^2 k (k+1) / 2, without deforming.",
    params: &[
        Param::number("step", 1e-3, "s", "time step"),
        Param::count("steps", 100, "steps"),
        Param::count("vertices", 21, "vertices"),
    ],
    run: run_free_fall,
};

/// Spin.
pub const SPIN: Case = Case {
    id: "rods/spin",
    about: "A free spinning and drifting rod keeps momentum to round-off and angular momentum and energy to second order over 1000 steps of BDF2.",
    params: &[
        Param::number("turns_per_second", 2.0, "1/s", "rate of spin about a transverse axis"),
        Param::number("step", 1e-3, "s", "time step"),
        Param::count("steps", 1000, "steps"),
        Param::count("vertices", 21, "vertices"),
    ],
    run: run_spin,
};

fn run_vibration(p: &Params) -> Result<Outcome, CaseError> {
    let vertices = p.count_in("vertices", 9, 1001)?;
    let (young, radius, length) = (p.positive("young_modulus")?, p.positive("radius")?, p.positive("length")?);
    let (density, viscosity) = (p.positive("density")?, p.number_in("viscosity", 0.0, f64::MAX)?);
    let per_period = p.count_in("steps_per_period", 20, 20_000)?;
    if radius > 0.05 * length {
        return Err(p.reject("radius", "at most a twentieth of the length (a slender rod)"));
    }
    let omega = clamped_free_root().powi(2) * (young * radius * radius / (4.0 * density * length.powi(4))).sqrt();
    let zeta = 1.5 * viscosity * omega / young;
    if zeta >= 0.9 {
        return Err(p.reject("viscosity", "a damping ratio 3 eta omega / (2 E) below 0.9"));
    }
    let reference = omega / std::f64::consts::TAU;
    let material =
        StrandMaterial { young_modulus: young, poisson_ratio: 0.3, density, viscosity, ..StrandMaterial::default() };
    let build = |n: usize| -> Result<(RodSet, Boundary), CaseError> {
        let edge = length / (n as f64 - 1.5);
        let mut rods = RodSet::new();
        let spec = StrandSpec::straight(V::x() * (-0.5 * edge), V::x() * length, n, radius, material);
        rods.add_strand(&spec).map_err(CaseError::failed)?;
        let mut boundary = Boundary::default();
        boundary.clamp(&rods, 0, rods::End::Root);
        Ok((rods, boundary))
    };
    let mut out = Outcome::new();
    let mut errors = Vec::new();
    let mut mode = f64::NAN;
    for n in resolutions(vertices) {
        let (rods, boundary) = build(n)?;
        mode = rods.slowest_mode(0, &Loads::default(), &boundary).max(0.0).sqrt() / std::f64::consts::TAU;
        errors.push((1.0 / (n as f64 - 1.5), (mode / reference - 1.0).abs()));
    }
    let scale = (40.0 / (vertices as f64 - 1.0)).max(1.0).powi(2);
    out.compare("frequency_mode", mode, reference, 2e-3 * scale);
    report_order(&mut out, "frequency_mode", &errors, 1e-8);

    // the same from a run: released from the static shape under a small tip load, counted over zero crossings
    let (mut rods, boundary) = build(vertices)?;
    let bending = young * std::f64::consts::FRAC_PI_4 * radius.powi(4);
    let mut force = vec![V::zeros(); vertices];
    force[vertices - 1] = V::new(0.0, 0.0, 3e-3 * bending / (length * length));
    settle(&mut rods, &Loads { force: Some(&force), ..Loads::default() }, &boundary)?;
    let start = rods.position[vertices - 1].z;
    let settings = RodSettings { integrator: Integrator::ImplicitMidpoint, tolerance: 1e-10, ..RodSettings::default() };
    let mut stepper = RodStepper::new(settings).map_err(CaseError::failed)?;
    let dt = 1.0 / (reference * per_period as f64);
    // three periods are enough; a strongly damped rod is measured over the first
    let periods = if zeta > 0.1 { 1 } else { 3 };
    let mut crossings = Vec::new();
    let mut extremes: Vec<f64> = Vec::new();
    let (mut before, mut before2) = (start, start);
    for step in 1..=(periods * per_period + per_period / 2) {
        stepper.advance(&mut rods, dt, &Loads::default(), &boundary).map_err(CaseError::failed)?;
        let z = rods.position[vertices - 1].z;
        if before * z < 0.0 {
            crossings.push(dt * (step as f64 - 1.0 + before / (before - z)));
        }
        if (before - before2) * (z - before) < 0.0 {
            extremes.push(before.abs());
        }
        (before2, before) = (before, z);
    }
    let gaps = crossings.len().saturating_sub(1);
    let frequency = if gaps > 0 { 0.5 * gaps as f64 / (crossings[gaps] - crossings[0]) } else { f64::NAN };
    let damped = reference * (1.0 - zeta * zeta).sqrt();
    // the midpoint rule shortens a frequency by (ω h)²/12
    let time = (std::f64::consts::TAU / per_period as f64).powi(2) / 12.0;
    out.compare("frequency", frequency, damped, 5e-3 * scale + 2.0 * time + 0.05 * zeta);
    if viscosity > 0.0 && extremes.len() >= 2 {
        let pairs = extremes.len() - 1;
        let decrement = (extremes[0] / extremes[pairs]).ln() / pairs as f64;
        let measured = decrement / (std::f64::consts::PI.powi(2) + decrement * decrement).sqrt();
        out.compare("damping_ratio", measured, zeta, 0.05 * scale);
    }
    Ok(out)
}

fn run_hanging(p: &Params) -> Result<Outcome, CaseError> {
    let (young, density, length) = (p.positive("young_modulus")?, p.positive("density")?, p.positive("length")?);
    let vertices = p.count_in("vertices", 2, 2001)?;
    let strain = density * GRAVITY * length / (2.0 * young);
    if !(1e-9..=0.02).contains(&strain) {
        return Err(p.reject("young_modulus", "an extension rho g L / (2 E) from 1e-9 to 0.02 of the length"));
    }
    let material = StrandMaterial { young_modulus: young, density, ..StrandMaterial::default() };
    let mut rods = RodSet::new();
    let spec = StrandSpec::straight(V::zeros(), V::new(0.0, 0.0, -length), vertices, 1e-3 * length, material);
    rods.add_strand(&spec).map_err(CaseError::failed)?;
    let mut boundary = Boundary::default();
    boundary.clamp(&rods, 0, rods::End::Root);
    // only the first vertex and the angle are held: the first edge must be free to stretch
    boundary.vertices.truncate(1);
    settle(&mut rods, &Loads::gravity(V::new(0.0, 0.0, -GRAVITY)), &boundary)?;
    let mut out = Outcome::new();
    let measured = -rods.position[vertices - 1].z / length - 1.0;
    // the tip loses round-off of the length; the exact discrete answer differs by the strain itself (linear law)
    out.compare("extension", measured, strain, 1e-6 + strain + 4e-16 * vertices as f64 / strain);
    Ok(out)
}

fn curl(vertices: usize) -> Vec<V> {
    (0..vertices)
        .map(|i| {
            let s = 10.0 * i as f64 / vertices as f64;
            V::new(0.01 * s.sin(), 0.01 * s.cos(), 0.01 * s)
        })
        .collect()
}

fn run_free_fall(p: &Params) -> Result<Outcome, CaseError> {
    let (dt, steps) = (p.number_in("step", 1e-7, 1.0)?, p.count_in("steps", 1, 100_000)?);
    let vertices = p.count_in("vertices", 2, 2001)?;
    let mut rods = RodSet::new();
    let spec = StrandSpec::new(curl(vertices), 1e-4, StrandMaterial::default());
    rods.add_strand(&spec).map_err(CaseError::failed)?;
    let start = rods.position.clone();
    let loads = Loads::gravity(V::new(0.0, 0.0, -GRAVITY));
    let mut stepper = RodStepper::new(RodSettings::default()).map_err(CaseError::failed)?;
    for _ in 0..steps {
        stepper.advance(&mut rods, dt, &loads, &Boundary::default()).map_err(CaseError::failed)?;
    }
    let fall = 0.5 * GRAVITY * dt * dt * steps as f64 * (steps as f64 + 1.0);
    let mean = start.iter().zip(&rods.position).map(|(a, b)| a.z - b.z).sum::<f64>() / vertices as f64;
    let worst =
        start.iter().zip(&rods.position).map(|(a, b)| (b - a + V::new(0.0, 0.0, fall)).norm()).fold(0.0, f64::max);
    let mut out = Outcome::new();
    // round-off of positions (a decimetre) is all that may remain
    out.compare("fall", mean, fall, 1e-12 + 1e-15 / fall);
    out.compare_absolute("worst_vertex", worst / (fall + 0.1), 0.0, 1e-12 * (1.0 + steps as f64 / 100.0));
    Ok(out)
}

fn run_spin(p: &Params) -> Result<Outcome, CaseError> {
    let rate = p.number_in("turns_per_second", 1e-3, 1e3)? * std::f64::consts::TAU;
    let (dt, steps) = (p.number_in("step", 1e-7, 1.0)?, p.count_in("steps", 8, 100_000)?);
    let vertices = p.count_in("vertices", 3, 2001)?;
    let turn = rate * dt;
    if turn > 0.3 {
        return Err(p.reject("step", "a turn of at most 0.3 rad per step"));
    }
    let mut spec = StrandSpec::straight(V::zeros(), V::new(0.1, 0.0, 0.0), vertices, 1e-4, StrandMaterial::default());
    let (axis, drift) = (V::new(0.0, 0.6, 0.8) * rate, V::new(0.1, -0.2, 0.3));
    spec.velocities = Some(spec.positions.iter().map(|x| axis.cross(&(x - V::new(0.05, 0.0, 0.0))) + drift).collect());
    let loads = Loads::default();
    let run = |dt: f64, steps: usize| -> Result<[f64; 3], CaseError> {
        let mut rods = RodSet::new();
        rods.add_strand(&spec).map_err(CaseError::failed)?;
        let settings = RodSettings { integrator: Integrator::Bdf2, tolerance: 1e-10, ..RodSettings::default() };
        let mut stepper = RodStepper::new(settings).map_err(CaseError::failed)?;
        let momentum = rods.momentum(&loads);
        let energy = rods.energy(&loads).total() - 0.5 * momentum.linear.norm_squared() / momentum.mass;
        // about the centre of mass: the drift must not hide a loss of spin
        let spin = |m: &rods::RodMomentum| m.angular - m.first_moment.cross(&m.linear) / m.mass;
        let before = spin(&momentum);
        let mut worst = [0.0f64; 3];
        for _ in 0..steps {
            stepper.advance(&mut rods, dt, &loads, &Boundary::default()).map_err(CaseError::failed)?;
            let now = rods.momentum(&loads);
            let own = rods.energy(&loads).total() - 0.5 * now.linear.norm_squared() / now.mass;
            worst[0] = worst[0].max((now.linear - momentum.linear).norm() / momentum.linear.norm());
            worst[1] = worst[1].max((spin(&now) - before).norm() / before.norm());
            worst[2] = worst[2].max((own / energy - 1.0).abs());
        }
        Ok(worst)
    };
    let mut out = Outcome::new();
    let [linear, angular, energy] = run(dt, steps)?;
    // BDF2 damps a rotation by (ω h)⁴/4 per step in amplitude; the implicit Euler step that starts it costs
    // (ω h)² once
    let bound = turn * turn + 0.5 * steps as f64 * turn.powi(4);
    out.compare_absolute("momentum_defect", linear, 0.0, 1e-10);
    out.compare_absolute("angular_momentum_defect", angular, 0.0, 2.0 * bound + 1e-9);
    out.compare_absolute("energy_defect", energy, 0.0, 4.0 * bound + 1e-9);
    let [_, finer, _] = run(0.5 * dt, 2 * steps)?;
    out.measure(
        "order_angular_momentum",
        (angular / finer).log2(),
        |o| o > 1.8 || angular < 1e-9,
        "defect falls at second order with the step (above 1.8), or is below 1e-9",
    );
    Ok(out)
}

/// A rod whose stress-free shape is a helix.
pub const HELIX: Case = Case {
    id: "rods/helix",
    about: "A rod with the curvature and torsion of a helix is free of force on it, returns to it when disturbed, and its discrete radius converges.",
    params: &[
        Param::number("radius", 1.0, "m", "radius of the helix"),
        Param::number("pitch", std::f64::consts::PI, "m", "rise per turn"),
        Param::number("turns", 2.0, "1", "turns"),
        Param::count("vertices", 81, "vertices of the finest rod"),
    ],
    run: run_helix,
};

/// The discrete rod of uniform Darboux vector, built edge by edge, and the radius of the circle its vertices project to.
fn discrete_helix(radius: f64, pitch: f64, turns: f64, n: usize) -> Result<(RodSet, f64), CaseError> {
    let c = pitch / std::f64::consts::TAU;
    let w = radius * radius + c * c;
    let (curvature, torsion) = (radius / w, c / w);
    let length = turns * std::f64::consts::TAU * w.sqrt();
    let l = length / (n as f64 - 1.0);
    // frame columns m1, m2, t; Darboux vector along m2 (bend) and t (torsion)
    let turn = nalgebra::Rotation3::new(V::new(0.0, curvature, torsion) * l);
    let mut frame = nalgebra::Rotation3::identity();
    let mut x = V::zeros();
    let mut positions = vec![x];
    for _ in 0..n - 1 {
        x += frame * V::z() * l;
        positions.push(x);
        frame *= turn;
    }
    let mut spec = StrandSpec::new(
        positions,
        1e-3 * length,
        StrandMaterial { young_modulus: 1e7, density: 1000.0, ..StrandMaterial::default() },
    )
    .with_rest(rods::RestShape::Uniform { curvature: [0.0, curvature], twist: torsion })
    .with_director(V::x());
    // director angles of the frames, measured from the space-parallel directors the set is built with
    let mut rods = RodSet::new();
    rods.add_strand(&spec).map_err(CaseError::failed)?;
    let mut frame = nalgebra::Rotation3::identity();
    let mut angles: Vec<f64> = Vec::new();
    for j in 0..n - 1 {
        let (t, d1) = (rods.tangent(0, j).0, rods.reference_director[j]);
        let m1 = frame * V::x();
        // from d1 to m1 about t
        let mut angle = d1.cross(&m1).dot(&t).atan2(m1.dot(&d1));
        if let Some(last) = angles.last() {
            angle += std::f64::consts::TAU * ((last - angle) / std::f64::consts::TAU).round();
        }
        angles.push(angle);
        frame *= turn;
    }
    spec.twist_angles = Some(angles);
    let mut rods = RodSet::new();
    rods.add_strand(&spec).map_err(CaseError::failed)?;
    // three projected vertices give the circle
    let axis = V::new(0.0, curvature, torsion).normalize();
    let flat = |i: usize| rods.position[i] - axis * axis.dot(&rods.position[i]);
    let (a, b, q) = (flat(1) - flat(0), flat(2) - flat(1), flat(2) - flat(0));
    let circle = a.norm() * b.norm() * q.norm() / (2.0 * a.cross(&b).norm());
    Ok((rods, circle))
}

fn run_helix(p: &Params) -> Result<Outcome, CaseError> {
    let (radius, pitch) = (p.positive("radius")?, p.number_in("pitch", 0.0, 1e6)?);
    let turns = p.number_in("turns", 0.1, 20.0)?;
    let vertices = p.count_in("vertices", 17, 2001)?;
    if (vertices as f64) < 8.0 * turns.max(1.0) + 1.0 {
        return Err(p.reject("vertices", "at least eight edges per turn"));
    }
    let mut out = Outcome::new();
    let mut errors = Vec::new();
    for n in resolutions(vertices) {
        if n as f64 - 1.0 >= 5.0 * turns {
            let (_, circle) = discrete_helix(radius, pitch, turns, n)?;
            errors.push((1.0 / (n as f64 - 1.0), (circle / radius - 1.0).abs()));
        }
    }
    let (mut rods, circle) = discrete_helix(radius, pitch, turns, vertices)?;
    let per_turn = (vertices as f64 - 1.0) / turns;
    out.compare("radius", circle, radius, 8.0 / (per_turn * per_turn));
    if errors.len() >= 2 {
        report_order(&mut out, "radius", &errors, 1e-9);
    }
    let force = rods.elastic_gradient(0).iter().fold(0.0f64, |m, v| m.max(v.abs()));
    out.compare_absolute("rest_force", force / rods.bending_force_scale(0), 0.0, 1e-8);
    // disturb and let go
    let rest = rods.position.clone();
    let mut boundary = Boundary::default();
    boundary.clamp(&rods, 0, rods::End::Root);
    for i in 2..vertices {
        let s = i as f64 / vertices as f64;
        rods.position[i] += V::new((5.0 * s).sin(), (3.0 * s).cos() - 1.0, (4.0 * s).sin()) * (0.1 * radius * s);
    }
    refresh_frames(&mut rods);
    settle(&mut rods, &Loads::default(), &boundary)?;
    let away = rods.position.iter().zip(&rest).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    out.compare_absolute("recovery", away / radius, 0.0, 1e-3);
    Ok(out)
}

/// Carries the reference directors onto tangents that were changed by hand.
pub(super) fn refresh_frames(rods: &mut RodSet) {
    for s in 0..rods.strand_count() {
        let (v, e) = (rods.vertices(s), rods.edges(s));
        for (j, k) in e.clone().enumerate() {
            let (t, _) = rods.tangent(s, j);
            let d = rods.reference_director[k];
            let flat = d - t * t.dot(&d);
            rods.reference_director[k] = flat.normalize();
        }
        for i in 1..v.len() - 1 {
            let (_, twist) = rods.element(s, i);
            rods.reference_twist[v.start + i] =
                twist - (rods.twist_angle[e.start + i] - rods.twist_angle[e.start + i - 1]);
        }
    }
}

//! Set-ups that more than one test or case uses.

use geometry::{Motion, ShapeDescription, Vector3};

use crate::generate::{YarnGroup, YarnShape};
use crate::settings::*;

/// Two yarns of twenty vertices over three circles, pulled by an attractor on an orbit (2-D): the set-up of the reference
/// trajectories; with `compat` as the printed note has it. Its step is 1e-4 s.
#[must_use]
pub fn two_yarns(compat: bool) -> YarnSettings {
    let cell: f64 = 1.0 / 64.0;
    let length = 0.5 * cell;
    let index = (0..20).map(f64::from);
    let a = index.clone().map(|i| vec![0.42 + i * length, 0.575]).collect();
    let b = index.map(|i| vec![0.44 + i * length * 0.3f64.cos(), 0.590 + i * length * 0.3f64.sin() * 0.5]).collect();
    let line = |points| YarnGroup::new(YarnShape::Polyline { points, rest_lengths: vec![], velocities: vec![] });
    let circle = |x: f64, y: f64, radius| ObstacleSettings {
        shape: ShapeDescription::Sphere { center: Vector3::new(x, y, 0.0), radius },
        motion: Motion::default(),
        friction: 0.3,
        restitution: 0.0,
    };
    let material = YarnMaterial {
        contact: ContactModuli::Lame { mu: 400.0, lambda: 600.0 },
        bending: Bending::Spring { stiffness: None },
        ..YarnMaterial::default()
    };
    YarnSettings {
        dimension: 2,
        cell,
        domain: Some(DomainSettings {
            origin: vec![0.0, 0.0],
            cells: vec![64, 64],
            walls: WallSettings::All(WallKind::Stick),
            layers: 3,
        }),
        materials: [("yarn".to_owned(), material)].into(),
        yarns: vec![line(a), YarnGroup { velocity: vec![0.5, -2.0], ..line(b) }],
        gravity: vec![0.0, -9.8],
        attractor: Some(AttractorSettings {
            path: PathSettings::Orbit { center: vec![0.5, 0.6], radii: (0.2, 0.1), angular_velocity: 40.0, phase: 0.0 },
            strength: vec![(0.0, 20.0)],
            softening: 0.01,
        }),
        obstacles: vec![circle(0.45, 0.50, 0.05), circle(0.62, 0.46, 0.04), circle(0.30, 0.42, 0.05)],
        momentum_hand_back: false,
        min_section: 1e-3,
        compat,
        ..YarnSettings::default()
    }
}

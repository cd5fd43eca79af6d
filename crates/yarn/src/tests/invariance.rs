//! A turned set-up moves as the set-up turned.

use nalgebra::{Rotation2, Rotation3, SMatrix, SVector, Vector3};

use super::{build, pair, pair_settings, polyline};
use crate::YarnSystem;

fn turned<const D: usize>(turn: &SMatrix<f64, D, D>, steps: usize, dt: f64, smooth: bool) -> (f64, f64) {
    let mut settings = pair_settings::<D>(2.0);
    let mut yarns = pair::<D>(2.0);
    if smooth {
        // One yarn that the grid resolves: contact itself acts over a cell and depends on where the nodes are.
        yarns.truncate(1);
        let (x, v) = &mut yarns[0];
        for (x, v) in x.iter().zip(v) {
            *v = SVector::repeat(0.3);
            v[1] += 1.0 - 300.0 * (x[0] - 0.5).powi(2);
        }
    }
    settings.yarns = yarns.iter().map(|(x, v)| polyline(x, v)).collect();
    let center = SVector::<f64, D>::repeat(0.5);
    let mut other = settings.clone();
    other.yarns = yarns
        .iter()
        .map(|(x, v)| {
            let x: Vec<_> = x.iter().map(|x| center + turn * (x - center)).collect();
            let v: Vec<_> = v.iter().map(|v| turn * v).collect();
            polyline(&x, &v)
        })
        .collect();
    let (mut a, mut b): (YarnSystem<D>, YarnSystem<D>) = (build(&settings), build(&other));
    let start = a.state().position.clone();
    for _ in 0..steps {
        assert_eq!(a.advance(dt).unwrap().substeps, 1);
        b.advance(dt).unwrap();
    }
    let error = |i: usize| (center + turn * (a.state().position[i] - center) - b.state().position[i]).norm();
    let moved = |i: usize| (a.state().position[i] - start[i]).norm();
    let n = start.len();
    let most = |f: &dyn Fn(usize) -> f64| (0..n).map(f).fold(0.0, f64::max);
    (most(&error), most(&moved))
}

#[test]
fn quarter_turn_in_the_plane_changes_nothing() {
    let turn = SMatrix::<f64, 2, 2>::new(0.0, -1.0, 1.0, 0.0);
    let (error, moved) = turned(&turn, 200, 8e-5, false);
    assert!(error < 1e-12 && moved > 0.01, "{error:e} {moved}");
}

#[test]
fn quarter_turns_in_space_change_nothing() {
    for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
        let turn = Rotation3::new(axis * std::f64::consts::FRAC_PI_2).matrix().map(|x: f64| x.round());
        let (error, moved) = turned::<3>(&turn, 200, 8e-5, false);
        assert!(error < 1e-12 && moved > 0.01, "{axis}: {error:e} {moved}");
    }
}

#[test]
fn any_other_turn_differs_by_the_grid_error_only() {
    let turn = *Rotation2::new(37f64.to_radians()).matrix();
    let (error, moved) = turned::<2>(&turn, 100, 8e-5, true);
    assert!(error < 0.02 * moved && error > 1e-9, "{error:e} {moved}");
}

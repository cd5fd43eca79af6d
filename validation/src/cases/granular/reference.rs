//! Reference trajectories of the original program: states and tensors as stored.

use granular::cell::Cell;
use granular::compat::{DirectedContact, DirectedSample};
use granular::grains::Grains;
use granular::law::{CentralLaw, Tension};
use granular::model::{ContactKind, ContactModel};
use serde_json::Value;

use crate::case::CaseError;

/// Two-sphere trajectories.
pub fn two_sphere() -> Result<Value, CaseError> {
    serde_json::from_str(include_str!("../../../data/granular/two_sphere_trajectories.json")).map_err(CaseError::failed)
}

/// The cross-linked assembly of 45 grains.
pub fn assembly() -> Result<Value, CaseError> {
    serde_json::from_str(include_str!("../../../data/granular/assembly_n45.json")).map_err(CaseError::failed)
}

/// A stored number; absent ones become NaN and so fail every comparison.
pub fn number(v: &Value) -> f64 {
    v.as_f64().unwrap_or(f64::NAN)
}

/// A stored list.
pub fn list(v: &Value) -> &[Value] {
    v.as_array().map_or(&[], Vec::as_slice)
}

fn contact(c: &Value) -> DirectedContact {
    let kind = match c["type"].as_str() {
        Some("stick") => ContactKind::Stick,
        Some("slip") => ContactKind::Slip,
        _ => ContactKind::Permanent,
    };
    let other = c["j"].as_u64().unwrap_or(0) as u32;
    DirectedContact { other, kind, spring: number(&c["s"]), rest: number(&c["d_eq"]) }
}

/// Builds the sample of a stored initial state.
pub fn sample(params: &Value, initial: &Value, applying_shear: bool) -> DirectedSample {
    let mut grains = Grains::default();
    let mut contacts = Vec::new();
    for (i, s) in list(&initial["spheres"]).iter().enumerate() {
        grains.push([number(&s["x"]), number(&s["y"])], number(&s["r"]), number(&s["m"]));
        grains.vx[i] = number(&s["vx"]);
        grains.vy[i] = number(&s["vy"]);
        grains.omega[i] = number(&s["omega"]);
        grains.angle[i] = number(&s["phi"]);
        grains.inertia[i] = number(&s["inertia"]);
        contacts.push(list(&s["contacts"]).iter().map(contact).collect());
    }
    let repulsion = number(&params["central_repulsion"]);
    let model = ContactModel {
        spring: number(&params["k"]),
        viscosity: number(&params["nu"]),
        tangential_spring: number(&params["k_t"]),
        tangential_viscosity: number(&params["nu_t"]),
        friction: number(&params["mu"]),
        law: CentralLaw::Blend { repulsion },
        tension: Tension::Linear,
        permanent_ratio_central: number(&params["permanent_ratio_central"]),
        permanent_ratio_tangential: number(&params["permanent_ratio_tangential"]),
        keep_viscosity: params["keep_viscosity_coefficients_constant"].as_bool() == Some(true),
    };
    let mut cell = Cell::new(number(&params["size_x"]), number(&params["size_y"]));
    cell.strain = number(&initial["shear"]);
    cell.rate = number(&initial["shear_rate"]);
    let mut sample = DirectedSample::new(grains, cell, model, 1);
    sample.contacts = contacts;
    sample.applying_shear = applying_shear;
    sample
}

/// Largest difference of the tensors to stored ones, relative to the largest stored entry.
pub fn tensor_error(sample: &DirectedSample, stored: &Value) -> f64 {
    let s = sample.stresses();
    let named = [
        ("love_weber", s.love_weber),
        ("external", s.external),
        ("linear_acceleration", s.linear),
        ("unbalanced_torque", s.torque),
        ("internal_torque", s.internal_torque),
        ("spin", s.centrifugal),
        ("otsuki", s.otsuki),
        ("overall", s.overall),
    ];
    let scale =
        named.iter().flat_map(|(name, _)| list(&stored[*name])).fold(f64::MIN_POSITIVE, |m, v| m.max(number(v).abs()));
    named.iter().fold(0.0, |worst, (name, t)| {
        t.0.iter().zip(list(&stored[*name])).fold(worst, |w, (a, b)| larger(w, (a - number(b)).abs() / scale))
    })
}

/// Largest difference of the state to a stored one: lengths over the box, velocities and spins over their largest.
/// Infinite if a contact is missing or of another kind.
pub fn state_error(sample: &DirectedSample, stored: &Value) -> f64 {
    let g = &sample.grains;
    let spheres = list(&stored["spheres"]);
    let most = |names: &[&str]| {
        spheres.iter().flat_map(|s| names.iter().map(|n| number(&s[*n]).abs())).fold(f64::MIN_POSITIVE, f64::max)
    };
    let (speed, spin) = (most(&["vx", "vy"]), most(&["omega"]));
    let mut worst = (sample.cell.strain - number(&stored["shear"])).abs();
    for (i, s) in spheres.iter().enumerate() {
        for (value, name, scale) in [
            (g.x[i], "x", sample.cell.width),
            (g.y[i], "y", sample.cell.height),
            (g.vx[i], "vx", speed),
            (g.vy[i], "vy", speed),
            (g.omega[i], "omega", spin),
            (g.angle[i], "phi", 1.0),
        ] {
            worst = larger(worst, (value - number(&s[name])).abs() / scale);
        }
        let listed: Vec<DirectedContact> = list(&s["contacts"]).iter().map(contact).collect();
        if listed.len() != sample.contacts[i].len() {
            return f64::INFINITY;
        }
        for (a, b) in sample.contacts[i].iter().zip(&listed) {
            if (a.other, a.kind) != (b.other, b.kind) {
                return f64::INFINITY;
            }
            worst = larger(worst, (a.spring - b.spring).abs() / g.radius[i]);
        }
    }
    worst
}

/// Maximum that does not lose a NaN.
pub fn larger(a: f64, b: f64) -> f64 {
    if b.is_nan() || b > a { b } else { a }
}

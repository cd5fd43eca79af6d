//! A moving capsule against a solid: contacts at its ends and at nearest points between them.

use super::pair::Capsule;
use super::solids::SolidField;
use crate::block::{Vec3, dot, norm_squared, sub};

/// Contact of a point of an edge with a solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceContact {
    /// Place on the edge, 0 … 1.
    pub alpha: f64,
    /// Outward normal of the solid.
    pub normal: Vec3,
    /// Gap along the normal at the start of the step [m].
    pub gap: f64,
    /// Velocity of the solid at the contact [m/s].
    pub velocity: Vec3,
    /// When in the step they meet, 0 … 1.
    pub time: f64,
}

/// Contacts of an edge of radius `radius` with a solid: its first vertex, the last one if `last`, and the nearest interior
/// point where that is nearer than both ends.
pub fn surface_contacts(
    edge: &Capsule,
    radius: f64,
    solid: &dyn SolidField,
    proximity: f64,
    continuous: bool,
    last: bool,
    mut found: impl FnMut(SurfaceContact),
) {
    let start = |alpha: f64| lerp(&edge[0][0], &edge[0][1], alpha);
    let end = |alpha: f64| lerp(&edge[1][0], &edge[1][1], alpha);
    let mut consider = |alpha: f64| {
        if let Some(c) = point_contact(&start(alpha), &end(alpha), alpha, radius, solid, proximity, continuous) {
            found(c);
        }
    };
    consider(0.0);
    if last {
        consider(1.0);
    }
    let length = norm_squared(&sub(&edge[0][1], &edge[0][0])).sqrt();
    let fractions: &[f64] = if continuous { &[0.0, 1.0] } else { &[0.0] };
    for fraction in fractions {
        let distance = |alpha: f64| {
            let p = if *fraction == 0.0 { start(alpha) } else { end(alpha) };
            solid.sample(&p, *fraction).0
        };
        let ends = [distance(0.0), distance(1.0)];
        // distance changes by at most the length along the edge: a nearer interior point must be within reach at all
        if ends[0].min(ends[1]) - 0.5 * length > radius + proximity {
            continue;
        }
        let samples = [0.25, 0.5, 0.75].map(|a| (a, distance(a)));
        let mut nearest = samples[0];
        for s in samples {
            if s.1 < nearest.1 {
                nearest = s;
            }
        }
        // strictly nearer than the line between the ends: a bump towards the solid, not a flat stretch or an end
        let chord = ends[0] + nearest.0 * (ends[1] - ends[0]);
        if nearest.1 < chord - 1e-6 * length && nearest.1 < ends[0].min(ends[1]) {
            let (mut lo, mut hi) = (nearest.0 - 0.25, nearest.0 + 0.25);
            for _ in 0..24 {
                let (a, b) = (lo + 0.381_966 * (hi - lo), lo + 0.618_034 * (hi - lo));
                if distance(a) < distance(b) { hi = b } else { lo = a }
            }
            consider(0.5 * (lo + hi));
            break;
        }
    }
}

fn lerp(a: &Vec3, b: &Vec3, t: f64) -> Vec3 {
    [0, 1, 2].map(|c| a[c] + t * (b[c] - a[c]))
}

/// Sphere tracing in time: the distance cannot shrink faster than point and solid move.
fn point_contact(
    start: &Vec3,
    end: &Vec3,
    alpha: f64,
    radius: f64,
    solid: &dyn SolidField,
    proximity: f64,
    continuous: bool,
) -> Option<SurfaceContact> {
    let (d0, n0) = solid.sample(start, 0.0);
    if !d0.is_finite() {
        return None;
    }
    if d0 <= radius + proximity {
        let velocity = solid.velocity(start, 0.0);
        return Some(SurfaceContact { alpha, normal: n0, gap: d0 - radius, velocity, time: 0.0 });
    }
    if !continuous {
        return None;
    }
    let travel = norm_squared(&sub(end, start)).sqrt();
    let solid_travel = norm_squared(&solid.velocity(start, 0.0)).sqrt() * solid.dt();
    // a turning solid may be faster elsewhere on the way
    let speed = travel + 1.5 * solid_travel;
    if d0 - radius > speed {
        return None;
    }
    let tolerance = 1e-3 * radius.max(1e-6 * speed);
    let (mut t, mut d) = (0.0, d0);
    for _ in 0..200 {
        t += (d - radius) / speed;
        if !(t <= 1.0) {
            return None;
        }
        let p = lerp(start, end, t);
        let (distance, normal) = solid.sample(&p, t);
        d = distance;
        if d <= radius + tolerance {
            let velocity = solid.velocity(&p, t);
            // where the touched point of the solid was at the start, along the normal
            let moved = dot(&normal, &sub(&p, start)) - t * solid.dt() * dot(&normal, &velocity);
            return Some(SurfaceContact { alpha, normal, gap: d - radius - moved, velocity, time: t });
        }
    }
    None
}

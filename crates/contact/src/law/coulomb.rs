//! Coulomb's cone: projection, De Saxcé's change of variable, the natural map that judges every solver.

use crate::block::{Vec3, norm_squared, sub, tangential_norm};
use serde::{Deserialize, Serialize};

/// What a contact does in the solution.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum ContactState {
    /// No impulse: the bodies part or have not met.
    Open,
    /// Inside the cone, no relative motion.
    Stick,
    /// On the cone's boundary, sliding.
    Slip,
    /// Pulled together by the cohesive bond: impulse in traction.
    Cohesive,
}

impl ContactState {
    /// The name written into records: `open`, `stick`, `slip`, `cohesive`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            ContactState::Open => "open",
            ContactState::Stick => "stick",
            ContactState::Slip => "slip",
            ContactState::Cohesive => "cohesive",
        }
    }
}

/// De Saxcé's shifted velocity `u + ν‖u_T‖ e_N`. A negative `friction` marks a bilateral contact and shifts nothing.
#[inline]
#[must_use]
pub fn de_saxce(u: &Vec3, friction: f64) -> Vec3 {
    [u[0] + friction.max(0.0) * tangential_norm(u), u[1], u[2]]
}

/// Orthogonal projection of `z` on the cone `‖z_T‖ ≤ ν z_N`; the whole space for a negative `friction`.
#[inline]
#[must_use]
pub fn project_cone(z: &Vec3, friction: f64) -> Vec3 {
    if friction < 0.0 {
        return *z;
    }
    let t = tangential_norm(z);
    // without friction the cone is a half-line, and what points against it lies in its polar, not in it
    if z[0] >= 0.0 && t <= friction * z[0] {
        return *z;
    }
    if friction * t <= -z[0] {
        return [0.0; 3];
    }
    let n = (z[0] + friction * t) / (1.0 + friction * friction);
    if t == 0.0 {
        return [n, 0.0, 0.0];
    }
    let s = friction * n / t;
    [n, s * z[1], s * z[2]]
}

/// The natural map `r − P_K(r − ρ (u + ν‖u_T‖ e_N))`: zero exactly where the law holds.
///
/// - `r`: impulse including the cohesive shift [N s]
/// - `u`: relative velocity [m/s]
/// - `friction`: Coulomb coefficient, negative for a bilateral contact
/// - `rho`: weight that brings the velocity to the unit of the impulse [kg]; 1 for the public problems
///
/// Source: Acary, Brémond and Huber 2018, section 3.2; spec 7.4.
#[inline]
#[must_use]
pub fn natural_map(r: &Vec3, u: &Vec3, friction: f64, rho: f64) -> Vec3 {
    let shifted = de_saxce(u, friction);
    let z = [r[0] - rho * shifted[0], r[1] - rho * shifted[1], r[2] - rho * shifted[2]];
    sub(r, &project_cone(&z, friction))
}

/// What a contact does, judged on the impulse with the cohesive shift `r_hat` and the velocity `u`.
///
/// `impulse_scale` [N s] and `velocity_scale` [m/s] are the sizes below which a number counts as zero (the solver's
/// tolerance times the size of the problem).
#[must_use]
pub fn classify(
    r_hat: &Vec3,
    u: &Vec3,
    friction: f64,
    cohesion: f64,
    impulse_scale: f64,
    velocity_scale: f64,
) -> ContactState {
    if norm_squared(r_hat).sqrt() <= impulse_scale {
        return ContactState::Open;
    }
    if cohesion > 0.0 && r_hat[0] < cohesion && u[0].abs() <= velocity_scale {
        return ContactState::Cohesive;
    }
    let on_boundary = tangential_norm(r_hat) >= friction * r_hat[0] - impulse_scale;
    if friction >= 0.0 && on_boundary && tangential_norm(u) > velocity_scale {
        ContactState::Slip
    } else {
        ContactState::Stick
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block::dot;
    use proptest::prelude::*;

    proptest! {
        /// The projection is the nearest point: the remainder lies in the polar cone and is orthogonal to it.
        #[test]
        fn projection_splits_into_cone_and_polar(z in proptest::array::uniform3(-2.0..2.0f64), nu in 0.0..2.0f64) {
            let p = project_cone(&z, nu);
            let d = sub(&z, &p);
            prop_assert!(tangential_norm(&p) <= nu * p[0] + 1e-14);
            prop_assert!(dot(&p, &d).abs() < 1e-13);
            // the polar cone: d_N <= -nu |d_T|
            prop_assert!(d[0] <= -nu * tangential_norm(&d) + 1e-13);
        }

        /// Stick, slip and open pairs built by hand are zeros of the natural map for any weight.
        #[test]
        fn natural_map_vanishes_on_the_law(nu in 0.01..2.0f64, n in 0.1..3.0f64, a in 0.0..6.3f64, s in 0.01..5.0f64, rho in 0.01..10.0f64) {
            let t = [a.cos(), a.sin()];
            let slip = ([n, -nu * n * t[0], -nu * n * t[1]], [0.0, s * t[0], s * t[1]]);
            let stick = ([n, 0.5 * nu * n * t[0], 0.5 * nu * n * t[1]], [0.0; 3]);
            let open = ([0.0; 3], [s, n * t[0], n * t[1]]);
            for (r, u) in [slip, stick, open] {
                let f = natural_map(&r, &u, nu, rho);
                prop_assert!(norm_squared(&f).sqrt() < 1e-13 * (1.0 + rho) * (1.0 + nu) * 10.0);
            }
            // a sliding body that would lift is not a solution
            let lift = natural_map(&slip.0, &[0.1, slip.1[1], slip.1[2]], nu, rho);
            prop_assert!(norm_squared(&lift).sqrt() > 1e-4);
        }
    }

    #[test]
    fn without_friction_the_cone_is_a_half_line() {
        assert_eq!(project_cone(&[-1.0, 0.0, 0.0], 0.0), [0.0; 3]);
        assert_eq!(project_cone(&[-1.0, 0.5, 0.0], 0.0), [0.0; 3]);
        assert_eq!(project_cone(&[2.0, 0.0, 0.0], 0.0), [2.0, 0.0, 0.0]);
        assert_eq!(project_cone(&[2.0, 0.5, -0.5], 0.0), [2.0, 0.0, 0.0]);
        // open, parting straight
        assert_eq!(natural_map(&[0.0; 3], &[0.3, 0.0, 0.0], 0.0, 1.0), [0.0; 3]);
    }

    #[test]
    fn states_are_told_apart() {
        let z = 1e-9;
        assert_eq!(classify(&[0.0; 3], &[1.0, 0.0, 0.0], 0.3, 0.0, z, z), ContactState::Open);
        assert_eq!(classify(&[1.0, 0.1, 0.0], &[0.0; 3], 0.3, 0.0, z, z), ContactState::Stick);
        assert_eq!(classify(&[1.0, 0.3, 0.0], &[0.0, -1.0, 0.0], 0.3, 0.0, z, z), ContactState::Slip);
        assert_eq!(classify(&[1.0, 0.1, 0.0], &[0.0; 3], 0.3, 2.0, z, z), ContactState::Cohesive);
    }
}

//! How far an answer is from Coulomb's law, contact by contact and in velocity units.
//!
//! Written from the three cases of the law (open, stick, slip) and not from the natural map or the change of variable by
//! which the solvers and the cone programmes work, so that it can judge both: large impulses do not make it small.

use super::ContactProblem;
use crate::block::{Vec3, dot, norm_squared, trace};

/// What of the law one contact breaks; all in velocity units [m/s]. Impulses count by the velocity `tr W_kk / 3` that
/// a unit of them gives to their own contact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Violation {
    /// Approach speed `max(0, −u_N)`.
    pub approach: f64,
    /// Impulse outside its cone: pull, or more friction than `ν r_N`.
    pub cone: f64,
    /// Normal impulse and opening speed at once: the smaller of the two.
    pub complementarity: f64,
    /// Sliding with an impulse that is not `−ν r_N` along the slip: the smaller of the slip and of the impulse missing.
    pub slip: f64,
}

impl Violation {
    /// The largest of the four.
    #[must_use]
    pub fn worst(&self) -> f64 {
        self.approach.max(self.cone).max(self.complementarity).max(self.slip)
    }

    /// What a contact with shifted impulse `r` [N s], velocity `u` [m/s] and mobility `w` [1/kg] breaks.
    #[must_use]
    pub fn of(r: &Vec3, u: &Vec3, friction: f64, w: f64) -> Self {
        if friction < 0.0 {
            // bilateral: nothing may move
            return Violation { approach: norm_squared(u).sqrt(), ..Violation::default() };
        }
        let slip_speed = u[1].hypot(u[2]);
        let friction_impulse = r[1].hypot(r[2]);
        let bound = friction * r[0].max(0.0);
        let missing = if slip_speed > 0.0 {
            let t = [u[1] / slip_speed, u[2] / slip_speed];
            (r[1] + bound * t[0]).hypot(r[2] + bound * t[1])
        } else {
            0.0
        };
        Violation {
            approach: (-u[0]).max(0.0),
            cone: w * (-r[0]).max(friction_impulse - bound).max(0.0),
            complementarity: (w * r[0]).min(u[0]).max(0.0),
            slip: slip_speed.min(w * missing),
        }
    }
}

/// The law's violation by impulses `r` (cohesive shift not included), for the velocities that they give.
#[must_use]
pub fn violations(problem: &ContactProblem, impulses: &[Vec3]) -> Vec<Violation> {
    let velocities = problem.velocities(impulses);
    (0..problem.len())
        .map(|k| {
            let mut r = impulses[k];
            r[0] += problem.cohesion_of(k);
            Violation::of(&r, &velocities[k], problem.friction[k], trace(problem.delassus.diagonal(k)) / 3.0)
        })
        .collect()
}

/// The largest violation of any contact, relative to the root mean square of the free velocities (cohesive shift included).
#[must_use]
pub fn worst_violation(problem: &ContactProblem, impulses: &[Vec3]) -> f64 {
    let q = problem.shifted_velocity();
    let size = (q.iter().map(|v| dot(v, v)).sum::<f64>() / q.len().max(1) as f64).sqrt();
    let worst = violations(problem, impulses).iter().map(Violation::worst).fold(0.0, f64::max);
    if size > 0.0 { worst / size } else { worst }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::natural_map;
    use proptest::prelude::*;

    proptest! {
        /// Exact stick, slip and open pairs break nothing; a disturbance breaks about as much as it is large.
        #[test]
        fn vanishes_on_the_law_and_only_there(
            nu in 0.05..1.5f64, n in 0.1..3.0f64, a in 0.0..6.3f64, s in 0.1..5.0f64, w in 0.1..10.0f64, e in 1e-6..1e-2f64,
        ) {
            let t = [a.cos(), a.sin()];
            let cases = [
                ([n, -nu * n * t[0], -nu * n * t[1]], [0.0, s * t[0], s * t[1]]),
                ([n, 0.5 * nu * n * t[0], 0.5 * nu * n * t[1]], [0.0; 3]),
                ([0.0; 3], [s, n * t[0], n * t[1]]),
            ];
            for (r, u) in cases {
                prop_assert!(Violation::of(&r, &u, nu, w).worst() < 1e-13 * (1.0 + w));
                for c in 0..3 {
                    let mut v = u;
                    v[c] -= e;
                    let broken = Violation::of(&r, &v, nu, w).worst();
                    prop_assert!(broken <= 3.0 * e * (1.0 + w) * (1.0 + n / s) * (1.0 + nu));
                    // what the natural map calls broken is broken here too
                    let map = norm_squared(&natural_map(&r, &v, nu, 1.0 / w)).sqrt() * w;
                    prop_assert!(map <= 10.0 * (1.0 + nu) * broken + 1e-12 * (1.0 + w), "{} {}", map, broken);
                }
            }
        }
    }

    #[test]
    fn each_part_of_the_law_is_seen() {
        let v = |r, u| Violation::of(&r, &u, 0.5, 2.0);
        assert_eq!(v([1.0, 0.0, 0.0], [-0.1, 0.0, 0.0]).approach, 0.1);
        assert_eq!(v([-1.0, 0.0, 0.0], [0.0; 3]).cone, 2.0);
        assert_eq!(v([1.0, 0.75, 0.0], [0.0; 3]).cone, 0.5);
        assert_eq!(v([1.0, 0.0, 0.0], [0.3, 0.0, 0.0]).complementarity, 0.3);
        assert_eq!(v([1.0, 0.5, 0.0], [0.0, 0.3, 0.0]).slip, 0.3);
        // an enormous impulse does not hide a small slip
        assert_eq!(v([1e9, 0.0, 0.0], [0.0, 1e-3, 0.0]).slip, 1e-3);
        assert_eq!(Violation::of(&[1.0, 2.0, 3.0], &[0.0, 0.0, 0.2], -1.0, 1.0).approach, 0.2);
    }
}

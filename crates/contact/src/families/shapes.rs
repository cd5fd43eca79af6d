//! The families: walls and towers of boxes, capsule piles, arches, chains, sphere piles, single bodies, vehicles.

use super::bodies::Bodies;
use super::random::{Random, random_system};
use crate::block::Vec3;
use crate::problem::ContactProblem;

const GRAVITY: Vec3 = [0.0, 0.0, -9.81];
const STEP: f64 = 0.01;

/// A named family; each member follows from a seed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// A tower of boxes of very different mass, tilted gravity.
    Tower,
    /// A wall of boxes, four contacts per joint.
    Boxes,
    /// A masonry arch.
    Arch,
    /// A hanging chain of links, two contacts per link.
    Chain,
    /// A loose pile of spheres.
    Spheres,
    /// A pile of capsules, half of them parallel: line contacts as two points.
    Capsules,
    /// One body on many supports.
    OneObject,
    /// A wheeled vehicle: few contacts, light wheels, heavy hull.
    Vehicle,
    /// Random systems, often rank deficient.
    Random,
}

impl Family {
    /// All families.
    pub const ALL: [Family; 9] = [
        Family::Tower,
        Family::Boxes,
        Family::Arch,
        Family::Chain,
        Family::Spheres,
        Family::Capsules,
        Family::OneObject,
        Family::Vehicle,
        Family::Random,
    ];

    /// The name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Family::Tower => "tower",
            Family::Boxes => "boxes",
            Family::Arch => "arch",
            Family::Chain => "chain",
            Family::Spheres => "spheres",
            Family::Capsules => "capsules",
            Family::OneObject => "one_object",
            Family::Vehicle => "vehicle",
            Family::Random => "random",
        }
    }

    /// The member of a seed. Odd seeds have random extra velocities (impacts), every third a matrix that is not exactly
    /// symmetric (an implicit gyroscopic term of relative size 1e-3, as in some public files).
    #[must_use]
    pub fn member(self, seed: u64) -> ContactProblem {
        self.larger_member(seed, 1)
    }

    /// The member of a seed with up to `times` as many bodies.
    #[must_use]
    pub fn larger_member(self, seed: u64, times: usize) -> ContactProblem {
        let times = times.max(1);
        let mut r = Random::new(seed.wrapping_mul(31).wrapping_add(self as u64));
        let shake = if seed % 2 == 1 { r.uniform(0.0, 0.1) } else { 0.0 };
        let friction = r.uniform(0.1, 1.0);
        let tilt = [r.uniform(-6.0, 6.0), r.uniform(-3.0, 3.0), -9.81];
        let spin = if seed % 3 == 2 { 1e-3 } else { 0.0 };
        match self {
            Family::Tower => {
                let n = r.index(2 * times, 15 * times);
                tower(&mut r, n, friction, tilt, shake, spin)
            }
            Family::Boxes => {
                let (nx, ny) = (r.index(2, 5 + times), r.index(2, 6));
                boxes(&mut r, nx, ny, friction, if seed % 4 < 2 { GRAVITY } else { tilt }, shake, spin)
            }
            Family::Arch => {
                let n = r.index(5 * times, 40 * times);
                arch(&mut r, n, friction, shake, spin)
            }
            Family::Chain => {
                let n = r.index(3 * times, 40 * times);
                chain(&mut r, n, friction, shake.max(0.02), spin)
            }
            Family::Spheres => {
                let n = r.index(5 * times, 150 * times);
                spheres(&mut r, n, friction, shake, spin)
            }
            Family::Capsules => {
                let n = r.index(5 * times, 100 * times);
                capsules(&mut r, n, friction, shake, spin)
            }
            Family::OneObject => {
                let n = r.index(3, 30 * times);
                one_object(&mut r, n, friction, shake, spin)
            }
            Family::Vehicle => {
                let n = r.index(2 * times, 5 * times);
                vehicle(&mut r, n, friction, shake, spin)
            }
            Family::Random => {
                let n = r.index(2 * times, 40 * times);
                let dofs = r.index(3, 6 * n);
                random_system(&mut r, n, dofs, (0.0, 1.2), 0.0)
            }
        }
    }
}

fn settle(mut s: Bodies, r: &mut Random, gravity: Vec3, shake: f64, spin: f64) -> ContactProblem {
    if spin > 0.0 {
        s.gyroscopic = (0..s.mass.len()).map(|_| r.direction().map(|v| spin * v)).collect();
    }
    s.accelerate(gravity, STEP);
    for v in &mut s.velocity {
        for c in v.iter_mut() {
            *c += shake * r.normal();
        }
    }
    s.problem()
}

/// A tower of `n` unit boxes with masses 0.1 … 10 kg, four contacts per joint.
#[must_use]
pub fn tower(r: &mut Random, n: usize, friction: f64, gravity: Vec3, shake: f64, spin: f64) -> ContactProblem {
    let mut s = Bodies::default();
    for j in 0..n {
        let m = r.uniform(0.1, 10.0);
        let b = s.add([0.0, 0.0, j as f64 + 0.5], m, [m / 6.0; 3]);
        for dx in [-0.5, 0.5] {
            for dy in [-0.5, 0.5] {
                s.touch(b, b.checked_sub(1), [dx, dy, j as f64], [0.0, 0.0, 1.0], friction);
            }
        }
    }
    settle(s, r, gravity, shake, spin)
}

/// A wall of `nx` × `ny` unit boxes laid with half a box of overlap, four contacts per joint.
#[must_use]
pub fn boxes(
    r: &mut Random,
    nx: usize,
    ny: usize,
    friction: f64,
    gravity: Vec3,
    shake: f64,
    spin: f64,
) -> ContactProblem {
    let mut s = Bodies::default();
    for j in 0..ny {
        for i in 0..nx {
            s.add([i as f64 + if j % 2 == 1 { 0.5 } else { 0.0 }, 0.0, j as f64 + 0.5], 1.0, [1.0 / 6.0; 3]);
        }
    }
    for j in 0..ny {
        for i in 0..nx {
            let b = j * nx + i;
            let x = s.centre[b][0];
            let z = j as f64;
            if j == 0 {
                for dx in [-0.5, 0.5] {
                    for dy in [-0.5, 0.5] {
                        s.touch(b, None, [x + dx, dy, 0.0], [0.0, 0.0, 1.0], friction);
                    }
                }
            } else {
                for c in 0..nx {
                    let a = (j - 1) * nx + c;
                    let (lo, hi) = ((x - 0.5).max(s.centre[a][0] - 0.5), (x + 0.5).min(s.centre[a][0] + 0.5));
                    if hi - lo > 0.1 {
                        for px in [lo, hi] {
                            for dy in [-0.5, 0.5] {
                                s.touch(b, Some(a), [px, dy, z], [0.0, 0.0, 1.0], friction);
                            }
                        }
                    }
                }
            }
            if i > 0 {
                for dz in [-0.5, 0.5] {
                    for dy in [-0.5, 0.5] {
                        s.touch(b, Some(b - 1), [x - 0.5, dy, z + 0.5 + dz], [1.0, 0.0, 0.0], friction);
                    }
                }
            }
        }
    }
    settle(s, r, gravity, shake, spin)
}

/// A semicircular masonry arch of `n` stones, four contacts per joint, springing from the ground.
#[must_use]
pub fn arch(r: &mut Random, n: usize, friction: f64, shake: f64, spin: f64) -> ContactProblem {
    let mut s = Bodies::default();
    let (inner, outer) = (1.0, 1.2);
    let width = std::f64::consts::PI * 1.1 / n as f64;
    for j in 0..n {
        let a = std::f64::consts::PI * (j as f64 + 0.5) / n as f64;
        let m = width * 0.2 * 0.3 * 2000.0;
        let i = m / 12.0 * (0.3_f64.powi(2) + 0.2_f64.powi(2));
        s.add([1.1 * a.cos(), 0.0, 1.1 * a.sin()], m, [i; 3]);
    }
    for j in 0..=n {
        let a = std::f64::consts::PI * j as f64 / n as f64;
        let (e, t) = ([a.cos(), 0.0, a.sin()], [-a.sin(), 0.0, a.cos()]);
        for radius in [inner, outer] {
            for y in [-0.15, 0.15] {
                let p = [radius * e[0], y, radius * e[2]];
                if j < n {
                    s.touch(j, j.checked_sub(1), p, t, friction);
                } else {
                    s.touch(n - 1, None, p, t.map(|v| -v), friction);
                }
            }
        }
    }
    settle(s, r, GRAVITY, shake, spin)
}

/// A hanging chain of `n` links, two contacts between neighbours, alternating planes.
#[must_use]
pub fn chain(r: &mut Random, n: usize, friction: f64, shake: f64, spin: f64) -> ContactProblem {
    let mut s = Bodies::default();
    for j in 0..n {
        s.add([0.0, 0.0, -(j as f64)], 1.0, [0.2, 0.1, 0.15]);
    }
    for j in 0..n {
        for y in [-0.05, 0.05] {
            let (p, slope) = if j % 2 == 1 { ([y, 0.0], [6.0 * y, 0.0]) } else { ([0.0, y], [0.0, 6.0 * y]) };
            s.touch(j, j.checked_sub(1), [p[0], p[1], 0.5 - j as f64], [slope[0], slope[1], 1.0], friction);
        }
    }
    settle(s, r, GRAVITY, shake, spin)
}

/// A loose pile of `n` spheres in a box of about their own volume.
#[must_use]
pub fn spheres(r: &mut Random, n: usize, friction: f64, shake: f64, spin: f64) -> ContactProblem {
    let mut s = Bodies::default();
    let side = (0.6 * n as f64).cbrt();
    for _ in 0..n {
        s.add([r.uniform(0.0, side), r.uniform(0.0, side), r.uniform(0.0, side)], 1.0, [0.1; 3]);
    }
    for i in 0..n {
        for j in 0..i {
            let d = crate::block::sub(&s.centre[i], &s.centre[j]);
            let l = crate::block::norm_squared(&d).sqrt();
            if l < 1.0 {
                let mid = [0, 1, 2].map(|c| 0.5 * (s.centre[i][c] + s.centre[j][c]));
                s.touch(i, Some(j), mid, d, friction);
            }
        }
        let c = s.centre[i];
        if c[2] < 0.5 {
            s.touch(i, None, [c[0], c[1], 0.0], [0.0, 0.0, 1.0], friction);
        }
    }
    settle(s, r, GRAVITY, shake, spin)
}

/// A pile of `n` capsules; parallel neighbours touch along a line, given as two points.
#[must_use]
pub fn capsules(r: &mut Random, n: usize, friction: f64, shake: f64, spin: f64) -> ContactProblem {
    let mut s = Bodies::default();
    let side = (0.9 * n as f64).cbrt();
    let mut axis = Vec::new();
    for i in 0..n {
        s.add([r.uniform(0.0, side), r.uniform(0.0, side), r.uniform(0.0, side)], 1.0, [0.02, 0.1, 0.1]);
        let d = r.direction();
        axis.push(if i < n / 2 { [1.0, 0.0, 0.0] } else { d });
    }
    for i in 0..n {
        for j in 0..i {
            let d = crate::block::sub(&s.centre[i], &s.centre[j]);
            let l = crate::block::norm_squared(&d).sqrt();
            if l < 1.0 {
                let mid = [0, 1, 2].map(|c| 0.5 * (s.centre[i][c] + s.centre[j][c]));
                let across = (d[1] * d[1] + d[2] * d[2]).sqrt();
                if i < n / 2 && across > 0.2 {
                    for t in [-0.3, 0.3] {
                        s.touch(i, Some(j), [mid[0] + t, mid[1], mid[2]], [0.0, d[1], d[2]], friction);
                    }
                } else {
                    s.touch(i, Some(j), mid, d, friction);
                }
            }
        }
        let c = s.centre[i];
        if c[2] < 0.5 {
            for t in [-0.4, 0.4] {
                let p = [c[0] + t * axis[i][0], c[1] + t * axis[i][1], 0.0];
                s.touch(i, None, p, [0.0, 0.0, 1.0], friction);
            }
        }
    }
    settle(s, r, GRAVITY, shake, spin)
}

/// One body held by `n` contacts with the ground and a wall: up to five times more equations than freedoms.
#[must_use]
pub fn one_object(r: &mut Random, n: usize, friction: f64, shake: f64, spin: f64) -> ContactProblem {
    let mut s = Bodies::default();
    let b = s.add([0.0, 0.0, 0.3], 1.0, [0.02, 0.03, 0.01]);
    for k in 0..n {
        let (x, y) = (r.uniform(-0.5, 0.5), r.uniform(-0.5, 0.5));
        if k % 3 == 2 {
            s.touch(b, None, [-0.5, y, 0.3 + 0.3 * x], [1.0, 0.05 * y, 0.0], friction);
        } else {
            s.touch(b, None, [x, y, 0.0], [0.0, 0.02 * x, 1.0], friction);
        }
    }
    let gravity = [r.uniform(-3.0, 1.0), 1.0, -9.81];
    settle(s, r, gravity, shake + 0.02, spin)
}

/// A heavy hull on `axles` pairs of light wheels joined to it by contacts, wheels on the ground.
#[must_use]
pub fn vehicle(r: &mut Random, axles: usize, friction: f64, shake: f64, spin: f64) -> ContactProblem {
    let mut s = Bodies::default();
    let hull = s.add([0.0, 0.0, 0.8], 50.0, [5.0, 10.0, 12.0]);
    for a in 0..axles {
        let x = a as f64 - 0.5 * (axles as f64 - 1.0);
        for y in [-0.6, 0.6] {
            let w = s.add([x, y, 0.3], 1.0, [0.02, 0.03, 0.02]);
            s.touch(w, None, [x, y, 0.0], [0.0, 0.0, 1.0], friction);
            for dx in [-0.05, 0.05] {
                s.touch(hull, Some(w), [x + dx, y, 0.4], [-dx, 0.0, 1.0], friction);
            }
        }
    }
    settle(s, r, [1.0, 0.5, -9.81], shake, spin)
}

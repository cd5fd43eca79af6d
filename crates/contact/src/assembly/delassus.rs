//! Columns `K⁻¹ Hᵀ`, blocks of `W`, and the way back.

use super::point::PosedContact;
use super::rows::{Busy, Standing, rows};
use super::share::{Scratch, Share, Touch};
use crate::block::Vec3;
use crate::problem::ContactProblem;
use rayon::prelude::*;
use thiserror::Error;

/// The inverse dynamics of many strands, as the rods' factorised step matrices give it.
pub trait InverseDynamics: Sync {
    /// Number of freedoms of a strand.
    fn dofs(&self, strand: usize) -> usize;

    /// Turns an impulse into the change of velocity, in place: `x ← K⁻¹ x` for one strand.
    fn apply(&self, strand: usize, x: &mut [f64]);

    /// The same for three impulses at once, stored freedom by freedom (`x[3 d + c]`); override it where the factors can
    /// share a pass.
    fn apply_three(&self, strand: usize, x: &mut [f64]) {
        let n = self.dofs(strand);
        let mut one = vec![0.0; n];
        for c in 0..3 {
            for d in 0..n {
                one[d] = x[3 * d + c];
            }
            self.apply(strand, &mut one);
            for d in 0..n {
                x[3 * d + c] = one[d];
            }
        }
    }
}

/// Why a system cannot be assembled.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum AssemblyError {
    /// A contact names freedoms that its strand does not have.
    #[error("contact {contact} touches freedoms outside strand {strand}")]
    OutOfRange {
        /// Which contact.
        contact: usize,
        /// Which strand.
        strand: usize,
    },
    /// A column or velocity is not finite.
    #[error("the inverse dynamics of strand {strand} returned a number that is not finite")]
    NotFinite {
        /// Which strand.
        strand: usize,
    },
}

/// An assembled problem with what is needed to hand the impulses back.
#[derive(Clone, Debug)]
pub struct ContactSystem {
    /// The contact problem.
    pub problem: ContactProblem,
    /// The contacts it came from.
    pub contacts: Vec<PosedContact>,
}

/// Assembles the contact problem.
///
/// - `contacts`: what touches
/// - `velocities`: free velocities per strand, freedoms in the order of [`InverseDynamics`]
/// - `dt`, `stabilisation`: see [`PosedContact::prescribed`]
///
/// # Errors
/// If a contact lies outside its strand or a number is not finite.
pub fn assemble<D: InverseDynamics>(
    contacts: &[PosedContact],
    dynamics: &D,
    strands: usize,
    velocities: &[&[f64]],
    dt: f64,
    stabilisation: f64,
) -> Result<ContactSystem, AssemblyError> {
    let (touched, standing) = touches(contacts, dynamics, strands)?;
    if let Some((strand, touches)) =
        touched.iter().find(|(s, _)| velocities.get(*s).is_none_or(|v| v.len() < dynamics.dofs(*s)))
    {
        return Err(AssemblyError::OutOfRange { contact: touches[0].contact as usize, strand: *strand });
    }
    let bases: Vec<[Vec3; 3]> = contacts.iter().map(PosedContact::basis).collect();
    let busy: Vec<Busy> = touched
        .par_iter()
        .map_init(Scratch::default, |scratch, (strand, touches)| {
            let share = Share::assemble(*strand, touches, &bases, dynamics, scratch)?;
            Ok(Busy { contacts: touches.iter().map(|touch| touch.contact).collect(), share })
        })
        .collect::<Vec<Result<Busy, AssemblyError>>>()
        .into_iter()
        .collect::<Result<_, AssemblyError>>()?;
    let free_velocity: Vec<Vec3> = contacts
        .iter()
        .zip(&bases)
        .map(|(c, e)| {
            let mut v = c.a.velocity(velocities[c.a.strand as usize]);
            if let Some(b) = &c.b {
                let o = b.velocity(velocities[b.strand as usize]);
                for i in 0..3 {
                    v[i] -= o[i];
                }
            }
            let w = c.prescribed(dt, stabilisation);
            [0, 1, 2].map(|i| crate::block::dot(&e[i], &v) + w[i])
        })
        .collect();
    if let Some(k) = free_velocity.iter().position(|v| !v.iter().all(|x| x.is_finite())) {
        return Err(AssemblyError::NotFinite { strand: contacts[k].a.strand as usize });
    }
    let cohesion = if contacts.iter().any(|c| c.cohesion > 0.0) {
        contacts.iter().map(|c| c.cohesion.max(0.0)).collect()
    } else {
        Vec::new()
    };
    let problem = ContactProblem {
        dimension: 3,
        delassus: rows(&standing, &busy),
        free_velocity,
        friction: contacts.iter().map(|c| c.friction).collect(),
        cohesion,
    };
    Ok(ContactSystem { problem, contacts: contacts.to_vec() })
}

/// Touches by strand, and where each contact stands.
type Touched = (Vec<(usize, Vec<Touch>)>, Vec<Standing>);

/// Who touches which strand, in the order of the contacts.
pub(super) fn touches<D: InverseDynamics>(
    contacts: &[PosedContact],
    dynamics: &D,
    strands: usize,
) -> Result<Touched, AssemblyError> {
    let mut place_of = vec![u32::MAX; strands];
    let mut touched: Vec<(usize, Vec<Touch>)> = Vec::new();
    let mut standing: Vec<Standing> = Vec::with_capacity(contacts.len());
    for (k, c) in contacts.iter().enumerate() {
        let mut stands = [None; 2];
        for (n, (side, sign)) in [(Some(c.a), 1.0), (c.b, -1.0)].into_iter().enumerate() {
            let Some(side) = side else { continue };
            let s = side.strand as usize;
            if s >= strands || side.dof.iter().any(|d| *d as usize + 3 > dynamics.dofs(s)) {
                return Err(AssemblyError::OutOfRange { contact: k, strand: s });
            }
            if place_of[s] == u32::MAX {
                place_of[s] = touched.len() as u32;
                touched.push((s, Vec::new()));
            }
            let touches = &mut touched[place_of[s] as usize].1;
            let own = touches.last().is_some_and(|last| last.contact == k as u32);
            if !own {
                stands[n] = Some((place_of[s], touches.len() as u32));
                touches.push(Touch::new(k as u32));
            }
            if let Some(touch) = touches.last_mut() {
                touch.add(&side, sign);
            }
        }
        standing.push(stands);
    }
    Ok((touched, standing))
}

impl ContactSystem {
    /// Adds the contact impulses `Hᵀ r` [N s] to per-strand freedom vectors.
    pub fn scatter(&self, impulses: &[Vec3], strands: &mut [Vec<f64>]) {
        for (c, r) in self.contacts.iter().zip(impulses) {
            let e = c.basis();
            let world = [0, 1, 2].map(|i| e[0][i] * r[0] + e[1][i] * r[1] + e[2][i] * r[2]);
            for (side, sign) in [(Some(c.a), 1.0), (c.b, -1.0)] {
                let Some(side) = side else { continue };
                let v = &mut strands[side.strand as usize];
                for (dof, weight) in side.dof.iter().zip(side.weight) {
                    for i in 0..3 {
                        v[*dof as usize + i] += sign * weight * world[i];
                    }
                }
            }
        }
    }

    /// Impulse of a contact in world axes [N s], acting on side A.
    #[must_use]
    pub fn world_impulse(&self, contact: usize, impulse: &Vec3) -> Vec3 {
        let e = self.contacts[contact].basis();
        [0, 1, 2].map(|i| e[0][i] * impulse[0] + e[1][i] * impulse[1] + e[2][i] * impulse[2])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::ContactSide;
    use crate::families::Random;

    /// Dense symmetric inverse dynamics for tests.
    struct Dense {
        inverse: Vec<Vec<f64>>,
        n: usize,
    }

    impl InverseDynamics for Dense {
        fn dofs(&self, _: usize) -> usize {
            self.n
        }
        fn apply(&self, strand: usize, x: &mut [f64]) {
            let y: Vec<f64> =
                (0..self.n).map(|i| (0..self.n).map(|j| self.inverse[strand][i * self.n + j] * x[j]).sum()).collect();
            x.copy_from_slice(&y);
        }
    }

    /// W r + q equals the relative velocity after applying the impulses through the inverse dynamics, for strand–strand,
    /// strand–solid and self contacts.
    #[test]
    fn the_matrix_is_what_the_dynamics_does() {
        let mut random = Random::new(3);
        let n = 16;
        let dynamics = Dense {
            n,
            inverse: (0..3)
                .map(|_| {
                    let g: Vec<f64> = (0..n * n).map(|_| random.normal()).collect();
                    (0..n * n).map(|e| (0..n).map(|k| g[(e / n) * n + k] * g[(e % n) * n + k]).sum()).collect()
                })
                .collect(),
        };
        let velocities: Vec<Vec<f64>> = (0..3).map(|_| (0..n).map(|_| random.normal()).collect()).collect();
        let side = |s: u32, e: u32, a: f64| ContactSide::on_edge(s, e, a, 4);
        let pairs = [
            (side(0, 0, 0.3), Some(side(1, 2, 0.6))),
            (side(0, 1, 0.0), None),
            (side(2, 0, 1.0), Some(side(1, 2, 0.1))),
            (side(2, 0, 0.5), Some(side(2, 2, 0.5))),
        ];
        let contacts: Vec<PosedContact> = pairs
            .iter()
            .map(|(a, b)| PosedContact {
                a: *a,
                b: *b,
                normal: random.direction(),
                external_velocity: if b.is_none() { [0.1, -0.2, 0.3] } else { [0.0; 3] },
                gap: random.uniform(-0.01, 0.01),
                friction: 0.3,
                cohesion: 0.0,
            })
            .collect();
        let slices: Vec<&[f64]> = velocities.iter().map(Vec::as_slice).collect();
        let system = assemble(&contacts, &dynamics, 3, &slices, 0.01, 0.2).unwrap();
        assert!(system.problem.delassus.asymmetry() == 0.0);
        let r: Vec<Vec3> = (0..4).map(|_| [random.normal(), random.normal(), random.normal()]).collect();
        let mut impulse = vec![vec![0.0; n]; 3];
        system.scatter(&r, &mut impulse);
        let after: Vec<Vec<f64>> = (0..3)
            .map(|s| {
                let mut x = impulse[s].clone();
                dynamics.apply(s, &mut x);
                x.iter().zip(&velocities[s]).map(|(a, b)| a + b).collect()
            })
            .collect();
        let u = system.problem.velocities(&r);
        for (k, c) in contacts.iter().enumerate() {
            let e = c.basis();
            let mut v = c.a.velocity(&after[c.a.strand as usize]);
            if let Some(b) = c.b {
                let o = b.velocity(&after[b.strand as usize]);
                v = crate::block::sub(&v, &o);
            }
            let w = c.prescribed(0.01, 0.2);
            for i in 0..3 {
                let expected = crate::block::dot(&e[i], &v) + w[i];
                assert!(
                    (u[k][i] - expected).abs() < 1e-10 * (1.0 + expected.abs()),
                    "contact {k}: {} {expected}",
                    u[k][i]
                );
            }
        }
        // and so does the operator that stores no blocks
        let mut by_operator = vec![[0.0; 3]; 4];
        let free = system.problem.free_velocity.clone();
        crate::assembly::DelassusOperator::new(&contacts, &dynamics, 3).apply(&r, &free, &mut by_operator);
        for (a, b) in u.iter().flatten().zip(by_operator.iter().flatten()) {
            assert!((a - b).abs() < 1e-10 * (1.0 + a.abs()), "{a} {b}");
        }
        // as do the diagonals alone
        let normals = crate::assembly::normal_mobilities(&contacts, &dynamics, 3).unwrap();
        for (k, mobility) in normals.iter().enumerate() {
            let expected = system.problem.delassus.diagonal(k)[0];
            assert!((mobility - expected).abs() < 1e-12 * expected, "{mobility} {expected}");
        }
        // out of range is an error
        let bad = PosedContact { a: side(0, 3, 0.5), ..contacts[1] };
        assert_eq!(
            assemble(&[bad], &dynamics, 3, &slices, 0.01, 0.2).unwrap_err(),
            AssemblyError::OutOfRange { contact: 0, strand: 0 }
        );
    }
}

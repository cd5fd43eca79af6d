//! Rigid bodies and the contacts between them, turned into a contact problem.

use crate::block::{Block, Vec3, ZERO, dot};
use crate::problem::{BlockMatrix, ContactProblem};

/// Rigid bodies with diagonal inertia.
#[derive(Clone, Debug, Default)]
pub struct Bodies {
    /// Centres of mass [m].
    pub centre: Vec<Vec3>,
    /// Masses [kg].
    pub mass: Vec<f64>,
    /// Principal moments of inertia about the world axes [kg m²].
    pub inertia: Vec<Vec3>,
    /// Velocities [m/s] and angular velocities [1/s] before the contact impulses.
    pub velocity: Vec<[f64; 6]>,
    /// Contacts.
    pub touches: Vec<Touch>,
    /// Angular velocity times step of an implicit gyroscopic term, per body [1]: makes `W` slightly unsymmetric, as in
    /// some public files, without changing its rank. Empty for none.
    pub gyroscopic: Vec<Vec3>,
}

/// One contact point.
#[derive(Clone, Copy, Debug)]
pub struct Touch {
    /// Body A, on which the impulse acts with plus sign.
    pub a: usize,
    /// Body B, or `None` for the fixed world.
    pub b: Option<usize>,
    /// Contact point [m].
    pub point: Vec3,
    /// Unit normal from B to A.
    pub normal: Vec3,
    /// Friction coefficient.
    pub friction: f64,
}

/// Orthonormal basis with the given first vector (spec A.7: `t₁ ∝ (−n_y, n_x, 0)`, or `(0, −n_z, n_y)` where that is short).
#[must_use]
pub fn basis(normal: &Vec3) -> [Vec3; 3] {
    let mut t = [-normal[1], normal[0], 0.0];
    let mut l = dot(&t, &t).sqrt();
    if l < 1e-6 {
        t = [0.0, -normal[2], normal[1]];
        l = dot(&t, &t).sqrt();
    }
    let t = t.map(|v| v / l);
    [*normal, t, cross(normal, &t)]
}

/// Cross product.
#[must_use]
pub fn cross(a: &Vec3, b: &Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

impl Bodies {
    /// Adds a body at rest and returns its index.
    pub fn add(&mut self, centre: Vec3, mass: f64, inertia: Vec3) -> usize {
        self.centre.push(centre);
        self.mass.push(mass);
        self.inertia.push(inertia);
        self.velocity.push([0.0; 6]);
        self.mass.len() - 1
    }

    /// Adds a contact; the normal need not be of unit length.
    pub fn touch(&mut self, a: usize, b: Option<usize>, point: Vec3, normal: Vec3, friction: f64) {
        let l = dot(&normal, &normal).sqrt();
        if l > 0.0 {
            self.touches.push(Touch { a, b, point, normal: normal.map(|v| v / l), friction });
        }
    }

    /// Accelerates every body by `gravity` [m/s²] over `dt` [s].
    pub fn accelerate(&mut self, gravity: Vec3, dt: f64) {
        for v in &mut self.velocity {
            for i in 0..3 {
                v[i] += gravity[i] * dt;
            }
        }
    }

    /// Rows of the contact's Jacobian for one body: relative velocity from its six velocities.
    #[must_use]
    pub fn jacobian(&self, touch: &Touch, body: usize) -> [[f64; 6]; 3] {
        let e = basis(&touch.normal);
        let d = crate::block::sub(&touch.point, &self.centre[body]);
        let sign = if touch.a == body { 1.0 } else { -1.0 };
        [0, 1, 2].map(|i| {
            let m = cross(&d, &e[i]);
            [sign * e[i][0], sign * e[i][1], sign * e[i][2], sign * m[0], sign * m[1], sign * m[2]]
        })
    }

    /// `M⁻¹ x`, with the gyroscopic term as a skew part of the inverse inertia.
    fn inverse_mass_times(&self, body: usize, x: &[f64; 6]) -> [f64; 6] {
        let inverse = self.inverse_mass(body);
        let mut y = [0.0; 6];
        for d in 0..6 {
            y[d] = inverse[d] * x[d];
        }
        if let Some(w) = self.gyroscopic.get(body) {
            let scale = (inverse[3] * inverse[4] * inverse[5]).cbrt();
            let c = cross(w, &[x[3], x[4], x[5]]);
            for d in 0..3 {
                y[3 + d] += scale * c[d];
            }
        }
        y
    }

    fn inverse_mass(&self, body: usize) -> [f64; 6] {
        let (m, i) = (1.0 / self.mass[body], self.inertia[body]);
        [m, m, m, 1.0 / i[0], 1.0 / i[1], 1.0 / i[2]]
    }

    /// The contact problem of the bodies as they move now.
    #[must_use]
    pub fn problem(&self) -> ContactProblem {
        let mut by_body: Vec<Vec<u32>> = vec![Vec::new(); self.mass.len()];
        for (k, t) in self.touches.iter().enumerate() {
            by_body[t.a].push(k as u32);
            if let Some(b) = t.b {
                by_body[b].push(k as u32);
            }
        }
        let mut triplets: Vec<(u32, u32, Block)> = Vec::new();
        let mut q = vec![[0.0; 3]; self.touches.len()];
        for (body, list) in by_body.iter().enumerate() {
            let rows: Vec<[[f64; 6]; 3]> =
                list.iter().map(|k| self.jacobian(&self.touches[*k as usize], body)).collect();
            for (k, hk) in list.iter().zip(&rows) {
                for c in 0..3 {
                    for d in 0..6 {
                        q[*k as usize][c] += hk[c][d] * self.velocity[body][d];
                    }
                }
                for (l, hl) in list.iter().zip(&rows) {
                    let mut b = ZERO;
                    for j in 0..3 {
                        let column = self.inverse_mass_times(body, &hl[j]);
                        for i in 0..3 {
                            for d in 0..6 {
                                b[3 * i + j] += hk[i][d] * column[d];
                            }
                        }
                    }
                    triplets.push((*k, *l, b));
                }
            }
        }
        ContactProblem {
            dimension: 3,
            delassus: BlockMatrix::from_triplets(self.touches.len(), &triplets),
            free_velocity: q,
            friction: self.touches.iter().map(|t| t.friction).collect(),
            cohesion: Vec::new(),
        }
    }

    /// Velocities after the contact impulses `r`.
    pub fn apply(&mut self, impulses: &[Vec3]) {
        for (t, r) in self.touches.iter().zip(impulses) {
            for body in [Some(t.a), t.b].into_iter().flatten() {
                let h = self.jacobian(t, body);
                let mut impulse = [0.0; 6];
                for d in 0..6 {
                    impulse[d] = h[0][d] * r[0] + h[1][d] * r[1] + h[2][d] * r[2];
                }
                let change = self.inverse_mass_times(body, &impulse);
                for d in 0..6 {
                    self.velocity[body][d] += change[d];
                }
            }
        }
    }

    /// Kinetic energy [J].
    #[must_use]
    pub fn kinetic_energy(&self) -> f64 {
        (0..self.mass.len())
            .map(|b| {
                let inverse = self.inverse_mass(b);
                (0..6).map(|d| 0.5 * self.velocity[b][d].powi(2) / inverse[d]).sum::<f64>()
            })
            .sum()
    }
}

//! The scaled, reordered equations of one attempt: residual function, Jacobian blocks, assembly.

use super::Attempt;
use crate::block::{Block, IDENTITY, Vec3, ZERO, mat_mul, mat_vec, norm_squared, scale, trace};
use crate::law::fischer_burmeister::{linearise, value};
use crate::problem::BlockMatrix;
use crate::problem::residual::ResidualParts;
use crate::solvers::block_lu::BlockLu;
use crate::solvers::group::Group;
use crate::solvers::ordering::Elimination;

/// What kind of equation a contact has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Frictional,
    Frictionless,
    Bilateral,
    /// No impulse can move it: `r = 0`.
    Frozen,
}

/// The equations in elimination order; impulse `r = d s r'`, velocity `u = s u'/d` with a scale `d` per contact.
pub(super) struct System<'a> {
    group: &'a Group<'a>,
    order: &'a [u32],
    pub w: BlockMatrix,
    slots: Vec<usize>,
    pub q: Vec<Vec3>,
    d: Vec<f64>,
    size: f64,
    kind: Vec<Kind>,
    /// Normal and tangential factors of `x` and `y` in terms of `r'` and `u'`.
    tx: Vec<[f64; 2]>,
    ty: Vec<[f64; 2]>,
    slip_smoothing: f64,
    damping: f64,
    /// De Saxcé's shift held fixed, where the attempt lags it.
    held: Option<Vec<f64>>,
    by_x: Vec<Block>,
    by_u: Vec<Block>,
}

/// A friction coefficient below this is none.
const FRICTIONLESS: f64 = 1e-12;

impl<'a> System<'a> {
    pub fn new(group: &'a Group<'a>, elimination: &'a Elimination, lu: &BlockLu, attempt: &Attempt) -> Self {
        let n = group.len();
        let order = &elimination.order[..];
        let mean = group.w.mean_diagonal();
        let mut d = Vec::with_capacity(n);
        let mut kind = Vec::with_capacity(n);
        let mut tx = Vec::with_capacity(n);
        let mut ty = Vec::with_capacity(n);
        for k in order {
            let k = *k as usize;
            let own = trace(group.w.diagonal(k)) / 3.0;
            let nu = group.friction[k];
            let usable = own > 1e-14 * mean;
            let s = if attempt.equilibrate && usable { own } else { mean };
            d.push(if s > 0.0 { 1.0 / s.sqrt() } else { 1.0 });
            kind.push(if !usable {
                Kind::Frozen
            } else if nu < 0.0 {
                Kind::Bilateral
            } else if nu < FRICTIONLESS {
                Kind::Frictionless
            } else {
                Kind::Frictional
            });
            let (p, safe) = (if nu > 0.0 { nu.powf(attempt.friction_power) } else { 1.0 }, nu.max(FRICTIONLESS));
            tx.push([p, p / safe]);
            ty.push([1.0 / p, safe / p]);
        }
        let mut row_start = vec![0];
        let mut entries: Vec<(u32, Block)> = Vec::new();
        let mut columns = Vec::with_capacity(group.w.block_count());
        let mut blocks = Vec::with_capacity(group.w.block_count());
        let mut slots = Vec::with_capacity(group.w.block_count());
        let mut q = Vec::with_capacity(n);
        for (p, k) in order.iter().enumerate() {
            let (c, b) = group.w.row(*k as usize);
            entries.clear();
            entries.extend(c.iter().zip(b).map(|(j, b)| {
                let pj = elimination.place[*j as usize];
                let f = d[p] * d[pj as usize];
                (pj, b.map(|v| v * f))
            }));
            entries.sort_unstable_by_key(|e| e.0);
            for (j, b) in &entries {
                columns.push(*j);
                blocks.push(*b);
                slots.push(lu.slot(p, *j as usize).expect("the factor's pattern contains the matrix"));
            }
            row_start.push(columns.len());
            q.push(scale(d[p], &group.q[*k as usize]));
        }
        let total: f64 = q.iter().map(norm_squared).sum();
        let size = (total / n.max(1) as f64).sqrt();
        let size = if size > 0.0 { size } else { 1.0 };
        for v in &mut q {
            *v = scale(1.0 / size, v);
        }
        System {
            group,
            order,
            w: BlockMatrix::from_rows(row_start, columns, blocks),
            slots,
            q,
            d,
            size,
            kind,
            tx,
            ty,
            slip_smoothing: attempt.slip_smoothing,
            damping: attempt.damping,
            held: attempt.lagged.then(|| vec![0.0; n]),
            by_x: vec![ZERO; n],
            by_u: vec![ZERO; n],
        }
    }

    /// Takes the shift from the velocities given, where the attempt lags it.
    pub fn hold(&mut self, u: &[Vec3]) {
        if let Some(h) = &mut self.held {
            for (h, u) in h.iter_mut().zip(u) {
                *h = (u[1] * u[1] + u[2] * u[2]).sqrt();
            }
        }
    }

    /// Impulses in scaled form.
    pub fn import(&self, r: &[Vec3]) -> Vec<Vec3> {
        self.order.iter().enumerate().map(|(p, k)| scale(1.0 / (self.d[p] * self.size), &r[*k as usize])).collect()
    }

    /// Impulses in the problem's units and order.
    pub fn export(&self, r: &[Vec3], out: &mut [Vec3]) {
        for (p, k) in self.order.iter().enumerate() {
            out[*k as usize] = scale(self.d[p] * self.size, &r[p]);
        }
    }

    /// The problem's own residual from scaled impulses and velocities.
    pub fn residual(&self, r: &[Vec3], u: &[Vec3]) -> f64 {
        let mut parts = ResidualParts::default();
        for (p, k) in self.order.iter().enumerate() {
            let k = *k as usize;
            let (a, b) = (self.d[p] * self.size, self.size / self.d[p]);
            let rho = self.group.scaling.weight(self.group.w, k);
            parts.add(&scale(a, &r[p]), &scale(b, &u[p]), &self.group.q[k], self.group.friction[k], rho);
        }
        self.group.relative(&parts)
    }

    #[inline]
    fn pair(&self, p: usize, r: &Vec3, u: &Vec3, mu: f64) -> (Vec3, Vec3, f64) {
        let (tx, ty) = (&self.tx[p], &self.ty[p]);
        let e = self.slip_smoothing * mu;
        let slip = match &self.held {
            Some(h) => h[p],
            None => (u[1] * u[1] + u[2] * u[2] + e * e).sqrt(),
        };
        ([tx[0] * r[0], tx[1] * r[1], tx[1] * r[2]], [ty[0] * u[0] + ty[1] * slip, ty[1] * u[1], ty[1] * u[2]], slip)
    }

    /// The equation of contact `p`.
    #[inline]
    pub fn equation(&self, p: usize, r: &Vec3, u: &Vec3, mu: f64) -> Vec3 {
        match self.kind[p] {
            Kind::Frictional => {
                let (x, y, _) = self.pair(p, r, u, mu);
                value(&x, &y, mu * mu)
            }
            Kind::Frictionless => {
                let z = (r[0] * r[0] + u[0] * u[0] + 2.0 * mu * mu).sqrt();
                [r[0] + u[0] - z, r[1], r[2]]
            }
            Kind::Bilateral => *u,
            Kind::Frozen => *r,
        }
    }

    /// Evaluates all equations and their derivatives: `f` and `∂f/∂μ²` (slip smoothing included).
    pub fn linearise(&mut self, r: &[Vec3], u: &[Vec3], mu: f64, f: &mut [Vec3], by_mu: &mut [Vec3]) {
        for p in 0..r.len() {
            match self.kind[p] {
                Kind::Frictional => {
                    let (x, y, slip) = self.pair(p, &r[p], &u[p], mu);
                    let l = linearise(&x, &y, mu * mu);
                    f[p] = l.value;
                    let (tx, ty) = (self.tx[p], self.ty[p]);
                    let free = self.held.is_none() && slip > 0.0;
                    let g = if free { [ty[1] * u[p][1] / slip, ty[1] * u[p][2] / slip] } else { [0.0; 2] };
                    let s2 = self.slip_smoothing * self.slip_smoothing;
                    let dslip = if free { ty[1] * s2 / (2.0 * slip) } else { 0.0 };
                    let (bx, by) = (&mut self.by_x[p], &mut self.by_u[p]);
                    for i in 0..3 {
                        bx[3 * i] = l.by_x[3 * i] * tx[0];
                        bx[3 * i + 1] = l.by_x[3 * i + 1] * tx[1];
                        bx[3 * i + 2] = l.by_x[3 * i + 2] * tx[1];
                        by[3 * i] = l.by_y[3 * i] * ty[0];
                        by[3 * i + 1] = l.by_y[3 * i + 1] * ty[1] + l.by_y[3 * i] * g[0];
                        by[3 * i + 2] = l.by_y[3 * i + 2] * ty[1] + l.by_y[3 * i] * g[1];
                        by_mu[p][i] = l.by_smoothing[i] + l.by_y[3 * i] * dslip;
                    }
                }
                Kind::Frictionless => {
                    f[p] = self.equation(p, &r[p], &u[p], mu);
                    let z = (r[p][0] * r[p][0] + u[p][0] * u[p][0] + 2.0 * mu * mu).sqrt();
                    let (a, b, c) = if z > 0.0 {
                        (1.0 - r[p][0] / z, 1.0 - u[p][0] / z, -1.0 / z)
                    } else {
                        (1.0 - 0.5_f64.sqrt(), 1.0 - 0.5_f64.sqrt(), 0.0)
                    };
                    self.by_x[p] = [a, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
                    self.by_u[p] = ZERO;
                    self.by_u[p][0] = b;
                    by_mu[p] = [c, 0.0, 0.0];
                }
                Kind::Bilateral => {
                    f[p] = u[p];
                    self.by_x[p] = ZERO;
                    self.by_u[p] = IDENTITY;
                    by_mu[p] = [0.0; 3];
                }
                Kind::Frozen => {
                    f[p] = r[p];
                    self.by_x[p] = IDENTITY;
                    self.by_u[p] = ZERO;
                    by_mu[p] = [0.0; 3];
                }
            }
        }
    }

    /// Writes the Jacobian `∂f/∂u W + ∂f/∂r` into the factor's storage.
    pub fn assemble(&self, lu: &mut BlockLu) {
        lu.clear();
        let values = lu.values_mut();
        let mut e = 0;
        for p in 0..self.order.len() {
            let (columns, blocks) = self.w.row(p);
            let b = &self.by_u[p];
            for (j, w) in columns.iter().zip(blocks) {
                let mut m = mat_mul(b, w);
                if *j as usize == p {
                    for c in 0..9 {
                        m[c] += self.by_x[p][c] + self.damping * b[c];
                    }
                }
                values[self.slots[e]] = m;
                e += 1;
            }
        }
    }

    /// `J δ` from `δ` and `W δ`: used to check what the factorisation returned.
    #[inline]
    pub fn jacobian_times(&self, p: usize, delta: &Vec3, w_delta: &Vec3) -> Vec3 {
        let a = mat_vec(&self.by_x[p], delta);
        let wd = [0, 1, 2].map(|i| w_delta[i] + self.damping * delta[i]);
        let b = mat_vec(&self.by_u[p], &wd);
        [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
    }
}

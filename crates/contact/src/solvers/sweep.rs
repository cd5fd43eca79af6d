//! One sweep of block Gauss–Seidel: over contacts one by one, over clusters, and over every other slab at once.

use super::clusters::Clusters;
use super::group::Group;
use super::slabs::{self, Colours, Rows};
use crate::block::Vec3;
use crate::law::natural_map;
use crate::local::{LocalContact, LocalMethod};
use crate::problem::residual::ResidualParts;
use rayon::prelude::*;

/// Residual of a local solve from which on its answer is taken whole.
const LOCAL: f64 = 1e-9;

/// Residual asked of local solves, as a share of the tolerance of the group, and the least of it: digits that the sweeps around
/// it do not have are not worth a fall-back.
const LOCAL_SHARE: f64 = 1e-4;
const LEAST_LOCAL: f64 = 1e-12;

/// Coupling from which on contacts are taken together, in parts of what each feels of itself, and the most of them.
const FELT: f64 = 0.1;
const MOST: usize = 32;

/// A group made ready for sweeps.
pub(super) struct Sweeps<'a> {
    fixed: Fixed<'a>,
    /// Empty where the group is too small, or too closely knit, to be parted.
    slabs: Colours,
}

/// What a sweep reads and does not change.
struct Fixed<'a> {
    group: &'a Group<'a>,
    locals: Vec<LocalContact>,
    weights: Vec<f64>,
    method: LocalMethod,
    accept: f64,
    clusters: Option<Clusters>,
    /// How often clusters are gone over.
    inner: usize,
}

impl<'a> Sweeps<'a> {
    /// Sweeps that go `inner` times over contacts that feel each other most.
    pub fn new(group: &'a Group<'a>, method: LocalMethod, inner: usize) -> Sweeps<'a> {
        let n = group.len();
        let parted = slabs::part(group.w);
        let slab = parted.as_ref().map(|parted| &parted.0[..]);
        let clusters = (inner > 1).then(|| Clusters::new(group.w, FELT, MOST, slab));
        let slabs =
            parted.as_ref().map(|parted| slabs::colours(group.w, parted, clusters.as_ref())).unwrap_or_default();
        let fixed = Fixed {
            locals: (0..n).map(|k| LocalContact::new(group.w.diagonal(k), group.friction[k])).collect(),
            weights: (0..n).map(|k| group.scaling.weight(group.w, k)).collect(),
            accept: (LOCAL_SHARE * group.tolerance).clamp(LEAST_LOCAL, LOCAL),
            group,
            method,
            clusters,
            inner,
        };
        Sweeps { fixed, slabs }
    }

    /// One sweep over all contacts; returns the residual each contact had when it was visited.
    pub fn sweep(&mut self, r: &mut [Vec3]) -> ResidualParts {
        let Sweeps { fixed, slabs } = self;
        if slabs[0].is_empty() {
            let units = fixed.clusters.as_ref().map_or(r.len(), Clusters::count);
            return fixed.over(0..units as u32, |_, k, r| fixed.group.w.row_product_sparse(k, r), r);
        }
        let over = |units: &[u32], rows: &Rows, r: &mut [Vec3]| {
            fixed.over(units.iter().copied(), |place, _, r| rows.product_sparse(place, r), r)
        };
        let mut parts = ResidualParts::default();
        for colour in slabs {
            // a slab sees no other of its colour, so it does not matter whether they are swept at once or in turn
            let swept: Vec<ResidualParts> = if rayon::current_num_threads() > 1 {
                let seen = &*r;
                let swept = colour.par_iter_mut().with_max_len(1).map(|slab| slab.sweep(seen, over)).collect();
                colour.iter().for_each(|slab| slab.write(r));
                swept
            } else {
                colour.iter().map(|slab| over(&slab.units, &slab.rows, r)).collect()
            };
            swept.iter().for_each(|swept| parts.merge(swept));
        }
        parts
    }
}

impl Fixed<'_> {
    /// Goes over contacts or clusters in the order given. `product(place, k, r)` is row `k` of `W r`, the `place`-th that is
    /// visited.
    #[inline]
    fn over(
        &self,
        units: impl Iterator<Item = u32>,
        product: impl Fn(usize, usize, &[Vec3]) -> Vec3,
        r: &mut [Vec3],
    ) -> ResidualParts {
        let mut parts = ResidualParts::default();
        let mut place = 0;
        match &self.clusters {
            None => {
                for k in units {
                    let k = k as usize;
                    let u = self.visit(k, product(place, k, r), r, &mut parts);
                    place += 1;
                    r[k] = self.solve_one(k, &u, &r[k]);
                }
            }
            Some(clusters) => {
                let mut outside: Vec<Vec3> = Vec::new();
                for c in units {
                    let product = |within: usize, k: usize, r: &[Vec3]| product(place + within, k, r);
                    self.cluster((clusters, c as usize), product, &mut outside, r, &mut parts);
                    place += clusters.members(c as usize).len();
                }
            }
        }
        parts
    }

    /// Goes over a cluster several times.
    #[inline]
    fn cluster(
        &self,
        (clusters, c): (&Clusters, usize),
        product: impl Fn(usize, usize, &[Vec3]) -> Vec3,
        outside: &mut Vec<Vec3>,
        r: &mut [Vec3],
        parts: &mut ResidualParts,
    ) {
        let members = clusters.members(c);
        outside.clear();
        for (place, k) in members.iter().enumerate() {
            let k = *k as usize;
            let u = self.visit(k, product(place, k, r), r, parts);
            if members.len() > 1 {
                let inside = clusters.inner_product(c, place, r);
                outside.push([u[0] - inside[0], u[1] - inside[1], u[2] - inside[2]]);
            }
            r[k] = self.solve_one(k, &u, &r[k]);
        }
        if members.len() == 1 {
            return;
        }
        for _ in 1..self.inner {
            for (place, k) in members.iter().enumerate() {
                let k = *k as usize;
                let inside = clusters.inner_product(c, place, r);
                let u = [0, 1, 2].map(|i| outside[place][i] + inside[i]);
                if r[k] == [0.0; 3] && u[0] >= 0.0 {
                    continue;
                }
                r[k] = self.solve_one(k, &u, &r[k]);
            }
        }
    }

    /// Velocity of a contact with the present impulses, from its row of `W r`; what it adds to the residual is gathered.
    #[inline]
    fn visit(&self, k: usize, mut u: Vec3, r: &[Vec3], parts: &mut ResidualParts) -> Vec3 {
        let group = self.group;
        for i in 0..3 {
            u[i] += group.q[k][i];
        }
        parts.add(&r[k], &u, &group.q[k], group.friction[k], self.weights[k]);
        u
    }

    /// The impulse of one contact whose velocity is `u` with its present one `old`.
    #[inline]
    fn solve_one(&self, k: usize, u: &Vec3, old: &Vec3) -> Vec3 {
        let local = &self.locals[k];
        let own = crate::block::mat_vec(&local.block, old);
        let b = [u[0] - own[0], u[1] - own[1], u[2] - own[2]];
        let answer = local.solve_to(&b, old, self.method, self.accept);
        if answer.residual <= LOCAL {
            return answer.impulse;
        }
        if answer.residual.is_finite() {
            // the local solve missed its tolerance (a nearly singular block): half the update, if it helps at all
            let map = natural_map(old, u, local.friction, local.rho);
            if crate::block::norm_squared(&map) > 0.0 {
                return [0, 1, 2].map(|i| 0.5 * (old[i] + answer.impulse[i]));
            }
        }
        *old
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::families::squeezed_bundle;
    use crate::problem::Scaling;

    /// One thread or four: the same bits, with and without clusters; and sweeps come nearer to the answer.
    #[test]
    fn sweeps_do_not_depend_on_threads() {
        let problem = squeezed_bundle(400, 4e-3, 0.02, 0.3);
        let q = problem.shifted_velocity();
        let group = Group::whole(&problem, &q, Scaling::PerContact, 1e-8);
        for inner in [1, 2] {
            let run = |threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| {
                    let mut sweeps = Sweeps::new(&group, LocalMethod::default(), inner);
                    assert!(!sweeps.slabs[1].is_empty());
                    let mut r = vec![[0.0; 3]; group.len()];
                    let parts: Vec<ResidualParts> = (0..20).map(|_| sweeps.sweep(&mut r)).collect();
                    (r, parts)
                })
            };
            let (one, four) = (run(1), run(4));
            assert!(one == four);
            let (first, last) = (group.relative(&one.1[0]), group.relative(&one.1[19]));
            assert!(last < 0.5 * first, "{last:e} after {first:e}");
        }
    }
}

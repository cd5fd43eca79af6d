//! Where a few contacts hold most of what is left, they are solved for with their neighbours, and the rest stays as it is.
//!
//! Large piles come to rest everywhere but where a contact is about to change: there all methods go on about details of the whole,
//! while a few dozen contacts around it are solved in milliseconds. (An additive step of domain decomposition, with domains chosen by the residual.)

use super::group::{Best, Group, GroupOutcome};
use super::part::{Part, places};
use crate::block::{Vec3, max_abs, norm_squared};
use crate::law::natural_map;
use crate::problem::Component;

/// Contacts of a patch, from one look to the next where it did not help.
const SIZES: [usize; 3] = [40, 100, 250];

/// Patches that are solved at most, and one more for so many contacts.
const PATCHES: usize = 24;
const PATCH_FOR: usize = 20;

/// Worst contacts around which a patch grows.
const SEEDS: usize = 4;

/// Improvement on the patch before that counts (the first one as a rule disturbs its surroundings), and how many in a row may do without.
const HELPS: f64 = 0.9;
const VAIN: usize = 6;

/// Solves patch after patch around the worst contacts with `solve`; leaves the best impulses of all in `r`.
pub fn mend(
    group: &Group<'_>,
    r: &mut [Vec3],
    mut solve: impl FnMut(&Group<'_>, &mut [Vec3]) -> GroupOutcome,
) -> Option<GroupOutcome> {
    let mut best = Best::start(group, r);
    let mut outcome: Option<GroupOutcome> = None;
    let size_floor = group.size_floor.max(size(group, r));
    let (mut grade, mut vain) = (0, 0);
    let mut before = best.residual;
    for _ in 0..PATCHES + group.len() / PATCH_FOR {
        let members = patch(group, r, SIZES[grade % SIZES.len()]);
        if members.len() == group.len() || before <= group.tolerance {
            break;
        }
        let members = Component { contacts: members };
        let mut part = Part::take(&members, &places(&members, group.len()), group.w, group.q, group.friction, r);
        part.hold_the_rest(group.w, r);
        // solved ten times more exactly than asked: the whole has many patches
        let answer = part.solve(group.scaling, 0.1 * group.tolerance, size_floor, &mut solve);
        part.put_back(r);
        let residual = group.residual(r);
        best.offer(residual, r);
        outcome = Some(match &outcome {
            Some(earlier) => answer.after(earlier),
            None => answer,
        });
        if residual <= HELPS * before {
            vain = 0;
        } else {
            (grade, vain) = (grade + 1, vain + 1);
            if vain == VAIN {
                break;
            }
        }
        before = residual;
    }
    r.copy_from_slice(&best.r);
    outcome.map(|o| GroupOutcome { residual: best.residual, ..o })
}

/// Size of the problem at `r`, in the unit of the residual.
fn size(group: &Group<'_>, r: &[Vec3]) -> f64 {
    crate::problem::residual::residual_parts(group.w, group.q, group.friction, r, group.scaling)
        .guarded_size(group.scaling)
}

/// The contacts around the worst ones, nearest first, ascending in the end.
fn patch(group: &Group<'_>, r: &[Vec3], most: usize) -> Vec<u32> {
    let n = group.len();
    let map = |k: usize| {
        let weight = group.scaling.weight(group.w, k);
        let s = group.w.row_product_sparse(k, r);
        let u = [0, 1, 2].map(|i| s[i] + group.q[k][i]);
        norm_squared(&natural_map(&r[k], &u, group.friction[k], weight))
    };
    let mut worst: Vec<(f64, u32)> = (0..n).map(|k| (map(k), k as u32)).collect();
    worst.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut taken = vec![false; n];
    let mut members: Vec<u32> = Vec::with_capacity(most);
    let seeds = worst.iter().take(SEEDS).map(|w| w.1);
    for k in seeds {
        taken[k as usize] = true;
        members.push(k);
    }
    let mut next = 0;
    while next < members.len() && members.len() < most {
        let (columns, blocks) = group.w.row(members[next] as usize);
        next += 1;
        for (j, b) in columns.iter().zip(blocks) {
            if !taken[*j as usize] && max_abs(b) > 0.0 && members.len() < most {
                taken[*j as usize] = true;
                members.push(*j);
            }
        }
    }
    members.sort_unstable();
    members
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::families::Family;
    use crate::problem::Scaling;
    use crate::solvers::group::GroupSolver as _;
    use crate::solvers::newton::Newton;
    use crate::{ContactSettings, solve};

    #[test]
    fn what_is_wrong_in_one_place_is_mended_there() {
        let problem = Family::Arch.larger_member(2, 2);
        let solved = solve(&problem, None, &ContactSettings::default());
        assert!(solved.report.status().is_converged());
        let mut r = solved.impulses.clone();
        let n = r.len();
        for k in n / 2..n / 2 + 3 {
            r[k] = r[k].map(|x| 1.5 * x);
        }
        let q = problem.shifted_velocity();
        let group = Group::whole(&problem, &q, Scaling::PerContact, 1e-8);
        let (wrong, mut sizes) = (group.residual(&r), Vec::new());
        assert!(wrong > 1e-3, "{wrong:e}");
        let outcome = mend(&group, &mut r, |patch, x| {
            sizes.push(patch.len());
            Newton::default().solve(patch, x)
        });
        let residual = outcome.expect("patches were solved").residual;
        assert_eq!(residual, group.residual(&r));
        assert!(residual <= 1e-2 * wrong, "{residual:e} of {wrong:e} in patches of {sizes:?}");
        assert!(sizes.iter().all(|size| SIZES.contains(size)), "{sizes:?} of {n}");
    }
}

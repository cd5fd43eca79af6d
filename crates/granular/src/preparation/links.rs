//! The graph of permanent links: particles, bridges, removal and joining.

use crate::assembly::Assembly;
use crate::grains::Grains;
use crate::model::ContactKind;
use crate::random::Random;

/// Disjoint sets with path halving.
#[derive(Debug, Clone)]
pub struct Components {
    parent: Vec<u32>,
}

impl Components {
    /// `n` singletons.
    pub fn new(n: usize) -> Self {
        Self { parent: (0..n as u32).collect() }
    }

    /// Representative of the set of `i`.
    pub fn find(&mut self, i: usize) -> usize {
        let mut i = i as u32;
        while self.parent[i as usize] != i {
            self.parent[i as usize] = self.parent[self.parent[i as usize] as usize];
            i = self.parent[i as usize];
        }
        i as usize
    }

    /// Joins two sets; false if they were one already.
    pub fn join(&mut self, i: usize, j: usize) -> bool {
        let (a, b) = (self.find(i), self.find(j));
        self.parent[a.max(b)] = a.min(b) as u32;
        a != b
    }

    /// Number of the set of each element, numbered by first appearance, and the number of sets.
    pub fn labels(&mut self) -> (Vec<u32>, usize) {
        let n = self.parent.len();
        let mut names = vec![u32::MAX; n];
        let mut count = 0;
        let labels = (0..n)
            .map(|i| {
                let root = self.find(i);
                if names[root] == u32::MAX {
                    names[root] = count;
                    count += 1;
                }
                names[root]
            })
            .collect();
        (labels, count as usize)
    }
}

/// True for a link that does not reach across an edge of the box.
fn direct(grains: &Grains, width: f64, height: f64, [i, j]: [usize; 2]) -> bool {
    (grains.x[j] - grains.x[i]).abs() < width / 2.0 && (grains.y[j] - grains.y[i]).abs() < height / 2.0
}

/// Links that do not reach across an edge; particles are connected by these alone.
pub fn direct_links(assembly: &Assembly) -> Vec<[usize; 2]> {
    if let Assembly::Spheres(s) = assembly {
        let inside = |p: &&crate::spheres::SpherePair| p.kind == ContactKind::Permanent && p.image == [0; 3];
        return s.pairs().iter().filter(inside).map(|p| [p.i as usize, p.j as usize]).collect();
    }
    let (grains, cell) = (assembly.grains(), assembly.cell());
    assembly.links().into_iter().filter(|&l| direct(&grains, cell.width, cell.height, l)).collect()
}

/// Particle of each grain and the number of particles.
pub fn particles(n: usize, links: &[[usize; 2]]) -> (Vec<u32>, usize) {
    let mut sets = Components::new(n);
    for &[i, j] in links {
        sets.join(i, j);
    }
    sets.labels()
}

/// Largest vertical extent of a particle [µm], raw coordinates.
pub fn tallest(grains: &Grains, labels: &[u32], count: usize) -> f64 {
    let mut extent = vec![[f64::MAX, f64::MIN]; count];
    for (i, &l) in labels.iter().enumerate() {
        let e = &mut extent[l as usize];
        e[0] = e[0].min(grains.y[i] - grains.radius[i]);
        e[1] = e[1].max(grains.y[i] + grains.radius[i]);
    }
    extent.iter().fold(0.0, |m, e| m.max(e[1] - e[0]))
}

/// Links whose loss would split a particle (Tarjan 1974), as flags; iterative, linear in grains plus links.
pub fn bridges(n: usize, links: &[[usize; 2]]) -> Vec<bool> {
    let mut offsets = vec![0usize; n + 1];
    for &[i, j] in links {
        offsets[i + 1] += 1;
        offsets[j + 1] += 1;
    }
    for i in 0..n {
        offsets[i + 1] += offsets[i];
    }
    let mut next = offsets.clone();
    let mut edges = vec![(0usize, 0usize); 2 * links.len()];
    for (k, &[i, j]) in links.iter().enumerate() {
        for (a, b) in [(i, j), (j, i)] {
            edges[next[a]] = (b, k);
            next[a] += 1;
        }
    }
    let mut is_bridge = vec![false; links.len()];
    let (mut order, mut low, mut clock) = (vec![0usize; n], vec![0usize; n], 0);
    let mut at = offsets[..n].to_vec();
    for start in 0..n {
        if order[start] != 0 {
            continue;
        }
        clock += 1;
        (order[start], low[start]) = (clock, clock);
        let mut stack = vec![(start, usize::MAX)];
        while let Some(&(v, came)) = stack.last() {
            if at[v] < offsets[v + 1] {
                let (w, k) = edges[at[v]];
                at[v] += 1;
                if k == came {
                    continue;
                }
                if order[w] == 0 {
                    clock += 1;
                    (order[w], low[w]) = (clock, clock);
                    stack.push((w, k));
                } else {
                    low[v] = low[v].min(order[w]);
                }
            } else {
                stack.pop();
                if let Some(&(u, _)) = stack.last() {
                    low[u] = low[u].min(low[v]);
                    if low[v] > order[u] {
                        is_bridge[came] = true;
                    }
                }
            }
        }
    }
    is_bridge
}

/// Chooses links to remove so that no particle falls apart: random order, non-essential ones first come, first gone.
///
/// Removing links one by one in random order unless that splits a particle leaves exactly the spanning forest that Kruskal's
/// method finds in reverse order, so one pass of disjoint sets replaces a search per link. Returns at most
/// `fraction · links` of them.
pub fn choose_removable(n: usize, links: &[[usize; 2]], fraction: f64, random: &mut Random) -> Vec<[usize; 2]> {
    let mut order = links.to_vec();
    random.shuffle(&mut order);
    let mut sets = Components::new(n);
    let essential: Vec<bool> = order.iter().rev().map(|&[i, j]| sets.join(i, j)).collect();
    let wanted = (fraction * links.len() as f64).floor() as usize;
    order.iter().zip(essential.iter().rev()).filter(|(_, e)| !**e).map(|(l, _)| *l).take(wanted).collect()
}

/// The published removal: random grain, random linked neighbour, kept cut if the two stay connected; returns the number removed.
fn remove_by_trial(assembly: &mut Assembly, fraction: f64, random: &mut Random) -> usize {
    let n = assembly.len();
    let mut partners = vec![Vec::new(); n];
    let links = direct_links(assembly);
    for &[i, j] in &links {
        partners[i].push(j);
        partners[j].push(i);
    }
    let (mut removed, mut failures) = (0usize, 0);
    while (removed as f64) < fraction * links.len() as f64 && failures < 1000 {
        let i = random.below(n);
        if partners[i].is_empty() {
            failures += 1;
            continue;
        }
        let j = partners[i][random.below(partners[i].len())];
        partners[i].retain(|&b| b != j);
        partners[j].retain(|&b| b != i);
        let mut seen = vec![false; n];
        let mut queue = vec![i];
        seen[i] = true;
        while let Some(v) = queue.pop() {
            for &w in &partners[v] {
                if !seen[w] {
                    seen[w] = true;
                    queue.push(w);
                }
            }
        }
        assembly.cut(i, j);
        if seen[j] {
            removed += 1;
            failures = 0;
        } else {
            partners[i].push(j);
            partners[j].push(i);
            assembly.link(i, j);
            failures += 1;
        }
    }
    removed
}

/// Removes a fraction of the direct links where connection is kept otherwise; returns the removed fraction.
pub fn remove_links(assembly: &mut Assembly, fraction: f64, random: &mut Random) -> f64 {
    let links = direct_links(assembly);
    if links.is_empty() || fraction <= 0.0 {
        return 0.0;
    }
    let removed = match assembly {
        Assembly::Directed(_) => remove_by_trial(assembly, fraction, random),
        Assembly::Undirected(_) | Assembly::Spheres(_) => {
            let chosen = choose_removable(assembly.len(), &links, fraction, random);
            for &[i, j] in &chosen {
                assembly.cut(i, j);
            }
            chosen.len()
        }
    };
    removed as f64 / links.len() as f64
}

/// Gives each grain without a direct link one to a random neighbour it touches; returns the number of links added.
pub fn join_isolated(assembly: &mut Assembly, random: &mut Random) -> usize {
    let n = assembly.len();
    let mut linked = vec![false; n];
    for [i, j] in direct_links(assembly) {
        linked[i] = true;
        linked[j] = true;
    }
    let mut touching = vec![Vec::new(); n];
    let compat = matches!(assembly, Assembly::Directed(_));
    for c in assembly.contacts() {
        if c.kind != ContactKind::Permanent && (c.direct || compat) {
            touching[c.i as usize].push(c.j as usize);
            touching[c.j as usize].push(c.i as usize);
        }
    }
    let mut added = 0;
    for i in 0..n {
        if !linked[i] && !touching[i].is_empty() {
            let j = touching[i][random.below(touching[i].len())];
            assembly.link(i, j);
            linked[i] = true;
            linked[j] = true;
            added += 1;
        }
    }
    added
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn bridges_are_exactly_the_links_whose_loss_splits_a_particle(
            edges in proptest::collection::vec((0usize..12, 0usize..12), 0..24)) {
            let links: Vec<[usize; 2]> = edges.into_iter().filter(|(a, b)| a != b).map(|(a, b)| [a, b]).collect();
            let (_, count) = particles(12, &links);
            for (k, is_bridge) in bridges(12, &links).into_iter().enumerate() {
                let mut rest = links.clone();
                rest.remove(k);
                prop_assert_eq!(is_bridge, particles(12, &rest).1 > count);
            }
        }

        #[test]
        fn removal_never_splits_and_stops_at_a_spanning_forest(
            edges in proptest::collection::btree_set((0usize..15, 0usize..15), 0..50), fraction in 0.0..1.0f64, seed in 0u64..99) {
            let links: Vec<[usize; 2]> = edges.into_iter().filter(|(a, b)| a < b).map(|(a, b)| [a, b]).collect();
            let (labels, count) = particles(15, &links);
            let gone = choose_removable(15, &links, fraction, &mut Random::new(seed));
            let rest: Vec<_> = links.iter().filter(|l| !gone.contains(l)).copied().collect();
            prop_assert_eq!(particles(15, &rest), (labels, count));
            let wanted = (fraction * links.len() as f64).floor() as usize;
            prop_assert!(gone.len() == wanted || rest.len() == 15 - count);
        }
    }
}

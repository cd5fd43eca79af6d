//! Elimination order of the contact graph by minimum degree, and the fill it causes.

use crate::problem::BlockMatrix;
use std::collections::BinaryHeap;

/// An elimination order with the filled pattern of the factors.
#[derive(Clone, Debug)]
pub struct Elimination {
    /// `order[p]` is the contact eliminated at place `p`.
    pub order: Vec<u32>,
    /// `place[k]` is the place of contact `k`.
    pub place: Vec<u32>,
    /// For each place, the later places coupled to it when it is eliminated, ascending.
    pub upper: Vec<Vec<u32>>,
    /// First place of the tail: from here on what is left is so nearly dense that it is factored as a dense matrix, and
    /// `upper` counts every later place.
    pub tail: usize,
    /// Block multiplications of one factorisation, those of the dense tail counted by [`DENSE_SPEED`].
    pub block_products: usize,
}

/// How many block multiplications of a dense factorisation cost as much as one of the sparse one (measured in the bench
/// `contact/newton`).
pub const DENSE_SPEED: usize = 8;

/// Share of the contacts left that the least connected one must feel for the rest to be taken as dense, in tenths.
const DENSE_TENTHS: usize = 7;

/// Contacts below which a dense tail is not worth its start.
const LEAST_TAIL: usize = 16;

/// Eliminates the contact with the fewest neighbours first, ties by index; stops with `None` once the factorisation
/// would need more than `limit` block multiplications.
#[must_use]
pub fn minimum_degree(w: &BlockMatrix, limit: usize) -> Option<Elimination> {
    let n = w.len();
    // symmetrised adjacency, sorted
    let mut adjacent: Vec<Vec<u32>> = vec![Vec::new(); n];
    for (i, j, _) in w.iter() {
        if i != j {
            adjacent[i].push(j as u32);
            adjacent[j].push(i as u32);
        }
    }
    for a in &mut adjacent {
        a.sort_unstable();
        a.dedup();
    }
    let mut heap: BinaryHeap<std::cmp::Reverse<(u32, u32)>> =
        (0..n).map(|k| std::cmp::Reverse((adjacent[k].len() as u32, k as u32))).collect();
    let mut eliminated = vec![false; n];
    let mut order = Vec::with_capacity(n);
    let mut place = vec![0u32; n];
    let mut products = 0usize;
    let mut tail = n;
    let mut reach: Vec<Vec<u32>> = Vec::with_capacity(n);
    let mut merged: Vec<u32> = Vec::new();
    while let Some(std::cmp::Reverse((degree, k))) = heap.pop() {
        let ku = k as usize;
        if eliminated[ku] || adjacent[ku].len() as u32 != degree {
            continue;
        }
        let left = n - order.len();
        if left >= LEAST_TAIL && 10 * degree as usize >= DENSE_TENTHS * (left - 1) {
            // what is left is taken in the order of the contacts
            products += dense_products(left) / DENSE_SPEED;
            if products > limit {
                return None;
            }
            tail = order.len();
            for k in (0..n).filter(|k| !eliminated[*k]) {
                place[k] = order.len() as u32;
                order.push(k as u32);
            }
            break;
        }
        eliminated[ku] = true;
        place[ku] = order.len() as u32;
        order.push(k);
        let neighbours = std::mem::take(&mut adjacent[ku]);
        let d = neighbours.len();
        products += d * d + d + 1;
        if products > limit {
            return None;
        }
        for a in &neighbours {
            // adjacent[a] ← (adjacent[a] ∪ neighbours) \ {a, k}, all sorted
            let old = &adjacent[*a as usize];
            merged.clear();
            let (mut p, mut q) = (0, 0);
            while p < old.len() || q < d {
                let next = match (old.get(p), neighbours.get(q)) {
                    (Some(x), Some(y)) if x == y => {
                        p += 1;
                        q += 1;
                        *x
                    }
                    (Some(x), Some(y)) if x < y => {
                        p += 1;
                        *x
                    }
                    (Some(x), None) => {
                        p += 1;
                        *x
                    }
                    (_, Some(y)) => {
                        q += 1;
                        *y
                    }
                    (None, None) => break,
                };
                if next != *a && next != k {
                    merged.push(next);
                }
            }
            adjacent[*a as usize].clear();
            adjacent[*a as usize].extend_from_slice(&merged);
            heap.push(std::cmp::Reverse((merged.len() as u32, *a)));
        }
        reach.push(neighbours);
    }
    let mut upper: Vec<Vec<u32>> = reach
        .into_iter()
        .map(|contacts| {
            let mut places: Vec<u32> = contacts.into_iter().map(|c| place[c as usize]).collect();
            places.sort_unstable();
            places
        })
        .collect();
    upper.extend((tail..n).map(|p| (p as u32 + 1..n as u32).collect()));
    Some(Elimination { order, place, upper, tail, block_products: products })
}

/// Block multiplications of a dense factorisation of `n` block rows.
fn dense_products(n: usize) -> usize {
    n * n * n / 3
}

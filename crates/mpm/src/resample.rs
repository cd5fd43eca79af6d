//! Stage 2: splitting, merging and spreading of particles.
//!
//! Particles are meant to have the volume of one point of the sub-lattice. Larger ones are split, small ones are given to their
//! neighbours, crowded ones inside the liquid are moved apart. Every operation keeps mass, rest volume, volume, linear
//! momentum, the centre of mass and angular momentum (affine part included) exactly: what a change of position would do to the
//! angular momentum is put into the affine matrices. Kinetic energy can only be lost. Everything runs in a fixed order.
//!
//! Source: Fei et al. 2019, stage 2, and spec 6.4; the conservation of angular momentum is our own.

use crate::grid::LiquidGrid;
use crate::material::LiquidMaterial;
use crate::neighbours::{for_near, interior_cells};
use crate::particles::{Particle, Particles};
use crate::random::{hash, uniform};
use crate::settings::LiquidSettings;
use crate::solid::{Solid, distance};
use crate::{LiquidError, particles_to_grid};
use constitutive::liquid_law::normalise;
use numerics::tensor::{Tensor, Vector, determinant, dimension_root};
use particle_grid::{NONE, cells_per_block};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// Volume over nominal volume below which a particle is given away.
const SMALL: f64 = 0.5;
/// Below this it may receive the excess of others.
const WANTING: f64 = 0.9;
/// Up to this it may receive small particles.
const NOMINAL: f64 = 1.1;
/// Above this a particle is split.
const LARGE: f64 = 2.0;

/// What the stage did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ResampleReport {
    /// Particles that were split.
    pub split: usize,
    /// Particles that came from splitting.
    pub children: usize,
    /// Particles given to their neighbours.
    pub merged: usize,
    /// Particles that gave their excess volume away.
    pub trimmed: usize,
    /// Particles moved apart.
    pub spread: usize,
    /// Particles of no volume that were removed.
    pub removed: usize,
    /// Mass removed with them [kg].
    pub removed_mass: f64,
}

/// Scratch of the stage.
#[derive(Clone, Debug, Default)]
pub struct ResampleScratch<const D: usize> {
    radius: Vec<f64>,
    shift: Vec<Vector<D>>,
    twist: Vec<Tensor<D>>,
    gone: Vec<bool>,
}

/// Maintains the particles: removes empty ones, splits, merges, spreads. Particles are sorted first.
///
/// - `dt`: time since the last pass [s]
/// - `step_index`: seeds the orientation of split particles
///
/// # Errors
/// Where positions cannot be sorted.
#[expect(clippy::too_many_arguments, reason = "state, surroundings, time and settings are all separate things")]
pub fn resample<const D: usize, S: Solid<D>>(
    particles: &mut Particles<D>,
    materials: &[LiquidMaterial],
    grid: &mut LiquidGrid<D>,
    solids: &[S],
    dt: f64,
    step_index: u64,
    settings: &LiquidSettings,
    scratch: &mut ResampleScratch<D>,
) -> Result<ResampleReport, LiquidError> {
    let mut report = ResampleReport::default();
    let dx = grid.lattice().dx;
    let fine = (dx / settings.particles_per_axis as f64).powi(D as i32);
    let least = 1e-12 * dx.powi(D as i32);
    if (0..particles.len()).any(|p| particles.volume(p) < least) {
        let keep: Vec<bool> = (0..particles.len()).map(|p| particles.volume(p) >= least).collect();
        report.removed = keep.iter().filter(|&&k| !k).count();
        report.removed_mass = particles.mass.iter().zip(&keep).filter(|(_, k)| !**k).map(|(m, _)| m).sum();
        particles.retain(|p| keep[p]);
    }
    if particles.is_empty() {
        return Ok(report);
    }
    let ratio = |particles: &Particles<D>, p: usize| particles.volume(p) / fine;
    for p in 0..particles.len() {
        if ratio(particles, p) > LARGE {
            report.children += split(particles, p, fine, dx, step_index, solids);
            report.split += 1;
        }
    }
    particles_to_grid::activate(particles, materials, &[], grid)?;
    // Merging is rare; most passes only look.
    if (0..particles.len()).any(|p| {
        let r = ratio(particles, p);
        r < SMALL || (r > NOMINAL && r <= LARGE)
    }) {
        merge(particles, grid, fine, &mut report, scratch);
        if report.merged + report.trimmed > 0 {
            // Receivers have moved: cells must be looked up anew before pairs are formed.
            particles_to_grid::activate(particles, materials, &[], grid)?;
        }
    }
    let strength = dt * settings.resample.relaxation_rate;
    if strength > 0.0 {
        report.spread = spread(particles, grid, strength, settings.particles_per_axis, step_index, scratch);
    }
    Ok(report)
}

/// Radius of the ball (disc) of a volume [m].
fn radius<const D: usize>(volume: f64) -> f64 {
    dimension_root::<D>(volume / if D == 2 { PI } else { 4.0 * PI / 3.0 })
}

/// `count` points on the unit sphere (circle) with zero mean.
fn pattern<const D: usize>(count: usize, seed: u64) -> Vec<Vector<D>> {
    let turn = TAU * uniform(&[seed, 1]);
    let mut points: Vec<Vector<D>> = (0..count)
        .map(|k| {
            if D == 2 {
                let angle = turn + TAU * k as f64 / count as f64;
                Vector::from_fn(|a, _| if a == 0 { angle.cos() } else { angle.sin() })
            } else {
                // Even spiral from pole to pole, turned about its axis.
                let z = 1.0 - (2.0 * k as f64 + 1.0) / count as f64;
                let angle = turn + k as f64 * PI * (3.0 - 5.0f64.sqrt());
                let r = (1.0 - z * z).max(0.0).sqrt();
                let xyz = [r * angle.cos(), r * angle.sin(), z];
                Vector::from_fn(|a, _| xyz[a])
            }
        })
        .collect();
    if D == 3 {
        // A second and third turn make the orientation uniform.
        let tilt = (1.0 - 2.0 * uniform(&[seed, 2])).acos();
        let swing = TAU * uniform(&[seed, 3]);
        for p in &mut points {
            let (x, z) = (p[0], p[2]);
            (p[0], p[2]) = (x * tilt.cos() + z * tilt.sin(), z * tilt.cos() - x * tilt.sin());
            let (x, y) = (p[0], p[1]);
            (p[0], p[1]) = (x * swing.cos() - y * swing.sin(), x * swing.sin() + y * swing.cos());
        }
    }
    let mean = points.iter().sum::<Vector<D>>() / count as f64;
    for p in &mut points {
        *p -= mean;
    }
    points
}

/// Splits a particle into equal children; returns how many there are.
fn split<const D: usize, S: Solid<D>>(
    particles: &mut Particles<D>,
    p: usize,
    fine: f64,
    dx: f64,
    step_index: u64,
    solids: &[S],
) -> usize {
    let parent = particles.get(p);
    let volume = particles.volume(p);
    let count = ((volume / fine).ceil() as usize).clamp(2, 64);
    let own = radius::<D>(volume / count as f64);
    let mut reach = 0.75 * own.max(radius::<D>(volume) - own);
    let points = pattern::<D>(count, hash(&[step_index, parent.id]));
    for _ in 0..4 {
        if points.iter().all(|d| distance(solids, &(parent.position + d * reach)) >= 0.0) {
            break;
        }
        reach *= 0.5;
    }
    let share = 1.0 / count as f64;
    // The children's motion about their centre takes its angular momentum from the affine part.
    let inertia = 0.25 * dx * dx;
    let second = points.iter().map(|d| d * d.transpose()).sum::<Tensor<D>>() * (reach * reach * share / inertia);
    let affine = parent.affine * (Tensor::<D>::identity() - second);
    for (k, d) in points.iter().enumerate() {
        let offset = d * reach;
        let child = Particle {
            position: parent.position + offset,
            velocity: parent.velocity + parent.affine * offset,
            affine,
            mass: parent.mass * share,
            rest_volume: parent.rest_volume * share,
            ..parent
        };
        if k == 0 {
            particles.set(p, &child);
        } else {
            particles.push(child);
        }
    }
    count
}

/// Joins a share of one particle to another; position, velocity and affine matrix keep all momenta.
fn join<const D: usize>(to: &mut Particle<D>, from: &Particle<D>, share: f64, inertia: f64) {
    let moved = from.mass * share;
    let total = to.mass + moved;
    let (a, b) = (to.mass / total, moved / total);
    let (dv, dx) = (from.velocity - to.velocity, from.position - to.position);
    to.position += dx * b;
    to.velocity += dv * b;
    to.affine = to.affine * a + from.affine * b + dv * dx.transpose() * (a * b / inertia);
    let volume = to.rest_volume * to.volume_ratio + from.rest_volume * from.volume_ratio * share;
    let weight = (from.rest_volume * from.volume_ratio * share) / volume;
    to.rest_volume += from.rest_volume * share;
    to.volume_ratio = volume / to.rest_volume;
    to.mass = total;
    let strain = to.elastic_strain * (1.0 - weight) + from.elastic_strain * weight;
    to.elastic_strain = normalise(&strain).map_or(to.elastic_strain, |(s, _)| s);
    let gradient = to.deformation_gradient * (1.0 - weight) + from.deformation_gradient * weight;
    let det = determinant(&gradient);
    if det > 0.0 {
        to.deformation_gradient = gradient * dimension_root::<D>(to.volume_ratio / det);
    }
}

fn merge<const D: usize>(
    particles: &mut Particles<D>,
    grid: &LiquidGrid<D>,
    fine: f64,
    report: &mut ResampleReport,
    scratch: &mut ResampleScratch<D>,
) {
    let dx = grid.lattice().dx;
    let inertia = 0.25 * dx * dx;
    let reach = 2.0 * radius::<D>(fine);
    let gone = &mut scratch.gone;
    gone.clear();
    gone.resize(particles.len(), false);
    let mut near = Vec::new();
    let periodic = grid.lattice().periods.iter().any(|&p| p > 0);
    for p in 0..particles.len() {
        if gone[p] {
            continue;
        }
        let own = particles.volume(p) / fine;
        // Receivers may be filled up to the nominal volume, counting what they have received already.
        let (limit, share) = if own < SMALL {
            (1.0, 1.0)
        } else if own > NOMINAL && own <= LARGE {
            (WANTING, 1.0 - 1.0 / own)
        } else {
            continue;
        };
        let x = particles.position[p];
        near.clear();
        for_near(grid, &x, reach, |q| {
            let size = particles.volume(q) / fine;
            let fits = size <= limit;
            let close = grid.lattice().displacement(&particles.position[q], &x).norm_squared() <= reach * reach;
            if q != p && !gone[q] && particles.material[q] == particles.material[p] && fits && close {
                near.push(q);
            }
        });
        if near.is_empty() {
            continue;
        }
        let mut giver = particles.get(p);
        let each = share / near.len() as f64;
        for &q in &near {
            let mut receiver = particles.get(q);
            if periodic {
                // Join with the image next door.
                giver.position = receiver.position + grid.lattice().displacement(&x, &receiver.position);
            }
            join(&mut receiver, &giver, each, inertia);
            if periodic {
                grid.lattice().wrap(&mut receiver.position);
            }
            particles.set(q, &receiver);
        }
        if own < SMALL {
            gone[p] = true;
            report.merged += 1;
        } else {
            particles.mass[p] *= 1.0 - share;
            particles.rest_volume[p] *= 1.0 - share;
            report.trimmed += 1;
        }
    }
    if report.merged > 0 {
        particles.retain(|p| !gone[p]);
    }
}

/// Moves crowded particles inside the liquid apart; returns how many moved.
///
/// Pairs move by shares of their masses, so that the centre of mass stays; what the shifts do to the angular momentum goes into
/// the affine matrices of the pair.
fn spread<const D: usize>(
    particles: &mut Particles<D>,
    grid: &LiquidGrid<D>,
    strength: f64,
    per_axis: usize,
    step_index: u64,
    scratch: &mut ResampleScratch<D>,
) -> usize {
    let lattice = *grid.lattice();
    let per = cells_per_block::<D>();
    let interior = interior_cells(grid, (per_axis.pow(D as u32) / 2).max(1));
    let twist_factor = 0.5 / (0.25 * lattice.dx * lattice.dx);
    // Weight of a neighbour at the spacing of the sub-lattice, whose square over that of the range is that of unit volume.
    let regular = (1.0 - 0.25 / radius::<D>(1.0).powi(2)).max(0.0).powi(3) * (1.0 + 1e-9);
    let n = particles.len();
    scratch.radius.clear();
    scratch.radius.extend((0..n).map(|p| radius::<D>(particles.volume(p))));
    scratch.shift.clear();
    scratch.shift.resize(n, Vector::zeros());
    scratch.twist.clear();
    scratch.twist.resize(n, Tensor::zeros());
    let view = &*particles;
    let radii = &scratch.radius;
    let shifts = grid.order.split(&mut scratch.shift);
    let twists = grid.order.split(&mut scratch.twist);
    let is_interior = |x: &Vector<D>| {
        let node = grid.blocks.node(&lattice.to_cells(x).map(|c| c.floor() as i32));
        node != NONE && interior[node as usize]
    };
    let moved = shifts
        .into_par_iter()
        .zip(twists)
        .enumerate()
        .map(|(rank, (shifts, twists))| {
            let mut moved = 0;
            let mut places = Vec::new();
            let start = grid.order.block_range(rank).start;
            let block = grid.blocks.occupied()[rank] as usize;
            for cell in 0..per {
                if !interior[block * per + cell] {
                    let range = grid.order.cell_range(rank, cell);
                    moved += part_coincident(
                        view,
                        radii,
                        range,
                        start,
                        step_index,
                        twist_factor,
                        shifts,
                        twists,
                        &mut places,
                    );
                    continue;
                }
                for p in grid.order.cell_range(rank, cell) {
                    let x = view.position[p];
                    let own = radii[p];
                    let reach = (2.5 * own).min(lattice.dx);
                    let (mut shift, mut twist) = (Vector::<D>::zeros(), Tensor::<D>::zeros());
                    for_near(grid, &x, reach, |q| {
                        let d = lattice.displacement(&x, &view.position[q]);
                        let r2 = d.norm_squared();
                        if r2 >= reach * reach || q == p {
                            return;
                        }
                        let other = radii[q];
                        // Both of a pair must find each other: the range is symmetric and within the search of both.
                        let range = (2.0 * (own * other).sqrt()).min(2.5 * own.min(other)).min(lattice.dx);
                        if r2 >= range * range || !is_interior(&view.position[q]) {
                            return;
                        }
                        // Only what is closer than the sub-lattice would hold it is crowded: a regular arrangement stays.
                        let s = 1.0 - r2 / (range * range);
                        let push = s * s * s - regular;
                        if push <= 0.0 {
                            return;
                        }
                        let direction = if r2 > 0.0 { d / r2.sqrt() } else { away(view.id[p], view.id[q], step_index) };
                        let mass = 2.0 * view.mass[q] / (view.mass[p] + view.mass[q]);
                        let step = direction * (strength * push * range * mass);
                        shift += step;
                        twist -= (view.velocity[p] - view.velocity[q]) * step.transpose() * twist_factor;
                    });
                    if shift.norm_squared() > 0.0 {
                        moved += 1;
                    }
                    shifts[p - start] = shift;
                    twists[p - start] = twist;
                }
            }
            moved
        })
        .sum();
    for p in 0..n {
        particles.position[p] += scratch.shift[p];
        particles.affine[p] += scratch.twist[p];
    }
    if lattice.periods.iter().any(|&p| p > 0) {
        for x in &mut particles.position {
            lattice.wrap(x);
        }
    }
    moved
}

/// Direction in which the first of two coincident particles gives way to the second: the pair agrees on it through its identities.
fn away<const D: usize>(first: u64, second: u64, step_index: u64) -> Vector<D> {
    let direction = pattern::<D>(2, hash(&[step_index, first.min(second), first.max(second)]))[0].normalize();
    if first < second { direction } else { -direction }
}

/// Share of their radius by which particles in exactly the same place near the surface give way to each other.
const PARTING: f64 = 0.1;

/// Parts particles of a cell that are in exactly the same place; returns how many moved.
///
/// Near the surface nothing is spread, because shifts would change its shape; but particles that coincide would stay together for good: the
/// grid gives them the same velocity for ever.
#[expect(clippy::too_many_arguments, reason = "views of one state")]
fn part_coincident<const D: usize>(
    view: &Particles<D>,
    radii: &[f64],
    range: std::ops::Range<usize>,
    start: usize,
    step_index: u64,
    twist_factor: f64,
    shifts: &mut [Vector<D>],
    twists: &mut [Tensor<D>],
    places: &mut Vec<usize>,
) -> usize {
    places.clear();
    places.extend(range);
    let order = |a: &usize, b: &usize| {
        let (x, y) = (&view.position[*a], &view.position[*b]);
        (0..D).map(|k| x[k].total_cmp(&y[k])).find(|o| o.is_ne()).unwrap_or(a.cmp(b))
    };
    places.sort_unstable_by(order);
    let mut moved = 0;
    for pair in places.windows(2) {
        let (p, q) = (pair[0], pair[1]);
        if view.position[p] != view.position[q] {
            continue;
        }
        // Three in one place are two pairs: each moves for each.
        let direction = away::<D>(view.id[p], view.id[q], step_index);
        let size = PARTING * radii[p].min(radii[q]);
        let mass = view.mass[p] + view.mass[q];
        for (one, other, sign) in [(p, q, 1.0), (q, p, -1.0)] {
            let step = direction * (sign * size * view.mass[other] / mass);
            shifts[one - start] += step;
            twists[one - start] -= (view.velocity[one] - view.velocity[other]) * step.transpose() * twist_factor;
        }
        moved += 2;
    }
    moved
}

/// Mean and standard deviation of the number of particles in the cells inside the liquid: how evenly it is sampled.
#[must_use]
pub fn sampling<const D: usize>(grid: &LiquidGrid<D>, per_axis: usize) -> (f64, f64) {
    let interior = interior_cells(grid, (per_axis.pow(D as u32) / 4).max(1));
    let counts: Vec<f64> = (0..grid.blocks.node_count())
        .filter(|&i| interior[i])
        .map(|i| crate::neighbours::occupancy(grid, i as u32) as f64)
        .collect();
    if counts.is_empty() {
        return (0.0, 0.0);
    }
    let mean = counts.iter().sum::<f64>() / counts.len() as f64;
    let variance = counts.iter().map(|c| (c - mean) * (c - mean)).sum::<f64>() / counts.len() as f64;
    (mean, variance.sqrt())
}

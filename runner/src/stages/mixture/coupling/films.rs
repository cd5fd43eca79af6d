//! Films inside the liquid (spec 5.5): their mass moves with the faces, and after the solves they move with the liquid.
//!
//! Stage 1 gives back nearly all film of vertices in the liquid; what is left is what no particle around could take, and the
//! film of edges that cross the surface.

use mpm::LiquidGrid;
use nalgebra::Vector3;
use particle_grid::{mac_offset, stencil};

use super::Both;
use crate::stages::Step;
use crate::system::Rejection;
use crate::world::World;
use crate::world::liquid::coupling::FaceNumbers;

/// An edge whose film moves with the liquid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InsideEdge {
    /// Strand.
    pub strand: usize,
    /// Edge in the whole set.
    pub edge: usize,
    /// First vertex of the edge in the whole set.
    pub vertex: usize,
    /// Mass of its film [kg].
    pub mass: f64,
    /// Velocity of its film over the ground when it joined the faces [m/s].
    pub velocity: Vector3<f64>,
    /// Speed of its film along the strand after the solves [m/s].
    pub speed: f64,
    /// Momentum that its film gave to the liquid in the step [N s].
    pub given: Vector3<f64>,
}

fn middle(rods: &rods::RodSet, vertex: usize) -> Vector3<f64> {
    (rods.position[vertex] + rods.position[vertex + 1]) * 0.5
}

/// Weights of the faces with liquid around a point; none unless every face around it holds some, so that they add up to one.
fn surrounded(grid: &LiquidGrid<3>, x: &Vector3<f64>, axis: usize, mut visit: impl FnMut(usize, f64)) -> f64 {
    let mut sum = 0.0;
    stencil(&grid.blocks, x, &mac_offset(axis), |s| {
        if grid.face[axis].mass[s.node] > grid.mass_floor {
            sum += s.weight;
            visit(s.node, s.weight);
        }
    });
    sum
}

/// Films of edges with a vertex deeper than half a cell join the faces as mass with its momentum.
pub fn carry_films(world: &mut World, step: Step) -> Result<(), Rejection> {
    let Some(both) = Both::of(world) else { return Ok(()) };
    let Both { rods, strands, films, film, flow, submersion, memory, .. } = both;
    submersion.inside_edges.clear();
    strands.stepper.velocities_into(rods, &mut submersion.vectors);
    let state = &films.state;
    for strand in 0..rods.strand_count() {
        let first = rods.vertices(strand).start;
        for (j, edge) in rods.edges(strand).enumerate() {
            let v = first + j;
            if !(memory.inside[v] || memory.inside[v + 1]) {
                continue;
            }
            let mass = film.density[strand] * 0.5 * (state.area[v] + state.area[v + 1]) * film.edge_length[edge];
            let x = middle(rods, v);
            if mass <= 0.0 || (0..3).any(|a| surrounded(&flow.grid, &x, a, |_, _| {}) < 1.0 - 1e-9) {
                continue;
            }
            let moves = (submersion.vectors[v] + submersion.vectors[v + 1]) * 0.5;
            let velocity = moves + film.tangent[edge] * state.velocity[edge];
            submersion.inside_edges.push(InsideEdge {
                strand,
                edge,
                vertex: v,
                mass,
                velocity,
                speed: 0.0,
                given: Vector3::zeros(),
            });
        }
    }
    if submersion.inside_edges.is_empty() {
        return Ok(());
    }
    let n = flow.grid.blocks.node_count();
    let (mut mass, mut momentum) = (FaceNumbers::<3>::zeros(n), FaceNumbers::<3>::zeros(n));
    for inside in &submersion.inside_edges {
        let x = middle(rods, inside.vertex);
        // the film's weight acts on the strand; the faces give added mass weight of their own
        let brings = inside.velocity - flow.body * step.dt;
        for a in 0..3 {
            surrounded(&flow.grid, &x, a, |node, weight| {
                mass.0[a][node] += weight * inside.mass;
                momentum.0[a][node] += weight * inside.mass * brings[a];
            });
        }
    }
    flow.coupling.added = Some((mass, momentum));
    Ok(())
}

/// Films inside the liquid take its velocity along the strand; what the liquid got from them across it the strand loses.
pub fn release_films(world: &mut World) -> Result<(), Rejection> {
    let Some(both) = Both::of(world) else { return Ok(()) };
    let Both { rods, strands, film, flow, submersion, .. } = both;
    if submersion.inside_edges.is_empty() {
        return Ok(());
    }
    strands.stepper.velocities_into(rods, &mut submersion.vectors);
    submersion.film_impulse.fill(Vector3::zeros());
    for k in 0..submersion.inside_edges.len() {
        let inside = submersion.inside_edges[k];
        let x = middle(rods, inside.vertex);
        let mut liquid = Vector3::zeros();
        for a in 0..3 {
            surrounded(&flow.grid, &x, a, |node, weight| liquid[a] += weight * flow.grid.face[a].velocity[node]);
        }
        let given = (inside.velocity - liquid) * inside.mass;
        let tangent = film.tangent[inside.edge];
        let across = given - tangent * given.dot(&tangent);
        submersion.film_impulse[inside.vertex] -= across * 0.5;
        submersion.film_impulse[inside.vertex + 1] -= across * 0.5;
        let moves = (submersion.vectors[inside.vertex] + submersion.vectors[inside.vertex + 1]) * 0.5;
        submersion.inside_edges[k].speed = (liquid - moves).dot(&tangent);
        submersion.inside_edges[k].given = given;
    }
    Ok(())
}

/// Gives films inside the liquid their velocity, whatever drove them otherwise.
pub fn hold_films(world: &mut World) {
    if let Some(both) = Both::of(world) {
        for inside in &both.submersion.inside_edges {
            both.films.state.velocity[inside.edge] = inside.speed;
        }
    }
}

//! Nodes at obstacles, pins and walls: which contacts hold, what they forbid, and Coulomb's friction from their reactions.
//!
//! A node with one holding contact sticks (its tangential velocity is the body's) or slips (a friction impulse of known size acts
//! against the sliding). Sizes, directions and states are those of the last solve and are taken anew until they agree with it. The
//! rare node that several contacts hold is rubbed after the solve.

use nalgebra::{SMatrix, SVector};
use particle_grid::{BlockGrid, cells_per_block};

use crate::boundary::{Actor, BoundarySample, inside_pin, rub};
use crate::nodes::{Totals, find_near};
use crate::settings::WallKind;

/// One thing that may hold a node.
#[derive(Clone, Debug)]
struct Contact<const D: usize> {
    actor: Actor,
    /// Out of the body; zero where all directions are held.
    normal: SVector<f64, D>,
    body: SVector<f64, D>,
    friction: f64,
    /// Normal velocity relative to the body while the contact holds.
    rebound: f64,
    /// Pushes only; may let go.
    unilateral: bool,
    holds: bool,
    rub: Rub<D>,
}

/// Friction of a contact that holds.
#[derive(Clone, Copy, Debug)]
enum Rub<const D: usize> {
    Stick,
    /// The impulse on the node [N s], against the sliding.
    Slip(SVector<f64, D>),
}

/// What [`Contacts::update`] found.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Change {
    /// Contacts that took hold, let go, began to stick or to slip.
    pub switched: usize,
    /// Mass norm of the change of all friction impulses.
    pub friction: f64,
    /// Mass norm of the friction impulses themselves.
    pub size: f64,
}

/// A node with its contacts, in the order in which the explicit step applies them.
#[derive(Clone, Debug)]
struct Held<const D: usize> {
    node: usize,
    contacts: Vec<Contact<D>>,
    free: SMatrix<f64, D, D>,
}

/// All nodes that something may hold.
#[derive(Clone, Debug)]
pub(super) struct Contacts<const D: usize> {
    held: Vec<Held<D>>,
}

impl<const D: usize> Contacts<D> {
    /// Finds candidate contacts; those hold at first that the predicted velocities run into.
    pub fn find(grid: &BlockGrid<D>, boundary: &BoundarySample<'_, D>, star: &[SVector<f64, D>], mass: &[f64]) -> Self {
        let per = cells_per_block::<D>();
        let cell = grid.lattice.dx;
        let mut near = Vec::new();
        let mut held = Vec::new();
        for (block, coordinates) in grid.blocks().iter().enumerate() {
            find_near(grid.lattice.origin, *coordinates, cell, boundary, &mut near);
            for node in block * per..(block + 1) * per {
                if mass[node] == 0.0 {
                    continue;
                }
                let index = grid.cell(node);
                let x = grid.lattice.node_position(&index, &[0.0; D]);
                let contacts = contacts_of(boundary, &index, &x, &near, &star[node]);
                if !contacts.is_empty() {
                    let mut entry = Held { node, contacts, free: SMatrix::identity() };
                    for contact in entry.contacts.iter_mut().filter(|c| c.holds) {
                        contact.predict(&star[node], mass[node]);
                    }
                    entry.settle();
                    held.push(entry);
                }
            }
        }
        Self { held }
    }

    /// Gives held directions their prescribed velocity.
    pub fn enforce(&self, velocity: &mut [SVector<f64, D>]) {
        for held in &self.held {
            let v = &mut velocity[held.node];
            let alone = held.is_alone();
            for contact in held.contacts.iter().filter(|c| c.holds) {
                if contact.is_full() {
                    *v = contact.body;
                } else if alone && contact.sticks() {
                    *v = contact.body + contact.normal * contact.rebound;
                } else {
                    *v += contact.normal * (contact.rebound - (*v - contact.body).dot(&contact.normal));
                }
            }
        }
    }

    /// Removes held directions from a node vector.
    pub fn project(&self, vector: &mut [SVector<f64, D>]) {
        for held in &self.held {
            vector[held.node] = held.free * vector[held.node];
        }
    }

    /// Friction impulse of each slipping node: `visit(node, impulse)`.
    pub fn slipping(&self, mut visit: impl FnMut(usize, &SVector<f64, D>)) {
        for held in self.held.iter().filter(|held| held.is_alone()) {
            for contact in held.contacts.iter().filter(|c| c.holds) {
                if let Rub::Slip(impulse) = &contact.rub {
                    visit(held.node, impulse);
                }
            }
        }
    }

    /// Lets go of contacts that would have to pull, takes up those that are run into, and takes the friction anew from the reactions.
    pub fn update(&mut self, velocity: &[SVector<f64, D>], residual: &[SVector<f64, D>], mass: &[f64]) -> Change {
        let mut change = Change::default();
        for held in &mut self.held {
            let (v, r, m) = (velocity[held.node], residual[held.node], mass[held.node]);
            let mut switched = 0;
            for contact in held.contacts.iter_mut().filter(|c| c.unilateral) {
                let holds = if contact.holds {
                    r.dot(&contact.normal) >= 0.0
                } else {
                    (v - contact.body).dot(&contact.normal) < -1e-12 * (v.norm() + contact.body.norm())
                };
                if holds != contact.holds {
                    switched += 1;
                    contact.holds = holds;
                    if holds {
                        contact.predict(&v, m);
                    }
                }
            }
            if switched == 0 && held.is_alone() {
                for contact in held.contacts.iter_mut().filter(|c| c.holds && c.friction > 0.0) {
                    let (turned, moved) = contact.rub_anew(&v, &r);
                    switched += usize::from(turned);
                    change.friction += moved / m;
                    if let Rub::Slip(impulse) = &contact.rub {
                        change.size += impulse.norm_squared() / m;
                    }
                }
            }
            if switched > 0 {
                held.settle();
                change.switched += switched;
            }
        }
        change.friction = change.friction.sqrt();
        change.size = change.size.sqrt();
        change
    }

    /// The books: what each body gave to the yarns; friction of nodes that several contacts hold.
    pub fn finish(
        &self,
        velocity: &mut [SVector<f64, D>],
        residual: &[SVector<f64, D>],
        mass: &[f64],
        totals: &mut Totals<D>,
    ) {
        for held in &self.held {
            let m = mass[held.node];
            // What is left of the reaction after earlier contacts have taken theirs.
            let mut reaction = residual[held.node];
            let alone = held.is_alone();
            for contact in held.contacts.iter().filter(|c| c.holds) {
                let mut impulse = reaction;
                if alone && !contact.is_full() {
                    if let Rub::Slip(friction) = contact.rub {
                        impulse = contact.normal * reaction.dot(&contact.normal) + friction;
                    }
                } else if !contact.is_full() {
                    let normal = reaction.dot(&contact.normal);
                    impulse = contact.normal * normal;
                    let v = velocity[held.node];
                    let relative = v - contact.body;
                    let along = relative - contact.normal * relative.dot(&contact.normal);
                    let rubbed = rub(along, contact.friction * normal.max(0.0) / m);
                    velocity[held.node] = v + (rubbed - along);
                    totals_add(totals, contact.actor, (rubbed - along) * m);
                }
                reaction -= impulse;
                totals_add(totals, contact.actor, impulse);
            }
        }
    }
}

fn totals_add<const D: usize>(totals: &mut Totals<D>, actor: Actor, impulse: SVector<f64, D>) {
    match actor {
        Actor::Obstacle(i) => totals.obstacles[i as usize] += impulse,
        Actor::Pin(i) => totals.pins[i as usize] += impulse,
        Actor::Wall => totals.walls += impulse,
    }
}

impl<const D: usize> Contact<D> {
    fn is_full(&self) -> bool {
        !self.unilateral && self.normal.iter().all(|x| *x == 0.0)
    }

    fn sticks(&self) -> bool {
        matches!(self.rub, Rub::Stick)
    }

    /// Part of a vector along the surface.
    fn along(&self, v: SVector<f64, D>) -> SVector<f64, D> {
        v - self.normal * v.dot(&self.normal)
    }

    /// Friction of a contact that has just taken hold of a node with velocity `v`: as if nothing else acted on the node.
    fn predict(&mut self, v: &SVector<f64, D>, mass: f64) {
        let relative = v - self.body;
        let sliding = self.along(relative);
        let (speed, bound) = (sliding.norm(), self.friction * (self.rebound - relative.dot(&self.normal)).max(0.0));
        self.rub = if self.friction == 0.0 {
            Rub::Slip(SVector::zeros())
        } else if speed > bound {
            Rub::Slip(sliding * (-bound * mass / speed))
        } else {
            Rub::Stick
        };
    }

    /// Friction from the reaction `r` of a solved node with velocity `v`: whether it changed between sticking and slipping, and the
    /// squared change of the impulse of a slipping node.
    fn rub_anew(&mut self, v: &SVector<f64, D>, r: &SVector<f64, D>) -> (bool, f64) {
        let bound = self.friction * r.dot(&self.normal).max(0.0);
        match self.rub {
            Rub::Stick => {
                let held = self.along(*r);
                let size = held.norm();
                if size <= bound * (1.0 + 1e-9) {
                    return (false, 0.0);
                }
                self.rub = Rub::Slip(held * (bound / size));
                (true, 0.0)
            }
            Rub::Slip(before) => {
                let sliding = self.along(v - self.body);
                if sliding.dot(&before) > 0.0 {
                    // It was pushed back through rest: friction holds it.
                    self.rub = Rub::Stick;
                    return (true, 0.0);
                }
                let speed = sliding.norm();
                let now = if speed > 0.0 { sliding * (-bound / speed) } else { before };
                self.rub = Rub::Slip(now);
                (false, (now - before).norm_squared())
            }
        }
    }
}

impl<const D: usize> Held<D> {
    /// One contact holds and no other.
    fn is_alone(&self) -> bool {
        self.contacts.iter().filter(|c| c.holds).count() == 1
    }

    /// Projection onto the directions that no holding contact forbids.
    fn settle(&mut self) {
        self.free = SMatrix::identity();
        for contact in self.contacts.iter().filter(|c| c.holds) {
            if contact.is_full() || (contact.sticks() && self.is_alone()) {
                self.free = SMatrix::zeros();
                return;
            }
            let normal = self.free * contact.normal;
            let length = normal.norm();
            if length > 1e-6 {
                let normal = normal / length;
                self.free -= normal * normal.transpose();
            }
        }
    }
}

/// Everything that may hold a node, obstacles first, then pins, then walls.
fn contacts_of<const D: usize>(
    boundary: &BoundarySample<'_, D>,
    index: &[i32; D],
    x: &SVector<f64, D>,
    near: &[u32],
    star: &SVector<f64, D>,
) -> Vec<Contact<D>> {
    let mut contacts = Vec::new();
    for &i in near {
        let obstacle = &boundary.obstacles[i as usize];
        let (distance, normal) = obstacle.sample(x);
        if distance < 0.0 {
            let body = obstacle.velocity_at(x);
            let approach = (star - body).dot(&normal);
            let (friction, restitution) = obstacle.surface();
            contacts.push(Contact {
                actor: Actor::Obstacle(i),
                normal,
                body,
                friction,
                rebound: -restitution * approach.min(0.0),
                unilateral: true,
                holds: approach < 0.0,
                rub: Rub::Slip(SVector::zeros()),
            });
        }
    }
    let full = |actor, body| Contact {
        actor,
        normal: SVector::zeros(),
        body,
        friction: 0.0,
        rebound: 0.0,
        unilateral: false,
        holds: true,
        rub: Rub::Slip(SVector::zeros()),
    };
    for (i, (center, body, half)) in boundary.pins.iter().enumerate() {
        if inside_pin(x, center, half) {
            contacts.push(full(Actor::Pin(i as u32), *body));
        }
    }
    if let Some(walls) = boundary.walls {
        for axis in 0..D {
            let Some((kind, out)) = walls.on(index, axis) else { continue };
            let mut normal = SVector::<f64, D>::zeros();
            normal[axis] = -out;
            let friction = if let WallKind::Friction(friction) = kind { friction } else { 0.0 };
            match kind {
                WallKind::Open => {}
                WallKind::Stick => contacts.push(full(Actor::Wall, SVector::zeros())),
                WallKind::Slip | WallKind::Separate | WallKind::Friction(_) => {
                    let unilateral = kind != WallKind::Slip;
                    contacts.push(Contact {
                        actor: Actor::Wall,
                        normal,
                        body: SVector::zeros(),
                        friction,
                        rebound: 0.0,
                        unilateral,
                        holds: !unilateral || star.dot(&normal) < 0.0,
                        rub: Rub::Slip(SVector::zeros()),
                    });
                }
            }
        }
    }
    // A node held in full is held by the last that holds it so (walls over pins over obstacles).
    if let Some(last) = contacts.iter().rposition(Contact::is_full) {
        contacts.swap(0, last);
        contacts.truncate(1);
    }
    contacts
}

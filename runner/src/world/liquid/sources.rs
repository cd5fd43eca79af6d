//! Stage 0 of the liquid: sources, drains and the domain.
//!
//! A source moves with its script: liquid flows in at rest against the shape plus the velocity of the source, both turning with
//! the shape. A vertical nozzle that is swept sideways therefore gives `area × velocity × time`, and the stream carries the
//! velocity of the nozzle.

use geometry::planar::PlanarShape;
use geometry::{Motion, Pose, Shape, VelocityField};
use mpm::{Emission, Inlet, Ledger, Particles, SourceSettings, SourceShape, SourceState, Vector, emit, terminate};
use particle_grid::Lattice;

use super::{Flow, FlowState, lift, lower};

/// A shape that moves by script.
#[derive(Clone, Debug)]
pub struct MovingShape {
    /// In space.
    pub shape: Shape,
    /// In the plane, for a liquid there.
    pub planar: Option<PlanarShape>,
    /// How it moves.
    pub motion: Motion,
    /// Its centre at the start [m].
    pub center: Vector<3>,
}

/// A shape from which liquid flows in.
#[derive(Clone, Debug)]
pub struct Source {
    /// Name for records.
    pub name: String,
    /// Shape and motion.
    pub place: MovingShape,
    /// Velocity of the liquid against the shape, in the frame of the shape [m/s].
    pub velocity: Vector<3>,
    /// Index of the material.
    pub material: u16,
    /// When it flows [s].
    pub during: (f64, f64),
}

/// A shape in which liquid disappears.
#[derive(Clone, Debug)]
pub struct Drain {
    /// Name for records.
    pub name: String,
    /// Shape and motion.
    pub place: MovingShape,
    /// When [s].
    pub during: (f64, f64),
}

/// A box outside which liquid disappears, in the directions that are not periodic.
#[derive(Clone, Copy, Debug)]
pub struct Domain<const D: usize> {
    /// Lowest corner [m]; minus infinity along periodic directions.
    pub low: Vector<D>,
    /// Highest corner [m]; infinite along periodic directions.
    pub high: Vector<D>,
}

impl MovingShape {
    /// Signed distance in the frame of the shape [m].
    #[must_use]
    pub fn own_distance(&self, x: &Vector<3>) -> f64 {
        match &self.planar {
            None => self.shape.signed_distance(x),
            Some(planar) => planar.signed_distance(&x.xy()),
        }
    }

    /// The box around the shape in its own frame [m]; `None` for an endless one.
    #[must_use]
    pub fn own_bounds(&self) -> Option<(Vector<3>, Vector<3>)> {
        self.shape.bounds().map(|b| (Vector::<3>::from(b.min), Vector::<3>::from(b.max)))
    }

    /// Velocity of the shape at its centre at a time [m/s].
    #[must_use]
    pub fn velocity(&self, time: f64) -> Vector<3> {
        let (pose, field) = self.motion.evaluate(&self.center, time);
        field.at(&pose.apply(&self.center))
    }
}

/// A shape in its own frame, where it rests.
struct AtRest<'a>(&'a MovingShape);

impl<const D: usize> SourceShape<D> for AtRest<'_> {
    fn distance(&self, x: &Vector<D>, _: f64) -> f64 {
        self.0.own_distance(&lift(x))
    }
    fn bounds(&self, _: f64) -> (Vector<D>, Vector<D>) {
        // endless sources are refused when the scene is read
        let (low, high) = self.0.own_bounds().unwrap_or((Vector::<3>::zeros(), Vector::<3>::zeros()));
        (lower(&low), lower(&high))
    }
}

impl Source {
    /// Emits what has entered since the last call, up to `time` [s].
    fn emit<const D: usize>(
        &self,
        state: &mut SourceState,
        lattice: &Lattice<D>,
        per_axis: usize,
        materials: &[mpm::LiquidMaterial],
        time: f64,
        particles: &mut Particles<D>,
    ) -> Emission<D> {
        let settings = SourceSettings {
            velocity: lower::<D>(&self.velocity),
            material: self.material,
            start: self.during.0,
            end: self.during.1,
        };
        let open = Lattice { periods: [0; D], ..*lattice };
        let first = particles.len();
        let mut out = emit(&AtRest(&self.place), &settings, state, &open, per_axis, materials, time, particles);
        let moves = !self.place.motion.movements.is_empty();
        let (pose, field) = self.place.motion.evaluate(&self.place.center, time);
        if moves {
            out.momentum = Vector::zeros();
        }
        for p in first..particles.len() {
            if moves {
                let x = pose.apply(&lift(&particles.position[p]));
                let v = pose.rotation * lift(&particles.velocity[p]) + field.at(&x);
                particles.position[p] = lower(&x);
                particles.velocity[p] = lower(&v);
                out.momentum += particles.velocity[p] * particles.mass[p];
            }
            lattice.wrap(&mut particles.position[p]);
        }
        out
    }

    /// Whether liquid flows through it: one that is at rest against its shape only fills it.
    #[must_use]
    pub fn flows(&self) -> bool {
        self.velocity != Vector::<3>::zeros()
    }

    /// Its mouth at a time [s], on a grid of spacing `dx` [m]; `None` while it is shut or where nothing flows.
    #[must_use]
    pub fn mouth(&self, time: f64, dx: f64) -> Option<Mouth<'_>> {
        let open = (self.during.0..self.during.1).contains(&time);
        let (low, high) = self.place.own_bounds()?;
        if !open || !self.flows() {
            return None;
        }
        let (pose, field) = self.place.motion.evaluate(&self.place.center, time);
        let along = self.velocity.normalize();
        let thickness = along.abs().dot(&(high - low));
        let reach = (0.5 * (dx - thickness)).max(0.0) + 1e-9 * dx;
        let shift = along * reach;
        let half = 0.5 * (high - low) + shift.abs();
        let centre = pose.apply(&(0.5 * (low + high)));
        Some(Mouth { source: self, pose, field, shift, centre, radius: half.norm() })
    }

    /// Largest speed of its liquid at a time [m/s]; zero while it is shut.
    #[must_use]
    pub fn speed(&self, time: f64, dt: f64) -> f64 {
        let open = time < self.during.1 && time + dt > self.during.0;
        if open { self.velocity.norm() + self.place.velocity(time).norm() } else { 0.0 }
    }
}

/// The place where the grid carries the velocity of a source, at one instant. Along the flow it is at least a cell long, so that a
/// thin shape holds one layer of faces wherever it lies between them.
#[derive(Clone, Debug)]
pub struct Mouth<'a> {
    source: &'a Source,
    pose: Pose,
    field: VelocityField,
    /// How far it reaches beyond the shape, along the flow [m].
    shift: Vector<3>,
    /// A ball around it, whichever way it is turned [m].
    centre: Vector<3>,
    radius: f64,
}

impl<const D: usize> Inlet<D> for Mouth<'_> {
    fn holds(&self, x: &Vector<D>) -> bool {
        let own = self.pose.apply_inverse(&lift(x));
        let inside = |y: Vector<3>| self.source.place.own_distance(&y) < 0.0;
        inside(own) || inside(own + self.shift) || inside(own - self.shift)
    }

    fn bounds(&self) -> (Vector<D>, Vector<D>) {
        let reach = Vector::<3>::repeat(self.radius);
        (lower(&(self.centre - reach)), lower(&(self.centre + reach)))
    }

    fn velocity(&self, x: &Vector<D>) -> Vector<D> {
        let x = lift(x);
        lower(&(self.pose.rotation * self.source.velocity + self.field.at(&x)))
    }
}

impl<const D: usize> Flow<D> {
    /// Lets liquid in and out at the start of a step.
    pub fn drive(&self, state: &mut FlowState<D>, time: f64) {
        let lattice = self.grid.lattice();
        let FlowState { particles, ledger, sources, .. } = state;
        for (source, own) in self.sources.iter().zip(sources) {
            let per_axis = self.settings.particles_per_axis;
            let emission = source.emit(own, lattice, per_axis, &self.materials, time, particles);
            ledger.emitted(&emission);
        }
        if particles.is_empty() {
            return;
        }
        for drain in self.drains.iter().filter(|drain| (drain.during.0..=drain.during.1).contains(&time)) {
            let pose = drain.place.motion.pose(&drain.place.center, time);
            take(particles, ledger, |x| drain.place.own_distance(&pose.apply_inverse(&lift(x))) < 0.0);
        }
        if let Some(domain) = &self.domain {
            let outside = |x: &Vector<D>| (0..D).any(|a| x[a] < domain.low[a] || x[a] > domain.high[a]);
            if particles.position.iter().any(outside) {
                take(particles, ledger, outside);
            }
        }
    }
}

fn take<const D: usize>(particles: &mut Particles<D>, ledger: &mut Ledger<D>, inside: impl Fn(&Vector<D>) -> bool) {
    let taken = terminate(particles, inside);
    ledger.terminated(&taken);
}

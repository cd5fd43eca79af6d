//! Solids that the liquid meets: a distance, a normal, a velocity, and how well the liquid sticks.

use geometry::PosedSolid;
use geometry::planar::PlanarShape;
use numerics::tensor::Vector;

/// A solid at one instant, as the liquid sees it.
pub trait Solid<const D: usize>: Sync {
    /// Signed distance, negative inside [m].
    fn distance(&self, x: &Vector<D>) -> f64;
    /// Signed distance [m] and outward unit normal.
    fn sample(&self, x: &Vector<D>) -> (f64, Vector<D>);
    /// Velocity of the solid at a position [m/s].
    fn velocity(&self, x: &Vector<D>) -> Vector<D>;
    /// How well the liquid sticks: 1 no slip, 0 free slip.
    fn stick(&self) -> f64;
}

/// The nearest of several solids at a position.
#[derive(Clone, Copy, Debug)]
pub struct Nearest<const D: usize> {
    /// Signed distance [m].
    pub distance: f64,
    /// Outward unit normal.
    pub normal: Vector<D>,
    /// Velocity of the solid [m/s].
    pub velocity: Vector<D>,
    /// 1 no slip, 0 free slip.
    pub stick: f64,
}

/// Distance to the nearest of several solids [m]; infinite where there is none.
#[inline]
#[must_use]
pub fn distance<const D: usize, S: Solid<D>>(solids: &[S], x: &Vector<D>) -> f64 {
    solids.iter().fold(f64::INFINITY, |d, s| d.min(s.distance(x)))
}

/// The nearest of several solids, or `None` where there is none.
#[must_use]
pub fn nearest<const D: usize, S: Solid<D>>(solids: &[S], x: &Vector<D>) -> Option<Nearest<D>> {
    let mut best: Option<(f64, &S)> = None;
    for s in solids {
        let d = s.distance(x);
        if best.is_none_or(|(b, _)| d < b) {
            best = Some((d, s));
        }
    }
    best.map(|(_, s)| {
        let (distance, normal) = s.sample(x);
        Nearest { distance, normal, velocity: s.velocity(x), stick: s.stick() }
    })
}

/// No solids at all, for scenes without any.
#[derive(Clone, Copy, Debug)]
pub enum NoSolid {}

impl<const D: usize> Solid<D> for NoSolid {
    fn distance(&self, _: &Vector<D>) -> f64 {
        match *self {}
    }
    fn sample(&self, _: &Vector<D>) -> (f64, Vector<D>) {
        match *self {}
    }
    fn velocity(&self, _: &Vector<D>) -> Vector<D> {
        match *self {}
    }
    fn stick(&self) -> f64 {
        match *self {}
    }
}

impl Solid<3> for PosedSolid<'_> {
    #[inline]
    fn distance(&self, x: &Vector<3>) -> f64 {
        self.signed_distance(x)
    }
    #[inline]
    fn sample(&self, x: &Vector<3>) -> (f64, Vector<3>) {
        let s = PosedSolid::sample(self, x);
        (s.distance, s.normal)
    }
    #[inline]
    fn velocity(&self, x: &Vector<3>) -> Vector<3> {
        self.velocity_at(x)
    }
    fn stick(&self) -> f64 {
        if self.solid().surface.sticky { 1.0 } else { 0.0 }
    }
}

/// A shape in the plane that moves without turning.
#[derive(Clone, Debug)]
pub struct PlanarSolid {
    /// The shape at the start.
    pub shape: PlanarShape,
    /// How far it has moved since [m].
    pub displacement: Vector<2>,
    /// How fast it moves [m/s].
    pub velocity: Vector<2>,
    /// 1 no slip, 0 free slip.
    pub stick: f64,
}

impl PlanarSolid {
    /// A resting shape.
    #[must_use]
    pub fn still(shape: PlanarShape, stick: f64) -> Self {
        Self { shape, displacement: Vector::zeros(), velocity: Vector::zeros(), stick }
    }

    /// A resting half-plane with the given normal out of the solid.
    #[must_use]
    pub fn wall(point: Vector<2>, normal: Vector<2>, stick: f64) -> Self {
        Self::still(PlanarShape::HalfPlane { point, normal }, stick)
    }
}

impl Solid<2> for PlanarSolid {
    #[inline]
    fn distance(&self, x: &Vector<2>) -> f64 {
        self.shape.signed_distance(&(x - self.displacement))
    }
    #[inline]
    fn sample(&self, x: &Vector<2>) -> (f64, Vector<2>) {
        self.shape.sample(&(x - self.displacement))
    }
    fn velocity(&self, _: &Vector<2>) -> Vector<2> {
        self.velocity
    }
    fn stick(&self) -> f64 {
        self.stick
    }
}

/// A half-space at rest in any dimension: floors and walls of small set-ups.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfSpace<const D: usize> {
    /// A point of its surface [m].
    pub point: Vector<D>,
    /// Unit normal out of the solid.
    pub normal: Vector<D>,
    /// 1 no slip, 0 free slip.
    pub stick: f64,
}

impl<const D: usize> Solid<D> for HalfSpace<D> {
    #[inline]
    fn distance(&self, x: &Vector<D>) -> f64 {
        (x - self.point).dot(&self.normal)
    }
    #[inline]
    fn sample(&self, x: &Vector<D>) -> (f64, Vector<D>) {
        (Solid::distance(self, x), self.normal)
    }
    fn velocity(&self, _: &Vector<D>) -> Vector<D> {
        Vector::zeros()
    }
    fn stick(&self) -> f64 {
        self.stick
    }
}

//! The solids of the scene as the liquid meets them: the same ones that strands touch.
//!
//! In space a solid is its own signed distance. In the plane it is the planar shape of its description, carried by the same
//! motion: a slice through the distance in space would name distances to parts above and below the plane.

use geometry::planar::PlanarShape;
use geometry::{Motion, PosedSolid};
use mpm::{Solid, Vector};

use super::{lift, lower};
use crate::world::solids::SceneSolid;

/// What the liquid knows of a solid beyond the solid itself.
#[derive(Clone, Debug)]
pub struct Body {
    /// Its shape in the plane; absent in space.
    pub planar: Option<PlanarShape>,
}

/// A solid at one instant, as the liquid sees it in `D` dimensions.
#[derive(Clone, Copy, Debug)]
pub struct PosedBody<'a, const D: usize> {
    posed: PosedSolid<'a>,
    planar: Option<&'a PlanarShape>,
    stick: f64,
}

/// All solids at one time [s].
#[must_use]
pub fn at<'a, const D: usize>(solids: &'a [SceneSolid], bodies: &'a [Body], time: f64) -> Vec<PosedBody<'a, D>> {
    let one = |(solid, body): (&'a SceneSolid, &'a Body)| PosedBody {
        posed: solid.solid.at(time),
        planar: body.planar.as_ref(),
        stick: solid.liquid_friction,
    };
    solids.iter().zip(bodies).map(one).collect()
}

/// Largest speed of a moving solid with an end at a time, over the corners of the box around it [m/s]; zero for one at rest.
#[must_use]
pub fn speed(solid: &SceneSolid, time: f64) -> f64 {
    let moving = &solid.solid;
    if still(&moving.motion) {
        return 0.0;
    }
    let posed = moving.at(time);
    let field = posed.velocity_field();
    match posed.bounds() {
        Some(bounds) => (0..8)
            .map(|corner| {
                let side = |k: usize| if corner >> k & 1 == 0 { bounds.min[k] } else { bounds.max[k] };
                field.at(&Vector::<3>::new(side(0), side(1), side(2))).norm()
            })
            .fold(0.0, f64::max),
        // an endless solid turns without end: only its translation is a speed
        None => field.linear.norm(),
    }
}

fn still(motion: &Motion) -> bool {
    motion.movements.is_empty()
}

impl<const D: usize> Solid<D> for PosedBody<'_, D> {
    #[inline]
    fn distance(&self, x: &Vector<D>) -> f64 {
        let x = lift(x);
        match self.planar {
            None => self.posed.signed_distance(&x),
            Some(shape) => {
                let pose = self.posed.pose();
                shape.signed_distance(&pose.apply_inverse(&x).xy()) * pose.scale
            }
        }
    }

    #[inline]
    fn sample(&self, x: &Vector<D>) -> (f64, Vector<D>) {
        let x = lift(x);
        match self.planar {
            None => {
                let sample = self.posed.sample(&x);
                (sample.distance, lower(&sample.normal))
            }
            Some(shape) => {
                let pose = self.posed.pose();
                let (distance, normal) = shape.sample(&pose.apply_inverse(&x).xy());
                (distance * pose.scale, lower(&(pose.rotation * normal.push(0.0))))
            }
        }
    }

    fn velocity(&self, x: &Vector<D>) -> Vector<D> {
        lower(&self.posed.velocity_at(&lift(x)))
    }

    fn stick(&self) -> f64 {
        self.stick
    }
}

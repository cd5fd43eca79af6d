//! What acts on the strands during one step.

use crate::error::RodError;
use crate::state::RodSet;
use nalgebra::Vector3;

/// Loads of one step; every slice is optional and then means zero.
#[derive(Clone, Copy, Debug, Default)]
pub struct Loads<'a> {
    /// Gravity \[m/s²\].
    pub gravity: Vector3<f64>,
    /// Force per vertex \[N\] (pressure, external fields), constant over the step.
    pub force: Option<&'a [Vector3<f64>]>,
    /// Torque about the tangent per edge \[N m\].
    pub torque: Option<&'a [f64]>,
    /// Linear drag coefficient per vertex \[kg/s\] against [`fluid_velocity`](Self::fluid_velocity).
    pub drag: Option<&'a [f64]>,
    /// Velocity per vertex \[m/s\] that the drag pulls towards.
    pub fluid_velocity: Option<&'a [Vector3<f64>]>,
    /// Impulse per vertex over the step \[N s\] (inertia of a film).
    pub impulse: Option<&'a [Vector3<f64>]>,
    /// Extra mass per vertex \[kg\] (a film); it moves and weighs with the vertex.
    pub film_mass: Option<&'a [f64]>,
    /// Film height per vertex \[m\]; only for the turning inertia.
    pub film_height: Option<&'a [f64]>,
}

impl<'a> Loads<'a> {
    /// Gravity alone.
    #[must_use]
    pub fn gravity(gravity: Vector3<f64>) -> Self {
        Self { gravity, ..Self::default() }
    }

    /// Refuses slices of the wrong length and numbers that are not finite.
    pub fn check(&self, rods: &RodSet) -> Result<(), RodError> {
        let (vertices, edges) = (rods.vertex_count(), rods.edge_count());
        let length = |what, got: Option<usize>, expected| match got {
            Some(got) if got != expected => Err(RodError::Argument { what, expected, got }),
            _ => Ok(()),
        };
        length("loads.force", self.force.map(<[_]>::len), vertices)?;
        length("loads.torque", self.torque.map(<[_]>::len), edges)?;
        length("loads.drag", self.drag.map(<[_]>::len), vertices)?;
        length("loads.fluid_velocity", self.fluid_velocity.map(<[_]>::len), vertices)?;
        length("loads.impulse", self.impulse.map(<[_]>::len), vertices)?;
        length("loads.film_mass", self.film_mass.map(<[_]>::len), vertices)?;
        length("loads.film_height", self.film_height.map(<[_]>::len), vertices)?;
        let place = |what, i: usize| {
            let (strand, vertex) = rods.locate_vertex(i);
            RodError::NonFinite { strand, vertex, what }
        };
        if !self.gravity.iter().all(|v| v.is_finite()) {
            return Err(RodError::NonFinite { strand: 0, vertex: 0, what: "gravity" });
        }
        for (what, slice) in [("force", self.force), ("fluid velocity", self.fluid_velocity), ("impulse", self.impulse)] {
            if let Some(i) = slice.and_then(|s| s.iter().position(|v| !v.iter().all(|c| c.is_finite()))) {
                return Err(place(what, i));
            }
        }
        for (what, slice) in [("drag", self.drag), ("film mass", self.film_mass), ("film height", self.film_height)] {
            if let Some(i) = slice.and_then(|s| s.iter().position(|v| !(v.is_finite() && *v >= 0.0))) {
                return Err(place(what, i));
            }
        }
        Ok(())
    }
}

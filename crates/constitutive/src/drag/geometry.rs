//! Areas of a body in a stream.

use std::f64::consts::PI;

/// What the drag law needs of a body: two areas and a diameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DragGeometry {
    /// Area seen from the stream `A_⊥` [m²].
    pub projected_area: f64,
    /// Area of the surface `A_c` [m²].
    pub surface_area: f64,
    /// Diameter of the circle of the projected area `d_p = 2√(A_⊥/π)` [m].
    pub diameter: f64,
}

impl DragGeometry {
    /// A piece of strand with hemispherical ends.
    ///
    /// - `radius`, `length`: of the cylinder [m]
    /// - `sine`: sine of the angle between its axis and the stream, `‖t × û‖`
    #[inline]
    #[must_use]
    pub fn capsule(radius: f64, length: f64, sine: f64) -> Self {
        let cap = PI * radius * radius;
        Self::from_areas(2.0 * radius * length * sine + cap, 2.0 * PI * radius * length + 4.0 * cap)
    }

    /// A sphere of the given diameter [m].
    #[must_use]
    pub fn sphere(diameter: f64) -> Self {
        Self::capsule(0.5 * diameter, 0.0, 0.0)
    }

    #[inline]
    fn from_areas(projected_area: f64, surface_area: f64) -> Self {
        DragGeometry { projected_area, surface_area, diameter: 2.0 * (projected_area / PI).sqrt() }
    }

    /// Surface over projected area: 4 for a sphere.
    #[inline]
    #[must_use]
    pub fn area_ratio(&self) -> f64 {
        self.surface_area / self.projected_area
    }
}

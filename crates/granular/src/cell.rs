//! The sheared box: nearest images, wrapping and relative velocities across its edges (Lees & Edwards 1972).

use serde::{Deserialize, Serialize};

/// How the box ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Boundary {
    /// Periodic, rows above and below shifted and moving with the shear.
    #[default]
    LeesEdwards,
    /// Periodic, at rest.
    Periodic,
    /// Unbounded.
    Open,
    /// Periodic along the flow, flat rough walls below and above that move with the shear.
    Walls,
}

impl Boundary {
    /// Periodic along the flow.
    pub fn periodic_x(self) -> bool {
        self != Self::Open
    }

    /// Periodic along the gradient.
    pub fn periodic_y(self) -> bool {
        matches!(self, Self::LeesEdwards | Self::Periodic)
    }
}

/// Size and shear of the box.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Cell {
    /// Width along the flow [µm].
    pub width: f64,
    /// Height along the gradient [µm].
    pub height: f64,
    /// Accumulated shear strain [-], never reduced.
    pub strain: f64,
    /// Shear rate [1/s].
    pub rate: f64,
    /// Rate at which the height shrinks over the height [1/s]; positive closes the box.
    pub closing: f64,
    /// How the box ends.
    pub boundary: Boundary,
}

impl Cell {
    /// A Lees–Edwards box at rest.
    pub fn new(width: f64, height: f64) -> Self {
        Self { width, height, strain: 0.0, rate: 0.0, closing: 0.0, boundary: Boundary::LeesEdwards }
    }

    /// Area of the box [µm²].
    pub fn area(&self) -> f64 {
        self.width * self.height
    }

    /// Factor from `force · length` of this room to stress in Pa (per metre of depth).
    pub fn stress_scale(&self) -> f64 {
        1e-18 / (self.width * 1e-6 * (self.height * 1e-6))
    }

    /// Reduces a separation to its nearest image and returns it with the rows crossed (positive: partner seen one row below).
    ///
    /// Rows are reduced first, then columns, which is exact for any strain. A separation that is not finite comes back unchanged.
    #[inline(always)]
    pub fn nearest(&self, mut dx: f64, mut dy: f64) -> ([f64; 2], i32, bool) {
        let (mut rows, mut wrapped) = (0, false);
        if self.boundary.periodic_y() && dy.is_finite() {
            let half = self.height / 2.0;
            while dy >= half {
                dy -= self.height;
                dx -= self.height * self.strain;
                rows += 1;
            }
            while dy < -half {
                dy += self.height;
                dx += self.height * self.strain;
                rows -= 1;
            }
            wrapped = rows != 0;
        }
        if self.boundary.periodic_x() && dx.is_finite() {
            let half = self.width / 2.0;
            if dx.abs() > 64.0 * self.width {
                dx -= (dx / self.width).round() * self.width;
            }
            while dx >= half {
                dx -= self.width;
                wrapped = true;
            }
            while dx < -half {
                dx += self.width;
                wrapped = true;
            }
        }
        ([dx, dy], rows, wrapped)
    }

    /// Wraps a position into the box; returns it with the change of the flow velocity.
    #[inline(always)]
    pub fn wrap(&self, mut x: f64, mut y: f64) -> ([f64; 2], f64) {
        let old = y;
        if self.boundary.periodic_y() && y.is_finite() {
            while y >= self.height {
                y -= self.height;
                x -= self.height * self.strain;
            }
            while y < 0.0 {
                y += self.height;
                x += self.height * self.strain;
            }
        }
        if self.boundary.periodic_x() && x.is_finite() {
            if x.abs() > 64.0 * self.width {
                x -= (x / self.width).floor() * self.width;
            }
            while x >= self.width {
                x -= self.width;
            }
            while x < 0.0 {
                x += self.width;
            }
        }
        ([x, y], (y - old) * self.rate)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn nearest_image_is_antisymmetric_and_independent_of_whole_turns(
            dx in -900.0..900.0f64, dy in -900.0..900.0f64, strain in -3.0..3.0f64) {
            let mut cell = Cell::new(500.0, 400.0);
            cell.strain = strain;
            let ([ax, ay], rows, _) = cell.nearest(dx, dy);
            prop_assert!((-250.0..250.0).contains(&ax) && (-200.0..200.0).contains(&ay));
            let ([bx, by], back, _) = cell.nearest(-dx, -dy);
            if ax > -249.9 && ay > -199.9 && ax < 249.9 && ay < 199.9 {
                prop_assert!((ax + bx).abs() < 1e-12 && (ay + by).abs() < 1e-12 && rows == -back);
                // A strain larger by width/height shifts the rows by one whole box.
                cell.strain += 500.0 / 400.0;
                let ([cx, cy], _, _) = cell.nearest(dx, dy);
                prop_assert!((ax - cx).abs() < 1e-9 && (ay - cy).abs() < 1e-9);
            }
        }

        #[test]
        fn wrapping_keeps_nearest_images(x in -300.0..900.0f64, y in -300.0..900.0f64, strain in -3.0..3.0f64) {
            let mut cell = Cell::new(500.0, 400.0);
            cell.strain = strain;
            cell.rate = 2.0;
            let ([wx, wy], dv) = cell.wrap(x, y);
            prop_assert!((0.0..500.0).contains(&wx) && (0.0..400.0).contains(&wy));
            prop_assert!((dv - 2.0 * (wy - y)).abs() < 1e-12);
            let ([ax, ay], ..) = cell.nearest(x - 100.0, y - 100.0);
            let ([bx, by], ..) = cell.nearest(wx - 100.0, wy - 100.0);
            if ax.abs() < 249.0 && ay.abs() < 199.0 {
                prop_assert!((ax - bx).abs() < 1e-9 && (ay - by).abs() < 1e-9);
            }
        }
    }
}

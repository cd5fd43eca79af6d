//! Pictures of frames by a small software renderer: lit tubes, balls and triangles, no window, no graphics card.
//!
//! ```text
//! Frame ─► Framing (what must be in view, over a whole run) ─► Camera
//!       └► primitives (capsules, triangles, colours) ─► raster (bands of rows, depth test) ─► edges shaded ─► RgbImage ─► PNG, GIF
//! ```
//! The same frame gives the same bytes for any number of threads. Numbers that are not finite are left out and counted.

mod camera;
mod color;
mod image;
mod primitives;
mod raster;

pub use camera::{Camera, Framing};
pub use color::{ColorBy, colormap};
pub use image::{PictureError, RgbImage, animation};

use crate::record::frame::Frame;

/// How a picture is to look.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureOptions {
    /// Width [pixels], at least 16.
    pub width: usize,
    /// Height [pixels], at least 16.
    pub height: usize,
    /// Samples per pixel and direction, 1 to 4; 2 smooths edges well.
    pub supersample: usize,
    /// From where the scene is seen: a direction from the scene to the eye. By default in front and a little above, from the side that shows most;
    /// flat scenes are seen at right angles.
    pub from: Option<[f64; 3]>,
    /// Which way is up.
    pub up: [f64; 3],
    /// What the colours show.
    pub color: ColorBy,
}

impl Default for PictureOptions {
    fn default() -> PictureOptions {
        PictureOptions {
            width: 960,
            height: 600,
            supersample: 2,
            from: None,
            up: [0.0, 1.0, 0.0],
            color: ColorBy::Piece,
        }
    }
}

/// A picture of one frame, framed by itself.
#[must_use]
pub fn still(frame: &Frame, options: &PictureOptions) -> RgbImage {
    let mut framing = Framing::default();
    framing.include(frame);
    render(frame, &Camera::new(&framing, options), options)
}

/// A picture of one frame through a given camera (one camera for all frames of a run keeps the view still).
#[must_use]
pub fn render(frame: &Frame, camera: &Camera, options: &PictureOptions) -> RgbImage {
    let factor = options.supersample.clamp(1, 4);
    let seen = primitives::collect(frame, camera, &options.color, factor);
    let light = camera.seen_from_light(raster::LIGHT, (factor * camera.width.max(camera.height)).min(2048));
    let lit = primitives::collect(frame, &light, &ColorBy::Piece, 1);
    raster::render(&seen, &lit, camera, &light, factor)
}

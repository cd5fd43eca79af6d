//! From primitives to pixels: bands of rows in parallel, each with its own depth, then edges, light and averaging.

use rayon::prelude::*;

use super::camera::Camera;
use super::color::{Color, encode, linear};
use super::image::RgbImage;
use super::primitives::{Capsule, Primitives, Triangle};

/// Rows of one band in the supersampled picture.
const BAND: usize = 16;
const SKY: [u8; 3] = [252, 252, 253];
const HORIZON: [u8; 3] = [233, 237, 242];
/// Where the light comes from: right, up, towards the eye.
pub(super) const LIGHT: [f32; 3] = [-0.42, 0.68, 0.60];
const HALFWAY: [f32; 3] = [-0.235, 0.380, 0.895];

/// What reaches the eye from a sample.
#[derive(Clone, Copy, Default)]
struct Light {
    /// Light from all around, which shadows leave.
    ambient: Color,
    /// Light from the lamp.
    direct: Color,
}

/// Depth and light of every sample.
struct Canvas {
    width: usize,
    depth: Vec<f32>,
    light: Vec<Light>,
}

/// Draws what the eye sees; `lit` is the same scene as the light sees it, for shadows.
pub(super) fn render(seen: &Primitives, lit: &Primitives, camera: &Camera, light: &Camera, factor: usize) -> RgbImage {
    let shadows = draw(lit, light, 1);
    resolve(&draw(seen, camera, factor), &shadows, camera, light, factor)
}

fn draw(primitives: &Primitives, camera: &Camera, factor: usize) -> Canvas {
    let (width, height) = (camera.width * factor, camera.height * factor);
    let bands = height.div_ceil(BAND);
    let (capsules, triangles) =
        (bin_capsules(&primitives.capsules, bands), bin_triangles(&primitives.triangles, bands));
    let mut canvas =
        Canvas { width, depth: vec![f32::INFINITY; width * height], light: vec![Light::default(); width * height] };
    let eye = camera.eye_distance() as f32;
    canvas.depth.par_chunks_mut(width * BAND).zip(canvas.light.par_chunks_mut(width * BAND)).enumerate().for_each(
        |(band, (depth, light))| {
            let mut rows = Rows { top: band * BAND, width, eye, depth, light };
            triangles.of(band).iter().for_each(|&i| rows.triangle(&primitives.triangles[i as usize]));
            capsules.of(band).iter().for_each(|&i| rows.capsule(&primitives.capsules[i as usize]));
        },
    );
    canvas
}

/// Lists of primitives per band, in their order.
struct Bins {
    start: Vec<u32>,
    items: Vec<u32>,
}

impl Bins {
    fn of(&self, band: usize) -> &[u32] {
        &self.items[self.start[band] as usize..self.start[band + 1] as usize]
    }

    fn new(ranges: &[Option<(usize, usize)>], bands: usize) -> Bins {
        let mut start = vec![0u32; bands + 1];
        for &(first, last) in ranges.iter().flatten() {
            (first..=last).for_each(|band| start[band + 1] += 1);
        }
        for band in 0..bands {
            start[band + 1] += start[band];
        }
        let mut items = vec![0u32; start[bands] as usize];
        let mut next = start.clone();
        for (i, range) in ranges.iter().enumerate() {
            if let Some((first, last)) = *range {
                for place in &mut next[first..=last] {
                    items[*place as usize] = i as u32;
                    *place += 1;
                }
            }
        }
        Bins { start, items }
    }
}

fn band_range(top: f32, bottom: f32, bands: usize) -> Option<(usize, usize)> {
    let limit = (bands * BAND) as f32;
    if !(bottom >= 0.0 && top < limit) {
        return None;
    }
    Some((top.max(0.0) as usize / BAND, (bottom.min(limit - 1.0) as usize / BAND).min(bands - 1)))
}

fn bin_capsules(capsules: &[Capsule], bands: usize) -> Bins {
    let range = |c: &Capsule| {
        let (y0, y1, r) = (c.ends[0][1], c.ends[1][1], c.radius[0].max(c.radius[1]));
        band_range(y0.min(y1) - r, y0.max(y1) + r, bands)
    };
    Bins::new(&capsules.iter().map(range).collect::<Vec<_>>(), bands)
}

fn bin_triangles(triangles: &[Triangle], bands: usize) -> Bins {
    let range = |t: &Triangle| {
        let y = t.corners.map(|c| c[1]);
        band_range(y[0].min(y[1]).min(y[2]), y[0].max(y[1]).max(y[2]), bands)
    };
    Bins::new(&triangles.iter().map(range).collect::<Vec<_>>(), bands)
}

/// One band while it is drawn.
struct Rows<'a> {
    top: usize,
    width: usize,
    /// Distance of the eye from the centre [m], infinite for parallel projection.
    eye: f32,
    depth: &'a mut [f32],
    light: &'a mut [Light],
}

impl Rows<'_> {
    fn span(&self, low: f32, high: f32) -> std::ops::Range<usize> {
        let first = (low - 0.5).ceil().clamp(0.0, self.width as f32) as usize;
        let end = ((high - 0.5).floor() + 1.0).clamp(0.0, self.width as f32) as usize;
        first..end.max(first)
    }

    fn capsule(&mut self, c: &Capsule) {
        let [a, b] = c.ends;
        let d = [b[0] - a[0], b[1] - a[1]];
        let dd = d[0] * d[0] + d[1] * d[1];
        let inverse = if dd > 1e-12 { 1.0 / dd } else { 0.0 };
        let largest = c.radius[0].max(c.radius[1]);
        let rows = self.depth.len() / self.width;
        let first = (a[1].min(b[1]) - largest - self.top as f32 - 0.5).ceil().clamp(0.0, rows as f32) as usize;
        let last = (a[1].max(b[1]) + largest - self.top as f32 - 0.5).floor().clamp(-1.0, rows as f32 - 1.0);
        for row in first..(last + 1.0) as usize {
            let y = (self.top + row) as f32 + 0.5;
            // Where the strip of this row meets the tube, so that long slanted tubes cost their own pixels only.
            let (mut low, mut high) = (a[0].min(b[0]) - largest, a[0].max(b[0]) + largest);
            if d[1].abs() > 1e-6 {
                let t0 = ((y - largest - a[1]) / d[1]).clamp(0.0, 1.0);
                let t1 = ((y + largest - a[1]) / d[1]).clamp(0.0, 1.0);
                let (x0, x1) = (a[0] + d[0] * t0, a[0] + d[0] * t1);
                low = low.max(x0.min(x1) - largest);
                high = high.min(x0.max(x1) + largest);
            }
            for x in self.span(low, high) {
                let p = [x as f32 + 0.5 - a[0], y - a[1]];
                let t = ((p[0] * d[0] + p[1] * d[1]) * inverse).clamp(0.0, 1.0);
                let offset = [p[0] - d[0] * t, p[1] - d[1] * t];
                let radius = c.radius[0] + (c.radius[1] - c.radius[0]) * t;
                let square = (offset[0] * offset[0] + offset[1] * offset[1]) / (radius * radius);
                if square > 1.0 {
                    continue;
                }
                let height = (1.0 - square).sqrt();
                let depth = c.depth[0] + (c.depth[1] - c.depth[0]) * t - c.rise * height;
                let at = row * self.width + x;
                if depth < self.depth[at] {
                    self.depth[at] = depth;
                    let normal = [offset[0] / radius, -offset[1] / radius, height];
                    let base = std::array::from_fn(|k| c.color[0][k] + (c.color[1][k] - c.color[0][k]) * t);
                    self.light[at] = shade(base, normal).over(linear(HORIZON), c.coverage);
                }
            }
        }
    }

    fn triangle(&mut self, t: &Triangle) {
        let [a, b, c] = t.corners;
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if area.abs() <= 1e-6 || !area.is_finite() {
            return;
        }
        let rows = self.depth.len() / self.width;
        let ys = [a[1], b[1], c[1]];
        let (ymin, ymax) = (ys[0].min(ys[1]).min(ys[2]), ys[0].max(ys[1]).max(ys[2]));
        let first = (ymin - self.top as f32 - 0.5).ceil().clamp(0.0, rows as f32) as usize;
        let last = (ymax - self.top as f32 - 0.5).floor().clamp(-1.0, rows as f32 - 1.0);
        for row in first..(last + 1.0) as usize {
            let y = (self.top + row) as f32 + 0.5;
            let xs = [a[0], b[0], c[0]];
            for x in self.span(xs[0].min(xs[1]).min(xs[2]), xs[0].max(xs[1]).max(xs[2])) {
                let p = [x as f32 + 0.5, y];
                let edge =
                    |u: [f32; 2], v: [f32; 2]| ((v[0] - u[0]) * (p[1] - u[1]) - (v[1] - u[1]) * (p[0] - u[0])) / area;
                let w = [edge(b, c), edge(c, a), edge(a, b)];
                if w.iter().any(|w| *w < 0.0) {
                    continue;
                }
                let mix = |v: [f32; 3]| w[0] * v[0] + w[1] * v[1] + w[2] * v[2];
                // Along a plane it is the reciprocal of the distance that is linear in the picture.
                let depth = if self.eye.is_finite() {
                    1.0 / mix(t.depth.map(|d| 1.0 / (self.eye + d))) - self.eye
                } else {
                    mix(t.depth)
                };
                let at = row * self.width + x;
                if depth < self.depth[at] {
                    self.depth[at] = depth;
                    let n: [f32; 3] = std::array::from_fn(|k| mix(t.normals.map(|n| n[k])));
                    let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt().max(1e-12);
                    // Seen from inside the other side is lit.
                    let side = if n[2] < 0.0 { -1.0 } else { 1.0 };
                    let base = std::array::from_fn(|k| mix(t.color.map(|c| c[k])));
                    self.light[at] = shade(base, n.map(|v| side * v / length));
                }
            }
        }
    }
}

impl Light {
    /// The share `coverage` of this light, the rest from behind.
    fn over(self, behind: Color, coverage: f32) -> Light {
        Light {
            ambient: std::array::from_fn(|k| behind[k] + (self.ambient[k] - behind[k]) * coverage),
            direct: self.direct.map(|v| v * coverage),
        }
    }
}

/// A lamp at the upper left with a small highlight, the sky above and the floor below.
fn shade(base: Color, n: [f32; 3]) -> Light {
    let dot = |a: [f32; 3]| a[0] * n[0] + a[1] * n[1] + a[2] * n[2];
    let sky = 0.5 + 0.5 * n[1];
    let diffuse = 0.72 * dot(LIGHT).max(0.0);
    let highlight = 0.18 * dot(HALFWAY).max(0.0).powi(40);
    Light { ambient: base.map(|c| c * (0.30 + 0.22 * sky)), direct: base.map(|c| c * diffuse + highlight) }
}

/// Darkens what lies behind a nearer edge or in shadow, lets what is far from the scene fade into the background,
/// averages the samples of each pixel.
fn resolve(canvas: &Canvas, shadows: &Canvas, camera: &Camera, light: &Camera, factor: usize) -> RgbImage {
    let edges = Edges { canvas, step: factor as isize, full: (0.03 * camera.reach) as f32 };
    let (sky, horizon) = (linear(SKY), linear(HORIZON));
    let weight = 1.0 / (factor * factor) as f32;
    let mut pixels = vec![[0u8; 3]; camera.width * camera.height];
    pixels.par_chunks_mut(camera.width).enumerate().for_each(|(row, line)| {
        let blend = row as f32 / camera.height as f32;
        let behind: Color = std::array::from_fn(|k| sky[k] + (horizon[k] - sky[k]) * blend);
        for (column, pixel) in line.iter_mut().enumerate() {
            let mut sum = [0.0f32; 3];
            for sample in 0..factor * factor {
                let (x, y) = (column * factor + sample % factor, row * factor + sample / factor);
                let at = y * canvas.width + x;
                let depth = canvas.depth[at];
                if !depth.is_finite() {
                    (0..3).for_each(|k| sum[k] += behind[k]);
                    continue;
                }
                let middle = |i: usize| (i as f64 + 0.5) / factor as f64;
                let place = camera.unproject(middle(x), middle(y), f64::from(depth));
                let shadow = shadow_at(shadows, light, &place);
                let dark = 1.0 - EDGE * edges.darkness(x, y, depth);
                let Light { ambient, direct } = canvas.light[at];
                let away = camera.remoteness(&place);
                for k in 0..3 {
                    let own = (ambient[k] + direct[k] * (1.0 - SHADOW * shadow)).min(1.0) * dark;
                    sum[k] += own + (behind[k] - own) * away;
                }
            }
            *pixel = sum.map(|v| encode(v * weight));
        }
    });
    RgbImage { width: camera.width, height: camera.height, pixels }
}

/// How much an edge in front darkens.
const EDGE: f32 = 0.75;
/// How much of the lamp's light a shadow takes.
const SHADOW: f32 = 0.7;

/// Finds samples that lie behind the edge of something nearer.
struct Edges<'a> {
    canvas: &'a Canvas,
    step: isize,
    /// Depth difference that counts fully [m].
    full: f32,
}

impl Edges<'_> {
    fn depth(&self, x: isize, y: isize) -> Option<f32> {
        let (width, height) = (self.canvas.width as isize, (self.canvas.depth.len() / self.canvas.width) as isize);
        ((0..width).contains(&x) && (0..height).contains(&y)).then(|| self.canvas.depth[(y * width + x) as usize])
    }

    /// From 0 (nothing near stands in front) to 1. Opposite neighbours are taken together, so that slopes do not count.
    fn darkness(&self, x: usize, y: usize, own: f32) -> f32 {
        let (x, y) = (x as isize, y as isize);
        let mut sum = 0.0f32;
        for (dx, dy) in [(1, 0), (0, 1), (1, 1), (1, -1)] {
            for reach in [self.step, 3 * self.step] {
                let ahead = |sign: isize| {
                    let other = self.depth(x + sign * dx * reach, y + sign * dy * reach).unwrap_or(own);
                    (own - other).clamp(-0.2 * self.full, self.full)
                };
                sum += (ahead(1) + ahead(-1)).max(0.0);
            }
        }
        (sum / (8.0 * self.full)).min(1.0)
    }
}

/// Share of the light that something nearer to it takes away, over a few texels.
fn shadow_at(shadows: &Canvas, light: &Camera, place: &nalgebra::Vector3<f64>) -> f32 {
    let seen = light.project(place);
    let limit = (seen.depth - 4.0 / seen.scale) as f32;
    let mut covered = 0.0f32;
    for dy in [-1.6, 0.0, 1.6] {
        for dx in [-1.6, 0.0, 1.6] {
            let (x, y) = (seen.x + dx, seen.y + dy);
            if x >= 0.0 && y >= 0.0 && x < light.width as f64 && y < light.height as f64 {
                let hit = shadows.depth[y as usize * shadows.width + x as usize] < limit;
                covered += f32::from(u8::from(hit));
            }
        }
    }
    covered / 9.0
}

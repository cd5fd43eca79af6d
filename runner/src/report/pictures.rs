//! Stills and the animation of a run.

use crate::picture::{Camera, ColorBy, Framing, PictureOptions, RgbImage, animation, render};
use crate::record::frame::{Field, FieldValues, Frame, Piece, Topology};
use crate::record::frame_files::{self, FrameFiles};

use super::data::RunData;

/// How many pictures a run gets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Effort {
    stills: usize,
    animation: usize,
    large: bool,
}

/// Fewer pictures each when many runs share a page.
pub(super) fn effort(runs: usize) -> Effort {
    match runs {
        0 | 1 => Effort { stills: 6, animation: 48, large: true },
        2..=4 => Effort { stills: 6, animation: 24, large: false },
        _ => Effort { stills: 3, animation: 0, large: false },
    }
}

/// Points drawn over all pictures of an animation; beyond, it gets fewer pictures.
const POINT_BUDGET: usize = 6_000_000;

/// The pictures of a run.
#[derive(Clone, Debug, Default)]
pub(super) struct Shown {
    /// Small stills: time [s] and PNG.
    pub stills: Vec<(f64, Vec<u8>)>,
    /// The last frame large, coloured by speed where the frames tell it: caption and PNG.
    pub large: Option<(String, Vec<u8>)>,
    /// Cuts through the liquid of the last frame: caption and PNG.
    pub cuts: Vec<(String, Vec<u8>)>,
    /// The animation as GIF.
    pub animation: Option<Vec<u8>>,
    /// Length of the scale bar that fits the stills [m] and its share of the width.
    pub scale_bar: Option<(f64, f64)>,
    /// Files that could not be read.
    pub unreadable: Vec<String>,
    /// Points that were not finite.
    pub left_out: usize,
    /// Whether the view does not hold everything.
    pub clipped: bool,
}

pub(super) fn of_run(run: &RunData, effort: Effort) -> Shown {
    let mut shown = Shown::default();
    if run.frames.is_empty() {
        return shown;
    }
    let chosen = spread(run.frames.len(), effort.animation.max(effort.stills));
    let mut framing = Framing::default();
    let mut readable = Vec::new();
    let (mut points, mut fastest) = (0, 0.0f64);
    for &k in &chosen {
        if let Some(frame) = load(&run.frames[k], &mut shown.unreadable) {
            framing.include(&frame);
            points = points.max(frame.pieces.iter().map(|p| p.positions.len()).sum());
            fastest = fastest.max(typical_speed(&frame));
            readable.push(k);
        }
    }
    shown.left_out = framing.left_out();
    shown.clipped = framing.is_clipped();
    let up = run.up().unwrap_or([0.0, 1.0, 0.0]);
    let small = PictureOptions { width: 480, height: 320, up, ..PictureOptions::default() };
    let camera = Camera::new(&framing, &small);
    let (length, pixels) = camera.scale_bar();
    shown.scale_bar = Some((length, pixels / small.width as f64));
    let stills: Vec<usize> = spread(readable.len(), effort.stills).into_iter().map(|k| readable[k]).collect();
    let moving: Vec<usize> = spread(readable.len(), effort.animation.min(POINT_BUDGET / points.max(1)))
        .into_iter()
        .map(|k| readable[k])
        .collect();
    let mut pictures: Vec<RgbImage> = Vec::new();
    for &k in &readable {
        let (is_still, is_moving) = (stills.contains(&k), moving.len() > 1 && moving.contains(&k));
        if !is_still && !is_moving {
            continue;
        }
        let Some(frame) = load(&run.frames[k], &mut shown.unreadable) else { continue };
        let picture = render(&frame, &camera, &small);
        if is_still && let Ok(png) = picture.png() {
            shown.stills.push((frame.time, png));
        }
        if is_moving {
            pictures.push(picture);
        }
    }
    if pictures.len() > 1 {
        let delay = (400 / pictures.len()).clamp(4, 25) as u16;
        shown.animation = animation(&pictures, delay).ok();
    }
    if effort.large
        && let Some(&last) = readable.last()
        && let Some(frame) = load(&run.frames[last], &mut shown.unreadable)
    {
        let mut options = PictureOptions { width: 1080, height: 675, up, ..PictureOptions::default() };
        let mut caption = format!("Last frame, {} s", frame.time);
        if fastest > 0.0 {
            options.color = ColorBy::Field { name: "velocity".into(), low: 0.0, high: fastest };
            caption = format!(
                "{caption}, coloured by speed: violet 0, yellow {fastest:.3e} m/s (the fastest vertex of the run)"
            );
        }
        let camera = Camera::new(&framing, &options);
        shown.large = render(&frame, &camera, &options).png().ok().map(|png| (caption, png));
        shown.cuts = cuts(&frame, up);
    }
    shown
}

/// The liquid of a frame cut through its middle: by speed, and where it yields.
fn cuts(frame: &Frame, up: [f64; 3]) -> Vec<(String, Vec<u8>)> {
    let Some(slab) = frame.pieces.iter().find(|piece| piece.name == "particles").and_then(slab) else {
        return Vec::new();
    };
    let fastest = norms(&slab, "velocity").fold(0.0, f64::max);
    let yields = slab.point_field("yielded").is_some();
    let at = frame.time;
    let cut = Frame { time: at, step: frame.step, pieces: vec![slab] };
    let mut framing = Framing::default();
    framing.include(&cut);
    let mut pictures = Vec::new();
    let mut add = |name: &str, high: f64, caption: String| {
        let color = ColorBy::Field { name: name.into(), low: 0.0, high };
        let options =
            PictureOptions { width: 720, height: 450, up, from: Some([0.0, 0.0, 1.0]), color, ..Default::default() };
        let camera = Camera::new(&framing, &options);
        if let Ok(png) = render(&cut, &camera, &options).png() {
            pictures.push((caption, png));
        }
    };
    add("velocity", fastest, format!("Cut at {at} s, coloured by speed: violet 0, yellow {fastest:.3e} m/s"));
    if yields {
        add("yielded", 1.0, format!("Cut at {at} s: yellow flows, violet does not yield"));
    }
    pictures
}

/// The particles near the middle plane across z, all of them for a liquid in a plane.
fn slab(piece: &Piece) -> Option<Piece> {
    let n = piece.positions.len();
    if n == 0 {
        return None;
    }
    let mut depths: Vec<f64> = piece.positions.iter().map(|x| x[2]).collect();
    depths.sort_by(f64::total_cmp);
    let middle = depths[n / 2];
    let thickness = 3.0 * norms(piece, "radius").fold(0.0, f64::max);
    let kept: Vec<usize> = (0..n).filter(|&i| (piece.positions[i][2] - middle).abs() <= thickness).collect();
    let pick = |field: &Field| {
        let c = field.components;
        let values = match &field.values {
            FieldValues::F64(v) => FieldValues::F64(kept.iter().flat_map(|i| v[i * c..(i + 1) * c].to_vec()).collect()),
            FieldValues::I64(v) => FieldValues::I64(kept.iter().flat_map(|i| v[i * c..(i + 1) * c].to_vec()).collect()),
        };
        Field { name: field.name.clone(), components: c, values }
    };
    Some(Piece {
        name: piece.name.clone(),
        topology: Topology::Points,
        positions: kept.iter().map(|&i| piece.positions[i]).collect(),
        point_fields: piece.point_fields.iter().map(pick).collect(),
        cell_fields: Vec::new(),
    })
}

/// Sizes of the finite values of a point field.
fn norms<'a>(piece: &'a Piece, name: &str) -> impl Iterator<Item = f64> + 'a {
    let field = piece.point_field(name);
    let values: &[f64] = match field.map(|field| &field.values) {
        Some(FieldValues::F64(values)) => values,
        _ => &[],
    };
    let components = field.map_or(1, |field| field.components.max(1));
    values.chunks_exact(components).map(|v| v.iter().map(|x| x * x).sum::<f64>().sqrt()).filter(|x| x.is_finite())
}

/// At most `wanted` of `count` places, evenly, first and last included.
fn spread(count: usize, wanted: usize) -> Vec<usize> {
    match (count, wanted) {
        (0, _) | (_, 0) => Vec::new(),
        (_, 1) => vec![count - 1],
        _ if count <= wanted => (0..count).collect(),
        _ => (0..wanted).map(|k| (k * (count - 1) + (wanted - 1) / 2) / (wanted - 1)).collect(),
    }
}

fn load(files: &FrameFiles, unreadable: &mut Vec<String>) -> Option<Frame> {
    match frame_files::load(files) {
        Ok(frame) => Some(frame),
        Err(error) => {
            unreadable.push(error.to_string());
            None
        }
    }
}

/// Largest finite speed of a frame [m/s].
fn typical_speed(frame: &Frame) -> f64 {
    let mut fastest = 0.0f64;
    for piece in frame.pieces.iter().filter(|p| p.name != "solids") {
        if let Some(FieldValues::F64(values)) = piece.point_field("velocity").map(|field| &field.values) {
            for v in values.chunks_exact(3) {
                let speed = v.iter().map(|x| x * x).sum::<f64>().sqrt();
                if speed.is_finite() {
                    fastest = fastest.max(speed);
                }
            }
        }
    }
    fastest
}

#[cfg(test)]
mod tests {
    use super::spread;

    #[test]
    fn choices_are_even_and_keep_both_ends() {
        assert_eq!(spread(0, 5), Vec::<usize>::new());
        assert_eq!(spread(3, 6), [0, 1, 2]);
        assert_eq!(spread(11, 6), [0, 2, 4, 6, 8, 10]);
        assert_eq!(spread(100, 2), [0, 99]);
        assert_eq!(spread(9, 1), [8]);
        let many = spread(1001, 48);
        assert!(many.windows(2).all(|p| p[0] < p[1]) && many.len() == 48 && many[47] == 1000);
    }
}

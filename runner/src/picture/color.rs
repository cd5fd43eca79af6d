//! Colours: of pieces, of lines, of values. Linear light inside, sRGB only at the end.

/// What colours show.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum ColorBy {
    /// Which piece, and which line or grain within it.
    #[default]
    Piece,
    /// The size of a point field, dark blue (low) over green to yellow (high); pieces without it are grey,
    /// contacts and films without it are left out.
    Field {
        /// Name of the point field; of a vector or tensor its norm is shown.
        name: String,
        /// Value of the lowest colour.
        low: f64,
        /// Value of the highest colour.
        high: f64,
    },
}

/// Linear red, green, blue.
pub(super) type Color = [f32; 3];

/// sRGB bytes as linear light.
pub(super) fn linear(rgb: [u8; 3]) -> Color {
    rgb.map(|v| {
        let v = f32::from(v) / 255.0;
        if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
    })
}

/// Linear light as an sRGB byte.
pub(super) fn encode(v: f32) -> u8 {
    let v = v.clamp(0.0, 1.0);
    let s = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    (s * 255.0 + 0.5) as u8
}

const SCALE: [[u8; 3]; 9] = [
    [68, 1, 84],
    [71, 44, 122],
    [59, 81, 139],
    [44, 113, 142],
    [33, 144, 141],
    [39, 173, 129],
    [92, 200, 99],
    [170, 220, 50],
    [253, 231, 37],
];

/// Colour of a value in `[0, 1]` (clamped): dark violet, blue, green, yellow, of evenly rising lightness.
#[must_use]
pub fn colormap(value: f64) -> [u8; 3] {
    let x = if value.is_finite() { value.clamp(0.0, 1.0) } else { 0.0 } * (SCALE.len() - 1) as f64;
    let i = (x as usize).min(SCALE.len() - 2);
    let f = x - i as f64;
    std::array::from_fn(|k| (f64::from(SCALE[i][k]) * (1.0 - f) + f64::from(SCALE[i + 1][k]) * f + 0.5) as u8)
}

/// Colours that stay apart when there are few lines.
const DISTINCT: [[u8; 3]; 8] = [
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [230, 159, 0],
    [86, 180, 233],
    [122, 82, 54],
    [110, 110, 120],
];

/// Colour of a contact by its state: 1 sticks, 2 slips, 3 is a permanent link.
pub(super) fn of_state(state: i64) -> Option<Color> {
    match state {
        1 => Some(linear(granular::frame::colour::STICK)),
        2 => Some(linear(granular::frame::colour::SLIP)),
        3 => Some(linear(granular::frame::colour::LINK)),
        _ => None,
    }
}

/// Colour of line (or grain) `i` of `count` in a piece of that name.
pub(super) fn of_piece(name: &str, i: usize, count: usize) -> Color {
    let lightness = |base: [u8; 3], range: f32| {
        // The golden ratio spreads neighbours in the list.
        let t = (i as f64 * 0.618_033_988_749_894_9).fract() as f32;
        linear(base).map(|c| c * (1.0 - range + 2.0 * range * t))
    };
    match name {
        "particles" => linear([70, 140, 205]),
        "films" => linear([126, 178, 222]),
        "contacts" => linear([215, 40, 40]),
        "solids" => linear([203, 207, 212]),
        "links" => linear(granular::frame::colour::LINK),
        "box" => linear([90, 96, 104]),
        // pale, so that red, green and blue lines stand out on them
        "grains" => lightness([214, 205, 184], 0.14),
        _ if count <= DISTINCT.len() => linear(DISTINCT[i % DISTINCT.len()]),
        "yarns" | "yarn" => lightness([176, 92, 88], 0.4),
        _ => lightness([132, 86, 52], 0.5),
    }
}

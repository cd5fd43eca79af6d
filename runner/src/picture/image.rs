//! Finished pictures and their files.

use std::borrow::Cow;

/// Red, green, blue, one byte each, row after row from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RgbImage {
    /// Width [pixels].
    pub width: usize,
    /// Height [pixels].
    pub height: usize,
    /// Pixels.
    pub pixels: Vec<[u8; 3]>,
}

/// Why a picture could not be written.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// The PNG encoder refused.
    #[error("PNG: {0}")]
    Png(#[from] png::EncodingError),
    /// The GIF encoder refused.
    #[error("GIF: {0}")]
    Gif(#[from] gif::EncodingError),
    /// An animation needs at least one frame, all of one size of at most 65535 pixels a side.
    #[error("an animation needs pictures of one size, at most 65535 pixels a side")]
    Size,
}

impl RgbImage {
    /// The picture as a PNG file.
    ///
    /// # Errors
    /// When the encoder refuses (a picture without pixels).
    pub fn png(&self) -> Result<Vec<u8>, PictureError> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::Balanced);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(self.pixels.as_flattened())?;
        writer.finish()?;
        Ok(bytes)
    }

    /// The picture at half the size (rounded down), each pixel the mean of four.
    #[must_use]
    pub fn half(&self) -> RgbImage {
        let (width, height) = (self.width / 2, self.height / 2);
        let pixels = (0..width * height)
            .map(|i| {
                let (x, y) = (2 * (i % width), 2 * (i / width));
                let at = |dx: usize, dy: usize| self.pixels[(y + dy) * self.width + x + dx];
                let four = [at(0, 0), at(1, 0), at(0, 1), at(1, 1)];
                std::array::from_fn(|k| ((four.iter().map(|p| u32::from(p[k])).sum::<u32>() + 2) / 4) as u8)
            })
            .collect();
        RgbImage { width, height, pixels }
    }
}

/// An endless GIF animation; `delay` is the time per picture in hundredths of a second.
///
/// # Errors
/// When there is no picture, sizes differ or the encoder refuses.
pub fn animation(pictures: &[RgbImage], delay: u16) -> Result<Vec<u8>, PictureError> {
    let first = pictures.first().ok_or(PictureError::Size)?;
    let side = |n: usize| u16::try_from(n).map_err(|_| PictureError::Size);
    let (width, height) = (side(first.width)?, side(first.height)?);
    if pictures.iter().any(|p| (p.width, p.height) != (first.width, first.height)) {
        return Err(PictureError::Size);
    }
    // One palette for all keeps colours from flickering: a cube of 6 × 7 × 6 levels would band, so it is learnt from the pictures.
    let palette = Palette::of(pictures);
    let mut bytes = Vec::new();
    {
        let mut encoder = gif::Encoder::new(&mut bytes, width, height, &palette.colors)?;
        encoder.set_repeat(gif::Repeat::Infinite)?;
        let mut former: Vec<u8> = Vec::new();
        for picture in pictures {
            let indices = palette.indices(picture);
            // Unchanged pixels are left transparent: runs of one value pack well.
            let buffer = if former.is_empty() {
                indices.clone()
            } else {
                indices.iter().zip(&former).map(|(new, old)| if new == old { TRANSPARENT } else { *new }).collect()
            };
            let frame = gif::Frame {
                width,
                height,
                delay,
                dispose: gif::DisposalMethod::Keep,
                transparent: Some(TRANSPARENT),
                buffer: Cow::Owned(buffer),
                ..gif::Frame::default()
            };
            encoder.write_frame(&frame)?;
            former = indices;
        }
    }
    Ok(bytes)
}

const TRANSPARENT: u8 = 255;
/// Bits kept per channel when colours are counted.
const BITS: u32 = 5;

/// At most 255 colours by median cut over the colours that occur, and the nearest one for every coarse colour.
struct Palette {
    colors: Vec<u8>,
    nearest: Vec<u8>,
}

impl Palette {
    fn of(pictures: &[RgbImage]) -> Palette {
        let mut counts = vec![0u64; 1 << (3 * BITS)];
        let mut sums = vec![[0u64; 3]; 1 << (3 * BITS)];
        for pixel in pictures.iter().flat_map(|p| &p.pixels) {
            let key = coarse(pixel);
            counts[key] += 1;
            for k in 0..3 {
                sums[key][k] += u64::from(pixel[k]);
            }
        }
        let used: Vec<usize> = (0..counts.len()).filter(|&key| counts[key] > 0).collect();
        let mean = |key: usize| -> [u8; 3] { std::array::from_fn(|k| (sums[key][k] / counts[key]) as u8) };
        let mut boxes = vec![used.clone()];
        while boxes.len() < 255 {
            // Split the box whose colours differ most, weighed by the root of how often they occur.
            let spread = |cell: &Vec<usize>| -> (u64, usize) {
                let axis = |k: usize| {
                    let (low, high) =
                        cell.iter().map(|&key| mean(key)[k]).fold((255, 0), |(l, h), v| (l.min(v), h.max(v)));
                    u64::from(high.saturating_sub(low))
                };
                let widest = (0..3).max_by_key(|&k| (axis(k), k)).unwrap_or(0);
                let weight = (cell.iter().map(|&key| counts[key]).sum::<u64>() as f64).sqrt() as u64;
                (axis(widest) * axis(widest) * weight, widest)
            };
            let Some((_, axis, chosen)) = boxes
                .iter()
                .enumerate()
                .filter(|(_, cell)| cell.len() > 1)
                .map(|(i, cell)| (spread(cell), i))
                .map(|((s, a), i)| (s, a, i))
                .max_by_key(|&(s, _, i)| (s, usize::MAX - i))
            else {
                break;
            };
            let mut cell = boxes.swap_remove(chosen);
            cell.sort_by_key(|&key| (mean(key)[axis], key));
            let (low, high) = (mean(cell[0])[axis], mean(cell[cell.len() - 1])[axis]);
            let middle = (u16::from(low) + u16::from(high)) / 2;
            let cut = cell.partition_point(|&key| u16::from(mean(key)[axis]) <= middle).clamp(1, cell.len() - 1);
            let upper = cell.split_off(cut);
            boxes.push(cell);
            boxes.push(upper);
        }
        let colors: Vec<[u8; 3]> = boxes
            .iter()
            .filter(|cell| !cell.is_empty())
            .map(|cell| {
                let total: u64 = cell.iter().map(|&key| counts[key]).sum();
                std::array::from_fn(|k| (cell.iter().map(|&key| sums[key][k]).sum::<u64>() / total) as u8)
            })
            .collect();
        let mut nearest = vec![0u8; counts.len()];
        for key in used {
            let color = mean(key);
            let distance =
                |other: &[u8; 3]| (0..3).map(|k| (i32::from(color[k]) - i32::from(other[k])).pow(2)).sum::<i32>();
            nearest[key] = (0..colors.len()).min_by_key(|&i| (distance(&colors[i]), i)).unwrap_or(0) as u8;
        }
        let mut colors = colors.as_flattened().to_vec();
        // The last entry is the transparent one, so the table must be full.
        colors.resize(3 * 256, 255);
        Palette { colors, nearest }
    }

    fn indices(&self, picture: &RgbImage) -> Vec<u8> {
        picture.pixels.iter().map(|pixel| self.nearest[coarse(pixel)]).collect()
    }
}

fn coarse(pixel: &[u8; 3]) -> usize {
    pixel.iter().fold(0, |key, &v| (key << BITS) | usize::from(v >> (8 - BITS)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(width: usize, height: usize, shift: usize) -> RgbImage {
        let pixels = (0..width * height).map(|i| [((i + shift) % 256) as u8, (i / width) as u8, 128]).collect();
        RgbImage { width, height, pixels }
    }

    #[test]
    fn png_reads_back() {
        let picture = ramp(37, 20, 0);
        let bytes = picture.png().unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        assert_eq!((info.width, info.height), (37, 20));
        assert_eq!(pixels, picture.pixels.as_flattened());
    }

    #[test]
    fn gif_reads_back_close_to_what_was_given() {
        let pictures = [ramp(40, 30, 0), ramp(40, 30, 9)];
        let bytes = animation(&pictures, 5).unwrap();
        assert_eq!(bytes, animation(&pictures, 5).unwrap());
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::RGBA);
        let mut decoder = options.read_info(bytes.as_slice()).unwrap();
        let mut canvas = vec![[0u8; 4]; 1200];
        for picture in &pictures {
            let frame = decoder.read_next_frame().unwrap().unwrap();
            for (to, from) in canvas.iter_mut().zip(frame.buffer.chunks_exact(4)) {
                if from[3] > 0 {
                    to.copy_from_slice(from);
                }
            }
            for (shown, wanted) in canvas.iter().zip(&picture.pixels) {
                for k in 0..3 {
                    assert!(shown[k].abs_diff(wanted[k]) <= 24, "{shown:?} {wanted:?}");
                }
            }
        }
        assert!(decoder.read_next_frame().unwrap().is_none());
        assert!(animation(&[], 5).is_err());
        assert!(animation(&[ramp(4, 4, 0), ramp(5, 4, 0)], 5).is_err());
    }
}

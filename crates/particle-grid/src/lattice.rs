//! Where cells are: size, origin and periodic directions of a grid, without any storage.

use crate::GridError;
use numerics::tensor::Vector;
use serde::{Deserialize, Serialize};

/// Edge of a block in cells.
pub const BLOCK: usize = 4;
/// Offset of cell centres, one entry per direction.
pub const CENTRE: f64 = 0.5;
/// Block coordinates must stay below this magnitude so that they can be packed into one key.
const LIMIT: i32 = 1 << 20;

/// Number of cells of a block, `4^D`.
#[must_use]
pub const fn cells_per_block<const D: usize>() -> usize {
    BLOCK.pow(D as u32)
}

/// Offset of the faces normal to `axis`: on the low face in that direction, centred in the others [cells].
#[must_use]
pub fn mac_offset<const D: usize>(axis: usize) -> [f64; D] {
    std::array::from_fn(|a| if a == axis { 0.0 } else { CENTRE })
}

/// Cell size, origin and periodic directions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lattice<const D: usize> {
    /// Edge of a cell [m].
    pub dx: f64,
    /// Position of the low corner of cell zero [m].
    pub origin: Vector<D>,
    /// Length of each periodic direction in blocks of four cells; zero where the direction is open [blocks].
    #[serde(with = "serde_arrays")]
    pub periods: [u32; D],
}

/// `serde` has no arrays of generic length.
mod serde_arrays {
    use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

    pub(super) fn serialize<S: Serializer, const D: usize>(a: &[u32; D], s: S) -> Result<S::Ok, S::Error> {
        a.as_slice().serialize(s)
    }

    pub(super) fn deserialize<'de, De: Deserializer<'de>, const D: usize>(d: De) -> Result<[u32; D], De::Error> {
        let v = Vec::<u32>::deserialize(d)?;
        v.try_into().map_err(|v: Vec<u32>| De::Error::invalid_length(v.len(), &"one entry per direction"))
    }
}

impl<const D: usize> Lattice<D> {
    /// An open lattice whose cell zero starts at the origin of space.
    #[must_use]
    pub fn new(dx: f64) -> Self {
        Self { dx, origin: Vector::zeros(), periods: [0; D] }
    }

    /// Position in cells from the origin.
    #[inline(always)]
    #[must_use]
    pub fn to_cells(&self, x: &Vector<D>) -> [f64; D] {
        std::array::from_fn(|a| (x[a] - self.origin[a]) / self.dx)
    }

    /// Position of a node of global cell index `cell` and offset `offset` [m].
    #[inline(always)]
    #[must_use]
    pub fn node_position(&self, cell: &[i32; D], offset: &[f64; D]) -> Vector<D> {
        Vector::from_fn(|a, _| self.origin[a] + (f64::from(cell[a]) + offset[a]) * self.dx)
    }

    /// Low corner of a block [cells from the origin of space]: what is taken off `x / dx` to get the position inside it.
    #[inline(always)]
    #[must_use]
    pub fn block_low(&self, block: &[i32; D]) -> [f64; D] {
        let inverse_dx = 1.0 / self.dx;
        std::array::from_fn(|a| self.origin[a] * inverse_dx + f64::from(block[a]) * BLOCK as f64)
    }

    /// Length of a periodic direction [m], zero where it is open.
    #[must_use]
    pub fn period(&self, axis: usize) -> f64 {
        f64::from(self.periods[axis]) * BLOCK as f64 * self.dx
    }

    /// Brings a position into the periodic domain.
    #[inline]
    pub fn wrap(&self, x: &mut Vector<D>) {
        for a in 0..D {
            if self.periods[a] > 0 {
                let length = self.period(a);
                let mut t = x[a] - self.origin[a];
                if (0.0..length).contains(&t) {
                    continue;
                }
                t -= length * (t / length).floor();
                // Rounding may land on the end of the period, which is its beginning.
                x[a] = self.origin[a] + if t < length { t } else { 0.0 };
                if (x[a] - self.origin[a]) / self.dx >= f64::from(self.periods[a]) * BLOCK as f64 {
                    x[a] = self.origin[a];
                }
            }
        }
    }

    /// Shortest displacement `a − b` across periodic directions [m].
    #[inline]
    #[must_use]
    pub fn displacement(&self, a: &Vector<D>, b: &Vector<D>) -> Vector<D> {
        let mut d = a - b;
        for k in 0..D {
            if self.periods[k] > 0 {
                let length = self.period(k);
                d[k] -= length * (d[k] / length).round();
            }
        }
        d
    }

    /// Brings block coordinates into the periodic domain.
    #[inline(always)]
    #[must_use]
    pub fn wrap_block(&self, mut block: [i32; D]) -> [i32; D] {
        for a in 0..D {
            if self.periods[a] > 0 {
                block[a] = block[a].rem_euclid(self.periods[a] as i32);
            }
        }
        block
    }

    /// Block and cell inside the block of a position.
    ///
    /// # Errors
    /// Where the position is not finite, outside a period, or too far away.
    #[inline(always)]
    pub fn locate(&self, x: &Vector<D>, particle: usize) -> Result<([i32; D], [usize; D]), GridError> {
        let cells = self.to_cells(x);
        let mut block = [0i32; D];
        let mut local = [0usize; D];
        for a in 0..D {
            let cell = cells[a].floor();
            if !cell.is_finite() {
                return Err(GridError::NonFinite { particle });
            }
            if cell.abs() >= f64::from(LIMIT - 2) * BLOCK as f64 {
                return Err(GridError::TooFar { particle });
            }
            let cell = cell as i32;
            block[a] = cell.div_euclid(BLOCK as i32);
            local[a] = cell.rem_euclid(BLOCK as i32) as usize;
            if self.periods[a] > 0 && !(0..self.periods[a] as i32).contains(&block[a]) {
                return Err(GridError::OutsidePeriod { particle, axis: a });
            }
        }
        Ok((block, local))
    }
}

/// Block coordinates in one number whose order is that of the blocks, x fastest.
#[inline(always)]
pub(crate) fn pack<const D: usize>(block: &[i32; D]) -> u64 {
    let mut key = 0u64;
    for a in (0..D).rev() {
        key = (key << 21) | (block[a] + LIMIT) as u64;
    }
    key
}

/// Inverse of [`pack`].
#[inline(always)]
pub(crate) fn unpack<const D: usize>(mut key: u64) -> [i32; D] {
    std::array::from_fn(|_| {
        let digit = (key & ((1 << 21) - 1)) as i32 - LIMIT;
        key >>= 21;
        digit
    })
}

/// Index of a cell inside its block, x fastest.
#[inline(always)]
#[must_use]
pub fn local_index<const D: usize>(local: &[usize; D]) -> usize {
    let mut index = 0;
    for a in (0..D).rev() {
        index = index * BLOCK + local[a];
    }
    index
}

/// Inverse of [`local_index`].
#[inline(always)]
#[must_use]
pub fn local_digits<const D: usize>(mut index: usize) -> [usize; D] {
    std::array::from_fn(|_| {
        let digit = index % BLOCK;
        index /= BLOCK;
        digit
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn keys_keep_order_and_invert() {
        for block in [[0, 0, 0], [-5, 7, -9], [1_000_000, -1_000_000, 3]] {
            assert_eq!(unpack::<3>(pack(&block)), block);
        }
        assert!(pack(&[9, 0, 0]) < pack(&[-9, 1, 0]));
        assert!(pack(&[9, 9, -1]) < pack(&[-9, -9, 0]));
        for i in 0..64 {
            assert_eq!(local_index(&local_digits::<3>(i)), i);
        }
    }

    #[test]
    fn wrapping_reaches_the_domain_even_from_its_very_edge() {
        let lattice = Lattice { dx: 0.1, origin: Vector3::new(0.3, 0.0, 0.0), periods: [2, 0, 1] };
        for x in [-1e-18, 0.3 - 1e-17, 0.3 + 0.8, 1e5 / 3.0, -77.7, 0.3 + 0.8 - 1e-17] {
            let mut p = Vector3::new(x, 5.0, x - 0.3);
            lattice.wrap(&mut p);
            assert!(lattice.locate(&p, 0).is_ok(), "{x} went to {p}");
            assert_eq!(p.y, 5.0);
        }
        assert!(matches!(
            lattice.locate(&Vector3::new(f64::NAN, 0.0, 0.0), 3),
            Err(GridError::NonFinite { particle: 3 })
        ));
        assert!(matches!(lattice.locate(&Vector3::new(0.4, 1e9, 0.0), 3), Err(GridError::TooFar { .. })));
        assert!(matches!(
            lattice.locate(&Vector3::new(9.0, 1.0, 0.0), 3),
            Err(GridError::OutsidePeriod { axis: 0, .. })
        ));
        let d = lattice.displacement(&Vector3::new(0.35, 0.0, 0.0), &Vector3::new(1.05, 0.0, 0.0));
        assert!((d.x - 0.1).abs() < 1e-15);
    }
}

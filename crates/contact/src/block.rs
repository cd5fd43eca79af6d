//! Kernels on 3-vectors and row-major 3×3 blocks, the unit every matrix of this crate is made of.
//!
//! Plain arrays rather than a matrix type: the blocks are stored back to back in long vectors, and the compiler
//! unrolls and vectorises these short loops by itself.

/// A vector in contact coordinates: normal, first tangent, second tangent.
pub type Vec3 = [f64; 3];
/// A 3×3 block, row-major.
pub type Block = [f64; 9];

/// The zero block.
pub const ZERO: Block = [0.0; 9];
/// The unit block.
pub const IDENTITY: Block = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// Scalar product.
#[inline(always)]
#[must_use]
pub fn dot(a: &Vec3, b: &Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Squared Euclidean norm.
#[inline(always)]
#[must_use]
pub fn norm_squared(a: &Vec3) -> f64 {
    dot(a, a)
}

/// Euclidean norm of the two tangential components, safe from overflow and underflow.
#[inline(always)]
#[must_use]
pub fn tangential_norm(a: &Vec3) -> f64 {
    let direct = a[1] * a[1] + a[2] * a[2];
    if direct > 1e-280 && direct < 1e280 { direct.sqrt() } else { a[1].hypot(a[2]) }
}

/// `a + b`.
#[inline(always)]
#[must_use]
pub fn add(a: &Vec3, b: &Vec3) -> Vec3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// `a − b`.
#[inline(always)]
#[must_use]
pub fn sub(a: &Vec3, b: &Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `s a`.
#[inline(always)]
#[must_use]
pub fn scale(s: f64, a: &Vec3) -> Vec3 {
    [s * a[0], s * a[1], s * a[2]]
}

/// `M x`.
#[inline(always)]
#[must_use]
pub fn mat_vec(m: &Block, x: &Vec3) -> Vec3 {
    [
        m[0] * x[0] + m[1] * x[1] + m[2] * x[2],
        m[3] * x[0] + m[4] * x[1] + m[5] * x[2],
        m[6] * x[0] + m[7] * x[1] + m[8] * x[2],
    ]
}

/// `y += M x`.
#[inline(always)]
pub fn mat_vec_add(m: &Block, x: &Vec3, y: &mut Vec3) {
    y[0] += m[0] * x[0] + m[1] * x[1] + m[2] * x[2];
    y[1] += m[3] * x[0] + m[4] * x[1] + m[5] * x[2];
    y[2] += m[6] * x[0] + m[7] * x[1] + m[8] * x[2];
}

/// `y −= M x`.
#[inline(always)]
pub fn mat_vec_sub(m: &Block, x: &Vec3, y: &mut Vec3) {
    y[0] -= m[0] * x[0] + m[1] * x[1] + m[2] * x[2];
    y[1] -= m[3] * x[0] + m[4] * x[1] + m[5] * x[2];
    y[2] -= m[6] * x[0] + m[7] * x[1] + m[8] * x[2];
}

/// `Mᵀ x`.
#[inline(always)]
#[must_use]
pub fn transpose_vec(m: &Block, x: &Vec3) -> Vec3 {
    [
        m[0] * x[0] + m[3] * x[1] + m[6] * x[2],
        m[1] * x[0] + m[4] * x[1] + m[7] * x[2],
        m[2] * x[0] + m[5] * x[1] + m[8] * x[2],
    ]
}

/// `A B`.
#[inline(always)]
#[must_use]
pub fn mat_mul(a: &Block, b: &Block) -> Block {
    let mut c = ZERO;
    for i in 0..3 {
        for j in 0..3 {
            c[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
        }
    }
    c
}

/// `C −= A B`.
#[inline(always)]
pub fn mat_mul_sub(a: &Block, b: &Block, c: &mut Block) {
    for i in 0..3 {
        for j in 0..3 {
            c[3 * i + j] -= a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
        }
    }
}

/// `Aᵀ`.
#[inline(always)]
#[must_use]
pub fn transpose(a: &Block) -> Block {
    [a[0], a[3], a[6], a[1], a[4], a[7], a[2], a[5], a[8]]
}

/// Sum of the diagonal.
#[inline(always)]
#[must_use]
pub fn trace(a: &Block) -> f64 {
    a[0] + a[4] + a[8]
}

/// Largest absolute entry.
#[inline]
#[must_use]
pub fn max_abs(a: &Block) -> f64 {
    a.iter().fold(0.0_f64, |m, v| m.max(v.abs()))
}

/// Inverse by elimination with row pivoting; `None` where a pivot falls below `floor`.
///
/// Pivoting inside the block costs little and is what keeps the block factorisation usable when a contact sticks in
/// one direction and is free in another.
#[inline]
#[must_use]
pub fn invert(a: &Block, floor: f64) -> Option<Block> {
    let mut m = *a;
    let mut inv = IDENTITY;
    for c in 0..3 {
        let mut p = c;
        for r in c + 1..3 {
            if m[3 * r + c].abs() > m[3 * p + c].abs() {
                p = r;
            }
        }
        let pivot = m[3 * p + c];
        if !(pivot.abs() > floor) {
            return None;
        }
        if p != c {
            for j in 0..3 {
                m.swap(3 * p + j, 3 * c + j);
                inv.swap(3 * p + j, 3 * c + j);
            }
        }
        let d = 1.0 / pivot;
        for j in 0..3 {
            m[3 * c + j] *= d;
            inv[3 * c + j] *= d;
        }
        for r in 0..3 {
            if r != c {
                let f = m[3 * r + c];
                for j in 0..3 {
                    m[3 * r + j] -= f * m[3 * c + j];
                    inv[3 * r + j] -= f * inv[3 * c + j];
                }
            }
        }
    }
    Some(inv)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// The inverse of a well-conditioned block times the block is the unit block.
        #[test]
        fn inverse_times_block_is_identity(v in proptest::array::uniform9(-1.0..1.0f64)) {
            let mut a = v;
            for i in 0..3 { a[4 * i] += 4.0; }
            let i = invert(&a, 0.0).unwrap();
            let p = mat_mul(&a, &i);
            for k in 0..9 { prop_assert!((p[k] - IDENTITY[k]).abs() < 1e-13); }
        }
    }

    #[test]
    fn a_singular_block_has_no_inverse() {
        assert!(invert(&[1.0, 2.0, 3.0, 2.0, 4.0, 6.0, 0.0, 0.0, 1.0], 1e-14).is_none());
        assert!(invert(&[f64::NAN; 9], 0.0).is_none());
    }
}

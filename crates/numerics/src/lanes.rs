//! Four independent problems side by side: lane arithmetic with run-time dispatch.
//!
//! A kernel is written once, generic over [`Lane`], and runs on one `f64` or on four of them. [`dispatch`] picks
//! the AVX2 instructions when the machine has them and plain arrays otherwise. Every operation is one correctly
//! rounded IEEE operation per lane (no fused multiply-add), and the elementary functions here ([`sin_cos`],
//! [`atan2`]) are built from those operations alone, so a lane's bits depend neither on its neighbours nor on the
//! instruction set.
//!
//! Data flow: memory holds [`F4`] (four numbers, 32-byte aligned) → [`Lane::load`] → arithmetic → [`Lane::store`].

use serde::{Deserialize, Serialize};
use std::ops::{Add, AddAssign, Div, Index, IndexMut, Mul, MulAssign, Neg, Sub, SubAssign};

/// Four numbers as they lie in memory, one per lane.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[repr(C, align(32))]
pub struct F4(pub [f64; 4]);

impl F4 {
    /// Four zeros.
    pub const ZERO: F4 = F4([0.0; 4]);

    /// The same number in every lane.
    #[inline(always)]
    #[must_use]
    pub const fn splat(x: f64) -> F4 {
        F4([x; 4])
    }
}

impl Index<usize> for F4 {
    type Output = f64;
    #[inline(always)]
    fn index(&self, lane: usize) -> &f64 {
        &self.0[lane]
    }
}

impl IndexMut<usize> for F4 {
    #[inline(always)]
    fn index_mut(&mut self, lane: usize) -> &mut f64 {
        &mut self.0[lane]
    }
}

/// Lane-wise arithmetic; implemented by `f64` (one lane) and by the four-lane types that [`dispatch`] hands out.
pub trait Lane:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
{
    /// What lies in memory: `f64` or [`F4`].
    type Memory: Copy + Send + Sync;
    /// Number of lanes.
    const WIDTH: usize;
    /// The same number in every lane.
    fn splat(x: f64) -> Self;
    /// Reads the lanes.
    fn load(memory: &Self::Memory) -> Self;
    /// Writes the lanes.
    fn store(self, memory: &mut Self::Memory);
    /// Square root.
    fn sqrt(self) -> Self;
    /// Magnitude.
    fn abs(self) -> Self;
    /// `a > b ? yes : no` in each lane (`no` where either is not a number).
    fn select_gt(a: Self, b: Self, yes: Self, no: Self) -> Self;
    /// `2^self` for whole numbers between −1022 and 1023.
    fn power_of_two(self) -> Self;
    /// Mantissa in `[1, 2)` and exponent of positive normal numbers.
    fn split_exponent(self) -> (Self, Self);
    /// Lane `i`.
    fn lane(self, i: usize) -> f64;
    /// Replaces lane `i`.
    #[must_use]
    fn with_lane(self, i: usize, value: f64) -> Self;

    /// `self > other ? self : other`.
    #[inline(always)]
    #[must_use]
    fn max(self, other: Self) -> Self {
        Self::select_gt(self, other, self, other)
    }

    /// `self > other ? other : self`.
    #[inline(always)]
    #[must_use]
    fn min(self, other: Self) -> Self {
        Self::select_gt(self, other, other, self)
    }

    /// Nearest integer, ties to even, for magnitudes below 2⁵¹.
    #[inline(always)]
    #[must_use]
    fn round(self) -> Self {
        let magic = Self::splat(6_755_399_441_055_744.0); // 1.5 · 2⁵²: the sum has no room for a fraction
        (self + magic) - magic
    }
}

impl Lane for f64 {
    type Memory = f64;
    const WIDTH: usize = 1;
    #[inline(always)]
    fn splat(x: f64) -> f64 {
        x
    }
    #[inline(always)]
    fn load(memory: &f64) -> f64 {
        *memory
    }
    #[inline(always)]
    fn store(self, memory: &mut f64) {
        *memory = self;
    }
    #[inline(always)]
    fn sqrt(self) -> f64 {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn abs(self) -> f64 {
        f64::abs(self)
    }
    #[inline(always)]
    fn select_gt(a: f64, b: f64, yes: f64, no: f64) -> f64 {
        if a > b { yes } else { no }
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        scalar_power_of_two(self)
    }
    #[inline(always)]
    fn split_exponent(self) -> (Self, Self) {
        scalar_split_exponent(self)
    }
    #[inline(always)]
    fn lane(self, _: usize) -> f64 {
        self
    }
    #[inline(always)]
    fn with_lane(self, _: usize, value: f64) -> f64 {
        value
    }
}

/// `2^52 · 1.5 + 1023`: adding a whole number leaves it, with the bias of an exponent, in the low bits.
const EXPONENT_MAGIC: f64 = 6_755_399_441_055_744.0 + 1023.0;
const MANTISSA_BITS: u64 = 0x000f_ffff_ffff_ffff;
const ONE_BITS: u64 = 0x3ff0_0000_0000_0000;
/// `2^52` as bits: the low bits of a number this large count ones.
const COUNTING_BITS: u64 = 0x4330_0000_0000_0000;
const COUNTING: f64 = 4_503_599_627_370_496.0;

#[inline(always)]
fn scalar_power_of_two(x: f64) -> f64 {
    f64::from_bits((x + EXPONENT_MAGIC).to_bits() << 52)
}

#[inline(always)]
fn scalar_split_exponent(x: f64) -> (f64, f64) {
    let bits = x.to_bits();
    let exponent = f64::from_bits((bits >> 52) | COUNTING_BITS) - (COUNTING + 1023.0);
    (f64::from_bits(bits & MANTISSA_BITS | ONE_BITS), exponent)
}

/// Four lanes as a plain array, for machines without AVX2.
#[derive(Clone, Copy)]
struct Portable4([f64; 4]);

macro_rules! portable_operator {
    ($operator:ident, $method:ident, $assign:ident, $assign_method:ident, $symbol:tt) => {
        impl $operator for Portable4 {
            type Output = Portable4;
            #[inline(always)]
            fn $method(self, o: Portable4) -> Portable4 {
                Portable4([
                    self.0[0] $symbol o.0[0],
                    self.0[1] $symbol o.0[1],
                    self.0[2] $symbol o.0[2],
                    self.0[3] $symbol o.0[3],
                ])
            }
        }
    };
}
portable_operator!(Add, add, AddAssign, add_assign, +);
portable_operator!(Sub, sub, SubAssign, sub_assign, -);
portable_operator!(Mul, mul, MulAssign, mul_assign, *);
portable_operator!(Div, div, DivAssign, div_assign, /);

macro_rules! assigning {
    ($t:ty) => {
        impl AddAssign for $t {
            #[inline(always)]
            fn add_assign(&mut self, o: $t) {
                *self = *self + o;
            }
        }
        impl SubAssign for $t {
            #[inline(always)]
            fn sub_assign(&mut self, o: $t) {
                *self = *self - o;
            }
        }
        impl MulAssign for $t {
            #[inline(always)]
            fn mul_assign(&mut self, o: $t) {
                *self = *self * o;
            }
        }
    };
}
assigning!(Portable4);

impl Neg for Portable4 {
    type Output = Portable4;
    #[inline(always)]
    fn neg(self) -> Portable4 {
        Portable4(self.0.map(|x| -x))
    }
}

impl Lane for Portable4 {
    type Memory = F4;
    const WIDTH: usize = 4;
    #[inline(always)]
    fn splat(x: f64) -> Self {
        Portable4([x; 4])
    }
    #[inline(always)]
    fn load(memory: &F4) -> Self {
        Portable4(memory.0)
    }
    #[inline(always)]
    fn store(self, memory: &mut F4) {
        memory.0 = self.0;
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Portable4(self.0.map(f64::sqrt))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Portable4(self.0.map(f64::abs))
    }
    #[inline(always)]
    fn select_gt(a: Self, b: Self, yes: Self, no: Self) -> Self {
        let mut out = no.0;
        for i in 0..4 {
            if a.0[i] > b.0[i] {
                out[i] = yes.0[i];
            }
        }
        Portable4(out)
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        Portable4(self.0.map(scalar_power_of_two))
    }
    #[inline(always)]
    fn split_exponent(self) -> (Self, Self) {
        let parts = self.0.map(scalar_split_exponent);
        (Portable4(parts.map(|p| p.0)), Portable4(parts.map(|p| p.1)))
    }
    #[inline(always)]
    fn lane(self, i: usize) -> f64 {
        self.0[i]
    }
    #[inline(always)]
    fn with_lane(mut self, i: usize, value: f64) -> Self {
        self.0[i] = value;
        self
    }
}

#[cfg(target_arch = "x86_64")]
mod avx {
    use super::{
        Add, AddAssign, COUNTING, COUNTING_BITS, Div, EXPONENT_MAGIC, F4, Lane, LaneKernel, MANTISSA_BITS, Mul,
        MulAssign, Neg, ONE_BITS, Sub, SubAssign,
    };
    use std::arch::x86_64::*;

    /// Four lanes in one AVX register. Private to this file: values exist only inside [`run`], hence only on
    /// machines that have AVX2, which is what makes the intrinsics below sound.
    #[derive(Clone, Copy)]
    pub(super) struct Avx4(__m256d);

    macro_rules! operator {
        ($operator:ident, $method:ident, $intrinsic:ident) => {
            impl $operator for Avx4 {
                type Output = Avx4;
                #[inline(always)]
                fn $method(self, o: Avx4) -> Avx4 {
                    // SAFETY: an `Avx4` exists only where AVX2 was detected (see the type).
                    Avx4(unsafe { $intrinsic(self.0, o.0) })
                }
            }
        };
    }
    operator!(Add, add, _mm256_add_pd);
    operator!(Sub, sub, _mm256_sub_pd);
    operator!(Mul, mul, _mm256_mul_pd);
    operator!(Div, div, _mm256_div_pd);
    assigning!(Avx4);

    impl Neg for Avx4 {
        type Output = Avx4;
        #[inline(always)]
        fn neg(self) -> Avx4 {
            // SAFETY: as above.
            Avx4(unsafe { _mm256_xor_pd(self.0, _mm256_set1_pd(-0.0)) })
        }
    }

    impl Lane for Avx4 {
        type Memory = F4;
        const WIDTH: usize = 4;
        #[inline(always)]
        fn splat(x: f64) -> Self {
            // SAFETY: reached only from `run`, where AVX2 is enabled.
            Avx4(unsafe { _mm256_set1_pd(x) })
        }
        #[inline(always)]
        fn load(memory: &F4) -> Self {
            // SAFETY: AVX2 as above; `F4` is 32 bytes long and 32-byte aligned.
            Avx4(unsafe { _mm256_load_pd(memory.0.as_ptr()) })
        }
        #[inline(always)]
        fn store(self, memory: &mut F4) {
            // SAFETY: AVX2 as above; `F4` is 32 bytes long and 32-byte aligned.
            unsafe { _mm256_store_pd(memory.0.as_mut_ptr(), self.0) }
        }
        #[inline(always)]
        fn sqrt(self) -> Self {
            // SAFETY: as above.
            Avx4(unsafe { _mm256_sqrt_pd(self.0) })
        }
        #[inline(always)]
        fn abs(self) -> Self {
            // SAFETY: as above.
            Avx4(unsafe { _mm256_andnot_pd(_mm256_set1_pd(-0.0), self.0) })
        }
        #[inline(always)]
        fn select_gt(a: Self, b: Self, yes: Self, no: Self) -> Self {
            // SAFETY: as above.
            Avx4(unsafe { _mm256_blendv_pd(no.0, yes.0, _mm256_cmp_pd::<_CMP_GT_OQ>(a.0, b.0)) })
        }
        #[inline(always)]
        fn power_of_two(self) -> Self {
            // SAFETY: as above.
            Avx4(unsafe {
                let shifted = _mm256_add_pd(self.0, _mm256_set1_pd(EXPONENT_MAGIC));
                _mm256_castsi256_pd(_mm256_slli_epi64::<52>(_mm256_castpd_si256(shifted)))
            })
        }
        #[inline(always)]
        fn split_exponent(self) -> (Self, Self) {
            // SAFETY: as above.
            unsafe {
                let bits = _mm256_castpd_si256(self.0);
                let counted = _mm256_or_si256(_mm256_srli_epi64::<52>(bits), _mm256_set1_epi64x(COUNTING_BITS as i64));
                let exponent = _mm256_sub_pd(_mm256_castsi256_pd(counted), _mm256_set1_pd(COUNTING + 1023.0));
                let mantissa = _mm256_or_si256(
                    _mm256_and_si256(bits, _mm256_set1_epi64x(MANTISSA_BITS as i64)),
                    _mm256_set1_epi64x(ONE_BITS as i64),
                );
                (Avx4(_mm256_castsi256_pd(mantissa)), Avx4(exponent))
            }
        }
        #[inline(always)]
        fn lane(self, i: usize) -> f64 {
            let mut out = F4::ZERO;
            self.store(&mut out);
            out.0[i]
        }
        #[inline(always)]
        fn with_lane(self, i: usize, value: f64) -> Self {
            let mut out = F4::ZERO;
            self.store(&mut out);
            out.0[i] = value;
            Self::load(&out)
        }
    }

    /// # Safety
    /// The machine must have AVX2.
    #[target_feature(enable = "avx2")]
    pub(super) unsafe fn run<K: LaneKernel>(kernel: K) -> K::Output {
        kernel.run::<Avx4>()
    }
}

/// Work to be done on four lanes. `run` and everything it calls with lane values must be `#[inline(always)]`, so
/// that it is compiled with the instructions chosen by [`dispatch`].
pub trait LaneKernel {
    /// What the work returns.
    type Output;
    /// Does the work.
    fn run<L: Lane<Memory = F4>>(self) -> Self::Output;
}

/// Runs a kernel with the best four-lane instructions of this machine. The bits do not depend on which.
#[inline]
pub fn dispatch<K: LaneKernel>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: AVX2 was just detected.
        return unsafe { avx::run(kernel) };
    }
    kernel.run::<Portable4>()
}

/// Runs a kernel without special instructions; for tests that compare bits.
#[doc(hidden)]
pub fn dispatch_portable<K: LaneKernel>(kernel: K) -> K::Output {
    kernel.run::<Portable4>()
}

/// Three-vector of lanes.
#[derive(Clone, Copy, Debug)]
pub struct V3<L>(pub [L; 3]);

impl<L: Lane> V3<L> {
    /// The zero vector.
    #[inline(always)]
    #[must_use]
    pub fn zero() -> Self {
        V3([L::splat(0.0); 3])
    }
    /// Reads three numbers.
    #[inline(always)]
    #[must_use]
    pub fn load(memory: &[L::Memory; 3]) -> Self {
        V3([L::load(&memory[0]), L::load(&memory[1]), L::load(&memory[2])])
    }
    /// Writes three numbers.
    #[inline(always)]
    pub fn store(self, memory: &mut [L::Memory; 3]) {
        self.0[0].store(&mut memory[0]);
        self.0[1].store(&mut memory[1]);
        self.0[2].store(&mut memory[2]);
    }
    /// Scalar product.
    #[inline(always)]
    pub fn dot(self, o: Self) -> L {
        self.0[0] * o.0[0] + self.0[1] * o.0[1] + self.0[2] * o.0[2]
    }
    /// Vector product.
    #[inline(always)]
    #[must_use]
    pub fn cross(self, o: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, o.0);
        V3([b * z - c * y, c * x - a * z, a * y - b * x])
    }
    /// Product with a number.
    #[inline(always)]
    #[must_use]
    pub fn scale(self, s: L) -> Self {
        V3([self.0[0] * s, self.0[1] * s, self.0[2] * s])
    }
}

impl<L: Lane> Add for V3<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        V3([self.0[0] + o.0[0], self.0[1] + o.0[1], self.0[2] + o.0[2]])
    }
}

impl<L: Lane> Sub for V3<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        V3([self.0[0] - o.0[0], self.0[1] - o.0[1], self.0[2] - o.0[2]])
    }
}

impl<L: Lane> Neg for V3<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        V3([-self.0[0], -self.0[1], -self.0[2]])
    }
}

/// Sine and cosine. Absolute error below 2 ulp of one for magnitudes up to 10⁶ rad.
///
/// Three-part reduction by π/2 (each product with the quadrant number is exact), then the Taylor polynomials, whose
/// remainders on ±π/4 are below 3e-18.
#[inline(always)]
pub fn sin_cos<L: Lane>(x: L) -> (L, L) {
    let k = (x * L::splat(std::f64::consts::FRAC_2_PI)).round();
    // π/2 in three pieces of 33 bits each
    let r = x - k * L::splat(f64::from_bits(0x3FF9_21FB_5440_0000));
    let r = r - k * L::splat(f64::from_bits(0x3DD0_B461_1A60_0000));
    let r = r - k * L::splat(f64::from_bits(0x3BA3_198A_2E03_7073));
    let z = r * r;
    let mut s = L::splat(1.0 / 355_687_428_096_000.0);
    for c in [-1.0 / 1_307_674_368_000.0, 1.0 / 6_227_020_800.0, -1.0 / 39_916_800.0, 1.0 / 362_880.0, -1.0 / 5040.0] {
        s = s * z + L::splat(c);
    }
    s = s * z + L::splat(1.0 / 120.0);
    s = s * z - L::splat(1.0 / 6.0);
    let s = r + r * (z * s);
    let mut c = L::splat(1.0 / 20_922_789_888_000.0);
    for a in [-1.0 / 87_178_291_200.0, 1.0 / 479_001_600.0, -1.0 / 3_628_800.0, 1.0 / 40320.0, -1.0 / 720.0] {
        c = c * z + L::splat(a);
    }
    c = c * z + L::splat(1.0 / 24.0);
    let half_z = z * L::splat(0.5);
    let c = L::splat(1.0) - (half_z - z * z * c);
    // quadrant in -2..=2
    let q = k - L::splat(4.0) * (k * L::splat(0.25)).round();
    let odd = (q.abs() - L::splat(1.0)).abs(); // zero in the quadrants ±1
    let half = L::splat(0.5);
    let (sw, cw) = (L::select_gt(half, odd, c, s), L::select_gt(half, odd, s, c));
    let two = L::splat(1.5);
    // sine changes sign in quadrants ±2 and -1; cosine in ±2 and 1
    let s_negative = L::select_gt(q.abs(), two, L::splat(1.0), L::select_gt(-half, q, L::splat(1.0), L::splat(0.0)));
    let c_negative = L::select_gt(q.abs(), two, L::splat(1.0), L::select_gt(q, half, L::splat(1.0), L::splat(0.0)));
    (L::select_gt(s_negative, half, -sw, sw), L::select_gt(c_negative, half, -cw, cw))
}

/// Angle of the point `(c, s)`, in (-π, π]; zero at the origin. Relative error below 4 ulp.
///
/// Halves the angle four times with square roots and ends with the arctangent series, whose argument is below 0.199.
#[inline(always)]
pub fn atan2<L: Lane>(s: L, c: L) -> L {
    let one = L::splat(1.0);
    let zero = L::splat(0.0);
    let r2 = s * s + c * c;
    let tiny = L::splat(1e-280);
    let r = L::select_gt(r2, tiny, r2, one).sqrt();
    let (sa, ca) = (s.abs(), c.abs());
    let big = ((r + ca) / (r + r)).sqrt();
    let small = sa / ((r + r) * big);
    let ch = L::select_gt(zero, c, small, big);
    let sh = L::select_gt(zero, c, big, small);
    let t = sh / (one + ch);
    let t = t / (one + (one + t * t).sqrt());
    let t = t / (one + (one + t * t).sqrt());
    let z = t * t;
    let mut p = L::splat(1.0 / 25.0);
    for n in [23.0, 21.0, 19.0, 17.0, 15.0, 13.0, 11.0, 9.0, 7.0, 5.0, 3.0] {
        p = L::splat(1.0 / n) - z * p;
    }
    let angle = (t - t * (z * p)) * L::splat(16.0);
    let angle = L::select_gt(r2, tiny, angle, zero);
    L::select_gt(zero, s, -angle, angle)
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Functions<'a> {
        x: &'a [F4],
        out: &'a mut Vec<F4>,
    }
    impl LaneKernel for Functions<'_> {
        type Output = ();
        #[inline(always)]
        fn run<L: Lane<Memory = F4>>(self) {
            for x in self.x {
                let (s, c) = sin_cos(L::load(x));
                for y in [s, c, atan2(s, c), atan2(L::load(x), c), (L::load(x) / c).abs().sqrt().max(s).min(-c)] {
                    let mut m = F4::ZERO;
                    y.store(&mut m);
                    self.out.push(m);
                }
            }
        }
    }

    fn arguments() -> Vec<F4> {
        let mut x = Vec::new();
        let mut a = 1.0e-9;
        while a < 2.0e5 {
            x.push(F4([a, -a, a * 1.37, -a * 0.731]));
            a *= 1.13;
        }
        let quarter = std::f64::consts::FRAC_PI_4;
        for k in -40..40 {
            x.push(F4([quarter * f64::from(k), quarter * f64::from(k) + 1e-12, f64::from(k), 0.0]));
        }
        x
    }

    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        let x = arguments();
        let (mut a, mut b) = (Vec::new(), Vec::new());
        dispatch(Functions { x: &x, out: &mut a });
        dispatch_portable(Functions { x: &x, out: &mut b });
        assert_eq!(a.len(), b.len());
        for (p, q) in a.iter().zip(&b) {
            for i in 0..4 {
                assert_eq!(p[i].to_bits(), q[i].to_bits());
            }
        }
    }

    #[test]
    fn sine_cosine_and_angle_agree_with_the_standard_library() {
        for v in arguments() {
            for &x in &v.0 {
                let (s, c) = sin_cos(x);
                assert!((s - x.sin()).abs() < 5e-16, "sin {x}: {s} {}", x.sin());
                assert!((c - x.cos()).abs() < 5e-16, "cos {x}: {c} {}", x.cos());
                let (a, b) = (atan2(s, c), s.atan2(c));
                assert!((a - b).abs() <= 1e-15 * b.abs().max(1e-300), "atan2 {x}: {a} {b}");
            }
        }
        assert_eq!(atan2(0.0, 0.0), 0.0);
        assert!((atan2(0.0, -1.0) - std::f64::consts::PI).abs() < 1e-15);
        assert!((atan2(-1.0, 0.0) + std::f64::consts::FRAC_PI_2).abs() < 1e-15);
    }
}

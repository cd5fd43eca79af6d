//! Exponential, logarithm and cube root of lanes ([`crate::lanes`]): the same bits on every instruction set.
//!
//! Built from single IEEE operations. Errors against the standard library are a few units in the last place; the tests state them.

use crate::lanes::Lane;

/// ln 2 in two pieces; products of the first with exponents are exact.
const LN2_HIGH: f64 = 0.693_147_180_369_123_8;
const LN2_LOW: f64 = 1.908_214_929_270_587_7e-10;
/// Arguments of the exponential are held above this; below, the result is zero.
const LEAST: f64 = -708.0;
/// Arguments of the exponential are held below this: nothing overflows.
const MOST: f64 = 709.0;

/// `e^x`, held at `e^709` above and zero below `x = −708`.
#[inline(always)]
#[must_use]
pub fn exp<L: Lane>(x: L) -> L {
    let held = x.max(L::splat(LEAST)).min(L::splat(MOST));
    let k = (held * L::splat(std::f64::consts::LOG2_E)).round();
    let r = (held - k * L::splat(LN2_HIGH)) - k * L::splat(LN2_LOW);
    // Taylor on |r| ≤ 0.35: the first term left out is below 5e-18
    let mut p = L::splat(1.0 / 6_227_020_800.0);
    for c in [
        1.0 / 479_001_600.0,
        1.0 / 39_916_800.0,
        1.0 / 3_628_800.0,
        1.0 / 362_880.0,
        1.0 / 40_320.0,
        1.0 / 5040.0,
        1.0 / 720.0,
        1.0 / 120.0,
        1.0 / 24.0,
        1.0 / 6.0,
        0.5,
    ] {
        p = p * r + L::splat(c);
    }
    let sum = L::splat(1.0) + (r + r * r * p);
    // The exponent is taken in two halves: 2^1024 itself does not exist.
    let half = (k * L::splat(0.5)).round();
    let value = sum * half.power_of_two() * (k - half).power_of_two();
    L::select_gt(L::splat(LEAST), x, L::splat(0.0), value)
}

/// `ln x` of positive normal numbers; smaller ones count as the smallest of these.
#[inline(always)]
#[must_use]
pub fn ln<L: Lane>(x: L) -> L {
    let (mantissa, exponent) = x.max(L::splat(f64::MIN_POSITIVE)).split_exponent();
    let one = L::splat(1.0);
    let large = L::splat(std::f64::consts::SQRT_2);
    let m = L::select_gt(mantissa, large, mantissa * L::splat(0.5), mantissa);
    let e = L::select_gt(mantissa, large, exponent + one, exponent);
    let f = m - one;
    e * L::splat(LN2_HIGH) + (area(f, m + one) + e * L::splat(LN2_LOW))
}

/// `ln(1 + x)` for `0 ≤ x ≤ 1`, accurate also for the smallest `x`.
#[inline(always)]
#[must_use]
pub fn ln_1p<L: Lane>(x: L) -> L {
    let one = L::splat(1.0);
    // ln(1 + x) = ln(4/3) + ln(3 (1 + x)/4) above 1/3, so that the series runs over |s| ≤ 1/5
    let upper = L::splat(1.0 / 3.0);
    let (f, sum) = (x, x + one + one);
    let shifted = (x * L::splat(3.0) - one) * L::splat(0.25);
    let far = L::splat(0.287_682_072_451_780_93) + area(shifted, shifted + one + one);
    L::select_gt(x, upper, far, area(f, sum))
}

/// `ln(1 + f)` from `f` and `2 + f`, for `|f/(2 + f)| ≤ 1/5`: twice the area tangent.
#[inline(always)]
fn area<L: Lane>(f: L, sum: L) -> L {
    let s = f / sum;
    let z = s * s;
    let mut p = L::splat(1.0 / 23.0);
    for n in [21.0, 19.0, 17.0, 15.0, 13.0, 11.0, 9.0, 7.0, 5.0, 3.0] {
        p = p * z + L::splat(1.0 / n);
    }
    // ln(1 + f) = f − s (f − 2 z p): the leading term carries no rounding
    f - s * (f - L::splat(2.0) * z * p)
}

/// `x^(−1/3)` for positive normal numbers.
#[inline(always)]
#[must_use]
pub fn inverse_cbrt<L: Lane>(x: L) -> L {
    let (mantissa, exponent) = x.max(L::splat(f64::MIN_POSITIVE)).split_exponent();
    // exponent = 3 k + r with r in −1, 0, 1; x = m 2^r · 8^k with m 2^r in [½, 4)
    let third = (exponent * L::splat(1.0 / 3.0)).round();
    let rest = exponent - third * L::splat(3.0);
    let m = mantissa * rest.power_of_two();
    // a quadratic through the range, good to a tenth, then Newton on y^(−3) = m, each of second order
    let mut y = L::splat(1.554) - m * (L::splat(0.656) - m * L::splat(0.1));
    for _ in 0..6 {
        y = y + y * (L::splat(1.0) - m * y * y * y) * L::splat(1.0 / 3.0);
    }
    y * (-third).power_of_two()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{F4, LaneKernel, dispatch, dispatch_portable};

    struct All<'a> {
        x: &'a [F4],
        out: &'a mut Vec<F4>,
    }
    impl LaneKernel for All<'_> {
        type Output = ();
        #[inline(always)]
        fn run<L: Lane<Memory = F4>>(self) {
            for x in self.x {
                let x = L::load(x);
                for y in [exp(x), ln(x.abs()), ln_1p(x.abs().min(L::splat(1.0))), inverse_cbrt(x.abs())] {
                    let mut m = F4::ZERO;
                    y.store(&mut m);
                    self.out.push(m);
                }
            }
        }
    }

    fn arguments() -> Vec<F4> {
        let mut x = Vec::new();
        let mut a: f64 = 1e-300;
        while a < 1e300 {
            x.push(F4([a, -a, 1.0 + a.min(0.5), 1.0 - a.min(0.5)]));
            a *= 1.0917;
        }
        for k in -8000..8000 {
            let t = f64::from(k) * 0.0887;
            x.push(F4([t, t * 1e-3, 1.0 + t * 1e-6, t + 0.31]));
        }
        x
    }

    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        let x = arguments();
        let (mut a, mut b) = (Vec::new(), Vec::new());
        dispatch(All { x: &x, out: &mut a });
        dispatch_portable(All { x: &x, out: &mut b });
        assert!(a.iter().zip(&b).all(|(p, q)| p.0.map(f64::to_bits) == q.0.map(f64::to_bits)));
    }

    #[test]
    fn they_agree_with_the_standard_library() {
        let mut worst = [0.0f64; 4];
        for v in arguments() {
            for x in v.0 {
                let relative = |got: f64, right: f64| (got - right).abs() / right.abs().max(1e-300);
                if (-700.0..700.0).contains(&x) {
                    worst[0] = worst[0].max(relative(exp(x), x.exp()));
                }
                let a = x.abs();
                if a > 1e-300 {
                    worst[1] = worst[1].max(relative(ln(a), a.ln()).min((ln(a) - a.ln()).abs()));
                    worst[3] = worst[3].max(relative(inverse_cbrt(a), 1.0 / a.cbrt()));
                }
                if a <= 1.0 && a > 1e-300 {
                    worst[2] = worst[2].max(relative(ln_1p(a), a.ln_1p()));
                }
            }
        }
        assert!(worst.iter().all(|w| *w < 1e-15), "{worst:?}");
        assert_eq!((exp(-800.0), exp(0.0), ln(1.0), ln_1p(0.0), inverse_cbrt(1.0)), (0.0, 1.0, 0.0, 0.0, 1.0));
    }
}

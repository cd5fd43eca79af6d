//! Numbers of twice the digits, as unevaluated sums of two (Dekker 1971; Knuth's exact sum), and the cases of one contact
//! in them: the last resort where the own block is singular to nearly all digits and decides between sticking and sliding
//! by the digits that ordinary numbers have lost.

use crate::block::{Block, Vec3};
use std::cmp::Ordering;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// `high + low` with `|low| ≤ ½ ulp(high)`: about 32 decimal digits.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Wide {
    high: f64,
    low: f64,
}

impl Wide {
    const ZERO: Wide = Wide { high: 0.0, low: 0.0 };

    /// Sum of two numbers with its round-off.
    fn exact_sum(a: f64, b: f64) -> Wide {
        let s = a + b;
        let part = s - a;
        Wide { high: s, low: (a - (s - part)) + (b - part) }
    }

    fn exact_product(a: f64, b: f64) -> Wide {
        let p = a * b;
        Wide { high: p, low: a.mul_add(b, -p) }
    }

    fn sqrt(self) -> Wide {
        if self.high <= 0.0 {
            return Wide::ZERO;
        }
        let root = Wide::from(self.high.sqrt());
        root + (self - root * root) / Wide::from(2.0 * root.high)
    }

    fn abs(self) -> Wide {
        if self.high < 0.0 { -self } else { self }
    }
}

impl From<f64> for Wide {
    fn from(high: f64) -> Wide {
        Wide { high, low: 0.0 }
    }
}

impl Neg for Wide {
    type Output = Wide;
    fn neg(self) -> Wide {
        Wide { high: -self.high, low: -self.low }
    }
}

impl Add for Wide {
    type Output = Wide;
    fn add(self, other: Wide) -> Wide {
        let (s, t) = (Wide::exact_sum(self.high, other.high), Wide::exact_sum(self.low, other.low));
        let u = Wide::exact_sum(s.high, s.low + t.high);
        Wide::exact_sum(u.high, u.low + t.low)
    }
}

impl Sub for Wide {
    type Output = Wide;
    fn sub(self, other: Wide) -> Wide {
        self + (-other)
    }
}

impl Mul for Wide {
    type Output = Wide;
    fn mul(self, other: Wide) -> Wide {
        let p = Wide::exact_product(self.high, other.high);
        Wide::exact_sum(p.high, p.low + (self.high * other.low + self.low * other.high))
    }
}

impl Div for Wide {
    type Output = Wide;
    fn div(self, other: Wide) -> Wide {
        let first = Wide::from(self.high / other.high);
        let rest = self - first * other;
        let second = Wide::from(rest.high / other.high);
        let rest = rest - second * other;
        first + second + Wide::from(rest.high / other.high)
    }
}

impl PartialOrd for Wide {
    fn partial_cmp(&self, other: &Wide) -> Option<Ordering> {
        match self.high.partial_cmp(&other.high) {
            Some(Ordering::Equal) => self.low.partial_cmp(&other.low),
            order => order,
        }
    }
}

/// Slip rates that are looked at between two powers of ten, and the powers.
const PER_DECADE: i32 = 3;
const DECADES: std::ops::Range<i32> = -34..9;

/// Halvings of a bracket: all digits of a wide number from a third of a decade.
const HALVINGS: usize = 110;

/// Impulses of sticking and of every sliding that the cases allow, judged by nobody yet. The data are scaled to order one
/// by the caller or not at all: only ratios count.
pub(super) fn candidates(w: &Block, b: &Vec3, nu: f64) -> Vec<Vec3> {
    let mut found = Vec::new();
    let m: [Wide; 9] = w.map(Wide::from);
    let v: [Wide; 3] = b.map(Wide::from);
    if let Some(stick) = stick(&m, &v) {
        found.push(stick);
    }
    let Some(slide) = Slide::new(&m, &v, nu) else { return found };
    let scale = slide.scale();
    if !(scale > 0.0 && scale.is_finite()) {
        return found;
    }
    let mut last: Option<(Wide, Wide)> = None;
    for step in DECADES.start * PER_DECADE..=DECADES.end * PER_DECADE {
        let alpha = Wide::from(scale * 10f64.powf(f64::from(step) / f64::from(PER_DECADE)));
        let h = slide.h(alpha);
        if let Some((below, h_below)) = last
            && (h_below.high < 0.0) != (h.high < 0.0)
        {
            found.push(slide.impulse(slide.root(below, alpha, h_below.high < 0.0)));
        }
        last = Some((alpha, h));
    }
    found.retain(|r| r.iter().all(|x| x.is_finite()));
    found
}

/// `−W⁻¹ b` by elimination with the largest pivots.
fn stick(w: &[Wide; 9], b: &[Wide; 3]) -> Option<Vec3> {
    let mut m: [[Wide; 4]; 3] = [0, 1, 2].map(|i| [w[3 * i], w[3 * i + 1], w[3 * i + 2], -b[i]]);
    let mut column = [0usize, 1, 2];
    for k in 0..3 {
        let (mut row, mut place, mut largest) = (k, k, Wide::ZERO);
        for i in k..3 {
            for j in k..3 {
                if m[i][j].abs() > largest {
                    (row, place, largest) = (i, j, m[i][j].abs());
                }
            }
        }
        if largest.high == 0.0 {
            return None;
        }
        m.swap(k, row);
        column.swap(k, place);
        for line in &mut m {
            line.swap(k, place);
        }
        for i in k + 1..3 {
            let factor = m[i][k] / m[k][k];
            for j in k..4 {
                m[i][j] = m[i][j] - factor * m[k][j];
            }
        }
    }
    let mut x = [Wide::ZERO; 3];
    for k in (0..3).rev() {
        let mut s = m[k][3];
        for j in k + 1..3 {
            s = s - m[k][j] * x[j];
        }
        x[k] = s / m[k][k];
    }
    let mut r = [0.0; 3];
    for k in 0..3 {
        r[column[k]] = x[k].high;
    }
    Some(r)
}

/// The sliding equation of [`super::enumerative`] in wide numbers.
struct Slide {
    nu: Wide,
    closing: Wide,
    beta: [Wide; 2],
    adj_beta: [Wide; 2],
    trace: Wide,
    det: Wide,
    a1: Wide,
    a0: Wide,
    c: Wide,
}

impl Slide {
    fn new(w: &[Wide; 9], b: &[Wide; 3], nu: f64) -> Option<Slide> {
        if !(w[0].high > 0.0 && nu > 0.0 && b[0].high < 0.0) {
            return None;
        }
        let nu = Wide::from(nu);
        let (w_nt, w_tn) = ([w[1], w[2]], [w[3], w[6]]);
        let share = |i: usize, j: usize| w_tn[i] * w_nt[j] / w[0];
        let t = [w[4] - share(0, 0), w[5] - share(0, 1), w[7] - share(1, 0), w[8] - share(1, 1)];
        let closing = -b[0];
        let beta = [b[1] - w_tn[0] * b[0] / w[0], b[2] - w_tn[1] * b[0] / w[0]];
        let adj_beta = [t[3] * beta[0] - t[1] * beta[1], t[0] * beta[1] - t[2] * beta[0]];
        let (trace, det) = (t[0] + t[3], t[0] * t[3] - t[1] * t[2]);
        let a1 = closing * trace + w_nt[0] * beta[0] + w_nt[1] * beta[1];
        let a0 = closing * det + w_nt[0] * adj_beta[0] + w_nt[1] * adj_beta[1];
        Some(Slide { nu, closing, beta, adj_beta, trace, det, a1, a0, c: w[0] / nu })
    }

    /// Size of the slip rates that can balance.
    fn scale(&self) -> f64 {
        let beta = self.beta[0].high.hypot(self.beta[1].high);
        (self.c.high * beta / self.closing.high).max(self.trace.high.abs()).max(self.c.high)
    }

    fn along(&self, alpha: Wide) -> ([Wide; 2], Wide) {
        let v = [0, 1].map(|i| alpha * self.beta[i] + self.adj_beta[i]);
        (v, (v[0] * v[0] + v[1] * v[1]).sqrt())
    }

    fn h(&self, alpha: Wide) -> Wide {
        (self.closing * alpha + self.a1) * alpha + self.a0 - self.c * self.along(alpha).1
    }

    fn root(&self, mut low: Wide, mut high: Wide, rises: bool) -> Wide {
        for _ in 0..HALVINGS {
            let middle = (low + high) * Wide::from(0.5);
            if (self.h(middle).high < 0.0) == rises {
                low = middle;
            } else {
                high = middle;
            }
        }
        (low + high) * Wide::from(0.5)
    }

    fn impulse(&self, alpha: Wide) -> Vec3 {
        let p = (alpha + self.trace) * alpha + self.det;
        let (v, size) = self.along(alpha);
        [(size / (self.nu * p.abs())).high, -(v[0] / p).high, -(v[1] / p).high]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::families::Random;

    /// Digits far beyond an ordinary number survive sums, products, quotients and roots.
    #[test]
    fn thirty_digits_are_kept() {
        let mut random = Random::new(2);
        for _ in 0..1000 {
            let (x, y) = (Wide::from(random.normal()), Wide::from(random.normal()) * Wide::from(1e-9));
            let back = (x + y) - x;
            // to the last digits of the larger one, of which the smaller may keep few
            assert!(((back - y) / x).high.abs() < 1e-30, "{back:?} {y:?}");
            let z = x + y;
            let again = z / y * y;
            assert!(((again - z) / z).high.abs() < 1e-30);
            let square = z * z;
            assert!(((square.sqrt() - z.abs()) / z).high.abs() < 1e-30);
        }
    }
}

//! Exact solution of the scalar flow under constant loading: `dφ/dt = a − 2μ̂ (φ₊/η)^{1/n}`.
//!
//! With `q = (φ/φ_a)^{1/n}`, `φ_a = η (|a|/2μ̂)ⁿ` and the time in units of `φ_a/|a|`, the flow is
//! `dT = n q^{n−1} dq / (±1 − q)`: an integral whose inverse is wanted. It is summed as
//!
//! ```text
//! q ≤ ½            power series in q
//! |q − 1| ≤ ½      power series in q − 1, plus the logarithm of the approach to steady flow
//! ½ or 3/2 … 10⁴   Gauss quadrature in ln q on panels of unit width
//! q ≥ 10⁴          geometric series in 1/q
//! ```
//!
//! and inverted by Newton's method on the one piece that holds the end of the step. Because the flow is autonomous, both
//! derivatives follow from its rate at the two ends.

use super::exact::ln_decay;
use crate::shear_flow::ShearFlow;

/// When the excess of an unloading step vanished.
#[derive(Clone, Copy, Debug)]
pub(super) struct Unloaded {
    /// Time since the start of the step [s].
    pub time: f64,
    /// Its derivative by the loading rate.
    pub by_loading: f64,
    /// Its derivative by the modulus.
    pub by_modulus: f64,
}

/// The excess at the end of a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct End {
    /// Excess over yield [Pa]; negative below yield.
    pub excess: f64,
    /// Derivative by the loading rate `a` [s], start and step fixed.
    pub by_loading: f64,
    /// Derivative by the modulus μ̂.
    pub by_modulus: f64,
    /// Rate of the excess at the end [Pa/s].
    pub end_rate: f64,
    /// Set when the excess was positive at the start and gone before the end.
    pub unloaded_at: Option<Unloaded>,
}

/// Largest `ln q` reached by quadrature; beyond it four terms of the series in `1/q` reach round-off.
const LN_FAR: f64 = 9.210_340_371_976_184;
const LN_HALF: f64 = -std::f64::consts::LN_2;
const LN_THREE_HALVES: f64 = 0.405_465_108_108_164_4;

/// Advances the excess `phi0` (negative: below yield) over `dt` with loading rate `a` and modulus `mu_hat`.
pub(super) fn advance(flow: &ShearFlow, phi0: f64, a: f64, mu_hat: f64, dt: f64) -> End {
    let elastic_end = phi0 + a * dt;
    if phi0 <= 0.0 {
        if elastic_end <= 0.0 {
            return End { excess: elastic_end, by_loading: dt, by_modulus: 0.0, end_rate: a, unloaded_at: None };
        }
        // elastic until yield, then flow from zero excess; the yield time moves with the loading
        let until = -phi0 / a;
        let end = from_yield(flow, 0.0, a, mu_hat, dt - until);
        return End { by_loading: end.by_loading + end.end_rate * until / a, ..end };
    }
    from_yield(flow, phi0, a, mu_hat, dt)
}

/// As [`advance`] for an excess that is not negative.
fn from_yield(flow: &ShearFlow, phi0: f64, a: f64, mu_hat: f64, dt: f64) -> End {
    if flow.consistency() == 0.0 {
        let excess = (a * dt).min(0.0);
        let unloaded = Unloaded { time: 0.0, by_loading: 0.0, by_modulus: 0.0 };
        return End {
            excess,
            by_loading: if a < 0.0 { dt } else { 0.0 },
            by_modulus: 0.0,
            end_rate: a.min(0.0),
            unloaded_at: (a < 0.0).then_some(unloaded),
        };
    }
    let n = flow.index();
    let load = a.abs();
    // excess of steady flow at this loading, in logs because n may be small
    let ln_ref = flow.ln_consistency() + n * (load.ln() - (2.0 * mu_hat).ln());
    let ln_q0 = (phi0.ln() - ln_ref) / n;
    let time = (load.ln() + dt.ln() - ln_ref).exp();
    if a == 0.0 || load * dt <= 1e-13 * phi0 || ln_q0 * n.max(1.0) > 600.0 {
        return relax(flow, phi0, a, mu_hat, dt);
    }
    let reference = ln_ref.exp();
    let (y0, q0) = (phi0 / reference, ln_q0.exp());
    let sign = a.signum();
    let branch = Branch { n, sign };
    let (ln_q, delta) = match branch.end(ln_q0, time) {
        Reached::Excess { ln_q, delta } => (ln_q, delta),
        Reached::Yield { time: gone } => {
            // unloading only: elastic for what is left of the step
            let time_gone = gone * reference / load;
            let slope = n * reference / load * (gone - y0 / (1.0 + q0));
            // time_gone = reference·gone/load, differentiated by load (= −a) and by the modulus
            let unloaded =
                Unloaded { time: time_gone, by_loading: -(slope - time_gone) / load, by_modulus: -slope / mu_hat };
            return End {
                excess: a * (dt - time_gone),
                by_loading: dt - time_gone - a * unloaded.by_loading,
                by_modulus: -a * unloaded.by_modulus,
                end_rate: a,
                unloaded_at: Some(unloaded),
            };
        }
    };
    let y = (n * ln_q).exp();
    // rates of q-space at both ends: ±1 − q, taken from q − 1 where that is small
    let rate_end = if sign > 0.0 { -delta } else { -2.0 - delta };
    let rate_start = if sign > 0.0 { -ln_q0.exp_m1() } else { -(1.0 + q0) };
    let propagation = if rate_start == 0.0 { (-time / n).exp() } else { rate_end / rate_start };
    let bracket = y - y0 * propagation - if rate_end == 0.0 { 0.0 } else { time * rate_end };
    let by_load = n * reference / load * bracket + dt * rate_end;
    End {
        excess: reference * y,
        by_loading: sign * by_load,
        by_modulus: -n * reference / mu_hat * bracket,
        end_rate: load * rate_end,
        unloaded_at: None,
    }
}

/// Relaxation without loading, with the derivative by a loading that is added.
fn relax(flow: &ShearFlow, phi0: f64, a: f64, mu_hat: f64, dt: f64) -> End {
    let p = flow.inverse_index();
    let ln_rate0 = (phi0.ln() - flow.ln_consistency()) * p;
    let ln_ratio = ln_decay(flow, (2.0 * dt * mu_hat).ln() - phi0.ln() + ln_rate0);
    let ratio = ln_ratio.exp();
    if a < 0.0 && phi0 * ratio <= 1e-9 * a.abs() * dt {
        // the excess is gone early in the step: elastic unloading for the rest of it
        let extinct = if p < 1.0 { (phi0.ln() - ln_rate0).exp() / (2.0 * mu_hat * (1.0 - p)) } else { 0.0 };
        let rest = (dt - extinct).max(0.0);
        let unloaded = Unloaded { time: dt - rest, by_loading: 0.0, by_modulus: 0.0 };
        return End { excess: a * rest, by_loading: rest, by_modulus: 0.0, end_rate: a, unloaded_at: Some(unloaded) };
    }
    let rate_end = (ln_ratio * p + ln_rate0).exp();
    // ∫ (φ₁/φ)^{1/n} dt along the relaxation: a load added at any time decays by that factor until the end
    let weight = if ln_ratio == f64::NEG_INFINITY {
        0.0
    } else {
        // φ₁^{1/n} ∫ φ^{−2/n} dφ η^{1/n}/(2μ̂), the larger power taken out of the integral of φ^{c−1}, c = 1 − 2/n
        let c = 1.0 - 2.0 * p;
        let (out, integral) = match c {
            0.0 => (p, -ln_ratio),
            _ if c > 0.0 => (p, -(c * ln_ratio).exp_m1() / c),
            _ => (1.0 - p, (-c * ln_ratio).exp_m1() / c),
        };
        (phi0.ln() - ln_rate0 + ln_ratio * out).exp() / (2.0 * mu_hat) * integral
    };
    let weight = if weight.is_finite() { weight.clamp(0.0, dt) } else { dt };
    End {
        excess: phi0 * ratio + a * weight,
        by_loading: weight,
        by_modulus: -2.0 * dt * rate_end,
        end_rate: a - 2.0 * mu_hat * rate_end,
        unloaded_at: None,
    }
}

/// Where a step ends.
enum Reached {
    /// At `ln q`, `q − 1 = delta`.
    Excess { ln_q: f64, delta: f64 },
    /// The excess vanished after this dimensionless time.
    Yield { time: f64 },
}

/// One sign of the loading, in dimensionless form.
struct Branch {
    n: f64,
    /// +1 loading, −1 unloading.
    sign: f64,
}

impl Branch {
    /// End of a step of dimensionless length `time` from `ln q₀`.
    fn end(&self, ln_q0: f64, time: f64) -> Reached {
        let at = |ln_q: f64| Reached::Excess { ln_q, delta: ln_q.exp_m1() };
        if self.sign > 0.0 && ln_q0 < LN_THREE_HALVES {
            return if ln_q0 > LN_HALF { self.approach(ln_q0.exp_m1(), time) } else { self.rise(ln_q0, time) };
        }
        // descending: from far above through the panels to the region of a series
        let floor = if self.sign > 0.0 { LN_THREE_HALVES } else { LN_HALF };
        let (mut ln_q, mut left, mut gone) = (ln_q0, time, 0.0);
        if ln_q > LN_FAR {
            let passed = self.far_time(ln_q, LN_FAR);
            if left <= passed {
                return at(self.solve(ln_q, LN_FAR, left, Self::far_time));
            }
            left -= passed;
            gone += passed;
            ln_q = LN_FAR;
        }
        while ln_q > floor {
            let lower = (ln_q - 1.0).max(floor);
            let passed = self.panel_time(ln_q, lower);
            if left <= passed {
                return at(self.solve(ln_q, lower, left, Self::panel_time));
            }
            left -= passed;
            gone += passed;
            ln_q = lower;
        }
        if self.sign > 0.0 { self.approach(ln_q.exp_m1(), left) } else { self.fall(ln_q, left, gone) }
    }

    /// Time from `upper` down to `lower`, both at or above [`LN_FAR`] (geometric series of the integrand).
    fn far_time(&self, upper: f64, lower: f64) -> f64 {
        let mut sum = 0.0;
        let mut factor = 1.0;
        for k in 0..5 {
            let c = self.n - 1.0 - k as f64;
            let width = upper - lower;
            sum += factor * (c * lower).exp() * if c == 0.0 { width } else { (c * width).exp_m1() / c };
            factor *= self.sign;
        }
        self.n * sum
    }

    /// Time from `upper` down to `lower` by Gauss quadrature.
    fn panel_time(&self, upper: f64, lower: f64) -> f64 {
        let (center, half) = (0.5 * (upper + lower), 0.5 * (upper - lower));
        let mut sum = 0.0;
        for (x, w) in GAUSS_12 {
            sum += w * (self.density(center - half * x) + self.density(center + half * x));
        }
        sum * half
    }

    /// `−dT/d(ln q)` on the descending branch.
    fn density(&self, ln_q: f64) -> f64 {
        self.n * (self.n * ln_q).exp() / (ln_q.exp() - self.sign)
    }

    /// `ln q` in `[lower, upper]` that `elapsed(upper, ln q) = time`, by Newton with bisection guard.
    fn solve(&self, upper: f64, lower: f64, time: f64, elapsed: fn(&Self, f64, f64) -> f64) -> f64 {
        let (mut low, mut high) = (lower, upper);
        // without the loading the descent is a power law: an excellent start far above steady flow
        let m = self.n - 1.0;
        let grown = 1.0 - m * time / self.n * (-m * upper).exp();
        let mut x = if m != 0.0 && grown > 0.0 { upper + grown.ln() / m } else { upper - time / self.density(upper) };
        if !(x > low && x < high) {
            x = 0.5 * (low + high);
        }
        for _ in 0..100 {
            let miss = elapsed(self, upper, x) - time;
            if miss > 0.0 {
                low = x;
            } else {
                high = x;
            }
            let mut next = x + miss / self.density(x);
            if !(next > low && next < high) {
                next = 0.5 * (low + high);
            }
            let step = (next - x).abs();
            x = next;
            if step <= 1e-15 * (1.0 + x.abs()) || high - low <= 1e-15 * (1.0 + high.abs()) {
                break;
            }
        }
        x
    }

    /// Steady flow approached from `|q − 1| ≤ ½`: solves `n (v − S(q − 1)) = const` for `v = −ln|q − 1|`.
    fn approach(&self, start: f64, time: f64) -> Reached {
        let steady = Reached::Excess { ln_q: 0.0, delta: 0.0 };
        if start == 0.0 {
            return steady;
        }
        let side = start.signum();
        let v0 = -start.abs().ln();
        let target = v0 - self.binomial(start) + time / self.n;
        if !target.is_finite() || target > 740.0 {
            return steady;
        }
        let mut v = target.max(v0);
        for _ in 0..50 {
            let delta = side * (-v).exp();
            let miss = v - self.binomial(delta) - target;
            let step = miss / ((self.n - 1.0) * delta.ln_1p()).exp();
            v = (v - step).max(v0);
            if step.abs() <= 1e-16 * (1.0 + v.abs()) {
                break;
            }
        }
        let delta = side * (-v).exp();
        Reached::Excess { ln_q: delta.ln_1p(), delta }
    }

    /// `Σ_{k≥1} C(n−1, k) δᵏ/k` for `|δ| ≤ ½`.
    fn binomial(&self, delta: f64) -> f64 {
        // factor = C(n−1, k) δᵏ, by multiplications alone
        let (mut factor, mut sum) = (1.0, 0.0);
        for (k, reciprocal) in RECIPROCALS.iter().enumerate() {
            factor *= (self.n - (k + 1) as f64) * reciprocal * delta;
            let term = factor * reciprocal;
            sum += term;
            if term.abs() <= 1e-17 * sum.abs() {
                break;
            }
        }
        sum
    }

    /// Time between zero excess and `y = qⁿ`, `q ≤ ½`: `y Σ (±q)ᵏ/(k/n + 1)`.
    fn low_time(&self, y: f64, q: f64) -> f64 {
        let (mut power, mut sum) = (1.0, 0.0);
        for k in 0..64 {
            let term = power * self.n / (k as f64 + self.n);
            sum += term;
            if term.abs() <= 1e-17 * sum {
                break;
            }
            power *= self.sign * q;
        }
        y * sum
    }

    /// Loading from `q₀ ≤ ½` upwards.
    fn rise(&self, ln_q0: f64, time: f64) -> Reached {
        let y_half = (self.n * LN_HALF).exp();
        let begun = self.low_time((self.n * ln_q0).exp(), ln_q0.exp());
        let target = begun + time;
        let to_half = self.low_time(y_half, 0.5);
        if target >= to_half {
            return self.approach(-0.5, target - to_half);
        }
        // convex in y: Newton from the right descends to the root
        self.low_solve(target, target.min(y_half))
    }

    /// Unloading from `q ≤ ½` downwards; `left` of the step remain, `gone` have passed.
    fn fall(&self, ln_q: f64, left: f64, gone: f64) -> Reached {
        let to_zero = self.low_time((self.n * ln_q).exp(), ln_q.exp());
        if left >= to_zero {
            return Reached::Yield { time: gone + to_zero };
        }
        // concave in y: Newton from the left ascends to the root
        let target = to_zero - left;
        self.low_solve(target, target)
    }

    /// `y` with `low_time(y) = target`.
    fn low_solve(&self, target: f64, start: f64) -> Reached {
        let y_half = (self.n * LN_HALF).exp();
        let mut y = start;
        for _ in 0..100 {
            let q = (y.ln() / self.n).exp();
            let step = (self.low_time(y, q) - target) * (1.0 - self.sign * q);
            y = (y - step).clamp(0.0, y_half);
            if step.abs() <= 2e-16 * y || y == 0.0 {
                break;
            }
        }
        let ln_q = y.ln() / self.n;
        Reached::Excess { ln_q, delta: ln_q.exp_m1() }
    }
}

/// `1/k` for k = 1 to 64.
const RECIPROCALS: [f64; 64] = {
    let mut table = [0.0; 64];
    let mut k = 0;
    while k < 64 {
        table[k] = 1.0 / (k + 1) as f64;
        k += 1;
    }
    table
};

/// Positive nodes and weights of 12-point Gauss–Legendre quadrature.
const GAUSS_12: [(f64, f64); 6] = [
    (0.125_233_408_511_468_9, 0.249_147_045_813_402_8),
    (0.367_831_498_998_180_2, 0.233_492_536_538_354_8),
    (0.587_317_954_286_617_4, 0.203_167_426_723_065_9),
    (0.769_902_674_194_304_7, 0.160_078_328_543_346_2),
    (0.904_117_256_370_474_9, 0.106_939_325_995_318_4),
    (0.981_560_634_246_719_2, 0.047_175_336_386_511_8),
];

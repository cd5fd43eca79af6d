//! Radau IIA of order 5 with step doubling, for the four strain components of simple shear.

use nalgebra::{SMatrix, SVector};

type State = SVector<f64, 4>;

/// Advances `y` from 0 to `time` by `dy/dt = f(y)`; `None` if the step size collapses.
///
/// Error per step held below `tolerance` relative to the state, judged by two half steps.
pub(super) fn integrate(f: &dyn Fn(&State) -> State, start: State, time: f64, tolerance: f64) -> Option<State> {
    let (mut y, mut t, mut h) = (start, 0.0, time * 1e-3);
    let mut steps = 0;
    while t < time {
        steps += 1;
        if steps > 200_000 || h < 1e-14 * time {
            return None;
        }
        h = h.min(time - t);
        let attempt = step(f, &y, h).and_then(|whole| {
            let half = step(f, &y, 0.5 * h)?;
            let both = step(f, &half, 0.5 * h)?;
            Some((whole, both))
        });
        let Some((whole, both)) = attempt else {
            h *= 0.25;
            continue;
        };
        let error = (both - whole).norm() / (31.0 * both.norm()) / tolerance;
        if error <= 1.0 {
            t += h;
            y = both;
        }
        h *= (0.9 * error.max(1e-12).powf(-1.0 / 6.0)).clamp(0.2, 4.0);
    }
    Some(y)
}

/// One step; `None` if Newton's iteration does not settle.
fn step(f: &dyn Fn(&State) -> State, y: &State, h: f64) -> Option<State> {
    let s6 = 6f64.sqrt();
    let a = [
        [(88.0 - 7.0 * s6) / 360.0, (296.0 - 169.0 * s6) / 1800.0, (-2.0 + 3.0 * s6) / 225.0],
        [(296.0 + 169.0 * s6) / 1800.0, (88.0 + 7.0 * s6) / 360.0, (-2.0 - 3.0 * s6) / 225.0],
        [(16.0 - s6) / 36.0, (16.0 + s6) / 36.0, 1.0 / 9.0],
    ];
    let mut z = [State::zeros(); 3];
    let mut last = f64::INFINITY;
    for iteration in 0..25 {
        let values = [f(&(y + z[0])), f(&(y + z[1])), f(&(y + z[2]))];
        let jacobians = [jacobian(f, &(y + z[0])), jacobian(f, &(y + z[1])), jacobian(f, &(y + z[2]))];
        let mut matrix = SMatrix::<f64, 12, 12>::identity();
        let mut residual = SVector::<f64, 12>::zeros();
        for i in 0..3 {
            let mut r = -z[i];
            for j in 0..3 {
                r += h * a[i][j] * values[j];
                let block = -h * a[i][j] * jacobians[j];
                for p in 0..4 {
                    for q in 0..4 {
                        matrix[(4 * i + p, 4 * j + q)] += block[(p, q)];
                    }
                }
            }
            residual.fixed_rows_mut::<4>(4 * i).copy_from(&r);
        }
        let delta = matrix.lu().solve(&residual)?;
        for i in 0..3 {
            z[i] += delta.fixed_rows::<4>(4 * i);
        }
        let size = delta.norm() / y.norm();
        if !size.is_finite() {
            return None;
        }
        if size < 1e-14 || (iteration > 2 && size < 1e-12 && size >= last) {
            return Some(y + z[2]);
        }
        last = size;
    }
    (last < 1e-10).then(|| y + z[2])
}

/// Central differences.
pub(super) fn jacobian(f: &dyn Fn(&State) -> State, y: &State) -> SMatrix<f64, 4, 4> {
    let mut out = SMatrix::<f64, 4, 4>::zeros();
    for k in 0..4 {
        let h = 1e-6 * (0.01 + y[k].abs());
        let (mut up, mut down) = (*y, *y);
        up[k] += h;
        down[k] -= h;
        out.set_column(k, &((f(&up) - f(&down)) / (2.0 * h)));
    }
    out
}

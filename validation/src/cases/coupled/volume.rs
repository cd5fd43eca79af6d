//! The room that strands take from the liquid.

use nalgebra::Vector3;
use particle_grid::{BlockGrid, Lattice, ParticleOrder};
use runner::world::submersion::volume::{add_shares, faces_around};

use crate::case::{Case, CaseError, Outcome, Param, Params};

/// Shares of cells and their rate.
pub const VOLUME_FRACTION: Case = Case {
    id: "coupled/volume-fraction",
    about: "Shares of cells that moving strands take in a periodic box: they add up to the volume of the strands, their rates to \
            zero, and the rate is the derivative following the liquid (S51)",
    params: &[
        Param::count("points", 200, "points of the strands"),
        Param::number("step", 1e-5, "1", "step of the difference, in cells"),
    ],
    run: volume_fraction,
};

fn volume_fraction(p: &Params) -> Result<Outcome, CaseError> {
    let count = p.count_in("points", 1, 1_000_000)?;
    let step = p.number_in("step", 1e-8, 1e-2)?;
    let lattice = Lattice { dx: 0.01, origin: Vector3::zeros(), periods: [2; 3] };
    let side = 0.08;
    // points and velocities without a pattern
    let draw = |k: usize, a: usize| ((k * 3 + a) as f64 * 0.754_877_666).fract();
    let positions: Vec<Vector3<f64>> = (0..count).map(|k| Vector3::from_fn(|a, _| side * draw(k, a))).collect();
    let velocities: Vec<Vector3<f64>> = (0..count).map(|k| Vector3::from_fn(|a, _| draw(k + 7, a) - 0.5)).collect();
    let volumes: Vec<f64> = (0..count).map(|k| 1e-9 * (1.0 + draw(k, 1))).collect();
    let mut grid = BlockGrid::new(lattice);
    grid.rebuild(&ParticleOrder::new(), &positions);
    let cell = lattice.dx.powi(3);
    let shares = |positions: &[Vector3<f64>]| {
        let mut share = vec![0.0; grid.node_count()];
        add_shares(&grid, positions, &volumes, &mut share);
        share
    };
    let share = shares(&positions);
    let mut out = Outcome::new();
    out.compare("volume", share.iter().sum::<f64>() * cell, volumes.iter().sum(), 1e-12);
    // divergence of what flows through the faces when every point has its velocity
    let divergence = |velocity: &dyn Fn(usize) -> Vector3<f64>| {
        let mut rate = vec![0.0; grid.node_count()];
        for a in 0..3 {
            let mut flux = vec![0.0; grid.node_count()];
            for (k, (x, volume)) in positions.iter().zip(&volumes).enumerate() {
                faces_around(&grid, x, a, |node, weight| flux[node] += weight * volume / cell * velocity(k)[a]);
            }
            for (node, rate) in rate.iter_mut().enumerate() {
                *rate += (flux[grid.along(node, a, 1) as usize] - flux[node]) / lattice.dx;
            }
        }
        rate
    };
    let own = divergence(&|k| velocities[k]);
    let size = own.iter().map(|r| r.abs()).sum::<f64>();
    out.measure(
        "rate_sum",
        own.iter().sum::<f64>().abs() / size,
        |x| x <= 1e-12,
        "liquid at rest: the rates add up to zero",
    );
    // following liquid that moves as one is moving the points the other way
    let stream = Vector3::new(0.3, -0.2, 0.1);
    let common = divergence(&|_| stream);
    let rate: Vec<f64> = common.iter().zip(&own).map(|(common, own)| own - common).collect();
    let h = step * lattice.dx;
    let moved = |sign: f64| -> Vec<Vector3<f64>> {
        let shift = |(x, v): (&Vector3<f64>, &Vector3<f64>)| {
            let mut y = x + (v - stream) * (sign * h);
            lattice.wrap(&mut y);
            y
        };
        positions.iter().zip(&velocities).map(shift).collect()
    };
    let (ahead, behind) = (shares(&moved(1.0)), shares(&moved(-1.0)));
    let largest_rate = rate.iter().fold(0.0f64, |m, r| m.max(r.abs()));
    let difference = (0..rate.len())
        // the liquid's share is what the strands leave
        .map(|c| (rate[c] + (ahead[c] - behind[c]) / (2.0 * h)).abs())
        .fold(0.0, f64::max);
    let why = "the rate is the difference of the shares following the liquid (second order in the step)";
    out.measure("rate_difference", difference / largest_rate, |x| x <= 1e-6, why);
    Ok(out)
}

use constitutive::EquationOfState;
use mpm::{HalfSpace, LiquidSettings, Vector};
use particle_grid::Lattice;

use super::setup::{self, GRAVITY, Run};
use crate::case::{Case, CaseError, Outcome, Param, Params};

pub const CASE: Case = Case {
    id: "liquid/hydrostatic",
    about: "A column at rest: pressure at the floor (and volume ratio of a compressible liquid) against the closed form, and no \
            spurious currents.",
    params: &[
        Param::text("material", "water", "name of the liquid"),
        Param::number("depth", 0.2, "m", "depth of the column"),
        Param::number("cell", 0.005, "m", "cell size"),
        Param::count("per_axis", 4, "particles per cell and direction"),
        Param::number("dt", 1e-3, "s", "step"),
        Param::count("steps", 10, "steps"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let liquid = setup::preset(p)?;
    let (depth, dx, dt) = (p.positive("depth")?, p.positive("cell")?, p.positive("dt")?);
    let per_axis = p.count_in("per_axis", 1, 8)?;
    let steps = p.count_in("steps", 1, 10_000)?;
    if depth / dx > 2000.0 || depth < 4.0 * dx {
        return Err(p.reject("cell", "between a two-thousandth and a quarter of the depth"));
    }
    let lattice = Lattice { dx, origin: Vector::<2>::zeros(), periods: [2, 0] };
    let materials = vec![setup::material(&liquid)?];
    let high = Vector::<2>::new(8.0 * dx, depth);
    let mut particles = setup::region(&lattice, per_axis, Vector::<2>::zeros(), high, |_| true, &materials);
    // The column in equilibrium: dp/dz = ρ₀ g/J(p), marched from the surface.
    let law = EquationOfState::new(liquid.bulk_modulus).map_err(CaseError::failed)?;
    let compressible = !materials[0].rigid_volume;
    let ratio = |pressure: f64| if compressible { law.volume_ratio(pressure) } else { 1.0 };
    let pressure_at = |z: f64| {
        let n = 400;
        let h = z / f64::from(n);
        let slope = |q: f64| liquid.density * GRAVITY / ratio(q);
        (0..n).fold(0.0, |q, _| q + h * slope(q + 0.5 * h * slope(q)))
    };
    for i in 0..particles.len() {
        let j = ratio(pressure_at(depth - particles.position[i][1]));
        particles.volume_ratio[i] = j;
        particles.rest_volume[i] /= j;
        particles.mass[i] /= j;
    }
    let floor = [HalfSpace { point: Vector::<2>::zeros(), normal: Vector::<2>::new(0.0, 1.0), stick: 0.0 }];
    let body = Vector::<2>::new(0.0, -GRAVITY);
    let settings = LiquidSettings { particles_per_axis: per_axis, ..Default::default() };
    let mut run = Run::new(lattice, particles, materials, &floor, body, settings);
    for _ in 0..steps {
        run.step(dt)?;
    }
    // Pressure of the lowest cells, carried down to the floor.
    let grid = &run.stepper.grid;
    let (mut sum, mut count) = (0.0, 0.0);
    for node in 0..grid.blocks.node_count() {
        let y = grid.cell_position(node)[1];
        if y > 0.0 && y < dx && grid.cell.pressure[node] != 0.0 {
            sum += grid.cell.pressure[node] + 0.5 * dx * liquid.density * GRAVITY / grid.cell.volume_ratio[node];
            count += 1.0;
        }
    }
    let mut out = Outcome::new();
    let exact = pressure_at(depth);
    out.compare("floor_pressure", sum / count, exact, if compressible { 0.01 } else { 1e-3 });
    if compressible {
        let lowest = (0..run.particles.len())
            .min_by(|&a, &b| run.particles.position[a][1].total_cmp(&run.particles.position[b][1]))
            .unwrap_or(0);
        out.compare("floor_volume_ratio", run.particles.volume_ratio[lowest], ratio(exact), 1e-3);
    }
    let totals = run.particles.totals(&run.materials, dx);
    let scale = (GRAVITY * dx).sqrt();
    out.measure("largest_speed", totals.max_speed / scale, |v| v < 1e-2, "below a hundredth of √(g dx)");
    Ok(out)
}

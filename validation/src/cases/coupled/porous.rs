//! Liquid among strands that take room.

use super::{largest, last, whole};
use crate::case::{Case, CaseError, Curve, Outcome, Param, Params, Table};

/// Liquid at rest among frozen strands.
pub const HYDROSTATIC: Case = Case {
    id: "coupled/porous-hydrostatic",
    about: "Water stands among frozen strands that take half of its room: its pressure is that of water alone, nothing moves, and \
            the strands feel the weight of the water they displace (spec 11, row 38)",
    params: &[
        Param::number("share", 0.5, "1", "share of the room that the strands take"),
        Param::number("step", 2e-3, "s", "time step"),
        Param::count("steps", 30, "steps"),
    ],
    run: hydrostatic,
};

/// The mixture's volume with ever stiffer liquid.
pub const INCOMPRESSIBLE_LIMIT: Case = Case {
    id: "coupled/incompressible-limit",
    about: "Strands plunge into liquid: the largest rate of the common volume in the first step, |div(eps_f u_f + eps_s u_s)|/eps_f, falls \
            as one over the bulk modulus from 1e4 to 1e10 dyn/cm2. Later the volume ratios of the particles, which carry noise of sampling, \
            are put right in every step: between 1e6 and 1e9 Pa that is a rate of about one a second, whatever the modulus",
    params: &[
        Param::number("softest", 1e3, "Pa", "least bulk modulus"),
        Param::count("decades", 6, "decades up from there"),
        Param::number("step", 1e-3, "s", "time step"),
        Param::count("steps", 5, "steps"),
    ],
    run: incompressible_limit,
};

const CELL: f64 = 5e-3;
/// Half the side of the tank [m].
const HALF: f64 = 0.01;
const DEPTH: f64 = 0.02;

fn hydrostatic(p: &Params) -> Result<Outcome, CaseError> {
    let (share, step) = (p.number_in("share", 0.0, 0.8)?, p.positive("step")?);
    let steps = p.count_in("steps", 10, 100_000)?;
    // upright strands half a cell apart, also in and behind the walls and the floor: their share is the same everywhere
    let spacing = 0.5 * CELL;
    let radius = spacing * (share / std::f64::consts::PI).sqrt();
    let count = 14;
    let strands: String = (0..count * count)
        .map(|n| {
            let at = |n: usize| (n as f64 + 0.5 - 0.5 * count as f64) * spacing;
            let (x, z) = (at(n % count), at(n / count));
            format!(
                "(material: \"reed\", radius: {radius:e}, shape: Straight(from: [{x:e}, -0.0075, {z:e}], to: [{x:e}, 0.03, {z:e}], vertices: 16), clamp: [First(16)]),"
            )
        })
        .collect();
    let end = step * steps as f64;
    let text = format!(
        "Scene(
            units: Si, time: (end: {end:e}, step: Fixed({step:e})), gravity: [0, -9.81, 0],
            materials: {{ \"reed\": Fibre(density: 500, young_modulus: 1e9, poisson_ratio: 0.4, viscosity: 0), \"water\": Liquid(preset: \"water\", bulk_modulus: 2.2e9) }},
            strands: [{strands}],
            solids: [(name: \"pot\", shape: Box(center: [0, 0.1, 0], half_size: [{HALF}, 0.1, {HALF}]), inverted: true)],
            liquid: (cell: {CELL:e}, particles_per_cell: 8, tanks: [(material: \"water\", shape: Box(center: [0, {:e}, 0], half_size: [{HALF}, {:e}, {HALF}]))]),
            disable: [StrandContact, Capture],
            output: (frames: Never, checkpoint: Never),
        )",
        0.5 * DEPTH,
        0.5 * DEPTH
    );
    let run = whole(&text, "porous-hydrostatic.ron")?;
    let mut out = Outcome::new();
    let scale = 1e-3 * (9.81 * CELL).sqrt();
    out.measure(
        "speed",
        last(&run, "liquid_max_speed")?,
        |x| x < scale,
        "no currents, against a thousandth of the root of g dx",
    );
    out.info("largest_speed", largest(&run, "liquid_max_speed")?);
    // the lowest cells have their centres half a cell above the floor
    out.compare("pressure", last(&run, "liquid_max_pressure")?, 997.0 * 9.81 * (DEPTH - 0.5 * CELL), 0.02);
    Ok(out)
}

fn incompressible_limit(p: &Params) -> Result<Outcome, CaseError> {
    let (softest, step) = (p.positive("softest")?, p.positive("step")?);
    let (decades, steps) = (p.count_in("decades", 1, 9)?, p.count_in("steps", 2, 10_000)?);
    let end = step * steps as f64;
    let mut out = Outcome::new();
    let (mut rows, mut points) = (Vec::new(), Vec::new());
    for k in 0..=decades {
        let bulk = softest * 10f64.powi(k as i32);
        let text = format!(
            "Scene(
                units: Si, time: (end: {end:e}, step: Fixed({step:e})), gravity: [0, -9.81, 0],
                materials: {{ \"rod\": Fibre(density: 2000, young_modulus: 1e8, poisson_ratio: 0.4, viscosity: 1e4),
                              \"liquid\": Liquid(density: 1000, bulk_modulus: {bulk:e}, shear_modulus: 0, flow: Rheometer((yield_stress: 0, consistency: 1, index: 1))) }},
                strands: [(material: \"rod\", radius: 1e-3, shape: HexBundle(count: 7, spacing: 0.004, from: [-0.01, 0.012, 0], to: [0.01, 0.012, 0], vertices: 9), velocity: [0, -0.3, 0])],
                solids: [(name: \"pot\", shape: Box(center: [0, 0.05, 0], half_size: [0.015, 0.05, 0.01]), inverted: true)],
                liquid: (cell: {CELL:e}, particles_per_cell: 8, tanks: [(material: \"liquid\", shape: Box(center: [0, 0.01, 0], half_size: [0.015, 0.01, 0.01]))]),
                disable: [StrandContact, Capture],
                output: (frames: Never, checkpoint: Never),
            )"
        );
        let run = whole(&text, "incompressible-limit.ron")?;
        let rates = run.series.column("liquid_mixture_divergence")?;
        // in the first step no volume ratio is anything but one; later what is left of the particles' ratios is put right in a step
        let rate = rates[1];
        let later = rates[2..].iter().copied().fold(0.0, f64::max);
        let fraction = largest(&run, "solid_fraction_max")?;
        rows.push(vec![format!("{bulk:.0e}"), format!("{rate:.4e}"), format!("{later:.4e}"), format!("{fraction:.3}")]);
        points.push([bulk, rate]);
    }
    let slopes: Vec<f64> = points.windows(2).map(|w| (w[1][1] / w[0][1]).log10()).collect();
    let whole_range = points[decades][1] / points[0][1] * 10f64.powi(decades as i32);
    out.measure(
        "fall_over_bulk_modulus",
        whole_range,
        |x| x < 3.0,
        "over all decades together it falls at least as one over the bulk modulus, within a factor of three",
    );
    // from 1e8 Pa on the liquid counts as rigid: there the residual of the pressure solve is left
    let compressible = points.iter().filter(|[bulk, _]| *bulk < 0.99e8).count();
    if compressible >= 2 {
        let why = "in the stiffest decade of compressible liquid it falls tenfold (exponent -1 within 0.1)";
        out.measure("stiffest_decade", slopes[compressible - 2], |x| x < -0.9, why);
    }
    if let Some(rigid) = points.get(compressible) {
        out.measure(
            "rigid",
            rigid[1] / points[0][1],
            |x| x < 1e-7,
            "liquid that counts as rigid keeps the common volume",
        );
    }
    out.table(Table {
        title: "rate of the common volume".to_owned(),
        columns: ["bulk modulus [Pa]", "first step [1/s]", "largest later [1/s]", "largest share of strands"]
            .map(str::to_owned)
            .to_vec(),
        rows,
    });
    out.curve(Curve {
        title: "incompressible limit".to_owned(),
        x_label: "bulk modulus [Pa]".to_owned(),
        y_label: "largest rate of the common volume in the first step [1/s]".to_owned(),
        log_x: true,
        log_y: true,
        series: vec![("measured".to_owned(), points)],
    });
    Ok(out)
}

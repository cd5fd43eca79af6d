//! A hanging yarn against the catenary.

use geometry::Motion;
use yarn::YarnMaterial;
use yarn::settings::{Pin, PinPlace};

use super::setup::{SEGMENT, build, material, observed_order, plane, polyline};
use crate::case::{Case, CaseError, Outcome, Param, Params, Table};

/// Catenary.
pub const CASE: Case = Case {
    id: "yarn/catenary",
    about: "A yarn hung between two pins: shape of its interior against the catenary of its own length, strain against tension over k.",
    params: &[
        Param::number(
            "stretch_modulus",
            4000.0,
            "Pa",
            "stretch modulus; the shape error and the strain fall as it rises",
        ),
        Param::count("steps", 0, "steps of relaxation (0: as many as cover 0.3 s)"),
    ],
    run,
};

/// Parameter `a` of the catenary `a cosh(x/a)` with chord `span` and length `length`.
fn parameter(span: f64, length: f64) -> f64 {
    let (mut low, mut high) = (1e-3 * span, 1e3 * span);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if 2.0 * middle * (0.5 * span / middle).sinh() > length { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

fn run(p: &Params) -> Result<Outcome, CaseError> {
    super::setup::alone(|| experiment(p))
}

fn experiment(p: &Params) -> Result<Outcome, CaseError> {
    let modulus = p.number_in("stretch_modulus", 1000.0, 1e6)?;
    let steps = p.count("steps")?;
    let hung = hang(modulus, steps)?;
    let mut out = Outcome::new();
    out.compare_absolute("shape_error", hung.off / hung.sag, 0.0, 0.005);
    out.compare("length_strain", hung.strain, hung.expected_strain, 0.12);
    out.info("sag", hung.sag);
    out.info("catenary_parameter", hung.parameter);
    out.info("residual_speed", hung.speed);
    // The inextensible limit: strain falls as 1/k.
    let mut strains = vec![[modulus, hung.strain]];
    let mut rows = vec![hung.row(modulus)];
    for factor in [2.0, 4.0, 8.0] {
        let stiffer = hang(factor * modulus, steps)?;
        strains.push([factor * modulus, stiffer.strain]);
        rows.push(stiffer.row(factor * modulus));
    }
    let order = -observed_order(&strains);
    out.compare_absolute("order_of_the_strain_in_1/k", order, 1.0, 0.1);
    out.table(Table {
        title: "Towards an inextensible yarn".to_owned(),
        columns: ["stretch modulus [Pa]", "strain of the length", "strain by tension", "shape error over sag"]
            .map(str::to_owned)
            .to_vec(),
        rows,
    });
    Ok(out)
}

/// A yarn that has come to rest.
struct Hung {
    off: f64,
    sag: f64,
    strain: f64,
    expected_strain: f64,
    parameter: f64,
    speed: f64,
}

impl Hung {
    fn row(&self, modulus: f64) -> Vec<String> {
        let off = self.off / self.sag;
        [modulus, self.strain, self.expected_strain, off].map(|x| format!("{x:.3e}")).to_vec()
    }
}

fn hang(modulus: f64, steps: usize) -> Result<Hung, CaseError> {
    let gravity = 98.0;
    let n = 41;
    let length = (n - 1) as f64 * SEGMENT;
    let span = 0.8 * length;
    let a = parameter(span, length);
    let points: Vec<Vec<f64>> = (0..n)
        .map(|i| {
            let s = -0.5 * length + length * i as f64 / (n - 1) as f64;
            vec![
                0.5 + a * (s / a).asinh(),
                0.7 + 0.95 * ((a * a + s * s).sqrt() - (a * a + 0.25 * length * length).sqrt()),
            ]
        })
        .collect();
    let mut settings = plane(
        YarnMaterial { stretch_modulus: modulus, ..material(0.05) },
        vec![polyline(points, vec![SEGMENT; n - 1], vec![])],
    );
    settings.plastic = false;
    settings.gravity = vec![0.0, -gravity];
    for vertex in [0, -1] {
        settings.pins.push(Pin {
            at: PinPlace::Vertex { yarn: 0, vertex },
            half_width: 1.5,
            half_size: vec![],
            motion: Motion::default(),
        });
    }
    let mut system = build(&settings)?;
    let dt = system.tightest_limit().map_or(5e-5, |l| l.seconds).min(5e-5);
    let steps = match steps {
        0 => (0.3 / dt).ceil() as usize,
        given => given,
    };
    // Damping of 4 % per millisecond, as in the reference.
    let damping = 0.998f64.powf(dt / 5e-5);
    for _ in 0..steps {
        system.advance(dt).map_err(CaseError::failed)?;
        for v in &mut system.state_mut().velocity {
            *v *= damping;
        }
    }
    // The pins clamp 1.5 cells, so that only the interior hangs freely.
    let x = &system.state().position[6..n - 6];
    let width = x[x.len() - 1][0] - x[0][0];
    let hanging: f64 = x.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
    let own = parameter(width, hanging);
    let middle = 0.5 * (x[0][0] + x[x.len() - 1][0]);
    let curve = |q: f64| own * ((q - middle) / own).cosh();
    let shift = x[0][1] - curve(x[0][0]);
    let lowest = x.iter().map(|q| q[1]).fold(f64::INFINITY, f64::min);
    let sag = x[0][1] - lowest;
    let off = x.iter().map(|q| (q[1] - shift - curve(q[0])).abs()).fold(0.0, f64::max);
    let strain = hanging / ((x.len() - 1) as f64 * SEGMENT) - 1.0;
    // Mean tension of a catenary of weight ρ w g per length: T = ρ w g y.
    let mean_height: f64 =
        x.windows(2).map(|w| 0.5 * (curve(w[0][0]) + curve(w[1][0]))).sum::<f64>() / (x.len() - 1) as f64;
    Ok(Hung {
        off,
        sag,
        strain,
        expected_strain: gravity * mean_height / modulus,
        parameter: own,
        speed: system.state().velocity.iter().map(|v| v.norm()).fold(0.0, f64::max),
    })
}

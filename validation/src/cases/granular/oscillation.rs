//! Moduli of a parameter set, mean over seeds, beside the original's where it has been run.

use crate::case::{Case, CaseError, Curve, Outcome, Param, Params, Table};
use granular::experiment::{Ensemble, Experiment, MicrogelSettings, Oscillation, run_ensemble};
use granular::experiment::{Measure, Rheometer};
use granular::model::{Mode, ModelSettings};
use granular::preparation::{Cut, PreparationSettings};
use granular::statistics::{Estimate, Welch, welch};

/// Case.
pub const CASE: Case = Case {
    id: "granular/oscillation",
    about: "G′ and G″ of a microgel under oscillatory shear, mean and standard deviation over seeds; in compat mode compared by \
            Welch's test with the original program where that parameter set has been run.",
    params: &[
        Param::number("amplitude", 0.2, "1", "strain amplitude"),
        Param::number("mu", 0.01, "1", "Coulomb coefficient of transient contacts"),
        Param::number("packing", 1.5, "1", "nominal packing"),
        Param::flag("links", true, "cross-links the sample before cutting it"),
        Param::count("cut_lines", 5, "Voronoi points that cut it into particles; 0 leaves one body"),
        Param::text("mode", "compat", "physical or compat"),
        Param::count("seeds", 2, "number of samples"),
        Param::count("first_seed", 1, "seed of the first sample"),
        Param::count("grains", 150, "number of grains; the box stays 500 µm wide"),
        Param::number("relative_frequency", 0.025, "1", "frequency times the characteristic time"),
        Param::number("step_factor", 0.0, "1", "factor on the published time step; 0 takes the mode's own"),
        Param::flag("lissajous", false, "draws the Lissajous curve of the first seed, at the cost of one more run"),
    ],
    run,
};

/// What the original's table varies.
#[derive(Clone, Copy, PartialEq)]
pub struct ParameterSet {
    pub amplitude: f64,
    pub mu: f64,
    pub packing: f64,
    pub links: bool,
    pub cut_lines: usize,
}

impl ParameterSet {
    /// Settings of a run with everything else at its default.
    pub fn settings(&self, mode: Mode, seeds: u32, first: u64) -> MicrogelSettings {
        MicrogelSettings {
            mode,
            seed: first,
            seeds,
            model: ModelSettings { friction: self.mu, packing: self.packing, ..ModelSettings::default() },
            preparation: PreparationSettings {
                links: self.links,
                cut: Cut::Voronoi { points: self.cut_lines, edge_fuzziness: 0.0 },
                ..PreparationSettings::default()
            },
            experiment: Experiment::Oscillation(Oscillation { amplitude: self.amplitude, ..Oscillation::default() }),
            ..MicrogelSettings::default()
        }
    }

    /// True if both describe the same samples: without links nothing is cut, and fewer than two points cut nothing.
    fn same(&self, o: &Self) -> bool {
        let cut = |s: &Self| if s.links && s.cut_lines > 1 { s.cut_lines } else { 0 };
        cut(self) == cut(o) && Self { cut_lines: 0, ..*self } == Self { cut_lines: 0, ..*o }
    }
}

/// One row of the original's results.
pub struct ReferenceSet {
    pub name: String,
    pub set: ParameterSet,
    pub g_prime: Estimate,
    pub g_double_prime: Estimate,
}

/// The parameter sets that the original has been run for.
pub fn reference_sets() -> Vec<ReferenceSet> {
    let text = include_str!("../../../data/granular/summary.csv");
    let mut lines = text.lines();
    let head: Vec<&str> = lines.next().unwrap_or("").split(',').collect();
    let at = |name: &str| head.iter().position(|h| *h == name).unwrap_or(usize::MAX);
    lines
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            let text = |name: &str| cells.get(at(name)).copied().unwrap_or("");
            let number = |name: &str| text(name).parse().unwrap_or(f64::NAN);
            let estimate = |mean: &str, sd: &str| Estimate {
                count: number("n") as usize,
                mean: number(mean),
                sd: number(sd),
                half_width: 0.0,
            };
            ReferenceSet {
                name: text("set").to_owned(),
                set: ParameterSet {
                    links: text("links") == "True",
                    mu: number("mu"),
                    amplitude: number("amplitude"),
                    packing: number("packing"),
                    cut_lines: number("cut_lines") as usize,
                },
                g_prime: estimate("Gp_overall_mean", "Gp_overall_sd"),
                g_double_prime: estimate("Gpp_overall_mean", "Gpp_overall_sd"),
            }
        })
        .collect()
}

impl ReferenceSet {
    /// Welch's test of an ensemble against this set, `[G′, G″]`.
    pub fn compare(&self, e: &Ensemble) -> [Welch; 2] {
        [welch(&e.g_prime, &self.g_prime), welch(&e.g_double_prime, &self.g_double_prime)]
    }
}

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let amplitude = p.number_in("amplitude", 1e-5, 10.0)?;
    let mu = p.number_in("mu", 0.0, 1000.0)?;
    let packing = p.number_in("packing", 0.1, 4.0)?;
    let links = p.flag("links")?;
    let points = p.count_in("cut_lines", 0, 10_000)?;
    let seeds = p.count_in("seeds", 1, 10_000)? as u32;
    let first = p.count("first_seed")? as u64;
    let grains = p.count_in("grains", 2, 1_000_000)?;
    let mode = match p.text("mode")? {
        "physical" => Mode::Physical,
        "compat" => Mode::Compat,
        _ => return Err(p.reject("mode", "physical or compat")),
    };
    let set = ParameterSet { amplitude, mu, packing, links, cut_lines: points };
    let mut settings = set.settings(mode, seeds, first);
    settings.model.grains = grains;
    settings.step_factor = p.number_in("step_factor", 0.0, 1000.0)?;
    let relative_frequency = p.number_in("relative_frequency", 1e-4, 0.25)?;
    settings.experiment =
        Experiment::Oscillation(Oscillation { amplitude, relative_frequency, ..Oscillation::default() });
    let e = run_ensemble(&settings, |_| {}).map_err(CaseError::failed)?;
    let mut out = Outcome::new();
    let standard = grains == 150 && settings.step_factor() == 1.0 && relative_frequency == 0.025;
    let known = reference_sets().into_iter().find(|r| r.set.same(&set));
    out.info("g_prime", e.g_prime.mean);
    out.info("g_double_prime", e.g_double_prime.mean);
    out.info("g_prime_sd", e.g_prime.sd);
    out.info("g_double_prime_sd", e.g_double_prime.sd);
    out.info("g_prime_half_width", e.g_prime.half_width);
    out.info("g_double_prime_half_width", e.g_double_prime.half_width);
    out.info("pressure", e.estimate(|s| s.pressure_before).mean);
    let surface = e.estimate(|s| s.segments[0].moduli[0].surface.g_prime);
    out.info("g_prime_surface", surface.mean);
    out.info("g_prime_overall", e.estimate(|s| s.segments[0].moduli[0].overall.g_prime).mean);
    out.info("links", e.estimate(|s| s.sample.links as f64).mean);
    out.info("particles", e.estimate(|s| s.sample.particles as f64).mean);
    let credible = e.runs.iter().filter(|s| s.credible()).count();
    out.info("credible_runs", credible as f64);
    out.measure("failed_runs", e.failed.len() as f64, |n| n == 0.0, "every seed runs to the end");
    let defect = e.runs.iter().fold(0.0f64, |m, s| m.max(s.identity_defect));
    out.compare("identity_defect", defect, 0.0, 1e-9);
    for (seed, reason) in &e.failed {
        out.note(format!("seed {seed}: {reason}"));
    }
    if let (Some(set), Mode::Compat, true, true) = (known, mode, standard, e.runs.len() > 1) {
        let [a, b] = set.compare(&e);
        // One per cent over the 22 comparisons of the table.
        let least = 0.01 / 22.0;
        out.measure("welch_p_g_prime", a.p, |v| v > least, "probability of such a difference by chance above 0.01/22");
        out.measure(
            "welch_p_g_double_prime",
            b.p,
            |v| v > least,
            "probability of such a difference by chance above 0.01/22",
        );
        out.table(Table {
            title: format!("Original, set {}", set.name),
            columns: ["", "original [Pa]", "here [Pa]", "p"].map(String::from).to_vec(),
            rows: [("G′", set.g_prime, e.g_prime, a.p), ("G″", set.g_double_prime, e.g_double_prime, b.p)]
                .into_iter()
                .map(|(name, r, m, p)| {
                    vec![
                        name.to_owned(),
                        format!("{:.1} ± {:.1} (n {})", r.mean, r.sd, r.count),
                        format!("{:.1} ± {:.1} (n {})", m.mean, m.sd, m.count),
                        format!("{p:.3}"),
                    ]
                })
                .collect(),
        });
    }
    if p.flag("lissajous")? {
        out.curve(lissajous(&MicrogelSettings { seeds: 1, ..settings })?);
    }
    Ok(out)
}

/// Stress against strain of the first seed.
fn lissajous(settings: &MicrogelSettings) -> Result<Curve, CaseError> {
    let mut rheometer = Rheometer::new(settings).map_err(CaseError::failed)?;
    let mut rows = Vec::new();
    let measure = match settings.mode {
        Mode::Compat => Measure::Overall,
        Mode::Physical => Measure::Bulk,
    };
    rheometer
        .run(|row| {
            if row.index % 16 == 0 && row.rate != 0.0 {
                let stress = if measure == Measure::Bulk { row.stress.bulk } else { row.stress.overall };
                rows.push([row.strain, stress.shear()]);
            }
        })
        .map_err(CaseError::failed)?;
    Ok(Curve {
        title: "Lissajous curve of the first seed".into(),
        x_label: "strain [-]".into(),
        y_label: "shear stress [Pa]".into(),
        log_x: false,
        log_y: false,
        series: vec![("overall".into(), rows)],
    })
}

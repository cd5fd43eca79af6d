//! Runs one parameter set over several seeds and prints the moduli:
//! `oscillation MODE LINKS MU AMPLITUDE PACKING CUT_LINES SEEDS [FIRST_SEED]`.

use granular::experiment::{Experiment, MicrogelSettings, Oscillation, run_ensemble};
use granular::model::{Mode, ModelSettings};
use granular::preparation::{Cut, PreparationSettings};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let a: Vec<String> = std::env::args().collect();
    let number = |i: usize| a.get(i).ok_or("missing argument").map(|v| v.parse::<f64>());
    let settings = MicrogelSettings {
        mode: if a.get(1).is_some_and(|m| m == "compat") { Mode::Compat } else { Mode::Physical },
        seed: a.get(8).map_or(Ok(1), |s| s.parse())?,
        seeds: number(7)?? as u32,
        model: ModelSettings { friction: number(3)??, packing: number(5)??, ..ModelSettings::default() },
        preparation: PreparationSettings {
            links: number(2)?? != 0.0,
            cut: Cut::Voronoi { points: number(6)?? as usize, edge_fuzziness: 0.0 },
            ..PreparationSettings::default()
        },
        experiment: Experiment::Oscillation(Oscillation { amplitude: number(4)??, ..Oscillation::default() }),
        ..MicrogelSettings::default()
    };
    let start = std::time::Instant::now();
    let e = run_ensemble(&settings, |_| {})?;
    let seconds = start.elapsed().as_secs_f64();
    let show = |name: &str, f: &dyn Fn(&granular::experiment::Summary) -> f64| {
        let v = e.estimate(f);
        println!("{name:>16} {:10.3} ± {:8.3} (n {})", v.mean, v.sd, v.count);
    };
    show("G' overall", &|s| s.segments[0].moduli[0].overall.g_prime);
    show("G'' overall", &|s| s.segments[0].moduli[0].overall.g_double_prime);
    show("G' surface", &|s| s.segments[0].moduli[0].surface.g_prime);
    show("G'' surface", &|s| s.segments[0].moduli[0].surface.g_double_prime);
    show("G' bulk", &|s| s.segments[0].moduli[0].bulk.g_prime);
    show("G'' bulk", &|s| s.segments[0].moduli[0].bulk.g_double_prime);
    show("pressure", &|s| s.pressure_before);
    show("links", &|s| s.sample.links as f64);
    show("particles", &|s| s.sample.particles as f64);
    show("slip", &|s| s.slip_fraction);
    show("identities", &|s| s.identity_defect);
    show("steps", &|s| s.steps as f64);
    show("extra steps", &|s| s.extra_steps as f64);
    println!("{:?} {seconds:.1} s", e.failed);
    Ok(())
}

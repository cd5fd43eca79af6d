//! Grain-steps and contacts per second of processor time: `speed GRAINS STEPS [compat]`.

use granular::assembly::Assembly;
use granular::cell::Cell;
use granular::model::{Mode, ModelSettings};
use granular::physical::Rules;
use granular::preparation::random_packing;
use granular::random::Random;

/// Processor time of this thread [s] where the system tells it, else wall-clock time; with several threads wall-clock time.
fn clock(origin: &std::time::Instant) -> f64 {
    let alone = std::env::var("RAYON_NUM_THREADS").is_ok_and(|n| n == "1");
    std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .filter(|_| alone)
        .and_then(|t| t.split_whitespace().next()?.parse::<f64>().ok())
        .map_or_else(|| origin.elapsed().as_secs_f64(), |ns| ns * 1e-9)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let a: Vec<String> = std::env::args().collect();
    let (grains, steps): (usize, u32) = (a.get(1).ok_or("GRAINS")?.parse()?, a.get(2).ok_or("STEPS")?.parse()?);
    let mode = if a.get(3).is_some_and(|m| m == "compat") { Mode::Compat } else { Mode::Physical };
    let side = 500.0 * (grains as f64 / 150.0).sqrt();
    let settings = ModelSettings { grains, width: side, height: side, ..ModelSettings::default() };
    let discs = random_packing(&settings, mode, &mut Random::new(1));
    let mut rules = Rules::default();
    if let Some(skin) = a.get(4) {
        rules.skin = skin.parse()?;
    }
    let mut s = Assembly::new(mode, &discs, Cell::new(side, side), settings.contact_model(), rules, 1)?;
    let tau = settings.constants().time;
    for _ in 0..300 {
        s.advance(0.1 * tau, 0.5, true, false)?;
    }
    s.set_rate(2e-2 / tau);
    let rebuilds = |s: &Assembly| if let Assembly::Undirected(s) = s { s.counters() } else { (0, 0) };
    let before = rebuilds(&s);
    let mut best = f64::MAX;
    let mut report = s.advance(tau / 56.0, 0.9997, true, true)?;
    let origin = std::time::Instant::now();
    for _ in 0..10 {
        let start = clock(&origin);
        for _ in 0..steps.div_ceil(10) {
            report = s.advance(tau / 56.0, 0.9997, true, true)?;
        }
        best = best.min((clock(&origin) - start) / f64::from(steps.div_ceil(10)));
    }
    let after = rebuilds(&s);
    println!(
        "{grains} grains, {} contacts: {:.1} us a step, {:.2} million grain-steps/s, {:.2} million contacts/s, {} steps a rebuild, {} extra, identities {:.1e}",
        report.contacts,
        best * 1e6,
        grains as f64 / best * 1e-6,
        f64::from(report.contacts) / best * 1e-6,
        u64::from(steps) / (after.0 - before.0).max(1),
        after.1,
        report.stress.identity_defect(),
    );
    Ok(())
}

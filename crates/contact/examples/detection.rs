//! CPU seconds of detection in bundles of 5,617, 22,468 and 89,872 vertices: `detection [REPEATS]`.
//!
//! Counts the processor time of all threads (from `/proc`, so only where that exists), which a loaded machine does not distort.

use contact::detection::{DetectionSettings, Detector};
use contact::families::bundle;

/// Processor time of this process so far [s], in ticks of a hundredth.
fn cpu_seconds() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    let mut fields = stat.rsplit_once(')')?.1.split_whitespace().skip(11);
    Some((fields.next()?.parse::<f64>().ok()? + fields.next()?.parse::<f64>().ok()?) / 100.0)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let repeats: usize = std::env::args().nth(1).and_then(|a| a.parse().ok()).unwrap_or(5);
    for strands in [137, 548, 2192] {
        let b = bundle(strands, 41);
        let (mut detector, mut contacts) = (Detector::default(), Vec::new());
        let settings = DetectionSettings::default();
        let report = detector.detect(&b.strands(), None, &[], &settings, &mut contacts)?;
        let repeats = repeats * 2192 / strands;
        let begin = cpu_seconds();
        for _ in 0..repeats {
            detector.forget();
            detector.detect(&b.strands(), None, &[], &settings, &mut contacts)?;
        }
        let seconds = cpu_seconds().zip(begin).map(|(now, then)| (now - then) / repeats as f64);
        println!(
            "{} vertices: {} candidates, {} found, {} kept, {:.4} CPU s, {:.2} µs per contact kept",
            strands * 41,
            report.candidates,
            report.found,
            report.kept,
            seconds.unwrap_or(f64::NAN),
            1e6 * seconds.unwrap_or(f64::NAN) / report.kept.max(1) as f64
        );
    }
    Ok(())
}

//! Moduli from stress signals: a made one with known answer, and the run published by the authors of the method.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::case::{Case, CaseError, Outcome, Param, Params};
use granular::demodulation::{Drift, Window, demodulate};

/// Synthetic signal.
pub const SYNTHETIC: Case = Case {
    id: "granular/demodulation-synthetic",
    about: "A made stress signal with drift: the right sign of the correction recovers the moduli, the published sign doubles the \
            drift and misses G′ by 2·drift/(π A f).",
    params: &[
        Param::number("g_prime", 1000.0, "Pa", "true storage modulus"),
        Param::number("g_double_prime", 150.0, "Pa", "true loss modulus"),
        Param::number("drift", 10.0, "Pa per period", "drift of the stress"),
        Param::number("amplitude", 0.2, "1", "strain amplitude"),
        Param::count("samples", 2240, "samples per period"),
    ],
    run: synthetic,
};

fn synthetic(p: &Params) -> Result<Outcome, CaseError> {
    let (g1, g2, drift) = (p.number("g_prime")?, p.number("g_double_prime")?, p.number("drift")?);
    let amplitude = p.positive("amplitude")?;
    let samples = p.count_in("samples", 100, 100_000)?;
    let w = Window { frequency: 1.0, amplitude, pre: 2.0, periods: 3.0, post: 1.0 };
    let t: Vec<f64> = (0..6 * samples).map(|i| i as f64 / samples as f64).collect();
    let stress: Vec<f64> = t
        .iter()
        .map(|&t| {
            let (s, c) = (std::f64::consts::TAU * (t - 2.0)).sin_cos();
            drift * t + if (2.0..=5.0).contains(&t) { amplitude * (g1 * s + g2 * c) } else { 0.0 }
        })
        .collect();
    let of = |d| demodulate(&t, &stress, &w, d).map_err(CaseError::failed);
    let (right, kept, doubled) = (of(Drift::Subtract)?, of(Drift::Keep)?, of(Drift::Double)?);
    let shift = drift / (std::f64::consts::PI * amplitude);
    let scale = g1.abs().max(g2.abs()).max(shift.abs());
    // Both ends of the window are samples: one sample of drift and of the sine is left over.
    let tolerance = 4.0 * scale / samples as f64;
    let mut out = Outcome::new();
    out.compare_absolute("g_prime", right.g_prime, g1, tolerance);
    out.compare_absolute("g_double_prime", right.g_double_prime, g2, tolerance);
    out.compare_absolute("g_prime_uncorrected", kept.g_prime, g1 - shift, tolerance);
    out.compare_absolute("g_prime_compat", doubled.g_prime, g1 - 2.0 * shift, 2.0 * tolerance);
    Ok(out)
}

/// Published run.
pub const CASE: Case = Case {
    id: "granular/demodulation",
    about: "Demodulates the stress of a run published by the method's authors: with the published sign of the drift to all printed \
            digits, with the right sign to the corrected values. Skipped where the run's files are absent.",
    params: &[],
    run: published,
};

fn folder() -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    match std::env::var_os("VISCOSE_REFERENCE") {
        Some(dir) => PathBuf::from(dir),
        None => root.join("../shared/reference"),
    }
    .join("particleshear/published-run")
}

/// Reads the table, unpacking it with gzip where only the packed file is there.
fn read_table(dir: &Path) -> Result<String, String> {
    let plain = dir.join("particleshear_example_stress.csv");
    if let Ok(text) = std::fs::read_to_string(&plain) {
        return Ok(text);
    }
    let packed = dir.join("particleshear_example_stress.csv.gz");
    if !packed.is_file() {
        return Err(format!(
            "the published run is not in {}; name the folder of the reference data by VISCOSE_REFERENCE",
            dir.display()
        ));
    }
    let output =
        Command::new("gzip").arg("-dc").arg(&packed).output().map_err(|e| format!("gzip cannot be run: {e}"))?;
    if !output.status.success() {
        return Err("gzip could not unpack the published run".to_owned());
    }
    String::from_utf8(output.stdout).map_err(|e| e.to_string())
}

fn published(_: &Params) -> Result<Outcome, CaseError> {
    let mut out = Outcome::new();
    let text = match read_table(&folder()) {
        Ok(text) => text,
        Err(reason) => {
            out.skip(reason);
            return Ok(out);
        }
    };
    let mut lines = text.lines();
    let head: Vec<&str> = lines.next().unwrap_or("").split(',').map(str::trim).collect();
    let column =
        |name: &str| head.iter().position(|h| *h == name).ok_or_else(|| CaseError::Failed(format!("no column {name}")));
    let rows: Vec<Vec<f64>> =
        lines.map(|l| l.split(',').map(|v| v.trim().parse().unwrap_or(f64::NAN)).collect()).collect();
    let take = |c: usize| rows.iter().map(|r| r.get(c).copied().unwrap_or(f64::NAN)).collect::<Vec<f64>>();
    let t = take(column("t")?);
    let overall = take(column("shear_stress_internal_stress.tensor")?);
    let surface = take(column("stress_measured_at_surface")?);
    // Frequency, amplitude and periods as printed in the run's header.
    let w = Window { frequency: 990.8318244015028, amplitude: 0.3, pre: 2.0, periods: 3.0, post: 1.0 };
    for (drift, name, values, tolerance) in [
        (
            Drift::Double,
            "compat",
            [383.68439383680135, 424.23230663955445, 166.30952072861956, 700.2552485340161],
            1e-9,
        ),
        (Drift::Subtract, "physical", [396.1820, 424.2148, 161.6628, 700.2618], 2e-7),
    ] {
        for (k, (stress, measure)) in [(&overall, "overall"), (&surface, "surface")].into_iter().enumerate() {
            let d = demodulate(&t, stress, &w, drift).map_err(CaseError::failed)?;
            out.compare(&format!("{name}_g_prime_{measure}"), d.g_prime, values[2 * k], tolerance);
            out.compare(&format!("{name}_g_double_prime_{measure}"), d.g_double_prime, values[2 * k + 1], tolerance);
        }
    }
    // Identities of the published tensors: overall = Love–Weber + internal torque + centrifugal.
    let tensor = |name: &str| column(&format!("stress_tensor_{name}_00"));
    let (o, l, i, c) =
        (tensor("overall")?, tensor("Love_Weber")?, tensor("internal_tangential_torque")?, tensor("centrifugal")?);
    let defect = rows
        .iter()
        .fold(0.0f64, |m, r| (0..4).fold(m, |m, k| m.max((r[o + k] - r[l + k] - r[i + k] - r[c + k]).abs())));
    out.compare("identity_defect", defect, 0.0, 1e-12);
    out.info("samples", rows.len() as f64);
    Ok(out)
}

//! `viscose material NAME`: a material in numbers, with its flow curve.

use clap::Args;
use constitutive::presets::{LIQUID_NAMES, Liquid};
use constitutive::summary::{describe, logarithmic_rates};
use miette::IntoDiagnostic;
use runner::scene::error::suggest;

use super::Exit;
use crate::out::{say, say_on};

/// Arguments of `viscose material`.
#[derive(Args)]
pub struct Material {
    /// Name of a liquid, such as `shaving-cream` [default: all, a line each].
    pub name: Option<String>,
    /// Draw the flow curve in characters: stress `o`, viscosity `·`, against shear rate.
    #[arg(long)]
    pub plot: bool,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
    /// Lowest and highest shear rate [1/s].
    #[arg(long, num_args = 2, value_names = ["LOW", "HIGH"], default_values_t = [1e-3, 1e3])]
    pub rates: Vec<f64>,
}

impl Material {
    /// Prints the material.
    pub fn run(self) -> miette::Result<Exit> {
        let &[low, high] = self.rates.as_slice() else {
            return Err(miette::miette!("--rates: expected two shear rates"));
        };
        if !(low > 0.0 && high > low && high.is_finite()) {
            return Err(miette::miette!("--rates {low} {high}: expected 0 < low < high [1/s]"));
        }
        let rates = logarithmic_rates(low, high, 25);
        let names: Vec<&str> = match &self.name {
            Some(name) => vec![name],
            None => LIQUID_NAMES.to_vec(),
        };
        for name in names {
            let liquid = Liquid::preset(name)
                .map_err(|error| miette::miette!(help = suggest(name, "liquid", &LIQUID_NAMES), "{error}"))?;
            let summary = describe(name, &liquid, &rates).into_diagnostic()?;
            if self.json {
                say!("{}", serde_json::to_string(&summary).into_diagnostic()?);
            } else if self.name.is_none() {
                let kind = if summary.compressible { "compressible" } else { "incompressible" };
                say!("{name:20} {:14} {}", kind, summary.class.name());
            } else {
                say_on!("{}", summary.text());
                if self.plot {
                    say_on!("{}", summary.plot(72, 20));
                }
            }
        }
        Ok(Exit::Done)
    }
}

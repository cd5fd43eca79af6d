//! `viscose plan SCENE`: which stages run, why, and what is switched off or absent.

use std::path::PathBuf;

use clap::Args;

use super::Exit;
use crate::out::{say, say_on};

/// Arguments of `viscose plan`.
#[derive(Args)]
pub struct Plan {
    /// Scene file (RON).
    pub scene: PathBuf,
    /// Override a field of the scene.
    #[arg(long = "set", value_name = "PATH=VALUE")]
    pub set: Vec<String>,
}

impl Plan {
    /// Prints the plan.
    pub fn run(self) -> miette::Result<Exit> {
        let loaded = runner::scene::load(&self.scene, &self.set)?;
        let plan = runner::plan::Plan::for_scene(&loaded.scene)?;
        let estimate = runner::prepare::estimate(&loaded.scene)?;
        let particles = estimate.liquid.map_or(0.0, |liquid| liquid.particles);
        say_on!("{}", plan.with_cost(estimate.vertices as f64, particles));
        say!("{estimate}");
        Ok(Exit::Done)
    }
}

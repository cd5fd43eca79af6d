//! One straight strand for the film cases.

use constitutive::Liquid;
use nalgebra::Vector3;
use surface_flow::{FilmLiquid, FilmSettings, FilmSolver, StrandSlices};

use crate::case::{CaseError, Params};

/// A straight strand along x with circular cross-section.
pub struct Strand {
    edge_length: Vec<f64>,
    tangent: Vec<Vector3<f64>>,
    semi_axes: Vec<[f64; 2]>,
    acceleration: Vec<Vector3<f64>>,
}

impl Strand {
    /// A strand with edges of the lengths that `length` gives [m].
    pub fn new(vertices: usize, radius: f64, length: impl Fn(usize) -> f64) -> Self {
        Strand {
            edge_length: (0..vertices - 1).map(length).collect(),
            tangent: vec![Vector3::x(); vertices - 1],
            semi_axes: vec![[radius; 2]; vertices],
            acceleration: vec![Vector3::zeros(); vertices],
        }
    }

    pub fn view(&self) -> StrandSlices<'_> {
        StrandSlices {
            edge_length: &self.edge_length,
            tangent: &self.tangent,
            semi_axes: &self.semi_axes,
            acceleration: &self.acceleration,
        }
    }

    pub fn edge_length(&self) -> &[f64] {
        &self.edge_length
    }
}

/// The preset named by the parameter `material`.
pub fn preset(p: &Params) -> Result<Liquid, CaseError> {
    Liquid::preset(p.text("material")?).map_err(|_| {
        p.reject("material", &format!("the name of a liquid: {}", constitutive::presets::LIQUID_NAMES.join(", ")))
    })
}

pub fn solver(liquid: &Liquid, settings: FilmSettings) -> Result<FilmSolver, CaseError> {
    let liquid = FilmLiquid::new(liquid).map_err(CaseError::failed)?;
    FilmSolver::new(liquid, settings).map_err(CaseError::failed)
}

//! What does not change during a run: topology, masses, rest lengths, materials.

use constitutive::yarn::{YarnForm, YarnLaw};
use nalgebra::{SMatrix, SVector};

use crate::YarnError;
use crate::error::YarnWarning;
use crate::generate::Strand;
use crate::report::Ledger;
use crate::settings::{Bending, YarnSettings};
use crate::state::YarnState;

/// Bending of one material, with its stiffness settled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BendingLaw {
    /// None.
    None,
    /// Discrete rod of this stiffness [N m²].
    Rod(f64),
    /// Spring between vertices two apart [N/m].
    Spring(f64),
}

/// One material, ready for use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Law of a quadrature point.
    pub law: YarnLaw,
    /// Density [kg/m³].
    pub density: f64,
    /// Width or diameter [m].
    pub width: f64,
    /// Bending.
    pub bending: BendingLaw,
}

/// The unchanging part of a system. Arrays have one entry per vertex; a segment's entry stands at its first vertex.
#[derive(Clone, Debug)]
pub struct YarnModel<const D: usize> {
    /// First vertex of each yarn, and the number of vertices at the end.
    pub yarn_start: Vec<usize>,
    /// Material of each vertex and segment.
    pub material: Vec<u16>,
    /// Rest length of each segment [m]; zero at the last vertex of a yarn, where no segment starts.
    pub rest_length: Vec<f64>,
    /// Reference volume of each segment [m³].
    pub volume: Vec<f64>,
    /// Mass carried by each vertex [kg].
    pub vertex_mass: Vec<f64>,
    /// Mass carried by each quadrature point [kg].
    pub quadrature_mass: Vec<f64>,
    /// Materials.
    pub materials: Vec<Material>,
    /// Initial rotations of segments: only for the printed note's world-axis frames.
    pub(crate) world_frame: Option<Vec<SMatrix<f64, D, D>>>,
    /// Edge of a cell [m].
    pub cell: f64,
    /// Mean mass of a vertex [kg].
    pub mean_mass: f64,
}

impl<const D: usize> YarnModel<D> {
    /// Number of vertices.
    #[must_use]
    pub fn len(&self) -> usize {
        self.material.len()
    }

    /// Whether there are no yarns.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.material.is_empty()
    }

    /// Number of yarns.
    #[must_use]
    pub fn yarn_count(&self) -> usize {
        self.yarn_start.len() - 1
    }

    /// Whether a segment starts at vertex `i`.
    #[inline(always)]
    #[must_use]
    pub fn has_segment(&self, i: usize) -> bool {
        self.rest_length[i] > 0.0
    }

    /// Whether vertex `i` lies between two segments.
    #[inline(always)]
    #[must_use]
    pub fn is_inner(&self, i: usize) -> bool {
        i > 0 && self.has_segment(i - 1) && self.has_segment(i)
    }

    /// Mass of vertex `i` with its share of the quadrature points beside it [kg].
    #[inline(always)]
    #[must_use]
    pub fn lumped_mass(&self, i: usize) -> f64 {
        let left = if i > 0 { self.quadrature_mass[i - 1] } else { 0.0 };
        self.vertex_mass[i] + 0.5 * (left + self.quadrature_mass[i])
    }

    /// Yarn and vertex along it of a vertex number.
    #[must_use]
    pub fn locate(&self, i: usize) -> (usize, usize) {
        let yarn = self.yarn_start.partition_point(|&s| s <= i) - 1;
        (yarn, i - self.yarn_start[yarn])
    }

    /// Vertex number of a vertex along a yarn; negative counts from the end.
    ///
    /// # Errors
    /// Where there is no such yarn or vertex.
    pub fn vertex(&self, setting: &str, yarn: usize, vertex: i64) -> Result<usize, YarnError> {
        if yarn >= self.yarn_count() {
            return Err(YarnError::setting(
                setting,
                format!("there is no yarn {yarn}: there are {}", self.yarn_count()),
            ));
        }
        let (start, end) = (self.yarn_start[yarn] as i64, self.yarn_start[yarn + 1] as i64);
        let index = if vertex < 0 { end + vertex } else { start + vertex };
        if (start..end).contains(&index) {
            return Ok(index as usize);
        }
        Err(YarnError::setting(setting, format!("yarn {yarn} has no vertex {vertex}: it has {}", end - start)))
    }

    /// Total mass [kg].
    #[must_use]
    pub fn total_mass(&self) -> f64 {
        numerics::reduce::compensated_sum(self.vertex_mass.iter().chain(&self.quadrature_mass).copied())
    }

    /// Builds model, initial state and warnings.
    ///
    /// # Errors
    /// The first setting that is wrong.
    pub(crate) fn build(settings: &YarnSettings) -> Result<(Self, YarnState<D>, Vec<YarnWarning>), YarnError> {
        let cell = settings.cell;
        let names: Vec<&String> = settings.materials.keys().collect();
        let mut model = Self {
            yarn_start: vec![0],
            material: Vec::new(),
            rest_length: Vec::new(),
            volume: Vec::new(),
            vertex_mass: Vec::new(),
            quadrature_mass: Vec::new(),
            materials: Vec::new(),
            world_frame: None,
            cell,
            mean_mass: 0.0,
        };
        let (mut position, mut velocity) = (Vec::new(), Vec::new());
        let mut warnings = Vec::new();
        for (g, group) in settings.yarns.iter().enumerate() {
            let path = format!("yarns[{g}]");
            let Some(material) = names.iter().position(|n| **n == group.material) else {
                return Err(YarnError::setting(
                    format!("{path}.material"),
                    format!("there is no material `{}`; there are {names:?}", group.material),
                ));
            };
            for strand in group.build::<D>(&path, cell)? {
                let yarn = model.yarn_count();
                let longest = strand.rest.iter().fold(0.0f64, |a, &b| a.max(b)) / cell;
                let shortest = strand.rest.iter().fold(f64::INFINITY, |a, &b| a.min(b)) / cell;
                if longest > 1.5 {
                    return Err(YarnError::setting(
                        path,
                        format!(
                            "a segment of yarn {yarn} is {longest:.3} cells long; more than 1.5 share too few nodes"
                        ),
                    ));
                }
                if longest > 1.0 {
                    warnings.push(YarnWarning::LongSegments { yarn, ratio: longest });
                }
                if shortest < 0.25 {
                    warnings.push(YarnWarning::ShortSegments { yarn, ratio: shortest });
                }
                model.push(&strand, material as u16);
                position.extend_from_slice(&strand.points);
                velocity.extend_from_slice(&strand.velocity);
            }
        }
        if model.is_empty() {
            return Err(YarnError::setting("yarns", "needs at least one yarn"));
        }
        if settings.quadrature_mass_share == 0.0 {
            warnings.push(YarnWarning::MasslessQuadrature);
        }
        model.settle_materials(settings)?;
        model.settle_masses(settings);
        let deformation = model.initial_deformation(settings, &position)?;
        let n = model.len();
        let state = YarnState {
            time: 0.0,
            step: 0,
            position,
            velocity,
            affine: vec![SMatrix::zeros(); n],
            quadrature_affine: vec![SMatrix::zeros(); n],
            deformation,
            slip: vec![0.0; n],
            ledger: Ledger::default(),
        };
        Ok((model, state, warnings))
    }

    fn push(&mut self, strand: &Strand<D>, material: u16) {
        let n = strand.points.len();
        self.material.extend(std::iter::repeat_n(material, n));
        self.rest_length.extend_from_slice(&strand.rest);
        self.rest_length.push(0.0);
        self.yarn_start.push(self.material.len());
    }

    fn settle_materials(&mut self, settings: &YarnSettings) -> Result<(), YarnError> {
        let form = if settings.compat { YarnForm::Printed } else { YarnForm::Corrected };
        for material in settings.materials.values() {
            self.materials.push(Material {
                law: material.law(settings.min_section, form),
                density: material.density,
                width: material.width(self.cell),
                bending: BendingLaw::None,
            });
        }
        let areas: Vec<f64> = settings.materials.values().map(|m| m.area(self.cell, D)).collect();
        self.volume = (0..self.len()).map(|i| self.rest_length[i] * areas[self.material[i] as usize]).collect();
        // Mean segment of the scene, for the note's default spring.
        let count = self.rest_length.iter().filter(|l| **l > 0.0).count().max(1) as f64;
        let mean_volume = self.volume.iter().sum::<f64>() / count;
        let mean_length = self.rest_length.iter().sum::<f64>() / count;
        for (material, given) in self.materials.iter_mut().zip(settings.materials.values()) {
            let along = given.stretch_modulus * mean_volume / (mean_length * mean_length);
            let solid = given.solid_bending_stiffness(self.cell, D);
            material.bending = match given.bending {
                Bending::None => BendingLaw::None,
                // The printed note knows springs only.
                Bending::Rod { .. } | Bending::RodShare { .. } if settings.compat => BendingLaw::Spring(0.05 * along),
                Bending::Rod { stiffness } => BendingLaw::Rod(stiffness.unwrap_or(0.01 * solid)),
                Bending::RodShare { share } => BendingLaw::Rod(share * solid),
                Bending::Spring { stiffness } => BendingLaw::Spring(stiffness.unwrap_or(0.05 * along)),
                Bending::SpringShare { share } => BendingLaw::Spring(share * along),
            };
            if matches!(material.bending, BendingLaw::Rod(b) | BendingLaw::Spring(b) if b == 0.0) {
                material.bending = BendingLaw::None;
            }
        }
        Ok(())
    }

    fn settle_masses(&mut self, settings: &YarnSettings) {
        let share = settings.quadrature_mass_share;
        let n = self.len();
        let mass: Vec<f64> =
            (0..n).map(|i| self.materials[self.material[i] as usize].density * self.volume[i]).collect();
        self.quadrature_mass = mass.iter().map(|m| share * m).collect();
        self.vertex_mass = (0..n)
            .map(|i| {
                let left = if i > 0 { mass[i - 1] - self.quadrature_mass[i - 1] } else { 0.0 };
                0.5 * (left + (mass[i] - self.quadrature_mass[i]))
            })
            .collect();
        self.mean_mass = self.total_mass() / n as f64;
    }

    /// `F` of each segment: the yarn's own frame, the edge stretched by its length over the rest length.
    fn initial_deformation(
        &mut self,
        settings: &YarnSettings,
        position: &[SVector<f64, D>],
    ) -> Result<Vec<SMatrix<f64, D, D>>, YarnError> {
        let mut deformation = vec![SMatrix::<f64, D, D>::identity(); self.len()];
        let mut frames = vec![SMatrix::<f64, D, D>::identity(); self.len()];
        for yarn in 0..self.yarn_count() {
            let mut previous: Option<SMatrix<f64, D, D>> = None;
            for i in self.yarn_start[yarn]..self.yarn_start[yarn + 1] - 1 {
                let edge = position[i + 1] - position[i];
                let length = edge.norm();
                if !(length > 1e-9 * self.rest_length[i] && length.is_finite()) {
                    let vertex = i - self.yarn_start[yarn];
                    return Err(YarnError::setting(
                        "yarns",
                        format!("segment {vertex} of yarn {yarn} starts with no length"),
                    ));
                }
                let frame = next_frame(previous.as_ref(), &(edge / length));
                previous = Some(frame);
                frames[i] = frame;
                deformation[i] = frame;
                deformation[i].set_column(0, &(edge / self.rest_length[i]));
            }
        }
        if settings.compat {
            self.world_frame = Some(frames);
        }
        Ok(deformation)
    }
}

/// Orthonormal frame whose first column is the unit tangent; the others are carried along the yarn without twist.
fn next_frame<const D: usize>(previous: Option<&SMatrix<f64, D, D>>, tangent: &SVector<f64, D>) -> SMatrix<f64, D, D> {
    let mut frame = SMatrix::<f64, D, D>::zeros();
    frame.set_column(0, tangent);
    if D == 2 {
        frame[(0, 1)] = -tangent[1];
        frame[(1, 1)] = tangent[0];
        return frame;
    }
    let mut normal = SVector::<f64, D>::zeros();
    let mut usable = false;
    if let Some(previous) = previous {
        let carried: SVector<f64, D> = previous.column(1).into_owned();
        normal = carried - tangent * tangent.dot(&carried);
        usable = normal.norm() > 0.1;
    }
    if !usable {
        let mut least = 0;
        for i in 1..D {
            if tangent[i].abs() < tangent[least].abs() {
                least = i;
            }
        }
        normal = -tangent * tangent[least];
        normal[least] += 1.0;
    }
    normal /= normal.norm();
    frame.set_column(1, &normal);
    for i in 0..D {
        let (j, k) = ((i + 1) % D, (i + 2) % D);
        frame[(i, D - 1)] = tangent[j] * normal[k] - tangent[k] * normal[j];
    }
    frame
}

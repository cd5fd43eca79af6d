//! Vertices that a scene follows step by step.

use rods::RodSet;

use super::BuildError;
use crate::scene::Scene;
use crate::scene::output::Probe as Described;
use crate::system::Column;

/// Something followed step by step.
#[derive(Clone, Debug, PartialEq)]
pub struct Probe {
    /// Name of its columns.
    pub name: String,
    /// Vertex in the whole set.
    pub vertex: usize,
}

/// The probes of a scene that follow vertices; points in the liquid are followed by the liquid.
///
/// # Errors
/// When a probe points at a strand, a vertex or a liquid that is not there.
pub fn build(scene: &Scene, rods: &RodSet) -> Result<Vec<Probe>, BuildError> {
    let probes = scene.output.probes.iter().enumerate();
    probes
        .filter(|(_, probe)| scene.liquid.is_none() || !matches!(probe, Described::Point(_)))
        .map(|(index, probe)| one(probe, index, rods))
        .collect()
}

fn one(probe: &Described, index: usize, rods: &RodSet) -> Result<Probe, BuildError> {
    let refuse = |what: String| BuildError::Probe { index, what };
    match probe {
        Described::Vertex(v) => {
            if v.strand >= rods.strand_count() {
                let count = rods.strand_count();
                return Err(refuse(format!("there is no strand {}; the scene has {count} strands, from 0", v.strand)));
            }
            let range = rods.vertices(v.strand);
            let vertex = v.vertex.unwrap_or(range.len() - 1);
            if vertex >= range.len() {
                let count = range.len();
                return Err(refuse(format!("strand {} has no vertex {vertex}; it has {count}, from 0", v.strand)));
            }
            let name = v.name.clone().unwrap_or_else(|| format!("strand{}_vertex{vertex}", v.strand));
            Ok(Probe { name, vertex: range.start + vertex })
        }
        Described::Point(_) => Err(refuse("a point in space probes liquid, and the scene has none".to_owned())),
        Described::Yarn(_) => Err(refuse("a vertex of a yarn is probed, and the scene has no yarns".to_owned())),
    }
}

impl Probe {
    /// The columns of the probe.
    pub fn columns(&self, columns: &mut Vec<Column>) {
        for (part, unit, meaning) in [
            ("x", "m", "probe position"),
            ("y", "m", "probe position"),
            ("z", "m", "probe position"),
            ("vx", "m/s", "probe velocity"),
            ("vy", "m/s", "probe velocity"),
            ("vz", "m/s", "probe velocity"),
        ] {
            columns.push(Column::new(format!("{}_{part}", self.name), unit, meaning));
        }
    }

    /// Its values.
    pub fn row(&self, rods: &RodSet, out: &mut Vec<f64>) {
        out.extend(rods.position[self.vertex].iter());
        out.extend(rods.velocity[self.vertex].iter());
    }
}

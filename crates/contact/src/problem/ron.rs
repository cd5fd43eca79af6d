//! Contact problems in RON: what a scene dumps when a solve fails, and what `viscose replay` reads.

use super::{BlockMatrix, ContactProblem, ProblemError};
use crate::block::{Block, ZERO};
use serde::{Deserialize, Serialize};

/// The file form: plain lists in contact order, blocks row by row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProblemFile {
    /// 2 or 3.
    pub dimension: usize,
    /// Free velocities [m/s], `dimension` numbers a contact, normal first.
    pub free_velocity: Vec<f64>,
    /// Coulomb coefficients, negative for bilateral contacts.
    pub friction: Vec<f64>,
    /// Cohesive impulse bounds [N s]; empty for none.
    #[serde(default)]
    pub cohesion: Vec<f64>,
    /// Blocks of the Delassus matrix [1/kg].
    pub blocks: Vec<BlockEntry>,
    /// Impulses the failed solve ended with [N s], `dimension` numbers a contact; empty if unknown.
    #[serde(default)]
    pub impulses: Vec<f64>,
}

/// One block.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BlockEntry {
    /// Block row.
    pub row: u32,
    /// Block column.
    pub column: u32,
    /// `dimension²` entries, row by row.
    pub entries: Vec<f64>,
}

/// Writes a problem.
///
/// # Errors
/// If serialisation fails.
pub fn write(problem: &ContactProblem) -> Result<String, ProblemError> {
    let d = problem.dimension;
    let file = ProblemFile {
        dimension: d,
        free_velocity: problem.free_velocity.iter().flat_map(|q| q[..d].to_vec()).collect(),
        friction: problem.friction.clone(),
        cohesion: problem.cohesion.clone(),
        blocks: problem
            .delassus
            .iter()
            .map(|(i, j, b)| BlockEntry {
                row: i as u32,
                column: j as u32,
                entries: (0..d).flat_map(|r| b[3 * r..3 * r + d].to_vec()).collect(),
            })
            .collect(),
        impulses: Vec::new(),
    };
    ron::ser::to_string_pretty(&file, ron::ser::PrettyConfig::new().depth_limit(2))
        .map_err(|e| ProblemError::Format(e.to_string()))
}

/// Reads a problem.
///
/// # Errors
/// [`ProblemError`] with the parser's message or what does not fit.
pub fn read(text: &str) -> Result<ContactProblem, ProblemError> {
    let file: ProblemFile = ron::from_str(text).map_err(|e| ProblemError::Format(e.to_string()))?;
    let (d, n) = (file.dimension, file.friction.len());
    if d != 2 && d != 3 {
        return Err(ProblemError::Format(format!("dimension {d} is neither 2 nor 3")));
    }
    if file.free_velocity.len() != d * n {
        return Err(ProblemError::Length { what: "free velocity", found: file.free_velocity.len(), expected: d * n });
    }
    let mut triplets: Vec<(u32, u32, Block)> = Vec::with_capacity(file.blocks.len());
    for e in &file.blocks {
        if e.entries.len() != d * d || e.row as usize >= n || e.column as usize >= n {
            return Err(ProblemError::Format(format!("block ({}, {}) does not fit", e.row, e.column)));
        }
        let mut b = ZERO;
        for r in 0..d {
            b[3 * r..3 * r + d].copy_from_slice(&e.entries[d * r..d * r + d]);
        }
        if d == 2 && e.row == e.column {
            b[8] = 0.5 * (b[0] + b[4]);
        }
        triplets.push((e.row, e.column, b));
    }
    let free_velocity = (0..n)
        .map(|k| {
            [
                file.free_velocity[d * k],
                file.free_velocity[d * k + 1],
                if d == 3 { file.free_velocity[d * k + 2] } else { 0.0 },
            ]
        })
        .collect();
    let problem = ContactProblem {
        dimension: d,
        delassus: BlockMatrix::from_triplets(n, &triplets),
        free_velocity,
        friction: file.friction,
        cohesion: file.cohesion,
    };
    problem.check()?;
    Ok(problem)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_trip_with_cohesion() {
        let w = BlockMatrix::from_triplets(2, &[(0, 0, crate::block::IDENTITY), (1, 0, [0.1; 9]), (1, 1, [0.5; 9])]);
        let mut p = ContactProblem::new(w, vec![[-1.0, 0.5, 0.25], [0.0; 3]], vec![0.3, -1.0]).unwrap();
        p.cohesion = vec![0.0, 2.0];
        assert_eq!(read(&write(&p).unwrap()).unwrap(), p);
        assert!(read("(dimension: 3, free_velocity: [], friction: [0.1], blocks: [])").is_err());
    }
}

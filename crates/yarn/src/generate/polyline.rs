//! Polylines from text, one vertex per line.

use thiserror::Error;

/// What is wrong with a text of polylines.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum PolylineError {
    /// A line is not a list of numbers of the right count.
    #[error("line {line}: expected {expected} numbers, found `{text}`")]
    Line {
        /// Line, from 1.
        line: usize,
        /// Numbers per vertex.
        expected: usize,
        /// The line.
        text: String,
    },
    /// A yarn has fewer than two vertices.
    #[error("the yarn that ends at line {line} has fewer than two vertices")]
    Short {
        /// Line, from 1.
        line: usize,
    },
}

/// Reads yarns from text: one vertex per line as numbers separated by commas, semicolons or blanks; an empty line ends a yarn;
/// `#` starts a comment; a first line without numbers is a header.
///
/// # Errors
/// The line that is wrong.
pub fn parse_polylines(text: &str, dimension: usize) -> Result<Vec<Vec<Vec<f64>>>, PolylineError> {
    let mut yarns = Vec::new();
    let mut current: Vec<Vec<f64>> = Vec::new();
    let mut seen = false;
    let end = |current: &mut Vec<Vec<f64>>, yarns: &mut Vec<Vec<Vec<f64>>>, line: usize| {
        if current.len() == 1 {
            return Err(PolylineError::Short { line });
        }
        if !current.is_empty() {
            yarns.push(std::mem::take(current));
        }
        Ok(())
    };
    let mut count = 0;
    for (i, raw) in text.lines().enumerate() {
        count = i + 1;
        let line = raw.split('#').next().unwrap_or("").trim();
        if line.is_empty() {
            if raw.trim().is_empty() {
                end(&mut current, &mut yarns, i + 1)?;
            }
            continue;
        }
        let numbers: Option<Vec<f64>> = line
            .split([',', ';', ' ', '\t'])
            .filter(|s| !s.is_empty())
            .map(|s| s.parse().ok().filter(|x: &f64| x.is_finite()))
            .collect();
        match numbers {
            Some(point) if point.len() == dimension => current.push(point),
            None if !seen => {}
            _ => return Err(PolylineError::Line { line: i + 1, expected: dimension, text: raw.to_owned() }),
        }
        seen = true;
    }
    end(&mut current, &mut yarns, count)?;
    Ok(yarns)
}

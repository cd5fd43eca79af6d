//! Polylines of a Wavefront OBJ file: its `v` and `l` lines. (The mesh reader in use elsewhere keeps triangles only.)

use nalgebra::Vector3;
use std::path::Path;

/// Reads the polylines of a file, in its own units.
///
/// # Errors
/// A sentence that names the line.
pub fn read(path: &Path) -> Result<Vec<Vec<Vector3<f64>>>, String> {
    let bytes = std::fs::read(path).map_err(|error| format!("cannot read {}: {error}", path.display()))?;
    parse(&String::from_utf8_lossy(&bytes)).map_err(|message| format!("{}: {message}", path.display()))
}

fn parse(text: &str) -> Result<Vec<Vec<Vector3<f64>>>, String> {
    let mut vertices: Vec<Vector3<f64>> = Vec::new();
    let mut lines: Vec<Vec<usize>> = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or("");
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let numbers: Vec<f64> = words.map_while(|word| word.parse().ok()).take(3).collect();
                match numbers.as_slice() {
                    [x, y, z] if numbers.iter().all(|number| number.is_finite()) => {
                        vertices.push(Vector3::new(*x, *y, *z))
                    }
                    _ => return Err(format!("line {}: a vertex needs three finite numbers", number + 1)),
                }
            }
            Some("l") => {
                let mut indices = Vec::new();
                for word in words {
                    let index: i64 = word
                        .split('/')
                        .next()
                        .and_then(|word| word.parse().ok())
                        .ok_or_else(|| format!("line {}: `{word}` is not the number of a vertex", number + 1))?;
                    // Positive numbers count from 1 at the start, negative ones back from the last vertex so far.
                    let place = if index > 0 { index - 1 } else { vertices.len() as i64 + index };
                    match usize::try_from(place) {
                        Ok(place) if index != 0 => indices.push(place),
                        _ => return Err(format!("line {}: there is no vertex {index}", number + 1)),
                    }
                }
                if indices.len() < 2 {
                    return Err(format!("line {}: a polyline needs at least two vertices", number + 1));
                }
                lines.push(indices);
            }
            _ => {}
        }
    }
    if lines.is_empty() {
        return if vertices.len() < 2 {
            Err("has no polyline (`l` line) in it".to_owned())
        } else {
            Ok(vec![vertices])
        };
    }
    lines
        .into_iter()
        .map(|line| {
            line.into_iter()
                .map(|i| vertices.get(i).copied().ok_or_else(|| format!("there is no vertex {}", i + 1)))
                .collect()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_polylines_with_both_kinds_of_numbers() {
        let text = "# strands\nv 0 0 0\nv 1 0 0\nv 2 0 0 1.0\nl 1 2/7 3\nv 0 1 0\nl -1 -2 # back\n";
        let strands = parse(text).unwrap();
        assert_eq!(strands.len(), 2);
        assert_eq!(strands[0][2], Vector3::new(2.0, 0.0, 0.0));
        assert_eq!(strands[1], vec![Vector3::new(0.0, 1.0, 0.0), Vector3::new(2.0, 0.0, 0.0)]);
        assert_eq!(parse("v 0 0 0\nv 1 0 0").unwrap()[0].len(), 2);
    }

    #[test]
    fn refuses_nonsense_by_line() {
        for (text, part) in [
            ("v 0 0", "line 1"),
            ("v 0 0 NaN", "line 1"),
            ("v 0 0 0\nl 1 9", "vertex 9"),
            ("l 0 1", "line 1"),
            ("", "no polyline"),
        ] {
            assert!(parse(text).unwrap_err().contains(part), "{text}");
        }
    }
}

//! Cuts for ParaView: one VTK XML ImageData file (`.vti`) per lattice piece and output, in the same layout as the other files.

use std::fmt::Write as _;

use super::frame::{FieldValues, Piece};
use super::vtk::{APPENDED, Arrays, check};

/// A regular lattice of points.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lattice {
    pub origin: [f64; 3],
    pub spacing: f64,
    pub counts: [u32; 3],
}

impl Lattice {
    /// All points, x fastest.
    pub fn positions(&self) -> Vec<[f64; 3]> {
        let [nx, ny, nz] = self.counts;
        let at = |i: u32, a: usize| self.origin[a] + f64::from(i) * self.spacing;
        let rows = (0..nz).flat_map(move |k| (0..ny).map(move |j| (j, k)));
        rows.flat_map(|(j, k)| (0..nx).map(move |i| [at(i, 0), at(j, 1), at(k, 2)])).collect()
    }

    /// Origin, spacing and counts in a row.
    pub fn numbers(&self) -> [f64; 7] {
        let ([x, y, z], [nx, ny, nz]) = (self.origin, self.counts.map(f64::from));
        [x, y, z, self.spacing, nx, ny, nz]
    }

    /// The inverse of [`Lattice::numbers`]; nothing where they are no lattice.
    pub fn from_numbers(v: &[f64]) -> Option<Lattice> {
        let [x, y, z, spacing, nx, ny, nz] = *v else { return None };
        let count = |n: f64| ((0.0..1e7).contains(&n) && n.fract() == 0.0).then_some(n as u32);
        Some(Lattice { origin: [x, y, z], spacing, counts: [count(nx)?, count(ny)?, count(nz)?] })
    }
}

/// The bytes of a lattice piece as a `.vti` file.
///
/// # Errors
/// A sentence, when counts or field lengths do not fit the piece.
pub(super) fn encode(time: f64, step: u64, piece: &Piece, lattice: &Lattice) -> Result<Vec<u8>, String> {
    check(piece)?;
    let mut out = Arrays::default();
    let extent: Vec<String> = lattice.counts.iter().map(|n| format!("0 {}", n.saturating_sub(1))).collect();
    let (extent, s) = (extent.join(" "), lattice.spacing);
    let [x, y, z] = lattice.origin;
    let mut xml = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n\
         <ImageData WholeExtent=\"{extent}\" Origin=\"{x} {y} {z}\" Spacing=\"{s} {s} {s}\">\n<FieldData>\n"
    );
    out.reals(&mut xml, "TimeValue", 1, Some(1), &[time]);
    out.integers(&mut xml, "step", 1, Some(1), [step as i64].into_iter());
    out.integers(&mut xml, "topology", 1, Some(1), [4].into_iter());
    out.reals(&mut xml, "lattice", 1, Some(7), &lattice.numbers());
    let _ = writeln!(xml, "</FieldData>\n<Piece Extent=\"{extent}\">\n<PointData>");
    for field in &piece.point_fields {
        match &field.values {
            FieldValues::F64(values) => out.reals(&mut xml, &field.name, field.components, None, values),
            FieldValues::I64(values) => {
                out.integers(&mut xml, &field.name, field.components, None, values.iter().copied())
            }
        }
    }
    xml.push_str("</PointData>\n</Piece>\n</ImageData>\n");
    xml.push_str(APPENDED);
    let mut bytes = xml.into_bytes();
    bytes.append(&mut out.data);
    bytes.extend(b"\n</AppendedData>\n</VTKFile>\n");
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::frame::{Field, Topology};

    #[test]
    fn a_lattice_comes_back_as_it_was() {
        let lattice = Lattice { origin: [0.1, -0.2, 0.3], spacing: 0.05, counts: [4, 3, 1] };
        let Lattice { origin, spacing, counts } = lattice;
        let piece = Piece {
            name: String::new(),
            topology: Topology::Lattice { origin, spacing, counts },
            positions: lattice.positions(),
            point_fields: vec![Field::scalar("pressure", (0..12).map(f64::from).collect())],
            cell_fields: Vec::new(),
        };
        let bytes = encode(1.5, 7, &piece, &lattice).unwrap();
        let back = crate::record::vtk::decode(&bytes).unwrap();
        assert_eq!((back.time, back.step, &back.piece), (1.5, 7, &piece));
        assert!(String::from_utf8_lossy(&bytes).contains("WholeExtent=\"0 3 0 2 0 0\""));
        let mut short = piece;
        short.positions.pop();
        assert!(encode(0.0, 0, &short, &lattice).is_err());
    }
}

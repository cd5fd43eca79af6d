//! Frames for ParaView: one VTK XML PolyData file (`.vtp`) per piece and output, one `frames.pvd` with the times.
//!
//! Arrays are appended raw, little-endian, with 64-bit lengths: exact, compact and the same bytes every time. Field data
//! holds `TimeValue` [s], `step` and `topology` (0 points, 1 polylines, 2 segments, 3 triangles, 4 a lattice, which goes to a
//! `.vti` file), which tells pairs from polylines when a file is read back.

use std::fmt::Write as _;
use std::fs;
use std::io;
use std::path::Path;

use super::frame::{Field, FieldValues, Frame, Piece, Topology};
use super::frame_files::{StampedPiece, file_name, write_whole};
use super::vti::{self, Lattice};

pub(super) const APPENDED: &str = "<AppendedData encoding=\"raw\">\n_";
const COLLECTION: &str = "frames.pvd";
const COLLECTION_HEAD: &str = "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n<Collection>\n";
const COLLECTION_TAIL: &str = "</Collection>\n</VTKFile>\n";

/// Writes the pieces of output `index` into `folder` and lists them in `frames.pvd`. Entries of this and later outputs, left
/// by a run that is being resumed, are replaced.
///
/// # Errors
/// When the file system refuses or a piece is inconsistent (offsets or field lengths that do not fit).
pub fn write_frame(folder: &Path, index: u64, frame: &Frame) -> io::Result<()> {
    let mut entries = String::new();
    for (part, piece) in frame.pieces.iter().enumerate() {
        let bytes =
            encode(frame.time, frame.step, piece).map_err(|m| io::Error::new(io::ErrorKind::InvalidInput, m))?;
        let image = matches!(piece.topology, Topology::Lattice { .. });
        let file = file_name(&piece.name, index, if image { "vti" } else { "vtp" });
        write_whole(&folder.join(&file), &bytes)?;
        let name = escape(&piece.name);
        let _ =
            writeln!(entries, "<DataSet timestep=\"{}\" part=\"{part}\" name=\"{name}\" file=\"{file}\"/>", frame.time);
    }
    let path = folder.join(COLLECTION);
    let former = fs::read_to_string(&path).unwrap_or_default();
    let mut text = COLLECTION_HEAD.to_owned();
    for line in former.lines().filter(|line| entry_index(line).is_some_and(|former| former < index)) {
        text.push_str(line);
        text.push('\n');
    }
    text.push_str(&entries);
    text.push_str(COLLECTION_TAIL);
    write_whole(&path, text.as_bytes())
}

/// Number of the output that a line of the collection names.
fn entry_index(line: &str) -> Option<u64> {
    let file = line.strip_prefix("<DataSet ")?.split_once("file=\"")?.1.split_once(".vt")?.0;
    file.rsplit_once('_')?.1.parse().ok()
}

/// The bytes of one piece as a `.vtp` file.
///
/// # Errors
/// A sentence, when offsets, indices or field lengths do not fit the piece.
pub fn encode(time: f64, step: u64, piece: &Piece) -> Result<Vec<u8>, String> {
    if let Topology::Lattice { origin, spacing, counts } = piece.topology {
        return vti::encode(time, step, piece, &Lattice { origin, spacing, counts });
    }
    check(piece)?;
    let n = piece.positions.len();
    let mut out = Arrays::default();
    let mut xml = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<PolyData>\n<FieldData>\n",
    );
    let kind = match piece.topology {
        Topology::Points | Topology::Lattice { .. } => 0,
        Topology::Polylines { .. } => 1,
        Topology::Segments(_) => 2,
        Topology::Triangles(_) => 3,
    };
    out.reals(&mut xml, "TimeValue", 1, Some(1), &[time]);
    out.integers(&mut xml, "step", 1, Some(1), [step as i64].into_iter());
    out.integers(&mut xml, "topology", 1, Some(1), [kind].into_iter());
    let cells = piece.cell_count();
    let counts = match kind {
        0 => [n, 0, 0],
        3 => [0, 0, cells],
        _ => [0, cells, 0],
    };
    let [verts, lines, polys] = counts;
    let _ = writeln!(
        xml,
        "</FieldData>\n<Piece NumberOfPoints=\"{n}\" NumberOfVerts=\"{verts}\" NumberOfLines=\"{lines}\" NumberOfStrips=\"0\" NumberOfPolys=\"{polys}\">"
    );
    for (section, fields) in [("PointData", &piece.point_fields), ("CellData", &piece.cell_fields)] {
        let _ = writeln!(xml, "<{section}>");
        for field in fields {
            match &field.values {
                FieldValues::F64(values) => out.reals(&mut xml, &field.name, field.components, None, values),
                FieldValues::I64(values) => {
                    out.integers(&mut xml, &field.name, field.components, None, values.iter().copied())
                }
            }
        }
        let _ = writeln!(xml, "</{section}>");
    }
    xml.push_str("<Points>\n");
    out.reals(&mut xml, "Points", 3, None, piece.positions.as_flattened());
    xml.push_str("</Points>\n");
    let mut cell_arrays =
        |section: &str, connectivity: &mut dyn Iterator<Item = i64>, ends: &mut dyn Iterator<Item = i64>| {
            let _ = writeln!(xml, "<{section}>");
            out.integers(&mut xml, "connectivity", 1, None, connectivity);
            out.integers(&mut xml, "offsets", 1, None, ends);
            let _ = writeln!(xml, "</{section}>");
        };
    match &piece.topology {
        Topology::Points | Topology::Lattice { .. } => cell_arrays("Verts", &mut (0..n as i64), &mut (1..=n as i64)),
        Topology::Polylines { offsets } => {
            cell_arrays("Lines", &mut (0..n as i64), &mut offsets.iter().skip(1).map(|&o| i64::from(o)));
        }
        Topology::Segments(pairs) => {
            let ends = pairs.as_flattened().iter().map(|&v| i64::from(v));
            cell_arrays("Lines", &mut { ends }, &mut (1..=pairs.len() as i64).map(|k| 2 * k));
        }
        Topology::Triangles(triangles) => {
            let corners = triangles.as_flattened().iter().map(|&v| i64::from(v));
            cell_arrays("Polys", &mut { corners }, &mut (1..=triangles.len() as i64).map(|k| 3 * k));
        }
    }
    xml.push_str("</Piece>\n</PolyData>\n");
    xml.push_str(APPENDED);
    let mut bytes = xml.into_bytes();
    bytes.append(&mut out.data);
    bytes.extend(b"\n</AppendedData>\n</VTKFile>\n");
    Ok(bytes)
}

/// Whether offsets, indices and field lengths fit the piece.
pub(super) fn check(piece: &Piece) -> Result<(), String> {
    let n = piece.positions.len();
    let refuse = |what: String| Err(format!("piece `{}`: {what}", piece.name));
    let inside = |corners: &[u32]| corners.iter().all(|&v| (v as usize) < n);
    match &piece.topology {
        Topology::Points => {}
        Topology::Polylines { offsets } => {
            let ends_fit = offsets.first() == Some(&0) && offsets.last() == Some(&(n as u32));
            if !ends_fit || offsets.windows(2).any(|pair| pair[0] > pair[1]) {
                return refuse(format!("line offsets must rise from 0 to the {n} points"));
            }
        }
        Topology::Segments(pairs) if !inside(pairs.as_flattened()) => {
            return refuse("a segment names a point that is not there".into());
        }
        Topology::Triangles(all) if !inside(all.as_flattened()) => {
            return refuse("a triangle names a point that is not there".into());
        }
        Topology::Lattice { counts, .. } if counts.iter().map(|c| *c as usize).product::<usize>() != n => {
            return refuse(format!("a lattice of {counts:?} with {n} points"));
        }
        Topology::Segments(_) | Topology::Triangles(_) | Topology::Lattice { .. } => {}
    }
    for (fields, count, of) in [(&piece.point_fields, n, "points"), (&piece.cell_fields, piece.cell_count(), "cells")] {
        for field in fields {
            let numbers = match &field.values {
                FieldValues::F64(values) => values.len(),
                FieldValues::I64(values) => values.len(),
            };
            if field.components == 0 || numbers != field.components * count {
                let found =
                    format!("field `{}` has {numbers} numbers for {count} {of} of {}", field.name, field.components);
                return refuse(found);
            }
        }
    }
    Ok(())
}

/// The appended section while it grows.
#[derive(Default)]
pub(super) struct Arrays {
    pub(super) data: Vec<u8>,
}

impl Arrays {
    fn declare(&self, xml: &mut String, kind: &str, name: &str, components: usize, tuples: Option<usize>) {
        let name = escape(name);
        let _ = write!(xml, "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\"");
        if let Some(tuples) = tuples {
            let _ = write!(xml, " NumberOfTuples=\"{tuples}\"");
        }
        let _ = writeln!(xml, " format=\"appended\" offset=\"{}\"/>", self.data.len());
    }

    pub(super) fn reals(
        &mut self,
        xml: &mut String,
        name: &str,
        components: usize,
        tuples: Option<usize>,
        values: &[f64],
    ) {
        self.declare(xml, "Float64", name, components, tuples);
        self.data.extend((8 * values.len() as u64).to_le_bytes());
        self.data.extend(values.iter().flat_map(|v| v.to_le_bytes()));
    }

    pub(super) fn integers(
        &mut self,
        xml: &mut String,
        name: &str,
        components: usize,
        tuples: Option<usize>,
        values: impl Iterator<Item = i64>,
    ) {
        self.declare(xml, "Int64", name, components, tuples);
        let at = self.data.len();
        self.data.extend([0; 8]);
        self.data.extend(values.flat_map(i64::to_le_bytes));
        let length = (self.data.len() - at - 8) as u64;
        self.data[at..at + 8].copy_from_slice(&length.to_le_bytes());
    }
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

fn unescape(text: &str) -> String {
    text.replace("&quot;", "\"").replace("&gt;", ">").replace("&lt;", "<").replace("&amp;", "&")
}

/// Reads a piece that [`encode`] made; its name is left empty, the file's name has it.
///
/// # Errors
/// A sentence, when the bytes are not such a file or end too early.
pub fn decode(bytes: &[u8]) -> Result<StampedPiece, String> {
    let marker = APPENDED.as_bytes();
    let split = bytes
        .windows(marker.len())
        .position(|w| w == marker)
        .ok_or("no appended data: not a file of ours, or cut short")?;
    let xml = std::str::from_utf8(&bytes[..split]).map_err(|_| "the header is not text")?;
    let data = &bytes[split + marker.len()..];
    let mut piece = Piece {
        name: String::new(),
        topology: Topology::Points,
        positions: Vec::new(),
        point_fields: Vec::new(),
        cell_fields: Vec::new(),
    };
    let (mut time, mut step, mut kind) = (0.0, 0, 0);
    let (mut connectivity, mut ends) = (Vec::new(), Vec::new());
    let mut section = "";
    let mut lattice = None;
    for tag in xml.split('<').skip(1) {
        let name = tag.split([' ', '>', '/']).next().unwrap_or_default();
        if name != "DataArray" {
            if !tag.starts_with('/') {
                section = name;
            }
            continue;
        }
        let array = read_array(tag, data)?;
        match (section, array.name.as_str(), array.values) {
            ("FieldData", "TimeValue", FieldValues::F64(v)) => time = v.first().copied().unwrap_or(0.0),
            ("FieldData", "step", FieldValues::I64(v)) => step = v.first().map_or(0, |&s| s as u64),
            ("FieldData", "lattice", FieldValues::F64(v)) => lattice = Lattice::from_numbers(&v),
            ("FieldData", "topology", FieldValues::I64(v)) => kind = v.first().copied().unwrap_or(0),
            ("Points", _, FieldValues::F64(v)) => {
                piece.positions = v.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect()
            }
            ("PointData", _, values) => piece.point_fields.push(Field { values, ..array.header }),
            ("CellData", _, values) => piece.cell_fields.push(Field { values, ..array.header }),
            ("Verts", ..) => {}
            ("Lines" | "Polys", "connectivity", FieldValues::I64(v)) => connectivity = v,
            ("Lines" | "Polys", "offsets", FieldValues::I64(v)) => ends = v,
            _ => {}
        }
    }
    let index = |v: &i64| u32::try_from(*v).map_err(|_| "a point number is out of range".to_owned());
    let corners: Vec<u32> = connectivity.iter().map(index).collect::<Result<_, _>>()?;
    piece.topology = match kind {
        0 => Topology::Points,
        1 => Topology::Polylines {
            offsets: std::iter::once(Ok(0)).chain(ends.iter().map(index)).collect::<Result<_, _>>()?,
        },
        2 => Topology::Segments(corners.chunks_exact(2).map(|c| [c[0], c[1]]).collect()),
        3 => Topology::Triangles(corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect()),
        4 => {
            let lattice = lattice.ok_or("an image without its lattice")?;
            piece.positions = lattice.positions();
            Topology::Lattice { origin: lattice.origin, spacing: lattice.spacing, counts: lattice.counts }
        }
        other => return Err(format!("unknown topology {other}")),
    };
    check(&piece)?;
    Ok(StampedPiece { time, step, piece })
}

struct Array {
    name: String,
    values: FieldValues,
    header: Field,
}

fn read_array(tag: &str, data: &[u8]) -> Result<Array, String> {
    let attribute = |key: &str| {
        let start = tag.find(&format!(" {key}=\""))? + key.len() + 3;
        Some(&tag[start..start + tag[start..].find('"')?])
    };
    let name = unescape(attribute("Name").ok_or("an array has no name")?);
    let cut = || format!("array `{name}` is cut short");
    let offset: usize =
        attribute("offset").and_then(|o| o.parse().ok()).ok_or_else(|| format!("array `{name}` has no offset"))?;
    let after = data.get(offset..).ok_or_else(cut)?;
    let (length, rest) = after.split_first_chunk::<8>().ok_or_else(cut)?;
    let length = usize::try_from(u64::from_le_bytes(*length)).map_err(|_| cut())?;
    let body = rest.get(..length).ok_or_else(cut)?;
    let (words, _) = body.as_chunks::<8>();
    let values = match attribute("type") {
        Some("Float64") => FieldValues::F64(words.iter().map(|w| f64::from_le_bytes(*w)).collect()),
        Some("Int64") => FieldValues::I64(words.iter().map(|w| i64::from_le_bytes(*w)).collect()),
        other => return Err(format!("array `{name}` has unknown type {other:?}")),
    };
    let components = attribute("NumberOfComponents").and_then(|c| c.parse().ok()).unwrap_or(1);
    let header = Field { name: name.clone(), components, values: FieldValues::I64(Vec::new()) };
    Ok(Array { name, values, header })
}

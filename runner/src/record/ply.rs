//! Frames for Houdini and Blender: one binary little-endian PLY file per piece and output.
//!
//! Positions and fields are vertex properties (`velocity` becomes `velocity_x`, `velocity_y`, `velocity_z`); lines are `edge`
//! elements with `vertex1` and `vertex2`, triangles are `face` lists. Vertices of polylines carry `line`, the number of
//! their line. Comments hold time, step, piece and topology, so that our reader gets back what was written (values per
//! line sit on its edges: a line of one vertex has none and loses them).

use std::fmt::Write as _;
use std::io;
use std::path::Path;

use super::frame::{Field, FieldValues, Frame, Piece, Topology};
use super::frame_files::{StampedPiece, file_name, write_whole};
use super::vtk::check;

const AXES: [&str; 3] = ["x", "y", "z"];

/// Writes the pieces of output `index` into `folder`.
///
/// # Errors
/// When the file system refuses or a piece is inconsistent.
pub fn write_frame(folder: &Path, index: u64, frame: &Frame) -> io::Result<()> {
    for piece in &frame.pieces {
        let bytes =
            encode(frame.time, frame.step, piece).map_err(|m| io::Error::new(io::ErrorKind::InvalidInput, m))?;
        write_whole(&folder.join(file_name(&piece.name, index, "ply")), &bytes)?;
    }
    Ok(())
}

/// A column of an element: name and how to get the number of a row.
enum Column<'a> {
    Real(&'a [f64], usize, usize),
    Whole(&'a [i64], usize, usize),
}

impl Column<'_> {
    fn push(&self, row: usize, to: &mut Vec<u8>) {
        match self {
            Column::Real(values, stride, k) => to.extend(values[row * stride + k].to_le_bytes()),
            // PLY knows no 64-bit integers.
            Column::Whole(values, stride, k) => to.extend((values[row * stride + k] as f64).to_le_bytes()),
        }
    }
}

fn columns<'a>(fields: &'a [Field], header: &mut String) -> Vec<Column<'a>> {
    let mut all = Vec::new();
    for field in fields {
        let name: String = field.name.chars().map(|c| if c.is_whitespace() { '_' } else { c }).collect();
        let n = field.components;
        for k in 0..n {
            let suffix = match n {
                1 => String::new(),
                3 => format!("_{}", AXES[k]),
                _ => format!("_{k}"),
            };
            let _ = writeln!(header, "property double {name}{suffix}");
            all.push(match &field.values {
                FieldValues::F64(values) => Column::Real(values, n, k),
                FieldValues::I64(values) => Column::Whole(values, n, k),
            });
        }
    }
    all
}

/// The bytes of one piece as a `.ply` file.
///
/// # Errors
/// A sentence, when offsets, indices or field lengths do not fit the piece.
pub fn encode(time: f64, step: u64, piece: &Piece) -> Result<Vec<u8>, String> {
    check(piece)?;
    let n = piece.positions.len();
    let word = match piece.topology {
        // PLY knows no images: a lattice becomes its points
        Topology::Points | Topology::Lattice { .. } => "points",
        Topology::Polylines { .. } => "polylines",
        Topology::Segments(_) => "segments",
        Topology::Triangles(_) => "triangles",
    };
    let mut header = format!(
        "ply\nformat binary_little_endian 1.0\ncomment time {time}\ncomment step {step}\ncomment piece {}\ncomment topology {word}\n",
        piece.name.replace('\n', " ")
    );
    let mut line_of = Vec::new();
    if let Topology::Polylines { offsets } = &piece.topology {
        let _ = writeln!(header, "comment lines {}", offsets.len() - 1);
        for (line, pair) in offsets.windows(2).enumerate() {
            line_of.resize(pair[1] as usize, line as i32);
        }
    }
    for (where_, fields) in [("point", &piece.point_fields), ("cell", &piece.cell_fields)] {
        for field in fields {
            let kind = if matches!(field.values, FieldValues::F64(_)) { "real" } else { "whole" };
            let _ = writeln!(
                header,
                "comment field {where_} {kind} {} {}",
                field.components,
                field.name.replace('\n', " ")
            );
        }
    }
    let _ = write!(header, "element vertex {n}\nproperty double x\nproperty double y\nproperty double z\n");
    if !line_of.is_empty() {
        header.push_str("property int line\n");
    }
    let point_columns = columns(&piece.point_fields, &mut header);
    let edges: Vec<([u32; 2], usize)> = match &piece.topology {
        Topology::Polylines { offsets } => offsets
            .windows(2)
            .enumerate()
            .flat_map(|(line, pair)| (pair[0] + 1..pair[1]).map(move |v| ([v - 1, v], line)))
            .collect(),
        Topology::Segments(pairs) => pairs.iter().copied().zip(0..).collect(),
        _ => Vec::new(),
    };
    let mut cell_columns = Vec::new();
    match &piece.topology {
        Topology::Points | Topology::Lattice { .. } => {}
        Topology::Polylines { .. } | Topology::Segments(_) => {
            let _ = write!(header, "element edge {}\nproperty int vertex1\nproperty int vertex2\n", edges.len());
            cell_columns = columns(&piece.cell_fields, &mut header);
        }
        Topology::Triangles(triangles) => {
            let _ = write!(header, "element face {}\nproperty list uchar int vertex_indices\n", triangles.len());
            cell_columns = columns(&piece.cell_fields, &mut header);
        }
    }
    header.push_str("end_header\n");
    let mut bytes = header.into_bytes();
    for (i, position) in piece.positions.iter().enumerate() {
        position.iter().for_each(|x| bytes.extend(x.to_le_bytes()));
        if let Some(line) = line_of.get(i) {
            bytes.extend(line.to_le_bytes());
        }
        point_columns.iter().for_each(|column| column.push(i, &mut bytes));
    }
    for (ends, cell) in &edges {
        ends.iter().for_each(|v| bytes.extend((*v as i32).to_le_bytes()));
        cell_columns.iter().for_each(|column| column.push(*cell, &mut bytes));
    }
    if let Topology::Triangles(triangles) = &piece.topology {
        for (cell, corners) in triangles.iter().enumerate() {
            bytes.push(3);
            corners.iter().for_each(|v| bytes.extend((*v as i32).to_le_bytes()));
            cell_columns.iter().for_each(|column| column.push(cell, &mut bytes));
        }
    }
    Ok(bytes)
}

/// Reads a piece that [`encode`] made.
///
/// # Errors
/// A sentence, when the bytes are not such a file or end too early.
pub fn decode(bytes: &[u8]) -> Result<StampedPiece, String> {
    let end = b"end_header\n";
    let split = bytes.windows(end.len()).position(|w| w == end).ok_or("no PLY header, or cut short")? + end.len();
    let header = std::str::from_utf8(&bytes[..split]).map_err(|_| "the header is not text")?;
    if !header.starts_with("ply\nformat binary_little_endian 1.0\n") {
        return Err("not a binary little-endian PLY file".into());
    }
    let (mut time, mut step, mut name, mut topology, mut lines) = (0.0, 0, String::new(), "points", 0usize);
    let (mut vertices, mut cells) = (0usize, 0usize);
    let (mut point_fields, mut cell_fields) = (Vec::new(), Vec::new());
    for line in header.lines() {
        let mut words = line.split(' ');
        match (words.next(), words.next()) {
            (Some("comment"), Some("time")) => time = parse(words.next())?,
            (Some("comment"), Some("step")) => step = parse(words.next())?,
            (Some("comment"), Some("lines")) => lines = parse(words.next())?,
            (Some("comment"), Some("piece")) => name = words.collect::<Vec<_>>().join(" "),
            (Some("comment"), Some("topology")) => topology = words.next().unwrap_or_default(),
            (Some("comment"), Some("field")) => {
                let (at, kind) = (words.next(), words.next());
                let components: usize = parse(words.next())?;
                let name = words.collect::<Vec<_>>().join(" ");
                let values =
                    if kind == Some("whole") { FieldValues::I64(Vec::new()) } else { FieldValues::F64(Vec::new()) };
                let list = if at == Some("cell") { &mut cell_fields } else { &mut point_fields };
                list.push(Field { name, components, values });
            }
            (Some("element"), Some("vertex")) => vertices = parse(words.next())?,
            (Some("element"), Some("edge" | "face")) => cells = parse(words.next())?,
            _ => {}
        }
    }
    let mut body = Body { bytes: &bytes[split..] };
    let with_line = header.contains("property int line\n");
    let (mut positions, mut line_of) = (Vec::new(), Vec::new());
    for _ in 0..vertices {
        positions.push([body.real()?, body.real()?, body.real()?]);
        if with_line {
            line_of.push(body.index()?);
        }
        body.fields(&mut point_fields)?;
    }
    let (mut segments, mut triangles) = (Vec::new(), Vec::new());
    let mut last_line = None;
    for _ in 0..cells {
        if topology == "triangles" {
            body.skip(1)?;
            triangles.push([body.index()?, body.index()?, body.index()?]);
        } else {
            segments.push([body.index()?, body.index()?]);
        }
        // Values per line are repeated on its edges: the first has them.
        let line = segments.last().and_then(|s| line_of.get(s[0] as usize)).copied();
        if topology == "polylines" && line == last_line {
            body.skip(8 * cell_fields.iter().map(|f: &Field| f.components).sum::<usize>())?;
        } else {
            body.fields(&mut cell_fields)?;
        }
        last_line = line;
    }
    let topology = match topology {
        "polylines" => {
            let mut offsets = vec![0u32; lines.min(vertices) + 1];
            for &line in &line_of {
                *offsets.get_mut(line as usize + 1).ok_or("a line number is out of range")? += 1;
            }
            for i in 1..offsets.len() {
                offsets[i] += offsets[i - 1];
            }
            Topology::Polylines { offsets }
        }
        "segments" => Topology::Segments(segments),
        "triangles" => Topology::Triangles(triangles),
        _ => Topology::Points,
    };
    let mut piece = Piece { name, topology, positions, point_fields, cell_fields };
    let cells = piece.cell_count();
    piece.cell_fields.retain(|field| field.count() == cells);
    check(&piece)?;
    Ok(StampedPiece { time, step, piece })
}

fn parse<T: std::str::FromStr>(word: Option<&str>) -> Result<T, String> {
    word.and_then(|w| w.parse().ok()).ok_or_else(|| "a number in the header cannot be read".to_owned())
}

struct Body<'a> {
    bytes: &'a [u8],
}

impl Body<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let (head, rest) = self.bytes.split_first_chunk::<N>().ok_or("the file is cut short")?;
        self.bytes = rest;
        Ok(*head)
    }

    fn skip(&mut self, count: usize) -> Result<(), String> {
        self.bytes = self.bytes.get(count..).ok_or("the file is cut short")?;
        Ok(())
    }

    fn real(&mut self) -> Result<f64, String> {
        self.take().map(f64::from_le_bytes)
    }

    fn index(&mut self) -> Result<u32, String> {
        u32::try_from(self.take().map(i32::from_le_bytes)?).map_err(|_| "a point number is negative".to_owned())
    }

    fn fields(&mut self, fields: &mut [Field]) -> Result<(), String> {
        for field in fields {
            for _ in 0..field.components {
                let value = self.real()?;
                match &mut field.values {
                    FieldValues::F64(values) => values.push(value),
                    FieldValues::I64(values) => values.push(value as i64),
                }
            }
        }
        Ok(())
    }
}

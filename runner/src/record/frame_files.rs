//! Frames as files: names, listing, and reading back whatever format is there.
//!
//! `frames/strands_000012.vtp` is the piece `strands` of output 12; `frames/frames.pvd` lists all pieces with their times
//! for ParaView. PLY files have the same names. Files appear whole or not at all: they are written aside and renamed.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::frame::{Frame, Piece};
use super::{ply, vtk};

/// The pieces of one output, as files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameFiles {
    /// Number of the output.
    pub index: u64,
    /// Piece name and file, in order of name. Where both formats are there, the VTK one.
    pub pieces: Vec<(String, PathBuf)>,
}

/// A piece with the moment it belongs to, as read from one file.
#[derive(Clone, Debug, PartialEq)]
pub struct StampedPiece {
    /// Simulated time [s].
    pub time: f64,
    /// Steps accepted so far.
    pub step: u64,
    /// The piece.
    pub piece: Piece,
}

/// File name of a piece: letters, digits, `-` and `_` of its name, then the number of the output.
#[must_use]
pub fn file_name(piece: &str, index: u64, extension: &str) -> String {
    let plain: String = piece.chars().map(|c| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' }).collect();
    format!("{plain}_{index:06}.{extension}")
}

/// All outputs in a folder, in order. A folder that is not there holds none.
///
/// # Errors
/// When the folder cannot be read.
pub fn list(folder: &Path) -> io::Result<Vec<FrameFiles>> {
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        other => other?,
    };
    let mut frames: BTreeMap<u64, BTreeMap<String, PathBuf>> = BTreeMap::new();
    for entry in entries {
        let path = entry?.path();
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_owned();
        let stem = path.file_stem().and_then(|s| s.to_str()).unwrap_or_default();
        let Some((piece, number)) = stem.rsplit_once('_') else { continue };
        let Ok(index) = number.parse::<u64>() else { continue };
        let piece = piece.to_owned();
        match extension.as_str() {
            "vtp" | "vti" => _ = frames.entry(index).or_default().insert(piece, path),
            "ply" => _ = frames.entry(index).or_default().entry(piece).or_insert(path),
            _ => {}
        }
    }
    Ok(frames.into_iter().map(|(index, pieces)| FrameFiles { index, pieces: pieces.into_iter().collect() }).collect())
}

/// Reads one output back.
///
/// # Errors
/// When a file cannot be read or is not one of ours.
pub fn load(files: &FrameFiles) -> io::Result<Frame> {
    let mut frame = Frame::default();
    for (_, path) in &files.pieces {
        let bytes = fs::read(path)?;
        let is_vtk = path.extension().is_some_and(|e| e == "vtp" || e == "vti");
        let read = if is_vtk { vtk::decode(&bytes) } else { ply::decode(&bytes) };
        let mut stamped = read
            .map_err(|message| io::Error::new(io::ErrorKind::InvalidData, format!("{}: {message}", path.display())))?;
        if stamped.piece.name.is_empty() {
            stamped.piece.name =
                path.file_stem().and_then(|s| s.to_str()?.rsplit_once('_')).map_or("", |s| s.0).to_owned();
        }
        (frame.time, frame.step) = (stamped.time, stamped.step);
        frame.pieces.push(stamped.piece);
    }
    Ok(frame)
}

/// Writes aside and renames, so that readers never meet half a file.
pub(super) fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let aside = path.with_extension("part");
    let mut file = File::create(&aside)?;
    file.write_all(bytes)?;
    drop(file);
    fs::rename(&aside, path)
}

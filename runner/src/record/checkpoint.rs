//! Checkpoints: versioned, checksummed, written atomically; the newest valid one is used, a broken one is refused by name.
//!
//! ```text
//! "VISCOSE1" | format u32 | scene hash u64 | payload bytes u64 | CRC-32 of payload u32 | zstd(postcard(Saved))
//! ```

use std::fs::{self, File};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::stepper::StepperState;

const MAGIC: &[u8; 8] = b"VISCOSE1";
/// Raised whenever the saved structures change shape.
pub const FORMAT: u32 = 1;
const EXTENSION: &str = "vck";
const HEADER: usize = 8 + 4 + 8 + 8 + 4;

/// Everything needed to go on with a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Saved {
    /// Kind of system, to refuse a foreign state early.
    pub kind: String,
    /// Time, steps and step control.
    pub stepper: StepperState,
    /// Frames written so far.
    pub frames: u64,
    /// Checkpoints written so far, this one included.
    pub checkpoints: u64,
    /// Length of `series.csv` at this moment.
    pub series_bytes: u64,
    /// Length of `timings.csv` at this moment.
    pub timings_bytes: u64,
    /// Wall-clock seconds used so far.
    pub seconds: f64,
    /// The system's own state.
    pub system: Vec<u8>,
}

/// Why a checkpoint could not be written or used.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// The file system refused.
    #[error("checkpoint {path}: {source}")]
    Io {
        /// File concerned.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Not a checkpoint of this program.
    #[error("{0} is not a Viscose checkpoint (its first bytes are something else)")]
    Foreign(PathBuf),
    /// Made by another version of the format.
    #[error(
        "{path} has checkpoint format {found}; this version reads format {FORMAT}: run it with the version that wrote it"
    )]
    Format {
        /// File concerned.
        path: PathBuf,
        /// Its format number.
        found: u32,
    },
    /// Made for another scene.
    #[error("{0} belongs to another scene (its scene hash differs); use --resume-from with --out to branch on purpose")]
    OtherScene(PathBuf),
    /// Cut short or altered.
    #[error("{path} is damaged ({what}); it was probably cut short while being written or copied")]
    Damaged {
        /// File concerned.
        path: PathBuf,
        /// What does not fit.
        what: String,
    },
    /// None left to use.
    #[error("no usable checkpoint in {folder}{}", refused.iter().map(|r| format!("\n  refused: {r}")).collect::<String>())]
    NoneUsable {
        /// Folder searched.
        folder: PathBuf,
        /// Those that were refused, with the reason.
        refused: Vec<String>,
    },
}

fn io_error(path: &Path) -> impl FnOnce(std::io::Error) -> CheckpointError {
    let path = path.to_owned();
    move |source| CheckpointError::Io { path, source }
}

/// The file of the checkpoint after `step` steps.
#[must_use]
pub fn path_of(folder: &Path, step: u64) -> PathBuf {
    folder.join(format!("{step:010}.{EXTENSION}"))
}

/// Writes a checkpoint beside its final place and moves it there in one go, so that a reader sees all of it or nothing.
///
/// # Errors
/// When the file system refuses.
pub fn write(path: &Path, scene_hash: u64, saved: &Saved) -> Result<(), CheckpointError> {
    let damaged = |what: String| CheckpointError::Damaged { path: path.to_owned(), what };
    let plain = postcard::to_stdvec(saved).map_err(|error| damaged(error.to_string()))?;
    let payload = zstd::encode_all(plain.as_slice(), 1).map_err(io_error(path))?;
    let folder = path.parent().unwrap_or(Path::new("."));
    fs::create_dir_all(folder).map_err(io_error(folder))?;
    let mut file = super::folder::new_file_in(folder).map_err(io_error(path))?;
    let mut header = Vec::with_capacity(HEADER);
    header.extend_from_slice(MAGIC);
    header.extend_from_slice(&FORMAT.to_le_bytes());
    header.extend_from_slice(&scene_hash.to_le_bytes());
    header.extend_from_slice(&(payload.len() as u64).to_le_bytes());
    header.extend_from_slice(&crc32fast::hash(&payload).to_le_bytes());
    file.write_all(&header).and_then(|()| file.write_all(&payload)).map_err(io_error(path))?;
    file.as_file().sync_all().map_err(io_error(path))?;
    file.persist(path).map_err(|error| CheckpointError::Io { path: path.to_owned(), source: error.error })?;
    // the rename itself must reach the disk too
    if let Ok(folder) = File::open(folder) {
        let _ = folder.sync_all();
    }
    Ok(())
}

/// Reads one checkpoint; `scene_hash` of `None` accepts any scene (branching).
///
/// # Errors
/// Says why a file cannot be used.
pub fn read(path: &Path, scene_hash: Option<u64>) -> Result<Saved, CheckpointError> {
    let mut bytes = Vec::new();
    File::open(path).and_then(|mut file| file.read_to_end(&mut bytes)).map_err(io_error(path))?;
    let damaged = |what: &str| CheckpointError::Damaged { path: path.to_owned(), what: what.to_owned() };
    if bytes.len() < MAGIC.len() || &bytes[..MAGIC.len()] != MAGIC {
        return Err(CheckpointError::Foreign(path.to_owned()));
    }
    if bytes.len() < HEADER {
        return Err(damaged("the header is incomplete"));
    }
    let (header, payload) = bytes.split_at(HEADER);
    let word32 = |at: usize| u32::from_le_bytes([header[at], header[at + 1], header[at + 2], header[at + 3]]);
    let word64 = |at: usize| u64::from(word32(at)) | u64::from(word32(at + 4)) << 32;
    let format = word32(8);
    if format != FORMAT {
        return Err(CheckpointError::Format { path: path.to_owned(), found: format });
    }
    if scene_hash.is_some_and(|hash| hash != word64(12)) {
        return Err(CheckpointError::OtherScene(path.to_owned()));
    }
    if word64(20) != payload.len() as u64 {
        return Err(damaged(&format!("{} bytes of state where {} are due", payload.len(), word64(20))));
    }
    if word32(28) != crc32fast::hash(payload) {
        return Err(damaged("the checksum does not fit"));
    }
    let plain = zstd::decode_all(payload).map_err(|error| damaged(&error.to_string()))?;
    postcard::from_bytes(&plain).map_err(|error| damaged(&error.to_string()))
}

/// The checkpoints in a folder, oldest first.
#[must_use]
pub fn list(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut paths: Vec<PathBuf> = entries.filter(|path| path.extension().is_some_and(|e| e == EXTENSION)).collect();
    paths.sort();
    paths
}

/// The newest checkpoint that can be used, with a line for each newer one that was refused.
///
/// # Errors
/// When none can be used.
pub fn newest_usable(folder: &Path, scene_hash: u64) -> Result<(PathBuf, Saved, Vec<String>), CheckpointError> {
    let mut refused = Vec::new();
    for path in list(folder).into_iter().rev() {
        match read(&path, Some(scene_hash)) {
            Ok(saved) => return Ok((path, saved, refused)),
            Err(error) => refused.push(error.to_string()),
        }
    }
    Err(CheckpointError::NoneUsable { folder: folder.to_owned(), refused })
}

/// Removes all but the newest `keep` checkpoints.
pub fn prune(folder: &Path, keep: usize) {
    let paths = list(folder);
    for path in paths.iter().rev().skip(keep.max(1)) {
        let _ = fs::remove_file(path); // a checkpoint that cannot be removed costs disk, not correctness
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn saved(step: u64) -> Saved {
        Saved {
            kind: "strands".into(),
            stepper: StepperState { step, time: 0.25, ..StepperState::default() },
            frames: 3,
            checkpoints: 1,
            series_bytes: 100,
            timings_bytes: 50,
            seconds: 1.5,
            system: (0..=255).collect(),
        }
    }

    #[test]
    fn what_is_written_is_read_back() {
        let dir = tempfile::tempdir().unwrap();
        let path = path_of(dir.path(), 7);
        write(&path, 42, &saved(7)).unwrap();
        assert_eq!(read(&path, Some(42)).unwrap(), saved(7));
        assert!(matches!(read(&path, Some(43)), Err(CheckpointError::OtherScene(_))));
        assert!(read(&path, None).is_ok());
    }

    #[test]
    fn damaged_and_foreign_files_are_refused_and_the_previous_one_is_used() {
        let dir = tempfile::tempdir().unwrap();
        for step in [1, 2, 3, 4] {
            write(&path_of(dir.path(), step), 42, &saved(step)).unwrap();
        }
        let newest = path_of(dir.path(), 4);
        let bytes = fs::read(&newest).unwrap();
        fs::write(&newest, &bytes[..bytes.len() - 5]).unwrap();
        let mut flipped = fs::read(path_of(dir.path(), 3)).unwrap();
        let last = flipped.len() - 1;
        flipped[last] ^= 1;
        fs::write(path_of(dir.path(), 3), flipped).unwrap();
        fs::write(dir.path().join("0000000009.vck"), b"some other program's file").unwrap();
        let (path, saved, refused) = newest_usable(dir.path(), 42).unwrap();
        assert_eq!(path, path_of(dir.path(), 2));
        assert_eq!(saved.stepper.step, 2);
        assert_eq!(refused.len(), 3);
        assert!(refused[0].contains("is not a Viscose checkpoint"));
        assert!(refused[1].contains("bytes of state"));
        assert!(refused[2].contains("checksum"));
    }

    #[test]
    fn every_truncation_is_an_error_not_a_panic() {
        let dir = tempfile::tempdir().unwrap();
        let path = path_of(dir.path(), 1);
        write(&path, 1, &saved(1)).unwrap();
        let bytes = fs::read(&path).unwrap();
        for length in 0..bytes.len() {
            fs::write(&path, &bytes[..length]).unwrap();
            assert!(read(&path, None).is_err(), "accepted {length} of {} bytes", bytes.len());
        }
    }

    #[test]
    fn pruning_keeps_the_newest() {
        let dir = tempfile::tempdir().unwrap();
        for step in 1..=5 {
            write(&path_of(dir.path(), step), 1, &saved(step)).unwrap();
        }
        prune(dir.path(), 2);
        assert_eq!(list(dir.path()), vec![path_of(dir.path(), 4), path_of(dir.path(), 5)]);
    }
}

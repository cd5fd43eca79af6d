//! The folder of one run: its files, and who may write into it.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The file by which a process holds the folder.
const LOCK: &str = ".lock";

/// How the names of files begin that are not in their place yet. A process that is killed leaves them behind.
const UNFINISHED: &str = ".unfinished-";

/// The right to write into a run's folder.
#[derive(Debug)]
pub struct TakenFolder {
    _file: fs::File,
}

/// Paths inside a run's folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RunFolder {
    root: PathBuf,
}

impl RunFolder {
    /// The folder at `root`; nothing is touched.
    #[must_use]
    pub fn at(root: impl Into<PathBuf>) -> RunFolder {
        RunFolder { root: root.into() }
    }

    /// The folder itself.
    #[must_use]
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// `scene.ron`, the scene as run.
    #[must_use]
    pub fn scene(&self) -> PathBuf {
        self.root.join("scene.ron")
    }

    /// `provenance.json`.
    #[must_use]
    pub fn provenance(&self) -> PathBuf {
        self.root.join("provenance.json")
    }

    /// `series.csv`.
    #[must_use]
    pub fn series(&self) -> PathBuf {
        self.root.join("series.csv")
    }

    /// `timings.csv`.
    #[must_use]
    pub fn timings(&self) -> PathBuf {
        self.root.join("timings.csv")
    }

    /// `frames/`.
    #[must_use]
    pub fn frames(&self) -> PathBuf {
        self.root.join("frames")
    }

    /// `checkpoints/`.
    #[must_use]
    pub fn checkpoints(&self) -> PathBuf {
        self.root.join("checkpoints")
    }

    /// `summary.json`.
    #[must_use]
    pub fn summary(&self) -> PathBuf {
        self.root.join("summary.json")
    }

    /// Whether a run has been here.
    #[must_use]
    pub fn holds_a_run(&self) -> bool {
        [self.scene(), self.series(), self.checkpoints(), self.summary()].iter().any(|path| path.exists())
    }

    /// Whether there is nothing here, or only the mark of a run that has just begun.
    #[must_use]
    pub fn is_bare(&self) -> bool {
        fs::read_dir(&self.root).is_ok_and(|entries| entries.flatten().all(|entry| entry.file_name() == LOCK))
    }

    /// Removes what a former run left, and nothing else. The checkpoints go last: whenever this is cut short, what is left still
    /// [holds a run](Self::holds_a_run) or is [bare](Self::is_bare).
    ///
    /// # Errors
    /// When the file system refuses.
    pub fn clear(&self) -> io::Result<()> {
        for file in [self.scene(), self.provenance(), self.series(), self.timings(), self.summary()] {
            remove_if_present(fs::remove_file(file))?;
        }
        for folder in [self.frames(), self.checkpoints()] {
            remove_if_present(fs::remove_dir_all(folder))?;
        }
        Ok(())
    }

    /// Takes the folder for this process, creating it if need be; it is free again when the guard is dropped or the process
    /// ends, however it ends. Waits up to `patience` for another process to leave. Files that a killed process left unfinished
    /// are removed.
    ///
    /// # Errors
    /// When the file system refuses.
    pub fn take(&self, patience: Duration) -> io::Result<Option<TakenFolder>> {
        fs::create_dir_all(&self.root)?;
        let file = fs::OpenOptions::new().create(true).truncate(false).write(true).open(self.root.join(LOCK))?;
        let give_up = Instant::now() + patience;
        loop {
            match file.try_lock() {
                Ok(()) => {
                    remove_unfinished(&self.root)?;
                    remove_unfinished(&self.checkpoints())?;
                    return Ok(Some(TakenFolder { _file: file }));
                }
                Err(fs::TryLockError::Error(error)) => return Err(error),
                Err(fs::TryLockError::WouldBlock) if Instant::now() >= give_up => return Ok(None),
                Err(fs::TryLockError::WouldBlock) => std::thread::sleep(Duration::from_millis(50)),
            }
        }
    }

    /// Creates the folder with its parts; the checkpoints first, by which a [run is known](Self::holds_a_run).
    ///
    /// # Errors
    /// When the file system refuses.
    pub fn create(&self) -> io::Result<()> {
        fs::create_dir_all(self.checkpoints())?;
        fs::create_dir_all(self.frames())
    }
}

fn remove_unfinished(folder: &Path) -> io::Result<()> {
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        entries => entries?,
    };
    for entry in entries.flatten().filter(|entry| entry.file_name().to_string_lossy().starts_with(UNFINISHED)) {
        remove_if_present(fs::remove_file(entry.path()))?;
    }
    Ok(())
}

fn remove_if_present(result: io::Result<()>) -> io::Result<()> {
    match result {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        other => other,
    }
}

/// Writes a small file so that a reader finds the old content or the new, never half of it.
///
/// # Errors
/// When the file system refuses.
pub fn write_atomically(path: &Path, content: &[u8]) -> io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    fs::create_dir_all(folder)?;
    let mut file = new_file_in(folder)?;
    file.write_all(content)?;
    file.as_file().sync_all()?;
    file.persist(path).map_err(|error| error.error)?;
    Ok(())
}

/// A new file in `folder`, to be written and then moved to its place. Others may read it, as far as the user's mask allows.
pub(super) fn new_file_in(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(UNFINISHED);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_for_one_writer_at_a_time() {
        let dir = tempfile::tempdir().unwrap();
        let folder = RunFolder::at(dir.path().join("run"));
        let first = folder.take(Duration::ZERO).unwrap();
        assert!(first.is_some());
        assert!(folder.take(Duration::from_millis(60)).unwrap().is_none());
        drop(first);
        assert!(folder.take(Duration::ZERO).unwrap().is_some());
        assert!(!folder.holds_a_run());
    }

    #[test]
    fn what_a_killed_process_left_unfinished_is_swept_away() {
        let dir = tempfile::tempdir().unwrap();
        let folder = RunFolder::at(dir.path().join("run"));
        fs::create_dir_all(folder.checkpoints()).unwrap();
        for place in [folder.root().to_owned(), folder.checkpoints()] {
            new_file_in(&place).unwrap().keep().unwrap();
        }
        let _taken = folder.take(Duration::ZERO).unwrap();
        assert_eq!(fs::read_dir(folder.checkpoints()).unwrap().count(), 0);
        folder.clear().unwrap();
        assert!(folder.is_bare());
    }

    #[test]
    fn clearing_removes_a_run_and_nothing_else() {
        let dir = tempfile::tempdir().unwrap();
        let folder = RunFolder::at(dir.path().join("run"));
        assert!(!folder.holds_a_run());
        folder.create().unwrap();
        write_atomically(&folder.summary(), b"{}").unwrap();
        let foreign = folder.root().join("notes.txt");
        fs::write(&foreign, "mine").unwrap();
        assert!(folder.holds_a_run());
        folder.clear().unwrap();
        assert!(!folder.holds_a_run());
        assert!(foreign.exists());
        folder.clear().unwrap();
    }
}

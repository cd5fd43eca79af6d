//! `series.csv` (physics and solver figures, the same bytes every time) and `timings.csv` (what the clock says).
//!
//! Rows are appended; a checkpoint notes how long each file was, and a resumed run cuts them back to that length.

use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::Path;

/// A growing CSV table that knows its own length in bytes.
#[derive(Debug)]
pub struct CsvTable {
    file: BufWriter<File>,
    length: u64,
}

impl CsvTable {
    /// Starts a new table with its header.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn create(path: &Path, header: &[String]) -> io::Result<CsvTable> {
        let mut table = CsvTable { file: BufWriter::new(File::create(path)?), length: 0 };
        table.line(&header.join(","))?;
        Ok(table)
    }

    /// Opens an existing table and cuts it to `length` bytes, where a checkpoint left it.
    ///
    /// # Errors
    /// When the file cannot be opened or is shorter than that.
    pub fn reopen(path: &Path, length: u64) -> io::Result<CsvTable> {
        let mut file = OpenOptions::new().read(true).write(true).open(path)?;
        let present = file.metadata()?.len();
        if present < length {
            let message = format!("{} has {present} bytes, the checkpoint expects at least {length}", path.display());
            return Err(io::Error::new(io::ErrorKind::UnexpectedEof, message));
        }
        file.set_len(length)?;
        file.seek(SeekFrom::End(0))?;
        Ok(CsvTable { file: BufWriter::new(file), length })
    }

    /// Appends one line.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn line(&mut self, line: &str) -> io::Result<()> {
        self.file.write_all(line.as_bytes())?;
        self.file.write_all(b"\n")?;
        self.length += line.len() as u64 + 1;
        Ok(())
    }

    /// Hands everything to the disk.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn sync(&mut self) -> io::Result<()> {
        self.file.flush()?;
        self.file.get_ref().sync_data()
    }

    /// Hands everything to the operating system, so that readers see it.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }

    /// Length in bytes, buffered lines included.
    #[must_use]
    pub fn length(&self) -> u64 {
        self.length
    }
}

/// Writes a number so that reading it back gives the same bits; whole numbers without a fraction.
pub fn push_number(line: &mut String, value: f64) {
    use std::fmt::Write as _;
    let magnitude = value.abs();
    // `{}` prints the shortest digits that read back exactly, but spells out long exponents digit by digit
    let written = if magnitude != 0.0 && !(1e-4..1e15).contains(&magnitude) {
        write!(line, "{value:e}")
    } else {
        write!(line, "{value}")
    };
    debug_assert!(written.is_ok(), "writing to a string cannot fail");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back_to_the_bit() {
        for value in [0.0, -0.0, 1.0, 1e-300, 1.0 / 3.0, 6.02214076e23, -2.5e-7, f64::MAX, f64::MIN_POSITIVE, 123456.75]
        {
            let mut line = String::new();
            push_number(&mut line, value);
            assert_eq!(line.parse::<f64>().unwrap().to_bits(), value.to_bits(), "{line}");
            assert!(line.len() < 25, "{line}");
        }
    }

    #[test]
    fn a_reopened_table_continues_where_the_checkpoint_was() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("series.csv");
        let mut table = CsvTable::create(&path, &["a".into(), "b".into()]).unwrap();
        table.line("1,2").unwrap();
        let mark = table.length();
        table.line("3,4").unwrap();
        table.sync().unwrap();
        drop(table);
        let mut table = CsvTable::reopen(&path, mark).unwrap();
        table.line("5,6").unwrap();
        table.sync().unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "a,b\n1,2\n5,6\n");
        assert!(CsvTable::reopen(&path, 1000).is_err());
    }
}

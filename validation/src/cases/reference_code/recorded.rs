//! What was recorded while the C++ reference code ran: its scenes and tables, read where they are.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Centimetres per metre: the tables are in CGS.
const CM: f64 = 100.0;

/// The folder of the recordings, or why there is none.
///
/// # Errors
/// A sentence that says how to name it.
pub fn folder() -> Result<PathBuf, String> {
    let root = match std::env::var_os("VISCOSE_REFERENCE") {
        Some(dir) => PathBuf::from(dir),
        None => Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/reference"),
    };
    let folder = root.join("creamystrand");
    if folder.is_dir() {
        return Ok(folder);
    }
    Err(format!(
        "the recordings of the C++ code are not in {}; name the folder of the reference data by VISCOSE_REFERENCE",
        folder.display()
    ))
}

/// A table of numbers with named columns.
pub struct Recorded {
    columns: BTreeMap<String, Vec<f64>>,
}

impl Recorded {
    /// Reads a table.
    ///
    /// # Errors
    /// When it is not there or holds something else than numbers.
    pub fn read(path: &Path) -> Result<Recorded, String> {
        let text = std::fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
        let mut lines = text.lines();
        let header: Vec<String> = lines.next().unwrap_or_default().split(',').map(str::to_owned).collect();
        let mut columns: BTreeMap<String, Vec<f64>> = header.iter().map(|name| (name.clone(), Vec::new())).collect();
        for (number, line) in lines.enumerate() {
            for (name, value) in header.iter().zip(line.split(',')) {
                let value = value
                    .trim()
                    .parse()
                    .map_err(|_| format!("{}:{}: `{value}` is no number", path.display(), number + 2))?;
                columns.entry(name.clone()).or_default().push(value);
            }
        }
        Ok(Recorded { columns })
    }

    /// A column as recorded; empty where there is none of that name.
    #[must_use]
    pub fn column(&self, name: &str) -> &[f64] {
        self.columns.get(name).map_or(&[], Vec::as_slice)
    }

    /// A length in metres, of the rows that `keep` chooses.
    fn lengths(&self, name: &str, keep: impl Fn(usize) -> bool) -> Vec<f64> {
        self.column(name).iter().enumerate().filter(|(row, _)| keep(*row)).map(|(_, x)| x / CM).collect()
    }

    /// Times of one strand's rows [s].
    #[must_use]
    pub fn times_of(&self, strand: usize) -> Vec<f64> {
        let rows = self.rows_of(strand);
        rows.iter().map(|row| self.column("time")[*row]).collect()
    }

    fn rows_of(&self, strand: usize) -> Vec<usize> {
        #[allow(clippy::cast_precision_loss)]
        let mine = |x: &f64| (x - strand as f64).abs() < 0.5;
        self.column("strand").iter().enumerate().filter(|(_, x)| mine(x)).map(|(row, _)| row).collect()
    }

    /// Positions of a point of a strand (`tip`, `mid`, `root`, `com`) [m].
    #[must_use]
    pub fn point_of(&self, strand: usize, point: &str) -> Vec<[f64; 3]> {
        let rows = self.rows_of(strand);
        let axis = |name: &str| self.lengths(&format!("{point}_{name}"), |row| rows.binary_search(&row).is_ok());
        let (x, y, z) = (axis("x"), axis("y"), axis("z"));
        x.into_iter().zip(y).zip(z).map(|((x, y), z)| [x, y, z]).collect()
    }

    /// A column of lengths [m], all rows.
    #[must_use]
    pub fn length(&self, name: &str) -> Vec<f64> {
        self.lengths(name, |_| true)
    }
}

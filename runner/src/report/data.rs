//! What a run's folder holds, read without complaint about what is missing.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde_json::{Map, Value};

use crate::record::folder::RunFolder;
use crate::record::frame_files::{self, FrameFiles};

/// A table read from CSV.
#[derive(Clone, Debug, Default)]
pub(super) struct Table {
    /// Column names.
    pub header: Vec<String>,
    /// Numbers, column after column; what is not a number is NaN.
    pub columns: Vec<Vec<f64>>,
    /// Words of the column `limiter`, row after row.
    pub limiter: Vec<String>,
    /// Lines that were cut short or malformed, and left out.
    pub damaged: usize,
}

impl Table {
    fn parse(text: &str) -> Table {
        let mut reader = csv::ReaderBuilder::new().flexible(true).from_reader(text.as_bytes());
        let header: Vec<String> = reader.headers().map(|h| h.iter().map(str::to_owned).collect()).unwrap_or_default();
        let mut table = Table { columns: vec![Vec::new(); header.len()], header, ..Table::default() };
        let limiter = table.index("limiter");
        let mut last_is_whole = false;
        for record in reader.records() {
            last_is_whole = false;
            let Some(record) = record.ok().filter(|r| r.len() == table.header.len()) else {
                table.damaged += 1;
                continue;
            };
            for (column, word) in table.columns.iter_mut().zip(&record) {
                column.push(word.parse().unwrap_or(f64::NAN));
            }
            if let Some(k) = limiter {
                table.limiter.push(record[k].to_owned());
            }
            last_is_whole = true;
        }
        // A line without its end may have lost digits.
        if last_is_whole && !text.ends_with('\n') {
            table.columns.iter_mut().for_each(|column| _ = column.pop());
            _ = table.limiter.pop();
            table.damaged += 1;
        }
        table
    }

    /// Which column has that name.
    pub fn index(&self, name: &str) -> Option<usize> {
        self.header.iter().position(|h| h == name)
    }

    /// The column of that name.
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        self.index(name).map(|k| self.columns[k].as_slice())
    }
}

/// Everything a page needs of one run.
#[derive(Clone, Debug, Default)]
pub(super) struct RunData {
    pub folder: PathBuf,
    pub scene: Option<String>,
    pub provenance: Option<Map<String, Value>>,
    pub summary: Option<Map<String, Value>>,
    pub series: Table,
    pub timings: Table,
    pub frames: Vec<FrameFiles>,
    pub checkpoints: usize,
    /// Sentences about what is missing or damaged.
    pub notes: Vec<String>,
}

impl RunData {
    /// Reads what is there.
    ///
    /// # Errors
    /// When a file or folder is there but the system refuses to read it.
    pub fn read(dir: &Path) -> io::Result<RunData> {
        let folder = RunFolder::at(dir);
        let mut run = RunData { folder: dir.to_owned(), ..RunData::default() };
        run.scene = text_of(&folder.scene())?;
        run.provenance = run.object(&folder.provenance(), "provenance.json")?;
        run.summary = run.object(&folder.summary(), "summary.json")?;
        for (path, name) in [(folder.series(), "series.csv"), (folder.timings(), "timings.csv")] {
            let table = text_of(&path)?.map(|text| Table::parse(&text));
            match &table {
                None => run.notes.push(format!("{name} is missing")),
                Some(table) if table.damaged > 0 => {
                    let damaged = table.damaged;
                    run.notes.push(format!(
                        "{name}: {damaged} line{} cut short or malformed, left out",
                        if damaged == 1 { "" } else { "s" }
                    ));
                }
                Some(_) => {}
            }
            let to = if name == "series.csv" { &mut run.series } else { &mut run.timings };
            *to = table.unwrap_or_default();
        }
        run.frames = frame_files::list(&folder.frames())?;
        run.checkpoints = match fs::read_dir(folder.checkpoints()) {
            Ok(entries) => entries.count(),
            Err(_) => 0,
        };
        Ok(run)
    }

    fn object(&mut self, path: &Path, name: &str) -> io::Result<Option<Map<String, Value>>> {
        let Some(text) = text_of(path)? else {
            self.notes.push(format!("{name} is missing"));
            return Ok(None);
        };
        match serde_json::from_str(&text) {
            Ok(Value::Object(map)) => Ok(Some(map)),
            _ => {
                self.notes.push(format!("{name} cannot be read"));
                Ok(None)
            }
        }
    }

    /// Whether nothing of a run was found.
    pub fn is_empty(&self) -> bool {
        self.scene.is_none() && self.summary.is_none() && self.series.header.is_empty() && self.frames.is_empty()
    }

    /// Title of the scene, or the folder's name.
    pub fn title(&self) -> String {
        let named = self.provenance.as_ref().and_then(|p| p.get("title")?.as_str()).filter(|t| !t.is_empty());
        named.map_or_else(|| self.folder.file_name().unwrap_or_default().to_string_lossy().into_owned(), str::to_owned)
    }

    /// The direction against gravity that the scene states, if it can be found in its text.
    pub fn up(&self) -> Option<[f64; 3]> {
        let text = self.scene.as_ref()?;
        let after = text.split("gravity").nth(1)?.trim_start().strip_prefix(':')?;
        let open = after.find(['(', '['])?;
        let inner = after.get(open + 1..)?.split([')', ']']).next()?;
        let numbers: Vec<f64> = inner.split(',').filter_map(|w| w.trim().parse().ok()).collect();
        let g: [f64; 3] = numbers.try_into().ok()?;
        let size = g.iter().map(|x| x * x).sum::<f64>().sqrt();
        (size > 0.0 && size.is_finite()).then(|| g.map(|x| 0.0 - x / size))
    }
}

fn text_of(path: &Path) -> io::Result<Option<String>> {
    match fs::read(path) {
        Ok(bytes) => Ok(Some(String::from_utf8_lossy(&bytes).into_owned())),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damaged_lines_are_left_out_and_counted() {
        let table = Table::parse("step,time,limiter\n1,0.5,end\n2,0.75\n3,1.0,rods: motion\n4,1.2,en");
        assert_eq!(table.columns[0], [1.0, 3.0]);
        assert_eq!(table.limiter, ["end", "rods: motion"]);
        assert_eq!(table.damaged, 2);
        assert!(Table::parse("").columns.is_empty());
    }

    #[test]
    fn up_is_against_gravity() {
        let up = |scene: &str| RunData { scene: Some(scene.into()), ..RunData::default() }.up();
        assert_eq!(up("Scene(gravity: [0, -981, 0], x: 1)"), Some([0.0, 1.0, 0.0]));
        assert_eq!(up("Scene(gravity:(0,0,-9.81))"), Some([0.0, 0.0, 1.0]));
        assert_eq!(up("Scene(gravity: (0, 0, 0))"), None);
        assert_eq!(up("Scene(title: \"no gravity\")"), None);
    }
}

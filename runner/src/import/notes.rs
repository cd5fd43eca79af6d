//! What became of every part of a foreign file that did not go into the scene as it stands.

use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Under which heading a note is listed; in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Heading {
    /// A file the scene needs is not there.
    Missing,
    /// The original uses it, the imported scene does not.
    NotHonoured,
    /// It is in the scene, but not with the same meaning.
    Changed,
    /// A fault of the file or of the original reader that whoever compares the two should know.
    Fault,
    /// The original reader never looks at it.
    Ignored,
    /// It steers the original's machinery and has no counterpart that could matter.
    Machinery,
}

impl Heading {
    const ALL: [Heading; 6] = [
        Heading::Missing,
        Heading::NotHonoured,
        Heading::Changed,
        Heading::Fault,
        Heading::Ignored,
        Heading::Machinery,
    ];

    /// The heading in words.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Heading::Missing => "Missing files",
            Heading::NotHonoured => "Not honoured: the original uses it, this scene does not",
            Heading::Changed => "Carried over with a difference",
            Heading::Fault => "Doubtful in the file or in the original program",
            Heading::Ignored => "Ignored by the original reader, so here as well",
            Heading::Machinery => "Machinery of the original without a counterpart",
        }
    }
}

/// One line of the list; what occurs often is counted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// Heading.
    pub heading: Heading,
    /// Line of the file where it occurs first (from 1); 0 for what belongs to no line.
    pub line: u32,
    /// How often it occurs.
    pub count: usize,
    /// What, as the file names it.
    pub what: String,
    /// Why, or what was done instead.
    pub why: String,
}

/// All notes on one file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Notes {
    /// Name of the file as shown.
    pub file: String,
    list: Vec<Note>,
    places: BTreeMap<(Heading, String, String), usize>,
    defaults: BTreeMap<String, Vec<String>>,
}

impl Notes {
    /// No notes yet.
    #[must_use]
    pub fn new(file: impl Into<String>) -> Notes {
        Notes { file: file.into(), ..Notes::default() }
    }

    /// Adds a note, or counts it where the same is there already.
    pub fn add(&mut self, heading: Heading, line: u32, what: impl Into<String>, why: impl Into<String>) {
        let (what, why) = (what.into(), why.into());
        let key = (heading, what.clone(), why.clone());
        if let Some(&place) = self.places.get(&key) {
            let note = &mut self.list[place];
            note.count += 1;
            note.line = note.line.min(line);
            return;
        }
        self.places.insert(key, self.list.len());
        self.list.push(Note { heading, line, count: 1, what, why });
    }

    /// Notes that a value of the original's own was taken because the file has none.
    pub fn assumed(&mut self, section: &str, name: &str, value: f64) {
        let line = format!("{name} {}", crate::scene::quantity::show_number(value));
        let values = self.defaults.entry(section.to_owned()).or_default();
        if !values.contains(&line) {
            values.push(line);
        }
    }

    /// Forgets the values taken for a section that does not matter after all.
    pub fn forget_assumed(&mut self, section: &str) {
        self.defaults.remove(section);
    }

    /// The notes under a heading, in the order of the file.
    #[must_use]
    pub fn under(&self, heading: Heading) -> Vec<&Note> {
        let mut notes: Vec<&Note> = self.list.iter().filter(|note| note.heading == heading).collect();
        notes.sort_by_key(|note| note.line);
        notes
    }

    /// Whether a file that the scene needs is missing.
    #[must_use]
    pub fn any_missing(&self) -> bool {
        self.list.iter().any(|note| note.heading == Heading::Missing)
    }

    /// How many notes there are under each heading, in words: `3 not honoured, 12 ignored`.
    #[must_use]
    pub fn counts(&self) -> String {
        let short = |heading| match heading {
            Heading::Missing => "missing",
            Heading::NotHonoured => "not honoured",
            Heading::Changed => "carried over with a difference",
            Heading::Fault => "doubtful",
            Heading::Ignored => "ignored by the original too",
            Heading::Machinery => "machinery",
        };
        let parts: Vec<String> = Heading::ALL
            .into_iter()
            .map(|heading| (self.under(heading).len(), short(heading)))
            .filter(|(count, _)| *count > 0)
            .map(|(count, words)| format!("{count} {words}"))
            .collect();
        if parts.is_empty() { "nothing left out".to_owned() } else { parts.join(", ") }
    }

    /// The whole list as text, one note a line with its place in the file.
    #[must_use]
    pub fn text(&self) -> String {
        let mut text = String::new();
        for heading in Heading::ALL {
            let notes = self.under(heading);
            if notes.is_empty() {
                continue;
            }
            let _ = writeln!(text, "{}:", heading.words());
            for note in notes {
                let place = match note.line {
                    0 => self.file.clone(),
                    line => format!("{}:{line}", self.file),
                };
                let often = if note.count > 1 { format!(" ({} times, first here)", note.count) } else { String::new() };
                let why = if note.why.is_empty() { String::new() } else { format!(": {}", note.why) };
                let _ = writeln!(text, "  {place}  {}{often}{why}", note.what);
            }
        }
        if !self.defaults.is_empty() {
            let _ = writeln!(text, "Not in the file, so the original's own value:");
            for (section, values) in &self.defaults {
                let _ = writeln!(text, "  {section}: {}", values.join(", "));
            }
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_notes_are_counted_at_the_first_place() {
        let mut notes = Notes::new("a.xml");
        notes.add(Heading::Ignored, 9, "particle/v", "");
        notes.add(Heading::Ignored, 4, "particle/v", "");
        notes.add(Heading::NotHonoured, 7, "pose", "no counterpart");
        notes.assumed("liquidinfo", "liquidDensity", 1.0);
        notes.assumed("liquidinfo", "liquidDensity", 1.0);
        let text = notes.text();
        assert!(text.contains("a.xml:4  particle/v (2 times, first here)\n"), "{text}");
        assert!(text.find("pose").unwrap() < text.find("particle/v").unwrap(), "{text}");
        assert!(text.ends_with("  liquidinfo: liquidDensity 1\n"), "{text}");
        assert_eq!(notes.counts(), "1 not honoured, 1 ignored by the original too");
        assert!(!notes.any_missing());
    }
}

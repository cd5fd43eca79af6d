//! Scenes of other programs: those of the C++ reference code (XML) to scene text.
//!
//! ```text
//! document, stream   XML with an account of everything that was read; numbers as the original reads them
//! original/          what the file says, part by part, with the names, defaults and quirks of its own reader
//! ease, replay       the original's scripts in time, and step by step
//! translate/         from what it says to a scene, as a tree of scene text (ron)
//! assets             files that the scene names
//! notes              what was not carried over, and why
//! ```
//!
//! Data flow: text → [`document::Document`] → [`original::Original`] → tree → scene text → our own reader, whose
//! complaints are brought back to the place in the XML they come from. Lengths are in cm throughout: the new scene says
//! `units: Cgs` and keeps the numbers of the file.

mod assets;
pub mod document;
mod ease;
pub mod notes;
pub mod original;
mod replay;
mod ron;
pub mod stream;
mod translate;

use crate::scene::edit::{Path as ScenePath, Step, follow, write};
use crate::scene::error::{Problem, ProblemKind, SceneError, SourceFile};
use crate::scene::tree::{Node, Span};
use document::Document;
use notes::Notes;
use original::Original;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// How to import.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ImportOptions {
    /// Folders in which files that the scene names are looked for first.
    pub assets: Vec<PathBuf>,
    /// As the original computes it, for comparison: scripts replayed step by step, film laws as printed, its flow map.
    pub parity: bool,
}

/// An imported scene.
#[derive(Clone, Debug)]
pub struct Imported {
    /// Scene text, with the notes as comments at its head.
    pub text: String,
    /// What was not carried over as it stands.
    pub notes: Notes,
}

/// Imports a scene file of the C++ reference code; file names in the new scene start from `folder`.
///
/// # Errors
/// Everything that makes the file unusable, with its place and what to write instead.
pub fn import(path: &Path, folder: &Path, options: &ImportOptions) -> Result<Imported, SceneError> {
    let name = path.display().to_string();
    let fail = |problem: Problem| SceneError::new(name.clone(), vec![problem]);
    let no_file = |message: String| {
        let problem = Problem::new(ProblemKind::File, message, Span::NONE, &[]);
        fail(problem.help("give the path of an XML scene of the C++ reference code"))
    };
    let bytes = match std::fs::metadata(path) {
        Ok(data) if !data.is_file() => return Err(no_file(format!("cannot read {name}: it is not a file"))),
        Ok(_) => std::fs::read(path).map_err(|error| no_file(format!("cannot read {name}: {error}")))?,
        Err(error) => return Err(no_file(format!("cannot read {name}: {error}"))),
    };
    let text = String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        let text = String::from_utf8_lossy(error.as_bytes()).into_owned();
        let files = [SourceFile { name: name.clone(), folder: PathBuf::new(), text }];
        let span = Span { file: 0, start: at, end: at + 1 };
        fail(Problem::new(ProblemKind::Syntax, "the file is not in UTF-8", span, &files).help("save it as UTF-8"))
    })?;
    import_text(&text, path, folder, options)
}

/// As [`import`], from text; `path` is shown in messages, and files are looked for beside it.
///
/// # Errors
/// As [`import`].
pub fn import_text(text: &str, path: &Path, folder: &Path, options: &ImportOptions) -> Result<Imported, SceneError> {
    let name = path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned());
    let fail = |problems: Vec<Problem>| SceneError::new(path.display().to_string(), problems);
    let document = Document::parse(text, &name).map_err(|problem| fail(vec![problem]))?;
    let root = document.root();
    if root.name() != "scene" {
        let message = format!("the file holds <{}>, not <scene>", root.name());
        document.problem(ProblemKind::Syntax, root.span(), message, "scenes of the C++ code are `<scene> … </scene>`");
        return Err(fail(document.take_problems()));
    }
    let original = Original::read(&document);
    let mut problems = document.take_problems();
    if !problems.is_empty() {
        return Err(fail(problems));
    }
    let tree = translate::translate(&document, &original, options, path, folder.to_owned());
    document.list_unread();
    problems = document.take_problems();
    let scene = write(&tree);
    let notes = document.take_notes();
    if problems.is_empty() {
        problems = complaints(&scene, &tree, folder, &document, &notes);
    }
    if !problems.is_empty() {
        return Err(fail(problems));
    }
    Ok(Imported { text: head(&original, &notes, options) + &scene, notes })
}

/// What our own reader says of the new scene, at the places of the XML that it comes from.
fn complaints(text: &str, tree: &Node, folder: &Path, document: &Document<'_>, notes: &Notes) -> Vec<Problem> {
    let Err(error) = crate::scene::load_str(text, folder.join("imported.ron"), &[]) else { return Vec::new() };
    let missing = |problem: &Problem| problem.kind == ProblemKind::File && notes.any_missing();
    let moved = |problem: Problem| {
        let span = place(tree, &problem.path);
        let path = problem.path.clone();
        let message =
            if path.is_empty() { problem.message } else { format!("{} (`{path}` of the scene)", problem.message) };
        let moved = Problem::new(problem.kind, message, span, document.files());
        moved.help(problem.help.unwrap_or_default())
    };
    error.problems.into_iter().filter(|problem| !missing(problem)).map(moved).collect()
}

/// The place in the XML that a place in the scene comes from: its own, or that of what is around it.
fn place(tree: &Node, path: &str) -> Span {
    let Ok(path) = ScenePath::parse(path) else { return Span::NONE };
    let steps: &[Step] = &path.0;
    (0..=steps.len())
        .rev()
        .map(|taken| follow(tree, &ScenePath(steps[..taken].to_vec())))
        .find(|(node, _)| node.span != Span::NONE)
        .map_or(Span::NONE, |(node, _)| node.span)
}

/// The comment at the head of the new scene.
fn head(original: &Original, notes: &Notes, options: &ImportOptions) -> String {
    let mut head = String::new();
    let how = if options.parity { " with --parity" } else { "" };
    let _ = writeln!(head, "// Imported from {}{how}: {}.", notes.file, notes.counts());
    if let Some(description) = &original.run.description {
        let _ = writeln!(head, "// The file says of itself: {}", description.replace('\n', " "));
    }
    for line in notes.text().lines() {
        let _ = writeln!(head, "// {line}");
    }
    head.push('\n');
    head
}

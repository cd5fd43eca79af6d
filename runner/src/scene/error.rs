//! What is wrong with a scene, where, and what to write instead.

use super::tree::{Span, SyntaxError};
use miette::{Diagnostic, LabeledSpan, NamedSource, SourceCode, SourceSpan};
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;

/// The kind of a problem; its [`code`](ProblemKind::code) is shown with the message and never changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ProblemKind {
    /// The text is not RON.
    Syntax,
    /// A value of another type was expected.
    Type,
    /// A field, variant or preset that does not exist.
    UnknownName,
    /// A required field is missing.
    MissingField,
    /// A number outside its range, or not finite.
    OutOfRange,
    /// Values that do not fit together.
    Inconsistent,
    /// A reference to something the scene does not define.
    UnknownReference,
    /// A file that could not be read.
    File,
    /// More memory or disk than any machine has.
    TooLarge,
    /// A `--set` that cannot be applied.
    Override,
}

impl ProblemKind {
    /// A stable code: `scene::out_of_range` and so on.
    #[must_use]
    pub fn code(self) -> &'static str {
        match self {
            ProblemKind::Syntax => "scene::syntax",
            ProblemKind::Type => "scene::type",
            ProblemKind::UnknownName => "scene::unknown_name",
            ProblemKind::MissingField => "scene::missing_field",
            ProblemKind::OutOfRange => "scene::out_of_range",
            ProblemKind::Inconsistent => "scene::inconsistent",
            ProblemKind::UnknownReference => "scene::unknown_reference",
            ProblemKind::File => "scene::file",
            ProblemKind::TooLarge => "scene::too_large",
            ProblemKind::Override => "scene::override",
        }
    }
}

/// One file of a scene, or one text given to the loader.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SourceFile {
    /// Name as shown in messages.
    pub name: String,
    /// Folder against which relative file names inside are resolved.
    pub folder: PathBuf,
    /// Content, after overrides.
    pub text: String,
}

/// One thing that is wrong, with its place in the text.
#[derive(Clone, Debug)]
pub struct Problem {
    /// Kind.
    pub kind: ProblemKind,
    /// What is wrong.
    pub message: String,
    /// What to write instead.
    pub help: Option<String>,
    /// Where in the scene: `strands[0].radius`; empty if it has no such place.
    pub path: String,
    /// Line (from 1) in the file; 0 if it belongs to no text.
    pub line: u32,
    /// Column (from 1, in characters); 0 if it belongs to no text.
    pub column: u32,
    /// Where in the text; [`Span::NONE`] if it belongs to no text.
    pub span: Span,
    source: Option<Arc<NamedSource<String>>>,
}

impl Problem {
    /// A problem at a place in one of `files`.
    #[must_use]
    pub fn new(kind: ProblemKind, message: impl Into<String>, span: Span, files: &[SourceFile]) -> Problem {
        let mut problem = Problem {
            kind,
            message: message.into(),
            help: None,
            path: String::new(),
            line: 0,
            column: 0,
            span,
            source: None,
        };
        if let Some(file) = files.get(span.file) {
            // A long value is marked on its first line only.
            let marked = file.text.get(span.start..span.end).unwrap_or("");
            problem.span.end = span.start + marked.find('\n').unwrap_or(marked.len());
            problem.source = Some(Arc::new(NamedSource::new(&file.name, file.text.clone())));
            let before = file.text.get(..span.start).unwrap_or(&file.text);
            problem.line = u32::try_from(before.matches('\n').count() + 1).unwrap_or(u32::MAX);
            let column = before.rsplit('\n').next().unwrap_or("").chars().count() + 1;
            problem.column = u32::try_from(column).unwrap_or(u32::MAX);
        }
        problem
    }

    /// The same with a help text.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Problem {
        self.help = Some(help.into());
        self
    }

    /// The same with one more sentence of help.
    #[must_use]
    pub fn note(mut self, note: &str) -> Problem {
        self.help = Some(match self.help.take() {
            Some(help) => format!("{help}\n{note}"),
            None => note.to_owned(),
        });
        self
    }

    /// The same with its place in the scene.
    #[must_use]
    pub fn at(mut self, path: impl Into<String>) -> Problem {
        self.path = path.into();
        self
    }

    /// From a syntax error.
    #[must_use]
    pub fn syntax(error: SyntaxError, files: &[SourceFile]) -> Problem {
        let mut problem = Problem::new(ProblemKind::Syntax, error.message, error.span, files);
        let plain = "a scene is written `Scene(field: value, list: [value, value], …)`";
        problem.help = Some(error.help.unwrap_or_else(|| plain.to_owned()));
        problem
    }

    /// Everything in one line: `scene.ron:12:9: message (help)`.
    #[must_use]
    pub fn one_line(&self) -> String {
        let place = match &self.source {
            Some(source) => format!("{}:{}:{}: ", source.name(), self.line, self.column),
            None => String::new(),
        };
        let help = self.help.as_ref().map_or(String::new(), |help| format!(" ({})", help.replace('\n', "; ")));
        format!("{place}{}{help}", self.message)
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Problem {}

impl Diagnostic for Problem {
    fn code<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        Some(Box::new(self.kind.code()))
    }

    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.help.as_ref().map(|help| Box::new(help) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.source.as_ref().map(|source| &**source as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        self.source.as_ref()?;
        let label = if self.path.is_empty() { "here".to_owned() } else { self.path.clone() };
        let length = self.span.end.saturating_sub(self.span.start);
        let span = SourceSpan::new(self.span.start.into(), length);
        Some(Box::new(std::iter::once(LabeledSpan::new_with_span(Some(label), span))))
    }
}

/// Why a scene was refused: every problem found, in the order of the text.
#[derive(Clone, Debug)]
pub struct SceneError {
    /// Name of the scene file.
    pub scene: String,
    /// At least one.
    pub problems: Vec<Problem>,
}

/// More problems than this are counted, not shown.
const SHOWN: usize = 20;

impl SceneError {
    /// From the problems found; the order becomes that of the text.
    #[must_use]
    pub fn new(scene: impl Into<String>, mut problems: Vec<Problem>) -> SceneError {
        problems.sort_by_key(|problem| (problem.span.file, problem.span.start));
        SceneError { scene: scene.into(), problems }
    }

    fn only(&self) -> Option<&Problem> {
        match self.problems.as_slice() {
            [problem] => Some(problem),
            _ => None,
        }
    }

    /// One line per problem, for logs and tables.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        self.problems.iter().map(Problem::one_line).collect()
    }
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.only() {
            Some(problem) => problem.fmt(f),
            None if self.problems.len() > SHOWN => {
                write!(f, "{} problems in {}, the first {SHOWN} are", self.problems.len(), self.scene)
            }
            None => write!(f, "{} problems in {}", self.problems.len(), self.scene),
        }
    }
}

impl std::error::Error for SceneError {}

impl Diagnostic for SceneError {
    fn code<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.only()?.code()
    }

    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        Diagnostic::help(self.only()?)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.only()?.source_code()
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        self.only()?.labels()
    }

    fn related<'a>(&'a self) -> Option<Box<dyn Iterator<Item = &'a dyn Diagnostic> + 'a>> {
        match self.only() {
            Some(_) => None,
            None => Some(Box::new(self.problems.iter().take(SHOWN).map(|problem| problem as &dyn Diagnostic))),
        }
    }
}

/// The candidate most like `found`, if one is near enough to be what was meant.
#[must_use]
pub fn nearest<'a>(found: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let plain = |text: &str| text.to_lowercase().replace(['_', '-', ' '], "");
    let wanted = plain(found);
    candidates
        .into_iter()
        .map(|candidate| (strsim::damerau_levenshtein(&wanted, &plain(candidate)), candidate))
        .filter(|&(distance, candidate)| distance <= 1 + candidate.len().max(found.len()) / 3)
        .min_by_key(|&(distance, _)| distance)
        .map(|(_, candidate)| candidate)
}

/// A help text for an unknown name: the nearest valid one first, then all.
#[must_use]
pub fn suggest(found: &str, what: &str, candidates: &[&str]) -> String {
    let all = || candidates.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    match (nearest(found, candidates.iter().copied()), candidates.len()) {
        (_, 0) => format!("there is no {what} here"),
        (Some(near), 1) => format!("did you mean `{near}`?"),
        (Some(near), _) => format!("did you mean `{near}`? Valid {what}s: {}", all()),
        (None, _) => format!("valid {what}s: {}", all()),
    }
}

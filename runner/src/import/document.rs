//! A foreign XML file as a tree that keeps account of what was read, so that nothing is left out in silence.
//!
//! Every element and attribute that a reader asks for is marked, and every name it asks for is remembered. What is
//! unmarked in the end is listed by [`Document::list_unread`], with the name that the author may have meant.

use super::notes::{Heading, Notes};
use super::stream;
use crate::scene::error::{Problem, ProblemKind, SourceFile};
use crate::scene::tree::Span;
use roxmltree::{Node as XmlNode, ParsingOptions};
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::path::PathBuf;

/// A value with the place where it stood ([`Span::NONE`] for a default).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sited<T> {
    /// The value.
    pub value: T,
    /// Where it stood.
    pub span: Span,
}

impl<T> Sited<T> {
    /// A value that stands nowhere in the file.
    pub fn made(value: T) -> Sited<T> {
        Sited { value, span: Span::NONE }
    }

    /// Another value of the same place.
    pub fn map<U>(self, change: impl FnOnce(T) -> U) -> Sited<U> {
        Sited { value: change(self.value), span: self.span }
    }
}

/// A number with its place.
pub type Number = Sited<f64>;

/// Most nodes that a file may have; far above any scene, far below what fills a machine.
const MAX_NODES: u32 = 50_000_000;
/// Files above this are refused \[bytes\]: offsets are kept in 32 bits.
const MAX_BYTES: usize = 2_000_000_000;

#[derive(Default)]
struct Account {
    elements: HashSet<usize>,
    attributes: HashSet<usize>,
    asked_elements: BTreeMap<String, BTreeSet<String>>,
    asked_attributes: BTreeMap<String, BTreeSet<String>>,
    /// Parents and names of elements of which only the first is read.
    first_only: HashSet<(usize, String)>,
}

/// An XML file under account.
pub struct Document<'i> {
    xml: roxmltree::Document<'i>,
    files: [SourceFile; 1],
    lines: Vec<usize>,
    account: RefCell<Account>,
    notes: RefCell<Notes>,
    problems: RefCell<Vec<Problem>>,
}

/// An element of it.
#[derive(Clone, Copy)]
pub struct Element<'a, 'i> {
    document: &'a Document<'i>,
    node: XmlNode<'a, 'i>,
}

impl<'i> Document<'i> {
    /// Reads XML text; `name` is shown in messages.
    ///
    /// # Errors
    /// What is no XML, with its place.
    pub fn parse(text: &'i str, name: &str) -> Result<Document<'i>, Problem> {
        let files = [SourceFile { name: name.to_owned(), folder: PathBuf::new(), text: text.to_owned() }];
        let refuse = |start: usize, message: String, help: &str| {
            let span = Span { file: 0, start, end: (start + 1).min(text.len()) };
            Problem::new(ProblemKind::Syntax, message, span, &files).help(help)
        };
        if text.len() > MAX_BYTES {
            return Err(refuse(0, format!("the file has {} bytes", text.len()), "at most 2 GB can be imported"));
        }
        let options = ParsingOptions { nodes_limit: MAX_NODES, ..ParsingOptions::default() };
        match roxmltree::Document::parse_with_options(text, options) {
            Ok(xml) => Ok(Document {
                xml,
                lines: std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect(),
                account: RefCell::default(),
                notes: RefCell::new(Notes::new(name)),
                problems: RefCell::default(),
                files,
            }),
            Err(error) => {
                let place = error.pos();
                let start = byte_at(text, place.row, place.col);
                let said = error.to_string();
                // the place is shown beside the message
                let said = said.rsplit_once(" at ").map_or(said.as_str(), |(before, _)| before);
                Err(refuse(
                    start,
                    format!("this is not XML: {said}"),
                    "scenes of the C++ code are `<scene> … </scene>`",
                ))
            }
        }
    }

    /// The root element.
    #[must_use]
    pub fn root(&self) -> Element<'_, 'i> {
        let node = self.xml.root_element();
        self.account.borrow_mut().elements.insert(node.id().get_usize());
        Element { document: self, node }
    }

    /// The file, for messages.
    #[must_use]
    pub fn files(&self) -> &[SourceFile] {
        &self.files
    }

    /// Line (from 1) of a place in the file; 0 for what stands nowhere.
    #[must_use]
    pub fn line(&self, span: Span) -> u32 {
        if span.file != 0 {
            return 0;
        }
        u32::try_from(self.lines.partition_point(|start| *start <= span.start)).unwrap_or(u32::MAX)
    }

    /// Adds a note.
    pub fn note(&self, heading: Heading, span: Span, what: impl Into<String>, why: impl Into<String>) {
        self.notes.borrow_mut().add(heading, self.line(span), what, why);
    }

    /// Notes that a value of the original's own was taken.
    pub fn assumed(&self, section: &str, name: &str, value: f64) {
        self.notes.borrow_mut().assumed(section, name, value);
    }

    /// Forgets the values taken for a section that does not matter after all.
    pub fn forget_assumed(&self, section: &str) {
        self.notes.borrow_mut().forget_assumed(section);
    }

    /// Records something that makes the file unusable.
    pub fn problem(&self, kind: ProblemKind, span: Span, message: impl Into<String>, help: impl Into<String>) {
        self.problems.borrow_mut().push(Problem::new(kind, message, span, &self.files).help(help));
    }

    /// Everything that makes the file unusable, so far.
    #[must_use]
    pub fn take_problems(&self) -> Vec<Problem> {
        self.problems.take()
    }

    /// The notes so far.
    #[must_use]
    pub fn take_notes(&self) -> Notes {
        self.notes.take()
    }

    /// Lists every element and attribute that no reader asked for.
    pub fn list_unread(&self) {
        let account = self.account.borrow();
        let read = |node: XmlNode<'_, '_>| account.elements.contains(&node.id().get_usize());
        for node in self.xml.descendants() {
            let name = node.tag_name().name();
            let Some(parent) = node.parent_element() else { continue };
            let owner = parent.tag_name().name();
            let path = if owner == "scene" { name.to_owned() } else { format!("{owner}/{name}") };
            if node.is_text() && read(parent) && node.text().is_some_and(|text| !text.trim().is_empty()) {
                self.note(
                    Heading::Ignored,
                    span_of(node.range()),
                    format!("text inside {owner}"),
                    "values stand in attributes",
                );
            }
            if !node.is_element() || !read(parent) {
                continue;
            }
            let span = Element { document: self, node }.span();
            if !read(node) {
                let first = account.first_only.contains(&(parent.id().get_usize(), name.to_owned()));
                let asked = account.asked_elements.get(owner);
                let why = if first { "only the first of its name counts".to_owned() } else { meant(name, asked) };
                self.note(Heading::Ignored, span, path + &shown_value(node), why);
                continue;
            }
            for attribute in node.attributes() {
                if !account.attributes.contains(&attribute.range().start) {
                    let why = meant(attribute.name(), account.asked_attributes.get(name));
                    let what = format!("{path}: attribute `{}`", attribute.name());
                    self.note(Heading::Ignored, span_of(attribute.range()), what, why);
                }
            }
        }
    }
}

/// The name that was perhaps meant: another spelling of it, or its beginning.
fn meant(name: &str, asked: Option<&BTreeSet<String>>) -> String {
    let plain = |text: &str| text.to_lowercase().replace(['_', '-'], "");
    let found = plain(name);
    let near = |known: &&String| {
        let known = plain(known);
        let slips = strsim::damerau_levenshtein(&found, &known);
        slips <= 1 + usize::from(found.len() > 8) && found.len() > 3 || known.len() > 6 && found.starts_with(&known)
    };
    let meant = asked.and_then(|names| names.iter().find(near));
    meant.map_or(String::new(), |known| format!("the reader knows `{known}`"))
}

/// The value of a parameter element, for the list.
fn shown_value(node: XmlNode<'_, '_>) -> String {
    node.attribute("value").map_or(String::new(), |value| format!(" = {}", shorten(value)))
}

/// At most a few words of a text.
#[must_use]
pub fn shorten(text: &str) -> String {
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    if text.chars().count() > 60 { text.chars().take(57).chain("…".chars()).collect() } else { text }
}

fn span_of(range: std::ops::Range<usize>) -> Span {
    Span { file: 0, start: range.start, end: range.end }
}

/// The byte at a line and column (both from 1, columns in characters).
fn byte_at(text: &str, row: u32, column: u32) -> usize {
    let row = (row as usize).max(1);
    let start = if row == 1 { 0 } else { text.match_indices('\n').nth(row - 2).map_or(text.len(), |(at, _)| at + 1) };
    let skipped = (column as usize).max(1) - 1;
    text[start..].char_indices().nth(skipped).map_or(text.len(), |(at, _)| start + at)
}

impl<'a, 'i> Element<'a, 'i> {
    /// The document it belongs to.
    #[must_use]
    pub fn document(&self) -> &'a Document<'i> {
        self.document
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> &'i str {
        self.node.tag_name().name()
    }

    /// Its opening tag.
    #[must_use]
    pub fn span(&self) -> Span {
        let range = self.node.range();
        let text = &self.document.files[0].text[range.clone()];
        let end = text.find('>').map_or(range.end, |at| range.start + at + 1);
        Span { file: 0, start: range.start, end }
    }

    fn ask_element(&self, name: &str) {
        let mut account = self.document.account.borrow_mut();
        account.asked_elements.entry(self.name().to_owned()).or_default().insert(name.to_owned());
    }

    fn take(&self, node: XmlNode<'a, 'i>) -> Element<'a, 'i> {
        self.document.account.borrow_mut().elements.insert(node.id().get_usize());
        Element { document: self.document, node }
    }

    /// The first element of a name inside; later ones stay unread, as in the original.
    #[must_use]
    pub fn child(&self, name: &str) -> Option<Element<'a, 'i>> {
        self.ask_element(name);
        let node = self.node.children().find(|node| node.is_element() && node.tag_name().name() == name)?;
        self.document.account.borrow_mut().first_only.insert((self.node.id().get_usize(), name.to_owned()));
        Some(self.take(node))
    }

    /// All elements of a name inside.
    #[must_use]
    pub fn children(&self, name: &str) -> Vec<Element<'a, 'i>> {
        self.ask_element(name);
        let named = self.node.children().filter(|node| node.is_element() && node.tag_name().name() == name);
        named.map(|node| self.take(node)).collect()
    }

    /// Marks everything in it as seen: it is listed as a whole.
    pub fn skip(&self) {
        let mut account = self.document.account.borrow_mut();
        for node in self.node.descendants().filter(|node| node.is_element()) {
            account.elements.insert(node.id().get_usize());
            account.attributes.extend(node.attributes().map(|attribute| attribute.range().start));
        }
    }

    /// An attribute as text.
    #[must_use]
    pub fn text(&self, name: &str) -> Option<Sited<&'a str>> {
        let attribute = self.node.attribute_node(name);
        let mut account = self.document.account.borrow_mut();
        let asked = account.asked_attributes.entry(self.name().to_owned()).or_default();
        if !asked.contains(name) {
            asked.insert(name.to_owned());
        }
        let attribute = attribute?;
        account.attributes.insert(attribute.range().start);
        Some(Sited { value: attribute.value(), span: span_of(attribute.range_value()) })
    }

    fn not_a(&self, wanted: &str, name: &str, text: Sited<&str>, example: &str) {
        let message = format!("`{name}` of {} must be {wanted}, found `{}`", self.name(), shorten(text.value));
        self.document.problem(ProblemKind::Type, text.span, message, example);
    }

    fn warn_trailing(&self, name: &str, text: Sited<&str>, read: &str) {
        let what = format!("{}: {name} = \"{}\"", self.name(), shorten(text.value));
        self.document.note(Heading::Fault, text.span, what, format!("read as {read}, as the original does"));
    }

    /// An attribute as a number.
    #[must_use]
    pub fn number(&self, name: &str) -> Option<Number> {
        let text = self.text(name)?;
        match stream::number(text.value) {
            Some(read) => {
                if read.trailing {
                    self.warn_trailing(name, text, &read.value.to_string());
                }
                Some(Sited { value: read.value, span: text.span })
            }
            None => {
                self.not_a("a finite number", name, text, "write a number such as `0.005` or `3.7e10`");
                None
            }
        }
    }

    /// An attribute as a whole number.
    #[must_use]
    pub fn integer(&self, name: &str) -> Option<Sited<i64>> {
        let text = self.text(name)?;
        match stream::integer(text.value) {
            Some(read) => {
                if read.trailing {
                    self.warn_trailing(name, text, &read.value.to_string());
                }
                Some(Sited { value: read.value, span: text.span })
            }
            None => {
                self.not_a("a whole number", name, text, "write a whole number such as `0` or `41`");
                None
            }
        }
    }

    /// An attribute as a switch, 0 or 1.
    #[must_use]
    pub fn flag(&self, name: &str) -> Option<Sited<bool>> {
        let text = self.text(name)?;
        let value = match text.value.trim() {
            "0" => false,
            "1" => true,
            "true" | "false" => {
                let what = format!("{}: {name} = \"{}\"", self.name(), text.value.trim());
                self.document.note(Heading::Fault, text.span, what, "the original stops here: it reads 0 and 1 only");
                text.value.trim() == "true"
            }
            _ => {
                self.not_a("0 or 1", name, text, "write `0` or `1`");
                return None;
            }
        };
        Some(Sited { value, span: text.span })
    }

    /// An attribute as three numbers with blanks between.
    #[must_use]
    pub fn vector(&self, name: &str) -> Option<Sited<[f64; 3]>> {
        let text = self.text(name)?;
        let numbers: Vec<Option<f64>> =
            text.value.split_whitespace().map(|word| stream::number(word).map(|read| read.value)).collect();
        match numbers.as_slice() {
            [Some(x), Some(y), Some(z)] => Some(Sited { value: [*x, *y, *z], span: text.span }),
            _ => {
                self.not_a("three finite numbers", name, text, "write three numbers such as `0 9.75 0`");
                None
            }
        }
    }

    /// Three attributes as a vector; those that are not there take the default.
    #[must_use]
    pub fn vector_of(&self, names: [&str; 3], default: [f64; 3]) -> Sited<[f64; 3]> {
        let mut vector = Sited { value: default, span: self.span() };
        for (place, name) in names.into_iter().enumerate() {
            if let Some(number) = self.number(name) {
                vector.value[place] = number.value;
            }
        }
        vector
    }

    /// A parameter `<name value="…"/>` inside.
    fn parameter(&self, name: &str) -> Option<Element<'a, 'i>> {
        let child = self.child(name)?;
        if child.text("value").is_none() {
            let message = format!("{}/{name} has no attribute `value`", self.name());
            self.document.problem(
                ProblemKind::MissingField,
                child.span(),
                message,
                format!("write `<{name} value=\"…\"/>`"),
            );
            return None;
        }
        Some(child)
    }

    /// A parameter as a number.
    #[must_use]
    pub fn parameter_number(&self, name: &str) -> Option<Number> {
        self.parameter(name)?.number("value")
    }

    /// A parameter as a whole number.
    #[must_use]
    pub fn parameter_integer(&self, name: &str) -> Option<Sited<i64>> {
        self.parameter(name)?.integer("value")
    }

    /// A parameter as a switch.
    #[must_use]
    pub fn parameter_flag(&self, name: &str) -> Option<Sited<bool>> {
        self.parameter(name)?.flag("value")
    }

    /// A parameter as a word.
    #[must_use]
    pub fn parameter_text(&self, name: &str) -> Option<Sited<&'a str>> {
        self.parameter(name)?.text("value")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_nobody_asked_for_is_listed_with_what_was_meant() {
        let text = "<scene>\n <a value=\"1\" extra=\"2\"/>\n <a value=\"3\"/>\n <gravty fy=\"1\"/>words\n</scene>";
        let document = Document::parse(text, "t.xml").unwrap();
        let root = document.root();
        assert_eq!(root.parameter_number("a").unwrap().value, 1.0);
        assert!(root.child("gravity").is_none());
        document.list_unread();
        let notes = document.take_notes().text();
        assert!(notes.contains("t.xml:2  a: attribute `extra`"), "{notes}");
        assert!(notes.contains("t.xml:3  a = 3: only the first of its name counts"), "{notes}");
        assert!(notes.contains("t.xml:4  gravty: the reader knows `gravity`"), "{notes}");
        assert!(notes.contains("text inside scene"), "{notes}");
        assert!(document.take_problems().is_empty());
    }

    #[test]
    fn broken_xml_is_refused_with_its_place() {
        for (text, line) in [("<scene>\n<a></b></scene>", 2), ("", 1), ("<scene>\n <a x='1' x='2'/></scene>", 2)] {
            let problem = Document::parse(text, "t.xml").err().unwrap();
            assert_eq!(problem.line, line, "{text}: {problem}");
            assert!(problem.help.is_some());
        }
    }

    #[test]
    fn deep_nesting_is_no_danger() {
        let deep = format!("{}{}", "<a>".repeat(200_000), "</a>".repeat(200_000));
        let _ = Document::parse(&deep, "t.xml").map(|document| document.list_unread());
    }
}

//! From a tree to typed values and back: the trait every field type of a scene has, and its plain implementations.

use super::edit::{Path, Step, write, write_number};
use super::error::{Problem, ProblemKind, SourceFile, suggest};
use super::quantity::{Quantity, Spec, Units};
use super::reference::{Book, Kind};
use super::tree::{Entry, Group, Node, Span, Value, parse_integer};
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// A type that a scene field can have.
pub trait Field: Clone + PartialEq {
    /// Whether the type is a group of named fields.
    const IS_SECTION: bool = false;

    /// Reads the value, converts it to SI and checks its range; problems go to `reading`, and then `None` comes back.
    fn decode(node: &Node, spec: &Spec, reading: &mut Reading<'_>) -> Option<Self>;

    /// The value as scene text would have it, in `units`.
    fn encode(&self, spec: &Spec, units: Units) -> Node;

    /// What the type is, for the reference page and the schema.
    fn describe(book: &mut Book) -> Kind;

    /// The value when nothing at all is written, if that is allowed.
    #[must_use]
    fn blank() -> Option<Self> {
        None
    }
}

/// The state of reading one scene: its files, its units, where the reader stands, and what was found wrong.
pub struct Reading<'a> {
    /// The files; spans point into them.
    pub files: &'a [SourceFile],
    /// Unit system of the numbers.
    pub units: Units,
    /// What was found wrong so far.
    pub problems: Vec<Problem>,
    /// Where the reader stands.
    pub path: Path,
}

impl<'a> Reading<'a> {
    /// Starts at the root.
    #[must_use]
    pub fn new(files: &'a [SourceFile], units: Units) -> Reading<'a> {
        Reading { files, units, problems: Vec::new(), path: Path::default() }
    }

    /// Records a problem here.
    pub fn problem(&mut self, kind: ProblemKind, span: Span, message: impl Into<String>, help: impl Into<String>) {
        let problem = Problem::new(kind, message, span, self.files).at(self.path.to_string()).help(help);
        self.problems.push(problem);
    }

    /// Records that a value of another type was expected.
    pub fn expected<T>(&mut self, node: &Node, wanted: &str, example: &str) -> Option<T> {
        let subject = self.subject();
        let message = format!("{subject} must be {wanted}, found {}", node.kind());
        self.problem(ProblemKind::Type, node.span, message, format!("write {example}"));
        None
    }

    /// The field under the reader, as a message names it.
    #[must_use]
    pub fn subject(&self) -> String {
        match self.path.0.last() {
            None => "the scene".to_owned(),
            Some(Step::Name(name)) => format!("`{name}`"),
            Some(Step::Index(_)) => {
                let names = self.path.0.iter().rposition(|step| matches!(step, Step::Name(_))).unwrap_or(0);
                format!("`{}`", Path(self.path.0[names..].to_vec()))
            }
        }
    }

    /// Does something one step further in.
    pub fn within<T>(&mut self, step: Step, work: impl FnOnce(&mut Self) -> T) -> T {
        self.path.0.push(step);
        let result = work(self);
        self.path.0.pop();
        result
    }
}

/// Reads one field of a section: its value, or its default when it is absent.
pub fn decode_entry<T: Field>(
    name: &str,
    node: Option<&Node>,
    spec: &Spec,
    default: Option<T>,
    section: Span,
    reading: &mut Reading<'_>,
) -> Option<T> {
    match node {
        Some(node) => reading.within(Step::Name(name.to_owned()), |reading| T::decode(node, spec, reading)),
        None if default.is_some() => default,
        None => {
            let place = match reading.path.0.last() {
                None => "the scene".to_owned(),
                Some(_) => reading.subject(),
            };
            let kind = T::describe(&mut Book::default());
            reading.problem(
                ProblemKind::MissingField,
                section,
                format!("{place} needs a field `{name}`"),
                format!("add `{name}: …` ({})", kind.words(spec, reading.units)),
            );
            None
        }
    }
}

/// The entries of a group, by the place of their field in `names`; unknown and repeated names are recorded.
///
/// Returns `None` where the value is no group at all, else one slot per name and whether all names were known.
pub fn section_entries<'n>(
    node: &'n Node,
    section: &str,
    names: &[&'static str],
    reading: &mut Reading<'_>,
) -> Option<(Vec<Option<&'n Node>>, bool)> {
    let group = match &node.value {
        Value::Group(group) => group,
        _ => {
            return reading.expected(
                node,
                "a group of named fields",
                &format!("`({}: …)`", names.first().unwrap_or(&"")),
            );
        }
    };
    let mut slots: Vec<Option<&Node>> = vec![None; names.len()];
    let mut sound = true;
    if let Some((name, span)) = &group.name
        && name != section
    {
        let message = format!("{} is a `{section}`, found `{name}(…)`", reading.subject());
        let help = format!("write `{section}(…)` or only `(…)`");
        reading.problem(ProblemKind::Type, span.unwrap_or(node.span), message, help);
        sound = false;
    }
    for (i, item) in group.items.iter().enumerate() {
        if i == 0 && !names.is_empty() {
            slots[0] = Some(item);
        } else {
            let message = format!("this value of {} has no name", reading.subject());
            reading.problem(
                ProblemKind::Type,
                item.span,
                message,
                format!("write `name: value`; {}", suggest("", "field", names)),
            );
            sound = false;
        }
    }
    for Entry { name, name_span, value } in &group.fields {
        match names.iter().position(|candidate| candidate == name) {
            Some(i) if slots[i].is_none() => slots[i] = Some(value),
            Some(_) => {
                let message = format!("`{name}` is given twice");
                reading.problem(ProblemKind::Inconsistent, *name_span, message, "keep one of the two");
                sound = false;
            }
            None => {
                let place = if reading.path.0.is_empty() { "a scene".to_owned() } else { format!("`{section}`") };
                let message = format!("{place} has no field `{name}`");
                reading.problem(ProblemKind::UnknownName, *name_span, message, suggest(name, "field", names));
                sound = false;
            }
        }
    }
    Some((slots, sound))
}

/// The variant a node names and the node of what it carries (the node without its name).
pub fn variant<'n>(
    node: &'n Node,
    names: &[&'static str],
    reading: &mut Reading<'_>,
) -> Option<(&'static str, Option<&'n Node>)> {
    let (found, span, payload) = match &node.value {
        Value::Name(name) => (name, node.span, None),
        Value::Group(Group { name: Some((name, span)), .. }) => (name, span.unwrap_or(node.span), Some(node)),
        _ => {
            let example = names.first().map_or(String::new(), |name| format!(", such as `{name}`"));
            let wanted = format!("one of {}", list_names(names));
            return reading.expected(node, &wanted, &format!("the name first{example}"));
        }
    };
    match names.iter().find(|name| *name == found) {
        Some(name) => Some((name, payload)),
        None => {
            let message = format!("{} cannot be `{found}`", reading.subject());
            reading.problem(ProblemKind::UnknownName, span, message, suggest(found, "name", names));
            None
        }
    }
}

/// Names in backquotes with commas.
#[must_use]
pub fn list_names(names: &[&str]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

/// Reads what a variant carries.
pub fn decode_payload<T: Field>(
    name: &str,
    node: &Node,
    payload: Option<&Node>,
    spec: &Spec,
    reading: &mut Reading<'_>,
) -> Option<T> {
    let empty = Node { span: node.span, value: Value::Group(Group::default()) };
    let Some(Node { span, value: Value::Group(group) }) = payload else {
        if T::IS_SECTION {
            return T::decode(&empty, spec, reading);
        }
        let kind = T::describe(&mut Book::default()).words(spec, reading.units);
        return reading.expected(node, &format!("`{name}(…)`"), &format!("`{name}(…)` with {kind} inside"));
    };
    if !T::IS_SECTION && group.items.len() == 1 && group.fields.is_empty() {
        return T::decode(&group.items[0], spec, reading);
    }
    // `Variant((field: …))` is plain RON for `Variant(field: …)`.
    if T::IS_SECTION
        && let [only] = group.items.as_slice()
        && group.fields.is_empty()
        && matches!(&only.value, Value::Group(Group { name: None, items, .. }) if items.is_empty())
    {
        return T::decode(only, spec, reading);
    }
    let bare = Node { span: *span, value: Value::Group(Group { name: None, ..group.clone() }) };
    T::decode(&bare, spec, reading)
}

/// A variant and what it carries as a node.
#[must_use]
pub fn encode_payload<T: Field>(name: &str, value: &T, spec: &Spec, units: Units) -> Node {
    let inner = value.encode(spec, units);
    let name = Some((name.to_owned(), None));
    match inner.value {
        Value::Group(group) if T::IS_SECTION && group.name.is_none() => {
            Node::made(Value::Group(Group { name, ..group }))
        }
        _ => Node::made(Value::Group(Group { name, items: vec![inner], fields: Vec::new() })),
    }
}

/// Reads a finite number in its range, in SI.
pub fn decode_number(node: &Node, spec: &Spec, reading: &mut Reading<'_>) -> Option<f64> {
    let Value::Number(text) = &node.value else {
        let unit = spec.quantity.unit(reading.units);
        let wanted = if unit.is_empty() { "a number".to_owned() } else { format!("a number [{unit}]") };
        return reading.expected(node, &wanted, "a number such as 12, 0.5 or 1e-3");
    };
    #[allow(clippy::cast_precision_loss)]
    let written =
        text.parse::<f64>().ok().or_else(|| parse_integer(text).map(|value| value as f64)).unwrap_or(f64::NAN);
    if !written.is_finite() {
        let message = format!("{} = {text} is not a finite number", reading.subject());
        let help = format!("it must be {}", spec.range.show(spec.quantity, reading.units));
        reading.problem(ProblemKind::OutOfRange, node.span, message, help);
        return None;
    }
    let value = spec.quantity.to_si(written, reading.units);
    if !spec.range.contains(value) || !value.is_finite() {
        let unit = spec.quantity.unit(reading.units);
        let space = if unit.is_empty() || unit == "°" { "" } else { " " };
        let message = format!("{} = {text}{space}{unit} is out of range", reading.subject());
        let help = format!("it must be {}", spec.range.show(spec.quantity, reading.units));
        reading.problem(ProblemKind::OutOfRange, node.span, message, help);
        return None;
    }
    Some(value)
}

impl Field for f64 {
    fn decode(node: &Node, spec: &Spec, reading: &mut Reading<'_>) -> Option<f64> {
        decode_number(node, spec, reading)
    }

    fn encode(&self, spec: &Spec, units: Units) -> Node {
        Node::made(Value::Number(write_number(spec.quantity.from_si_exact(*self, units))))
    }

    fn describe(_book: &mut Book) -> Kind {
        Kind::Number
    }
}

macro_rules! integer_field {
    ($($int:ty),*) => { $(
        impl Field for $int {
            fn decode(node: &Node, spec: &Spec, reading: &mut Reading<'_>) -> Option<$int> {
                let whole = match &node.value {
                    Value::Number(text) => parse_integer(text),
                    _ => None,
                };
                let Some(whole) = whole else {
                    return reading.expected(node, "a whole number", "a whole number such as 80");
                };
                #[allow(clippy::cast_precision_loss)]
                let inside = spec.range.contains(whole as f64);
                match <$int>::try_from(whole) {
                    Ok(value) if inside => Some(value),
                    _ => {
                        let message = format!("{} = {whole} is out of range", reading.subject());
                        let help = if spec.range.is_any() || inside {
                            format!("it must be a whole number from {} to {}", <$int>::MIN, <$int>::MAX)
                        } else {
                            format!("it must be {}", spec.range.show(Quantity::Number, reading.units))
                        };
                        reading.problem(ProblemKind::OutOfRange, node.span, message, help);
                        None
                    }
                }
            }

            fn encode(&self, _spec: &Spec, _units: Units) -> Node {
                Node::made(Value::Number(self.to_string()))
            }

            fn describe(_book: &mut Book) -> Kind {
                Kind::Integer
            }
        }
    )* };
}

integer_field!(u32, u64, usize);

impl Field for bool {
    fn decode(node: &Node, _spec: &Spec, reading: &mut Reading<'_>) -> Option<bool> {
        match node.value {
            Value::Bool(value) => Some(value),
            _ => reading.expected(node, "true or false", "`true` or `false`"),
        }
    }

    fn encode(&self, _spec: &Spec, _units: Units) -> Node {
        Node::made(Value::Bool(*self))
    }

    fn describe(_book: &mut Book) -> Kind {
        Kind::Bool
    }
}

impl Field for String {
    fn decode(node: &Node, _spec: &Spec, reading: &mut Reading<'_>) -> Option<String> {
        match &node.value {
            Value::Text(text) => Some(text.clone()),
            Value::Name(name) => reading.expected(node, "a text", &format!("it in quotes: \"{name}\"")),
            _ => reading.expected(node, "a text", "a text in quotes, such as \"hair\""),
        }
    }

    fn encode(&self, _spec: &Spec, _units: Units) -> Node {
        Node::made(Value::Text(self.clone()))
    }

    fn describe(_book: &mut Book) -> Kind {
        Kind::Text
    }
}

/// The name of a file, relative to the scene file that mentions it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileName {
    /// As written.
    pub written: String,
    /// Where the file is.
    pub path: PathBuf,
}

impl Field for FileName {
    fn decode(node: &Node, spec: &Spec, reading: &mut Reading<'_>) -> Option<FileName> {
        let written = String::decode(node, spec, reading)?;
        let folder = reading.files.get(node.span.file).map(|file| file.folder.clone()).unwrap_or_default();
        Some(FileName { path: folder.join(&written), written })
    }

    fn encode(&self, _spec: &Spec, _units: Units) -> Node {
        Node::made(Value::Text(self.written.clone()))
    }

    fn describe(_book: &mut Book) -> Kind {
        Kind::Text
    }
}

impl<T: Field> Field for Option<T> {
    fn decode(node: &Node, spec: &Spec, reading: &mut Reading<'_>) -> Option<Option<T>> {
        match &node.value {
            Value::Name(name) if name == "None" => Some(None),
            Value::Group(Group { name: Some((name, _)), items, fields }) if name == "Some" && fields.is_empty() => {
                match items.as_slice() {
                    [item] => T::decode(item, spec, reading).map(Some),
                    _ => reading.expected(node, "`Some(value)`", "only the value"),
                }
            }
            _ => T::decode(node, spec, reading).map(Some),
        }
    }

    fn encode(&self, spec: &Spec, units: Units) -> Node {
        match self {
            Some(value) => value.encode(spec, units),
            None => Node::made(Value::Name("None".to_owned())),
        }
    }

    fn describe(book: &mut Book) -> Kind {
        Kind::Optional(Box::new(T::describe(book)))
    }
}

impl<T: Field> Field for Vec<T> {
    fn decode(node: &Node, spec: &Spec, reading: &mut Reading<'_>) -> Option<Vec<T>> {
        let items = match &node.value {
            Value::List(items) => items,
            Value::Group(Group { name: None, items, fields }) if fields.is_empty() && items.len() != 1 => items,
            _ => return reading.expected(node, "a list", "a list `[…]`"),
        };
        let decoded: Vec<Option<T>> = items
            .iter()
            .enumerate()
            .map(|(i, item)| reading.within(Step::Index(i), |reading| T::decode(item, spec, reading)))
            .collect();
        decoded.into_iter().collect()
    }

    fn encode(&self, spec: &Spec, units: Units) -> Node {
        Node::made(Value::List(self.iter().map(|item| item.encode(spec, units)).collect()))
    }

    fn describe(book: &mut Book) -> Kind {
        Kind::List(Box::new(T::describe(book)))
    }
}

impl<T: Field> Field for BTreeMap<String, T> {
    fn decode(node: &Node, spec: &Spec, reading: &mut Reading<'_>) -> Option<Self> {
        let Value::Map(entries) = &node.value else {
            return reading.expected(node, "a map of names", "`{ \"name\": … }`");
        };
        let mut map = BTreeMap::new();
        let mut sound = true;
        for (key, value) in entries {
            let Value::Text(name) = &key.value else {
                sound = false;
                reading.expected::<()>(key, "a map of names in quotes", "the name as a text: \"hair\"");
                continue;
            };
            let decoded = reading.within(Step::Name(name.clone()), |reading| T::decode(value, spec, reading));
            match decoded {
                Some(decoded) => {
                    if map.insert(name.clone(), decoded).is_some() {
                        sound = false;
                        let message = format!("the name \"{name}\" is used twice in {}", reading.subject());
                        reading.problem(ProblemKind::Inconsistent, key.span, message, "give one of them another name");
                    }
                }
                None => sound = false,
            }
        }
        sound.then_some(map)
    }

    fn encode(&self, spec: &Spec, units: Units) -> Node {
        let entries = self.iter().map(|(key, value)| (Node::made(Value::Text(key.clone())), value.encode(spec, units)));
        Node::made(Value::Map(entries.collect()))
    }

    fn describe(book: &mut Book) -> Kind {
        Kind::Map(Box::new(T::describe(book)))
    }
}

/// Reads exactly `N` numbers, written `[a, b]` or `(a, b)`.
pub fn decode_numbers<const N: usize>(
    node: &Node,
    spec: &Spec,
    example: &str,
    reading: &mut Reading<'_>,
) -> Option<[f64; N]> {
    let items = match &node.value {
        Value::List(items) => items,
        Value::Group(Group { name: None, items, fields }) if fields.is_empty() => items,
        _ => return reading.expected(node, &format!("{N} numbers"), example),
    };
    if items.len() != N {
        let message = format!("{} must be {N} numbers, found {}", reading.subject(), items.len());
        reading.problem(ProblemKind::Type, node.span, message, format!("write {example}"));
        return None;
    }
    let mut numbers = [0.0; N];
    let mut sound = true;
    for (i, item) in items.iter().enumerate() {
        match reading.within(Step::Index(i), |reading| decode_number(item, spec, reading)) {
            Some(number) => numbers[i] = number,
            None => sound = false,
        }
    }
    sound.then_some(numbers)
}

/// A list of numbers as a node.
#[must_use]
pub fn encode_numbers(numbers: &[f64], spec: &Spec, units: Units) -> Node {
    Node::made(Value::List(numbers.iter().map(|number| number.encode(spec, units)).collect()))
}

impl Field for Vector3<f64> {
    fn decode(node: &Node, spec: &Spec, reading: &mut Reading<'_>) -> Option<Self> {
        decode_numbers::<3>(node, spec, "a vector `[x, y, z]`", reading).map(Vector3::from)
    }

    fn encode(&self, spec: &Spec, units: Units) -> Node {
        encode_numbers(self.as_slice(), spec, units)
    }

    fn describe(_book: &mut Book) -> Kind {
        Kind::Vector
    }
}

/// Writes a value as scene text on one line, for defaults on the reference page.
#[must_use]
pub fn show_value<T: Field>(value: &T, spec: &Spec, units: Units) -> String {
    write(&value.encode(spec, units)).trim_end().to_owned()
}

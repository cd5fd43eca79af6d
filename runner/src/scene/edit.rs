//! Places in a scene: finding them, changing the text there (`--set`), and writing a tree back as text.

use super::tree::{Entry, Group, Node, Span, Value};
use std::fmt;

/// One step of a path into a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Step {
    /// A field, or the key of a map.
    Name(String),
    /// A place in a list.
    Index(usize),
}

/// A place in a scene: `strands[0].clamp[1]`, `materials.hair.density`.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Path(pub Vec<Step>);

impl Path {
    /// Reads `strands[0].radius`; keys with unusual characters stand in quotes: `materials."my hair".density`.
    ///
    /// # Errors
    /// Says what is wrong with the path.
    pub fn parse(text: &str) -> Result<Path, String> {
        let mut steps = Vec::new();
        let mut rest = text.trim();
        loop {
            if let Some(after) = rest.strip_prefix('[') {
                let Some((digits, after)) = after.split_once(']') else {
                    return Err(format!("`[` without `]` in `{text}`"));
                };
                let index =
                    digits.trim().parse().map_err(|_| format!("`[{digits}]` in `{text}` is not a place in a list"))?;
                steps.push(Step::Index(index));
                rest = after;
            } else {
                let rest_of_name = if steps.is_empty() { rest } else { rest.strip_prefix('.').unwrap_or(rest) };
                let (name, after) = match rest_of_name.strip_prefix('"') {
                    Some(quoted) => quoted.split_once('"').ok_or_else(|| format!("`\"` is not closed in `{text}`"))?,
                    None => rest_of_name.split_at(rest_of_name.find(['.', '[']).unwrap_or(rest_of_name.len())),
                };
                if name.is_empty() {
                    return Err(format!("`{text}` is not a path such as `strands[0].radius`"));
                }
                steps.push(Step::Name(name.to_owned()));
                rest = after;
            }
            match rest.chars().next() {
                None => return Ok(Path(steps)),
                Some('.' | '[') => {}
                Some(_) => return Err(format!("`{text}` is not a path such as `strands[0].radius`")),
            }
        }
    }

    /// The path one step further.
    #[must_use]
    pub fn then(&self, step: Step) -> Path {
        let mut steps = self.0.clone();
        steps.push(step);
        Path(steps)
    }

    /// The path one field further.
    #[must_use]
    pub fn field(&self, name: &str) -> Path {
        self.then(Step::Name(name.to_owned()))
    }

    /// The path one index further.
    #[must_use]
    pub fn index(&self, index: usize) -> Path {
        self.then(Step::Index(index))
    }
}

impl fmt::Display for Path {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, step) in self.0.iter().enumerate() {
            match step {
                Step::Index(index) => write!(f, "[{index}]")?,
                Step::Name(name) => {
                    let dot = if i == 0 { "" } else { "." };
                    if is_name(name) { write!(f, "{dot}{name}")? } else { write!(f, "{dot}{}", quote(name))? }
                }
            }
        }
        Ok(())
    }
}

fn is_name(text: &str) -> bool {
    text.chars().next().is_some_and(|c| c.is_alphabetic() || c == '_')
        && text.chars().all(|c| c.is_alphanumeric() || matches!(c, '_' | '-'))
}

/// Text in double quotes, as scene files write it.
#[must_use]
pub fn quote(text: &str) -> String {
    let mut quoted = String::with_capacity(text.len() + 2);
    quoted.push('"');
    for c in text.chars() {
        match c {
            '"' => quoted.push_str("\\\""),
            '\\' => quoted.push_str("\\\\"),
            '\n' => quoted.push_str("\\n"),
            '\t' => quoted.push_str("\\t"),
            '\r' => quoted.push_str("\\r"),
            c => quoted.push(c),
        }
    }
    quoted.push('"');
    quoted
}

/// The part of a node that one step leads to.
fn child<'a>(node: &'a Node, step: &Step) -> Option<&'a Node> {
    match (&node.value, step) {
        (Value::Group(group), Step::Name(name)) => {
            group.fields.iter().find(|entry| entry.name == *name).map(|entry| &entry.value)
        }
        (Value::Map(entries), Step::Name(name)) => entries
            .iter()
            .find(|(key, _)| matches!(&key.value, Value::Text(text) | Value::Name(text) if text == name))
            .map(|(_, value)| value),
        (Value::List(items), Step::Index(index)) => items.get(*index),
        (Value::Group(group), Step::Index(index)) => group.items.get(*index),
        _ => None,
    }
}

/// Follows a path as far as the text goes: the deepest node on it, and how many steps were taken.
#[must_use]
pub fn follow<'a>(root: &'a Node, path: &Path) -> (&'a Node, usize) {
    let mut node = root;
    for (taken, step) in path.0.iter().enumerate() {
        match child(node, step) {
            Some(next) => node = next,
            None => return (node, taken),
        }
    }
    (node, path.0.len())
}

/// Follows a path as far as it goes, taking an unnamed first value (`First(2)`) for whichever field it stands for.
#[must_use]
pub fn follow_loosely<'a>(root: &'a Node, path: &Path) -> &'a Node {
    let mut node = root;
    for step in &path.0 {
        let first = match (&node.value, step) {
            (Value::Group(group), Step::Name(_)) => group.items.first(),
            _ => None,
        };
        match child(node, step).or(first) {
            Some(next) => node = next,
            None => return node,
        }
    }
    node
}

/// A change of one stretch of text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Edit {
    /// Text that goes away (empty for an insertion).
    pub span: Span,
    /// Text that comes.
    pub text: String,
}

/// The edit that gives the place `path` the value `value` (scene text), adding fields that are not there yet.
///
/// # Errors
/// Says why the path leads nowhere.
pub fn edit_for(root: &Node, path: &Path, value: &str) -> Result<Edit, String> {
    let (node, taken) = follow(root, path);
    let missing = &path.0[taken..];
    let Some((first, others)) = missing.split_first() else {
        return Ok(Edit { span: node.span, text: value.to_owned() });
    };
    let here = Path(path.0[..taken].to_vec());
    let here = if taken == 0 { "the scene".to_owned() } else { format!("`{here}`") };
    if let (Value::Map(_), Step::Name(name), false) = (&node.value, first, others.is_empty()) {
        return Err(format!("{here} has no entry \"{name}\""));
    }
    let mut text = value.to_owned();
    for step in others.iter().rev() {
        let Step::Name(name) = step else {
            return Err(format!("{here} has no {}", describe(first)));
        };
        text = format!("({name}: {text})");
    }
    let at_end = |last: Option<usize>, addition: String| match last {
        Some(end) => Edit { span: Span { start: end, end, ..node.span }, text: format!(", {addition}") },
        None => Edit { span: Span { start: node.span.end - 1, end: node.span.end - 1, ..node.span }, text: addition },
    };
    match (&node.value, first) {
        (Value::Group(group), Step::Name(name)) => {
            let last = group.fields.last().map(|entry| entry.value.span.end);
            let last = last.or(group.items.last().map(|item| item.span.end));
            Ok(at_end(last, format!("{name}: {text}")))
        }
        (Value::Map(entries), Step::Name(name)) => {
            Ok(at_end(entries.last().map(|(_, value)| value.span.end), format!("{}: {text}", quote(name))))
        }
        (Value::Name(variant), Step::Name(name)) => {
            Ok(Edit { span: node.span, text: format!("{variant}({name}: {text})") })
        }
        (Value::List(items), Step::Index(index)) if *index == items.len() => {
            Ok(at_end(items.last().map(|item| item.span.end), text))
        }
        (Value::List(items), Step::Index(index)) => Err(format!(
            "{here} has {} entries, so there is no [{index}]; the first is [0]{}",
            items.len(),
            if items.is_empty() { String::new() } else { format!(", the last [{}]", items.len() - 1) }
        )),
        (_, step) => Err(format!("{here} is {} and has no {}", node.kind(), describe(step))),
    }
}

fn describe(step: &Step) -> String {
    match step {
        Step::Name(name) => format!("field `{name}`"),
        Step::Index(index) => format!("[{index}]"),
    }
}

/// A number as scene text: the shortest digits that give the same `f64`, always with a point or exponent.
#[must_use]
pub fn write_number(value: f64) -> String {
    let magnitude = value.abs();
    if value == 0.0 || (1e-4..1e7).contains(&magnitude) { format!("{value:?}") } else { format!("{value:e}") }
}

/// Writes a tree as scene text, one field a line in large groups.
#[must_use]
pub fn write(node: &Node) -> String {
    let mut text = String::new();
    write_node(node, 0, &mut text);
    text.push('\n');
    text
}

const LINE: usize = 100;

fn write_node(node: &Node, indent: usize, out: &mut String) {
    let flat = write_flat(node);
    if flat.len() + 4 * indent <= LINE {
        out.push_str(&flat);
        return;
    }
    let inner = "    ".repeat(indent + 1);
    let outer = "    ".repeat(indent);
    match &node.value {
        Value::List(items) => {
            out.push_str("[\n");
            for item in items {
                out.push_str(&inner);
                write_node(item, indent + 1, out);
                out.push_str(",\n");
            }
            out.push_str(&format!("{outer}]"));
        }
        Value::Map(entries) => {
            out.push_str("{\n");
            for (key, value) in entries {
                out.push_str(&format!("{inner}{}: ", write_flat(key)));
                write_node(value, indent + 1, out);
                out.push_str(",\n");
            }
            out.push_str(&format!("{outer}}}"));
        }
        Value::Group(Group { name, items, fields }) => {
            out.push_str(name.as_ref().map_or("", |(name, _)| name));
            out.push_str("(\n");
            for item in items {
                out.push_str(&inner);
                write_node(item, indent + 1, out);
                out.push_str(",\n");
            }
            for Entry { name, value, .. } in fields {
                out.push_str(&format!("{inner}{name}: "));
                write_node(value, indent + 1, out);
                out.push_str(",\n");
            }
            out.push_str(&format!("{outer})"));
        }
        _ => out.push_str(&flat),
    }
}

fn write_flat(node: &Node) -> String {
    let list = |items: &[Node]| items.iter().map(write_flat).collect::<Vec<_>>().join(", ");
    match &node.value {
        Value::Bool(value) => value.to_string(),
        Value::Number(text) | Value::Name(text) => text.clone(),
        Value::Text(text) => quote(text),
        Value::List(items) => format!("[{}]", list(items)),
        Value::Map(entries) => {
            let entries: Vec<_> =
                entries.iter().map(|(key, value)| format!("{}: {}", write_flat(key), write_flat(value))).collect();
            format!("{{{}}}", entries.join(", "))
        }
        Value::Group(Group { name, items, fields }) => {
            let mut parts: Vec<_> = items.iter().map(write_flat).collect();
            parts.extend(fields.iter().map(|entry| format!("{}: {}", entry.name, write_flat(&entry.value))));
            format!("{}({})", name.as_ref().map_or("", |(name, _)| name), parts.join(", "))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tree::parse;
    use super::*;

    fn set(text: &str, path: &str, value: &str) -> Result<String, String> {
        let root = parse(text, 0).unwrap();
        let edit = edit_for(&root, &Path::parse(path)?, value)?;
        let mut result = text.to_owned();
        result.replace_range(edit.span.start..edit.span.end, &edit.text);
        parse(&result, 0).unwrap();
        Ok(result)
    }

    #[test]
    fn edits_replace_insert_and_append() {
        let text = "Scene(time: (end: 1.0,), strands: [(r: 1)], m: {\"a b\": F}, /* kept */)";
        assert!(set(text, "time.end", "2").unwrap().contains("(end: 2,)"));
        assert!(set(text, "time.step.max", "1e-3").unwrap().contains("(end: 1.0, step: (max: 1e-3),)"));
        assert!(set(text, "strands[0].r", "0.5").unwrap().contains("[(r: 0.5)]"));
        assert!(set(text, "strands[1]", "(r: 2)").unwrap().contains("[(r: 1), (r: 2)]"));
        assert!(set(text, "m.\"a b\".density", "3").unwrap().contains("F(density: 3)"));
        assert!(set(text, "seed", "3").unwrap().contains("F}, seed: 3, /* kept */)"));
        assert!(set(text, "strands[4].r", "3").unwrap_err().contains("1 entries"));
        assert!(set(text, "time.end.x", "3").is_err());
        assert!(Path::parse("a[").is_err() && Path::parse("").is_err() && Path::parse("a..b").is_err());
    }

    #[test]
    fn written_text_reads_back() {
        let text = "Scene(a: [1, 2.5], b: {\"k\": F(x: true)}, c: \"q\\\"\", d: ())";
        let node = parse(text, 0).unwrap();
        let again = parse(&write(&node), 0).unwrap();
        assert_eq!(write(&node), write(&again));
    }
}

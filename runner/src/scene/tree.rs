//! Scene text as a tree that remembers where every value stood.
//!
//! The `ron` crate is the judge of syntax (see [`load`](mod@super::load)); this reader gives what that crate does not: the place
//! of every value, needed to point at it in a message and to change it by `--set`. It reads the same language with one
//! convenience: the first value of a named group may stand without its name, `Translate([1, 0, 0], during: (0, 1))`.

use super::edit::quote;

/// A stretch of text in one of the files of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Span {
    /// Index into the files of the scene.
    pub file: usize,
    /// First byte.
    pub start: usize,
    /// One past the last byte.
    pub end: usize,
}

impl Span {
    /// A span that belongs to no text (values made by the program).
    pub const NONE: Span = Span { file: usize::MAX, start: 0, end: 0 };
}

/// A value and where it stood.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// Where.
    pub span: Span,
    /// What.
    pub value: Value,
}

/// A value of scene text.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// `true` or `false`.
    Bool(bool),
    /// A number as written, without underscores.
    Number(String),
    /// `"text"`.
    Text(String),
    /// A bare name, such as `Si`.
    Name(String),
    /// `[a, b]`.
    List(Vec<Node>),
    /// `{ key: value }`.
    Map(Vec<(Node, Node)>),
    /// `Name(a, field: b)`, with or without the name.
    Group(Group),
}

/// Everything of the form `Name(values, field: value)`.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Group {
    /// The name before the bracket.
    pub name: Option<(String, Option<Span>)>,
    /// Values without a name.
    pub items: Vec<Node>,
    /// Values with a name.
    pub fields: Vec<Entry>,
}

/// A named value of a group.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Name.
    pub name: String,
    /// Where the name stood.
    pub name_span: Span,
    /// Value.
    pub value: Node,
}

impl Node {
    /// A value made by the program.
    #[must_use]
    pub fn made(value: Value) -> Node {
        Node { span: Span::NONE, value }
    }

    /// What kind of value this is, in words, for messages.
    #[must_use]
    pub fn kind(&self) -> String {
        match &self.value {
            Value::Bool(value) => format!("`{value}`"),
            Value::Number(text) => format!("the number `{text}`"),
            Value::Text(text) => format!("the text {}", quote(text)),
            Value::Name(name) => format!("the name `{name}`"),
            Value::List(items) => format!("a list of {}", items.len()),
            Value::Map(_) => "a map `{…}`".to_owned(),
            Value::Group(Group { name: Some((name, _)), .. }) => format!("`{name}(…)`"),
            Value::Group(_) => "a group `(…)`".to_owned(),
        }
    }

    /// Whether the value, or one inside, uses the convenience that plain RON does not have.
    #[must_use]
    pub fn has_mixed_group(&self) -> bool {
        match &self.value {
            Value::List(items) => items.iter().any(Node::has_mixed_group),
            Value::Map(entries) => entries.iter().any(|(key, value)| key.has_mixed_group() || value.has_mixed_group()),
            Value::Group(group) => {
                (!group.items.is_empty() && !group.fields.is_empty())
                    || group.items.iter().any(Node::has_mixed_group)
                    || group.fields.iter().any(|entry| entry.value.has_mixed_group())
            }
            _ => false,
        }
    }
}

/// A syntax error with its place and what to write instead.
#[derive(Clone, Debug, PartialEq)]
pub struct SyntaxError {
    /// Where.
    pub span: Span,
    /// What is wrong.
    pub message: String,
    /// What to write instead.
    pub help: Option<String>,
}

/// Brackets nested deeper than this are refused.
const MAX_DEPTH: usize = 96;

/// Reads scene text.
///
/// # Errors
/// The first syntax error, with its place.
pub fn parse(text: &str, file: usize) -> Result<Node, SyntaxError> {
    let mut reader = Reader { text, file, at: 0, depth: 0 };
    if reader.rest().starts_with('\u{feff}') {
        reader.at += '\u{feff}'.len_utf8();
    }
    reader.space()?;
    while reader.rest().starts_with("#!") {
        // `#![enable(implicit_some)]`: both extensions are always on.
        let Some(close) = reader.rest().find(']') else {
            return Err(reader.error(reader.at, reader.at + 2, "this attribute is never closed", None));
        };
        reader.at += close + 1;
        reader.space()?;
    }
    if reader.rest().is_empty() {
        return Err(reader.error(0, text.len(), "the file is empty", Some("a scene starts with `Scene(`")));
    }
    let node = reader.value()?;
    reader.space()?;
    if reader.at < text.len() {
        let end = reader.at + reader.rest().chars().next().map_or(0, char::len_utf8);
        return Err(reader.error(
            reader.at,
            end,
            "text after the end of the scene",
            Some("the bracket that opened the scene was closed before this"),
        ));
    }
    Ok(node)
}

struct Reader<'a> {
    text: &'a str,
    file: usize,
    at: usize,
    depth: usize,
}

fn starts_name(c: char) -> bool {
    c.is_alphabetic() || c == '_'
}

fn continues_name(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

impl<'a> Reader<'a> {
    fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }

    fn peek(&self) -> Option<char> {
        self.rest().chars().next()
    }

    fn span(&self, start: usize) -> Span {
        Span { file: self.file, start, end: self.at }
    }

    fn error(&self, start: usize, end: usize, message: impl Into<String>, help: Option<&str>) -> SyntaxError {
        SyntaxError {
            span: Span { file: self.file, start, end },
            message: message.into(),
            help: help.map(str::to_owned),
        }
    }

    /// An error about the character that stands here.
    fn unexpected(&self, wanted: &str, help: Option<&str>) -> SyntaxError {
        match self.peek() {
            Some(c) => self.error(
                self.at,
                self.at + c.len_utf8(),
                format!("expected {wanted}, found `{}`", c.escape_debug()),
                help,
            ),
            None => self.error(self.at, self.at, format!("expected {wanted}, but the file ends here"), help),
        }
    }

    /// Skips blanks and comments.
    fn space(&mut self) -> Result<(), SyntaxError> {
        loop {
            let rest = self.rest();
            let blank = rest.len() - rest.trim_start().len();
            self.at += blank;
            let rest = self.rest();
            if rest.starts_with("//") {
                self.at += rest.find('\n').unwrap_or(rest.len());
            } else if rest.starts_with("/*") {
                self.block_comment()?;
            } else {
                return Ok(());
            }
        }
    }

    fn block_comment(&mut self) -> Result<(), SyntaxError> {
        let start = self.at;
        let mut level = 0usize;
        loop {
            let rest = self.rest();
            if rest.starts_with("/*") {
                level += 1;
                self.at += 2;
            } else if rest.starts_with("*/") {
                level -= 1;
                self.at += 2;
                if level == 0 {
                    return Ok(());
                }
            } else if let Some(c) = rest.chars().next() {
                self.at += c.len_utf8();
            } else {
                return Err(self.error(start, start + 2, "this comment is never closed", Some("close it with `*/`")));
            }
        }
    }

    fn value(&mut self) -> Result<Node, SyntaxError> {
        if self.depth >= MAX_DEPTH {
            return Err(self.unexpected("less nesting", Some("brackets are nested too deeply")));
        }
        self.depth += 1;
        let node = self.value_inner();
        self.depth -= 1;
        node
    }

    fn value_inner(&mut self) -> Result<Node, SyntaxError> {
        let start = self.at;
        let Some(c) = self.peek() else {
            return Err(self.unexpected("a value", None));
        };
        match c {
            '(' => self.group(start, None),
            '[' => self.list(),
            '{' => self.map(),
            '"' => {
                let text = self.text_value()?;
                Ok(Node { span: self.span(start), value: Value::Text(text) })
            }
            'r' if self.rest().starts_with("r\"")
                || self.rest().starts_with("r#\"")
                || self.rest().starts_with("r##") =>
            {
                let text = self.raw_text()?;
                Ok(Node { span: self.span(start), value: Value::Text(text) })
            }
            '\'' => Err(self.unexpected("a value", Some("texts stand in double quotes: \"hair\""))),
            c if c.is_ascii_digit() || matches!(c, '+' | '-' | '.') => self.number(),
            c if starts_name(c) => {
                let name = self.name()?;
                let name_span = self.span(start);
                match name.as_str() {
                    "true" | "false" => Ok(Node { span: name_span, value: Value::Bool(name == "true") }),
                    "NaN" | "inf" => Ok(Node { span: name_span, value: Value::Number(name) }),
                    _ => {
                        let end_of_name = self.at;
                        self.space()?;
                        if self.peek() == Some('(') {
                            return self.group(start, Some((name, Some(name_span))));
                        }
                        self.at = end_of_name;
                        Ok(Node { span: name_span, value: Value::Name(name) })
                    }
                }
            }
            _ => Err(self.unexpected("a value", None)),
        }
    }

    fn name(&mut self) -> Result<String, SyntaxError> {
        if self.rest().starts_with("r#") {
            self.at += 2;
        }
        let rest = self.rest();
        if !rest.chars().next().is_some_and(starts_name) {
            return Err(self.unexpected("a name", None));
        }
        let length = rest.find(|c| !continues_name(c)).unwrap_or(rest.len());
        self.at += length;
        Ok(rest[..length].to_owned())
    }

    fn number(&mut self) -> Result<Node, SyntaxError> {
        let start = self.at;
        if matches!(self.peek(), Some('+' | '-')) {
            self.at += 1;
        }
        for word in ["inf", "NaN"] {
            if self.rest().starts_with(word) {
                self.at += word.len();
                let text = self.text[start..self.at].to_owned();
                return Ok(Node { span: self.span(start), value: Value::Number(text) });
            }
        }
        let digits = self.at;
        let hex = self.rest().starts_with("0x");
        while let Some(c) = self.peek() {
            let signed_exponent = matches!(c, '+' | '-')
                && !hex
                && self.at > digits
                && matches!(self.text.as_bytes()[self.at - 1], b'e' | b'E');
            if c.is_ascii_alphanumeric() || matches!(c, '.' | '_') || signed_exponent {
                self.at += 1;
            } else {
                break;
            }
        }
        let text: String = self.text[start..self.at].chars().filter(|&c| c != '_').collect();
        let text = ["f64", "f32", "u64", "i64", "u32", "i32", "u16", "i16", "u8", "i8"]
            .iter()
            .find_map(|suffix| if hex { None } else { text.strip_suffix(suffix) })
            .unwrap_or(&text)
            .to_owned();
        if text.parse::<f64>().is_err() && parse_integer(&text).is_none() {
            return Err(self.error(
                start,
                self.at,
                format!("`{text}` is not a number"),
                Some("write numbers as 12, -0.5 or 3.7e10; the unit comes from `units`, so no unit is written"),
            ));
        }
        Ok(Node { span: self.span(start), value: Value::Number(text) })
    }

    fn text_value(&mut self) -> Result<String, SyntaxError> {
        let start = self.at;
        self.at += 1;
        let mut text = String::new();
        loop {
            let Some(c) = self.peek() else {
                return Err(self.error(start, start + 1, "this text is never closed", Some("close it with `\"`")));
            };
            self.at += c.len_utf8();
            match c {
                '"' => return Ok(text),
                '\\' => text.push(self.escape()?),
                c => text.push(c),
            }
        }
    }

    fn escape(&mut self) -> Result<char, SyntaxError> {
        let start = self.at - 1;
        let Some(c) = self.peek() else {
            return Err(self.unexpected("an escaped character", None));
        };
        self.at += c.len_utf8();
        let code = |digits: &str| u32::from_str_radix(digits, 16).ok().and_then(char::from_u32);
        let found = match c {
            'n' => Some('\n'),
            'r' => Some('\r'),
            't' => Some('\t'),
            '0' => Some('\0'),
            '\\' | '"' | '\'' => Some(c),
            'x' => {
                let digits = self.rest().get(..2);
                self.at += digits.map_or(0, str::len);
                digits.and_then(code)
            }
            'u' => match (self.rest().strip_prefix('{'), self.rest().find('}')) {
                (Some(rest), Some(close)) => {
                    self.at += close + 1;
                    rest.get(..close - 1).and_then(code)
                }
                _ => None,
            },
            _ => None,
        };
        found.ok_or_else(|| {
            self.error(
                start,
                self.at,
                "this escape is not known",
                Some("write a backslash as `\\\\`, a quote as `\\\"`"),
            )
        })
    }

    fn raw_text(&mut self) -> Result<String, SyntaxError> {
        let start = self.at;
        self.at += 1;
        let hashes = self.rest().len() - self.rest().trim_start_matches('#').len();
        self.at += hashes;
        if self.peek() != Some('"') {
            return Err(self.unexpected("`\"`", None));
        }
        self.at += 1;
        let close = format!("\"{}", "#".repeat(hashes));
        match self.rest().find(&close) {
            Some(length) => {
                let text = self.rest()[..length].to_owned();
                self.at += length + close.len();
                Ok(text)
            }
            None => Err(self.error(start, start + 1, "this text is never closed", None)),
        }
    }

    /// After a value: a comma, or the closing bracket (which is consumed; then true).
    fn separator(&mut self, close: char, open_at: usize) -> Result<bool, SyntaxError> {
        self.space()?;
        match self.peek() {
            Some(c) if c == close => {
                self.at += 1;
                Ok(true)
            }
            Some(',') => {
                self.at += 1;
                self.space()?;
                if self.peek() == Some(close) {
                    self.at += 1;
                    return Ok(true);
                }
                if self.peek().is_none() {
                    return Err(self.never_closed(open_at, close));
                }
                Ok(false)
            }
            None => Err(self.never_closed(open_at, close)),
            Some(c) => {
                let help = match c {
                    ':' => "a name and its value are written `name: value` inside round brackets",
                    ')' | ']' | '}' => "the brackets do not match",
                    '=' => "a field is written `name: value`",
                    _ => "values are separated by commas; units are not written (they come from `units`)",
                };
                Err(self.unexpected(&format!("`,` or `{close}`"), Some(help)))
            }
        }
    }

    fn never_closed(&self, open_at: usize, close: char) -> SyntaxError {
        self.error(
            open_at,
            open_at + 1,
            format!("this bracket is never closed: `{close}` is missing"),
            Some("the file ends before the closing bracket"),
        )
    }

    fn opened(&mut self, close: char) -> Result<(usize, bool), SyntaxError> {
        let open_at = self.at;
        self.at += 1;
        self.space()?;
        match self.peek() {
            None => Err(self.never_closed(open_at, close)),
            Some(c) if c == close => {
                self.at += 1;
                Ok((open_at, true))
            }
            Some(_) => Ok((open_at, false)),
        }
    }

    fn list(&mut self) -> Result<Node, SyntaxError> {
        let (open_at, mut done) = self.opened(']')?;
        let mut items = Vec::new();
        while !done {
            items.push(self.value()?);
            done = self.separator(']', open_at)?;
        }
        Ok(Node { span: self.span(open_at), value: Value::List(items) })
    }

    fn map(&mut self) -> Result<Node, SyntaxError> {
        let (open_at, mut done) = self.opened('}')?;
        let mut entries = Vec::new();
        while !done {
            let key = self.value()?;
            self.space()?;
            if self.peek() != Some(':') {
                return Err(self.unexpected("`:`", Some("a map is written { \"name\": value }")));
            }
            self.at += 1;
            self.space()?;
            let value = self.value()?;
            entries.push((key, value));
            done = self.separator('}', open_at)?;
        }
        Ok(Node { span: self.span(open_at), value: Value::Map(entries) })
    }

    fn group(&mut self, start: usize, name: Option<(String, Option<Span>)>) -> Result<Node, SyntaxError> {
        let (open_at, mut done) = self.opened(')')?;
        let mut group = Group { name, ..Group::default() };
        while !done {
            match self.field_name()? {
                Some((name, name_span)) => {
                    let value = self.value()?;
                    group.fields.push(Entry { name, name_span, value });
                }
                None => {
                    let item = self.value()?;
                    self.space()?;
                    if self.peek() == Some('=') {
                        return Err(self.unexpected("`:`", Some("a field is written `name: value`")));
                    }
                    if !group.fields.is_empty() {
                        return Err(self.error(
                            item.span.start,
                            item.span.end,
                            "a value without a name after named ones",
                            Some("write `name: value`"),
                        ));
                    }
                    group.items.push(item);
                }
            }
            done = self.separator(')', open_at)?;
        }
        Ok(Node { span: self.span(start), value: Value::Group(group) })
    }

    /// Reads `name:` if it stands here.
    fn field_name(&mut self) -> Result<Option<(String, Span)>, SyntaxError> {
        let start = self.at;
        if !self.peek().is_some_and(starts_name) || self.rest().starts_with("r\"") || self.rest().starts_with("r#\"") {
            return Ok(None);
        }
        let name = self.name()?;
        let span = self.span(start);
        self.space()?;
        if self.peek() == Some(':') {
            self.at += 1;
            self.space()?;
            return Ok(Some((name, span)));
        }
        self.at = start;
        Ok(None)
    }
}

/// An integer in decimal, `0x`, `0b` or `0o` form.
#[must_use]
pub fn parse_integer(text: &str) -> Option<i128> {
    let (negative, digits) = match text.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, text.strip_prefix('+').unwrap_or(text)),
    };
    let (radix, digits) = match digits.get(..2) {
        Some("0x") => (16, &digits[2..]),
        Some("0b") => (2, &digits[2..]),
        Some("0o") => (8, &digits[2..]),
        _ => (10, digits),
    };
    if !digits.starts_with(|c: char| c.is_digit(radix)) {
        return None;
    }
    let value = i128::from_str_radix(digits, radix).ok()?;
    Some(if negative { -value } else { value })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_all_forms_and_remembers_places() {
        let text = "#![enable(implicit_some)]\n// note\nScene(a: [1, -2.5e-3], /* x /* y */ */ m: {\"k\": F(2, b: true)}, s: r#\"q\"q\"#,)";
        let node = parse(text, 0).unwrap();
        let Value::Group(group) = &node.value else { panic!() };
        assert_eq!(group.name.as_ref().unwrap().0, "Scene");
        assert_eq!(group.fields.len(), 3);
        let list = &group.fields[0].value;
        assert_eq!(&text[list.span.start..list.span.end], "[1, -2.5e-3]");
        assert_eq!(group.fields[2].value.value, Value::Text("q\"q".to_owned()));
        assert!(node.has_mixed_group());
    }

    #[test]
    fn an_open_bracket_is_shown_where_it_opened() {
        let error = parse("Scene(strands: [(a: 1)", 0).unwrap_err();
        assert_eq!(error.span.start, 15);
        let error = parse("Scene(radius: 0.5 cm)", 0).unwrap_err();
        assert!(error.help.unwrap().contains("units"));
    }

    #[test]
    fn deep_nesting_is_refused_not_overflowed() {
        assert!(parse(&"[".repeat(100_000), 0).is_err());
    }
}

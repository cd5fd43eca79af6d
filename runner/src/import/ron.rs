//! Scene text from its parts; every number keeps the place in the foreign file that it came from.

use super::document::{Number, Sited};
use crate::scene::edit::write_number;
use crate::scene::tree::{Entry, Group, Node, Span, Value};

/// A number.
pub fn number(number: Number) -> Node {
    Node { span: number.span, value: Value::Number(short(number.value)) }
}

/// A number that stands nowhere in the foreign file.
pub fn plain(value: f64) -> Node {
    Node::made(Value::Number(short(value)))
}

/// Whole numbers without a point, as a person writes them.
fn short(value: f64) -> String {
    if value == 0.0 {
        "0".to_owned()
    } else if value == value.trunc() && value.abs() < 1e6 {
        format!("{value:.0}")
    } else {
        write_number(value)
    }
}

/// A count.
pub fn whole(value: usize) -> Node {
    Node::made(Value::Number(value.to_string()))
}

/// Three numbers.
pub fn vector(vector: Sited<[f64; 3]>) -> Node {
    let items = vector.value.into_iter().map(|value| number(Sited { value, span: vector.span })).collect();
    Node { span: vector.span, value: Value::List(items) }
}

/// Three numbers that stand nowhere.
pub fn plain_vector(values: [f64; 3]) -> Node {
    vector(Sited::made(values))
}

/// A direction: `X`, `Y`, `Z`, or its three numbers.
pub fn axis(values: [f64; 3]) -> Node {
    let largest = values.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    // what turning left of a zero
    let values = values.map(|x| if x.abs() < 1e-15 * largest { 0.0 } else { x });
    match values {
        [1.0, 0.0, 0.0] => name("X"),
        [0.0, 1.0, 0.0] => name("Y"),
        [0.0, 0.0, 1.0] => name("Z"),
        _ => plain_vector(values),
    }
}

/// A text.
pub fn text(value: &str) -> Node {
    Node::made(Value::Text(value.to_owned()))
}

/// A bare name.
pub fn name(value: &str) -> Node {
    Node::made(Value::Name(value.to_owned()))
}

/// A switch.
pub fn flag(value: bool) -> Node {
    Node::made(Value::Bool(value))
}

/// `(start, end)`.
pub fn interval(start: Number, end: Number) -> Node {
    let items = vec![number(start), number(end)];
    Node { span: start.span, value: Value::Group(Group { name: None, items, fields: Vec::new() }) }
}

/// A list.
pub fn list(items: Vec<Node>) -> Node {
    Node::made(Value::List(items))
}

/// A map with texts as keys.
pub fn map(entries: Vec<(String, Node)>) -> Node {
    Node::made(Value::Map(entries.into_iter().map(|(key, value)| (text(&key), value)).collect()))
}

/// `Name(field: value, …)`, or without the name where it is empty.
pub fn group(span: Span, name: &str, fields: Vec<(&str, Node)>) -> Node {
    let entry = |(name, value): (&str, Node)| Entry { name: name.to_owned(), name_span: Span::NONE, value };
    let name = (!name.is_empty()).then(|| (name.to_owned(), None));
    let fields = fields.into_iter().map(entry).collect();
    Node { span, value: Value::Group(Group { name, items: Vec::new(), fields }) }
}

/// `Name(value)`.
pub fn wrap(variant: &str, value: Node) -> Node {
    let span = value.span;
    let group = Group { name: Some((variant.to_owned(), None)), items: vec![value], fields: Vec::new() };
    Node { span, value: Value::Group(group) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back_to_the_same_bits() {
        for value in [0.0, -0.0, 1.0, -80.0, 0.005, 3.727e10, 1e-9, 123_456_789.5, -1e6, 2e6] {
            let Value::Number(text) = plain(value).value else { panic!() };
            assert_eq!(text.parse::<f64>().unwrap(), value, "{text}");
        }
        let Value::Number(text) = plain(-0.0).value else { panic!() };
        assert_eq!(text, "0");
    }
}

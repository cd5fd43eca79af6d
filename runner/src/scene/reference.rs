//! The reference page and the JSON schema of scene files, generated from the declarations of the fields.

use super::field::{Field, show_value};
use super::quantity::{Quantity, Spec, Units};
use serde_json::{Map, Value as Json, json};
use std::fmt::Write as _;

/// What a type is.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// A real number.
    Number,
    /// A whole number.
    Integer,
    /// `true` or `false`.
    Bool,
    /// A text in quotes.
    Text,
    /// `[x, y, z]`.
    Vector,
    /// A value or nothing.
    Optional(Box<Kind>),
    /// `[…]`.
    List(Box<Kind>),
    /// `{ "name": … }`.
    Map(Box<Kind>),
    /// A section or choice with an entry of its own.
    Named(&'static str),
    /// One of several forms, described in words.
    Words(&'static str),
}

impl Kind {
    /// In words for a message: `a number [cm]`, `a list of …`.
    #[must_use]
    pub fn words(&self, spec: &Spec, units: Units) -> String {
        self.words_with(spec.quantity.unit(units))
    }

    fn words_with(&self, unit: &str) -> String {
        let number = |noun: &str| if unit.is_empty() { noun.to_owned() } else { format!("{noun} [{unit}]") };
        match self {
            Kind::Number => number("a number"),
            Kind::Integer => "a whole number".to_owned(),
            Kind::Bool => "true or false".to_owned(),
            Kind::Text => "a text in quotes".to_owned(),
            Kind::Vector => number("a vector [x, y, z]"),
            Kind::Optional(inner) => inner.words_with(unit),
            Kind::List(inner) => format!("a list, each {}", inner.words_with(unit)),
            Kind::Map(inner) => format!("a map of names, each {}", inner.words_with(unit)),
            Kind::Named(name) => format!("`{name}`"),
            Kind::Words(words) => number(words),
        }
    }

    /// Short, for the reference table, with links to the entries of named types.
    fn short(&self) -> String {
        match self {
            Kind::Number => "number".to_owned(),
            Kind::Integer => "whole number".to_owned(),
            Kind::Bool => "`true` or `false`".to_owned(),
            Kind::Text => "text".to_owned(),
            Kind::Vector => "`[x, y, z]`".to_owned(),
            Kind::Optional(inner) => inner.short(),
            Kind::List(inner) => format!("list of {}", inner.short()),
            Kind::Map(inner) => format!("map of {}", inner.short()),
            Kind::Named(name) => format!("[`{name}`](#{})", name.to_lowercase()),
            Kind::Words(words) => (*words).to_owned(),
        }
    }

    fn schema(&self, spec: &Spec) -> Json {
        let mut schema = match self {
            Kind::Number => json!({ "type": "number" }),
            Kind::Integer => json!({ "type": "integer" }),
            Kind::Bool => json!({ "type": "boolean" }),
            Kind::Text => json!({ "type": "string" }),
            Kind::Vector => json!({ "type": "array", "items": { "type": "number" }, "minItems": 3, "maxItems": 3 }),
            Kind::Optional(inner) => return inner.schema(spec),
            Kind::List(inner) => json!({ "type": "array", "items": inner.schema(spec) }),
            Kind::Map(inner) => json!({ "type": "object", "additionalProperties": inner.schema(spec) }),
            Kind::Named(name) => json!({ "$ref": format!("#/$defs/{name}") }),
            Kind::Words(words) => json!({ "description": words }),
        };
        if matches!(self, Kind::Number | Kind::Integer) {
            // Bounds are in the units of the file; only bounds that are the same in both systems can be stated here.
            let keys = [("minimum", "exclusiveMinimum"), ("maximum", "exclusiveMaximum")];
            for (bound, (closed, open)) in spec.range.bounds().into_iter().zip(keys) {
                let Some((value, is_open)) = bound else { continue };
                let (si, cgs) = (spec.quantity.from_si(value, Units::Si), spec.quantity.from_si(value, Units::Cgs));
                if (si - cgs).abs() <= 1e-12 * si.abs() {
                    schema[if is_open { open } else { closed }] = json!(si);
                }
            }
        }
        schema
    }
}

/// A field of a section as the page shows it.
#[derive(Clone, Debug, PartialEq)]
struct FieldEntry {
    name: &'static str,
    meaning: String,
    effect: &'static str,
    kind: Kind,
    spec: Spec,
    /// Default in SI and CGS as scene text; `None` where the field is required.
    default: Option<(String, String)>,
}

/// A variant of a choice as the page shows it.
#[derive(Clone, Debug, PartialEq)]
struct VariantEntry {
    name: &'static str,
    meaning: String,
    payload: Option<(Kind, Spec)>,
}

/// One section or choice.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Page {
    name: &'static str,
    about: String,
    fields: Vec<FieldEntry>,
    variants: Vec<VariantEntry>,
}

fn tidy(text: &str) -> String {
    text.lines().map(str::trim).collect::<Vec<_>>().join(" ").trim().to_owned()
}

impl Page {
    /// Adds a field.
    pub fn field<T: Field>(
        &mut self,
        name: &'static str,
        meaning: &str,
        effect: &'static str,
        spec: Spec,
        default: Option<T>,
        book: &mut Book,
    ) {
        let kind = T::describe(book);
        let default =
            default.map(|value| (show_value(&value, &spec, Units::Si), show_value(&value, &spec, Units::Cgs)));
        self.fields.push(FieldEntry { name, meaning: tidy(meaning), effect, kind, spec, default });
    }

    /// Adds a variant that stands alone.
    pub fn variant(&mut self, name: &'static str, meaning: &str) {
        self.variants.push(VariantEntry { name, meaning: tidy(meaning), payload: None });
    }

    /// Adds a variant that carries a value.
    pub fn variant_with<T: Field>(&mut self, name: &'static str, meaning: &str, spec: Spec, book: &mut Book) {
        let kind = T::describe(book);
        self.variants.push(VariantEntry { name, meaning: tidy(meaning), payload: Some((kind, spec)) });
    }
}

/// All sections and choices, in the order in which they are first mentioned.
#[derive(Clone, Debug, Default)]
pub struct Book {
    pages: Vec<Page>,
}

impl Book {
    fn add(&mut self, name: &'static str, about: &str, fill: impl FnOnce(&mut Book, &mut Page)) -> Kind {
        if !self.pages.iter().any(|page| page.name == name) {
            let place = self.pages.len();
            self.pages.push(Page { name, about: tidy(about), ..Page::default() });
            let mut page = Page::default();
            fill(self, &mut page);
            self.pages[place].fields = page.fields;
            self.pages[place].variants = page.variants;
        }
        Kind::Named(name)
    }

    /// Adds a section once.
    pub fn section(&mut self, name: &'static str, about: &str, fill: impl FnOnce(&mut Book, &mut Page)) -> Kind {
        self.add(name, about, fill)
    }

    /// Adds a choice once.
    pub fn choice(&mut self, name: &'static str, about: &str, fill: impl FnOnce(&mut Book, &mut Page)) -> Kind {
        self.add(name, about, fill)
    }
}

/// The book of a whole scene.
fn scene_book() -> Book {
    let mut book = Book::default();
    super::Scene::describe(&mut book);
    book
}

fn range_words(spec: &Spec) -> String {
    if spec.range.is_any() {
        return "–".to_owned();
    }
    let strip = |units: Units| {
        let text = spec.range.show(spec.quantity, units);
        match spec.quantity.unit(units) {
            "" => text,
            unit => text.trim_end_matches(unit).trim_end().to_owned(),
        }
    };
    let (si, cgs) = (strip(Units::Si), strip(Units::Cgs));
    if si == cgs { si } else { format!("{si} (CGS: {})", cgs.trim_start_matches("in ")) }
}

fn default_words(default: &Option<(String, String)>) -> String {
    match default {
        None => "**required**".to_owned(),
        Some((si, _)) if si == "None" => "–".to_owned(),
        Some((si, cgs)) if si == cgs => format!("`{si}`"),
        Some((si, cgs)) => format!("`{si}` (CGS: `{cgs}`)"),
    }
}

fn unit_words(spec: &Spec) -> String {
    match spec.quantity {
        Quantity::Number => "–".to_owned(),
        quantity => quantity.both_units(),
    }
}

/// The reference page: every field with meaning, unit, default, range and effect.
#[must_use]
pub fn markdown() -> String {
    let mut page = String::from(
        "# Scene reference\n\n\
        Generated from the declarations in `runner/src/scene`; a test keeps it in step with them.\n\n\
        A scene is a RON file, `Scene(field: value, …)`. Numbers are in the units named by `units` (SI or CGS); angles \
        are in degrees, angular velocities in rad/s. A vector is written `[x, y, z]` or `(x, y, z)`. An optional value \
        is simply written or left out. The first value of a variant may stand without its name: `First(2)`, \
        `Translate([1, 0, 0], during: (0, 1))`. Defaults are shown in SI, and in CGS where the number differs.\n",
    );
    for entry in &scene_book().pages {
        let _ = write!(page, "\n## {}\n\n{}\n", entry.name, entry.about);
        if !entry.fields.is_empty() {
            page.push_str(
                "\n| field | type | unit | default | range | meaning | effect |\n|---|---|---|---|---|---|---|\n",
            );
            for field in &entry.fields {
                let _ = writeln!(
                    page,
                    "| `{}` | {} | {} | {} | {} | {} | {} |",
                    field.name,
                    field.kind.short(),
                    unit_words(&field.spec),
                    default_words(&field.default),
                    range_words(&field.spec),
                    field.meaning,
                    if field.effect.is_empty() { "–" } else { field.effect },
                );
            }
        }
        if !entry.variants.is_empty() {
            page.push_str("\n| variant | carries | unit | range | meaning |\n|---|---|---|---|---|\n");
            for variant in &entry.variants {
                let (carries, unit, range) = match &variant.payload {
                    None => ("–".to_owned(), "–".to_owned(), "–".to_owned()),
                    Some((kind, spec)) => (kind.short(), unit_words(spec), range_words(spec)),
                };
                let _ = writeln!(page, "| `{}` | {carries} | {unit} | {range} | {} |", variant.name, variant.meaning);
            }
        }
    }
    page
}

/// A JSON schema of scenes (numbers in the file's units; a variant is `"Name"` or `{"Name": value}`).
#[must_use]
pub fn json_schema() -> Json {
    let book = scene_book();
    let mut definitions = Map::new();
    for entry in &book.pages {
        let definition = if entry.variants.is_empty() {
            let mut properties = Map::new();
            let mut required = Vec::new();
            for field in &entry.fields {
                let mut schema = field.kind.schema(&field.spec);
                schema["description"] = json!(format!("{} {}", field.meaning, field.effect).trim());
                if field.spec.quantity != Quantity::Number {
                    schema["x-unit"] = json!({ "Si": field.spec.quantity.unit(Units::Si), "Cgs": field.spec.quantity.unit(Units::Cgs) });
                }
                match &field.default {
                    None => required.push(json!(field.name)),
                    Some((si, _)) if si == "None" => {}
                    Some((si, cgs)) => schema["x-default"] = json!({ "Si": si, "Cgs": cgs }),
                }
                properties.insert(field.name.to_owned(), schema);
            }
            json!({
                "type": "object",
                "description": entry.about,
                "properties": properties,
                "required": required,
                "additionalProperties": false,
            })
        } else {
            let variants: Vec<Json> = entry
                .variants
                .iter()
                .map(|variant| match &variant.payload {
                    None => json!({ "const": variant.name, "description": variant.meaning }),
                    Some((kind, spec)) => json!({
                        "type": "object",
                        "description": variant.meaning,
                        "properties": { variant.name: kind.schema(spec) },
                        "required": [variant.name],
                        "additionalProperties": false,
                    }),
                })
                .collect();
            json!({ "description": entry.about, "oneOf": variants })
        };
        definitions.insert(entry.name.to_owned(), definition);
    }
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Viscose scene",
        "$ref": "#/$defs/Scene",
        "$defs": definitions,
    })
}

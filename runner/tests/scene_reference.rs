//! The reference page and the schema follow the code.

use runner::scene::reference::{json_schema, markdown};
use std::collections::BTreeSet;

/// `docs/scene-reference.md` is what the code says. Run with `UPDATE_REFERENCE=1` to write it anew.
#[test]
fn the_reference_page_is_up_to_date() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/scene-reference.md");
    let page = markdown();
    if std::env::var_os("UPDATE_REFERENCE").is_some() {
        std::fs::write(path, &page).unwrap();
    }
    let written = std::fs::read_to_string(path).unwrap_or_default();
    assert!(written == page, "docs/scene-reference.md is out of step: run the tests with UPDATE_REFERENCE=1");
}

/// Every field has a meaning, every link leads somewhere, and no table row is broken.
#[test]
fn the_reference_page_is_complete() {
    let page = markdown();
    let titles: BTreeSet<String> =
        page.lines().filter_map(|line| line.strip_prefix("## ")).map(str::to_lowercase).collect();
    assert!(titles.len() > 40);
    for piece in page.split("](#").skip(1) {
        let target = piece.split(')').next().unwrap();
        assert!(titles.contains(target), "no entry for {target}");
    }
    for row in page.lines().filter(|line| line.starts_with("| `")) {
        let cells: Vec<&str> = row.trim_matches('|').split(" | ").map(str::trim).collect();
        assert!(cells.len() == 7 || cells.len() == 5, "{row}");
        let meaning = if cells.len() == 7 { cells[5] } else { cells[4] };
        assert!(meaning.len() > 1, "{row}");
    }
}

/// Every reference in the schema is defined, and required fields exist.
#[test]
fn the_schema_is_closed() {
    let schema = json_schema();
    let definitions = schema["$defs"].as_object().unwrap();
    let text = schema.to_string();
    for piece in text.split("#/$defs/").skip(1) {
        let name = piece.split('"').next().unwrap();
        assert!(definitions.contains_key(name), "{name} is not defined");
    }
    for (name, definition) in definitions {
        for field in definition["required"].as_array().into_iter().flatten() {
            assert!(definition["properties"].get(field.as_str().unwrap()).is_some(), "{name}.{field}");
        }
    }
    let radius = &schema["$defs"]["StrandGroup"]["properties"]["friction"];
    assert_eq!((radius["minimum"].as_f64(), radius["maximum"].as_f64()), (Some(0.0), Some(10.0)));
}

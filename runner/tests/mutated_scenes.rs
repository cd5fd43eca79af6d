//! No text makes the loader panic, and what it accepts is sound.

use proptest::prelude::*;
use runner::scene::expand::counts;
use runner::scene::{expand, load_str, tree};

const SCENES: [&str; 4] = [
    include_str!("scenes/pour.ron"),
    include_str!("scenes/cantilever.ron"),
    include_str!("scenes/everything.ron"),
    include_str!("scenes/grains.ron"),
];

/// Pieces that hurt when they stand where they do not belong.
const PIECES: [&str; 34] = [
    "0",
    "-1",
    "1e308",
    "-1e-320",
    "1e999",
    "NaN",
    "inf",
    "-inf",
    "18446744073709551616",
    "0x10",
    "1_000",
    "3.",
    ".5",
    "()",
    "[]",
    "{}",
    "(",
    ")",
    "[",
    "]",
    "{",
    "}",
    ",",
    ":",
    "\"",
    "None",
    "Some(1)",
    "First(2)",
    "[0, 0, 0]",
    "/*",
    "r#\"",
    "\\u{110000}",
    "ü",
    "#![enable(implicit_some)]",
];

#[derive(Clone, Debug)]
enum Mutation {
    Delete(f64, usize),
    Insert(f64, usize),
    Replace(f64, usize, usize),
    Repeat(f64, f64, usize),
    /// Replaces the number at this place.
    Number(f64, usize),
}

fn mutation() -> impl Strategy<Value = Mutation> {
    let place = || 0.0..1.0f64;
    prop_oneof![
        (place(), 1..12usize).prop_map(|(at, length)| Mutation::Delete(at, length)),
        (place(), 0..PIECES.len()).prop_map(|(at, piece)| Mutation::Insert(at, piece)),
        (place(), 1..12usize, 0..PIECES.len()).prop_map(|(at, length, piece)| Mutation::Replace(at, length, piece)),
        (place(), place(), 1..40usize).prop_map(|(from, to, length)| Mutation::Repeat(from, to, length)),
        (place(), 0..PIECES.len()).prop_map(|(at, piece)| Mutation::Number(at, piece)),
    ]
}

fn apply(text: &mut Vec<char>, mutation: &Mutation) {
    let n = text.len();
    if n == 0 {
        return;
    }
    let place = |at: f64| ((at * n as f64) as usize).min(n - 1);
    match *mutation {
        Mutation::Delete(at, length) => drop(text.drain(place(at)..(place(at) + length).min(n))),
        Mutation::Insert(at, piece) => drop(text.splice(place(at)..place(at), PIECES[piece].chars())),
        Mutation::Replace(at, length, piece) => {
            drop(text.splice(place(at)..(place(at) + length).min(n), PIECES[piece].chars()));
        }
        Mutation::Repeat(from, to, length) => {
            let copy: Vec<char> = text[place(from)..(place(from) + length).min(n)].to_vec();
            drop(text.splice(place(to)..place(to), copy));
        }
        Mutation::Number(at, piece) => {
            let start = (place(at)..n).find(|&i| text[i].is_ascii_digit()).unwrap_or(n);
            let end = (start..n).find(|&i| !text[i].is_ascii_digit() && text[i] != '.').unwrap_or(n);
            drop(text.splice(start..end, PIECES[piece].chars()));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, failure_persistence: None, ..ProptestConfig::default() })]

    /// The loader answers every text, points into it when it refuses, and repeats itself when it accepts.
    #[test]
    fn the_loader_answers_every_text(
        scene in 0..SCENES.len(),
        mutations in prop::collection::vec(mutation(), 1..5),
        order in prop::option::of(("[a-z]{1,8}(\\[[0-9]\\])?(\\.[a-z_]{1,12}){0,2}", 0..PIECES.len())),
    ) {
        let mut text: Vec<char> = SCENES[scene].chars().collect();
        for mutation in &mutations {
            apply(&mut text, mutation);
        }
        let text: String = text.into_iter().collect();
        let overrides: Vec<String> = order.iter().map(|(path, piece)| format!("{path}={}", PIECES[*piece])).collect();
        match load_str(&text, "tests/scenes/mutated.ron", &overrides) {
            Err(error) => {
                prop_assert!(!error.problems.is_empty());
                for problem in &error.problems {
                    prop_assert!(problem.help.is_some(), "{}", problem.one_line());
                    prop_assert!(problem.line > 0, "{}", problem.one_line());
                }
            }
            Ok(loaded) => {
                let again = load_str(&loaded.text, "tests/scenes/mutated.ron", &[]);
                prop_assert_eq!(&again.expect("the text as run loads").scene, &loaded.scene);
                let vertices: usize = loaded.scene.strands.iter().filter_map(|group| counts(&group.shape)).map(|(a, b)| a.saturating_mul(b)).sum();
                if vertices < 10_000 {
                    for strand in expand(&loaded.scene).expect("checked strands expand") {
                        prop_assert!(strand.positions.iter().all(|point| point.iter().all(|x| x.is_finite())));
                    }
                }
            }
        }
    }

    /// What the ron crate reads, our reader reads too (but for single characters and byte strings, which scenes do not use, and
    /// numbers with two points such as `0..5`, which the ron crate skips over without reading them).
    #[test]
    fn our_reader_accepts_what_ron_accepts(scene in 0..SCENES.len(), mutations in prop::collection::vec(mutation(), 1..4)) {
        let mut text: Vec<char> = SCENES[scene].chars().collect();
        for mutation in &mutations {
            apply(&mut text, mutation);
        }
        let text: String = text.into_iter().collect();
        let extensions = ron::extensions::Extensions::IMPLICIT_SOME | ron::extensions::Extensions::UNWRAP_NEWTYPES;
        let options = ron::Options::default().with_default_extension(extensions);
        let skipped_over = text.contains("..");
        if !skipped_over && options.from_str::<serde::de::IgnoredAny>(&text).is_ok() {
            prop_assert!(tree::parse(&text, 0).is_ok(), "{:?}\n{text}", tree::parse(&text, 0));
        }
    }
}

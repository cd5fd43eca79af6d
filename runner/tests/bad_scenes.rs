//! Broken scenes: each is refused, and its message is kept as a snapshot so that nobody makes it worse unnoticed.

use miette::NarratableReportHandler;
use runner::scene::{SceneError, load};
use std::path::{Path, PathBuf};

fn render(error: &SceneError) -> String {
    let mut text = String::new();
    NarratableReportHandler::new().with_context_lines(1).render_report(&mut text, error).unwrap();
    format!("{text}---\n{}\n", error.lines().join("\n"))
}

fn snapshot(name: &str, text: &str) {
    let mut settings = insta::Settings::clone_current();
    settings.set_prepend_module_to_snapshot(false);
    settings.set_omit_expression(true);
    settings.set_snapshot_path("snapshots");
    settings.bind(|| insta::assert_snapshot!(name.to_owned(), text));
}

#[test]
fn every_broken_scene_is_refused_with_a_message_that_helps() {
    let mut scenes: Vec<PathBuf> = std::fs::read_dir("tests/bad_scenes")
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "ron"))
        .collect();
    scenes.sort();
    assert!(scenes.len() >= 25);
    for path in scenes {
        let error = load(&path, &[]).expect_err(&format!("{} must be refused", path.display()));
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        for problem in &error.problems {
            assert!(problem.help.is_some(), "{name}: `{problem}` says nothing of what to write instead");
            assert!(problem.line > 0, "{name}: `{problem}` has no place");
        }
        snapshot(&name, &render(&error));
    }
}

#[test]
fn overrides_are_refused_by_name() {
    let good = Path::new("tests/scenes/cantilever.ron");
    load(good, &[]).unwrap_or_else(|error| panic!("{}", render(&error)));
    let cases = [
        ("no_value", vec!["strands[0].radius"]),
        ("no_path", vec!["=3"]),
        ("broken_value", vec!["time.end=[1"]),
        ("text_without_quotes", vec!["title=test"]),
        ("out_of_range", vec!["strands[0].radius=-0.1"]),
        ("wrong_type", vec!["time.end=\"long\""]),
        ("unknown_field", vec!["strands[0].raduis=0.01"]),
        ("unknown_section", vec!["strand[0].radius=0.01"]),
        ("unknown_material", vec!["materials.hare.density=1.2"]),
        ("no_such_strand", vec!["strands[4].radius=0.01"]),
        ("inside_a_number", vec!["time.end.max=3"]),
        ("breaks_another", vec!["strands[0].shape.vertices=1", "time.end=2"]),
        ("inconsistent", vec!["strands[0].clamp=[First(2), First(1)]"]),
    ];
    for (name, overrides) in cases {
        let overrides: Vec<String> = overrides.into_iter().map(str::to_owned).collect();
        let error = load(good, &overrides).expect_err(name);
        let text = render(&error);
        assert!(text.contains("--set"), "{name} does not name the override:\n{text}");
        snapshot(&format!("override_{name}"), &text);
    }
}

#[test]
fn a_missing_scene_is_named() {
    let error = load("tests/no-such-scene.ron", &[]).unwrap_err();
    assert!(error.to_string().contains("tests/no-such-scene.ron"));
}

//! Links in the documentation lead somewhere, and paths named in it exist.

use std::fs;
use std::path::{Path, PathBuf};

fn pages(root: &Path) -> Vec<PathBuf> {
    let mut pages = vec![root.join("README.md")];
    let mut folders = vec![root.join("docs")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).unwrap().flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "md") {
                pages.push(path);
            }
        }
    }
    pages
}

/// Targets of `[text](target)` within the repository.
fn links(text: &str) -> impl Iterator<Item = &str> {
    text.split("](")
        .skip(1)
        .filter_map(|rest| rest.split([')', '#']).next())
        .filter(|link| !link.is_empty() && !link.contains("://") && !link.contains(' '))
}

/// Code words that name a file or folder of the repository.
fn paths(text: &str) -> impl Iterator<Item = &str> {
    let known = ["crates/", "runner/", "scenes/", "validation/", "docs/"];
    text.split('`').skip(1).step_by(2).filter(move |word| {
        known.iter().any(|start| word.starts_with(start)) && !word.contains([' ', '*', '<', '…', '\n'])
    })
}

#[test]
fn links_and_paths_in_the_documentation_exist() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut missing = Vec::new();
    for page in pages(&root) {
        let text = fs::read_to_string(&page).unwrap();
        let folder = page.parent().unwrap();
        missing.extend(links(&text).filter(|l| !folder.join(l).exists()).map(|l| format!("{}: {l}", page.display())));
        missing.extend(paths(&text).filter(|p| !root.join(p).exists()).map(|p| format!("{}: {p}", page.display())));
    }
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}

#[test]
fn every_page_is_in_the_table_of_contents() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let summary = fs::read_to_string(root.join("docs/SUMMARY.md")).unwrap();
    for page in pages(&root) {
        let name = page.strip_prefix(root.join("docs")).map(|p| p.to_string_lossy().replace('\\', "/"));
        let Ok(name) = name else { continue };
        assert!(name == "SUMMARY.md" || summary.contains(&format!("({name})")), "{name} is not in docs/SUMMARY.md");
    }
}

/// What a reader copies from a page works.
#[test]
fn scenes_in_the_documentation_are_sound() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut found = 0;
    for page in pages(&root) {
        let text = fs::read_to_string(&page).unwrap();
        for scene in text.split("```ron\n").skip(1).filter_map(|rest| rest.split("```").next()) {
            if !scene.starts_with("Scene(") {
                continue;
            }
            let name = page.display().to_string();
            let loaded = runner::scene::load_str(scene, &name, &[]).unwrap_or_else(|error| panic!("{error:?}"));
            runner::prepare::estimate(&loaded.scene).unwrap_or_else(|error| panic!("{name}: {error}"));
            found += 1;
        }
    }
    assert!(found >= 2, "{found}");
}

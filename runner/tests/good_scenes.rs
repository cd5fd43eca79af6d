//! Scenes that must load: every one under `scenes/`, and those beside this test.

use runner::scene::{Scene, Units, expand, load, load_str};
use std::path::{Path, PathBuf};

fn scene_files(folder: &Path, found: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    let mut entries: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            scene_files(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "ron") {
            found.push(path);
        }
    }
}

fn all_scenes() -> Vec<PathBuf> {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = Vec::new();
    scene_files(&here.join("tests/scenes"), &mut found);
    scene_files(&here.join("../scenes"), &mut found);
    found
}

fn read(path: &Path) -> runner::scene::LoadedScene {
    load(path, &[]).unwrap_or_else(|error| panic!("{}", error.lines().join("\n")))
}

/// The design example loads as it stands, in SI.
#[test]
fn the_design_example_loads() {
    let loaded = read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scenes/pour.ron"));
    let scene = &loaded.scene;
    assert_eq!(scene.gravity.y, -9.81);
    let hair = scene.fibre("hair").unwrap();
    assert_eq!((hair.density, hair.young_modulus), (1320.0, 3.747e9));
    let cream = scene.liquid_material("cream").unwrap();
    assert_eq!(cream.density, 200.0);
    let strands = expand(scene).unwrap();
    assert_eq!(strands.len(), 7);
    assert_eq!(strands[0].positions.len(), 80);
    assert_eq!(strands[3].clamps[1].vertices, [78, 79]);
    assert_eq!(strands[3].clamps[1].edges, [78]);
    // Neighbours lie one spacing apart, as in the scene it was taken from.
    for strand in &strands[1..] {
        assert!(((strand.positions[0] - strands[0].positions[0]).norm() - 0.0012).abs() < 1e-15);
    }
    assert_eq!(scene.liquid.as_ref().unwrap().sources.len(), 1);
}

/// A scene written out in either unit system and read again is the same scene.
#[test]
fn scenes_survive_writing_and_reading() {
    for path in all_scenes() {
        let loaded = read(&path);
        for units in [Units::Si, Units::Cgs] {
            let text = loaded.scene.to_ron(units);
            let again =
                load_str(&text, &path, &[]).unwrap_or_else(|error| panic!("{}\n{text}", error.lines().join("\n")));
            assert_eq!(again.scene.to_ron(Units::Si).replace("e0", ""), {
                let mut same: Scene = loaded.scene.clone();
                same.units = again.scene.units.clone();
                same.to_ron(Units::Si).replace("e0", "")
            });
        }
    }
}

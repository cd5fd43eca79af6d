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

/// A scene written out and read again is the same scene: exactly in SI, to a few units in the last place in CGS.
#[test]
fn scenes_survive_writing_and_reading() {
    for path in all_scenes() {
        let loaded = read(&path);
        for units in [Units::Si, Units::Cgs] {
            let text = loaded.scene.to_ron(units);
            let again =
                load_str(&text, &path, &[]).unwrap_or_else(|error| panic!("{}\n{text}", error.lines().join("\n")));
            let mut expected = loaded.scene.clone();
            expected.units = again.scene.units.clone();
            expected.include.clear();
            let mut found = again.scene;
            found.include.clear();
            if units == Units::Si {
                assert_eq!(found, expected, "{}", path.display());
            } else {
                assert_close(&found.to_ron(Units::Si), &expected.to_ron(Units::Si), &path);
            }
        }
    }
}

/// Compares two texts that differ only in the last digits of their numbers.
fn assert_close(found: &str, expected: &str, path: &Path) {
    let pieces = |text: &str| -> Vec<String> {
        // a longer number may break a line elsewhere
        let parts = text.split(|c: char| c.is_whitespace() || "()[]{},:".contains(c));
        parts.filter(|part| !part.is_empty()).map(str::to_owned).collect()
    };
    let (found, expected) = (pieces(found), pieces(expected));
    assert_eq!(found.len(), expected.len(), "{}", path.display());
    for (a, b) in found.iter().zip(&expected) {
        match (a.parse::<f64>(), b.parse::<f64>()) {
            (Ok(a), Ok(b)) => assert!((a - b).abs() <= 4.0 * f64::EPSILON * b.abs(), "{}: {a} and {b}", path.display()),
            _ => assert_eq!(a, b, "{}", path.display()),
        }
    }
}

/// Every scene expands to strands with as many radii as vertices, edges with a length, and finite numbers.
#[test]
fn scenes_expand_to_sound_strands() {
    for path in all_scenes() {
        let scene = read(&path).scene;
        for strand in expand(&scene).unwrap() {
            let n = strand.positions.len();
            assert!(n >= 2);
            for list in [&strand.radius, &strand.second_radius, &strand.stiffness] {
                assert_eq!(list.len(), n);
                assert!(list.iter().all(|&value| value > 0.0 && value.is_finite()));
            }
            assert_eq!(strand.velocities.len(), n);
            assert!(strand.positions.iter().chain(&strand.velocities).all(|v| v.iter().all(|x| x.is_finite())));
            assert!(strand.positions.windows(2).all(|edge| (edge[1] - edge[0]).norm() > 0.0));
            assert!(strand.clamps.iter().all(|clamp| clamp.vertices.iter().all(|&vertex| vertex < n)));
        }
    }
}

/// Every scene that asks for plain RON is plain RON.
#[test]
fn scenes_without_unnamed_values_are_read_alike_by_the_ron_crate() {
    let extensions = ron::extensions::Extensions::IMPLICIT_SOME | ron::extensions::Extensions::UNWRAP_NEWTYPES;
    let options = ron::Options::default().with_default_extension(extensions);
    for path in all_scenes() {
        // Written out, no scene uses the convenience.
        let text = read(&path).scene.to_ron(Units::Si);
        let node = runner::scene::tree::parse(&text, 0).unwrap();
        if !node.has_mixed_group() {
            options.from_str::<serde::de::IgnoredAny>(&text).unwrap_or_else(|error| panic!("{error}\n{text}"));
        }
    }
}

const CANTILEVER: &str = "tests/scenes/cantilever.ron";

fn set(overrides: &[&str]) -> runner::scene::LoadedScene {
    let overrides: Vec<String> = overrides.iter().map(|&order| order.to_owned()).collect();
    load(CANTILEVER, &overrides).unwrap_or_else(|error| panic!("{}", error.lines().join("\n")))
}

/// Overrides change existing fields, add absent ones, keep the comments, and the text as run gives the same scene.
#[test]
fn overrides_change_the_scene_and_its_text() {
    let loaded = set(&[
        "strands[0].radius=0.004",
        "materials.hair.young_modulus=1e9",
        "time.end=0.2",
        "time.step.min=1e-6",
        "output.frames=Every(0.05)",
        "materials.\"thick hair\"=Fibre(preset: \"brush\")",
        "strands[1]=(material: \"thick hair\", shape: Straight(from: [0, 1, 0], to: [4, 1, 0], vertices: 9))",
        "seed=18446744073709551615",
    ]);
    let scene = &loaded.scene;
    assert_eq!(expand(scene).unwrap()[0].radius[7], 4e-5);
    assert_eq!(expand(scene).unwrap()[1].radius[7], 1.25e-4);
    assert_eq!(scene.fibre("hair").unwrap().young_modulus, 1e8);
    assert_eq!(scene.fibre("hair").unwrap().density, 1320.0);
    assert_eq!(scene.time.end, 0.2);
    assert_eq!(scene.seed, u64::MAX);
    assert!(loaded.text.starts_with("// A horizontal hair"));
    let again = load_str(&loaded.text, CANTILEVER, &[]).unwrap();
    assert_eq!(again.scene, loaded.scene);
    assert_eq!(again.hash, loaded.hash);
    assert_ne!(set(&[]).hash, loaded.hash);
}

/// Included files add to lists and maps, the scene wins where both speak, and the merged text stands alone.
#[test]
fn included_files_are_merged() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, text).unwrap();
        path
    };
    write("library/lock.obj", "v 0 0 0\nv 0 -1 0\nv 0 -2 0.5\nl 1 2 3\n");
    write(
        "library/hair.ron",
        "Scene(units: Cgs, seed: 5, materials: { \"hair\": Fibre(preset: \"hair\"), \"brush\": Fibre(preset: \"brush\") },
         strands: [(material: \"hair\", shape: Obj(file: \"lock.obj\", scale: 2))])",
    );
    let main = write(
        "main.ron",
        "Scene(units: Cgs, include: [\"library/hair.ron\"], time: (end: 1, step: Fixed(1e-3)),
         materials: { \"hair\": Fibre(preset: \"hair\", density: 1.0) },
         strands: [(material: \"brush\", shape: Straight(from: [0, 0, 0], to: [1, 0, 0], vertices: 5))])",
    );
    let order = "materials.brush.density=2.0".to_owned();
    let loaded = load(&main, &[order]).unwrap_or_else(|error| panic!("{}", error.lines().join("\n")));
    assert_eq!(loaded.scene.seed, 5);
    assert_eq!(loaded.scene.fibre("hair").unwrap().density, 1000.0);
    assert_eq!(loaded.scene.fibre("brush").unwrap().density, 2000.0);
    let strands = expand(&loaded.scene).unwrap();
    assert_eq!(strands.len(), 2);
    assert_eq!(strands[1].positions[2].as_slice(), [0.0, -0.04, 0.01]);
    assert_eq!(loaded.files.len(), 3);

    let alone = load_str(&loaded.text, &main, &[]).unwrap_or_else(|error| panic!("{}", error.lines().join("\n")));
    let mut expected = loaded.scene.clone();
    expected.include.clear();
    let key = |scene: &Scene| scene.to_ron(Units::Si).replace("library/", "");
    assert_eq!(key(&alone.scene), key(&expected));
    assert_eq!(expand(&alone.scene).unwrap(), strands);
}

/// A file reached on two ways is added once, and a cycle is seen however its paths are spelt.
#[test]
fn files_are_included_once() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    std::fs::create_dir(folder.path().join("sub")).unwrap();
    let strands = "strands: [(material: \"hair\", shape: Straight(from: [0, 0, 0], to: [1, 0, 0], vertices: 5))]";
    write("hair.ron", &format!("Scene(materials: {{ \"hair\": Fibre(preset: \"hair\") }}, {strands})"));
    write("sub/a.ron", "Scene(include: [\"../hair.ron\"])");
    write("sub/b.ron", "Scene(include: [\"../sub/../hair.ron\"])");
    let main = "Scene(units: Si, include: [\"sub/a.ron\", \"sub/b.ron\"], time: (end: 1, step: Fixed(1e-3)))";
    write("main.ron", main);
    let loaded =
        load(folder.path().join("main.ron"), &[]).unwrap_or_else(|error| panic!("{}", error.lines().join("\n")));
    assert_eq!(loaded.scene.strands.len(), 1);

    write("sub/b.ron", "Scene(include: [\"../sub/../main.ron\"])");
    let error = load(folder.path().join("main.ron"), &[]).unwrap_err();
    assert!(error.to_string().contains("includes itself"), "{error}");
}

/// Generators: same seed, same strands; other seeds, others; spreads within their bounds; roots where they are asked for.
#[test]
fn wisps_are_drawn_from_the_seed() {
    let wisp = |seed: u64| {
        let text = format!(
            "Scene(units: Si, seed: {seed}, time: (end: 1, step: Fixed(1e-3)), materials: {{ \"hair\": Fibre(preset: \"hair\") }},
             strands: [(material: \"hair\", shape: Wisp(count: 200, root: [0, 1, 0], length: 0.2, disc: 0.01, vertices: 41,
                curl: (radius: 2e-3, pitch: 0.02, onset: 0.02), spread: (radius: 0.2, length: 0.1, curl: 0.3, direction: 5)))])"
        );
        expand(&load_str(&text, "wisp.ron", &[]).unwrap().scene).unwrap()
    };
    let strands = wisp(1);
    assert_eq!(strands, wisp(1));
    assert_ne!(strands, wisp(2));
    let mut radii: Vec<f64> = strands.iter().map(|strand| strand.radius[0]).collect();
    radii.sort_by(f64::total_cmp);
    assert!(radii[0] >= 4e-5 && radii[199] < 6e-5 && radii[199] - radii[0] > 1.8e-5);
    for strand in &strands {
        let root = strand.positions[0];
        assert!(root.y == 1.0 && root.x.hypot(root.z) <= 0.01);
        let drop = root.y - strand.positions[40].y;
        assert!((0.17..0.225).contains(&drop), "{drop}");
    }
}

/// Evenly arranged strands keep their distance from root to tip.
#[test]
fn an_even_wisp_does_not_cross_itself() {
    let text = "Scene(units: Si, time: (end: 1, step: Fixed(1e-3)), materials: { \"hair\": Fibre(preset: \"hair\") },
        strands: [(material: \"hair\", shape: Wisp(count: 1000, root: [0, 0, 0], direction: [1, 0, 0], length: 0.1, disc: 0.0025,
            vertices: 5, arrangement: Even, spread: (direction: 3)))])";
    let strands = expand(&load_str(text, "wisp.ron", &[]).unwrap().scene).unwrap();
    let mut before = 1.4 * 0.0025 / 1000f64.sqrt();
    for vertex in 0..5 {
        let at: Vec<_> = strands.iter().map(|strand| strand.positions[vertex]).collect();
        let mut nearest = f64::INFINITY;
        for (i, a) in at.iter().enumerate() {
            nearest = at[..i].iter().map(|b| (a - b).norm()).fold(nearest, f64::min);
        }
        assert!(nearest > before, "{vertex}: {nearest} {before}");
        before = 0.999 * nearest;
    }
    let outermost = strands.last().unwrap();
    let lean = (outermost.positions[4] - outermost.positions[0]).normalize().x.acos();
    assert!((lean / 3f64.to_radians() - 1.0).abs() < 0.01, "{lean}");
}

/// Shapes: lengths, radii and angles of the analytic ones.
#[test]
fn analytic_shapes_are_where_they_should_be() {
    let one = |shape: &str| {
        let text = format!(
            "Scene(units: Si, time: (end: 1, step: Fixed(1e-3)), materials: {{ \"hair\": Fibre(preset: \"hair\") }},
             strands: [(material: \"hair\", radius: Taper(1e-4, 5e-5), shape: {shape}, spin: (rate: 2, axis: Z, center: [0, 0, 0]))])"
        );
        let scene =
            load_str(&text, "shape.ron", &[]).unwrap_or_else(|error| panic!("{}", error.lines().join("\n"))).scene;
        expand(&scene).unwrap().remove(0)
    };
    let helix = one("Helix(center: [1, 0, 0], axis: Z, radius: 0.5, pitch: 0.2, turns: 3, vertices: 301)");
    for (i, point) in helix.positions.iter().enumerate() {
        assert!(((point.x - 1.0).hypot(point.y) - 0.5).abs() < 1e-15);
        assert!((point.z - 0.6 * i as f64 / 300.0).abs() < 1e-15);
    }
    // Right-handed: seen along the axis the turn is counter-clockwise while it advances.
    let (a, b) = (helix.positions[0], helix.positions[1]);
    assert!((a.x - 1.0) * b.y - a.y * (b.x - 1.0) > 0.0);
    assert_eq!(helix.radius[0], 1e-4);
    assert!((helix.radius[150] - 7.5e-5).abs() < 1e-18 && (helix.radius[300] - 5e-5).abs() < 1e-18);

    let circle = one("Circle(center: [0, 0, 0], radius: 0.5, vertices: 61)");
    assert_eq!(circle.positions[0], circle.positions[60]);
    for (position, velocity) in circle.positions.iter().zip(&circle.velocities) {
        assert!((velocity.norm() - 1.0).abs() < 1e-15 && velocity.dot(position).abs() < 1e-15);
    }
    let arc = one("Arc(center: [0, 0, 0], radius: 2, angle: -90, vertices: 10)");
    assert!(arc.positions[0].dot(&arc.positions[9]).abs() < 1e-15);

    let uneven = one("Straight(from: [0, 0, 0], to: [0, -1, 0], vertices: 4, spacing: [1, 2, 1])");
    assert_eq!(uneven.positions.iter().map(|point| -point.y).collect::<Vec<_>>(), [0.0, 0.25, 0.75, 1.0]);
}

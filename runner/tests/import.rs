//! Importing scenes of the C++ reference code: hand-written files of every kind, and broken ones.

use miette::NarratableReportHandler;
use runner::import::{ImportOptions, Imported, import, import_text};
use runner::scene::{SceneError, expand, load_str};
use std::path::{Path, PathBuf};

const DATA: &str = "tests/data/import";

fn snapshot(name: &str, text: &str) {
    let mut settings = insta::Settings::clone_current();
    settings.set_prepend_module_to_snapshot(false);
    settings.set_omit_expression(true);
    settings.set_snapshot_path("snapshots/import");
    settings.bind(|| insta::assert_snapshot!(name.to_owned(), text));
}

fn import_file(name: &str, options: &ImportOptions) -> Imported {
    import(&Path::new(DATA).join(name), Path::new(DATA), options).unwrap_or_else(|error| panic!("{}", render(&error)))
}

fn render(error: &SceneError) -> String {
    let mut text = String::new();
    NarratableReportHandler::new().with_context_lines(1).render_report(&mut text, error).unwrap();
    format!("{text}---\n{}\n", error.lines().join("\n"))
}

/// Loads an imported scene as it would be loaded from the folder of the data.
fn load(imported: &Imported) -> runner::scene::Scene {
    let loaded = load_str(&imported.text, Path::new(DATA).join("imported.ron"), &[]);
    loaded.unwrap_or_else(|error| panic!("{}\n{}", imported.text, render(&error))).scene
}

#[test]
fn every_kind_of_file_becomes_a_scene_that_loads() {
    for name in ["strand", "pour", "film", "bundle", "motions"] {
        let imported = import_file(&format!("{name}.xml"), &ImportOptions::default());
        snapshot(name, &imported.text);
        let scene = load(&imported);
        assert_eq!(scene.title, name);
        let again = import_file(&format!("{name}.xml"), &ImportOptions::default());
        assert_eq!(again.text, imported.text);
        // every note stands at the head of the scene as well
        for line in imported.notes.text().lines() {
            assert!(imported.text.contains(&format!("// {line}\n")), "{name}: {line}");
        }
    }
}

#[test]
fn parity_replays_scripts_and_takes_the_laws_as_printed() {
    let options = ImportOptions { parity: true, ..ImportOptions::default() };
    let imported = import_file("motions.xml", &options);
    snapshot("motions_parity", &imported.text);
    load(&imported);
    let film = import_file("film.xml", &options).text;
    assert!(film.contains("film: (wall: Paper, advection: SemiLagrangian)"), "{film}");
    assert!(import_file("pour.xml", &options).text.contains("flow_map: Split"));
}

#[test]
fn a_motion_without_steps_follows_the_replayed_one() {
    use geometry::Motion;
    use nalgebra::Vector3;
    use runner::scene::strands::Clamp;
    // the lead of up to one and a half steps is small with a small step
    let text = std::fs::read_to_string(Path::new(DATA).join("motions.xml")).unwrap();
    let fine = text.replace("dt=\"0.05\"", "dt=\"0.0005\"");
    let motion_of = |parity: bool, strand: usize| -> (Motion, Vector3<f64>) {
        let options = ImportOptions { parity, ..ImportOptions::default() };
        let imported = import_text(&fine, &Path::new(DATA).join("motions.xml"), Path::new(DATA), &options).unwrap();
        let scene = load(&imported);
        let Clamp::First(clamp) = &scene.strands[strand].clamp[0] else { panic!("{}", imported.text) };
        let script = scene.script(clamp.motion.as_ref().unwrap());
        let expanded = expand(&scene).unwrap();
        (runner::world::script::motion(script, 1.0).unwrap(), expanded[strand].clamps[0].center)
    };
    for strand in [0, 1, 2] {
        let ((plain, center), (replayed, _)) = (motion_of(false, strand), motion_of(true, strand));
        for k in 0..=20 {
            let time = f64::from(k) * 0.05;
            let points = [Vector3::new(0.01, 0.0, 0.0), Vector3::new(0.02, 0.01, 0.09)];
            for point in points {
                let (a, b) = (plain.pose(&center, time).apply(&point), replayed.pose(&center, time).apply(&point));
                assert!((a - b).norm() < 2e-3, "strand {strand} at {time} s: {a} {b}");
            }
        }
    }
}

#[test]
fn missing_files_are_listed_and_the_rest_is_imported() {
    let imported = import_file("missing.xml", &ImportOptions::default());
    assert!(imported.notes.any_missing());
    snapshot("missing", &imported.text);
    let found = ImportOptions { assets: vec![PathBuf::from("tests/data/import/assets")], parity: false };
    let text = std::fs::read_to_string(Path::new(DATA).join("missing.xml")).unwrap();
    let text = text.replace("none.obj", "three.obj").replace("none-either.obj", "three.obj");
    let imported = import_text(&text, Path::new("/elsewhere/scene.xml"), Path::new(DATA), &found).unwrap();
    assert!(!imported.notes.any_missing(), "{}", imported.text);
    assert_eq!(load(&imported).strands.len(), 1);
}

/// A sound scene, for faults to be put into.
const SOUND: &str = r#"<scene>
  <duration time="1.0"/>
  <integrator dt="0.001"/>
  <StrandParameters>
    <radius value="0.005"/>
    <youngsModulus value="3.7e10"/>
    <density value="1.32"/>
  </StrandParameters>
  <particle x="0 0 0" fixed="3"/>
  <particle x="1 0 0" fixed="1"/>
  <particle x="2 0 0"/>
  <hair params="0" start="0" count="3"/>
  <script type="translate" x="1" y="0" z="0" start="0" end="0.5" group="0"/>
  <distancefield usage="solid" type="box" cx="0" cy="-5" cz="0" ex="1" ey="1" ez="1" group="1"/>
</scene>
"#;

fn import_str(text: &str) -> Result<Imported, SceneError> {
    import_text(text, Path::new("scene.xml"), Path::new(DATA), &ImportOptions::default())
}

#[test]
fn what_cannot_be_used_is_refused_with_its_place() {
    import_str(SOUND).unwrap_or_else(|error| panic!("{}", render(&error)));
    let faults = [
        ("no_xml", "<integrator dt=\"0.001\"/>", "<integrator dt=\"0.001\">"),
        ("no_scene", "<scene>", "<scenery>"),
        ("no_duration", "<duration time=\"1.0\"/>", ""),
        ("no_step", "dt=\"0.001\"", "step=\"0.001\""),
        ("no_number", "x=\"1 0 0\"", "x=\"1 zero 0\""),
        ("two_numbers", "x=\"1 0 0\"", "x=\"1 0\""),
        ("no_position", "<particle x=\"2 0 0\"/>", "<particle/>"),
        ("no_value", "<radius value=\"0.005\"/>", "<radius>0.005</radius>"),
        ("infinite", "value=\"3.7e10\"", "value=\"3.7e999\""),
        ("negative_radius", "value=\"0.005\"", "value=\"-0.005\""),
        ("absurd_density", "value=\"1.32\"", "value=\"1.32e9\""),
        ("absurd_position", "x=\"2 0 0\"", "x=\"2e30 0 0\""),
        ("too_many_particles", "count=\"3\"", "count=\"4\""),
        ("one_vertex", "count=\"3\"", "count=\"1\""),
        ("negative_count", "count=\"3\"", "count=\"-3\""),
        ("no_parameters", "params=\"0\"", "params=\"2\""),
        ("twice_the_same_place", "x=\"2 0 0\"", "x=\"1 0 0\""),
        ("unknown_script", "type=\"translate\"", "type=\"tanslate\""),
        ("unknown_shape", "type=\"box\"", "type=\"boxx\""),
        ("unknown_usage", "usage=\"solid\"", "usage=\"sold\""),
        ("no_size", "ez=\"1\"", ""),
        ("flat_box", "ez=\"1\"", "ez=\"0\""),
        ("negative_group", "group=\"1\"", "group=\"-1\""),
        ("step_longer_than_run", "dt=\"0.001\"", "dt=\"10\""),
        ("absurd_step", "dt=\"0.001\"", "dt=\"1e-15\""),
    ];
    for (name, sound, fault) in faults {
        assert!(SOUND.contains(sound), "{name}");
        let text = SOUND
            .replacen(sound, fault, 1)
            .replace("</scene>", if name == "no_scene" { "</scenery>" } else { "</scene>" });
        let error = import_str(&text).err().unwrap_or_else(|| panic!("{name} is refused"));
        for problem in &error.problems {
            assert!(problem.line > 0, "{name}: `{problem}` has no place");
            assert!(problem.help.as_ref().is_some_and(|help| !help.is_empty()), "{name}: `{problem}` gives no help");
        }
        snapshot(&format!("bad_{name}"), &render(&error));
    }
}

/// Small changes at random places: nothing panics, and what is accepted loads.
#[test]
fn mutated_files_are_refused_or_imported() {
    let mut texts = vec![SOUND.to_owned()];
    for name in ["strand", "pour", "film", "motions"] {
        texts.push(std::fs::read_to_string(Path::new(DATA).join(format!("{name}.xml"))).unwrap());
    }
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below.max(1)
    };
    let scraps = [
        "-1",
        "0",
        "1e300",
        "-1e-300",
        "nan",
        "1e9",
        "99999999999",
        "\"",
        "<",
        ">",
        "/",
        "&",
        " ",
        "é",
        "7",
        "3",
        "<a/>",
        "=\"\"",
    ];
    let mut accepted = 0;
    for round in 0..1500 {
        let mut text = texts[round % texts.len()].clone();
        for _ in 0..=random(3) {
            let inside = |text: &str, at: usize| (0..=at).rev().find(|&at| text.is_char_boundary(at)).unwrap_or(0);
            let at = inside(&text, random(text.len()));
            let end = inside(&text, (at + random(6)).min(text.len()));
            let end = end.max(at);
            match random(4) {
                0 => text.replace_range(at..end, ""),
                1 => text.insert_str(at, scraps[random(scraps.len())]),
                2 => text.replace_range(at..end, scraps[random(scraps.len())]),
                _ => {
                    // a whole attribute value
                    let Some(open) = text[at..].find("=\"").map(|found| at + found + 2) else { continue };
                    let Some(close) = text[open..].find('"').map(|found| open + found) else { continue };
                    text.replace_range(open..close, scraps[random(scraps.len())]);
                }
            }
        }
        match import_str(&text) {
            Ok(imported) => {
                accepted += 1;
                if !imported.notes.any_missing() {
                    let loaded = load_str(&imported.text, "imported.ron", &[]);
                    assert!(loaded.is_ok(), "{text}\n{}\n{}", imported.text, render(&loaded.unwrap_err()));
                }
            }
            Err(error) => assert!(!error.problems.is_empty()),
        }
    }
    assert!((150..1450).contains(&accepted), "{accepted} of 1500 were accepted");
}

#[test]
fn a_big_file_is_imported_in_seconds() {
    use std::fmt::Write as _;
    let mut text = String::from(SOUND.split("  <particle").next().unwrap());
    for strand in 0..1000 {
        for vertex in 0..80 {
            let _ = writeln!(
                text,
                "  <particle x=\"{} {} 0\" v=\"0 0 0\" fixed=\"0\" group=\"0\"/>",
                0.05 * f64::from(vertex),
                strand
            );
        }
    }
    for strand in 0..1000 {
        let _ = writeln!(text, "  <hair params=\"0\" start=\"{}\" count=\"80\"/>", 80 * strand);
    }
    text.push_str("</scene>\n");
    let clock = std::time::Instant::now();
    let imported = import_str(&text).unwrap();
    let seconds = clock.elapsed().as_secs_f64();
    assert_eq!(load(&imported).strands.len(), 1000);
    assert!(seconds < 60.0, "{seconds} s for 80,000 vertices");
}

//! A made-up run: strands that swing above a floor beside a ball, with drops falling. It obeys no physics; it has every
//! kind of piece, field and column that a report must cope with.
#![allow(dead_code)] // each test file uses its own part

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use runner::record::frame::{Field, Frame, Piece, Topology};
use runner::record::{ply, vtk};

/// The frame at a moment [s] of a run of one second.
pub fn frame(time: f64, strands: usize) -> Frame {
    let (mut positions, mut velocities, mut radii, mut offsets) = (Vec::new(), Vec::new(), Vec::new(), vec![0u32]);
    for s in 0..strands {
        let phase = s as f64 * 2.399_963;
        let root = [
            0.02 * phase.cos() * (s as f64 / strands as f64).sqrt(),
            0.2,
            0.02 * phase.sin() * (s as f64 / strands as f64).sqrt(),
        ];
        for k in 0..41 {
            let l = f64::from(k) / 40.0;
            let swing = |t: f64| 0.6 * l * l * (std::f64::consts::TAU * (t - 0.2 * l) + 0.1 * phase).sin();
            let curl = 0.006 * l;
            let at = |t: f64| {
                let a = 25.0 * l + phase;
                [
                    root[0] * (1.0 + l) + 0.08 * swing(t) + curl * a.cos(),
                    root[1] - 0.17 * l * (1.0 - 0.1 * swing(t).abs()),
                    root[2] * (1.0 + l) + curl * a.sin(),
                ]
            };
            let (now, next) = (at(time), at(time + 1e-4));
            positions.push(now);
            velocities.push(std::array::from_fn(|i| (next[i] - now[i]) / 1e-4));
            radii.push(1.2e-3 * (1.0 - 0.6 * l));
        }
        offsets.push(positions.len() as u32);
    }
    let n = positions.len();
    let strands_piece = Piece {
        name: "strands".into(),
        topology: Topology::Polylines { offsets },
        point_fields: vec![
            Field::integer("id", (0..n as i64).collect()),
            Field::scalar("radius", radii),
            Field::vector("velocity", &velocities),
        ],
        cell_fields: vec![
            Field::integer("strand", (0..strands as i64).collect()),
            Field::scalar("tension", (0..strands).map(|s| s as f64 * 0.5).collect()),
        ],
        positions,
    };
    let drops: Vec<[f64; 3]> = (0..400)
        .map(|i| {
            let x = f64::from(i) * 0.618_034;
            let fall = (x.fract() + time).fract();
            [0.12 + 0.02 * ((x * 5.0).fract() - 0.5), 0.2 - 0.2 * fall * fall, 0.02 * ((x * 11.0).fract() - 0.5)]
        })
        .collect();
    let particles = Piece {
        name: "particles".into(),
        topology: Topology::Points,
        point_fields: vec![
            Field::integer("id", (0..400).collect()),
            Field::scalar("radius", vec![2e-3; 400]),
            Field {
                name: "strain".into(),
                components: 9,
                values: runner::record::frame::FieldValues::F64(vec![0.25; 3600]),
            },
        ],
        cell_fields: vec![],
        positions: drops.clone(),
    };
    let links = Piece {
        name: "links".into(),
        topology: Topology::Segments((0..20).map(|i| [i, i + 1]).collect()),
        positions: drops[..21].to_vec(),
        point_fields: vec![],
        cell_fields: vec![Field::scalar("force", (0..20).map(f64::from).collect())],
    };
    Frame { time, step: (time * 1000.0).round() as u64, pieces: vec![strands_piece, particles, links, solids()] }
}

fn solids() -> Piece {
    use geometry::{ShapeDescription, Vector3};
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for text in [
        "HalfSpace(normal: (0, 1, 0))",
        "Sphere(center: (-0.1, 0.04, 0.02), radius: 0.04)",
        "Box(center: (0, 0.205, 0), half_extents: (0.03, 0.008, 0.03), rounding: 0.003)",
    ] {
        let shape = ron::from_str::<ShapeDescription>(text).unwrap().build(Path::new(".")).unwrap();
        let surface = shape.tessellate(48, 0.4);
        let base = positions.len() as u32;
        positions.extend(surface.positions.iter().map(|p: &Vector3| [p.x, p.y, p.z]));
        triangles.extend(surface.triangles.iter().map(|t| t.map(|v| v + base)));
    }
    Piece {
        name: "solids".into(),
        topology: Topology::Triangles(triangles),
        positions,
        point_fields: vec![],
        cell_fields: vec![],
    }
}

/// Writes the folder of such a run, complete with summary.
pub fn run_folder(dir: &Path, frames: u64, ply_instead: bool) {
    fs::create_dir_all(dir.join("frames")).unwrap();
    fs::create_dir_all(dir.join("checkpoints")).unwrap();
    for index in 0..=frames {
        let frame = frame(index as f64 / frames as f64, 30);
        if ply_instead {
            ply::write_frame(&dir.join("frames"), index, &frame)
        } else {
            vtk::write_frame(&dir.join("frames"), index, &frame)
        }
        .unwrap();
    }
    fs::write(dir.join("scene.ron"), "Scene(title: \"Swinging wisp <test>\", gravity: [0, -9.81, 0])\n").unwrap();
    fs::write(
        dir.join("provenance.json"),
        r#"{"version":"0.1.0","commit":"0123abcd","title":"Swinging wisp <test>","seed":7,"threads":2,"overrides":[]}"#,
    )
    .unwrap();
    fs::write(
        dir.join("summary.json"),
        r#"{"status":"completed","system":"strands","time":1.0,"end":1.0,"steps":1000,"rejected_steps":12,"frames":25,"seconds":3.25,"mass_defect":2.1e-16,"momentum_defect":3e-12}"#,
    )
    .unwrap();
    let mut series = "step,time,dt,limiter,rejections,iterations,kinetic_energy,elastic_energy,gravity_energy,total_energy,momentum_x,momentum_y,momentum_z,momentum_defect,mass,newton_residual,contact_count\n".to_owned();
    let mut timings = "step,seconds,memory_bytes,drive_seconds,mixture_seconds,advect_seconds\n".to_owned();
    for step in 0..=1000u32 {
        let t = f64::from(step) / 1000.0;
        let w = std::f64::consts::TAU * t;
        let (kinetic, elastic, gravity) = (2e-4 * w.cos().powi(2), 1.5e-4 * w.sin().powi(2), 5e-5 * w.sin().powi(2));
        let retry = step % 83 == 40;
        let limiter = if step == 0 {
            "start"
        } else if retry {
            "retry"
        } else if step % 40 == 0 {
            "output clock"
        } else {
            "rods: motion"
        };
        let dt = if step == 0 {
            0.0
        } else if retry {
            5e-4
        } else {
            1e-3
        };
        let residual = 1e-10 * (1.0 + (f64::from(step) * 0.7).sin().abs() * 50.0);
        let _ = writeln!(
            series,
            "{step},{t},{dt},{limiter},{},{},{kinetic:e},{elastic:e},{gravity:e},{:e},{:e},{:e},0,{:e},0.012,{residual:e},{}",
            u32::from(retry),
            3 + step % 3,
            kinetic + elastic + gravity,
            1e-3 * w.cos(),
            -2e-4 * w.sin(),
            1e-13 * f64::from(step),
            (30.0 * w.sin().abs()) as i32
        );
        let _ = writeln!(
            timings,
            "{step},{:.6},52428800,0.0001,{:.6},0.0004",
            0.003 + 0.0005 * w.sin(),
            0.002 + 0.0004 * w.sin()
        );
    }
    fs::write(dir.join("series.csv"), series).unwrap();
    fs::write(dir.join("timings.csv"), timings).unwrap();
}

//! Frames survive their files: every piece, field and bit comes back, damage is refused, pictures are the same for any threads.

mod synthetic;

use std::fs;

use runner::picture::{Camera, ColorBy, Framing, PictureOptions, render, still};
use runner::record::frame::{Field, Frame, Piece, Topology};
use runner::record::{frame_files, ply, vtk};

#[test]
fn vtk_and_ply_give_back_what_was_written() {
    let frame = synthetic::frame(0.3, 5);
    for piece in &frame.pieces {
        let read = vtk::decode(&vtk::encode(frame.time, frame.step, piece).unwrap()).unwrap();
        assert_eq!((read.time, read.step), (frame.time, frame.step));
        assert_eq!(Piece { name: piece.name.clone(), ..read.piece }, *piece);
        let read = ply::decode(&ply::encode(frame.time, frame.step, piece).unwrap()).unwrap();
        assert_eq!((read.time, read.step), (frame.time, frame.step));
        assert_eq!(read.piece, *piece);
    }
}

#[test]
fn extreme_numbers_and_empty_pieces_come_back() {
    let odd = Piece {
        name: "strands".into(),
        topology: Topology::Polylines { offsets: vec![0, 1, 1, 3] },
        positions: vec![[f64::MIN_POSITIVE, -0.0, 1e300], [1.0 / 3.0, 2.0, 3.0], [4.0, 5.0, 6.0]],
        point_fields: vec![Field::scalar("a <\"b\"> & c", vec![f64::INFINITY, -1e-300, 0.1])],
        cell_fields: vec![],
    };
    let empty = Piece {
        name: "particles".into(),
        topology: Topology::Points,
        positions: vec![],
        point_fields: vec![Field::integer("id", vec![])],
        cell_fields: vec![],
    };
    for piece in [odd, empty] {
        let read = vtk::decode(&vtk::encode(0.1, 3, &piece).unwrap()).unwrap();
        assert_eq!(read.piece.positions, piece.positions);
        assert_eq!((&read.piece.topology, &read.piece.point_fields), (&piece.topology, &piece.point_fields));
        let read = ply::decode(&ply::encode(0.1, 3, &piece).unwrap()).unwrap();
        assert_eq!((&read.piece.topology, &read.piece.positions), (&piece.topology, &piece.positions));
    }
}

#[test]
fn inconsistent_pieces_are_refused() {
    let good = synthetic::frame(0.0, 2).pieces.swap_remove(0);
    let bad = [
        Piece { topology: Topology::Polylines { offsets: vec![0, 5] }, ..good.clone() },
        Piece { topology: Topology::Polylines { offsets: vec![0, 60, 41, 82] }, ..good.clone() },
        Piece { topology: Topology::Segments(vec![[0, 82]]), ..good.clone() },
        Piece { topology: Topology::Triangles(vec![[0, 1, u32::MAX]]), ..good.clone() },
        Piece { point_fields: vec![Field::scalar("radius", vec![1.0])], ..good.clone() },
    ];
    for piece in bad {
        assert!(vtk::encode(0.0, 0, &piece).is_err());
        assert!(ply::encode(0.0, 0, &piece).is_err());
    }
}

#[test]
fn every_cut_is_refused_and_none_panics() {
    let frame = synthetic::frame(0.3, 1);
    for piece in &frame.pieces[..3] {
        let (v, p) = (vtk::encode(0.0, 0, piece).unwrap(), ply::encode(0.0, 0, piece).unwrap());
        // The last array ends 30 bytes before the end of the VTK file.
        for k in 1..40 {
            assert!(vtk::decode(&v[..(v.len() - 31) * k / 40]).is_err());
            assert!(ply::decode(&p[..(p.len() - 1) * k / 40]).is_err());
        }
        for (bytes, at) in [(&v, v.len() / 3), (&v, 400), (&p, 200), (&p, p.len() / 2)] {
            let mut broken = bytes.clone();
            broken[at..at + 8].fill(0xff);
            let _ = vtk::decode(&broken);
            let _ = ply::decode(&broken);
        }
    }
}

#[test]
fn a_resumed_run_leaves_the_same_files() {
    let (once, twice) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let write = |dir: &tempfile::TempDir, indices: &[u64]| {
        for &index in indices {
            vtk::write_frame(dir.path(), index, &synthetic::frame(index as f64 * 0.1, 2)).unwrap();
        }
    };
    write(&once, &[0, 1, 2, 3, 4]);
    write(&twice, &[0, 1, 2, 3]);
    write(&twice, &[2, 3, 4]);
    let content = |dir: &tempfile::TempDir| {
        let mut files: Vec<_> = fs::read_dir(dir.path()).unwrap().map(|e| e.unwrap().path()).collect();
        files.sort();
        files.into_iter().map(|f| (f.file_name().unwrap().to_owned(), fs::read(f).unwrap())).collect::<Vec<_>>()
    };
    assert_eq!(content(&once), content(&twice));
    let listed = frame_files::list(once.path()).unwrap();
    assert_eq!(listed.iter().map(|f| f.index).collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
    let frame = frame_files::load(&listed[3]).unwrap();
    assert_eq!((frame.step, frame.pieces.len()), (300, 4));
}

#[test]
fn pictures_are_the_same_for_any_number_of_threads_and_show_something() {
    let frame = synthetic::frame(0.2, 20);
    let options = PictureOptions { width: 240, height: 160, ..PictureOptions::default() };
    let with = |threads: usize| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| still(&frame, &options))
    };
    let picture = with(1);
    assert_eq!(picture, with(4));
    let dark = picture.pixels.iter().filter(|p| p.iter().map(|&v| u32::from(v)).sum::<u32>() < 360).count();
    assert!(dark > 240 * 160 / 100, "{dark} dark pixels");
    // Everything that moves is inside the frame: the outermost rows and columns show only background or floor.
    let colored = |p: &[u8; 3]| p[0].abs_diff(p[2]) > 60;
    let edge = picture.pixels[..240].iter().chain(picture.pixels.chunks(240).flat_map(|row| [&row[0], &row[239]]));
    assert_eq!(edge.filter(|p| colored(p)).count(), 0);
}

#[test]
fn one_camera_holds_the_whole_run_still() {
    let mut framing = Framing::default();
    (0..10).for_each(|k| framing.include(&synthetic::frame(f64::from(k) * 0.1, 6)));
    let options = PictureOptions {
        width: 120,
        height: 80,
        color: ColorBy::Field { name: "velocity".into(), low: 0.0, high: 1.0 },
        ..PictureOptions::default()
    };
    let camera = Camera::new(&framing, &options);
    let (a, b) =
        (render(&synthetic::frame(0.0, 6), &camera, &options), render(&synthetic::frame(0.45, 6), &camera, &options));
    assert_ne!(a, b);
    assert!(!framing.is_clipped() && framing.left_out() == 0);
}

#[test]
fn broken_and_odd_frames_still_give_a_picture() {
    let options = PictureOptions { width: 64, height: 48, supersample: 1, ..PictureOptions::default() };
    let points = |positions: Vec<[f64; 3]>| Frame {
        pieces: vec![Piece {
            name: "strands".into(),
            topology: Topology::Points,
            positions,
            point_fields: vec![],
            cell_fields: vec![],
        }],
        ..Frame::default()
    };
    for frame in [
        Frame::default(),
        points(vec![]),
        points(vec![[1.0, 2.0, 3.0]]),
        points(vec![[0.0; 3]; 4]),
        points(vec![[f64::NAN, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
        points(vec![[1e200, 0.0, 0.0], [-1e200, 0.0, 1.0]]),
        points(vec![[1e-200, 0.0, 0.0], [0.0, 1e-200, 0.0]]),
    ] {
        assert_eq!(still(&frame, &options).pixels.len(), 64 * 48);
    }
    let mut framing = Framing::default();
    framing.include(&points(vec![[0.0; 3], [1.0; 3]]));
    framing.include(&points(vec![[0.0; 3], [1e3, f64::INFINITY, 0.0], [900.0; 3]]));
    assert!(framing.is_clipped());
    assert_eq!(framing.left_out(), 1);
}

use super::*;

fn build<const D: usize>(shape: YarnShape) -> Vec<Strand<D>> {
    YarnGroup::new(shape).build("yarns[0]", 0.02).unwrap()
}

fn even<const D: usize>(strands: &[Strand<D>], tolerance: f64) {
    for strand in strands {
        for l in &strand.rest {
            assert!((l - 0.01).abs() < tolerance * 0.01, "{l}");
        }
    }
}

#[test]
fn shapes_have_even_segments_of_the_length_asked_for() {
    let line = build::<2>(YarnShape::Line { from: vec![0.0, 0.0], to: vec![0.3, 0.4] });
    assert_eq!(line[0].points.len(), 51);
    even(&line, 1e-12);
    let lines = build::<3>(YarnShape::Lines {
        from: vec![0.0; 3],
        to: vec![0.2, 0.0, 0.0],
        count: 3,
        step: vec![0.0, 0.02, 0.0],
    });
    assert_eq!((lines.len(), lines[2].points[0].y), (3, 0.04));
    let ring = build::<3>(YarnShape::Circle {
        center: vec![0.0; 3],
        radius: 0.2,
        normal: vec![0.0, 1.0, 0.0],
        start: 0.0,
        sweep: None,
    });
    even(&ring, 0.02);
    assert!(ring[0].points.iter().all(|p| (p.norm() - 0.2).abs() < 1e-15 && p.y.abs() < 1e-15));
    let gap = (ring[0].points[0] - ring[0].points.last().unwrap()).norm();
    assert!((gap - ring[0].rest[0]).abs() < 1e-12);
    let helix = build::<3>(YarnShape::Helix { from: vec![0.0; 3], to: vec![0.0, 0.0, 0.3], radius: 0.05, turns: 3.0 });
    even(&helix, 0.02);
    assert!((helix[0].points.last().unwrap().z - 0.3).abs() < 1e-12);
}

#[test]
fn weave_yarns_alternate_and_keep_apart() {
    let amplitude = 0.012;
    let yarns = build::<3>(YarnShape::Weave {
        center: vec![0.0; 3],
        warp: vec![],
        weft: vec![],
        count: (4, 5),
        spacing: 0.05,
        amplitude,
        overhang: None,
    });
    assert_eq!(yarns.len(), 9);
    even(&yarns, 0.06);
    // At a crossing warp and weft are about two amplitudes apart, alternately above and below.
    let height = |strand: &Strand<3>, axis: usize, at: f64| {
        strand.points.iter().min_by(|a, b| (a[axis] - at).abs().total_cmp(&(b[axis] - at).abs())).unwrap().z
    };
    for i in 0..4 {
        for j in 0..5 {
            let (x, y) = ((f64::from(j) - 2.0) * 0.05, (f64::from(i) - 1.5) * 0.05);
            let gap = height(&yarns[i as usize], 0, x) - height(&yarns[4 + j as usize], 1, y);
            assert!(gap.abs() > 1.8 * amplitude, "{i} {j} {gap}");
            assert_eq!(gap > 0.0, (i + j) % 2 == 0);
        }
    }
}

#[test]
fn knit_rows_pass_through_each_other_without_touching() {
    let yarns =
        build::<3>(YarnShape::Knit { center: vec![0.0; 3], rows: 3, loops: 3, width: 0.16, height: 0.08, depth: 0.03 });
    let mut least = f64::INFINITY;
    for (a, first) in yarns.iter().enumerate() {
        for second in &yarns[a + 1..] {
            for p in &first.points {
                for q in &second.points {
                    least = least.min((p - q).norm());
                }
            }
        }
    }
    assert!(least > 0.4 * 0.03, "{least}");
    let reach = |s: &Strand<3>| s.points.iter().map(|p| p.y).fold(f64::NEG_INFINITY, f64::max);
    assert!(reach(&yarns[0]) > yarns[1].points[0].y + 0.05, "heads of a row reach into the next");
}

#[test]
fn random_yarns_stay_inside_and_repeat() {
    let shape =
        |seed| YarnShape::HairBall { center: vec![1.0, 0.0, 0.0], radius: 0.1, count: 5, length: 0.6, curl: 0.1, seed };
    let a = build::<3>(shape(7));
    assert_eq!(a, build::<3>(shape(7)));
    assert_ne!(a, build::<3>(shape(8)));
    for strand in &a {
        assert!(strand.points.iter().all(|p| (p - SVector::from([1.0, 0.0, 0.0])).norm() <= 0.1 + 1e-12));
        assert!(strand.rest.iter().all(|l| *l > 0.005), "{:?}", strand.rest);
    }
    let pile =
        build::<2>(YarnShape::CutPile { low: vec![0.0; 2], high: vec![1.0; 2], count: 20, length: 0.2, seed: 1 });
    assert!(pile.iter().flat_map(|s| &s.points).all(|p| p.iter().all(|x| (-1e-12..=1.0 + 1e-12).contains(x))));
}

#[test]
fn bad_groups_are_refused_by_name() {
    let refuse = |shape| YarnGroup::new(shape).build::<2>("yarns[0]", 0.02).unwrap_err().to_string();
    assert!(refuse(YarnShape::Line { from: vec![0.0], to: vec![1.0, 0.0] }).contains("yarns[0].shape.from"));
    let zero = refuse(YarnShape::Polyline {
        points: vec![vec![0.0, 0.0], vec![0.0, 0.0]],
        rest_lengths: vec![],
        velocities: vec![],
    });
    assert!(zero.contains("segment 0 has rest length 0"), "{zero}");
    assert!(
        refuse(YarnShape::Helix { from: vec![0.0; 2], to: vec![1.0; 2], radius: 0.1, turns: 1.0 }).contains("three")
    );
}

#[test]
fn text_becomes_polylines() {
    let text = "x, y\n# a comment\n0, 0\n1; 0.5\n\n0 1\n0 2\n0 3\n";
    let yarns = parse_polylines(text, 2).unwrap();
    assert_eq!((yarns.len(), yarns[1].len(), yarns[0][1][1]), (2, 3, 0.5));
    assert_eq!(parse_polylines("0,0\n1,b\n", 2).unwrap_err().to_string(), "line 2: expected 2 numbers, found `1,b`");
    assert!(matches!(parse_polylines("0,0\n", 2), Err(PolylineError::Short { .. })));
}

//! Scenes with every vertex written out, as importers make them, load in time proportional to their size.

use runner::scene::{expand, load_str};
use std::fmt::Write as _;
use std::time::Instant;

fn scene(strands: usize) -> String {
    let mut text = String::from(
        "Scene(units: Cgs, time: (end: 1.0, step: Fixed(1e-3)), materials: { \"hair\": Fibre(preset: \"hair\") }, strands: [\n",
    );
    for strand in 0..strands {
        text.push_str("(material: \"hair\", shape: Polyline(points: [");
        for vertex in 0..41 {
            let _ = write!(
                text,
                "[{}, {}, {}], ",
                0.1 * vertex as f64,
                0.01 * strand as f64,
                0.123_456_789 / (1 + vertex) as f64
            );
        }
        text.push_str("]), clamp: [First(count: 2)]),\n");
    }
    text.push_str("])");
    text
}

/// 2192 strands of 41 vertices (3 MB of text): every strand arrives, and four times the strands take no more than eight times the time.
#[test]
fn many_polylines_load_in_linear_time() {
    let mut seconds = Vec::new();
    for strands in [548, 2192] {
        let text = scene(strands);
        let best = (0..3)
            .map(|_| {
                let start = Instant::now();
                let loaded = load_str(&text, "large.ron", &[]).unwrap();
                let elapsed = start.elapsed().as_secs_f64();
                assert_eq!(expand(&loaded.scene).unwrap().len(), strands);
                elapsed
            })
            .fold(f64::INFINITY, f64::min);
        println!("{strands} strands, {} bytes: {best:.3} s", text.len());
        seconds.push(best);
    }
    assert!(seconds[1] < 8.0 * seconds[0].max(0.02), "{seconds:?}");
}

//! Random blocks of one contact, from well conditioned to singular, by both local methods: `local_blocks [BLOCKS] [SEED]`.
//!
//! Prints the worst residual and every block that misses 1e-11.

use contact::families::Random;
use contact::local::{LocalContact, LocalMethod};

fn main() {
    let argument = |i: usize, default: u64| std::env::args().nth(i).and_then(|a| a.parse().ok()).unwrap_or(default);
    let (blocks, seed) = (argument(1, 1_000_000), argument(2, 1));
    let mut random = Random::new(seed);
    let (mut worst, mut missed, mut fallen) = (0.0_f64, 0, 0);
    for i in 0..blocks {
        let rows = random.index(1, 5);
        let floor = 10f64.powf(random.uniform(-16.0, 0.0));
        let unit = 10f64.powf(random.uniform(-9.0, 9.0));
        let h: Vec<f64> = (0..3 * rows).map(|_| random.uniform(-1.0, 1.0)).collect();
        let mut w = [0.0; 9];
        for a in 0..3 {
            for b in 0..3 {
                w[3 * a + b] = (0..rows).map(|k| h[rows * a + k] * h[rows * b + k]).sum();
            }
            w[4 * a] += floor;
        }
        let w = w.map(|v| v * unit);
        let b = [random.uniform(-2.0, 2.0), random.uniform(-2.0, 2.0), random.uniform(-2.0, 2.0)];
        let local = LocalContact::new(&w, random.uniform(0.01, 1.5));
        for method in [LocalMethod::Enumerative, LocalMethod::Newton] {
            let s = local.solve(&b, &[0.0; 3], method);
            worst = worst.max(s.residual);
            fallen += u64::from(s.fell_back);
            if !(s.residual <= 1e-11) {
                missed += 1;
                println!(
                    "{i} {method:?} rows {rows} floor {floor:.1e}: {:.1e} for {w:?} {b:?} {}",
                    s.residual, local.friction
                );
            }
        }
    }
    println!("{blocks} blocks by both methods: worst residual {worst:.1e}, {missed} above 1e-11, {fallen} fell back");
}

//! Gradient and Hessian of whole strands: stretch against dual numbers, everything against Richardson differences.
//!
//! The bending and twisting element alone is checked against second-order dual numbers in `constitutive::curvature`.

use nalgebra::{SVector, Vector3};
use num_dual::{DualNum, hessian};
use numerics::transport::parallel_transport;
use rods::*;

type V = Vector3<f64>;

struct Random(u64);
impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((self.0 >> 11) as f64) / ((1u64 << 52) as f64) - 1.0
    }
}

/// Strands of random bends; kind 1 nearly straight, 2 nearly folded in the middle, 3 with a short edge.
fn strand(r: &mut Random, kind: usize) -> RodSet {
    let n = 7;
    let mut x = V::zeros();
    let mut t = V::new(0.3, 0.2, 1.0).normalize();
    let mut positions = vec![x];
    for j in 0..n - 1 {
        let length = if kind == 3 && j == 3 { 1e-2 } else { 1.0 + 0.2 * r.next() };
        x += t * length;
        positions.push(x);
        let bend = match kind {
            1 => 1e-4,
            2 if j == 2 => 3.0,
            _ => 0.9,
        };
        let side = V::new(r.next(), r.next(), r.next());
        let side = (side - t * t.dot(&side)).normalize();
        t = (t * f64::cos(bend) + side * f64::sin(bend)).normalize();
    }
    let material = StrandMaterial { young_modulus: 10.0, poisson_ratio: 0.3, density: 1.0, ..Default::default() };
    let mut spec =
        StrandSpec::new(positions, 0.5, material).with_rest(RestShape::Uniform { curvature: [0.2, -0.1], twist: 0.3 });
    spec.radii = (0..n).map(|i| [0.5 + 0.02 * i as f64, 0.4]).collect();
    spec.rest_lengths = Some((0..n - 1).map(|_| 1.0 + 0.1 * r.next()).collect());
    spec.twist_angles = Some((0..n - 1).map(|_| 9.4 * r.next()).collect());
    let mut rods = RodSet::new();
    rods.add_strand(&spec).unwrap();
    rods
}

/// The strand with one unknown moved, frames carried by parallel transport from where it was.
fn moved(rods: &RodSet, unknown: usize, by: f64) -> RodSet {
    let mut out = rods.clone();
    let (i, c) = (unknown / 4, unknown % 4);
    if c == 3 {
        out.twist_angle[i] += by;
        return out;
    }
    out.position[i][c] += by;
    for j in 0..rods.edge_count() {
        let (from, to) = (rods.tangent(0, j).0, out.tangent(0, j).0);
        out.reference_director[j] = parallel_transport(&rods.reference_director[j], &from, &to).0;
    }
    out
}

fn energy(rods: &RodSet) -> f64 {
    rods.strand_energy(0, &Loads::default()).elastic()
}

/// Central differences extrapolated twice.
fn richardson(f: impl Fn(f64) -> f64, h: f64) -> f64 {
    let d = |h: f64| (f(h) - f(-h)) / (2.0 * h);
    let (a, b, c) = (d(h), d(0.5 * h), d(0.25 * h));
    let (ab, bc) = (b + (b - a) / 3.0, c + (c - b) / 3.0);
    bc + (bc - ab) / 15.0
}

#[test]
fn gradients_of_whole_strands_match_richardson_differences() {
    let mut r = Random(3);
    for trial in 0..24 {
        let rods = strand(&mut r, trial % 4);
        let g = rods.elastic_gradient(0);
        let scale = g.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let h = if trial % 4 == 3 { 5e-5 } else { 5e-3 };
        let h = if trial % 4 == 2 { 1e-3 } else { h };
        for d in 0..g.len() - 1 {
            let numeric = richardson(|s| energy(&moved(&rods, d, s)), h);
            assert!((numeric - g[d]).abs() < 1e-8 * scale, "{trial} {d}: {numeric} {} of {scale}", g[d]);
        }
    }
}

#[test]
fn hessians_of_whole_strands_match_second_differences() {
    let mut r = Random(11);
    for trial in 0..4 {
        let rods = strand(&mut r, trial % 2);
        let k = rods.elastic_hessian(0);
        let n = k.columns.len() - 1;
        let scale = k.columns.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
        let centre = energy(&rods);
        for d in 0..n {
            // along one unknown the energy is a function of one number: second differences, extrapolated
            let second = |h: f64| (energy(&moved(&rods, d, h)) - 2.0 * centre + energy(&moved(&rods, d, -h))) / (h * h);
            let (a, b, c) = (second(4e-2), second(2e-2), second(1e-2));
            let (ab, bc) = (b + (b - a) / 3.0, c + (c - b) / 3.0);
            let numeric = bc + (bc - ab) / 15.0;
            assert!((numeric - k.get(d, d)).abs() < 1e-6 * scale, "{trial} {d}: {numeric} {}", k.get(d, d));
        }
    }
}

#[test]
fn stretch_matches_dual_numbers() {
    let mut r = Random(5);
    for strain in [-0.4, -1e-3, 0.0, 1e-6, 0.7] {
        let rest = 1.0;
        let (x, direction) = (V::new(r.next(), r.next(), r.next()), V::new(r.next(), r.next(), r.next()).normalize());
        let end = x + direction * (rest * (1.0 + strain));
        let material = StrandMaterial { young_modulus: 3.0, density: 1.0, ..Default::default() };
        let mut spec = StrandSpec::new(vec![x, end], 0.6, material);
        spec.rest_lengths = Some(vec![rest]);
        let mut rods = RodSet::new();
        rods.add_strand(&spec).unwrap();
        let ks = std::f64::consts::PI * 0.36 * 3.0;
        fn law<D: DualNum<Primitive = f64> + Copy>(q: &[D], ks: f64, rest: f64) -> D {
            let e = [q[3] - q[0], q[4] - q[1], q[5] - q[2]];
            let strain = (e[0] * e[0] + e[1] * e[1] + e[2] * e[2]).sqrt() / rest - 1.0;
            strain * strain * (0.5 * ks * rest)
        }
        let q = SVector::<f64, 6>::from_iterator(x.iter().chain(end.iter()).copied());
        let (value, gradient, exact) = hessian(|q| law(q.as_slice(), ks, rest), &q);
        assert!((energy(&rods) - value).abs() < 1e-14);
        let (g, k) = (rods.elastic_gradient(0), rods.elastic_hessian(0));
        let place = |d: usize| if d < 3 { d } else { d + 1 };
        for a in 0..6 {
            assert!((g[place(a)] - gradient[a]).abs() < 1e-14);
            for b in 0..6 {
                assert!((k.get(place(a), place(b)) - exact[(a, b)]).abs() < 1e-13 * exact.amax());
            }
        }
    }
}

//! Derivatives against second-order dual numbers, and the invariances of the energy.

use super::*;
use nalgebra::{SVector, Vector3};
use num_dual::{DualNum, hessian};
use numerics::lanes::V3;
use numerics::transport::{any_normal, rotate_about};

/// The state in which frames are based, and the law.
#[derive(Clone, Debug)]
struct Sample {
    q: SVector<f64, 11>,
    d1e: Vector3<f64>,
    d1f: Vector3<f64>,
    reference: f64,
    law: CurvatureLaw<f64>,
}

struct Random(u64);
impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((self.0 >> 11) as f64) / ((1u64 << 52) as f64) - 1.0
    }
    fn vector(&mut self) -> Vector3<f64> {
        Vector3::new(self.next(), self.next(), self.next())
    }
}

fn at(q: &SVector<f64, 11>, i: usize) -> Vector3<f64> {
    Vector3::new(q[i], q[i + 1], q[i + 2])
}

fn sample(r: &mut Random, kind: usize) -> Sample {
    let te = r.vector().normalize();
    let normal = rotate_about(&any_normal(&te), &te, 3.0 * r.next());
    // random, near-straight, near-folded, short second edge
    let angle: f64 = match kind % 4 {
        0 => 1.2 * r.next(),
        1 => 1e-4 * r.next(),
        2 => 3.05 + 0.02 * r.next(),
        _ => 0.8 * r.next(),
    };
    let (le, lf) = (1.0 + 0.3 * r.next(), if kind % 4 == 3 { 1e-3 } else { 1.0 + 0.3 * r.next() });
    let tf = te * angle.cos() + normal * angle.sin();
    let x0 = r.vector();
    let (x1, x2) = (x0 + te * le, x0 + te * le + tf * lf);
    let mut q = SVector::<f64, 11>::zeros();
    for i in 0..3 {
        q[i] = x0[i];
        q[4 + i] = x1[i];
        q[8 + i] = x2[i];
    }
    q[3] = 9.42 * r.next();
    q[7] = 9.42 * r.next();
    let te = (x1 - x0).normalize();
    let tf = (x2 - x1).normalize();
    let d1e = rotate_about(&any_normal(&te), &te, 3.0 * r.next());
    let d1f = rotate_about(&any_normal(&tf), &tf, 3.0 * r.next());
    let (d1e, d1f) = ((d1e - te * te.dot(&d1e)).normalize(), (d1f - tf * tf.dot(&d1f)).normalize());
    let guess = std::f64::consts::TAU * r.next();
    let reference = reference_twist(guess, V3(d1e.into()), V3(te.into()), V3(d1f.into()), V3(tf.into()));
    let law = CurvatureLaw {
        c0: 1.0 + 0.5 * r.next(),
        c1: 2.0 + 0.5 * r.next(),
        cm: 1.5 + 0.5 * r.next(),
        rest: std::array::from_fn(|_| r.next()),
        rest_twist: r.next(),
    };
    Sample { q, d1e, d1f, reference, law }
}

/// The energy by its definition, frames transported from the base state, in any arithmetic.
fn energy<D: DualNum<Primitive = f64> + Copy>(s: &Sample, q: &[D]) -> D {
    type W<D> = [D; 3];
    fn dot<D: DualNum<Primitive = f64> + Copy>(a: W<D>, b: W<D>) -> D {
        a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    }
    fn cross<D: DualNum<Primitive = f64> + Copy>(a: W<D>, b: W<D>) -> W<D> {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    }
    // Rodrigues' form of the minimal rotation, not the closed form used by the code under test
    fn transport<D: DualNum<Primitive = f64> + Copy>(v: W<D>, s: W<D>, t: W<D>) -> W<D> {
        let w = cross(s, t);
        let wv = cross(w, v);
        let wwv = cross(w, wv);
        let c = dot(s, t) + 1.0;
        std::array::from_fn(|i| v[i] + wv[i] + wwv[i] / c)
    }
    let unit = |a: &[D], b: &[D]| -> W<D> {
        let e: W<D> = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
        let l = dot(e, e).sqrt();
        [e[0] / l, e[1] / l, e[2] / l]
    };
    let lift = |v: Vector3<f64>| -> W<D> { [D::from(v[0]), D::from(v[1]), D::from(v[2])] };
    let base = |i: usize| (at(&s.q, i + 4) - at(&s.q, i)).normalize();
    let (te, tf) = (unit(&q[0..3], &q[4..7]), unit(&q[4..7], &q[8..11]));
    let d1e = transport(lift(s.d1e), lift(base(0)), te);
    let d1f = transport(lift(s.d1f), lift(base(4)), tf);
    let turn = |d1: W<D>, t: W<D>, angle: D| -> (W<D>, W<D>) {
        let d2 = cross(t, d1);
        let (sn, c) = angle.sin_cos();
        (std::array::from_fn(|i| d1[i] * c + d2[i] * sn), std::array::from_fn(|i| d2[i] * c - d1[i] * sn))
    };
    let (m1e, m2e) = turn(d1e, te, q[3]);
    let (m1f, m2f) = turn(d1f, tf, q[7]);
    let chi = dot(te, tf) + 1.0;
    let kb: W<D> = cross(te, tf).map(|v| v * 2.0 / chi);
    let k = [dot(m2e, kb), -dot(m1e, kb), dot(m2f, kb), -dot(m1f, kb)];
    let u = transport(d1e, te, tf);
    let (u, _) = turn(u, tf, D::from(s.reference));
    let reference = dot(cross(u, d1f), tf).atan2(dot(u, d1f)) + s.reference;
    let m = reference + q[7] - q[3] - s.law.rest_twist;
    let d: [D; 4] = std::array::from_fn(|i| k[i] - s.law.rest[i]);
    ((d[0] * d[0] + d[2] * d[2]) * s.law.c0 + (d[1] * d[1] + d[3] * d[3]) * s.law.c1 + m * m * s.law.cm) * 0.5
}

fn element(s: &Sample) -> (CurvatureElement<f64>, f64) {
    let (e, f) = (at(&s.q, 4) - at(&s.q, 0), at(&s.q, 8) - at(&s.q, 4));
    let (le, lf) = (e.norm(), f.norm());
    let (te, tf) = (V3((e / le).into()), V3((f / lf).into()));
    let x = CurvatureElement::new(
        te,
        tf,
        1.0 / le,
        1.0 / lf,
        directors(te, V3(s.d1e.into()), s.q[3]),
        directors(tf, V3(s.d1f.into()), s.q[7]),
    );
    (x, s.reference + s.q[7] - s.q[3])
}

#[test]
fn gradient_and_hessian_match_dual_numbers_on_all_kinds_of_states() {
    let mut r = Random(7);
    let (mut worst_gradient, mut worst_hessian) = (0.0f64, 0.0f64);
    for n in 0..400 {
        let s = sample(&mut r, n);
        let (value, gradient, exact) = hessian(|q| energy(&s, q.as_slice()), &s.q);
        let (x, m) = element(&s);
        assert!((s.law.energy(&x, m) - value).abs() < 1e-10 * value.abs());
        let (g, h) = s.law.gradient_hessian::<true>(&x, m);
        let (g, h) = (vertex_gradient(&g), vertex_hessian(&h));
        worst_gradient = worst_gradient.max((g - gradient).amax() / gradient.amax());
        worst_hessian = worst_hessian.max((h - exact).amax() / exact.amax());
        assert!((h - h.transpose()).amax() <= 1e-12 * h.amax());
        let only = vertex_gradient(&s.law.gradient(&x, m));
        assert!((only - g).amax() <= 1e-13 * g.amax());
    }
    assert!(worst_gradient < 1e-9, "gradient {worst_gradient:e}");
    assert!(worst_hessian < 1e-8, "hessian {worst_hessian:e}");
}

#[test]
fn no_net_force_and_no_net_torque() {
    let mut r = Random(19);
    for n in 0..400 {
        let s = sample(&mut r, n);
        let (x, m) = element(&s);
        let g = vertex_gradient(&s.law.gradient(&x, m));
        let (f0, f1, f2) = (at(&g, 0), at(&g, 4), at(&g, 8));
        assert!((f0 + f1 + f2).norm() <= 1e-10 * g.amax());
        let torque = at(&s.q, 0).cross(&f0)
            + at(&s.q, 4).cross(&f1)
            + at(&s.q, 8).cross(&f2)
            + Vector3::from(x.te.0) * g[3]
            + Vector3::from(x.tf.0) * g[7];
        assert!(torque.norm() <= 1e-10 * g.amax(), "{}", torque.norm() / g.amax());
    }
}

#[test]
fn reversing_the_polyline_keeps_the_energy() {
    let mut r = Random(23);
    for n in 0..100 {
        let s = sample(&mut r, n);
        let (x, m) = element(&s);
        // walking backwards: tangents change sign, m1 is kept, m2 = t × m1 changes sign; the law's curvatures swap edges
        let back = CurvatureElement::new(-x.tf, -x.te, x.inv_lf, x.inv_le, (x.m1f, -x.m2f), (x.m1e, -x.m2e));
        let mut law = s.law;
        law.rest = [s.law.rest[2], -s.law.rest[3], s.law.rest[0], -s.law.rest[1]];
        let (a, b) = (s.law.energy(&x, m), law.energy(&back, m));
        assert!((a - b).abs() <= 1e-12 * a.abs());
    }
}

#[test]
fn projection_removes_negative_eigenvalues_and_nothing_else() {
    let mut r = Random(5);
    let mut indefinite = 0;
    for n in 0..200 {
        let s = sample(&mut r, n);
        let (x, m) = element(&s);
        let (_, h) = s.law.gradient_hessian::<true>(&x, m);
        let before = vertex_hessian(&h).symmetric_eigenvalues();
        let after = vertex_hessian(&project_positive(&h, 1.0 / x.inv_le)).symmetric_eigenvalues();
        let scale = before.amax();
        indefinite += usize::from(before.min() < -1e-9 * scale);
        assert!(after.min() >= -1e-12 * scale);
        let (_, gauss_newton) = s.law.gradient_hessian::<false>(&x, m);
        let g = vertex_hessian(&gauss_newton).symmetric_eigenvalues();
        assert!(g.min() >= -1e-12 * g.amax());
    }
    assert!(indefinite > 50);
}

#[test]
fn folded_elements_stay_finite() {
    let t = V3([0.0, 0.0, 1.0]);
    let f = V3([0.0, 0.0, -1.0]);
    let d = V3([1.0, 0.0, 0.0]);
    let x = CurvatureElement::new(t, f, 1.0, 1.0, directors(t, d, 0.1), directors(f, d, 0.2));
    let law = CurvatureLaw { c0: 1.0, c1: 1.0, cm: 1.0, rest: [0.0; 4], rest_twist: 0.0 };
    let (g, h) = law.gradient_hessian::<true>(&x, 0.1);
    assert!(vertex_gradient(&g).iter().chain(vertex_hessian(&h).iter()).all(|v| v.is_finite()));
    assert!(x.chi < MIN_CHI);
}

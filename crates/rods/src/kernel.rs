//! The hot loop: energy, gradient and band matrix of four strands in one pass.
//!
//! The pass walks along the edges. Everything is collected per edge first (a Hessian in edge vectors is block
//! tridiagonal) and turned into vertex columns as soon as the edges around a vertex are complete, so that each entry
//! of the band is written exactly once. In displacements `u` the function is
//! `Ψ(u) = ½ u·A u − b·u + E(q̃ + u)` with a diagonal `A`; its gradient is a force, its Hessian a stiffness.
//!
//! Work per vertex and four strands: about 800 flops for the exact Hessian; memory per strand and vertex: 176 B
//! of coefficients and 112 B of frames read, 352 B of matrix written.

use crate::settings::HessianMode;
use constitutive::curvature::{
    CurvatureElement, CurvatureLaw, ElementHessian, directors, project_positive_lanes, reference_twist,
};
use numerics::lanes::{F4, Lane, LaneKernel, V3, dispatch};
use numerics::transport::{orthonormalize, transport_normal};

/// Half-bandwidth of a strand's matrix plus one: a vertex sees two neighbours on either side.
pub(crate) const W: usize = 11;

/// What one vertex and the edge after it contribute, for four strands.
#[derive(Clone, Copy, Default)]
pub(crate) struct VertexData {
    /// Diagonal of the quadratic part, x, y, z and angle \[N/m, N m\].
    pub diagonal: [F4; 4],
    /// Linear part \[N, N m\].
    pub linear: [F4; 4],
    /// Edge vector of the predicted state \[m\].
    pub edge: [F4; 3],
    /// Twist angle of the predicted state \[rad\].
    pub theta: F4,
    /// Stretch stiffness over rest length \[N/m\].
    pub stretch: F4,
    /// Length without stretch \[m\] (rest length, shifted by internal viscosity).
    pub length: F4,
    /// Stiffness of curvatures 0 and 2 \[N m\].
    pub c0: F4,
    /// Stiffness of curvatures 1 and 3 \[N m\].
    pub c1: F4,
    /// Stiffness of twist \[N m\].
    pub cm: F4,
    /// Curvatures without stress.
    pub rest: [F4; 4],
    /// Twist without stress \[rad\].
    pub rest_twist: F4,
}

/// Tangent and reference director of an edge, and the reference twist of the vertex at its start.
#[derive(Clone, Copy, Default)]
pub(crate) struct Frame {
    pub tangent: [F4; 3],
    pub director: [F4; 3],
    pub reference_twist: F4,
}

/// What an evaluation returns per lane.
#[derive(Clone, Copy, Default)]
pub(crate) struct Value {
    /// Elastic (and viscous) energy \[J\].
    pub energy: F4,
    /// One if no element is folded and no edge vanishes, else zero.
    pub admissible: F4,
}

/// One pass over four strands of equal vertex count.
pub(crate) struct Evaluation<'a> {
    pub data: &'a [VertexData],
    /// Frames from which those of this state are carried.
    pub base: &'a [Frame],
    /// Displacement from the predicted state.
    pub u: &'a [[F4; 4]],
    /// Frames of this state (out).
    pub frames: &'a mut [Frame],
    /// Gradient of Ψ (out).
    pub gradient: &'a mut [[F4; 4]],
}

impl Evaluation<'_> {
    /// Energy and gradient; with a matrix also its entries, four columns per vertex.
    pub(crate) fn run(self, band: Option<(&mut [[F4; W]], HessianMode)>) -> Value {
        match band {
            None => dispatch(Pass::<0> { x: self, band: &mut [] }),
            Some((band, HessianMode::Exact)) => dispatch(Pass::<1> { x: self, band }),
            Some((band, HessianMode::ElementProjected)) => dispatch(Pass::<2> { x: self, band }),
            Some((band, HessianMode::GaussNewton | HessianMode::Shifted)) => dispatch(Pass::<3> { x: self, band }),
        }
    }
}

/// `MODE`: 0 no matrix, 1 exact, 2 projected, 3 Gauss–Newton.
struct Pass<'a, 'b, const MODE: u8> {
    x: Evaluation<'a>,
    band: &'b mut [[F4; W]],
}

/// An edge under construction: kinematics, and sums of gradient and Hessian.
#[derive(Clone, Copy)]
struct Edge<L> {
    t: V3<L>,
    d1: V3<L>,
    m: (V3<L>, V3<L>),
    inv: L,
    theta: L,
    /// ∂E/∂e
    ge: V3<L>,
    /// ∂E/∂θ
    gt: L,
    /// ∂²E/∂e²
    ee: [L; 6],
    /// ∂²E/∂e∂θ
    et: V3<L>,
    /// ∂²E/∂θ²
    tt: L,
}

/// Mixed derivatives of the edges before and after a vertex.
#[derive(Clone, Copy)]
struct Coupling<L> {
    ef: [[L; 3]; 3],
    /// edge before, angle after
    e_tf: V3<L>,
    /// edge after, angle before
    f_te: V3<L>,
    tt: L,
}

impl<L: Lane> Edge<L> {
    #[inline(always)]
    fn none() -> Self {
        let z = L::splat(0.0);
        let v = V3::zero();
        Edge { t: v, d1: v, m: (v, v), inv: z, theta: z, ge: v, gt: z, ee: [z; 6], et: v, tt: z }
    }
}

impl<L: Lane> Coupling<L> {
    #[inline(always)]
    fn none() -> Self {
        let z = L::splat(0.0);
        Coupling { ef: [[z; 3]; 3], e_tf: V3::zero(), f_te: V3::zero(), tt: z }
    }
}

/// Index into the lower triangle of a symmetric 3×3 matrix.
const TRIANGLE: [[usize; 3]; 3] = [[0, 1, 3], [1, 2, 4], [3, 4, 5]];

impl<const MODE: u8> LaneKernel for Pass<'_, '_, MODE> {
    type Output = Value;

    #[inline(always)]
    fn run<L: Lane<Memory = F4>>(self) -> Value {
        let Evaluation { data, base, u, frames, gradient } = self.x;
        let band = self.band;
        let nv = data.len();
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let mut energy = zero;
        let mut admissible = one;
        let mut before = Edge::<L>::none();
        let mut here = Edge::<L>::none();
        let mut coupling = Coupling::<L>::none();
        let mut u0 = load3::<L>(&u[0]);
        // vertex `i` is written when the edges `i − 1` (before), `i` (here) and the element at `i + 1` are known
        for step in 0..=nv {
            let mut after = Edge::<L>::none();
            let mut next = Coupling::<L>::none();
            if step + 1 < nv {
                let d = &data[step];
                let u1 = load3::<L>(&u[step + 1]);
                let e = V3::load(&d.edge) + (u1 - u0);
                u0 = u1;
                let l = e.dot(e).sqrt();
                let inv = one / l;
                let t = e.scale(inv);
                let frame = &base[step];
                let carried = transport_normal(V3::<L>::load(&frame.director), V3::load(&frame.tangent), t);
                let d1 = orthonormalize(carried, t);
                let theta = L::load(&d.theta) + L::load(&u[step][3]);
                let m = directors(t, d1, theta);
                // stretch: E = ½ c (l − l₀)²
                let (c, rest) = (L::load(&d.stretch), L::load(&d.length));
                let dl = l - rest;
                energy += L::splat(0.5) * c * dl * dl;
                admissible = L::select_gt(l, rest * L::splat(1e-6), admissible, zero);
                after = Edge { t, d1, m, inv, theta, ge: t.scale(c * dl), ..Edge::none() };
                if MODE > 0 {
                    let mut across = c * (dl * inv); // c (1 − l₀/l)
                    if MODE > 1 {
                        across = across.max(zero);
                    }
                    let along = c - across;
                    for a in 0..3 {
                        for b in 0..=a {
                            let s = along * t.0[a] * t.0[b];
                            after.ee[TRIANGLE[a][b]] = if a == b { s + across } else { s };
                        }
                    }
                }
                let out = &mut frames[step];
                t.store(&mut out.tangent);
                d1.store(&mut out.director);
                if step > 0 {
                    let reference = reference_twist(L::load(&frame.reference_twist), here.d1, here.t, d1, t);
                    reference.store(&mut out.reference_twist);
                    let x = CurvatureElement::new(here.t, t, here.inv, inv, here.m, m);
                    admissible = L::select_gt(
                        x.chi,
                        L::splat(constitutive::curvature::MIN_CHI),
                        admissible,
                        zero,
                    );
                    let law = CurvatureLaw {
                        c0: L::load(&d.c0),
                        c1: L::load(&d.c1),
                        cm: L::load(&d.cm),
                        rest: [L::load(&d.rest[0]), L::load(&d.rest[1]), L::load(&d.rest[2]), L::load(&d.rest[3])],
                        rest_twist: L::load(&d.rest_twist),
                    };
                    let twist = reference + theta - here.theta;
                    energy += law.energy(&x, twist);
                    let g = if MODE == 0 {
                        law.gradient(&x, twist)
                    } else {
                        let (g, h): (_, ElementHessian<L>) = match MODE {
                            1 => law.gradient_hessian::<true>(&x, twist),
                            2 => {
                                let (g, h) = law.gradient_hessian::<true>(&x, twist);
                                (g, project_positive_lanes(&h, x.inv_le))
                            }
                            _ => law.gradient_hessian::<false>(&x, twist),
                        };
                        for n in 0..6 {
                            here.ee[n] += h.ee[n];
                            after.ee[n] += h.ff[n];
                        }
                        here.et = here.et + h.e_te;
                        after.et = h.f_tf;
                        here.tt += h.tt[0];
                        after.tt = h.tt[2];
                        next = Coupling { ef: h.ef, e_tf: h.e_tf, f_te: h.f_te, tt: h.tt[1] };
                        g
                    };
                    here.ge = here.ge + g.e;
                    here.gt += g.te;
                    after.ge = after.ge + g.f;
                    after.gt = g.tf;
                }
            }
            if step > 0 {
                // write vertex `step − 1`: edge `before` ends there, edge `here` starts there
                let i = step - 1;
                let d = &data[i];
                let ui = &u[i];
                let out = &mut gradient[i];
                let pull = before.ge - here.ge;
                for c in 0..3 {
                    (L::load(&d.diagonal[c]) * L::load(&ui[c]) - L::load(&d.linear[c]) + pull.0[c]).store(&mut out[c]);
                }
                (L::load(&d.diagonal[3]) * L::load(&ui[3]) - L::load(&d.linear[3]) + here.gt).store(&mut out[3]);
                if MODE > 0 {
                    let columns: &mut [[F4; W]] = &mut band[4 * i..4 * i + 4];
                    let (p, q) = (&coupling.ef, &next.ef);
                    for c in 0..3 {
                        let column = &mut columns[c];
                        for r in c..3 {
                            let mut v = before.ee[TRIANGLE[r][c]] + here.ee[TRIANGLE[r][c]] - (p[r][c] + p[c][r]);
                            if r == c {
                                v += L::load(&d.diagonal[c]);
                            }
                            v.store(&mut column[r - c]);
                        }
                        (coupling.e_tf.0[c] - here.et.0[c]).store(&mut column[3 - c]);
                        for r in 0..3 {
                            (p[c][r] + q[c][r] - here.ee[TRIANGLE[r][c]]).store(&mut column[4 + r - c]);
                            (-q[c][r]).store(&mut column[8 + r - c]);
                        }
                        (-next.e_tf.0[c]).store(&mut column[7 - c]);
                        for r in 11 - c..W {
                            column[r] = F4::ZERO;
                        }
                    }
                    let column = &mut columns[3];
                    (here.tt + L::load(&d.diagonal[3])).store(&mut column[0]);
                    for r in 0..3 {
                        (here.et.0[r] - next.f_te.0[r]).store(&mut column[1 + r]);
                        next.f_te.0[r].store(&mut column[5 + r]);
                    }
                    next.tt.store(&mut column[4]);
                    for r in 8..W {
                        column[r] = F4::ZERO;
                    }
                }
            }
            before = here;
            here = after;
            coupling = next;
        }
        let mut value = Value::default();
        energy.store(&mut value.energy);
        admissible.store(&mut value.admissible);
        value
    }
}

#[inline(always)]
fn load3<L: Lane<Memory = F4>>(u: &[F4; 4]) -> V3<L> {
    V3([L::load(&u[0]), L::load(&u[1]), L::load(&u[2])])
}

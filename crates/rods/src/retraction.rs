//! Steps of Newton's method that turn edges instead of stretching them.
//!
//! A straight step that turns an edge by θ also stretches it by θ²/2. Where stretching is a thousand times as stiff as bending the
//! line search then creeps along the curved valley of unstretched shapes. Here the end of the step is bent back onto it: every
//! edge takes the direction of the straight step, and of its change in length what belongs to it in first order.
//!
//! ```text
//! s = e + α Δ                 the edge after the straight step
//! c_{i+1} = c_i + s (L/|s| − 1),  L = |e| + α t·Δ       what vertices move beside it, from the held end on
//! ```
//! The correction is of second order in the step, so Newton's method keeps its order; it is added up along the strand from a
//! clamp at the first vertices, or about the middle of a strand that nothing holds. Strands held elsewhere step straight.

use numerics::lanes::{F4, Lane, LaneKernel, V3};

use crate::group::FixedDof;
use crate::kernel::VertexData;

/// Square of the largest turn of an edge below which a step is as good as straight: the stretch would be round-off.
const STRAIGHT: f64 = 1e-14;

/// Where the corrections of a lane are added up from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Anchor {
    /// Vertices are held that the corrections must not move.
    Elsewhere,
    /// The first vertices are held, or none but they.
    First,
    /// Nothing is held.
    Nowhere,
}

impl Anchor {
    /// Anchor of a lane, from what is held in it.
    pub fn of(fixed: &[FixedDof], lane: usize) -> Anchor {
        let held = || fixed.iter().filter(|f| f.lane == lane && f.dof % 4 < 3);
        let count = held().count();
        let first = count % 3 == 0 && held().all(|f| f.dof / 4 < count / 3);
        match (count == 0, first) {
            (true, _) => Anchor::Nowhere,
            (false, true) => Anchor::First,
            (false, false) => Anchor::Elsewhere,
        }
    }
}

/// `bent = α direction`, with the corrections of the lanes that take them.
pub(crate) struct Bend<'a> {
    pub data: &'a [VertexData],
    pub u: &'a [[F4; 4]],
    pub direction: &'a [[F4; 4]],
    pub alpha: F4,
    /// Largest turn of the lanes, squared.
    pub turn: F4,
    pub anchor: [Anchor; 4],
    pub bent: &'a mut [[F4; 4]],
}

impl LaneKernel for Bend<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lane<Memory = F4>>(self) {
        let (mut bends, mut floats) = (F4::ZERO, F4::ZERO);
        for l in 0..4 {
            let turns = self.turn[l] > STRAIGHT;
            bends[l] = f64::from(u8::from(turns && self.anchor[l] != Anchor::Elsewhere));
            floats[l] = f64::from(u8::from(turns && self.anchor[l] == Anchor::Nowhere));
        }
        let (bends, floats, alpha) = (L::load(&bends), L::load(&floats), L::load(&self.alpha));
        let zero = L::splat(0.0);
        let n = self.data.len();
        let get = |x: &[F4; 4]| V3([L::load(&x[0]), L::load(&x[1]), L::load(&x[2])]);
        let mut beside = V3([zero; 3]);
        let mut sum = V3([zero; 3]);
        for i in 0..n {
            let p = &self.direction[i];
            for c in 0..4 {
                let straight = alpha * L::load(&p[c]);
                let bent = if c < 3 { straight + beside.0[c] } else { straight };
                bent.store(&mut self.bent[i][c]);
            }
            for c in 0..3 {
                sum.0[c] += beside.0[c];
            }
            if i + 1 < n {
                let d = &self.data[i];
                let edge = V3::<L>::load(&d.edge) + get(&self.u[i + 1]) - get(&self.u[i]);
                let change = get(&self.direction[i + 1]) - get(p);
                let tiny = L::splat(f64::MIN_POSITIVE);
                let length = edge.dot(edge).max(tiny).sqrt();
                let s = V3([
                    edge.0[0] + alpha * change.0[0],
                    edge.0[1] + alpha * change.0[1],
                    edge.0[2] + alpha * change.0[2],
                ]);
                let straight = s.dot(s).max(tiny).sqrt();
                let wanted = (length + alpha * edge.dot(change) / length).max(L::splat(0.25) * length);
                let share = bends * (wanted - straight) / straight;
                for c in 0..3 {
                    beside.0[c] += s.0[c] * share;
                }
            }
        }
        let back = floats * L::splat(1.0 / n as f64);
        for bent in self.bent.iter_mut() {
            for c in 0..3 {
                (L::load(&bent[c]) - back * sum.0[c]).store(&mut bent[c]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use numerics::lanes::dispatch;

    const N: usize = 9;

    /// A straight rod of edges of length 1 along x, and a direction that turns it about its first vertex, or about its middle.
    fn bend(anchor: Anchor, alpha: f64) -> Vec<[F4; 4]> {
        let data = vec![
            VertexData {
                edge: [F4::splat(1.0), F4::ZERO, F4::ZERO],
                length: F4::splat(1.0),
                ..VertexData::default()
            };
            N
        ];
        let u = vec![[F4::ZERO; 4]; N];
        let from = if anchor == Anchor::Nowhere { 0.5 * (N - 1) as f64 } else { 0.0 };
        let direction: Vec<[F4; 4]> =
            (0..N).map(|i| [F4::ZERO, F4::splat(i as f64 - from), F4::ZERO, F4::splat(0.1)]).collect();
        let mut bent = vec![[F4::ZERO; 4]; N];
        dispatch(Bend {
            data: &data,
            u: &u,
            direction: &direction,
            alpha: F4::splat(alpha),
            turn: F4::splat(1.0),
            anchor: [anchor; 4],
            bent: &mut bent,
        });
        bent
    }

    fn edge(bent: &[[F4; 4]], i: usize) -> [f64; 2] {
        [1.0 + bent[i + 1][0][2] - bent[i][0][2], bent[i + 1][1][2] - bent[i][1][2]]
    }

    #[test]
    fn a_turn_stretches_nothing_and_is_the_straight_step_in_first_order() {
        for anchor in [Anchor::First, Anchor::Nowhere] {
            let bent = bend(anchor, 0.3);
            for i in 0..N - 1 {
                let e = edge(&bent, i);
                approx::assert_relative_eq!(e[0].hypot(e[1]), 1.0, max_relative = 1e-15);
                approx::assert_relative_eq!(e[1] / e[0], 0.3, max_relative = 1e-14);
            }
            // half the step leaves a quarter of the difference from the straight one
            let beside = |alpha: f64| bend(anchor, alpha)[N - 1][0][0];
            let ratio = beside(2e-3) / beside(1e-3);
            assert!((ratio - 4.0).abs() < 1e-4, "{ratio}");
        }
        assert_eq!(bend(Anchor::First, 0.3)[0], [F4::ZERO, F4::ZERO, F4::ZERO, F4::splat(0.3 * 0.1)]);
    }

    #[test]
    fn the_middle_of_a_free_strand_stays_where_the_straight_step_puts_it() {
        let bent = bend(Anchor::Nowhere, 0.3);
        for c in 0..3 {
            let mean: f64 = bent.iter().map(|b| b[c][1]).sum::<f64>() / N as f64;
            assert!(mean.abs() < 1e-15, "{mean}");
        }
    }

    #[test]
    fn a_strand_held_elsewhere_steps_straight() {
        for (i, b) in bend(Anchor::Elsewhere, 0.3).iter().enumerate() {
            assert_eq!([b[0][3], b[1][3], b[2][3]], [0.0, 0.3 * i as f64, 0.0]);
        }
        let held = |dofs: &[usize]| -> Vec<FixedDof> {
            dofs.iter().map(|&dof| FixedDof { lane: 1, dof, target: 0.0, reaction: 0.0, pending: 0.0 }).collect()
        };
        assert_eq!(Anchor::of(&held(&[]), 1), Anchor::Nowhere);
        assert_eq!(Anchor::of(&held(&[3]), 1), Anchor::Nowhere);
        assert_eq!(Anchor::of(&held(&[0, 1, 2, 3, 4, 5, 6]), 1), Anchor::First);
        assert_eq!(Anchor::of(&held(&[0, 1, 2, 32, 33, 34]), 1), Anchor::Elsewhere);
        assert_eq!(Anchor::of(&held(&[0, 1]), 1), Anchor::Elsewhere);
        assert_eq!(Anchor::of(&held(&[32, 33, 34]), 1), Anchor::Elsewhere);
        assert_eq!(Anchor::of(&held(&[32, 33, 34]), 0), Anchor::Nowhere);
    }
}

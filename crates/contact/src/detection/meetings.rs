//! Candidates looked at closely, and what of that stays true while the ends of the step change.

use super::candidates::{Looked, Scene};
use super::detect::Contact;
use super::pair::{Capsule, Meeting, PairContact, meeting, speed};
use super::strands::Strands;
use crate::assembly::ContactKey;
use rayon::prelude::*;

/// What the candidates gave when they were last looked at, by ascending pairs.
#[derive(Clone, Debug, Default)]
pub(super) struct Meetings {
    met: Vec<([u32; 2], Contact)>,
    /// Gaps at the start of the step [m].
    apart: Vec<([u32; 2], f64)>,
}

/// What a pair of edges gave when it was looked at.
#[derive(Clone, Copy, Debug)]
enum Outcome {
    Met(Contact),
    Apart(f64),
    /// Near at the start, but along one strand, or without a normal.
    Neither,
}

/// Overlap, in parts of the sum of the radii, from which on the normal of edges that cross may hang on where they go.
const CROSSED: f64 = 0.9;

/// Pairs that one task looks at.
const CHUNK: usize = 1024;

impl Meetings {
    /// Those that are in contact.
    pub fn contacts(&self) -> impl Iterator<Item = Contact> + '_ {
        self.met.iter().map(|met| met.1)
    }

    /// Looks at candidates; at those that were looked at in the same step before as far as their ends have moved.
    pub fn look(&mut self, scene: Scene<'_>, looked: Looked<'_>) {
        let known = looked.moved.is_some().then_some((&self.met, &self.apart));
        let seen: Vec<Chunk> = looked
            .pairs
            .par_chunks(CHUNK)
            .map(|pairs| {
                let mut known = known.map(|(met, apart)| (Following::new(met, pairs), Following::new(apart, pairs)));
                let mut chunk = Chunk::default();
                for pair in pairs {
                    let known = known.as_mut().and_then(|(met, apart)| {
                        met.find(*pair).map(Outcome::Met).or_else(|| apart.find(*pair).map(Outcome::Apart))
                    });
                    let [i, j] = pair.map(|i| i as usize);
                    let stays = looked.moved.is_some_and(|moved| !moved[i] && !moved[j]);
                    let outcome = match known {
                        Some(outcome) if stays => outcome,
                        known => strand_pair(scene, scene.edges[i], scene.edges[j], known),
                    };
                    match outcome {
                        Outcome::Met(contact) => chunk.met.push((*pair, contact)),
                        Outcome::Apart(gap) => chunk.apart.push((*pair, gap)),
                        Outcome::Neither => {}
                    }
                }
                chunk
            })
            .collect();
        self.met.clear();
        self.apart.clear();
        for chunk in seen {
            self.met.extend(chunk.met);
            self.apart.extend(chunk.apart);
        }
    }
}

/// An edge over the step, its radius and its first vertex.
pub(super) fn capsule(strands: &Strands<'_>, (strand, edge): (u32, u32)) -> (Capsule, f64, usize) {
    let v = (strands.first_vertex[strand as usize] + edge) as usize;
    ([[strands.start[v], strands.start[v + 1]], [strands.end[v], strands.end[v + 1]]], strands.radius[v], v)
}

/// What some candidates gave.
#[derive(Default)]
struct Chunk {
    met: Vec<([u32; 2], Contact)>,
    apart: Vec<([u32; 2], f64)>,
}

/// Goes through a list by ascending pairs along with the pairs that are asked for.
struct Following<'a, T> {
    rest: std::slice::Iter<'a, ([u32; 2], T)>,
}

impl<'a, T: Copy> Following<'a, T> {
    /// From where the first of the pairs may be.
    fn new(list: &'a [([u32; 2], T)], pairs: &[[u32; 2]]) -> Self {
        Following { rest: list[list.partition_point(|x| x.0 < pairs[0])..].iter() }
    }

    fn find(&mut self, pair: [u32; 2]) -> Option<T> {
        while let Some((at, value)) = self.rest.as_slice().first() {
            if *at > pair {
                return None;
            }
            self.rest.next();
            if *at == pair {
                return Some(*value);
            }
        }
        None
    }
}

/// Looks at a pair of edges. What it gave with other ends of the step is known where that does not depend on them: a contact
/// of edges near at the start, and how far others are apart there.
fn strand_pair(scene: Scene<'_>, i: (u32, u32), j: (u32, u32), known: Option<Outcome>) -> Outcome {
    let Scene { strands, settings, .. } = scene;
    let (a, ra, va) = capsule(strands, i);
    let (b, rb, vb) = capsule(strands, j);
    match known {
        Some(Outcome::Met(contact)) if contact.time == 0.0 && contact.gap > -CROSSED * (ra + rb) => {
            return Outcome::Met(contact);
        }
        Some(Outcome::Apart(gap)) if gap > speed(&a, &b) => return Outcome::Apart(gap),
        _ => {}
    }
    let (c, otherwise) = match meeting(&a, &b, ra + rb, |gap| scene.is_near(i, j, gap), settings.continuous) {
        Meeting::Near(Some(c)) => (c, Outcome::Neither),
        Meeting::Near(None) => return Outcome::Neither,
        Meeting::OnTheWay(c, gap) => (c, Outcome::Apart(gap)),
        Meeting::Apart(gap) => return Outcome::Apart(gap),
    };
    if i.0 == j.0 && self_excluded(scene, va, vb, &c) {
        return otherwise;
    }
    Outcome::Met(Contact {
        key: ContactKey { a: i, b: j },
        alpha: c.alpha,
        beta: c.beta,
        normal: c.normal,
        gap: c.gap,
        solid_velocity: [0.0; 3],
        time: c.time,
        twin: false,
    })
}

/// Whether two places on one strand, on the edges that begin at these vertices, are too near along it to touch.
fn self_excluded(scene: Scene<'_>, va: usize, vb: usize, c: &PairContact) -> bool {
    let Scene { strands, settings, .. } = scene;
    let (lo, hi, s_lo, s_hi) = if va < vb { (va, vb, c.alpha, c.beta) } else { (vb, va, c.beta, c.alpha) };
    let length = |v: usize| {
        let d = crate::block::sub(&strands.start[v + 1], &strands.start[v]);
        crate::block::norm_squared(&d).sqrt()
    };
    let radii = strands.radius[va] + strands.radius[vb];
    let limit = settings.self_exclusion * (radii + (scene.seen(va) + scene.seen(vb)));
    let mut arc = (1.0 - s_lo) * length(lo) + s_hi * length(hi);
    for v in lo + 1..hi {
        if arc > limit {
            break;
        }
        arc += length(v);
    }
    arc <= limit
}

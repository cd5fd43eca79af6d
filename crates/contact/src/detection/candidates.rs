//! Pairs of edges that may meet within a step.
//!
//! A step looks several times: impulses move the ends of the step, its starts stay. Two edges can meet only if their distance
//! at the start is at most their reach and the largest displacement of the one against the other, and of these only the
//! last changes. The list is made for ends that lie up to an allowance elsewhere; edges whose ends have moved farther are looked
//! up anew.

use super::strands::{DetectionError, DetectionSettings, Sight, Strands};
use crate::block::{Vec3, norm_squared, sub};
use geometry::Vector3;
use geometry::broad_phase::{Nearness, SegmentGrid, SegmentMotion, Segments};

/// How far an end may move before the list is made anew, in radii.
const ALLOWANCE: f64 = 0.25;

/// An end that moved farther is allowed so many times as much from then on.
const ALLOWANCE_GROWTH: f64 = 2.0;

/// Edges whose ends moved farther, as a part of all, for which the list is mended and not made anew.
const FEW: usize = 16;

/// Candidates with what they were found for.
#[derive(Clone, Debug, Default)]
pub(super) struct Candidates {
    grid: SegmentGrid,
    start: Vec<[Vector3; 2]>,
    end: Vec<[Vector3; 2]>,
    /// How far edges see each other at the start, and where they touch on the way [m].
    look: Vec<f64>,
    touch: Vec<f64>,
    pairs: Vec<[u32; 2]>,
    known: Option<Known>,
    /// How far the vertices' ends may lie from those of the list [m].
    allowance: Vec<f64>,
    /// Ends when pairs were last asked for, and which edges have one elsewhere since.
    last_end: Vec<Vec3>,
    moved: Vec<bool>,
}

/// What a list was made for.
#[derive(Clone, Debug, Default)]
struct Known {
    start: Vec<Vec3>,
    end: Vec<Vec3>,
    first_vertex: Vec<u32>,
    radius: Vec<f64>,
    reach: Vec<f64>,
    proximity: f64,
    continuous: bool,
}

impl Known {
    /// Takes over a scene, in the memory of the one before.
    fn take_over(&mut self, Scene { strands, sight, settings, .. }: Scene<'_>) {
        strands.start.clone_into(&mut self.start);
        strands.end.clone_into(&mut self.end);
        strands.first_vertex.clone_into(&mut self.first_vertex);
        strands.radius.clone_into(&mut self.radius);
        sight.map_or(&[][..], |sight| sight.reach).clone_into(&mut self.reach);
        (self.proximity, self.continuous) = (settings.proximity, settings.continuous);
    }

    /// Whether only the ends have changed since.
    fn is_same_step(&self, Scene { strands, sight, settings, .. }: Scene<'_>) -> bool {
        self.proximity == settings.proximity
            && self.continuous == settings.continuous
            && self.first_vertex == strands.first_vertex
            && self.radius == strands.radius
            && self.reach == sight.map_or(&[][..], |sight| sight.reach)
            && self.start == strands.start
    }
}

/// Candidates of one look.
pub(super) struct Looked<'a> {
    /// Pairs of places in the list of edges, ascending.
    pub pairs: &'a [[u32; 2]],
    /// Which edges have moved since the look before; `None` where that was another step.
    pub moved: Option<&'a [bool]>,
}

/// What is looked at.
#[derive(Clone, Copy)]
pub(super) struct Scene<'a> {
    pub strands: &'a Strands<'a>,
    pub sight: Option<&'a Sight<'a>>,
    /// Strand and edge of each place.
    pub edges: &'a [(u32, u32)],
    pub settings: &'a DetectionSettings,
}

impl Scene<'_> {
    /// First vertex of an edge.
    pub fn vertex(&self, (strand, edge): (u32, u32)) -> usize {
        (self.strands.first_vertex[strand as usize] + edge) as usize
    }

    /// How far beyond touching the edge that begins at a vertex sees others [m].
    pub fn seen(&self, v: usize) -> f64 {
        self.sight.map_or(0.0, |sight| sight.reach[v])
    }

    /// Whether two edges with this gap at the start are in contact, whether they touch or not.
    pub fn is_near(&self, a: (u32, u32), b: (u32, u32), gap: f64) -> bool {
        let (v, w) = (self.vertex(a), self.vertex(b));
        gap <= self.settings.proximity * self.strands.radius[v].min(self.strands.radius[w])
            || self.sight.is_some_and(|sight| gap <= sight.reach[v] + sight.reach[w] && (sight.matters)(a, b, gap))
    }

    /// Whether two near edges are candidates.
    fn keeps(&self, i: u32, j: u32, near: Nearness) -> bool {
        let (a, b) = (self.edges[i as usize], self.edges[j as usize]);
        // one strand: adjacent edges share a vertex and always overlap
        if a.0 == b.0 && a.1.abs_diff(b.1) <= 1 {
            return false;
        }
        let radii = self.strands.radius[self.vertex(a)] + self.strands.radius[self.vertex(b)];
        near.may_meet || self.is_near(a, b, near.distance - radii)
    }

    /// Radius of the edge that begins at a vertex, with what counts as near [m].
    fn reach(&self, v: usize) -> f64 {
        self.strands.radius[v] * (1.0 + self.settings.proximity)
    }
}

impl Candidates {
    /// Pairs among which are all that can be in contact; neighbours on a strand are left out.
    pub(super) fn near(&mut self, scene: Scene<'_>) -> Result<Looked<'_>, DetectionError> {
        let Scene { strands, edges, settings, .. } = scene;
        let same = self.known.as_ref().is_some_and(|known| known.is_same_step(scene));
        if same && settings.continuous {
            self.mend(scene)?;
        } else if !same {
            self.allowance.clear();
            self.allowance.extend(strands.radius.iter().map(|radius| ALLOWANCE * radius));
            self.find(scene)?;
        }
        self.moved.clear();
        if same {
            let moves = |v: usize| settings.continuous && strands.end[v] != self.last_end[v];
            self.moved.extend(edges.iter().map(|edge| scene.vertex(*edge)).map(|v| moves(v) || moves(v + 1)));
        }
        strands.end.clone_into(&mut self.last_end);
        Ok(Looked { pairs: &self.pairs, moved: same.then_some(&self.moved[..]) })
    }

    /// The next look is that of a new step.
    pub(super) fn forget(&mut self) {
        self.known = None;
    }

    /// Looks up those edges anew that have an end beyond its allowance, and allows them more.
    fn mend(&mut self, scene: Scene<'_>) -> Result<(), DetectionError> {
        let strands = scene.strands;
        let Some(known) = &mut self.known else { return self.find(scene) };
        let mut strayed = vec![false; strands.end.len()];
        for (v, strayed) in strayed.iter_mut().enumerate() {
            let moved = norm_squared(&sub(&strands.end[v], &known.end[v])).sqrt();
            if moved > self.allowance[v] {
                *strayed = true;
                self.allowance[v] = ALLOWANCE_GROWTH * moved;
                known.end[v] = strands.end[v];
            }
        }
        let has_strayed = |edge: &(u32, u32)| {
            let v = scene.vertex(*edge);
            strayed[v] || strayed[v + 1]
        };
        let changed: Vec<u32> =
            (0u32..).zip(scene.edges).filter(|(_, edge)| has_strayed(edge)).map(|(i, _)| i).collect();
        if changed.is_empty() {
            return Ok(());
        }
        if changed.len() * FEW > scene.edges.len() {
            return self.find(scene);
        }
        for i in &changed {
            let v = scene.vertex(scene.edges[*i as usize]);
            self.end[*i as usize] = ends(&known.end, v);
            self.touch[*i as usize] = scene.reach(v) + self.allowance[v].max(self.allowance[v + 1]);
        }
        let motion = Some(SegmentMotion { ends: &self.end, reach: &self.touch });
        let segments = Segments { ends: &self.start, reach: &self.look, motion };
        let done = self.grid.update(&changed, segments, |i, j, near| scene.keeps(i, j, near), &mut self.pairs);
        done.map_err(|_| DetectionError::Shape("too many edges"))
    }

    fn find(&mut self, scene: Scene<'_>) -> Result<(), DetectionError> {
        let strands = scene.strands;
        self.start.clear();
        self.end.clear();
        self.look.clear();
        self.touch.clear();
        for v in scene.edges.iter().map(|edge| scene.vertex(*edge)) {
            self.start.push(ends(strands.start, v));
            self.look.push(scene.reach(v) + scene.seen(v));
            if scene.settings.continuous {
                self.end.push(ends(strands.end, v));
                self.touch.push(scene.reach(v) + self.allowance[v].max(self.allowance[v + 1]));
            }
        }
        let motion = scene.settings.continuous.then_some(SegmentMotion { ends: &self.end, reach: &self.touch });
        let segments = Segments { ends: &self.start, reach: &self.look, motion };
        let mut known = self.known.take().unwrap_or_default();
        self.grid
            .near_pairs(segments, |i, j, near| scene.keeps(i, j, near), &mut self.pairs)
            .map_err(|_| DetectionError::Shape("too many edges"))?;
        known.take_over(scene);
        self.known = Some(known);
        Ok(())
    }
}

fn ends(x: &[Vec3], v: usize) -> [Vector3; 2] {
    [Vector3::from(x[v]), Vector3::from(x[v + 1])]
}

#[cfg(test)]
mod tests {
    use crate::detection::{DetectionSettings, Detector, Sight, Strands};
    use proptest::prelude::*;

    proptest! {
        /// A detector that has looked at the step before gives the same answer as a new one, whether ends move little or much,
        /// all or a few.
        #[test]
        fn looking_again_finds_the_same(x in proptest::collection::vec(proptest::array::uniform3(-1.0..1.0f64), 24..60),
                                        shifts in proptest::collection::vec(-3.0..0.0f64, 4), far_sighted in any::<bool>()) {
            let n = x.len() / 4 * 4;
            let start = &x[..n];
            let first: Vec<u32> = (0..=n as u32 / 4).map(|s| 4 * s).collect();
            let (radius, reach) = (vec![0.05; n], vec![0.1; n]);
            let matters = |a: (u32, u32), b: (u32, u32), gap: f64| gap < 0.1 || (a.0 + b.0).is_multiple_of(2);
            let sight = far_sighted.then_some(Sight { reach: &reach, matters: &matters });
            let settings = DetectionSettings::default();
            let (mut seasoned, mut found, mut fresh) = (Detector::default(), Vec::new(), Vec::new());
            let mut end = start.to_vec();
            for (round, shift) in shifts.iter().enumerate() {
                let size = 10f64.powf(*shift);
                for (i, (e, p)) in end.iter_mut().zip(start).enumerate().filter(|(i, _)| round == 0 || i.is_multiple_of(round + 1)) {
                    let phase = i as f64 + 10.0 * round as f64;
                    *e = [p[0] + 0.3 + size * (1.7 * phase).sin(), p[1] + size * (2.3 * phase).cos(), p[2] + size * (0.7 * phase).sin()];
                }
                let strands = Strands { start, end: &end, first_vertex: &first, radius: &radius };
                let again = seasoned.detect(&strands, sight.as_ref(), &[], &settings, &mut found).unwrap();
                let anew = Detector::default().detect(&strands, sight.as_ref(), &[], &settings, &mut fresh).unwrap();
                prop_assert_eq!(&found, &fresh);
                prop_assert_eq!(again.worst_penetration, anew.worst_penetration);
            }
        }
    }
}

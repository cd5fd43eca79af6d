//! Broad phase, narrow phase and pruning for a whole scene.

use super::candidates::{Candidates, Looked, Scene};
use super::meetings::{Meetings, capsule};
use super::solids::SolidField;
use super::strands::{DetectionError, DetectionSettings, Sight, Strands};
use super::surface::surface_contacts;
use crate::assembly::{ContactKey, ContactSide, PosedContact, SOLID};
use crate::block::{Vec3, dot};
use geometry::Aabb;
use rayon::prelude::*;

/// A contact found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// What touches what; a solid has strand [`SOLID`].
    pub key: ContactKey,
    /// Place on edge A, 0 … 1.
    pub alpha: f64,
    /// Place on edge B; 0 for a solid.
    pub beta: f64,
    /// Unit normal from B to A.
    pub normal: Vec3,
    /// Gap along the normal at the start of the step [m].
    pub gap: f64,
    /// Velocity of the solid at the contact [m/s]; zero between strands.
    pub solid_velocity: Vec3,
    /// When in the step they meet, 0 … 1.
    pub time: f64,
    /// A nearer contact of the same strands lies at the same place, on this edge or its neighbour: unless the motion is large,
    /// what keeps that apart keeps this apart.
    pub twin: bool,
}

impl Contact {
    /// Whether side B is a solid.
    #[must_use]
    pub fn with_solid(&self) -> bool {
        self.key.b.0 == SOLID
    }

    /// The contact as assembly takes it; `stride` freedoms per vertex.
    #[must_use]
    pub fn posed(&self, friction: f64, cohesion: f64, stride: u32) -> PosedContact {
        PosedContact {
            a: ContactSide::on_edge(self.key.a.0, self.key.a.1, self.alpha, stride),
            b: (!self.with_solid()).then(|| ContactSide::on_edge(self.key.b.0, self.key.b.1, self.beta, stride)),
            normal: self.normal,
            external_velocity: self.solid_velocity,
            gap: self.gap,
            friction,
            cohesion,
        }
    }
}

/// What detection found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DetectionReport {
    /// Pairs of edges looked at closely.
    pub candidates: usize,
    /// Contacts before pruning.
    pub found: usize,
    /// Contacts kept.
    pub kept: usize,
    /// Deepest overlap [m], 0 if none.
    pub worst_penetration: f64,
}

/// Detection with its reusable memory.
#[derive(Clone, Debug, Default)]
pub struct Detector {
    candidates: Candidates,
    /// Strand and edge of each place.
    edges: Vec<(u32, u32)>,
    meetings: Meetings,
}

/// Edges that one task holds against solids.
const EDGES: usize = 512;

impl Detector {
    /// The next look is that of a new step, even if it looks like the last.
    pub fn forget(&mut self) {
        self.candidates.forget();
    }

    /// Finds the contacts of one step, ordered by key and place; `sight` adds pairs that do not touch.
    ///
    /// Called again for the same step with other ends it looks at the pairs that were near the first time, as long as no end
    /// is far from where it was, and of these at the ones that moved; the answer is the same as that of a new detector.
    ///
    /// # Errors
    /// If the strand arrays do not fit together or a number is not finite.
    pub fn detect(
        &mut self,
        strands: &Strands<'_>,
        sight: Option<&Sight<'_>>,
        solids: &[&dyn SolidField],
        settings: &DetectionSettings,
        contacts: &mut Vec<Contact>,
    ) -> Result<DetectionReport, DetectionError> {
        strands.check()?;
        if sight.is_some_and(|sight| sight.reach.len() != strands.start.len()) {
            return Err(DetectionError::Shape("reach and start differ in length"));
        }
        contacts.clear();
        self.edges.clear();
        for s in 0..strands.count() {
            let (first, next) = (strands.first_vertex[s], strands.first_vertex[s + 1]);
            self.edges.extend((0..(next - first).saturating_sub(1)).map(|edge| (s as u32, edge)));
        }
        let edges = &self.edges;
        let scene = Scene { strands, sight, edges, settings };
        let looked = if settings.strand_strand && !edges.is_empty() {
            self.candidates.near(scene)?
        } else {
            self.candidates.forget();
            Looked { pairs: &[], moved: None }
        };
        let candidates = looked.pairs.len();
        self.meetings.look(scene, looked);
        let on_solids: Vec<Vec<Contact>> = if solids.is_empty() {
            Vec::new()
        } else {
            (0..edges.len().div_ceil(EDGES))
                .into_par_iter()
                .map(|chunk| {
                    let mut out = Vec::new();
                    for e in &edges[chunk * EDGES..((chunk + 1) * EDGES).min(edges.len())] {
                        strand_solids(scene, *e, solids, &mut out);
                    }
                    out
                })
                .collect()
        };
        contacts.extend(self.meetings.contacts());
        contacts.extend(on_solids.into_iter().flatten());
        let before = contacts.len();
        prune(contacts, &self.edges, strands, settings.max_per_edge);
        mark_twins(contacts);
        let worst_penetration = contacts.iter().map(|c| -c.gap).fold(0.0, f64::max);
        Ok(DetectionReport { candidates, found: before, kept: contacts.len(), worst_penetration })
    }
}

fn strand_solids(scene: Scene<'_>, e: (u32, u32), solids: &[&dyn SolidField], out: &mut Vec<Contact>) {
    let Scene { strands, settings, .. } = scene;
    let (a, radius, v) = capsule(strands, e);
    let near = settings.proximity * radius + scene.seen(v);
    let ends = if settings.continuous { &a[..] } else { &a[..1] };
    let mut bounds = Aabb::EMPTY;
    ends.iter().flatten().for_each(|x| bounds.include(&(*x).into()));
    let bounds = bounds.inflated(radius + near);
    let last = v + 2 == strands.first_vertex[e.0 as usize + 1] as usize;
    for (index, solid) in solids.iter().enumerate() {
        if solid.bounds().is_some_and(|(lo, hi)| (0..3).any(|c| bounds.min[c] > hi[c] || bounds.max[c] < lo[c])) {
            continue;
        }
        surface_contacts(&a, radius, *solid, near, settings.continuous, last, |c| {
            out.push(Contact {
                key: ContactKey { a: e, b: (SOLID, index as u32) },
                alpha: c.alpha,
                beta: 0.0,
                normal: c.normal,
                gap: c.gap,
                solid_velocity: c.velocity,
                time: c.time,
                twin: false,
            });
        });
    }
}

/// Part of an edge within which two contacts of the same two strands are at the same place.
const SAME_PLACE: f64 = 0.2;

/// Marks contacts that lie where a nearer one of the same two strands does. A vertex near another strand gives one on
/// each of its edges, and strands side by side give one where each edge begins and the other ends.
fn mark_twins(contacts: &mut [Contact]) {
    let place = |(edge, at): (u32, f64)| f64::from(edge) + at;
    let places = |c: &Contact| (place((c.key.a.1, c.alpha)), place((c.key.b.1, c.beta)));
    let same = |c: &Contact, d: &Contact| {
        let ((x, y), (u, v)) = (places(c), places(d));
        (x - u).abs() < SAME_PLACE && (y - v).abs() < SAME_PLACE && dot(&c.normal, &d.normal) > 0.0
    };
    // contacts of the same strands, the nearest first; what will meet only later in the step is not the nearer for its gap
    let mut order: Vec<(u32, u32, f64, u32)> = (0u32..)
        .zip(&*contacts)
        .filter(|(_, c)| !c.with_solid() && c.time == 0.0)
        .map(|(i, c)| (c.key.a.0, c.key.b.0, c.gap, i))
        .collect();
    order.sort_unstable_by(|x, y| (x.0, x.1).cmp(&(y.0, y.1)).then(x.2.total_cmp(&y.2)).then(x.3.cmp(&y.3)));
    let mut kept: Vec<u32> = Vec::new();
    for strands in order.chunk_by(|x, y| (x.0, x.1) == (y.0, y.1)) {
        kept.clear();
        for (.., i) in strands {
            let c = contacts[*i as usize];
            if kept.iter().any(|k| same(&c, &contacts[*k as usize])) {
                contacts[*i as usize].twin = true;
            } else {
                kept.push(*i);
            }
        }
    }
}

/// Keeps at most `limit` contacts with strands per edge, then orders what is left by key and place.
///
/// Of each other strand the nearest contact comes first, then the second of each, and so on, nearest first (ties by key):
/// where edges of parallel strands lie side by side, a neighbour would else crowd out the others by its two ends. Contacts
/// with solids are few (three per edge and solid) and all stay.
fn prune(contacts: &mut Vec<Contact>, edges: &[(u32, u32)], strands: &Strands<'_>, limit: usize) {
    let order =
        |x: &Contact, y: &Contact| x.key.cmp(&y.key).then(x.alpha.total_cmp(&y.alpha)).then(x.beta.total_cmp(&y.beta));
    let slot = |e: (u32, u32)| (strands.first_vertex[e.0 as usize] + e.1) as usize;
    let mut count = vec![0usize; strands.start.len().max(edges.len())];
    for c in contacts.iter().filter(|c| !c.with_solid()) {
        count[slot(c.key.a)] += 1;
        count[slot(c.key.b)] += 1;
    }
    // pairs come out ordered already; only crowded edges need the ranking
    if count.iter().any(|n| *n > limit) {
        contacts.sort_unstable_by(|x, y| x.gap.total_cmp(&y.gap).then(order(x, y)));
        // place of each contact among those of its edge with the same other strand, the larger of both views
        let mut views: Vec<(usize, u32, u32)> = Vec::with_capacity(2 * contacts.len());
        for (i, c) in contacts.iter().enumerate().filter(|(_, c)| !c.with_solid()) {
            views.push((slot(c.key.a), c.key.b.0, i as u32));
            views.push((slot(c.key.b), c.key.a.0, i as u32));
        }
        views.sort_unstable();
        let mut rank = vec![0u32; contacts.len()];
        let mut place = 0;
        for (n, view) in views.iter().enumerate() {
            let same = n > 0 && (views[n - 1].0, views[n - 1].1) == (view.0, view.1);
            place = if same { place + 1 } else { 0 };
            rank[view.2 as usize] = rank[view.2 as usize].max(place);
        }
        let mut by_rank: Vec<u32> = (0..contacts.len() as u32).collect();
        // stable: within a rank they stay nearest first
        by_rank.sort_by_key(|i| rank[*i as usize]);
        count.fill(0);
        let mut kept = Vec::with_capacity(contacts.len());
        for i in by_rank {
            let c = contacts[i as usize];
            if !c.with_solid() {
                let (a, b) = (slot(c.key.a), slot(c.key.b));
                if count[a] >= limit || count[b] >= limit {
                    continue;
                }
                count[a] += 1;
                count[b] += 1;
            }
            kept.push(c);
        }
        *contacts = kept;
    }
    contacts.sort_unstable_by(order);
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::{Motion, MovingSolid, ShapeDescription, Surface};

    fn still<'a>(x: &'a [Vec3], first: &'a [u32], radius: &'a [f64]) -> Strands<'a> {
        Strands { start: x, end: x, first_vertex: first, radius }
    }

    #[test]
    fn crossed_strands_and_capsule_ends() {
        let x =
            [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.15], [0.0, 1.0, 0.15], [1.15, 0.0, 0.0], [3.0, 0.0, 0.0]];
        let mut out = Vec::new();
        let s = still(&x, &[0, 2, 4, 6], &[0.1; 6]);
        let report = Detector::default().detect(&s, None, &[], &DetectionSettings::default(), &mut out).unwrap();
        assert_eq!(out.len(), 2);
        assert_eq!((out[0].key.a, out[0].key.b), ((0, 0), (1, 0)));
        assert!((out[0].alpha - 0.5).abs() < 1e-12 && (out[0].gap + 0.05).abs() < 1e-12 && out[0].normal[2] == -1.0);
        // end to end
        assert_eq!((out[1].key.a, out[1].key.b, out[1].alpha, out[1].beta), ((0, 0), (2, 0), 1.0, 0.0));
        assert!((report.worst_penetration - 0.05).abs() < 1e-12);
    }

    /// Neighbours along one strand never touch; a strand folded back on itself does.
    #[test]
    fn neighbours_are_excluded_by_arc_length() {
        let r = 0.1;
        let straight: Vec<Vec3> = (0..20).map(|i| [0.05 * i as f64, 0.0, 0.0]).collect();
        let mut out = Vec::new();
        let first = [0, 20];
        Detector::default()
            .detect(&still(&straight, &first, &[r; 20]), None, &[], &DetectionSettings::default(), &mut out)
            .unwrap();
        let limit = std::f64::consts::FRAC_PI_2 * 2.0 * r;
        assert!(out.is_empty() || out.iter().all(|c| 0.05 * f64::from(c.key.a.1.abs_diff(c.key.b.1)) > limit - 0.1));
        let fold = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [2.0, 0.0, 0.0],
            [2.2, 0.1, 0.0],
            [2.0, 0.19, 0.0],
            [1.0, 0.19, 0.0],
            [0.0, 0.19, 0.0],
        ];
        Detector::default()
            .detect(&still(&fold, &[0, 7], &[r; 7]), None, &[], &DetectionSettings::default(), &mut out)
            .unwrap();
        assert!(out.iter().any(|c| c.key.a == (0, 0) && c.key.b == (0, 5)));
    }

    /// A vertex above another strand has a contact on both its edges; one of them is a twin. Elsewhere the strands touch again.
    #[test]
    fn a_vertex_has_a_twin() {
        let x = [
            [-1.0, 0.0, 0.3],
            [0.0, 0.0, 0.19],
            [1.0, 0.0, 0.3],
            [2.0, 0.0, 0.19],
            [3.0, 0.0, 0.3],
            [0.0, -1.0, 0.0],
            [0.0, 1.0, 0.0],
            [2.0, 1.0, 0.0],
            [2.0, -1.0, 0.0],
        ];
        let (s, mut out) = (still(&x, &[0, 5, 9], &[0.1; 9]), Vec::new());
        let settings = DetectionSettings::default();
        Detector::default().detect(&s, None, &[], &settings, &mut out).unwrap();
        assert!(out.iter().all(|c| (c.gap + 0.01).abs() < 1e-12), "{out:?}");
        assert_eq!((out.len(), out.iter().filter(|c| c.twin).count()), (4, 2));
    }

    /// At most six contacts per edge, the nearest, whatever the order of the strands.
    #[test]
    fn pruning_keeps_the_nearest() {
        let mut x = vec![[-5.0, 0.0, 0.0], [5.0, 0.0, 0.0]];
        for i in 0..12 {
            let (s, z) = (-3.0 + 0.5 * f64::from(i), 0.19 - 0.005 * f64::from((7 * i) % 12));
            x.push([s, -1.0, z]);
            x.push([s, 1.0, z]);
        }
        let first: Vec<u32> = (0..=13).map(|i| 2 * i).collect();
        let radius = vec![0.1; x.len()];
        let mut out = Vec::new();
        let report = Detector::default()
            .detect(&still(&x, &first, &radius), None, &[], &DetectionSettings::default(), &mut out)
            .unwrap();
        assert_eq!((report.found, report.kept), (12, 6));
        assert!(out.iter().all(|c| c.gap <= -0.01 - 0.005 * 6.0 + 1e-12));
        assert!(out.windows(2).all(|w| w[0].key < w[1].key));
    }

    /// A strand dropped on a plane and through a thin plate at a hundred radii per step is caught by both.
    #[test]
    fn solids_are_met_also_when_fast() {
        let plate: ShapeDescription = ron::from_str("Box(center: (0.0, 0.0, 0.0), half_extents: (5.0, 5.0, 0.02))")
            .unwrap_or_else(|e| panic!("{e}"));
        let shape = plate.build(std::path::Path::new(".")).unwrap();
        let solid = MovingSolid::new(shape, Motion::default(), Surface::default()).unwrap();
        let (r, dt) = (0.01, 1e-3);
        let start = [[-1.0, 0.0, 0.5], [0.0, 0.0, 0.5], [1.0, 0.0, 0.5]];
        let end = start.map(|p| [p[0], p[1], p[2] - 100.0 * r]);
        let step = StepSolidForTest::new(&solid, dt);
        let s = Strands { start: &start, end: &end, first_vertex: &[0, 3], radius: &[r; 3] };
        let mut out = Vec::new();
        Detector::default().detect(&s, None, &[&step.0], &DetectionSettings::default(), &mut out).unwrap();
        assert_eq!(out.len(), 3, "{out:?}");
        for c in &out {
            assert!((c.normal[2] - 1.0).abs() < 1e-9);
            // gap to the upper face
            assert!((c.gap - (0.5 - 0.02 - r)).abs() < 1e-9, "{c:?}");
        }
    }

    struct StepSolidForTest<'a>(super::super::StepSolid<'a>);
    impl<'a> StepSolidForTest<'a> {
        fn new(solid: &'a MovingSolid, dt: f64) -> Self {
            Self(super::super::StepSolid::new(solid, 0.0, dt))
        }
    }
}

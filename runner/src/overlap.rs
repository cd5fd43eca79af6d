//! Strands that overlap where a scene puts them.
//!
//! Contact pushes overlaps apart by a share a step. Where strands cross near their clamps, several such demands can contradict
//! one another: the strands stay wedged for as long as they are held, and steps are slow. Better told before the run.

use std::fmt;

use contact::detection::{Contact, DetectionSettings, Detector, Strands};

use crate::plan::Plan;
use crate::prepare::PrepareError;
use crate::scene::expand::{StrandGeometry, expand};
use crate::scene::quantity::Quantity;
use crate::scene::strands::{Arrangement, StrandShape};
use crate::scene::{Scene, Units};
use crate::world::contact::HELD;

/// Overlap in radii from which on it is told: less is round-off of a scene that lets strands touch, or gone after a few steps.
const TOLD: f64 = 0.02;

/// The strands of one group that overlap others.
#[derive(Clone, Debug, PartialEq)]
pub struct Overlap {
    /// Group in the scene.
    pub group: usize,
    /// How many of its strands overlap others.
    pub strands: usize,
    /// How many strands it has.
    pub of: usize,
    /// Deepest overlap \[m\].
    pub depth: f64,
    /// The same in radii of the thinner strand.
    pub radii: f64,
    /// Where: place in its group and edge of the one, group, place and edge of the other.
    pub deepest: [(usize, usize, usize); 2],
    advice: &'static str,
    units: Units,
}

impl fmt::Display for Overlap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [(_, first, edge), (group, second, other)] = self.deepest;
        write!(
            f,
            "strands[{}]: {} of {} strands overlap others at the start, by up to {} ({:.2} radii: strand {first} at edge {edge} and \
             strand {second}",
            self.group,
            self.strands,
            self.of,
            Quantity::Length.show(two_digits(self.depth), self.units),
            self.radii,
        )?;
        if group != self.group {
            write!(f, " of strands[{group}]")?;
        }
        write!(f, " at edge {other}); contact can only push them apart: {}", self.advice)
    }
}

/// Every group whose strands overlap others at the start, where contact between strands is on.
///
/// # Errors
/// When the scene needs something that is missing, or its strands cannot be made.
pub fn at_start(scene: &Scene) -> Result<Vec<Overlap>, PrepareError> {
    let plan = Plan::for_scene(scene)?;
    if !plan.components.strand_pairs {
        return Ok(Vec::new());
    }
    let strands = expand(scene)?;
    let mut sizes = vec![0; scene.strands.len()];
    strands.iter().for_each(|strand| sizes[strand.group] += 1);
    // the deepest overlap of each strand
    let mut worst: Vec<Option<(f64, f64, &Contact)>> = vec![None; strands.len()];
    let contacts = touching(scene, &strands);
    for contact in &contacts {
        let [(a, at_a), (b, at_b)] = [(contact.key.a, contact.alpha), (contact.key.b, contact.beta)];
        let (one, other) = (&strands[a.0 as usize], &strands[b.0 as usize]);
        let (thin_a, thin_b) = (thickness(one, a.1 as usize, at_a), thickness(other, b.1 as usize, at_b));
        let thick = edge_radius(one, a.1 as usize) + edge_radius(other, b.1 as usize);
        let depth = thin_a + thin_b - thick - contact.gap;
        let radii = depth / thin_a.min(thin_b);
        let free = free_share(one, a.1 as usize, at_a).max(free_share(other, b.1 as usize, at_b));
        if radii < TOLD || free < HELD {
            continue;
        }
        for strand in [a.0 as usize, b.0 as usize] {
            if worst[strand].is_none_or(|(deepest, ..)| radii > deepest) {
                worst[strand] = Some((radii, depth, contact));
            }
        }
    }
    let mut told = Vec::new();
    for (group, of) in sizes.into_iter().enumerate() {
        let mine = strands.iter().zip(&worst).filter(|(strand, _)| strand.group == group);
        let found: Vec<_> = mine.filter_map(|(_, worst)| *worst).collect();
        let Some((radii, depth, contact)) = found.iter().copied().max_by(|x, y| x.0.total_cmp(&y.0)) else { continue };
        let side = |(strand, edge): (u32, u32)| {
            let strand = &strands[strand as usize];
            (strand.group, strand.index, edge as usize)
        };
        let (a, b) = (side(contact.key.a), side(contact.key.b));
        told.push(Overlap {
            group,
            strands: found.len(),
            of,
            depth,
            radii,
            deepest: if a.0 == group { [a, b] } else { [b, a] },
            advice: advice(&scene.strands[group].shape),
            units: scene.unit_system(),
        });
    }
    Ok(told)
}

/// A length to two digits, as a reader wants it.
fn two_digits(length: f64) -> f64 {
    format!("{length:.1e}").parse().unwrap_or(length)
}

/// What to write instead.
fn advice(shape: &StrandShape) -> &'static str {
    match shape {
        StrandShape::Wisp(wisp) if wisp.arrangement == Arrangement::Random => {
            "write `arrangement: Even` in the wisp, or give it fewer or thinner strands or a wider `disc`"
        }
        StrandShape::Wisp(_) | StrandShape::Bundle(_) => "give it fewer or thinner strands, or a wider `disc`",
        _ => "put them farther apart, or make them thinner",
    }
}

/// What detection finds among the strands where they stand.
fn touching(scene: &Scene, strands: &[StrandGeometry]) -> Vec<Contact> {
    let mut first_vertex = vec![0];
    let (mut position, mut radius) = (Vec::new(), Vec::new());
    for strand in strands {
        position.extend(strand.positions.iter().map(|x| [x.x, x.y, x.z]));
        let edges = strand.positions.len() - 1;
        radius.extend((0..=edges).map(|edge| edge_radius(strand, edge.min(edges - 1))));
        first_vertex.push(position.len() as u32);
    }
    let still = Strands { start: &position, end: &position, first_vertex: &first_vertex, radius: &radius };
    let settings = DetectionSettings {
        proximity: 0.0,
        max_per_edge: scene.contact.detection.max_per_edge,
        self_exclusion: 0.5 * scene.contact.detection.self_distance,
        continuous: false,
        strand_strand: true,
    };
    let mut contacts = Vec::new();
    // what is not a number is told by the checks of the scene
    if Detector::default().detect(&still, None, &[], &settings, &mut contacts).is_err() {
        contacts.clear();
    }
    contacts
}

/// Radius that detection sees along an edge \[m\].
fn edge_radius(strand: &StrandGeometry, edge: usize) -> f64 {
    let largest = |v: usize| strand.radius[v].max(strand.second_radius[v]);
    largest(edge).max(largest(edge + 1))
}

/// Least radius at a place on an edge \[m\]: flat sections may lie on each other.
fn thickness(strand: &StrandGeometry, edge: usize, at: f64) -> f64 {
    let least = |v: usize| strand.radius[v].min(strand.second_radius[v]);
    (1.0 - at) * least(edge) + at * least(edge + 1)
}

/// Share of a place on an edge that free vertices carry.
fn free_share(strand: &StrandGeometry, edge: usize, at: f64) -> f64 {
    let held = |v: usize| strand.clamps.iter().any(|clamp| clamp.vertices.binary_search(&v).is_ok());
    let share = |v: usize, weight: f64| if held(v) { 0.0 } else { weight };
    share(edge, 1.0 - at) + share(edge + 1, at)
}

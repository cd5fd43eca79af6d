//! One picture of the sample as plain arrays: grains with their stress, contacts, force chains.

use crate::assembly::{Assembly, ContactView};
use crate::grains::Grains;
use crate::model::ContactKind;
use crate::preparation::links::{direct_links, particles};
use crate::tensor::Tensor2;
use serde::{Deserialize, Serialize};

/// Colours of the published pictures.
pub mod colour {
    /// Sticking contact.
    pub const STICK: [u8; 3] = [214, 39, 40];
    /// Slipping contact.
    pub const SLIP: [u8; 3] = [44, 160, 44];
    /// Permanent link.
    pub const LINK: [u8; 3] = [31, 119, 180];
    /// Strain curve.
    pub const STRAIN: [u8; 3] = [44, 160, 44];
    /// Surface stress curve.
    pub const SURFACE: [u8; 3] = [31, 119, 180];
    /// Overall stress curve.
    pub const OVERALL: [u8; 3] = [214, 39, 40];
}

/// A snapshot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// Box width [µm].
    pub width: f64,
    /// Box height [µm].
    pub height: f64,
    /// Shear strain [-].
    pub strain: f64,
    /// Shear rate [1/s].
    pub rate: f64,
    /// Grains.
    pub grains: Grains,
    /// Particle that each grain belongs to.
    pub particle: Vec<u32>,
    /// 0 free, -1 carried by the lower plate, 1 by the upper.
    pub plate: Vec<i8>,
    /// Stress of each grain over its own area (spheres: in-plane block over its volume) [Pa], compression positive.
    pub stress: Vec<Tensor2>,
    /// Position of spheres along the vorticity [µm]; empty for discs.
    pub z: Vec<f64>,
    /// Contacts per grain.
    pub coordination: Vec<u32>,
    /// Every contact once.
    pub contacts: Vec<ContactView>,
    /// For each contact true if it belongs to a force chain: compressed beyond the mean, and continued nearly straight by
    /// another such contact at one of its grains at least.
    pub in_chain: Vec<bool>,
}

/// Takes a picture of the current state; elastic forces only, dashpots left out.
pub fn frame(assembly: &Assembly) -> Frame {
    let (grains, cell) = (assembly.grains(), assembly.cell());
    let n = grains.len();
    let contacts = assembly.contacts();
    let mut stress = vec![Tensor2::ZERO; n];
    let mut coordination = vec![0u32; n];
    for c in &contacts {
        let (i, j) = (c.i as usize, c.j as usize);
        coordination[i] += 1;
        coordination[j] += 1;
        let d = match assembly {
            Assembly::Spheres(s) => {
                // Branch in space; its projection carries the in-plane block.
                s.pair_index(i, j).map_or(0.0, |k| {
                    let v = s.separation(&s.pairs()[k]);
                    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
                })
            }
            _ => (c.separation[0] * c.separation[0] + c.separation[1] * c.separation[1]).sqrt(),
        };
        if d <= 0.0 {
            continue;
        }
        let tangential = if matches!(assembly, Assembly::Spheres(_)) { 0.0 } else { c.tangential_force };
        let normal = [c.separation[0] / d, c.separation[1] / d];
        let f =
            [c.normal_force * normal[0] - tangential * normal[1], c.normal_force * normal[1] + tangential * normal[0]];
        // Each grain takes the part of the branch vector inside it, split at the contact point.
        let (ri, rj) = (grains.radius[i], grains.radius[j]);
        let branch = c.separation.map(|s| -s);
        for (k, share) in [(i, ri / (ri + rj)), (j, rj / (ri + rj))] {
            let r = grains.radius[k];
            let scale = match assembly {
                Assembly::Spheres(_) => share / (4.0 / 3.0 * std::f64::consts::PI * r * r * r),
                _ => share * 1e-6 / (std::f64::consts::PI * r * r),
            };
            stress[k] += Tensor2::dyad(f, branch) * scale;
        }
    }
    let (particle, _) = particles(n, &direct_links(assembly));
    let plate = match assembly {
        Assembly::Undirected(s) => s.plate.clone(),
        Assembly::Spheres(_) => vec![0; n],
        Assembly::Directed(s) => (0..n)
            .map(|i| {
                if s.movable(i) {
                    0
                } else if grains.y[i] > cell.height / 2.0 {
                    1
                } else {
                    -1
                }
            })
            .collect(),
    };
    let in_chain = chains(&contacts, n);
    Frame {
        width: cell.width,
        height: cell.height,
        strain: cell.strain,
        rate: cell.rate,
        grains,
        particle,
        plate,
        stress,
        z: match assembly {
            Assembly::Spheres(s) => s.balls().iter().map(|b| b.position[2].rem_euclid(s.depth())).collect(),
            _ => Vec::new(),
        },
        coordination,
        contacts,
        in_chain,
    }
}

/// Marks strong contacts that continue each other within 45 degrees.
fn chains(contacts: &[ContactView], n: usize) -> Vec<bool> {
    let pressed: Vec<f64> = contacts.iter().map(|c| (-c.normal_force).max(0.0)).collect();
    let count = pressed.iter().filter(|p| **p > 0.0).count();
    let mean = pressed.iter().sum::<f64>() / count.max(1) as f64;
    let mut strong: Vec<Vec<(usize, [f64; 2])>> = vec![Vec::new(); n];
    for (k, c) in contacts.iter().enumerate() {
        let d = (c.separation[0] * c.separation[0] + c.separation[1] * c.separation[1]).sqrt();
        if pressed[k] > mean && d > 0.0 && c.kind != ContactKind::Apart {
            let u = [c.separation[0] / d, c.separation[1] / d];
            strong[c.i as usize].push((k, u));
            strong[c.j as usize].push((k, [-u[0], -u[1]]));
        }
    }
    let mut marked = vec![false; contacts.len()];
    for list in &strong {
        for (a, (k, u)) in list.iter().enumerate() {
            for (l, v) in &list[a + 1..] {
                if u[0] * v[0] + u[1] * v[1] < -std::f64::consts::FRAC_1_SQRT_2 {
                    marked[*k] = true;
                    marked[*l] = true;
                }
            }
        }
    }
    marked
}

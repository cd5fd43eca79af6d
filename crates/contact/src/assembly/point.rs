//! Where a contact touches a strand.

use crate::block::Vec3;
use crate::families::bodies::basis;

/// A point on a strand: its velocity is `Σ weight · velocity[dof .. dof + 3]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactSide {
    /// Which strand.
    pub strand: u32,
    /// First of three consecutive freedoms of each supporting vertex.
    pub dof: [u32; 2],
    /// Weights, `1 − α` and `α`.
    pub weight: [f64; 2],
}

impl ContactSide {
    /// A point at place `alpha` of edge `edge`, with `stride` freedoms per vertex (4 for rods: position and angle).
    #[must_use]
    pub fn on_edge(strand: u32, edge: u32, alpha: f64, stride: u32) -> Self {
        ContactSide { strand, dof: [stride * edge, stride * (edge + 1)], weight: [1.0 - alpha, alpha] }
    }

    /// Velocity of the point [m/s].
    #[must_use]
    pub fn velocity(&self, v: &[f64]) -> Vec3 {
        let (a, b) = (self.dof[0] as usize, self.dof[1] as usize);
        [0, 1, 2].map(|c| self.weight[0] * v[a + c] + self.weight[1] * v[b + c])
    }
}

/// A contact ready for assembly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PosedContact {
    /// Side A: the impulse acts on it with plus sign.
    pub a: ContactSide,
    /// Side B, or `None` for a solid.
    pub b: Option<ContactSide>,
    /// Unit normal from B to A.
    pub normal: Vec3,
    /// Velocity of the solid at the contact [m/s]; zero between strands.
    pub external_velocity: Vec3,
    /// Distance of the surfaces at the start of the step [m]; negative when they overlap.
    pub gap: f64,
    /// Friction coefficient.
    pub friction: f64,
    /// Cohesive impulse bound [N s].
    pub cohesion: f64,
}

impl PosedContact {
    /// Contact basis: normal and two tangents.
    #[must_use]
    pub fn basis(&self) -> [Vec3; 3] {
        basis(&self.normal)
    }

    /// Prescribed part `w` of the contact velocity [m/s]: minus the solid's velocity in the basis, plus the gap term.
    ///
    /// An open gap adds `g/h`, so that the bodies may close it and no more; overlap adds `β g/h` with
    /// `stabilisation` `β` (0.2 by default), which pushes apart a fraction per step without a jump.
    #[must_use]
    pub fn prescribed(&self, dt: f64, stabilisation: f64) -> Vec3 {
        let e = self.basis();
        let mut w = e.map(|axis| -crate::block::dot(&axis, &self.external_velocity));
        if dt > 0.0 {
            w[0] += self.gap / dt * if self.gap > 0.0 { 1.0 } else { stabilisation };
        }
        w
    }
}

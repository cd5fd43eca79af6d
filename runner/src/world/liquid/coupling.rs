//! What strands do to the liquid in a step. Empty in a scene of liquid alone, and then it costs nothing.
//!
//! Whoever couples strands fills these fields between the named steps of stage 6 (`stages/mixture/liquid.rs`): the points before
//! stage 3, volume fractions before stage 4, drag, added mass and what strands carry through faces before the shear solve. They are
//! cleared at the end of every step.

use mpm::shear_solve::{Added, Drag, FaceCoupling};
use mpm::{Room, Vector};

/// A number on every face, one list per direction of the face normal.
#[derive(Clone, Debug)]
pub struct FaceNumbers<const D: usize>(pub [Vec<f64>; D]);

/// What strands do to faces and cells of the liquid.
#[derive(Clone, Debug, Default)]
pub struct Coupling<const D: usize> {
    /// Points that the grid must surround besides particles, such as strand vertices [m].
    pub points: Vec<Vector<D>>,
    /// Drag coefficient of each face [kg/s] and the velocity it pulls towards [m/s].
    pub drag: Option<(FaceNumbers<D>, FaceNumbers<D>)>,
    /// Mass that moves with each face besides the liquid's own [kg] and its momentum at the start of the step [kg m/s].
    pub added: Option<(FaceNumbers<D>, FaceNumbers<D>)>,
    /// Share of each cell taken by strands [1]; empty: none.
    pub solid_fraction: Vec<f64>,
    /// What strands leave of each face and carry through it; absent where they take no room.
    pub crowd: Option<Crowd<D>>,
}

/// Faces among strands that take room.
#[derive(Clone, Debug)]
pub struct Crowd<const D: usize> {
    /// Share of each face that the liquid has [1].
    pub left: FaceNumbers<D>,
    /// Share of the strands' volume that counts there: below one where they overlap, packed denser than circles can be [1].
    pub counted: FaceNumbers<D>,
    /// Volume that strands carry through each face per area and time, as if no pressure acted on them in the step [m/s].
    pub flux: FaceNumbers<D>,
    /// By how much a pressure gradient speeds that up, at most [m³/kg].
    pub yields: FaceNumbers<D>,
}

impl<const D: usize> FaceNumbers<D> {
    /// Zeros for `count` nodes.
    #[must_use]
    pub fn zeros(count: usize) -> Self {
        Self(std::array::from_fn(|_| vec![0.0; count]))
    }

    /// As slices.
    #[must_use]
    pub fn slices(&self) -> [&[f64]; D] {
        std::array::from_fn(|a| self.0[a].as_slice())
    }
}

impl<const D: usize> Coupling<D> {
    /// The part that the shear solve takes.
    #[must_use]
    pub fn faces(&self) -> FaceCoupling<'_, D> {
        FaceCoupling {
            drag: self
                .drag
                .as_ref()
                .map(|(coefficient, velocity)| Drag { coefficient: coefficient.slices(), velocity: velocity.slices() }),
            added: self
                .added
                .as_ref()
                .map(|(mass, momentum)| Added { mass: mass.slices(), momentum: momentum.slices() }),
        }
    }

    /// The share of each cell taken by strands, if there are any.
    #[must_use]
    pub fn solid_fraction(&self) -> Option<&[f64]> {
        (!self.solid_fraction.is_empty()).then_some(self.solid_fraction.as_slice())
    }

    /// What strands take of the room, as the pressure solve sees it.
    #[must_use]
    pub fn room(&self) -> Option<Room<'_, D>> {
        let crowd = self.crowd.as_ref()?;
        Some(Room {
            taken: &self.solid_fraction,
            left: crowd.left.slices(),
            flux: crowd.flux.slices(),
            yields: crowd.yields.slices(),
        })
    }

    /// Whether strands act on the momentum of the faces, so that it has to be solved for again after the pressure.
    #[must_use]
    pub fn acts_on_momentum(&self) -> bool {
        self.drag.is_some() || self.added.is_some()
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.points.clear();
        self.drag = None;
        self.added = None;
        self.solid_fraction.clear();
        self.crowd = None;
    }
}

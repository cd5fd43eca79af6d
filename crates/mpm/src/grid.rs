//! The staggered grid under the liquid: everything that lives on faces and cells for the length of one step.
//!
//! Nothing here survives a step; a restarted run rebuilds it from the particles.

use crate::particles::SortScratch;
use numerics::tensor::Vector;
use particle_grid::{BlockGrid, CENTRE, Lanes, Lattice, ParticleOrder, ScatterScratch, mac_offset};

/// Fields on the faces normal to one direction, one entry per node.
#[derive(Clone, Debug, Default)]
pub struct FaceFields {
    /// Liquid mass [kg].
    pub mass: Vec<f64>,
    /// Liquid volume [m³].
    pub volume: Vec<f64>,
    /// Velocity component along the normal direction [m/s].
    pub velocity: Vec<f64>,
    /// Force of the shear stress carried back to no motion [N].
    pub shear_force: Vec<f64>,
    /// Share of the face not covered by solids [1].
    pub open: Vec<f64>,
    /// Velocity of the nearest solid along the normal direction [m/s]; meaningful where `open` is below one.
    pub solid_velocity: Vec<f64>,
    /// Pressure gradient along the normal direction [Pa/m] of the last pressure solve, zero outside the liquid.
    pub pressure_gradient: Vec<f64>,
}

/// Fields at cell centres, one entry per node.
#[derive(Clone, Debug, Default)]
pub struct CellFields {
    /// Share of the cell filled with liquid, smoothed by the kernel [1].
    pub liquid_fraction: Vec<f64>,
    /// Distance to the free surface, negative inside the liquid [m].
    pub liquid_distance: Vec<f64>,
    /// Distance to the nearest solid, negative inside it [m].
    pub solid_distance: Vec<f64>,
    /// Share of the kernel around the cell that solids leave open [1].
    pub kernel_open: Vec<f64>,
    /// Average volume ratio of the liquid [1].
    pub volume_ratio: Vec<f64>,
    /// Compliance, one over the bulk modulus [1/Pa]; zero where the volume is rigid.
    pub compliance: Vec<f64>,
    /// Pressure of the last solve [Pa], zero outside the liquid.
    pub pressure: Vec<f64>,
}

/// A face tied to another one by a wall: `velocity = ratio × velocity(source) + offset`.
///
/// All forces on the tied face act on the one it follows through the ratio: the motions that obey the ties are a subspace, and
/// the balance of momentum is that of this subspace.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WallTie {
    /// Direction of the face normal.
    pub axis: u8,
    /// The tied face.
    pub face: u32,
    /// The face it follows, or [`particle_grid::NONE`] where the velocity is prescribed.
    pub source: u32,
    /// Factor on the source.
    pub ratio: f64,
    /// What is added [m/s].
    pub offset: f64,
}

/// The grid of one step with its fields and the scratch of the transfers.
#[derive(Clone, Debug)]
pub struct LiquidGrid<const D: usize> {
    /// Active blocks.
    pub blocks: BlockGrid<D>,
    /// Order of the sorted particles.
    pub order: ParticleOrder<D>,
    /// Face fields, one set per direction.
    pub face: [FaceFields; D],
    /// Cell fields.
    pub cell: CellFields,
    /// Faces tied to others by walls.
    pub ties: Vec<WallTie>,
    /// For each active block whether a solid is near.
    pub near_solid: Vec<bool>,
    /// Mass below which a face counts as empty [kg].
    pub mass_floor: f64,
    /// Room that a particle stands for, along each direction [cells]: fills are as exact as if particles were boxes of this width. Zero: points.
    pub particle_width: f64,
    /// Whether some liquid of the scene is elastic in shear: what is thinner than a cell then keeps its pressure.
    pub elastic: bool,
    pub(crate) scatter: ScatterScratch,
    pub(crate) lanes: Vec<Lanes>,
    pub(crate) sort: SortScratch<D>,
}

impl<const D: usize> LiquidGrid<D> {
    /// A grid without blocks.
    #[must_use]
    pub fn new(lattice: Lattice<D>) -> Self {
        Self {
            blocks: BlockGrid::new(lattice),
            order: ParticleOrder::new(),
            face: std::array::from_fn(|_| FaceFields::default()),
            cell: CellFields::default(),
            ties: Vec::new(),
            near_solid: Vec::new(),
            mass_floor: 0.0,
            particle_width: 0.0,
            elastic: false,
            scatter: ScatterScratch::default(),
            lanes: Vec::new(),
            sort: SortScratch::default(),
        }
    }

    /// Cell size, origin, periodic directions.
    #[must_use]
    pub fn lattice(&self) -> &Lattice<D> {
        &self.blocks.lattice
    }

    /// Position of a face centre [m].
    #[must_use]
    pub fn face_position(&self, axis: usize, node: usize) -> Vector<D> {
        self.lattice().node_position(&self.blocks.cell(node), &mac_offset(axis))
    }

    /// Position of a cell centre [m].
    #[must_use]
    pub fn cell_position(&self, node: usize) -> Vector<D> {
        self.lattice().node_position(&self.blocks.cell(node), &[CENTRE; D])
    }

    /// Volume of a cell [m³].
    #[must_use]
    pub fn cell_volume(&self) -> f64 {
        self.lattice().dx.powi(D as i32)
    }

    /// Face velocities as slices, for [`particle_grid::gather`].
    #[must_use]
    pub fn velocities(&self) -> [&[f64]; D] {
        std::array::from_fn(|a| self.face[a].velocity.as_slice())
    }

    /// Offsets of the face fields.
    #[must_use]
    pub fn offsets() -> [[f64; D]; D] {
        std::array::from_fn(mac_offset)
    }

    /// Largest speed component on faces that hold liquid [m/s].
    #[must_use]
    pub fn max_face_speed(&self) -> f64 {
        self.face
            .iter()
            .flat_map(|f| f.velocity.iter().zip(&f.mass))
            .fold(0.0, |m, (u, mass)| if *mass > self.mass_floor { m.max(u.abs()) } else { m })
    }

    /// Momentum on the faces [kg m/s].
    #[must_use]
    pub fn momentum(&self) -> Vector<D> {
        Vector::from_fn(|a, _| numerics::reduce::dot(&self.face[a].mass, &self.face[a].velocity))
    }

    /// Velocity of the liquid at any position [m/s] and the weight of the nodes that know it (one inside the liquid).
    #[must_use]
    pub fn velocity_at(&self, x: &Vector<D>) -> (Vector<D>, f64) {
        let mut out = Vector::zeros();
        let mut known = 1.0f64;
        for a in 0..D {
            let (mut sum, mut weight) = (0.0, 0.0);
            particle_grid::stencil(&self.blocks, x, &mac_offset(a), |s| {
                if self.face[a].mass[s.node] > self.mass_floor {
                    sum += s.weight * self.face[a].velocity[s.node];
                    weight += s.weight;
                }
            });
            out[a] = if weight > 0.0 { sum / weight } else { 0.0 };
            known = known.min(weight);
        }
        (out, known)
    }

    /// Bytes held by the fields and the scratch of transfers and sorting.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let faces: usize = self
            .face
            .iter()
            .map(|f| {
                f.mass.capacity()
                    + f.volume.capacity()
                    + f.velocity.capacity()
                    + f.shear_force.capacity()
                    + f.open.capacity()
                    + f.solid_velocity.capacity()
                    + f.pressure_gradient.capacity()
            })
            .sum();
        let c = &self.cell;
        let cells = c.liquid_fraction.capacity()
            + c.liquid_distance.capacity()
            + c.solid_distance.capacity()
            + c.kernel_open.capacity()
            + c.volume_ratio.capacity()
            + c.compliance.capacity()
            + c.pressure.capacity();
        8 * (faces + cells) + 32 * self.lanes.capacity() + self.scatter.bytes() + self.sort.bytes()
    }
}

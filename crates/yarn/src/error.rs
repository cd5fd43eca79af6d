//! What can go wrong, said with the yarn and vertex concerned.

use particle_grid::GridError;
use thiserror::Error;

/// A refused set-up or a step that could not be taken.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum YarnError {
    /// A setting is out of its range.
    #[error("{setting}: {problem}")]
    Setting {
        /// Path of the setting, as in `yarns[2].shape.radius`.
        setting: String,
        /// What is wrong and what is allowed.
        problem: String,
    },
    /// A vertex is, or came to be, outside the domain.
    #[error("yarn {yarn}, vertex {vertex} is outside the domain at step {step}: position {position:?} m")]
    LeftDomain {
        /// Yarn in scene order.
        yarn: usize,
        /// Vertex along the yarn.
        vertex: usize,
        /// Steps taken before.
        step: u64,
        /// Where it is [m].
        position: Vec<f64>,
    },
    /// A number stopped being finite.
    #[error("yarn {yarn}, vertex {vertex} has a non-finite {quantity} at step {step}")]
    NonFinite {
        /// Yarn in scene order.
        yarn: usize,
        /// Vertex along the yarn.
        vertex: usize,
        /// Which quantity.
        quantity: &'static str,
        /// Steps taken before.
        step: u64,
    },
    /// The step asked for is larger than the method is stable for, and sub-steps are not allowed (or too many).
    #[error(
        "a step of {dt:.3e} s is too large: {reason} allows {limit:.3e} s ({substeps} sub-steps needed, {allowed} allowed)"
    )]
    StepTooLarge {
        /// Step asked for [s].
        dt: f64,
        /// Largest stable step [s].
        limit: f64,
        /// Which limit.
        reason: &'static str,
        /// Sub-steps that would be needed.
        substeps: usize,
        /// Sub-steps the settings allow.
        allowed: usize,
    },
    /// The implicit solve did not reach its tolerance.
    #[error(
        "the implicit step did not converge: residual {residual:.3e} after {iterations} Newton iterations (tolerance {tolerance:.3e})"
    )]
    NotConverged {
        /// Newton iterations.
        iterations: usize,
        /// Relative residual reached.
        residual: f64,
        /// Tolerance asked for.
        tolerance: f64,
    },
    /// The grid refused the positions.
    #[error("the grid cannot hold the yarns: {0}")]
    Grid(#[from] GridError),
}

impl YarnError {
    /// A refused setting.
    pub(crate) fn setting(setting: impl Into<String>, problem: impl Into<String>) -> Self {
        Self::Setting { setting: setting.into(), problem: problem.into() }
    }
}

/// Something allowed that a user should know of.
#[derive(Clone, Debug, PartialEq)]
pub enum YarnWarning {
    /// Segments much shorter than a cell have zigzag modes that the grid cannot see.
    ShortSegments {
        /// Yarn in scene order.
        yarn: usize,
        /// Shortest segment in cells.
        ratio: f64,
    },
    /// Segments longer than a cell share few grid nodes: the yarn may come apart.
    LongSegments {
        /// Yarn in scene order.
        yarn: usize,
        /// Longest segment in cells.
        ratio: f64,
    },
    /// An obstacle smaller than two cells may slip through the grid.
    SmallObstacle {
        /// Obstacle in scene order.
        obstacle: usize,
        /// Smallest extent in cells.
        cells: f64,
    },
    /// A vertex starts inside an obstacle.
    StartsInside {
        /// Yarn in scene order.
        yarn: usize,
        /// Vertex along the yarn.
        vertex: usize,
        /// Obstacle in scene order.
        obstacle: usize,
    },
    /// No step bound is known for massless quadrature points; the one for an even share is used.
    MasslessQuadrature,
}

impl std::fmt::Display for YarnWarning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::ShortSegments { yarn, ratio } => {
                write!(f, "yarn {yarn} has segments of {ratio:.3} cells: below 0.25 there are motions that the grid cannot see")
            }
            Self::LongSegments { yarn, ratio } => {
                write!(f, "yarn {yarn} has segments of {ratio:.3} cells: above 1 the yarn may come apart")
            }
            Self::SmallObstacle { obstacle, cells } => {
                write!(f, "obstacle {obstacle} is {cells:.2} cells wide: below 2 it may slip through yarns")
            }
            Self::StartsInside { yarn, vertex, obstacle } => {
                write!(f, "yarn {yarn}, vertex {vertex} starts inside obstacle {obstacle}")
            }
            Self::MasslessQuadrature => {
                f.write_str("quadrature points carry no mass: the contact step limit is an estimate, and forces on massless nodes are lost")
            }
        }
    }
}

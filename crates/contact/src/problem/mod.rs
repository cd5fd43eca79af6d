//! A frictional contact problem, independent of what touches: `u = W r + q` with Coulomb's law at every contact.
//!
//! ```text
//! block_matrix ── W: block-sparse rows of 3×3 blocks
//! data         ── ContactProblem: W, q, friction, cohesion; checks; the cohesive shift
//! components   ── groups of contacts that do not feel each other
//! residual     ── the natural-map residual, the one measure of every solver
//! violation    ── what of the law an answer breaks, contact by contact: judges solvers and cross-check alike
//! text, ron    ── files
//! ```

pub mod block_matrix;
pub mod components;
pub mod data;
pub mod residual;
pub mod ron;
pub mod text;
pub mod violation;

pub use block_matrix::BlockMatrix;
pub use components::{Component, components};
pub use data::{ContactProblem, ProblemError};
pub use residual::{Scaling, residual};
pub use violation::{Violation, violations, worst_violation};

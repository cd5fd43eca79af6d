//! An independent second opinion: the same problem as second-order cone programmes solved by Clarabel.
//!
//! For a *fixed* shift `ς_k` the problem with associated friction is convex; its solution with `ς_k = ν‖u_T‖` is the exact
//! Coulomb solution. The outer fixed point on `ς` recovers it (Cadoux 2009; Acary and others 2011). Used in tests and by
//! `--cross-check`, never as the answer of a run. Left at `ς = 0` it is the relaxed model of many engines: see
//! [`convex_model`].
//!
//! ```text
//! dual   ── unknown impulses, cost ½ rᵀW r: needs a symmetric W
//! primal ── unknown velocities, cost ½ vᵀK v: keeps the sparse inverse dynamics, works for singular W
//! outer  ── the fixed point on the shift, the same for both
//! compare ── ours against it: the same, a second solution of the law, or a disagreement
//! polish ── the digits that an interior-point method leaves out (dual form)
//! ```

mod compare;
mod dual;
mod outer;
mod polish;
mod primal;

pub use compare::{AGREED, AT_REST, Comparison, VERIFIED, Verdict, compare};
pub use dual::{certify, convex_model, cross_check};
pub use outer::{OracleAnswer, OracleError, OracleSettings};
pub use polish::refine;
pub use primal::{PrimalProblem, cross_check_primal};

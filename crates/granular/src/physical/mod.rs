//! The default sample: every contact once, evaluated in any order with the same bits.
//!
//! One step reads the grains, writes one force per pair ([`pairs`](self)), then each grain gathers its own forces in a fixed
//! order, moves, and adds its share of the stress. Both loops run over blocks of fixed size whose sums are added in order, so
//! the result does not depend on the number of threads. Positions are wrapped only when the pair list is rebuilt; between
//! rebuilds every pair keeps its image offset, so nothing jumps when a grain crosses an edge.

mod flow;
mod kernel;
mod rebuild;
mod rules;
mod state;
mod step;

pub use rules::{Lever, Rules, SlipRule, StepGuard};
pub use state::{Body, Pair, Sample};
pub use step::StepReport;

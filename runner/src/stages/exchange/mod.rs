//! Stage 1, exchange: liquid that changes hands between strands and what is around them.
//!
//! ```text
//! drip ── reservoirs at the ends of strands let drops fall
//! ```

mod drip;

use super::Step;
use crate::system::Rejection;
use crate::world::World;
use crate::world::film::Exchanged;

/// Lets reservoirs drip.
pub fn run(world: &mut World, _step: Step) -> Result<(), Rejection> {
    if let Some(film) = &mut world.film {
        film.exchanged = Exchanged::default();
    }
    drip::to_ledger(world);
    Ok(())
}

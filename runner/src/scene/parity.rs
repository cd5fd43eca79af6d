//! Departures from our methods towards those of the reference code, for comparison. All off.

use super::declare::section;

section! {
    /// What is done as the reference code does it.
    pub struct Parity {
        /// Drag stands inside the equations of the liquid's faces, with the velocity of the strands averaged by mass; momentum is then not conserved.
        drag_in_faces: bool = [false] () "";
        /// The momentum across the strand of liquid that it takes up is lost.
        lose_transverse: bool = [false] () "";
    }
}

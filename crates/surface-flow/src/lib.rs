//! The liquid film on a strand: height, velocity, reduced strain.

//! Discrete elastic rods: state, kinematics, energies, implicit step.

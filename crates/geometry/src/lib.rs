//! Signed-distance shapes, triangle meshes, scripted motion, broad phase.

//! From a scene file to records: scene, world, twelve stages, stepper, outputs.

pub mod scene;

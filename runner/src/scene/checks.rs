//! What must fit together in a scene, beyond the range of each single number.

use super::Scene;
use super::error::{Problem, SourceFile};
use super::tree::Node;
use std::path::PathBuf;

/// Every inconsistency of a scene, each at its place in the text.
#[must_use]
pub fn check(_scene: &Scene, _root: &Node, _files: &[SourceFile]) -> Vec<Problem> {
    Vec::new()
}

/// The files that a scene refers to besides included ones.
#[must_use]
pub fn external_files(_scene: &Scene) -> Vec<PathBuf> {
    Vec::new()
}

//! Frictional contact: detection, Delassus operator, complementarity solvers, cohesion, cross-check.

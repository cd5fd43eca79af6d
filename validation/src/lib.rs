//! Analytic, literature and hard cases with their references.

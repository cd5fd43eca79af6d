//! Soft grains in an oscillatory shear cell: contacts, links, stress tensors, rheometer.

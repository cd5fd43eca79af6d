//! Properties of the whole method.

mod reference;

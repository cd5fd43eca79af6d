//! Vectors in text files: both `(0, 1, 0)` and `[0, 1, 0]` are read; binary formats get a plain tuple.
//!
//! Used through `#[serde(with = "crate::vector_format")]` on fields of any fixed-size vector.

use nalgebra::SVector;
use serde::de::{Deserializer, Error, SeqAccess, Visitor};
use serde::ser::{SerializeTuple, Serializer};
use std::fmt;

pub(crate) fn serialize<S: Serializer, const D: usize>(value: &SVector<f64, D>, to: S) -> Result<S::Ok, S::Error> {
    let mut tuple = to.serialize_tuple(D)?;
    for component in value.iter() {
        tuple.serialize_element(component)?;
    }
    tuple.end()
}

pub(crate) fn deserialize<'de, S: Deserializer<'de>, const D: usize>(from: S) -> Result<SVector<f64, D>, S::Error> {
    if from.is_human_readable() {
        from.deserialize_any(Components::<D>)
    } else {
        from.deserialize_tuple(D, Components::<D>)
    }
}

struct Components<const D: usize>;

impl<'de, const D: usize> Visitor<'de> for Components<D> {
    type Value = SVector<f64, D>;

    fn expecting(&self, to: &mut fmt::Formatter) -> fmt::Result {
        write!(to, "{D} numbers in brackets")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<Self::Value, A::Error> {
        let mut value = SVector::<f64, D>::zeros();
        for i in 0..D {
            value[i] = sequence.next_element()?.ok_or_else(|| A::Error::invalid_length(i, &self))?;
        }
        if sequence.next_element::<f64>()?.is_some() {
            return Err(A::Error::invalid_length(D + 1, &self));
        }
        Ok(value)
    }
}

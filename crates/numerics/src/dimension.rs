//! Code that is generic over the dimension, compiled once in its own crate for the plane and for space.
//!
//! A generic function is compiled in every crate that calls it. [`compile_here!`](crate::compile_here) names functions whose code
//! for `D = 2` and `D = 3` shall be made where they are written; whoever calls them, generic or not, calls that code.
//!
//! ```text
//! caller<D> ──► compiled::solve<D> ──┬─ D = 2 ─► compiled::two::solve    ─► Solver::<2>::solve_any
//!                                    └─ D = 3 ─► compiled::three::solve  ─► Solver::<3>::solve_any
//! ```

use std::mem::{ManuallyDrop, size_of, transmute_copy};

/// Hands a value over under the other name of its type.
///
/// # Safety
/// `A` and `B` must be the same type, lifetimes apart, and lifetimes must not grow.
#[inline(always)]
pub unsafe fn same<A, B>(value: A) -> B {
    debug_assert_eq!(size_of::<A>(), size_of::<B>());
    let value = ManuallyDrop::new(value);
    // SAFETY: one type, says the caller; the original is never dropped, so there is one owner.
    unsafe { transmute_copy(&value) }
}

/// Compiles functions that are generic over the dimension `D` here, for two and three dimensions.
///
/// ```
/// pub struct Sum<const D: usize>([f64; D]);
///
/// fn add_any<const D: usize>(sum: &mut Sum<D>, x: [f64; D]) -> f64 {
///     for a in 0..D {
///         sum.0[a] += x[a];
///     }
///     sum.0[0]
/// }
///
/// numerics::compile_here! {
///     mod compiled {
///         fn add(sum: &mut Sum<D>, x: [f64; D]) -> f64 = add_any;
///     }
/// }
///
/// fn main() {
///     let mut sum = Sum([1.0, 2.0, 3.0]);
///     assert_eq!(compiled::add(&mut sum, [1.0, 1.0, 1.0]), 2.0);
///     assert_eq!(sum.0, [2.0, 3.0, 4.0]);
/// }
/// ```
#[macro_export]
macro_rules! compile_here {
    ($vis:vis mod $module:ident {
        $(fn $name:ident($($arg:ident: $ty:ty),* $(,)?) $(-> $ret:ty)? = $inner:expr;)*
    }) => {
        #[allow(missing_docs, unused_imports, clippy::too_many_arguments, reason = "the public faces are documented where they call these")]
        $vis mod $module {
            use super::*;

            mod two {
                use super::*;
                const D: usize = 2;
                $(#[inline(never)] pub fn $name($($arg: $ty),*) $(-> $ret)? { $inner($($arg),*) })*
            }

            mod three {
                use super::*;
                const D: usize = 3;
                $(#[inline(never)] pub fn $name($($arg: $ty),*) $(-> $ret)? { $inner($($arg),*) })*
            }

            $(#[inline] pub fn $name<const D: usize>($($arg: $ty),*) $(-> $ret)? {
                use $crate::dimension::same;
                match D {
                    // SAFETY: `D` is 2, so the types of arguments and result, the same text in both functions, are the same.
                    2 => unsafe { same(two::$name($(same($arg)),*)) },
                    // SAFETY: as above, with 3.
                    3 => unsafe { same(three::$name($(same($arg)),*)) },
                    _ => unreachable!("the plane and space are the only dimensions"),
                }
            })*
        }
    };
}

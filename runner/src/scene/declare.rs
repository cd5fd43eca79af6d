//! The two macros that declare a scene.
//!
//! [`section!`](section) declares a group of fields, [`choice!`](choice) a set of alternatives. One declaration gives
//! the struct and its documentation, defaults, unit conversion, range checks, the reference page and the schema, so
//! these can never disagree. A new part of the scene is a new file with such declarations and one field in
//! [`Scene`](super::Scene).

/// The default of a field: `[required]`, `[blank]` (the type's own), or `[expression]` in SI.
macro_rules! scene_default {
    ($ty:ty, required) => {
        None::<$ty>
    };
    ($ty:ty, blank) => {
        <$ty as $crate::scene::field::Field>::blank()
    };
    ($ty:ty, $value:expr) => {
        Some::<$ty>($value)
    };
}

/// What the numbers of a field measure: `()` or `(Quantity, range)`.
macro_rules! scene_spec {
    () => {
        $crate::scene::quantity::Spec::PLAIN
    };
    ($quantity:ident) => {
        $crate::scene::quantity::Spec {
            quantity: $crate::scene::quantity::Quantity::$quantity,
            range: $crate::scene::quantity::any(),
        }
    };
    ($quantity:ident, $range:expr) => {
        $crate::scene::quantity::Spec { quantity: $crate::scene::quantity::Quantity::$quantity, range: $range }
    };
}

/// Declares a group of fields: `/// meaning` `name: Type = [default] (Quantity, range) "effect";`.
macro_rules! section {
    (
        $(#[doc = $about:literal])*
        pub struct $Name:ident {
            $( $(#[doc = $meaning:literal])* $field:ident : $ty:ty = [$($default:tt)*] ($($spec:tt)*) $effect:literal; )*
        }
    ) => {
        $(#[doc = $about])*
        #[derive(Clone, Debug, PartialEq)]
        pub struct $Name {
            $( $(#[doc = $meaning])* #[doc = ""] #[doc = $effect] pub $field: $ty, )*
        }

        impl $crate::scene::field::Field for $Name {
            const IS_SECTION: bool = true;

            fn decode(
                node: &$crate::scene::tree::Node,
                _spec: &$crate::scene::quantity::Spec,
                reading: &mut $crate::scene::field::Reading<'_>,
            ) -> Option<Self> {
                const NAMES: &[&str] = &[$(stringify!($field)),*];
                let (slots, sound) = $crate::scene::field::section_entries(node, stringify!($Name), NAMES, reading)?;
                let mut slots = slots.into_iter();
                $(
                    let $field = $crate::scene::field::decode_entry::<$ty>(
                        stringify!($field),
                        slots.next().flatten(),
                        &$crate::scene::declare::scene_spec!($($spec)*),
                        $crate::scene::declare::scene_default!($ty, $($default)*),
                        node.span,
                        reading,
                    );
                )*
                let result = Self { $( $field: $field?, )* };
                sound.then_some(result)
            }

            fn encode(
                &self,
                _spec: &$crate::scene::quantity::Spec,
                units: $crate::scene::quantity::Units,
            ) -> $crate::scene::tree::Node {
                let mut fields = Vec::new();
                $(
                    if $crate::scene::declare::scene_default!($ty, $($default)*).as_ref() != Some(&self.$field) {
                        fields.push($crate::scene::tree::Entry {
                            name: stringify!($field).to_owned(),
                            name_span: $crate::scene::tree::Span::NONE,
                            value: self.$field.encode(&$crate::scene::declare::scene_spec!($($spec)*), units),
                        });
                    }
                )*
                $crate::scene::tree::Node::made($crate::scene::tree::Value::Group($crate::scene::tree::Group {
                    fields,
                    ..$crate::scene::tree::Group::default()
                }))
            }

            fn describe(book: &mut $crate::scene::reference::Book) -> $crate::scene::reference::Kind {
                book.section(stringify!($Name), concat!($($about, "\n"),*), |book, page| {
                    $(
                        page.field(
                            stringify!($field),
                            concat!($($meaning, "\n"),*),
                            $effect,
                            $crate::scene::declare::scene_spec!($($spec)*),
                            $crate::scene::declare::scene_default!($ty, $($default)*),
                            book,
                        );
                    )*
                })
            }

            fn blank() -> Option<Self> {
                Some(Self { $( $field: $crate::scene::declare::scene_default!($ty, $($default)*)?, )* })
            }
        }
    };
}

macro_rules! scene_variant {
    (decode $Name:ident, $Variant:ident, $node:expr, $payload:expr, $reading:expr) => {{
        if let Some($crate::scene::tree::Node { value: $crate::scene::tree::Value::Group(group), .. }) = $payload
            && !(group.items.is_empty() && group.fields.is_empty())
        {
            return $reading.expected(
                $node,
                concat!("`", stringify!($Variant), "` alone"),
                concat!("only `", stringify!($Variant), "`: it takes no values"),
            );
        }
        Some($Name::$Variant)
    }};
    (decode $Name:ident, $Variant:ident, $node:expr, $payload:expr, $reading:expr, $ty:ty, ($($spec:tt)*)) => {
        $crate::scene::field::decode_payload::<$ty>(
            stringify!($Variant),
            $node,
            $payload,
            &$crate::scene::declare::scene_spec!($($spec)*),
            $reading,
        )
        .map($Name::$Variant)
    };
    (encode $Name:ident, $Variant:ident, $this:expr, $units:expr) => {
        if let $Name::$Variant = $this {
            return $crate::scene::tree::Node::made($crate::scene::tree::Value::Name(stringify!($Variant).to_owned()));
        }
    };
    (encode $Name:ident, $Variant:ident, $this:expr, $units:expr, $ty:ty, ($($spec:tt)*)) => {
        if let $Name::$Variant(value) = $this {
            return $crate::scene::field::encode_payload::<$ty>(
                stringify!($Variant),
                value,
                &$crate::scene::declare::scene_spec!($($spec)*),
                $units,
            );
        }
    };
    (describe $page:expr, $book:expr, $Variant:ident, $meaning:expr) => {
        $page.variant(stringify!($Variant), $meaning)
    };
    (describe $page:expr, $book:expr, $Variant:ident, $meaning:expr, $ty:ty, ($($spec:tt)*)) => {
        $page.variant_with::<$ty>(stringify!($Variant), $meaning, $crate::scene::declare::scene_spec!($($spec)*), $book)
    };
}

/// Declares a choice: `/// meaning` `Name;` or `Name(Type) (Quantity, range);`.
macro_rules! choice {
    (
        $(#[doc = $about:literal])*
        pub enum $Name:ident {
            $( $(#[doc = $meaning:literal])* $Variant:ident $(($ty:ty) ($($spec:tt)*))?; )*
        }
    ) => {
        $(#[doc = $about])*
        #[derive(Clone, Debug, PartialEq)]
        #[allow(clippy::large_enum_variant)] // scene descriptions are few and short-lived
        pub enum $Name {
            $( $(#[doc = $meaning])* $Variant $(($ty))?, )*
        }

        impl $crate::scene::field::Field for $Name {
            fn decode(
                node: &$crate::scene::tree::Node,
                _spec: &$crate::scene::quantity::Spec,
                reading: &mut $crate::scene::field::Reading<'_>,
            ) -> Option<Self> {
                const NAMES: &[&str] = &[$(stringify!($Variant)),*];
                let (name, payload) = $crate::scene::field::variant(node, NAMES, reading)?;
                $(
                    if name == stringify!($Variant) {
                        return $crate::scene::declare::scene_variant!(decode $Name, $Variant, node, payload, reading $(, $ty, ($($spec)*))?);
                    }
                )*
                None
            }

            fn encode(
                &self,
                _spec: &$crate::scene::quantity::Spec,
                units: $crate::scene::quantity::Units,
            ) -> $crate::scene::tree::Node {
                let _ = units;
                $( $crate::scene::declare::scene_variant!(encode $Name, $Variant, self, units $(, $ty, ($($spec)*))?); )*
                unreachable!("every variant returned above")
            }

            fn describe(book: &mut $crate::scene::reference::Book) -> $crate::scene::reference::Kind {
                book.choice(stringify!($Name), concat!($($about, "\n"),*), |book, page| {
                    let _ = &book;
                    $( $crate::scene::declare::scene_variant!(describe page, book, $Variant, concat!($($meaning, "\n"),*) $(, $ty, ($($spec)*))?); )*
                })
            }
        }
    };
}

pub(crate) use {choice, scene_default, scene_spec, scene_variant, section};

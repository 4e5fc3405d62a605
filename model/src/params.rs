//! Parameters of named scenes, each stated once: its meaning, its type, its default and its range.

use crate::error::{SceneError, check};

/// Keys of a text: names and the lines of their documentation.
#[cfg(feature = "toml")]
pub(crate) type Keys = &'static [(&'static str, &'static [&'static str])];

/// Parameters of a named scene: what [`params`] makes.
#[cfg(feature = "toml")]
pub(crate) trait Parameters: Sized {
    /// Keys with the lines of their documentation.
    const KEYS: Keys;
    /// Lines of their struct's documentation, whose first paragraph describes the scene.
    const ABOUT: &'static [&'static str];

    /// Name of the scene.
    fn scene_name(&self) -> &'static str;

    /// Documentation of the one of several scenes that it is; empty of a scene of its own.
    fn about_kind(&self) -> &'static str;

    /// These parameters for the scene that `other` has.
    fn with_kind_of(self, other: &Self) -> Self;
}

/// The numbers of a parameter, none of one that is not given.
pub(crate) trait Numbers {
    fn numbers(&self) -> impl Iterator<Item = f64>;
}

impl Numbers for f64 {
    fn numbers(&self) -> impl Iterator<Item = f64> {
        std::iter::once(*self)
    }
}

impl Numbers for usize {
    fn numbers(&self) -> impl Iterator<Item = f64> {
        std::iter::once(*self as f64)
    }
}

impl<T: Numbers> Numbers for Option<T> {
    fn numbers(&self) -> impl Iterator<Item = f64> {
        self.iter().flat_map(T::numbers)
    }
}

impl<T: Numbers, const N: usize> Numbers for [T; N] {
    fn numbers(&self) -> impl Iterator<Item = f64> {
        self.iter().flat_map(T::numbers)
    }
}

/// Refuses a parameter with a number that is not finite or not `ok`.
pub(crate) fn check_range(
    what: &str,
    parameter: &impl Numbers,
    ok: impl Fn(f64) -> bool,
    needs: &'static str,
) -> Result<(), SceneError> {
    let mut numbers = parameter.numbers();
    numbers.try_for_each(|number| check(what, number, ok(number), needs))
}

/// Refuses more than `limit` of what a scene is built from.
pub(crate) fn check_count(
    what: &'static str,
    value: usize,
    limit: usize,
) -> Result<(), SceneError> {
    if value > limit {
        return Err(SceneError::TooLarge { what, value, limit });
    }
    Ok(())
}

/// Refuses what under- or overflowed when all was worked out.
pub(crate) fn check_worked_out(all: &[(&str, f64)]) -> Result<(), SceneError> {
    let needs = "between 1e-150 and 1e150 when all is worked out";
    let mut all = all.iter();
    all.try_for_each(|(what, value)| check_range(what, value, representable, needs))
}

pub(crate) fn finite(_: f64) -> bool {
    true
}

pub(crate) fn positive(x: f64) -> bool {
    x > 0.0
}

pub(crate) fn not_negative(x: f64) -> bool {
    x >= 0.0
}

/// Far from where squares and inverses under- or overflow.
pub(crate) fn representable(x: f64) -> bool {
    (1e-150..=1e150).contains(&x)
}

/// The struct of a scene's parameters: each field with its documentation, its default, and its range, a function and the
/// words for it. `of FIELD: TYPE` adds the field that says which of several scenes it is.
macro_rules! params {
    (
        $(#[doc = $about:literal])*
        pub struct $name:ident, $(named $scene:literal)? $(of $kind:ident: $Kind:ident)? {
            $(
                $(#[doc = $doc:literal])*
                pub $field:ident: $type:ty = $default:expr $(, $ok:expr, $needs:literal)?;
            )*
        }
    ) => {
        $(#[doc = $about])*
        #[derive(Debug, Clone, PartialEq)]
        #[cfg_attr(feature = "toml", derive(serde::Serialize, serde::Deserialize))]
        #[cfg_attr(feature = "toml", serde(default, deny_unknown_fields))]
        pub struct $name {
            $(
                /// Which scene it is. Not part of a scene's text: the table's name says it.
                #[cfg_attr(feature = "toml", serde(skip))]
                pub $kind: $Kind,
            )?
            $(
                $(#[doc = $doc])*
                pub $field: $type,
            )*
        }

        impl Default for $name {
            fn default() -> Self {
                Self {
                    $($kind: $Kind::default(),)?
                    $($field: $default,)*
                }
            }
        }

        impl $name {
            $(
                /// The default parameters of a scene.
                #[must_use]
                pub fn new($kind: $Kind) -> Self {
                    Self {
                        $kind,
                        ..Self::default()
                    }
                }
            )?

            /// The default parameters of the scene called `name`.
            pub(crate) fn of_scene(name: &str) -> Option<Self> {
                $((name == $scene).then(Self::default))?
                $($Kind::named(name).map(Self::new))?
            }

            /// Checks each parameter by itself.
            fn check_each(&self) -> Result<(), crate::error::SceneError> {
                $($(crate::params::check_range(stringify!($field), &self.$field, $ok, $needs)?;)?)*
                Ok(())
            }
        }

        #[cfg(feature = "toml")]
        impl crate::params::Parameters for $name {
            const KEYS: crate::params::Keys = &[$((stringify!($field), &[$($doc),*])),*];
            const ABOUT: &'static [&'static str] = &[$($about),*];

            fn scene_name(&self) -> &'static str {
                $($scene)?
                $(self.$kind.name())?
            }

            fn about_kind(&self) -> &'static str {
                [$(self.$kind.about(),)? ""][0]
            }

            fn with_kind_of(self, _other: &Self) -> Self {
                Self {
                    $($kind: _other.$kind,)?
                    ..self
                }
            }
        }
    };
}
pub(crate) use params;

/// An enumeration of scenes that share their parameters, each with its name. The first is the default.
macro_rules! scenes {
    (
        $(#[doc = $about:literal])*
        pub enum $kind:ident {
            $($(#[doc = $doc:literal])* $scene:ident = $name:literal,)*
        }
    ) => {
        $(#[doc = $about])*
        #[non_exhaustive]
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum $kind {
            $(
                $(#[doc = $doc])*
                $scene,
            )*
        }

        impl Default for $kind {
            fn default() -> Self {
                Self::ALL[0]
            }
        }

        impl $kind {
            /// All of them.
            pub const ALL: [Self; [$($name),*].len()] = [$(Self::$scene),*];

            /// Name of its scene.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$scene => $name,)*
                }
            }

            /// Its documentation.
            #[cfg(feature = "toml")]
            pub(crate) const fn about(self) -> &'static str {
                match self {
                    $(Self::$scene => concat!($($doc),*),)*
                }
            }

            /// The one whose scene is called `name`.
            #[must_use]
            pub fn named(name: &str) -> Option<Self> {
                Self::ALL.into_iter().find(|kind| kind.name() == name)
            }
        }
    };
}
pub(crate) use scenes;

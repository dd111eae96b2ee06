//! Names of enums without fields, in one table per enum, and the order of stages.

/// Defines `ALL`, `name`, `Display` and `FromStr` of an enum from a table of its variants and their names.
///
/// The literal after the type, such as `"a stage"`, appears in the error of `FromStr`: `"fitt" is not a stage (fit,
/// depth, normalize, register)`.
#[macro_export]
macro_rules! enum_names {
    ($vis:vis $type:ident, $noun:literal: $($variant:ident = $name:literal),+ $(,)?) => {
        impl $type {
            /// Every variant, in order.
            $vis const ALL: [Self; [$($name),+].len()] = [$(Self::$variant),+];

            /// Returns the name in JSON, in the catalog and on the command line.
            $vis const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name),+
                }
            }
        }

        impl std::fmt::Display for $type {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.pad(self.name())
            }
        }

        impl std::str::FromStr for $type {
            type Err = String;

            fn from_str(text: &str) -> Result<Self, Self::Err> {
                match text {
                    $($name => Ok(Self::$variant),)+
                    _ => {
                        let found = $crate::domain::spelling::quoted(text);
                        Err(format!("{found} is not {} ({})", $noun, [$($name),+].join(", ")))
                    }
                }
            }
        }
    };
}

/// Defines the processing order of an enum of stages whose variants are in this order, with `index`, `from_index` and
/// `next`.
macro_rules! stage_order {
    ($type:ident) => {
        impl $type {
            /// Number of stages.
            pub const COUNT: usize = Self::ALL.len();

            /// Returns the position of the stage in the processing order, from 0. A job's cursor is the index of its
            /// next stage.
            pub const fn index(self) -> usize {
                self as usize
            }

            /// Returns the stage at a cursor; `None` after the last stage.
            pub fn from_index(index: usize) -> Option<Self> {
                Self::ALL.get(index).copied()
            }

            /// Returns the next stage, or `None` after the last.
            pub fn next(self) -> Option<Self> {
                Self::from_index(self.index() + 1)
            }
        }
    };
}

pub use enum_names;
pub(crate) use stage_order;

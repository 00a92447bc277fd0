//! Names of choices, as the command line, files and Python give them.

/// A choice among values that have names. The tool, scene files and Python share these names.
///
/// ```
/// use tesdf::base::Named;
/// use tesdf::encode::Preset;
///
/// assert_eq!(Preset::SampledSafe.name(), "sampled-safe");
/// assert_eq!("fast".parse(), Ok(Preset::Fast));
/// assert!("slow".parse::<Preset>().is_err_and(|e| e.starts_with("expected default, fast,")));
/// ```
pub trait Named: Copy + PartialEq + Send + Sync + 'static {
    /// All values, in the order in which they are listed for people.
    const ALL: &'static [Self];

    /// The name.
    fn name(self) -> &'static str;

    /// What it means, in one line without a full stop.
    fn meaning(self) -> &'static str;

    /// The value of a name.
    fn of_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|value| value.name() == name)
    }

    /// All names, each within `quote`, such as `cell, face or minimum`.
    fn names(quote: &str) -> String {
        let names: Vec<String> =
            Self::ALL.iter().map(|value| format!("{quote}{}{quote}", value.name())).collect();
        match names.split_last() {
            Some((last, rest)) if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
            _ => names.concat(),
        }
    }
}

/// Gives the variants of an enum their names and meanings: [`Named`], `FromStr` and `Display`.
#[doc(hidden)]
#[macro_export]
macro_rules! named {
    ($choice:ident { $($variant:ident: $name:literal, $meaning:literal;)+ }) => {
        impl $crate::base::Named for $choice {
            const ALL: &'static [Self] = &[$(Self::$variant),+];

            fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name),+
                }
            }

            fn meaning(self) -> &'static str {
                match self {
                    $(Self::$variant => $meaning),+
                }
            }
        }

        impl ::std::fmt::Display for $choice {
            fn fmt(&self, f: &mut ::std::fmt::Formatter<'_>) -> ::std::fmt::Result {
                f.write_str(<Self as $crate::base::Named>::name(*self))
            }
        }

        impl ::std::str::FromStr for $choice {
            type Err = String;

            /// The value of a name. The error lists all names.
            fn from_str(name: &str) -> Result<Self, String> {
                <Self as $crate::base::Named>::of_name(name)
                    .ok_or_else(|| format!("expected {}", <Self as $crate::base::Named>::names("")))
            }
        }
    };
}

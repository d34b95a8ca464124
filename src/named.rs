//! Enumerations whose variants have fixed names.

/// Display and parsing of an enumeration by its `ALL` and its `name()`; the error of parsing lists
/// the names.
///
/// - The type has a constant array `ALL` of every variant and a method `name(self) -> &'static str`.
/// - The literal says what it is, as [`Error::UnknownName`](crate::Error::UnknownName) needs it for its sentence.
///
/// ```
/// #[derive(Clone, Copy, Debug, PartialEq)]
/// enum Side { Left, Right }
///
/// impl Side {
///     const ALL: [Self; 2] = [Self::Left, Self::Right];
///
///     fn name(self) -> &'static str {
///         match self { Self::Left => "left", Self::Right => "right" }
///     }
/// }
///
/// lobes::named!(Side, "side");
///
/// assert_eq!("left".parse::<Side>().unwrap(), Side::Left);
/// assert_eq!(Side::Right.to_string(), "right");
/// assert!("up".parse::<Side>().unwrap_err().to_string().contains("left"));
/// ```
#[macro_export]
macro_rules! named {
    ($type:ty, $what:literal) => {
        impl std::fmt::Display for $type {
            fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                formatter.pad(self.name())
            }
        }

        impl std::str::FromStr for $type {
            type Err = $crate::Error;

            fn from_str(name: &str) -> $crate::Result<Self> {
                let mut all = Self::ALL.into_iter();
                all.find(|one| one.name() == name)
                    .ok_or_else(|| $crate::Error::UnknownName {
                        what: $what,
                        name: name.to_owned(),
                        names: Self::ALL.map(|one| one.name().to_owned()).into(),
                    })
            }
        }
    };
}

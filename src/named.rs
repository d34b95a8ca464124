//! Enums whose variants have fixed names.

/// Display and parsing of an enum by its `ALL` and its `name()`; the error of parsing lists the names.
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

pub(crate) use named;

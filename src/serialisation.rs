//! The feature `serde`: what is kept in files, and checked when it is read as its constructor checks
//! it.
//!
//! A type whose constructor refuses some values is deserialised by way of its plain fields
//! (`#[serde(try_from = …)]`), so that no file builds what no program can.

/// Serialises an enumeration of fixed names, as [`named!`](crate::named) describes them, by its
/// name.
macro_rules! by_name {
    ($type:ty) => {
        #[cfg(feature = "serde")]
        impl serde::Serialize for $type {
            fn serialize<S: serde::Serializer>(
                &self,
                serializer: S,
            ) -> std::result::Result<S::Ok, S::Error> {
                serializer.serialize_str(self.name())
            }
        }

        #[cfg(feature = "serde")]
        impl<'de> serde::Deserialize<'de> for $type {
            fn deserialize<D: serde::Deserializer<'de>>(
                deserializer: D,
            ) -> std::result::Result<Self, D::Error> {
                let name = String::deserialize(deserializer)?;
                name.parse().map_err(serde::de::Error::custom)
            }
        }
    };
}

pub(crate) use by_name;

//! The relief of a configuration: the parameters that are replaced together when another relief is chosen.

use super::SurfaceConfig;
use crate::height_field::{Fill, Level, Preset};
use crate::table::Tiling;
use std::path::PathBuf;

/// Defines [`ReliefSource`] from one list of fields: the struct, its names, and the conversions from and to a
/// [`SurfaceConfig`].
macro_rules! relief_source {
    ($($name:ident: $type:ty,)+) => {
        /// The parameters of a [`SurfaceConfig`] that name the heights and how they are read. Each is documented at the
        /// configuration's field of the same name.
        ///
        /// ```
        /// use sunbeam::config::{ReliefSource, SurfaceConfig};
        /// use sunbeam::Preset;
        ///
        /// let mut config = SurfaceConfig::from_json(r#"{"preset": "blazed", "period": 2, "coherence_length": 20}"#)?;
        /// assert_eq!(config.relief_source().given().collect::<Vec<_>>(), ["preset", "period"]);
        ///
        /// // Another relief: the grating's period is dropped, the coherence length is kept.
        /// config.set_relief_source(ReliefSource { preset: Some(Preset::Cd), ..ReliefSource::default() });
        /// assert_eq!((config.period, config.coherence_length), (None, 20.0));
        /// # Ok::<(), sunbeam::config::ConfigError>(())
        /// ```
        #[derive(Clone, Debug, Default, PartialEq)]
        #[allow(missing_docs, reason = "documented at the fields of `SurfaceConfig`")]
        pub struct ReliefSource {
            $(pub $name: Option<$type>,)+
        }

        impl ReliefSource {
            /// Names of all fields, which are those of the users' interfaces.
            pub const NAMES: &'static [&'static str] = &[$(stringify!($name)),+];

            /// Names of the fields that are given.
            pub fn given(&self) -> impl Iterator<Item = &'static str> + use<> {
                let fields = [$((stringify!($name), self.$name.is_some())),+];
                fields.into_iter().filter_map(|(name, given)| given.then_some(name))
            }
        }

        impl SurfaceConfig {
            /// The relief's parameters, as given.
            pub fn relief_source(&self) -> ReliefSource {
                ReliefSource { $($name: self.$name.clone()),+ }
            }

            /// Replaces all of the relief's parameters. Those that `source` leaves out become `None`.
            pub fn set_relief_source(&mut self, source: ReliefSource) {
                $(self.$name = source.$name;)+
            }
        }
    };
}

relief_source! {
    preset: Preset,
    period: f64,
    height: f64,
    region_size: f64,
    region_spread: f64,
    filename: PathBuf,
    pixel_size: f64,
    max_height: f64,
    channel: String,
    fill: Fill,
    level: Level,
    tiling: Tiling,
}

impl ReliefSource {
    /// Names of the fields that also apply to heights from an array ([`SurfaceConfig::validate_for_array`]).
    pub(super) const OF_ARRAYS: [&'static str; 3] = ["fill", "level", "tiling"];
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn relief_source_round_trips_through_a_configuration() {
        let json = r#"{"filename": "a.gsf", "pixel_size": 0.1, "max_height": 1, "channel": 2, "fill": "mean",
            "level": "plane", "tiling": "periodic"}"#;
        let config = SurfaceConfig::from_json(json).unwrap();
        let mut other = SurfaceConfig { period: Some(2.0), ..SurfaceConfig::default() };
        other.set_relief_source(config.relief_source());
        assert_eq!(other, config);
    }

    #[test]
    fn given_fields_have_the_names_of_the_users_interfaces() {
        let config = SurfaceConfig::from_json(r#"{"preset": "blazed", "height": 0.2, "tiling": "periodic"}"#).unwrap();
        assert!(config.relief_source().given().eq(["preset", "height", "tiling"]));
        let json = serde_json::to_value(&config).unwrap();
        assert!(config.relief_source().given().all(|name| json.get(name).is_some()));
    }
}

//! Keys of the data that the page keeps: heights, the method's data, mesh and pigment.

use super::Settings;
use super::json::serialised;
use serde::Serialize;
use sunbeam::config::{ReliefSource, SurfaceConfig};
use sunbeam_realtime::Shape;

/// Keys of the data that the page keeps: text that changes whenever the data have to be built again. Its contents have
/// no other meaning.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Keys {
    /// Key of the heights.
    pub relief: String,
    /// Key of the method's data.
    pub method: String,
    /// Key of mesh and pigment.
    pub scene: String,
}

impl Settings {
    /// Keys of the relief, the method's data and the scene for these settings.
    pub fn keys(&self) -> Keys {
        let config = self.config();
        // Heights do not depend on the tiling. `level` names what is subtracted from a scan's heights. It is always
        // written, so that a missing `level` and its explicit default have the same key.
        let mut relief = SurfaceConfig::default();
        relief.set_relief_source(ReliefSource { level: Some(config.level()), tiling: None, ..config.relief_source() });
        // Factors on the relief's widths and heights, which its source does not have.
        (relief.scale, relief.depth) = (config.scale, config.depth);
        let mut method = config;
        if method.conserve_energy != Some(true) {
            // Without energy conservation the tables do not depend on the index, except those of a film, whose relief
            // is magnified by it. Evaluators take other indices, with their obliquity factors, later (`set_index`).
            (method.eta, method.k) = (method.body().map(|body| body.eta), None);
        }
        Keys {
            relief: serialised(&relief),
            method: format!("{} {} {}", self.method, serialised(&self.options), serialised(&method)),
            scene: match self.shape {
                Shape::Snake => format!("{} {}", self.shape.name(), self.resolution),
                Shape::Flat | Shape::Sphere => self.shape.name().to_owned(),
            },
        }
    }
}

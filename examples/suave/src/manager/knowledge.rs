//! Knowledge of the managing loop.
//! Designs of the functions, and the camera's requirements to see the pipeline.

use slate_plugin::prelude::*;

use crate::interfaces::FunctionDesigns;

/// Requirements of a search.
#[interface]
#[derive(PartialEq)]
pub struct SearchModel {
    /// Height of the pipeline above the seabed; NaN if it is not known.
    #[unit("m")]
    pub pipeline_height: f64,
    /// Visibility beyond the distance to the pipeline.
    #[unit("m")]
    pub visibility_margin: f64,
    /// Vertical speed of the vehicle.
    #[unit("m/s")]
    pub vertical_speed: f64,
}

impl SearchModel {
    /// Returns the visibility that a search needs at an altitude, meters.
    /// The given one while the height of the pipeline is not known.
    pub fn visibility(&self, altitude: f64, given: f64) -> f64 {
        let needed = altitude - self.pipeline_height + self.visibility_margin;
        if needed.is_finite() { needed } else { given }
    }
}

/// Facts of the knowledge.
#[ports]
pub struct ManagerModels {
    /// Designs, from the configuration.
    known_designs: Required<FunctionDesigns>,
    /// Designs of the functions.
    designs: Output<FunctionDesigns>,
    /// Requirements of a search.
    search: Output<SearchModel>,
}

/// Parameters of the knowledge.
#[params]
pub struct ManagerKnowledgeParams {
    #[param(
        default = true,
        doc = "derive the visibility that a search needs from the height of the pipeline, not from the designs"
    )]
    knows_pipeline: Bool,
    #[param(default = 0.5, range = 0.0..=10.0, unit = "m", doc = "height of the pipeline above the seabed")]
    pipeline_height: f64,
    #[param(default = 0.1, range = 0.0..=10.0, unit = "m", doc = "visibility beyond the distance to the pipeline")]
    visibility_margin: f64,
    #[param(default = 0.3, range = 0.01..=5.0, unit = "m/s", doc = "vertical speed of the vehicle")]
    vertical_speed: f64,
}

/// Knowledge of the functions' designs, the pipeline and the vehicle.
pub struct ManagerKnowledge;

impl Knowledge for ManagerKnowledge {
    const NAME: &'static str = "suave_knowledge";
    const DOC: &'static str =
        "Knows the designs of the vehicle's functions, and the requirements of a search.";
    type Models = ManagerModels;
    type Params = ManagerKnowledgeParams;
    type State = ();

    fn update(_: &mut (), models: &ManagerModels, params: &ManagerKnowledgeParams, _: &Tick) {
        models.designs.set(*models.known_designs);
        models.search.set(SearchModel {
            pipeline_height: if params.knows_pipeline.get() { params.pipeline_height } else { f64::NAN },
            visibility_margin: params.visibility_margin,
            vertical_speed: params.vertical_speed,
        });
    }
}

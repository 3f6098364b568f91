//! Standing still.

use serde::{Deserialize, Serialize};
use slate_plugin::prelude::*;

use crate::body::NavigationBody;

/// Stops for a duration, the argument, s.
#[derive(Serialize, Deserialize)]
pub struct Halt {
    left: f64,
}

impl ActionKind for Halt {
    const KIND: &'static str = "Halt";
    type Arguments = f64;

    fn start(duration: f64) -> Self {
        Self { left: duration }
    }
}

impl Action<NavigationBody> for Halt {
    fn act(&mut self, acting: &Acting<'_, NavigationBody>) -> Step {
        if self.left <= 0.0 {
            return Step::Done;
        }
        self.left -= acting.now.elapsed();
        acting.body.stand(acting.priority);
        Step::Running
    }
}

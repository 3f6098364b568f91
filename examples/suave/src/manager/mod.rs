//! Managers of the vehicle: each chooses the designs of its functions.
//!
//! | strategy | manager |
//! |---|---|
//! | `none` | [`unmanaged`]: the functions of each task, always in the same design |
//! | `random` | [`random`]: another design every 15 s |
//! | `metacontrol` | [`metacontrol`]: the published rules |
//! | `slate` | blocks of MAPE-K: [`health`], [`outlook`], [`plan`], [`actions`] around [`knowledge`] |

pub mod actions;
pub mod health;
pub mod knowledge;
pub mod metacontrol;
pub mod outlook;
pub mod plan;
pub mod random;
pub mod unmanaged;

use serde::{Deserialize, Serialize};
use slate_plugin::module::aspect::{Aspect, Settings};
use slate_plugin::prelude::*;

use crate::interfaces::{Function, FunctionDesigns, VehicleTask};

/// Designs of the functions, as a manager has set them.
#[derive(Clone, Default, Serialize, Deserialize)]
pub struct Groundings {
    /// Place of the present design of each function of [`Function::ALL`].
    places: [Option<usize>; 3],
    /// Task that they are for.
    task: Option<VehicleTask>,
}

impl Groundings {
    /// Returns the place of a function's present design.
    fn of(&self, function: Function) -> Option<usize> {
        Function::ALL.iter().position(|known| *known == function).and_then(|at| self.places[at])
    }

    /// Sets a function's design, unless it has that one.
    fn set(
        &mut self,
        function: Function,
        place: usize,
        designs: &FunctionDesigns,
        settings: &Aspect<Settings>,
        now: &Tick,
    ) {
        let Some(at) = Function::ALL.iter().position(|known| *known == function) else { return };
        if self.places[at].replace(place) == Some(place) {
            return;
        }
        now.log_with(
            slate_plugin::module::Level::Info,
            format_args!("manager: other design"),
            &[("function", function.name().into()), ("design", designs.name(place).into())],
        );
        settings.change(designs.changes(place));
    }

    /// Turns the previous task's functions off when the task has changed.
    /// Returns true if it has.
    fn begin(
        &mut self,
        task: VehicleTask,
        designs: &FunctionDesigns,
        settings: &Aspect<Settings>,
        now: &Tick,
    ) -> bool {
        let before = self.task.replace(task);
        if before == Some(task) {
            return false;
        }
        for function in Function::ALL {
            if before.is_some_and(|before| function.serves(before))
                && let Some(off) = designs.off(function)
            {
                self.set(function, off, designs, settings, now);
            }
        }
        true
    }
}

//! Behavior engine in Lua: skills as hybrid state machines, and agents above them.
//!
//! [`SkillFiles`] names the files of a mission and [`BehaviorEngine`] executes them tick by tick: a
//! [`BehaviorHost`] performs the actions and answers the conditions. [`check_machines`] finds defects before it runs.
//! None of them needs an agent. Time is passed in; nothing reads a clock.
//!
//! Skill files have the API of Fawkes's: `SkillHSM`, `JumpState`, `SkillJumpState`, `SubFSMJumpState`,
//! `define_states`, `add_transitions`, `depends_skills`, `depends_interfaces`, predicates, `AgentHSM`. Two things are
//! Slate's: `depends_actions` names actions of the robot, and `interface{...}` in a file `interfaces.lua` names the
//! interfaces that skills depend on.
//!
//! Scripts run in a sandbox: no `io`, no processes, no clock but the host's, `require` within the folder of the
//! mission; operations of a tick and memory have [limits](BehaviorLimits). The order of `pairs` is fixed, and texts
//! of tables have no address, so that a run depends on its inputs alone.
//!
//! ```
//! use slate_behavior::*;
//!
//! /// A robot whose actions take a tick.
//! struct Robot(Vec<String>);
//!
//! impl BehaviorHost for Robot {
//!     fn condition(&mut self, _: &str) -> Option<bool> {
//!         Some(true)
//!     }
//!     fn start(&mut self, _: usize, action: &BehaviorAction, arguments: &[f64]) -> Result<(), String> {
//!         self.0.push(format!("{} {arguments:?}", action.kind));
//!         Ok(())
//!     }
//!     fn progress(&mut self, _: usize) -> BehaviorProgress {
//!         BehaviorProgress::Succeeded
//!     }
//!     fn stop(&mut self, _: usize) {}
//!     fn random(&mut self) -> u64 {
//!         4
//!     }
//!     fn log(&mut self, _: ScriptLevel, _: &str) {}
//! }
//!
//! let skill = r#"
//!     module(..., skillenv.module_init)
//!     name = "visit"
//!     documentation = "Goes to a place once the robot is localized."
//!     depends_actions = {{v = "go_to", kind = "GoToOrigin", arguments = {"x", "y"}}}
//!     skillenv.skill_module(_M)
//!     fsm = SkillHSM:new{name = name, start = "WAIT"}
//!     fsm:define_states{export_to = _M,
//!         {"WAIT", JumpState},
//!         {"GO", SkillJumpState, skills = {{go_to}}, final_to = "FINAL", fail_to = "FAILED"}}
//!     fsm:add_transitions{{"WAIT", "GO", cond = "conditions.localized"}, {"GO", "FAILED", timeout = 30}}
//!     function GO:init() self.args.go_to = {x = self.fsm.vars.x, y = 0.5} end
//! "#;
//! let files = SkillFiles::from_texts("visit", &[("visit", skill)]);
//! let mut engine = BehaviorEngine::load(&files, "visit{x = 1.4}", BehaviorLimits::default())?;
//! let mut robot = Robot(Vec::new());
//! assert_eq!(engine.tick(0, &mut robot)?, BehaviorStatus::Running);
//! assert_eq!(engine.tick(20_000_000, &mut robot)?, BehaviorStatus::Succeeded);
//! assert_eq!(robot.0, ["GoToOrigin [1.4, 0.5]"]);
//! # Ok::<(), BehaviorError>(())
//! ```

mod analysis;
mod engine;
mod error;
mod files;
mod host;
mod lua_error;
mod machine;
mod meter;
mod pattern;
mod sandbox;
mod state;

pub use analysis::{MachineFinding, MachineFindingKind, check_machines};
pub use engine::BehaviorEngine;
pub use error::BehaviorError;
pub use files::SkillFiles;
pub use host::{BehaviorAction, BehaviorHost, BehaviorProgress, BehaviorStatus, ScriptLevel};
pub use machine::{MachineState, MachineTransition, SkillMachine};
pub use sandbox::BehaviorLimits;
pub use state::BehaviorState;

#[cfg(doctest)]
#[doc = include_str!("../../../../book/src/43-skills-in-lua.md")]
mod book {}

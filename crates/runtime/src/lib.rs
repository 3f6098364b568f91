//! The agent: stages, scheduling, clock, configuration, logging.
//!
//! A [`Configuration`](configuration::Configuration) says which modules there are and how they are linked; an
//! [`Agent`] makes them and runs them. Either everything fits and starts, or nothing does and every misfit is shown
//! with file, line and caret.
#![allow(unsafe_code, reason = "modules run behind a table of calls, over memory of the host")]

mod actuators;
mod agent;
mod aspects;
mod background;
mod clock;
mod digest;
pub mod isolation;
pub mod log;
mod main_loop;
pub mod memory;
pub mod playback;
pub mod plugin;
pub mod recording;
pub mod remote;
mod runner;
pub mod sharing;
pub mod snapshot;
pub mod synchronization;
pub mod timing;

pub use agent::{
    Agent, Composer, ControlsError, ControlsHolder, LinkStatus, Loaded, Mode, ModuleStatus, NewLink, Options,
    PluginError, PluginStatus, Reload, StartError, Stopper, SystemClock, Teleoperation, WeakComposer,
};
pub use background::give_way;
pub use clock::{Calendar, RecordedTimes, TimeSource};
pub use main_loop::{AgentTrace, Control, Cycle, End, LoopPolicy, Observer, Place, Rate, STAGE_LIMIT};
pub use slate_configuration as configuration;
pub use slate_configuration::{
    Message, Mistake, Schedule, ScheduleError, ScheduledStage, printable, printable_text, replacement,
};
pub use slate_module::Stage;

//! Agent and aspects: the union of configuration, composition and engine.
//!
//! A [`Configuration`](configuration::Configuration) defines the modules and their links; an
//! [`Agent`] makes and runs them. Either everything fits and starts, or nothing does and every misfit is reported
//! with file, line and caret.
#![allow(unsafe_code, reason = "modules run behind a table of calls, over memory of the host")]

mod agent;
mod aspects;
mod delivery;
pub mod directory;
pub mod memory;
pub mod playback;
pub mod recording;
pub mod sharing;
pub mod snapshot;
pub mod stop_line;

pub use agent::{
    Agent, CommandError, Composer, ControlsError, ControlsHolder, CycleEnd, ExternalContent, ExternalValue,
    LinkStatus, Loaded, Mode, ModuleStatus, NewLink, Options, PluginError, PluginStatus, Reload, RemoteEnd,
    StartError, Stopper, SystemClock, Teleoperation, ValueWait, WeakComposer, catalogue, check_start,
};
pub use delivery::ExternalDelivery;
pub use slate_composition as composition;
pub use slate_composition::{ExternalInputError, ExternalPorts, PropertyFacts, PropertyIndex};
pub use slate_configuration as configuration;
pub use slate_configuration::{
    ErrorCode, Message, Schedule, ScheduleError, ScheduledStage, printable, printable_text, replacement,
};
pub use slate_engine::clock::{Calendar, RecordedTimes, TimeSource};
pub use slate_engine::main_loop::{
    AgentTrace, Control, Cycle, End, LoopPolicy, LoopPosition, Observer, Rate, STAGE_LIMIT,
};
pub use slate_engine::{isolation, log, plugin, set_batch_scheduling, synchronization, timing};
pub use slate_module::Stage;

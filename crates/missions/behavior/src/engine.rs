//! Execution of a mission, tick by tick.

use mlua::{Function, Lua, Table, Value};

use crate::error::BehaviorError;
use crate::files::SkillFiles;
use crate::host::{BehaviorAction, BehaviorHost, BehaviorProgress, BehaviorStatus, NoRobot, ScriptLevel};
use crate::lua_error::{behavior_error, is_out_of_memory};
use crate::machine::{self, SkillMachine};
use crate::sandbox::{BehaviorLimits, Sandbox};
use crate::state::BehaviorState;

/// Operations of loading, for each one of a tick.
const LOADING: u32 = 10;

/// Empty call, which needs no skill.
const OUTLINE: &str = "return";

/// Memory above the limit for the report about it, bytes.
const RESERVE: usize = 1 << 20;

/// Execution of a mission in Lua.
#[derive(Debug)]
pub struct BehaviorEngine {
    files: SkillFiles,
    limits: BehaviorLimits,
    sandbox: Sandbox,
    enter: Function,
    tick: Function,
    actions: Vec<BehaviorAction>,
    machines: Vec<SkillMachine>,
    status: BehaviorStatus,
    /// True if the newest tick has changed a state.
    is_changed: bool,
    /// Number of ticks and jumps that have changed a state.
    changes: u64,
    /// Error of a tick, after which the mission can't continue.
    failure: Option<BehaviorError>,
}

impl BehaviorEngine {
    /// Loads a mission.
    /// `call` is one of its skills with arguments, or empty for the skill of the main file.
    ///
    /// # Errors
    /// If a file can't be read, has wrong syntax, or names what does not exist.
    pub fn load(files: &SkillFiles, call: &str, limits: BehaviorLimits) -> Result<Self, BehaviorError> {
        Self::load_mission(files, call, limits).map_err(|error| match is_out_of_memory(&error) {
            true => BehaviorError::new(format!(
                "the files use more than {} bytes of memory; expected less",
                limits.memory
            )),
            false => behavior_error(&error, files),
        })
    }

    /// Loads a mission for its outline.
    /// The main file may be one that only loads skills.
    ///
    /// # Errors
    /// Those of [`load`](Self::load).
    pub fn load_outline(files: &SkillFiles, limits: BehaviorLimits) -> Result<Self, BehaviorError> {
        Self::load(files, OUTLINE, limits)
    }

    fn load_mission(files: &SkillFiles, call: &str, limits: BehaviorLimits) -> mlua::Result<Self> {
        let sandbox = Sandbox::new(files, limits)?;
        let enter = sandbox.function("enter")?;
        let operations = limits.operations.saturating_mul(LOADING);
        let load = sandbox.function("load_mission")?;
        sandbox.lua().scope(|scope| {
            let dispatch =
                scope.create_function_mut(|lua, call: HostCall| dispatch(lua, &[], &mut NoRobot, call))?;
            enter.call::<()>((load, dispatch, 0, operations, files.main(), call))
        })?;
        let names = sandbox.function("action_names")?.call::<Table>(())?;
        let action = |names: mlua::Result<Table>| {
            let names = names?;
            Ok(BehaviorAction { owner: names.get(1)?, name: names.get(2)?, kind: names.get(3)? })
        };
        Ok(Self {
            files: files.clone(),
            limits,
            actions: names.sequence_values().map(action).collect::<mlua::Result<_>>()?,
            machines: machine::read(&sandbox.function("outline")?.call(())?)?,
            tick: sandbox.function("tick")?,
            sandbox,
            enter,
            status: BehaviorStatus::Running,
            is_changed: false,
            changes: 0,
            failure: None,
        })
    }

    /// Returns the name of the main file.
    pub fn name(&self) -> &str {
        self.files.main()
    }

    /// Returns the actions that its skills perform.
    pub fn actions(&self) -> &[BehaviorAction] {
        &self.actions
    }

    /// Returns the state machines, in the order of their definition.
    pub fn machines(&self) -> &[SkillMachine] {
        &self.machines
    }

    /// Returns the status of the newest tick.
    pub fn status(&self) -> BehaviorStatus {
        self.status
    }

    /// Returns true if the newest tick has changed a state.
    pub fn is_changed(&self) -> bool {
        self.is_changed
    }

    /// Runs each skill that is active once, at a time in nanoseconds.
    ///
    /// A mission that has ended stays so.
    ///
    /// # Errors
    /// If a script uses more than its limits, or a machine can't continue. The mission can't continue either.
    pub fn tick(&mut self, now: u64, host: &mut dyn BehaviorHost) -> Result<BehaviorStatus, BehaviorError> {
        if let Some(failure) = &self.failure {
            return Err(failure.clone());
        }
        self.is_changed = false;
        if self.status != BehaviorStatus::Running {
            return Ok(self.status);
        }
        match self.run_tick(now, host) {
            Ok((status, is_changed)) => {
                (self.status, self.is_changed) = (status, is_changed);
                if is_changed {
                    self.changes = self.count_changes();
                }
            }
            Err(error) => {
                let error = self.failure_of(&error);
                self.failure = Some(error.clone());
                return Err(error);
            }
        }
        Ok(self.status)
    }

    /// Returns the error of a tick, which names the states that use too much memory.
    fn failure_of(&self, error: &mlua::Error) -> BehaviorError {
        if !is_out_of_memory(error) {
            return behavior_error(error, &self.files);
        }
        let limit = self.limits.memory;
        // The names need some, too.
        let _ = self.sandbox.lua().set_memory_limit(limit.saturating_add(RESERVE));
        let active = self.active();
        BehaviorError::new(format!(
            "the scripts use more than {limit} bytes of memory in {active}; expected less"
        ))
    }

    fn run_tick(&self, now: u64, host: &mut dyn BehaviorHost) -> mlua::Result<(BehaviorStatus, bool)> {
        let (status, is_changed): (i64, bool) = self.sandbox.lua().scope(|scope| {
            let actions = &self.actions;
            let dispatch =
                scope.create_function_mut(move |lua, call: HostCall| dispatch(lua, actions, host, call))?;
            self.enter.call((&self.tick, dispatch, time(now), self.limits.operations))
        })?;
        Ok((status_of(status), is_changed))
    }

    /// Returns machines and their states that run, such as `patrol/DRIVE, visit/GO`.
    pub fn active(&self) -> String {
        self.sandbox.function("active").and_then(|active| active.call(())).unwrap_or_default()
    }

    /// Returns the reason of the mission's failure; empty for none.
    pub fn reason(&self) -> String {
        self.sandbox.function("failure").and_then(|failure| failure.call(())).unwrap_or_default()
    }

    /// Returns the index of the state that each machine is in.
    pub fn current_states(&self) -> Vec<Option<usize>> {
        let list = || -> mlua::Result<Vec<usize>> {
            let list: Table = self.sandbox.function("current_states")?.call(())?;
            list.sequence_values().collect()
        };
        list().unwrap_or_default().into_iter().map(|place| place.checked_sub(1)).collect()
    }

    /// Returns the number of ticks and jumps that have changed a state.
    /// It includes those before a restoration.
    pub fn changes(&self) -> u64 {
        self.changes
    }

    fn count_changes(&self) -> u64 {
        self.sandbox.function("changes").and_then(|changes| changes.call(())).unwrap_or_default()
    }

    /// Forces a running machine into a state, as by a transition.
    /// It leaves its state and enters the other one.
    ///
    /// Machine and state are indices of [`machines`](Self::machines). Returns `false` if the machine does not run.
    ///
    /// # Errors
    /// Those of [`tick`](Self::tick).
    pub fn jump(
        &mut self,
        machine: usize,
        state: usize,
        now: u64,
        host: &mut dyn BehaviorHost,
    ) -> Result<bool, BehaviorError> {
        if let Some(failure) = &self.failure {
            return Err(failure.clone());
        }
        if self.status != BehaviorStatus::Running {
            return Ok(false);
        }
        let jumped = self.run_jump(machine, state, now, host).map_err(|error| {
            let error = self.failure_of(&error);
            self.failure = Some(error.clone());
            error
        });
        self.changes = self.count_changes();
        jumped
    }

    fn run_jump(
        &self,
        machine: usize,
        state: usize,
        now: u64,
        host: &mut dyn BehaviorHost,
    ) -> mlua::Result<bool> {
        let jump = self.sandbox.function("jump")?;
        self.sandbox.lua().scope(|scope| {
            let actions = &self.actions;
            let dispatch =
                scope.create_function_mut(move |lua, call: HostCall| dispatch(lua, actions, host, call))?;
            let operations = self.limits.operations;
            self.enter.call((jump, dispatch, time(now), operations, machine + 1, state + 1))
        })
    }

    /// Returns the state, for [`restore`](Self::restore).
    ///
    /// # Errors
    /// If a variable has something that is not plain data, such as a function.
    pub fn state(&self) -> Result<BehaviorState, BehaviorError> {
        let save = || BehaviorState::read(&self.sandbox.function("save")?.call(())?);
        save().map_err(|error| behavior_error(&error, &self.files))
    }

    /// Loads a mission and continues from a saved state.
    /// The state may be that of other files with the same states.
    ///
    /// # Errors
    /// Those of [`load`](Self::load), and if a state that runs does not exist any more.
    pub fn restore(
        files: &SkillFiles,
        call: &str,
        limits: BehaviorLimits,
        state: &BehaviorState,
    ) -> Result<Self, BehaviorError> {
        let mut engine = Self::load(files, call, limits)?;
        let sandbox = &engine.sandbox;
        let restore = || {
            sandbox.function("restore")?.call::<()>(state.write(sandbox.lua())?)?;
            sandbox.function("status")?.call(())
        };
        let status = restore().map_err(|error| behavior_error(&error, files))?;
        engine.status = status_of(status);
        engine.changes = engine.count_changes();
        Ok(engine)
    }
}

/// Converts a time to Lua's signed numbers; nanoseconds fit for 292 years.
fn time(now: u64) -> i64 {
    i64::try_from(now).unwrap_or(i64::MAX)
}

fn status_of(status: i64) -> BehaviorStatus {
    match status {
        1 => BehaviorStatus::Succeeded,
        3 => BehaviorStatus::Failed,
        _ => BehaviorStatus::Running,
    }
}

/// Number of a function of the host, and its arguments.
type HostCall = (i64, Value, Value);

/// Calls a function of the host by its number in `prelude/host.lua`.
fn dispatch(
    lua: &Lua,
    actions: &[BehaviorAction],
    host: &mut dyn BehaviorHost,
    (function, one, two): HostCall,
) -> mlua::Result<Value> {
    let index = || one.as_integer().and_then(|index| usize::try_from(index).ok()).unwrap_or(usize::MAX);
    Ok(match function {
        1 => {
            host.log(level(&one), &two.to_string()?);
            Value::Nil
        }
        2 => host.condition(&one.to_string()?).map_or(Value::Nil, Value::Boolean),
        3 => {
            let numbers = two.as_table().map(|numbers| numbers.sequence_values().collect());
            let numbers: Vec<f64> = numbers.unwrap_or_else(|| Ok(Vec::new()))?;
            let started = match actions.get(index()) {
                Some(action) => host.start(index(), action, &numbers),
                None => Err("actions start when the mission runs, not while its files are loaded".into()),
            };
            match started {
                Ok(()) => Value::Nil,
                Err(reason) => Value::String(lua.create_string(&reason)?),
            }
        }
        4 => Value::Integer(match host.progress(index()) {
            BehaviorProgress::Running => 0,
            BehaviorProgress::Succeeded => 1,
            BehaviorProgress::Failed => 2,
            BehaviorProgress::Preempted => 3,
        }),
        5 => {
            host.stop(index());
            Value::Nil
        }
        // The bits of both kinds of number are the same.
        _ => Value::Integer(host.random().cast_signed()),
    })
}

fn level(name: &Value) -> ScriptLevel {
    let is = |level: &str| name.as_string().is_some_and(|name| *name == level);
    match () {
        () if is("debug") => ScriptLevel::Debug,
        () if is("warn") => ScriptLevel::Warning,
        () if is("error") => ScriptLevel::Error,
        () => ScriptLevel::Information,
    }
}

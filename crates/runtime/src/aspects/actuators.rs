//! Aspect [`Actuators`]: commands to actuators chosen at run time.

use std::cell::UnsafeCell;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use slate_module::Priority;
use slate_module::aspect::{ActuatorState, Actuators};
use slate_module::table::{Bytes, DONE, REFUSED, Sink};
use slate_sorted::SortedMap;

use super::calls::{self, say};
use super::{HostService, ServiceContext, in_place};
use slate_engine::actuators::{Actuator, ActuatorList};
use slate_engine::digest::Digest;
use slate_engine::runner::AlignedMemory;

struct ActuatorService {
    /// State of the calls of a tick.
    work: Box<UnsafeCell<ActuatorCalls>>,
    held: Arc<CommandedActuators>,
}

struct ActuatorCalls {
    table: Actuators,
    list: Arc<ActuatorList>,
    module: Arc<str>,
    known: SortedMap<String, KnownActuator>,
    held: Arc<CommandedActuators>,
    now: u64,
}

/// Actuator that the module has named.
struct KnownActuator {
    actuator: Arc<Actuator>,
    /// Number of the module as a commander of the gate, if it may command it.
    commander: Option<u32>,
    /// State of its gate at the last look.
    state: ActuatorState,
    offer: Option<CommandOffer>,
}

/// Commands of a module to an actuator.
struct CommandOffer {
    command: AlignedMemory,
    priority: Priority,
    /// True if this tick has offered a command.
    set: bool,
    /// True if the last tick has offered a command.
    renewed: bool,
}

/// Actuators that the module has commanded.
/// They are kept apart, as they are taken from the module while its tick hangs.
#[derive(Default)]
struct CommandedActuators(Mutex<Vec<(Arc<Actuator>, u32)>>);

impl CommandedActuators {
    fn actuators(&self) -> MutexGuard<'_, Vec<(Arc<Actuator>, u32)>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

// SAFETY: the table's context is the work, which only the thread that runs the module uses; what is used meanwhile is
// behind a lock.
unsafe impl Send for ActuatorService {}

pub(super) fn make(service_context: &ServiceContext, module: &Arc<str>) -> Box<dyn HostService> {
    let held = Arc::<CommandedActuators>::default();
    let work = in_place(|context| {
        UnsafeCell::new(ActuatorCalls {
            // SAFETY: the context is the work, in which the table stays; these are its calls.
            table: unsafe { Actuators::new(context, names, state, stop, offer) },
            list: Arc::clone(&service_context.actuators),
            module: Arc::clone(module),
            known: SortedMap::new(),
            held: Arc::clone(&held),
            now: 0,
        })
    });
    Box::new(ActuatorService { work, held })
}

impl ActuatorService {
    fn work(&mut self) -> &mut ActuatorCalls {
        // SAFETY: the exclusive user of the service is not in the module's tick.
        unsafe { &mut *self.work.get() }
    }
}

impl HostService for ActuatorService {
    fn table(&self) -> *const u8 {
        // SAFETY: only its address is taken.
        unsafe { (&raw const (*self.work.get()).table).cast() }
    }

    fn prepare(&mut self, now: u64) {
        self.work().now = now;
    }

    fn commit(&mut self, now: u64, _: Option<&mut Digest>) {
        let work = self.work();
        // A command is as old as its step, which may have taken long.
        let made = work.now;
        for known in work.known.values_mut() {
            let (Some(offer), Some(commander)) = (&mut known.offer, known.commander) else { continue };
            if offer.set {
                // SAFETY: the memory has that size, and is not shared.
                let command =
                    unsafe { std::slice::from_raw_parts(offer.command.as_ptr(), known.actuator.size()) };
                known.actuator.offer(commander, offer.priority, command, made);
            } else if offer.renewed {
                known.actuator.withdraw(commander, now);
            }
            offer.renewed = std::mem::take(&mut offer.set);
        }
    }

    fn abandon(&mut self) {
        for offer in self.work().known.values_mut().filter_map(|known| known.offer.as_mut()) {
            (offer.set, offer.renewed) = (false, false);
        }
    }

    fn release(&self, now: u64) {
        self.held.actuators().iter().for_each(|(actuator, commander)| actuator.withdraw(*commander, now));
    }
}

impl ActuatorCalls {
    fn known(&mut self, name: &str) -> Result<&mut KnownActuator, String> {
        if !self.known.contains_key(name) {
            // That of the module's own robot first.
            let robot = self.module.rsplit_once('/').map(|(robot, _)| format!("{robot}/{name}"));
            let own = robot.and_then(|name| self.list.get(&name));
            let Some(actuator) = own.or_else(|| self.list.get(name)) else {
                let names = self.list.names();
                let there = if names.is_empty() { "none".into() } else { names.join(", ") };
                return Err(format!("no actuator `{name}`; available: {there}"));
            };
            let commander = actuator.commander(&self.module);
            let known = KnownActuator { actuator, commander, state: ActuatorState::default(), offer: None };
            self.known.insert(name.into(), known);
        }
        self.known.get_mut(name).ok_or_else(|| unreachable!("it was put in"))
    }

    fn state(&mut self, name: &str) -> Result<(ActuatorState, &str), String> {
        let now = self.now;
        let known = self.known(name)?;
        let mut holder = "";
        // While the gate is locked, its last known state is shown.
        if let Some(state) = known.actuator.try_state(now) {
            known.state = ActuatorState {
                reserved: 0,
                mode: state.mode.0.into(),
                priority: state.priority.0.into(),
                is_mine: (state.priority.0 != 0 && known.commander == Some(state.holder)).into(),
            };
            if known.state.is_leased() {
                holder = known.actuator.commander_name(state.holder);
            }
        }
        Ok((known.state, holder))
    }

    fn stop(&mut self, name: &str, reason: &str) -> Result<(), String> {
        let now = self.now;
        let reason = format!("{}: {reason}", self.module);
        if name.is_empty() {
            self.list.all().iter().for_each(|actuator| actuator.stop(&reason, now));
        } else {
            self.known(name)?.actuator.stop(&reason, now);
        }
        Ok(())
    }

    fn offer(&mut self, name: &str, schema: u64, priority: Priority, command: &[u8]) -> Result<(), String> {
        let (module, held) = (Arc::clone(&self.module), Arc::clone(&self.held));
        let known = self.known(name)?;
        let actuator = &known.actuator;
        let Some(commander) = known.commander else {
            return Err(format!(
                "{module} may not command `{name}`: add modules = [\"{module}\"] to [actuators.{name}]"
            ));
        };
        let descriptor = actuator.descriptor();
        if descriptor.hash != schema || command.len() != actuator.size() {
            let (name_of, hash) = (descriptor.name, descriptor.hash);
            return Err(format!("`{name}` takes {name_of} {hash:016x}, not {schema:016x}"));
        }
        let offer = known.offer.get_or_insert_with(|| {
            held.actuators().push((Arc::clone(actuator), commander));
            CommandOffer {
                command: AlignedMemory::zeroed(command.len()),
                priority,
                set: false,
                renewed: false,
            }
        });
        // SAFETY: the memory has that size, and is not shared.
        unsafe { offer.command.as_mut_ptr().copy_from_nonoverlapping(command.as_ptr(), command.len()) };
        (offer.priority, offer.set) = (priority, true);
        Ok(())
    }
}

/// # Safety
/// The sink is as the module made it.
unsafe fn code(sink: *const Sink, result: Result<(), String>) -> i32 {
    let Err(reason) = result else { return DONE };
    // SAFETY: passed on to the caller.
    unsafe { say(sink, &reason) };
    REFUSED
}

unsafe extern "C" fn names(context: *mut (), sink: *const Sink) -> i32 {
    // SAFETY: the context is the work, which the module's tick uses alone; the rest lives during the call.
    unsafe {
        let names = (*context.cast::<ActuatorCalls>()).list.names();
        names.iter().for_each(|name| say(sink, &format!("{name}\n")));
    }
    DONE
}

unsafe extern "C" fn state(
    context: *mut (),
    name: Bytes,
    state: *mut ActuatorState,
    sink: *const Sink,
) -> i32 {
    // SAFETY: as for `names`.
    unsafe {
        let found = (*context.cast::<ActuatorCalls>()).state(calls::name(name)).map(|(found, holder)| {
            state.write(found);
            say(sink, holder);
        });
        code(sink, found)
    }
}

unsafe extern "C" fn stop(context: *mut (), name: Bytes, reason: Bytes, sink: *const Sink) -> i32 {
    // SAFETY: as for `names`.
    unsafe { code(sink, (*context.cast::<ActuatorCalls>()).stop(calls::name(name), calls::name(reason))) }
}

unsafe extern "C" fn offer(
    context: *mut (),
    name: Bytes,
    schema: u64,
    priority: u32,
    command: Bytes,
    sink: *const Sink,
) -> i32 {
    let priority = slate_engine::runner::priority(priority);
    // SAFETY: as for `names`.
    unsafe {
        let offered =
            (*context.cast::<ActuatorCalls>()).offer(calls::name(name), schema, priority, command.as_slice());
        code(sink, offered)
    }
}

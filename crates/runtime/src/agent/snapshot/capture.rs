//! Copies all of an agent while it stands still.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;

use slate_blackboard::message::Mailbox;
use slate_blackboard::{Access, Board, Carrier, Property};
use slate_module::{ModuleKind, PortDescription};

use super::text;
use crate::agent::composition::Composition;
use crate::aspects::TimePlace;
use crate::snapshot::{
    Bytes, FrozenClock, FrozenMailbox, FrozenModule, FrozenPort, FrozenProperty, Keepsake, PluginMark,
    SnapshotError, SnapshotImage,
};
use slate_configuration::{InferredLink, Layered};
use slate_engine::clock::monotonic;
use slate_engine::main_loop::{FrozenLoop, Seat, SharedLoop};

/// How long modules with threads of their own are waited for.
pub(super) const LIMIT: Duration = Duration::from_secs(5);

/// A module of the agent.
#[derive(Clone)]
pub(super) struct SnapshotSubject {
    pub name: String,
    pub kind: String,
    pub seat: Arc<Seat>,
    pub own_thread: bool,
    pub ports: Vec<PortDescription>,
    pub params: u64,
}

/// All that is copied, and what is known of it without looking.
pub(super) struct SnapshotSubjects {
    pub modules: Vec<SnapshotSubject>,
    configuration: String,
    layers: Layered,
    inferred: Vec<InferredLink>,
    outputs: u32,
    time: Arc<TimePlace>,
    keepsakes: BTreeMap<String, Arc<dyn Keepsake>>,
}

/// Seats that are kept from stepping as long as this lives.
pub(super) struct HeldSeats(Vec<Arc<Seat>>);

impl Drop for HeldSeats {
    fn drop(&mut self) {
        for seat in &self.0 {
            seat.unclaim();
            // What came meanwhile was told to a thread that could not do anything about it.
            seat.wake.notify(1);
        }
    }
}

impl HeldSeats {
    /// Holds the modules that have threads of their own, one after the other as each stands still.
    pub fn of(modules: &[SnapshotSubject]) -> Result<Self, SnapshotError> {
        let mut held = Self(Vec::new());
        let end = monotonic() + LIMIT.as_nanos() as u64;
        for subject in modules.iter().filter(|subject| subject.own_thread) {
            while !subject.seat.claim() {
                if monotonic() > end || subject.seat.is_late() {
                    return Err(SnapshotError::Busy { module: subject.name.clone(), limit: LIMIT });
                }
                if !subject.seat.readmit() {
                    std::thread::sleep(Duration::from_micros(50));
                }
            }
            held.0.push(Arc::clone(&subject.seat));
        }
        Ok(held)
    }
}

impl SnapshotSubjects {
    pub fn of(composition: &Composition, shared: &SharedLoop) -> Result<Self, SnapshotError> {
        if let Some(plugin) = composition.plugins.trials.keys().next() {
            return Err(SnapshotError::Shadow { plugin: plugin.clone() });
        }
        let modules = composition.assembly.modules.iter().map(|(name, loaded)| SnapshotSubject {
            name: name.clone(),
            kind: loaded.kind.name().into(),
            seat: Arc::clone(&loaded.seat),
            own_thread: loaded.own_thread,
            ports: loaded.description.ports.clone(),
            params: loaded.description.params.hash,
        });
        Ok(Self {
            modules: modules.collect(),
            configuration: text::of(composition, shared.board.agent()),
            layers: text::layers(composition, shared.board.agent()),
            inferred: composition.configuration.inferred_links(),
            outputs: composition.assembly.resources.index,
            time: Arc::clone(&composition.assembly.resources.means.time),
            keepsakes: composition.snapshots.keepsakes.clone(),
        })
    }

    /// Copies all; nothing when a module's save did not return. The caller has the token, between two cycles, while modules
    /// with threads of their own are held.
    pub fn capture(&self, shared: &SharedLoop) -> Option<Result<SnapshotImage, SnapshotError>> {
        for subject in self.modules.iter().filter(|subject| !subject.own_thread) {
            if !subject.seat.is_idle() && !subject.seat.readmit() {
                return Some(Err(SnapshotError::Busy {
                    module: subject.name.clone(),
                    limit: Duration::ZERO,
                }));
            }
        }
        let mut modules = BTreeMap::new();
        let (mut written, mut receiving) = (BTreeSet::new(), BTreeSet::new());
        for subject in &self.modules {
            let state = match subject.state()? {
                Ok(state) => state,
                Err(reason) => {
                    return Some(Err(SnapshotError::Save { module: subject.name.clone(), reason }));
                }
            };
            // SAFETY: the seat is idle and the loop's, or held.
            let runner = unsafe { subject.seat.runner() };
            written.extend(runner.written());
            let inboxes = runner.entries.inboxes.iter().map(|inbox| &subject.ports[inbox.slot].name);
            receiving.extend(inboxes.map(|port| format!("{}/{port}", subject.name)));
            let mut frozen = runner.freeze(&subject.ports);
            frozen.ticks = subject.seat.ticks();
            let module = FrozenModule {
                kind: subject.kind.clone(),
                ports: subject.frozen_ports(),
                params: subject.params,
                state: state.map(Bytes),
                runner: frozen,
            };
            modules.insert(subject.name.clone(), module);
        }
        let gates = shared.actuators();
        for actuator in gates.iter() {
            written.extend(["command", "gate"].map(|own| format!("{}/{own}", actuator.name())));
        }
        let properties = match properties(&shared.board, &written) {
            Ok(properties) => properties,
            Err(error) => return Some(Err(error)),
        };
        // SAFETY: the caller has the token.
        let main_loop = FrozenLoop::of(shared, unsafe { shared.core() });
        let levels = shared.logger.levels();
        Some(Ok(SnapshotImage {
            configuration: self.configuration.clone(),
            layers: Some(self.layers.clone()),
            inferred: Some(self.inferred.clone()),
            clock: FrozenClock { driven: shared.clock.is_driven(), now: shared.clock.now() },
            main_loop,
            outputs: self.outputs,
            log_levels: levels.entries().map(|(name, level)| (name.to_owned(), level as u32)).collect(),
            modules,
            properties,
            mailboxes: mailboxes(&shared.board, &receiving),
            actuators: gates.iter().map(|actuator| (actuator.name().into(), actuator.freeze())).collect(),
            next_time: self.time.get(),
            keepsakes: self.keepsakes.iter().map(|(name, own)| (name.clone(), Bytes(own.save()))).collect(),
        }))
    }
}

/// A state, none when there is no instance, or why it can't be saved.
type SavedState = Result<Option<Vec<u8>>, String>;

impl SnapshotSubject {
    /// The state of the instance; nothing when the call does not return.
    fn state(&self) -> Option<SavedState> {
        let (kind, instance): (ModuleKind, _) = {
            // SAFETY: the seat is idle and the loop's, or held; the reference ends before the module is called.
            let runner = unsafe { self.seat.runner() };
            runner.code.parts()
        };
        if instance.is_null() {
            return Some(Ok(None));
        }
        // SAFETY: the instance is of that kind, and between two ticks it belongs to this call.
        let state = self.seat.call(self.own_thread, || unsafe { kind.save(instance) })?;
        Some(state.map(Some).map_err(|refusal| refusal.0))
    }

    /// The ports as a snapshot has them.
    pub fn frozen_ports(&self) -> Vec<FrozenPort> {
        let port = |port: &PortDescription| FrozenPort {
            name: port.name.clone(),
            direction: port.direction as u32,
            interface: port.descriptor.name.into(),
            schema: port.descriptor.hash,
        };
        self.ports.iter().map(port).collect()
    }
}

/// The values of the properties that somebody can write again: those that are `written` by what is frozen, those that
/// the host sets, and those that nobody writes now. What is measured of the loop is left out.
fn properties(
    board: &Board,
    written: &BTreeSet<String>,
) -> Result<BTreeMap<String, FrozenProperty>, SnapshotError> {
    let mut properties = BTreeMap::new();
    for property in board.properties() {
        if !is_kept(&property, written) {
            continue;
        }
        if let Some(values) = property.freeze()? {
            let descriptor = property.descriptor();
            let frozen =
                FrozenProperty { interface: descriptor.name.into(), schema: descriptor.hash, values };
            properties.insert(property.path().to_owned(), frozen);
        }
    }
    Ok(properties)
}

fn is_kept(property: &Property, written: &BTreeSet<String>) -> bool {
    let kept =
        property.access() == Access::Setting || !property.has_writer() || written.contains(property.path());
    kept && !is_remote(property.path())
}

/// Whether it is of other agents, which know better what it is when the snapshot is resumed.
fn is_remote(path: &str) -> bool {
    ["agents/", "peers/", "team/"].iter().any(|prefix| path.starts_with(prefix))
}

/// The messages that wait for receivers which are not there.
fn mailboxes(board: &Board, receiving: &BTreeSet<String>) -> BTreeMap<String, FrozenMailbox> {
    let frozen = |mailbox: &Arc<Mailbox>| {
        let receiver = mailbox.receiver().ok()?;
        Some(FrozenMailbox { sequence: receiver.sequence(), messages: receiver.waiting() })
    };
    let properties = board.properties();
    let others = properties
        .iter()
        .filter(|property| !receiving.contains(property.path()) && !is_remote(property.path()));
    let mailboxes = others.filter_map(|property| match property.carrier() {
        Carrier::Mailbox(mailbox) => Some((property.path().to_owned(), frozen(mailbox)?)),
        Carrier::Channel(_) => None,
    });
    mailboxes.collect()
}

/// The plugins that are loaded, each with a hash over its library, or over what its modules are.
pub(super) fn marks(composition: &Composition) -> Vec<PluginMark> {
    let mark = |plugin: &slate_module::Plugin| {
        let code = plugin.kinds().iter().find_map(slate_engine::plugin::code_of);
        let mut text = String::new();
        for kind in plugin.kinds() {
            text.push_str(&format!("{}\n", kind.name()));
            for (name, loaded) in
                composition.assembly.modules.iter().filter(|(_, loaded)| loaded.kind.is(kind))
            {
                let description = &loaded.description;
                text.push_str(&format!("{name} {:016x}\n", description.params.hash));
                for port in &description.ports {
                    let (direction, schema) = (port.direction as u32, port.descriptor.hash);
                    text.push_str(&format!("{} {direction} {schema:016x}\n", port.name));
                }
            }
        }
        PluginMark {
            name: plugin.name().into(),
            version: plugin.version_text().into(),
            file: composition.plugins.origins.get(plugin.name()).map(|origin| origin.file.clone()),
            hash: code.unwrap_or_else(|| xxhash_rust::xxh3::xxh3_64(text.as_bytes())),
        }
    };
    composition.catalogue.plugins.iter().map(mark).collect()
}

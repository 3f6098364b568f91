//! Copy of an agent between two cycles.

use std::sync::Arc;
use std::time::Duration;

use slate_blackboard::message::Mailbox;
use slate_blackboard::{Access, Board, Carrier, Property};
use slate_module::{ModuleKind, PortDescription};
use slate_sorted::{SortedMap, SortedSet};

use super::text;
use crate::agent::composition::Composition;
use crate::aspects::TimePlace;
use crate::snapshot::{
    ApplicationState, Bytes, ClockSnapshot, MailboxSnapshot, ModuleSnapshot, PluginMark, PortSnapshot,
    PropertySnapshot, SnapshotError, SnapshotImage,
};
use slate_configuration::{InferredLink, Layered};
use slate_engine::clock::monotonic;
use slate_engine::main_loop::{LoopSnapshot, RunnerCell, SharedLoop};

/// Longest wait for modules with threads of their own.
pub(super) const LIMIT: Duration = Duration::from_secs(5);

/// Module in a snapshot.
#[derive(Clone)]
pub(super) struct SnapshotSubject {
    pub name: String,
    pub kind: String,
    pub cell: Arc<RunnerCell>,
    pub own_thread: bool,
    pub ports: Vec<PortDescription>,
    pub params: u64,
}

/// Subjects of a snapshot, with all that is known without looking.
pub(super) struct SnapshotSubjects {
    pub modules: Vec<SnapshotSubject>,
    configuration: String,
    layers: Layered,
    inferred: Vec<InferredLink>,
    outputs: u32,
    time: Arc<TimePlace>,
    application_states: SortedMap<String, Arc<dyn ApplicationState>>,
}

/// Cells kept from stepping until this is dropped.
pub(super) struct HeldCells(Vec<Arc<RunnerCell>>);

impl Drop for HeldCells {
    fn drop(&mut self) {
        for cell in &self.0 {
            cell.release();
            // A concurrent request was signaled to a thread that could not serve it.
            cell.wake.notify(1);
        }
    }
}

impl HeldCells {
    /// Holds the modules with threads of their own, one by one as each is idle.
    pub fn of(modules: &[SnapshotSubject]) -> Result<Self, SnapshotError> {
        let mut held = Self(Vec::new());
        let end = monotonic() + LIMIT.as_nanos() as u64;
        for subject in modules.iter().filter(|subject| subject.own_thread) {
            while !subject.cell.claim() {
                if monotonic() > end || subject.cell.is_late() {
                    return Err(SnapshotError::Busy { module: subject.name.clone(), limit: LIMIT });
                }
                if !subject.cell.reclaim() {
                    std::thread::sleep(Duration::from_micros(50));
                }
            }
            held.0.push(Arc::clone(&subject.cell));
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
            cell: Arc::clone(&loaded.cell),
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
            time: Arc::clone(&composition.assembly.resources.service_context.time),
            application_states: composition.snapshots.application_states.clone(),
        })
    }

    /// Copies the agent's state; `None` if a module's save does not return.
    /// The caller must hold the token, between two cycles, and the modules with threads of their own.
    pub fn capture(&self, shared: &SharedLoop) -> Option<Result<SnapshotImage, SnapshotError>> {
        for subject in self.modules.iter().filter(|subject| !subject.own_thread) {
            if !subject.cell.is_idle() && !subject.cell.reclaim() {
                return Some(Err(SnapshotError::Busy {
                    module: subject.name.clone(),
                    limit: Duration::ZERO,
                }));
            }
        }
        let mut modules = SortedMap::new();
        let (mut written, mut receiving) = (SortedSet::new(), SortedSet::new());
        for subject in &self.modules {
            let state = match subject.state()? {
                Ok(state) => state,
                Err(reason) => {
                    return Some(Err(SnapshotError::Save { module: subject.name.clone(), reason }));
                }
            };
            // SAFETY: the cell is idle and the loop's, or held.
            let runner = unsafe { subject.cell.runner() };
            written.extend(runner.written());
            let inboxes = runner.entries.inboxes.iter().map(|inbox| &subject.ports[inbox.slot].name);
            receiving.extend(inboxes.map(|port| format!("{}/{port}", subject.name)));
            let mut saved = runner.snapshot(&subject.ports);
            saved.ticks = subject.cell.ticks();
            let module = ModuleSnapshot {
                kind: subject.kind.clone(),
                ports: subject.port_snapshots(),
                params: subject.params,
                state: state.map(Bytes),
                runner: saved,
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
        let main_loop = LoopSnapshot::of(shared, unsafe { shared.core() });
        let levels = shared.logger.levels();
        Some(Ok(SnapshotImage {
            configuration: self.configuration.clone(),
            layers: Some(self.layers.clone()),
            inferred: Some(self.inferred.clone()),
            clock: ClockSnapshot { driven: shared.clock.is_driven(), now: shared.clock.now() },
            main_loop,
            outputs: self.outputs,
            log_levels: levels.entries().map(|(name, level)| (name.to_owned(), level as u32)).collect(),
            modules,
            properties,
            mailboxes: mailboxes(&shared.board, &receiving),
            actuators: gates.iter().map(|actuator| (actuator.name().into(), actuator.snapshot())).collect(),
            next_time: self.time.get(),
            application_states: self
                .application_states
                .iter()
                .map(|(name, own)| (name.clone(), Bytes(own.save())))
                .collect(),
        }))
    }
}

/// State of a module; `None` without an instance, or the error of saving it.
type SavedState = Result<Option<Vec<u8>>, String>;

impl SnapshotSubject {
    /// Returns the state of the instance; `None` if the call does not return.
    fn state(&self) -> Option<SavedState> {
        let (kind, instance): (ModuleKind, _) = {
            // SAFETY: the cell is idle and the loop's, or held; the reference ends before the module is called.
            let runner = unsafe { self.cell.runner() };
            runner.code.parts()
        };
        if instance.is_null() {
            return Some(Ok(None));
        }
        // SAFETY: the instance is of that kind, and between two ticks it belongs to this call.
        let state = self.cell.call(self.own_thread, || unsafe { kind.save(instance) })?;
        Some(state.map(Some).map_err(|refusal| refusal.0))
    }

    /// Returns the ports in the form of a snapshot.
    pub fn port_snapshots(&self) -> Vec<PortSnapshot> {
        let port = |port: &PortDescription| PortSnapshot {
            name: port.name.clone(),
            direction: port.direction as u32,
            interface: port.descriptor.name.into(),
            schema: port.descriptor.hash,
        };
        self.ports.iter().map(port).collect()
    }
}

/// Returns the values of all properties that can be written again.
/// These are the properties `written` by the frozen modules, the host's settings, and those without a writer now. The
/// measurements of the loop are excluded.
fn properties(
    board: &Board,
    written: &SortedSet<String>,
) -> Result<SortedMap<String, PropertySnapshot>, SnapshotError> {
    let mut properties = SortedMap::new();
    for property in board.properties() {
        if !is_kept(&property, written) {
            continue;
        }
        if let Some(values) = property.snapshot()? {
            let descriptor = property.descriptor();
            let saved =
                PropertySnapshot { interface: descriptor.name.into(), schema: descriptor.hash, values };
            properties.insert(property.path().to_owned(), saved);
        }
    }
    Ok(properties)
}

fn is_kept(property: &Property, written: &SortedSet<String>) -> bool {
    let kept =
        property.access() == Access::Setting || !property.has_writer() || written.contains(property.path());
    kept && !is_remote(property.path())
}

/// Returns true if a property belongs to other agents.
/// They know its present value better when the snapshot is restored.
fn is_remote(path: &str) -> bool {
    ["agents/", "peers/", "team/"].iter().any(|prefix| path.starts_with(prefix))
}

/// Returns the messages that wait for absent receivers.
fn mailboxes(board: &Board, receiving: &SortedSet<String>) -> SortedMap<String, MailboxSnapshot> {
    let saved = |mailbox: &Arc<Mailbox>| {
        let receiver = mailbox.receiver().ok()?;
        Some(MailboxSnapshot { sequence: receiver.sequence(), messages: receiver.waiting() })
    };
    let properties = board.properties();
    let others = properties
        .iter()
        .filter(|property| !receiving.contains(property.path()) && !is_remote(property.path()));
    let mailboxes = others.filter_map(|property| match property.carrier() {
        Carrier::Mailbox(mailbox) => Some((property.path().to_owned(), saved(mailbox)?)),
        Carrier::Channel(_) => None,
    });
    mailboxes.collect()
}

/// Returns the loaded plugins, each with a hash.
/// The hash is over the library, or over the descriptions of the modules.
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

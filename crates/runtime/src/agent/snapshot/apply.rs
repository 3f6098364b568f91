//! Exchange of the agent's state between two cycles.
//! All checks precede it, so it can't fail.

use std::sync::Arc;

use slate_blackboard::message::{Mailbox, WaitingMessage};
use slate_blackboard::{Access, Board, BoardError, Carrier, Property};
use slate_sorted::SortedMap;

use super::capture::SnapshotSubject;
use crate::aspects::TimePlace;
use crate::snapshot::{SnapshotError, SnapshotImage};
use slate_engine::main_loop::SharedLoop;
use slate_engine::runner::{OutboxPort, Retired};

/// New state of an agent, ready for the exchange.
pub(super) struct Ready {
    pub image: SnapshotImage,
    /// Instances by module; `None` for a module that had none.
    pub fresh: SortedMap<String, Option<Retired>>,
    /// Values of settings that hold in place of the snapshot's.
    pub kept: SortedMap<String, Vec<u8>>,
    pub application_states: Vec<Box<dyn FnOnce() + Send>>,
    pub time: Arc<TimePlace>,
    /// True if actuators return to their armed state.
    pub rearm: bool,
}

pub(super) struct Restoration {
    pub subjects: Vec<SnapshotSubject>,
    pub ready: Ready,
}

impl Restoration {
    /// Checks that the exchange is possible; nothing is changed if not.
    /// The caller must hold the token.
    pub fn check(self, shared: &SharedLoop) -> Result<Self, SnapshotError> {
        let Self { subjects, ready } = &self;
        for subject in subjects.iter().filter(|subject| !subject.own_thread) {
            if !subject.cell.is_idle() && !subject.cell.reclaim() {
                let limit = std::time::Duration::ZERO;
                return Err(SnapshotError::Busy { module: subject.name.clone(), limit });
            }
        }
        // SAFETY: the caller has the token.
        let core = unsafe { shared.core() };
        if !ready.image.main_loop.restore_time_source(core) {
            let problems = vec!["the time source can't continue from the snapshot".into()];
            return Err(SnapshotError::Unfit { agent: shared.board.agent().into(), problems });
        }
        Ok(self)
    }

    /// Exchanges the state; returns the instances that it replaces.
    /// The caller must hold the token, and the modules with threads of their own.
    pub fn apply(self, shared: &SharedLoop) -> Vec<Retired> {
        let Self { subjects, ready } = self;
        let Ready { image, mut fresh, kept, application_states, time, rearm } = ready;
        // SAFETY: the caller has the token.
        let core = unsafe { shared.core() };
        let now = image.clock.now;
        shared.clock.resume(now);
        time.set(image.next_time);
        let mut old = Vec::new();
        let board = &*shared.board;
        for subject in &subjects {
            // SAFETY: the cell is idle and the loop's, or held.
            let runner = unsafe { subject.cell.runner() };
            if let Some(instance) = fresh.remove(&subject.name) {
                let (kind, instance) = match instance {
                    Some(fresh) => fresh.into_parts(),
                    None => (runner.code.kind().clone(), std::ptr::null_mut()),
                };
                old.push(runner.exchange(kind, instance));
            }
            // It was found to fit, and the runner has the writer, so a slot is free.
            report(shared, runner.restore_written(board, &image.properties));
        }
        for actuator in shared.actuators().iter() {
            if let Some(saved) = image.actuators.get(actuator.name()) {
                report(shared, actuator.restore(saved, board, &image.properties, (rearm, now)));
            }
        }
        for property in board.properties() {
            let is_own = property.access() == Access::Setting || !property.has_writer();
            if let Some(saved) = image.properties.get(property.path()).filter(|_| is_own) {
                report(shared, property.restore(&saved.values, None));
            }
        }
        for subject in &subjects {
            let Some(saved) = image.modules.get(&subject.name) else { continue };
            // SAFETY: as above.
            unsafe { subject.cell.runner() }.restore_snapshot(&subject.ports, &saved.runner);
            subject.cell.set_ticks(saved.runner.ticks);
        }
        messages(board, &subjects, &image);
        for (path, bytes) in kept {
            if let Some(property) = at(board, &path) {
                report(shared, property.set_bytes(&bytes, now).map(drop));
            }
        }
        image.main_loop.restore(shared, core);
        application_states.into_iter().for_each(|restore| restore());
        old
    }
}

fn report(shared: &SharedLoop, result: Result<(), BoardError>) {
    if let Err(error) = result {
        let text = format!("a property can't be restored from the snapshot: {error}");
        shared.logger.log(shared.clock.now(), slate_module::Level::Error, &text);
    }
}

/// Returns the property at exactly that path.
pub(super) fn at(board: &Board, path: &str) -> Option<Arc<Property>> {
    board.get(path).map(|(property, _)| property).filter(|property| property.path() == path)
}

/// Sends the waiting messages again, each as its sender.
fn messages(board: &Board, subjects: &[SnapshotSubject], image: &SnapshotImage) {
    let inboxes = image.modules.iter().flat_map(|(name, module)| {
        module.runner.inboxes.iter().map(move |(port, saved)| (format!("{name}/{port}"), saved))
    });
    let others = image.mailboxes.iter().map(|(path, saved)| (path.clone(), saved));
    let others: Vec<_> = others.collect();
    for (path, saved) in &others {
        if let Some(Carrier::Mailbox(mailbox)) = at(board, path).map(|property| property.carrier().clone())
            && let Ok(mut receiver) = mailbox.receiver()
        {
            receiver.resume(saved.sequence);
        }
    }
    for (path, saved) in inboxes.chain(others) {
        let Some(Carrier::Mailbox(mailbox)) = at(board, &path).map(|property| property.carrier().clone())
        else {
            continue;
        };
        for (at, message) in saved.messages.iter().enumerate() {
            let later = saved.messages[at + 1..].iter().filter(|later| later.sender == message.sender);
            send(&mailbox, message, later.count(), subjects, image);
        }
    }
    for subject in subjects {
        // SAFETY: as above.
        unsafe { subject.cell.runner() }.entries.outboxes.iter_mut().for_each(OutboxPort::mark_waiting_lost);
    }
}

/// Sends a message before the `later` newest ones of its sender.
fn send(
    mailbox: &Arc<Mailbox>,
    message: &WaitingMessage,
    later: usize,
    subjects: &[SnapshotSubject],
    image: &SnapshotImage,
) {
    for subject in subjects {
        let Some(saved) = image.modules.get(&subject.name) else { continue };
        // SAFETY: as above.
        let runner = unsafe { subject.cell.runner() };
        for outbox in &mut runner.entries.outboxes {
            let name = &subject.ports[outbox.slot].name;
            let was = saved.runner.outboxes.get(name).and_then(|outbox| outbox.sender);
            if outbox.sender.as_ref().is_some_and(|sender| sender.is_of(mailbox))
                && was == Some(message.sender)
            {
                outbox.resend(&message.bytes, message.items, message.time, later);
                return;
            }
        }
    }
    // Its sender is not a module, or is not there any more.
    if let Ok(mut sender) = mailbox.sender() {
        let _ = sender.send(&message.bytes, message.items, message.time);
    }
}

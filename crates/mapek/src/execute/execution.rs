use serde::{Deserialize, Serialize};
use slate_module::{Inbox, Output, Priority, Sequence, Text, Tick};

use crate::pipeline::{Admission, Origin, Pipeline, QueuedAction};
use crate::{
    Acting, ActionRequest, ActionTree, Ended, Ending, ExecuteStatus, PlanStep, Planned, Reflex,
    RefusalReason, Repertoire, RequestError, Route, Step, WaitingAction, WaitingActions,
};

/// The state of an [`ExecuteBlock`](crate::ExecuteBlock).
#[derive(Debug, Serialize, Deserialize)]
#[serde(bound = "R: Repertoire")]
pub struct Execution<R> {
    pipeline: Pipeline,
    /// The running action's own state.
    action: Option<R>,
    counts: Counts,
    endings: Endings,
    /// The last route that was not idle.
    last_route: Route,
    /// Set once the status was written.
    published: bool,
    /// Planned action with a logged failure.
    /// Kept until an action of its kind proceeds or completes. A Plan that retries in each cycle must not fill the log.
    #[serde(default, alias = "told")]
    logged_failure: Option<ActionRequest>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Counts {
    ticket: u64,
    reflexes: u64,
    route_switches: u64,
    completed: u64,
    failed: u64,
    cancelled: u64,
    dropped: u64,
    refused: u64,
}

/// The latest endings, oldest first.
#[derive(Debug, Default, Serialize, Deserialize)]
struct Endings {
    latest: [Option<(u64, QueuedAction, Ending)>; 8],
    number: u64,
}

/// Notes how an action ended.
fn note(counts: &mut Counts, endings: &mut Endings, entry: QueuedAction, ending: Ending) {
    *match ending {
        Ending::COMPLETED => &mut counts.completed,
        Ending::FAILED => &mut counts.failed,
        Ending::CANCELLED => &mut counts.cancelled,
        Ending::DROPPED => &mut counts.dropped,
        _ => &mut counts.refused,
    } += 1;
    endings.number += 1;
    endings.latest.rotate_left(1);
    endings.latest[7] = Some((endings.number, entry, ending));
}

/// Part of the status whose change is published.
#[derive(PartialEq)]
pub struct Summary {
    counts: Counts,
    epoch: u64,
    route: Route,
    replan: bool,
    waiting: (usize, usize),
    tree: Text<252>,
}

impl<R> Default for Execution<R> {
    fn default() -> Self {
        Self {
            pipeline: Pipeline::default(),
            action: None,
            counts: Counts::default(),
            endings: Endings::default(),
            last_route: Route::IDLE,
            published: false,
            logged_failure: None,
        }
    }
}

impl<R: Repertoire> Execution<R> {
    pub(super) fn set_time(&mut self, now: u64) {
        self.pipeline.set_time(now);
    }

    /// Counts the changes of the waiting actions.
    pub(super) fn revision(&self) -> u64 {
        self.pipeline.revision()
    }

    pub(super) fn has_waiting(&self) -> bool {
        self.pipeline.waiting() != (0, 0)
    }

    pub(super) fn write_waiting(&self, waiting: &Output<WaitingActions>) {
        let (high, normal) = self.pipeline.waiting();
        // It has room for both levels of the pipeline.
        waiting.write((high + normal).min(waiting.capacity()), |list| {
            list.revision = self.pipeline.revision();
            for (slot, entry) in list.actions.iter_mut().zip(self.pipeline.iter()) {
                *slot = WaitingAction {
                    queued: entry.queued,
                    ticket: entry.ticket(),
                    action: entry.action,
                    rank: entry.rank().unwrap_or(0),
                    route: entry.route(),
                };
            }
        });
    }

    pub(super) fn take_reflexes(&mut self, reflexes: &Inbox<Reflex>, now: &Tick) {
        for reflex in reflexes.iter() {
            let (source, rank) = (reflex.sender(), reflex.rank);
            let origin = Origin::Reflex { source, rank };
            let entry = QueuedAction { action: reflex.action, origin, queued: now.now() };
            if let Err(error) = R::start(&reflex.action) {
                reflex.refuse(self.refuse(entry, &error, now).0);
                continue;
            }
            let Self { pipeline, counts, endings, .. } = self;
            let cleared = |entry| note(counts, endings, entry, Ending::CANCELLED);
            match pipeline.reflex(reflex.action, source, rank, cleared) {
                Admission::Full => {
                    now.warn(format_args!("no room for the reflex {}", reflex.action.kind));
                    note(&mut self.counts, &mut self.endings, entry, Ending::REFUSED);
                    reflex.refuse(RefusalReason::FULL.0);
                    continue;
                }
                Admission::Renewed => {
                    // Its arguments were just seen to fit, and it is the kind that runs.
                    let _ = self.action.as_mut().map(|action| action.renew(&reflex.action));
                }
                Admission::Waiting | Admission::OldEpoch => {}
            }
            self.counts.reflexes += 1;
        }
    }

    pub(super) fn take_plan(&mut self, plan: &Inbox<Planned>, now: &Tick) {
        for planned in plan.iter() {
            self.counts.ticket = planned.ticket;
            let origin = Origin::Plan(planned.ticket);
            let entry = QueuedAction { action: planned.action, origin, queued: now.now() };
            if planned.step != PlanStep::CLEAR
                && let Err(error) = R::start(&planned.action)
            {
                planned.refuse(self.refuse(entry, &error, now).0);
                continue;
            }
            let Self { pipeline, counts, endings, .. } = self;
            let cleared = |entry| note(counts, endings, entry, Ending::CANCELLED);
            match pipeline.planned(planned.action, planned.ticket, planned.epoch, planned.step, cleared) {
                Admission::OldEpoch => {
                    note(&mut self.counts, &mut self.endings, entry, Ending::DROPPED);
                    planned.refuse(RefusalReason::OLD_EPOCH.0);
                }
                Admission::Full => {
                    now.warn(format_args!("no room for the planned action {}", planned.action.kind));
                    note(&mut self.counts, &mut self.endings, entry, Ending::REFUSED);
                    planned.refuse(RefusalReason::FULL.0);
                }
                Admission::Waiting | Admission::Renewed => {}
            }
        }
    }

    fn refuse(&mut self, entry: QueuedAction, error: &RequestError, now: &Tick) -> RefusalReason {
        now.warn(format_args!("refused the action {}: {error}", entry.action.kind));
        note(&mut self.counts, &mut self.endings, entry, Ending::REFUSED);
        match error {
            RequestError::UnknownKind { .. } => RefusalReason::UNKNOWN_KIND,
            RequestError::Count { .. } | RequestError::NotFinite => RefusalReason::BAD_ARGUMENTS,
        }
    }

    /// Ends the action whose place another takes.
    pub(super) fn cancel_interrupted(&mut self, body: &R::Body, now: &Tick) {
        if let Some(entry) = self.pipeline.take_interrupted() {
            if let Some(mut action) = self.action.take() {
                action.cancel(&Acting { body, priority: priority(&entry), now });
            }
            note(&mut self.counts, &mut self.endings, entry, Ending::CANCELLED);
        }
    }

    /// Steps the running action; while actions are done, the next one too.
    /// Each step but the last ends an action, and none is added meanwhile, so this ends.
    pub(super) fn perform(&mut self, body: &R::Body, now: &Tick) {
        while let Some(entry) = self.pipeline.advance() {
            self.enter(entry.route());
            if self.action.is_none() {
                match R::start(&entry.action) {
                    Ok(action) => self.action = Some(action),
                    // It was looked at when it came; only a restored pipeline can hold what the robot has unlearned.
                    Err(error) => {
                        self.pipeline.finish();
                        self.refuse(entry, &error, now);
                    }
                }
            }
            let Some(action) = &mut self.action else { continue };
            let ending = match action.act(&Acting { body, priority: priority(&entry), now }) {
                Step::Running => {
                    self.note_success(&entry);
                    return;
                }
                Step::Done => {
                    self.note_success(&entry);
                    Ending::COMPLETED
                }
                Step::Failed => Ending::FAILED,
            };
            self.action = None;
            self.pipeline.finish();
            note(&mut self.counts, &mut self.endings, entry, ending);
            if ending == Ending::FAILED && entry.route() == Route::DELIBERATIVE {
                if !self.is_failure_logged(&entry) {
                    self.logged_failure = Some(entry.action);
                    now.warn(format_args!("{} failed, the plan is given up", entry.action.kind));
                }
                let Self { pipeline, counts, endings, .. } = self;
                pipeline.abandon_plan(|entry| note(counts, endings, entry, Ending::CANCELLED));
            }
        }
    }

    /// Returns whether the failure of this kind of action is logged.
    fn is_failure_logged(&self, entry: &QueuedAction) -> bool {
        self.logged_failure.is_some_and(|action| action.kind == entry.action.kind)
    }

    /// Notes success of an action: the next failure of its kind is logged.
    fn note_success(&mut self, entry: &QueuedAction) {
        if self.is_failure_logged(entry) {
            self.logged_failure = None;
        }
    }

    fn enter(&mut self, route: Route) {
        if self.last_route != Route::IDLE && self.last_route != route {
            self.counts.route_switches += 1;
        }
        self.last_route = route;
    }

    pub(super) fn summary(&self) -> Summary {
        Summary {
            counts: self.counts,
            epoch: self.pipeline.epoch(),
            route: self.route(),
            replan: self.pipeline.wants_plan(),
            waiting: self.pipeline.waiting(),
            tree: self.tree(),
        }
    }

    /// Returns true if the status was published.
    pub(super) fn is_published(&self) -> bool {
        self.published
    }

    /// Returns true if the status has changed; true once at the start.
    pub(super) fn must_publish(&mut self, before: &Summary) -> bool {
        !std::mem::replace(&mut self.published, true) || self.summary() != *before
    }

    fn route(&self) -> Route {
        self.pipeline.running().map_or(Route::IDLE, QueuedAction::route)
    }

    fn tree(&self) -> Text<252> {
        let mut tree = ActionTree::default();
        if let Some(action) = &self.action {
            action.describe(&mut tree);
        }
        tree.text()
    }

    pub(super) fn status(&self) -> ExecuteStatus {
        let (high, normal) = self.pipeline.waiting();
        let mut ended = [Ended::default(); 8];
        let mut length = 0;
        for (number, entry, ending) in self.endings.latest.iter().flatten() {
            ended[length] = Ended {
                number: *number,
                ticket: entry.ticket(),
                kind: entry.action.kind,
                ending: *ending,
                route: entry.route(),
            };
            length += 1;
        }
        ExecuteStatus {
            epoch: self.pipeline.epoch(),
            ticket: self.counts.ticket,
            completed: self.counts.completed,
            failed: self.counts.failed,
            cancelled: self.counts.cancelled,
            dropped: self.counts.dropped,
            refused: self.counts.refused,
            reflexes: self.counts.reflexes,
            route_switches: self.counts.route_switches,
            // At most the capacity of the pipeline.
            high: high as u32,
            normal: normal as u32,
            route: self.route(),
            replan: self.pipeline.wants_plan().into(),
            running: self.pipeline.running().map(|entry| entry.action.kind).unwrap_or_default(),
            tree: self.tree(),
            ended: Sequence::new(&ended[..length]),
        }
    }
}

fn priority(entry: &QueuedAction) -> Priority {
    if entry.route() == Route::REACTIVE { Priority::Reflex } else { Priority::Plan }
}

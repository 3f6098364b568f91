//! The pipeline against a simple model of it, and its rules one by one.

use crate::common;

use proptest::prelude::*;
use slate_mapek::{ActionKind, ActionRequest, Admission, Origin, Pipeline, PlanStep, QueuedAction, Route};

use common::{Drive, Swerve};

/// Request with a distinct number.
fn request(number: u32) -> ActionRequest {
    Drive::request((number.into(), 1.0))
}

fn number(entry: &QueuedAction) -> f64 {
    entry.action.arguments[0]
}

/// All that waits, in the order in which it would run.
fn drain(pipeline: &mut Pipeline) -> Vec<f64> {
    let mut order = Vec::new();
    while let Some(entry) = pipeline.advance() {
        order.push(number(&entry));
        pipeline.finish();
    }
    order
}

fn append(pipeline: &mut Pipeline, value: u32) -> Admission {
    let epoch = pipeline.epoch();
    pipeline.planned(request(value), value.into(), epoch, PlanStep::APPEND, |_| {})
}

#[test]
fn planned_actions_run_in_the_order_in_which_they_were_planned() {
    let mut pipeline = Pipeline::default();
    for value in [3, 1, 2] {
        assert_eq!(append(&mut pipeline, value), Admission::Waiting);
    }
    assert_eq!(drain(&mut pipeline), [3.0, 1.0, 2.0]);
}

#[test]
fn a_reflex_clears_the_plan_and_requests_a_new_one() {
    let mut pipeline = Pipeline::default();
    append(&mut pipeline, 1);
    append(&mut pipeline, 2);
    pipeline.advance();
    let mut cleared = Vec::new();
    pipeline.reflex(request(7), 0, 0, |entry| cleared.push(entry.ticket()));
    assert_eq!(cleared, [2]);
    assert_eq!(pipeline.take_interrupted().map(|entry| entry.ticket()), Some(1));
    assert_eq!(pipeline.epoch(), 1);
    assert!(pipeline.wants_plan());
    assert_eq!(drain(&mut pipeline), [7.0]);
}

#[test]
fn plans_before_a_reflex_are_dropped_after_it() {
    let mut pipeline = Pipeline::default();
    pipeline.reflex(request(7), 0, 0, |_| {});
    assert_eq!(pipeline.planned(request(1), 1, 0, PlanStep::APPEND, |_| {}), Admission::OldEpoch);
    assert!(pipeline.wants_plan());
    assert_eq!(pipeline.planned(request(1), 1, 1, PlanStep::APPEND, |_| {}), Admission::Waiting);
    assert!(!pipeline.wants_plan());
}

#[test]
fn a_higher_rank_preempts_a_lower_and_inhibits_it() {
    let mut pipeline = Pipeline::default();
    pipeline.reflex(request(1), 1, 0, |_| {});
    pipeline.advance();
    pipeline.reflex(request(2), 2, 5, |_| {});
    assert_eq!(pipeline.take_interrupted().as_ref().map(number), Some(1.0));
    assert_eq!(pipeline.advance().as_ref().map(number), Some(2.0));
    // The lower one, sent again, waits.
    pipeline.reflex(request(1), 1, 0, |_| {});
    assert_eq!(pipeline.take_interrupted(), None);
    assert_eq!(drain(&mut pipeline), [2.0, 1.0]);
}

#[test]
fn a_reflex_of_the_same_rank_waits_for_the_running_one() {
    let mut pipeline = Pipeline::default();
    pipeline.reflex(request(1), 1, 0, |_| {});
    pipeline.advance();
    pipeline.reflex(request(2), 2, 0, |_| {});
    assert_eq!(drain(&mut pipeline), [1.0, 2.0]);
}

#[test]
fn a_repeated_reflex_takes_the_place_of_the_first() {
    let mut pipeline = Pipeline::default();
    pipeline.reflex(request(1), 1, 0, |_| {});
    pipeline.reflex(request(2), 2, 0, |_| {});
    pipeline.reflex(request(3), 1, 0, |_| {});
    assert_eq!(drain(&mut pipeline), [3.0, 2.0]);
}

#[test]
fn a_repeated_reflex_renews_its_arguments() {
    let mut pipeline = Pipeline::default();
    pipeline.reflex(request(1), 1, 0, |_| {});
    pipeline.advance();
    assert_eq!(pipeline.reflex(request(2), 1, 0, |_| {}), Admission::Renewed);
    assert_eq!(pipeline.take_interrupted(), None);
    assert_eq!(pipeline.running().map(number), Some(2.0));
    assert_eq!(pipeline.waiting(), (0, 0));
    // Another kind of action is another reflex.
    assert_eq!(pipeline.reflex(Swerve::request((9.0, 1.0)), 1, 0, |_| {}), Admission::Waiting);
}

#[test]
fn a_full_pipeline_accepts_only_higher_ranks() {
    let mut pipeline = Pipeline::default();
    for value in 0..Pipeline::CAPACITY as u32 {
        assert_eq!(append(&mut pipeline, value), Admission::Waiting);
    }
    assert_eq!(append(&mut pipeline, 99), Admission::Full);
    for source in 0..Pipeline::CAPACITY as u32 {
        assert_eq!(pipeline.reflex(request(source), source, 0, |_| {}), Admission::Waiting);
    }
    let epoch = pipeline.epoch();
    assert_eq!(pipeline.reflex(request(200), 200, 0, |_| {}), Admission::Full);
    assert_eq!(pipeline.epoch(), epoch);
    let mut cleared = Vec::new();
    assert_eq!(
        pipeline.reflex(request(201), 201, 1, |entry| cleared.push(number(&entry))),
        Admission::Waiting
    );
    assert_eq!(cleared, [63.0]);
    assert_eq!(pipeline.advance().as_ref().map(number), Some(201.0));
}

#[test]
fn a_saved_pipeline_comes_back_as_it_was() {
    let mut pipeline = Pipeline::default();
    pipeline.reflex(request(1), 1, 3, |_| {});
    pipeline.advance();
    pipeline.reflex(request(2), 2, 1, |_| {});
    append(&mut pipeline, 3);
    let saved = slate_module::encode(&pipeline).unwrap();
    assert_eq!(slate_module::decode::<Pipeline>(&saved).unwrap(), pipeline);
}

#[derive(Clone, Debug)]
enum Operation {
    Reflex { source: u32, rank: i32, swerve: bool },
    Planned { late: bool, step: PlanStep },
    Next,
    Finish,
    Abandon,
}

fn operation() -> impl Strategy<Value = Operation> {
    prop_oneof![
        3 => (0..3_u32, -1..2_i32, any::<bool>())
            .prop_map(|(source, rank, swerve)| Operation::Reflex { source, rank, swerve }),
        4 => (prop::bool::weighted(0.2), 0..3_u8)
            .prop_map(|(late, step)| Operation::Planned { late, step: PlanStep(step) }),
        3 => Just(Operation::Next),
        2 => Just(Operation::Finish),
        1 => Just(Operation::Abandon),
    ]
}

/// The rules as they are said, without an order kept: each action carries when it came, and the choice is made late.
#[derive(Default)]
struct Model {
    waiting: Vec<(u64, QueuedAction)>,
    running: Option<QueuedAction>,
    arrivals: u64,
    epoch: u64,
    replan: bool,
}

fn rank(entry: &QueuedAction) -> Option<i32> {
    match entry.origin {
        Origin::Plan(_) => None,
        Origin::Reflex { rank, .. } => Some(rank),
    }
}

impl Model {
    fn arrive(&mut self, entry: QueuedAction) {
        self.arrivals += 1;
        self.waiting.push((self.arrivals, entry));
    }

    fn clear_planned(&mut self) -> Option<QueuedAction> {
        self.waiting.retain(|(_, entry)| entry.route() == Route::REACTIVE);
        self.running.take_if(|entry| entry.route() == Route::DELIBERATIVE)
    }

    /// The action that is interrupted.
    fn reflex(&mut self, new: QueuedAction) -> Option<QueuedAction> {
        let same = |old: &QueuedAction| old.origin == new.origin && old.action.kind == new.action.kind;
        let mut interrupted = None;
        if self.running.as_ref().is_some_and(same) {
            self.running = Some(new);
        } else if let Some((_, old)) = self.waiting.iter_mut().find(|(_, old)| same(old)) {
            *old = new;
        } else {
            self.arrive(new);
            interrupted = self.running.take_if(|running| rank(running) < rank(&new));
        }
        self.epoch += 1;
        self.replan = true;
        self.clear_planned().or(interrupted)
    }

    fn next(&mut self) -> Option<QueuedAction> {
        if self.running.is_none() {
            let key = |(arrival, entry): &(u64, QueuedAction)| (std::cmp::Reverse(rank(entry)), *arrival);
            let best = (0..self.waiting.len()).min_by_key(|i| key(&self.waiting[*i]))?;
            self.running = Some(self.waiting.remove(best).1);
        }
        self.running
    }
}

proptest! {
    #[test]
    fn it_behaves_like_the_rules_as_they_are_said(operations in prop::collection::vec(operation(), 0..60)) {
        let mut pipeline = Pipeline::default();
        let mut model = Model::default();
        for (i, operation) in operations.into_iter().enumerate() {
            let value = i as u32;
            let mut interrupted = None;
            match operation {
                Operation::Reflex { source, rank, swerve } => {
                    let action = if swerve { Swerve::request((value.into(), 1.0)) } else { request(value) };
                    pipeline.reflex(action, source, rank, |_| {});
                    interrupted = model.reflex(QueuedAction { action, origin: Origin::Reflex { source, rank }, queued: 0 });
                }
                Operation::Planned { late, step } => {
                    let (action, ticket) = (request(value), u64::from(value));
                    let epoch = if late { model.epoch.wrapping_sub(1) } else { model.epoch };
                    let reflexes: Vec<QueuedAction> =
                        pipeline.iter().filter(|entry| entry.route() == Route::REACTIVE).copied().collect();
                    let running = pipeline.running().copied();
                    pipeline.planned(action, ticket, epoch, step, |_| {});
                    if !late {
                        if step != PlanStep::APPEND {
                            interrupted = model.clear_planned();
                        }
                        if step != PlanStep::CLEAR {
                            model.arrive(QueuedAction { action, origin: Origin::Plan(ticket), queued: 0 });
                        }
                        model.replan = false;
                    }
                    // Whatever the Plan sends: the reflexes are there as before, and first.
                    let after: Vec<QueuedAction> = pipeline.iter().take(reflexes.len()).copied().collect();
                    prop_assert_eq!(after, reflexes);
                    if running.is_some_and(|entry| entry.route() == Route::REACTIVE) {
                        prop_assert_eq!(pipeline.running().copied(), running);
                    }
                }
                Operation::Next => prop_assert_eq!(pipeline.advance(), model.next()),
                Operation::Finish => prop_assert_eq!(pipeline.finish(), model.running.take()),
                Operation::Abandon => {
                    pipeline.abandon_plan(|_| {});
                    interrupted = model.clear_planned();
                    model.epoch += 1;
                    model.replan = true;
                }
            }
            prop_assert_eq!(pipeline.take_interrupted(), interrupted);
            prop_assert_eq!(pipeline.running().copied(), model.running);
            prop_assert_eq!(pipeline.epoch(), model.epoch);
            prop_assert_eq!(pipeline.wants_plan(), model.replan);
            prop_assert_eq!(pipeline.waiting().0 + pipeline.waiting().1, model.waiting.len());
        }
        loop {
            let (own, expected) = (pipeline.advance(), model.next());
            prop_assert_eq!(own, expected);
            if own.is_none() {
                break;
            }
            pipeline.finish();
            model.running = None;
        }
    }
}

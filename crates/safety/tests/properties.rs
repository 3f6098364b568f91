//! Properties of a gate under all operations.

use crate::common;

use common::*;
use proptest::prelude::*;
use slate_module::Priority;
use slate_safety::{Gate, GateMode, StopLatch, Verdict};

#[derive(Clone, Debug)]
enum Step {
    Offer(u32, Priority, f64, f64),
    Malformed(u32, Priority, usize),
    Withdraw(u32),
    Arm,
    Disarm,
    Stop,
    Reset,
    StopAgent,
    ResetAgent,
}

const SAFE: Wheels = Wheels { left: 0.25, right: 9.0 };
const RATE: f64 = 20.0;

fn step() -> impl Strategy<Value = Step> {
    let commander = 0..4_u32;
    let priority = prop_oneof![Just(Priority::Plan), Just(Priority::Teleoperation), Just(Priority::Reflex)];
    let number =
        prop_oneof![3 => -10.0..10.0, 1 => any::<f64>(), 1 => Just(f64::NAN), 1 => Just(f64::INFINITY)];
    prop_oneof![
        12 => (commander.clone(), priority.clone(), number.clone(), number)
            .prop_map(|(commander, priority, left, right)| Step::Offer(commander, priority, left, right)),
        1 => (commander.clone(), priority, 0..16_usize)
            .prop_map(|(commander, priority, size)| Step::Malformed(commander, priority, size)),
        1 => commander.prop_map(Step::Withdraw),
        3 => Just(Step::Arm),
        1 => Just(Step::Disarm),
        1 => Just(Step::Stop),
        2 => Just(Step::Reset),
        1 => Just(Step::StopAgent),
        2 => Just(Step::ResetAgent),
    ]
}

/// What may be said about a gate without knowing how it works.
#[derive(Default)]
struct Model {
    armed: bool,
    stopped: bool,
    agent_stopped: bool,
    /// Commander, priority and time of the last effective offer.
    lease: Option<(u32, Priority, u64)>,
    /// Whether that offer was usable.
    commanding: bool,
}

impl Model {
    fn passes(&self) -> bool {
        self.armed && !self.stopped && !self.agent_stopped
    }

    fn settle(&mut self, now: u64) {
        if !self.passes() {
            self.armed = false;
            self.lease = None;
        }
        self.lease = self.lease.filter(|(_, _, offered)| now - offered < TIME_TO_LIVE);
    }

    fn offer(&mut self, commander: u32, priority: Priority, usable: bool, now: u64) -> bool {
        self.settle(now);
        let free = self.lease.is_none_or(|(by, urgency, _)| by == commander || urgency < priority);
        if !self.passes() || !free {
            return false;
        }
        self.lease = Some((commander, priority, now));
        self.commanding = usable;
        usable
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_output_is_within_limits_and_rate_or_the_safe_command(
        steps in prop::collection::vec((step(), 0..60 * MILLISECOND, any::<bool>()), 1..80)
    ) {
        let latch = StopLatch::in_memory();
        let configuration = configuration()
            .limit("left", -2.0, 3.0).unwrap()
            .limit("right", -5.0, 5.0).unwrap()
            .rate_limit("right", RATE).unwrap()
            .safe(bytes(&SAFE)).unwrap()
            .stop_latch(&latch);
        let mut gate = Gate::new(configuration);
        let mut model = Model::default();
        let mut now = 0;
        let mut last = (given(&mut gate, now), now);
        let mut counted = [0_u64; 3];
        for (step, wait, look) in steps {
            now += wait;
            let offer = match &step {
                Step::Offer(commander, priority, left, right) => {
                    let usable = left.is_finite() && right.is_finite();
                    Some((gate.offer(*commander, *priority, bytes(&wheels(*left, *right)), now),
                        model.offer(*commander, *priority, usable, now)))
                }
                Step::Malformed(commander, priority, size) => Some((
                    gate.offer(*commander, *priority, &vec![0; *size], now),
                    model.offer(*commander, *priority, false, now),
                )),
                _ => None,
            };
            if let Some((verdict, takes_effect)) = offer {
                prop_assert_eq!(!matches!(verdict, Verdict::Refused(_)), takes_effect);
                counted[match verdict { Verdict::Passed => 0, Verdict::Limited => 1, Verdict::Refused(_) => 2 }] += 1;
            }
            match step {
                Step::Withdraw(commander) => {
                    gate.withdraw(commander, now);
                    model.lease = model.lease.filter(|(by, _, _)| *by != commander);
                }
                Step::Arm => {
                    let possible = !model.stopped && !model.agent_stopped;
                    prop_assert_eq!(gate.arm().is_ok(), possible);
                    model.settle(now);
                    model.armed = possible;
                }
                Step::Disarm => { gate.disarm(); model.armed = false }
                Step::Stop => { gate.stop("test"); model.stopped = true; model.armed = false }
                Step::Reset => { gate.reset(); model.stopped = false }
                Step::StopAgent => { latch.stop("test").unwrap(); model.agent_stopped = true; model.armed = false }
                Step::ResetAgent => { latch.reset().unwrap(); model.agent_stopped = false }
                _ => {}
            }
            model.settle(now);
            if !look {
                continue;
            }
            let state = gate.output(now).state;
            let output = given(&mut gate, now);
            let commanded = model.passes() && model.lease.is_some() && model.commanding;
            prop_assert_eq!(state.age.get().is_some(), commanded);
            prop_assert_eq!([state.passed, state.limited, state.refused], counted);
            let mode = match &model {
                model if model.stopped || model.agent_stopped => GateMode::STOPPED,
                model if model.armed => GateMode::ARMED,
                _ => GateMode::DISARMED,
            };
            prop_assert_eq!(state.mode, mode);
            if commanded {
                prop_assert!((-2.0..=3.0).contains(&output.left), "{:?}", output);
                prop_assert!((-5.0..=5.0).contains(&output.right), "{:?}", output);
                // The safe command lies outside the limits, and limits stand above the rate.
                let base = last.0.right.clamp(-5.0, 5.0);
                let room = RATE * (now - last.1).min(TIME_TO_LIVE) as f64 / 1e9;
                prop_assert!((output.right - base).abs() <= room + 1e-9, "{:?} after {:?}", output, last);
            } else {
                prop_assert_eq!(output, SAFE);
            }
            // The time counts from the offer, or from the last time the safe command was given.
            let since = match model.lease {
                Some((_, _, offered)) if commanded => offered,
                _ => now,
            };
            last = (output, since);
        }
    }
}

//! Arguments, and actions made of others.

use crate::common;

use serde::{Deserialize, Serialize};
use slate_interfaces::Twist2;
use slate_mapek::prelude::*;
use slate_mapek::{Arguments, ExecuteBlock, ExecuteStatus};
use slate_module::testing::Fixture;

use common::{Body, Drive, Stumble, Swerve, planned};

/// Composite action with the arguments of its parts, so that each shape can be requested.
macro_rules! composed {
    ($($name:ident: $parts:ty, $arguments:expr;)+) => {
        $(
            #[derive(Serialize, Deserialize)]
            struct $name($parts);

            impl ActionKind for $name {
                const KIND: &'static str = stringify!($name);
                type Arguments = ();

                fn start((): ()) -> Self {
                    Self(ActionKind::start($arguments))
                }

                fn children(&self, tree: &mut ActionTree) {
                    tree.child(&self.0);
                }
            }

            impl Action<Body> for $name {
                fn act(&mut self, acting: &Acting<'_, Body>) -> Step {
                    self.0.act(acting)
                }

                fn cancel(&mut self, acting: &Acting<'_, Body>) {
                    self.0.cancel(acting);
                }
            }
        )+

        repertoire! {
            enum Composed for Body as "composed" { $($name),+ }
        }
    };
}
/// Rounds of two actions.
type Rounds = Repeat<InSequence<(Drive, Swerve)>>;

composed! {
    InstantsFirst: InSequence<(Drive, Drive, Swerve)>, ((1.0, 0.0), (2.0, 0.0), (3.0, 1.0));
    FailsInBetween: InSequence<(Drive, Stumble, Swerve)>, ((1.0, 1.0), (2.0, 0.0), (3.0, 9.0));
    Both: InParallel<(Drive, Swerve)>, ((1.0, 1.0), (2.0, 2.0));
    OneFails: InParallel<(Drive, Stumble)>, ((1.0, 9.0), (2.0, 1.0));
    Twice: Repeat<Drive>, (2.0, (1.0, 1.0));
    ForEver: Repeat<Drive>, (0.0, (1.0, 1.0));
    NothingForEver: Repeat<Drive>, (0.0, (1.0, 0.0));
    Nested: InSequence<(InParallel<(Drive, Swerve)>, Rounds)>,
        (((1.0, 1.0), (2.0, 1.0)), (1.0, ((3.0, 1.0), (4.0, 1.0))));
}

/// The commands of some cycles, and the status when it last changed.
fn run(action: ActionRequest, cycles: usize) -> (Vec<Option<f64>>, ExecuteStatus, Vec<String>) {
    let mut execute = Fixture::<ExecuteBlock<Composed>>::new();
    execute.push("plan", planned(action, 1, 0));
    let mut status = ExecuteStatus::default();
    let mut trees = Vec::new();
    let mut step = || {
        execute.tick();
        if let Some(new) = execute.output::<ExecuteStatus>("status") {
            status = new;
            trees.push(status.tree.as_str().to_owned());
        }
        execute.output::<Twist2>("wheels").map(|twist| twist.linear)
    };
    let commands = (0..cycles).map(|_| step()).collect();
    (commands, status, trees)
}

#[test]
fn a_sequence_goes_on_in_the_same_step_when_a_part_is_done() {
    let (commands, status, _) = run(InstantsFirst::request(()), 2);
    assert_eq!((commands, status.completed), (vec![Some(3.0), None], 1));
}

#[test]
fn a_part_that_fails_ends_a_sequence() {
    let (commands, status, _) = run(FailsInBetween::request(()), 3);
    assert_eq!((commands, status.failed), (vec![Some(1.0), None, None], 1));
}

#[test]
fn parallel_actions_are_done_when_all_are() {
    let (commands, status, trees) = run(Both::request(()), 3);
    // Both command the same wheels; the later one has them.
    assert_eq!((commands, status.completed), (vec![Some(2.0), Some(2.0), None], 1));
    assert_eq!(trees, ["Both > (Drive | Swerve)", "Both > (Swerve)", ""]);
}

#[test]
fn when_a_parallel_action_fails_the_others_are_cancelled() {
    let (commands, status, _) = run(OneFails::request(()), 3);
    assert_eq!((commands, status.failed), (vec![Some(2.0), Some(-1000.0), None], 1));
}

#[test]
fn repeating_starts_anew_without_a_pause() {
    let (commands, status, _) = run(Twice::request(()), 3);
    assert_eq!((commands, status.completed), (vec![Some(1.0), Some(1.0), None], 1));
    let (commands, ..) = run(ForEver::request(()), 9);
    assert_eq!(commands, [Some(1.0); 9]);
}

#[test]
fn repeating_what_takes_no_time_does_not_hang() {
    let (commands, status, _) = run(NothingForEver::request(()), 3);
    assert_eq!((commands, status.running.as_str()), (vec![None; 3], "NothingForEver"));
}

#[test]
fn combinations_can_be_combined() {
    let (commands, status, trees) = run(Nested::request(()), 4);
    assert_eq!((commands, status.completed), (vec![Some(2.0), Some(3.0), Some(4.0), None], 1));
    assert_eq!(trees, ["Nested > (Drive | Swerve)", "Nested > Drive", "Nested > Swerve", ""]);
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Goal {
    x: f64,
    y: f64,
}
arguments!(Goal { x, y });

#[derive(Clone, Copy, Debug, PartialEq)]
struct Visit {
    goal: Goal,
    seconds: f64,
}
arguments!(Visit { goal: Goal, seconds: f64 });

#[test]
fn arguments_come_back_as_they_were() {
    fn round_trip<A: Arguments + PartialEq + std::fmt::Debug>(arguments: A) {
        let mut numbers = vec![0.0; A::LENGTH];
        arguments.write(&mut numbers);
        assert_eq!(A::read(&numbers), arguments);
    }
    round_trip(());
    round_trip(1.0);
    round_trip([1.0, 2.0, 3.0]);
    round_trip((1.0, [2.0, 3.0], ((4.0,), ())));
    round_trip(Visit { goal: Goal { x: 1.0, y: 2.0 }, seconds: 3.0 });
    assert_eq!(Visit::LENGTH, 3);
}

#[test]
fn a_tree_that_is_too_deep_is_cut() {
    let mut tree = ActionTree::default();
    for _ in 0..100 {
        tree.name("Turn");
    }
    assert_eq!(tree.text().as_str().len(), 252);
}

//! Actions of a robot.

mod arguments;
mod parallel;
mod repeat;
mod sequence;
mod transmission;
mod tree;

pub use arguments::Arguments;
pub use parallel::InParallel;
pub use repeat::Repeat;
pub use sequence::InSequence;
use slate_module::{Priority, Sequence, Text, Tick};
pub use transmission::Transmission;
pub use tree::{ActionTree, ParallelWriter};

use crate::ActionRequest;
use crate::message::{ARGUMENTS, KIND_LENGTH};

/// Kind of action: its name, its arguments, and its start.
///
/// The value is the action's state while it runs. It must not allocate, and is saved with the robot.
pub trait ActionKind: Sized {
    /// Name in plans and reflexes, such as `TurnAngle`.
    const KIND: &'static str;
    /// Arguments at the start.
    type Arguments: Arguments;

    /// Returns the action before its first step.
    fn start(arguments: Self::Arguments) -> Self;

    /// Renews the arguments while the action is queued or runs.
    /// Called when the reflex was sent again. Restarts by default.
    fn renew(&mut self, arguments: Self::Arguments) {
        *self = Self::start(arguments);
    }

    /// Writes the children of a macro-action: `tree.child(&self.turn)`.
    fn children(&self, tree: &mut ActionTree) {
        let _ = tree;
    }

    /// Writes this action and its children.
    fn describe(&self, tree: &mut ActionTree) {
        tree.name(Self::KIND);
        self.children(tree);
    }

    /// Returns the request of Plan and ReactiveModel.
    fn request(arguments: Self::Arguments) -> ActionRequest {
        const { assert!(Self::KIND.len() <= KIND_LENGTH, "the name of a kind of action has at most 44 bytes") };
        const { assert!(Self::Arguments::LENGTH <= ARGUMENTS, "an action takes at most 8 arguments") };
        let mut numbers = [0.0; ARGUMENTS];
        arguments.write(&mut numbers[..Self::Arguments::LENGTH]);
        ActionRequest {
            kind: Text::new(Self::KIND),
            arguments: Sequence::new(&numbers[..Self::Arguments::LENGTH]),
        }
    }
}

/// Behavior of a kind of action on a body `B`.
/// `B` is the `#[ports]` struct of the commands and inputs of the robot's actions.
///
/// A macro-action has others as fields and calls their [`act`](Action::act) in its own.
pub trait Action<B>: ActionKind {
    /// Performs a step: sends the commands, in each cycle, and returns the progress.
    fn act(&mut self, acting: &Acting<'_, B>) -> Step;

    /// Ends an action that was stepped, and is not any more.
    fn cancel(&mut self, acting: &Acting<'_, B>) {
        let _ = acting;
    }
}

/// Context of a step of an action.
pub struct Acting<'a, B> {
    /// Body: commands and inputs of the robot.
    pub body: &'a B,
    /// Priority of its commands, for [`Command::send`](slate_module::Command::send).
    pub priority: Priority,
    /// Time, random numbers, log.
    pub now: &'a Tick,
}

/// Progress of an action after a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Continues in the next cycle.
    Running,
    /// Completed.
    Done,
    /// Failed.
    Failed,
}

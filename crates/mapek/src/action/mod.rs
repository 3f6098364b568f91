//! What a robot can do.

mod arguments;
mod parallel;
mod repeat;
mod sequence;
mod telling;
mod tree;

pub use arguments::Arguments;
pub use parallel::InParallel;
pub use repeat::Repeat;
pub use sequence::InSequence;
use slate_module::{Priority, Sequence, Text, Tick};
pub use telling::Telling;
pub use tree::{ActionTree, Beside};

use crate::ActionRequest;
use crate::message::{ARGUMENTS, KIND_LENGTH};

/// A kind of action: its name, its arguments, and how one begins.
///
/// The value is the action's state while it runs. It must not allocate, and is saved with the robot.
pub trait ActionKind: Sized {
    /// The name by which plans and reflexes ask for it, such as `TurnAngle`.
    const KIND: &'static str;
    /// What it is started with.
    type Arguments: Arguments;

    /// The action before its first step.
    fn start(arguments: Self::Arguments) -> Self;

    /// Takes newer arguments while it waits or runs: the same reflex was sent again. Unless it says otherwise it
    /// starts anew.
    fn renew(&mut self, arguments: Self::Arguments) {
        *self = Self::start(arguments);
    }

    /// Writes the actions that run inside this one, for a macro-action: `tree.child(&self.turn)`.
    fn children(&self, tree: &mut ActionTree) {
        let _ = tree;
    }

    /// Writes this action and those inside it.
    fn describe(&self, tree: &mut ActionTree) {
        tree.name(Self::KIND);
        self.children(tree);
    }

    /// The action as Plan and ReactiveModel send it.
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

/// The behaviour of a kind of action on a body `B`: the `#[ports]` struct with a robot's commands and what its
/// actions read.
///
/// A macro-action has others as fields and calls their [`act`](Action::act) in its own.
pub trait Action<B>: ActionKind {
    /// One step: sends the action's commands, each cycle anew, and says whether it is finished.
    fn act(&mut self, acting: &Acting<'_, B>) -> Step;

    /// Ends an action that was stepped before and will not be any more.
    fn cancel(&mut self, acting: &Acting<'_, B>) {
        let _ = acting;
    }
}

/// With what an action acts.
pub struct Acting<'a, B> {
    /// The robot's commands and what its actions read.
    pub body: &'a B,
    /// How urgent its commands are; passed on to [`Command::send`](slate_module::Command::send).
    pub priority: Priority,
    /// Time, random numbers, log.
    pub now: &'a Tick,
}

/// How far an action is after a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// It goes on in the next cycle.
    Running,
    /// It did what it should.
    Done,
    /// It can't.
    Failed,
}

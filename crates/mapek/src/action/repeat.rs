use serde::{Deserialize, Serialize};

use super::{Acting, Action, ActionKind, ActionTree, Step};

/// Repeated action; a failure ends it.
///
/// Rounds follow each other without a pause, except that a round which takes no time ends the cycle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Repeat<A> {
    fresh: A,
    action: A,
    /// Remaining rounds; `None` for no limit.
    left: Option<u32>,
    /// Set if the round has begun in an earlier cycle.
    begun: bool,
}

impl<A: Clone> Repeat<A> {
    /// Repeats a number of times; `None` for no limit.
    pub fn new(action: A, times: Option<u32>) -> Self {
        Self { fresh: action.clone(), action, left: times, begun: false }
    }
}

impl<A: ActionKind + Clone> ActionKind for Repeat<A> {
    const KIND: &'static str = "Repeat";
    /// Number of rounds (0 for no limit), and arguments of each.
    type Arguments = (f64, A::Arguments);

    fn start((times, arguments): Self::Arguments) -> Self {
        // A float converts to the nearest integer in range.
        Self::new(A::start(arguments), (times >= 1.0).then_some(times as u32))
    }

    fn renew(&mut self, (_, arguments): Self::Arguments) {
        self.fresh = A::start(arguments);
        self.action.renew(arguments);
    }

    fn describe(&self, tree: &mut ActionTree) {
        tree.child(&self.action);
    }
}

impl<B, A: Action<B> + Clone> Action<B> for Repeat<A> {
    fn act(&mut self, acting: &Acting<'_, B>) -> Step {
        loop {
            if self.left == Some(0) {
                return Step::Done;
            }
            match self.action.act(acting) {
                Step::Running => {
                    self.begun = true;
                    return Step::Running;
                }
                Step::Failed => return Step::Failed,
                Step::Done => {}
            }
            self.left = self.left.map(|left| left - 1);
            if self.left == Some(0) {
                return Step::Done;
            }
            self.action = self.fresh.clone();
            if !std::mem::take(&mut self.begun) {
                return Step::Running;
            }
        }
    }

    fn cancel(&mut self, acting: &Acting<'_, B>) {
        if self.begun {
            self.action.cancel(acting);
        }
    }
}

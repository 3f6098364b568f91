use serde::{Deserialize, Serialize};

use super::{Acting, Action, ActionKind, ActionTree, Step};

/// Actions in sequence.
/// The next one begins in the same cycle in which one is done, and a failure ends all.
///
/// A renewal keeps the position, and passes the arguments to the remaining actions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InSequence<T> {
    actions: T,
    /// Index of the running one.
    at: u8,
}

impl<T> InSequence<T> {
    /// Returns the tuple of actions in that order.
    pub fn new(actions: T) -> Self {
        Self { actions, at: 0 }
    }
}

macro_rules! sequence {
    ($($name:ident $index:tt),+) => {
        impl<$($name: ActionKind),+> ActionKind for InSequence<($($name,)+)> {
            const KIND: &'static str = "InSequence";
            type Arguments = ($($name::Arguments,)+);

            fn start(arguments: Self::Arguments) -> Self {
                Self::new(($($name::start(arguments.$index),)+))
            }

            fn renew(&mut self, arguments: Self::Arguments) {
                $(if self.at <= $index {
                    self.actions.$index.renew(arguments.$index);
                })+
            }

            fn describe(&self, tree: &mut ActionTree) {
                match self.at {
                    $($index => tree.child(&self.actions.$index),)+
                    _ => {}
                }
            }
        }

        impl<Body, $($name: Action<Body>),+> Action<Body> for InSequence<($($name,)+)> {
            fn act(&mut self, acting: &Acting<'_, Body>) -> Step {
                $(if self.at == $index {
                    match self.actions.$index.act(acting) {
                        Step::Done => self.at += 1,
                        step => return step,
                    }
                })+
                Step::Done
            }

            fn cancel(&mut self, acting: &Acting<'_, Body>) {
                match self.at {
                    $($index => self.actions.$index.cancel(acting),)+
                    _ => {}
                }
            }
        }
    };
}
sequence!(A 0);
sequence!(A 0, B 1);
sequence!(A 0, B 1, C 2);
sequence!(A 0, B 1, C 2, D 3);
sequence!(A 0, B 1, C 2, D 3, E 4);
sequence!(A 0, B 1, C 2, D 3, E 4, F 5);

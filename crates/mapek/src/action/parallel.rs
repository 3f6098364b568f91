use serde::{Deserialize, Serialize};

use super::{Acting, Action, ActionKind, ActionTree, Step};

/// Actions in parallel: done when all are.
/// When one fails, the others are cancelled and all have failed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InParallel<T> {
    actions: T,
    /// Bit mask of the completed actions.
    done: u8,
}

impl<T> InParallel<T> {
    /// Returns the tuple of actions.
    pub fn new(actions: T) -> Self {
        Self { actions, done: 0 }
    }
}

macro_rules! parallel {
    ($($name:ident $index:tt),+) => {
        impl<$($name: ActionKind),+> ActionKind for InParallel<($($name,)+)> {
            const KIND: &'static str = "InParallel";
            type Arguments = ($($name::Arguments,)+);

            fn start(arguments: Self::Arguments) -> Self {
                Self::new(($($name::start(arguments.$index),)+))
            }

            fn renew(&mut self, arguments: Self::Arguments) {
                $(if self.done & 1 << $index == 0 {
                    self.actions.$index.renew(arguments.$index);
                })+
            }

            fn describe(&self, tree: &mut ActionTree) {
                tree.parallel(|tree| {
                    $(if self.done & 1 << $index == 0 {
                        tree.child(&self.actions.$index);
                    })+
                });
            }
        }

        impl<Body, $($name: Action<Body>),+> Action<Body> for InParallel<($($name,)+)> {
            fn act(&mut self, acting: &Acting<'_, Body>) -> Step {
                let mut failed = false;
                let mut running = false;
                $(if self.done & 1 << $index == 0 {
                    match self.actions.$index.act(acting) {
                        Step::Running => running = true,
                        Step::Done => self.done |= 1 << $index,
                        Step::Failed => {
                            self.done |= 1 << $index;
                            failed = true;
                        }
                    }
                })+
                if failed {
                    self.cancel(acting);
                    Step::Failed
                } else if running {
                    Step::Running
                } else {
                    Step::Done
                }
            }

            fn cancel(&mut self, acting: &Acting<'_, Body>) {
                $(if self.done & 1 << $index == 0 {
                    self.actions.$index.cancel(acting);
                })+
            }
        }
    };
}
parallel!(A 0);
parallel!(A 0, B 1);
parallel!(A 0, B 1, C 2);
parallel!(A 0, B 1, C 2, D 3);
parallel!(A 0, B 1, C 2, D 3, E 4);
parallel!(A 0, B 1, C 2, D 3, E 4, F 5);

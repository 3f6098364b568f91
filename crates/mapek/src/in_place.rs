use std::marker::PhantomData;

use slate_module::{Interface, Outcome, Tick};

/// Value of any size that a block has written in place.
#[derive(Debug)]
pub struct InPlace<T: ?Sized> {
    /// Number of items and capacity of the port, if the value was not written.
    refused: Option<(usize, usize)>,
    interface: PhantomData<fn() -> Box<T>>,
}

impl<T: Interface + ?Sized> InPlace<T> {
    pub(crate) fn new(done: bool, items: usize, capacity: usize) -> Self {
        Self { refused: (!done).then_some((items, capacity)), interface: PhantomData }
    }

    pub(crate) fn outcome(&self, port: &str, now: &Tick) -> Outcome {
        let Some((items, capacity)) = self.refused else { return Outcome::Ok };
        if items > capacity {
            now.error(format_args!(
                "`{port}` has room for {capacity} items and not for {items}: give it a `#[capacity({items})]`"
            ));
        } else {
            now.error(format_args!("`{port}`: the copied input has no value yet"));
        }
        Outcome::Failed
    }
}

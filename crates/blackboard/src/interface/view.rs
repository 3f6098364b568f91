use serde::{Serialize, Serializer};

use super::decode::table;
use super::{Descriptor, FieldPath, Interface, Kind, Value, clear_padding, padding};

/// A value of any interface, read through its descriptor.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    descriptor: &'static Descriptor,
    bytes: &'a [u8],
    items: usize,
}

impl<'a> View<'a> {
    /// Creates a view of `bytes`; `None` if they are too few.
    /// They hold a value of that interface with `items` tail items.
    ///
    /// Returns nothing when there are too few bytes.
    pub fn new(descriptor: &'static Descriptor, bytes: &'a [u8], items: usize) -> Option<Self> {
        let item = descriptor.tail().map_or(0, Kind::size);
        let needed = item.checked_mul(items).and_then(|tail| tail.checked_add(descriptor.size))?;
        (bytes.len() >= needed).then_some(Self { descriptor, bytes, items })
    }

    /// Creates a view of a typed value without a tail, whose padding is zeroed.
    pub fn of<T: Interface>(value: &'a mut T) -> Self {
        let data = std::ptr::from_mut(value).cast::<u8>();
        // SAFETY: the value is borrowed exclusively. Its fields are initialized, and so is its padding once it is zeroed:
        // nothing writes the value as a whole while the view lasts.
        let bytes = unsafe {
            // The host shows its own values in every few cycles, and most have none.
            if const { padding::has_gaps(T::DESCRIPTOR) } {
                clear_padding(T::DESCRIPTOR, data, 0);
            }
            std::slice::from_raw_parts(data, size_of::<T>())
        };
        Self { descriptor: T::DESCRIPTOR, bytes, items: 0 }
    }

    /// Returns the descriptor of the bytes.
    pub fn descriptor(&self) -> &'static Descriptor {
        self.descriptor
    }

    /// Returns the memory of the value.
    pub fn bytes(&self) -> &'a [u8] {
        self.bytes
    }

    /// Returns the whole value as a table.
    pub fn value(&self) -> Value {
        table(self.descriptor, self.bytes, self.items)
    }

    /// Returns the value at a path found by [`find`](super::find).
    /// `None` for an index beyond a sequence's length.
    pub fn at(&self, path: &FieldPath) -> Option<Value> {
        path.read(self.bytes, self.items)
    }
}

impl Serialize for View<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.value().serialize(serializer)
    }
}

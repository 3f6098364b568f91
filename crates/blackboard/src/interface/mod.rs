//! Type of a property: plain data with a descriptor.
//! One generic codec can walk the descriptor.
//!
//! A value is `repr(C)` memory of fixed-width fields without pointers, in which every bit pattern is valid.
//! Padding between fields is zeroed at commit, before anything but the writer sees the bytes. So it may cross a library
//! boundary or shared memory unchanged, and outlives the plugin that wrote it.
//! Its [`Descriptor`] names the fields with their types, offsets, units and documentation.

mod canonical;
mod decode;
mod descriptor;
mod difference;
mod encode;
mod hash;
mod padding;
mod path;
mod plain;
mod primitive;
mod value;
mod view;

pub use canonical::CanonicalForm;
pub use descriptor::{Constant, Descriptor, Enumeration, Field, Kind};
pub use difference::difference;
pub use encode::edit;
pub use hash::schema_hash;
pub use padding::{clear_padding, gap_before_tail};
pub use path::{AccessError, FieldPath, find};
pub use plain::{Bool, Optional, Plain, Sequence, Text};
pub use primitive::Primitive;
pub use value::Value;
pub use view::View;

use crate::Shape;

/// Type of a property: plain data with a descriptor, possibly with an unsized tail.
///
/// Implemented by the `#[interface]` macro of `slate-module`.
///
/// # Safety
/// The type is `repr(C)`, has no pointers, accepts every bit pattern, and is laid out exactly as
/// [`DESCRIPTOR`](Interface::DESCRIPTOR) says: what no field has is padding.
pub unsafe trait Interface: Send + Sync + 'static {
    /// Descriptor of the memory.
    const DESCRIPTOR: &'static Descriptor;

    /// Returns the value in `data`, with `items` tail items.
    ///
    /// # Safety
    /// `data` is aligned and readable for the whole value during the life of the result.
    unsafe fn from_raw<'a>(data: *const u8, items: usize) -> &'a Self;

    /// Returns the value in `data` for writing, with `items` tail items.
    ///
    /// # Safety
    /// As for [`from_raw`](Interface::from_raw), writable, and without another reference.
    unsafe fn from_raw_mut<'a>(data: *mut u8, items: usize) -> &'a mut Self;
}

/// Returns the layout of interface `T` with room for `capacity` tail items.
pub fn shape_of<T: Interface + ?Sized>(capacity: usize) -> Shape {
    T::DESCRIPTOR.shape(capacity)
}

// SAFETY: nothing has no bytes that could be wrong.
unsafe impl Interface for () {
    const DESCRIPTOR: &'static Descriptor = &Descriptor {
        name: "Nothing",
        doc: "No value.",
        ros: "std_msgs/msg/Empty",
        fields: &[],
        size: 0,
        align: 1,
        hash: schema_hash("Nothing", &[]),
    };

    #[inline]
    unsafe fn from_raw<'a>(_: *const u8, _: usize) -> &'a Self {
        &()
    }

    #[inline]
    unsafe fn from_raw_mut<'a>(_: *mut u8, _: usize) -> &'a mut Self {
        // SAFETY: a reference to nothing may point anywhere.
        unsafe { std::ptr::NonNull::<()>::dangling().as_mut() }
    }
}

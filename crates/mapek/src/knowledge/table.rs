//! Facts as a property: statements of a robot, or of its team.
#![allow(unsafe_code, reason = "an interface that is generic is laid out by hand")]

use std::ops::Deref;

use slate_interfaces::{FactHead, FactTableHead};
use slate_module::blackboard::interface::{
    Descriptor, Field, Interface, Kind, Plain, clear_padding, schema_hash,
};
use xxhash_rust::xxh3::xxh3_64;

/// A fact in a [`FactTable`].
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Stated<T> {
    /// Key, origin and time.
    pub head: FactHead,
    /// Stated value.
    pub value: T,
}

/// Facts of a topic by key and origin: statements of a robot, or of its team.
///
/// A block states facts by an [`Output`](slate_module::Output) of this type, for which [`Statements`](super::Statements)
/// keep them, and reads the team's knowledge by an [`Input`](slate_module::Input), of which
/// [`WorldModel::replace`](super::WorldModel::replace) shows the views. The values are of any type that fields of interfaces may have
/// and that is aligned to at most 8 bytes.
#[repr(C)]
#[derive(Debug)]
pub struct FactTable<T> {
    /// Head of the table.
    pub head: FactTableHead,
    /// The facts, by key and then by origin.
    pub facts: [Stated<T>],
}

/// Access to the facts.
impl<T> Deref for FactTable<T> {
    type Target = [Stated<T>];

    fn deref(&self) -> &[Stated<T>] {
        &self.facts
    }
}

/// Returns a field at the offset of a field of another descriptor.
const fn same(descriptor: &'static Descriptor, i: usize) -> Field {
    let Field { name, doc, unit, offset, kind } = &descriptor.fields[i];
    Field { name, doc, unit, offset: *offset, kind: *kind }
}

const HEAD: &Descriptor = FactHead::DESCRIPTOR;
const TABLE: &Descriptor = FactTableHead::DESCRIPTOR;

impl<T: Plain> Stated<T> {
    const ALIGNED: () = assert!(align_of::<T>() <= 8, "the value of a fact is aligned to at most 8 bytes");
    const FIELDS: &'static [Field] = &[
        same(HEAD, 0),
        same(HEAD, 1),
        same(HEAD, 2),
        same(HEAD, 3),
        same(HEAD, 4),
        same(HEAD, 5),
        same(HEAD, 6),
        same(HEAD, 7),
        same(HEAD, 8),
        same(HEAD, 9),
        Field { name: "value", doc: "Stated value.", unit: "", offset: HEAD.size, kind: T::KIND },
    ];
    const DESCRIPTOR: &'static Descriptor = &Descriptor {
        name: "Fact",
        doc: "Statement of one robot about one thing.",
        ros: "",
        fields: Self::FIELDS,
        size: size_of::<Self>(),
        align: 8,
        hash: schema_hash("Fact", Self::FIELDS),
    };
    const ITEM: &'static Kind = &Kind::Nested(Self::DESCRIPTOR);
}

const _: () = assert!(HEAD.fields.len() == 10 && TABLE.fields.len() == 3, "all fields are listed");

impl<T: Plain> FactTable<T> {
    /// Returns a hash of the facts.
    pub(super) fn hash(&mut self) -> u64 {
        let (first, size) = (self.facts.as_mut_ptr().cast::<u8>(), size_of_val(&self.facts));
        for i in 0..self.facts.len() {
            // SAFETY: the fact lies in the table, which is borrowed exclusively.
            unsafe { clear_padding(Stated::<T>::DESCRIPTOR, first.add(i * size_of::<Stated<T>>()), 0) };
        }
        // SAFETY: fields are initialized, and so is the padding now.
        xxh3_64(unsafe { std::slice::from_raw_parts(first, size) })
    }

    const FIELDS: &'static [Field] = &[
        same(TABLE, 0),
        same(TABLE, 1),
        same(TABLE, 2),
        Field {
            name: "facts",
            doc: "The facts, by key and then by origin.",
            unit: "",
            offset: TABLE.size,
            kind: Kind::Tail(Stated::<T>::ITEM),
        },
    ];
}

// SAFETY: `repr(C)`; a head of 16 bytes that is aligned to 8, and items with the same alignment, as `ALIGNED` asserts. Both
// are plain.
unsafe impl<T: Plain> Interface for FactTable<T> {
    const DESCRIPTOR: &'static Descriptor = {
        let () = Stated::<T>::ALIGNED;
        &Descriptor {
            name: "FactTable",
            doc: "Facts about one topic, by key and origin.",
            ros: "",
            fields: Self::FIELDS,
            size: TABLE.size,
            align: 8,
            hash: schema_hash("FactTable", Self::FIELDS),
        }
    };

    unsafe fn from_raw<'a>(data: *const u8, items: usize) -> &'a Self {
        // SAFETY: passed on to the caller.
        unsafe { &*(std::ptr::slice_from_raw_parts(data, items) as *const Self) }
    }

    unsafe fn from_raw_mut<'a>(data: *mut u8, items: usize) -> &'a mut Self {
        // SAFETY: passed on to the caller.
        unsafe { &mut *(std::ptr::slice_from_raw_parts_mut(data, items) as *mut Self) }
    }
}

//! Layouts that plugins of the same version of a service rely on.

use std::mem::offset_of;

use super::*;
use crate::table::{Bytes, Sink};

/// Returns the size and alignment of a type.
fn size<T>() -> String {
    format!("{} bytes, aligned to {}\n", size_of::<T>(), align_of::<T>())
}

/// Appends a name and a layout to a text.
fn add(all: &mut String, name: &str, layout: &str) {
    *all += &format!("{name}: {layout}");
}

/// Appends a structure that calls pass, with the offsets of its fields.
macro_rules! structure {
    ($all:ident, $name:ty $(, $field:ident)+) => {
        let mut layout = size::<$name>();
        $(layout += &format!("  {} at {}\n", stringify!($field), offset_of!($name, $field));)+
        add(&mut $all, stringify!($name), &layout);
    };
}

/// Appends a service of the host, with its hash.
macro_rules! services {
    ($all:ident, $($name:ident),+) => {$(
        let Descriptor { name, hash, .. } = $name::DESCRIPTOR;
        add(&mut $all, &format!("{name}, {hash:016x}"), &$name::layout());
    )+};
}

/// Pins the layouts, by which plugins and hosts of other builds agree.
/// When it fails, raise the version in the name of each service that uses what has changed.
#[test]
#[cfg(target_pointer_width = "64")]
fn layouts_stay_as_their_versions_promise() {
    let mut all = String::new();
    services!(all, Actuators, BlackBoard, Logger, MainLoop, Network, Plugins, Settings);
    services!(all, Synchronization, Threads, TimeSource, Transforms);
    add(&mut all, "Stop", &Stop::layout());
    structure!(all, Bytes, data, length);
    structure!(all, Sink, context, write);
    structure!(all, ActuatorState, mode, priority, is_mine, reserved);
    structure!(all, PropertyValue, data, items, stamp, is_new, has_writer);
    structure!(all, BoardEvent, kind, reserved, generation, missed);
    structure!(all, StageTable, name, members, member_count, timeout);
    structure!(all, PolicyTable, owner, next, end);
    structure!(all, LoopPlace, now, cycle);
    add(&mut all, "NetworkAddress", &size::<NetworkAddress>());
    structure!(all, ThreadBody, data, run, discard);
    structure!(all, RigidTransform, translation, rotation);
    structure!(all, ProviderTable, context, provide, withdraw);
    assert_eq!(all, include_str!("layouts.txt"), "expected in layouts.txt:\n{all}");
}

#[repr(C)]
struct Short(u32);
// SAFETY: plain data without calls.
unsafe impl Service for Short {
    const DESCRIPTOR: &'static Descriptor = &service::<Self>("sample 1", "A sample.");
}

#[repr(C)]
struct Long(u32, u32);
// SAFETY: as above.
unsafe impl Service for Long {
    const DESCRIPTOR: &'static Descriptor = &service::<Self>("sample 1", "A sample.");
}

#[repr(C)]
struct Wide(u64);
// SAFETY: as above.
unsafe impl Service for Wide {
    const DESCRIPTOR: &'static Descriptor = &service::<Self>("sample 1", "A sample.");
}

#[test]
fn tables_of_other_layouts_are_other_services() {
    let hashes = [Short::DESCRIPTOR, Long::DESCRIPTOR, Wide::DESCRIPTOR].map(|descriptor| descriptor.hash);
    assert!(hashes[0] != hashes[1], "the size differs");
    assert!(hashes[1] != hashes[2], "the alignment differs");
}

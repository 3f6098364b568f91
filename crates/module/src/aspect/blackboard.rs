use std::marker::PhantomData;

use slate_blackboard::Stamp;
use slate_blackboard::interface::{Descriptor, Interface, View};

use super::{Effect, HostedService, Service, call_table, service};
use crate::table::{Bytes, DONE, Sink};
use crate::{Refusal, portable};

call_table! {
    /// Access to properties chosen at run time, by path and interface.
    /// Links are better for everything that configuration can say.
    ///
    /// Values read are the same during a whole tick, and values written are visible after it. The handles belong to the
    /// host: a path is opened at its first use, and closed with the module.
    pub struct BlackBoard {
        /// Reads the newest value of a path of that schema; [`ABSENT`] if none exists.
        fn read(Bytes, u64, *mut PropertyValue, *const Sink) -> i32;
        /// Writes a path.
        /// The interface is only read when the path is opened, and may be left out before that, for which the answer is
        /// [`DESCRIBE`].
        fn write(Bytes, u64, Bytes, Bytes, usize, *const Sink) -> i32;
        /// Lists the paths that match a pattern, a line each.
        /// Only those of that schema, or all for 0.
        fn matching(Bytes, u64, *const Sink) -> i32;
        /// Returns the next event of the properties that match a pattern.
        /// Events count from its first use on.
        fn event(Bytes, *mut BoardEvent, *const Sink) -> i32;
    }
}

/// Absence of a property, or of an event.
pub const ABSENT: i32 = 2;
/// Request to describe the interface.
pub const DESCRIBE: i32 = 3;

// SAFETY: plain C data; the host gives each module a service of its own, which is used in the module's tick alone.
unsafe impl Service for BlackBoard {
    const DESCRIPTOR: &'static Descriptor =
        &service::<Self>("blackboard 1", "Opens properties at run time, by path and interface.");
}

impl HostedService for BlackBoard {
    const EFFECT: Effect = Effect::ReadsAndWrites;
}

/// Value as the host shows it.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct PropertyValue {
    /// Value; null before the first write.
    pub data: *const u8,
    /// Number of tail items.
    pub items: usize,
    /// Stamp of the write.
    pub stamp: Stamp,
    /// 1 if no earlier tick has read it.
    pub is_new: u32,
    /// 1 if it has a writer now.
    pub has_writer: u32,
}

/// Event of a property.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BoardEvent {
    /// Kind of the event: [`BoardEvent::ADDED`] or another one.
    pub kind: u32,
    /// Reserved.
    pub reserved: u32,
    /// Generation of a writer.
    pub generation: u64,
    /// Events that were lost before this one.
    pub missed: u64,
}

impl BoardEvent {
    /// Property added.
    pub const ADDED: u32 = 1;
    /// Property removed.
    pub const REMOVED: u32 = 2;
    /// Writer added.
    pub const WRITER_ADDED: u32 = 3;
    /// Writer removed.
    pub const WRITER_REMOVED: u32 = 4;
    /// Reader added.
    pub const READER_ADDED: u32 = 5;
    /// Reader removed.
    pub const READER_REMOVED: u32 = 6;
}

/// Value of a property, the same during a whole tick.
#[derive(Debug)]
pub struct Sample<'a, T: Interface + ?Sized> {
    board_value: PropertyValue,
    value: PhantomData<&'a T>,
}

impl<T: Interface + ?Sized> Sample<'_, T> {
    /// Returns the stamp of the write.
    pub fn stamp(&self) -> Stamp {
        self.board_value.stamp
    }

    /// Returns true if this module's last tick did not read it.
    pub fn is_new(&self) -> bool {
        self.board_value.is_new != 0
    }

    /// Returns true if the property has a writer now.
    pub fn has_writer(&self) -> bool {
        self.board_value.has_writer != 0
    }
}

impl<T: Interface + ?Sized> std::ops::Deref for Sample<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        // SAFETY: the host shows a value of this interface, and keeps it during the tick.
        unsafe { T::from_raw(self.board_value.data, self.board_value.items) }
    }
}

impl BlackBoard {
    /// Returns the newest value at a path of this agent, such as `/localizer/pose`.
    /// `None` if no property exists there, or it was never written.
    ///
    /// # Errors
    /// When the property is of another interface, or serves no more readers.
    pub fn read<T: Interface + ?Sized>(&self, path: &str) -> Result<Option<Sample<'_, T>>, Refusal> {
        let mut value = PropertyValue {
            data: std::ptr::null(),
            items: 0,
            stamp: Stamp::default(),
            is_new: 0,
            has_writer: 0,
        };
        let schema = T::DESCRIPTOR.hash;
        // SAFETY: everything lives during the call.
        let (code, reason) = call_with_sink(|sink| unsafe {
            (self.read)(self.context, Bytes::of(path), schema, &raw mut value, sink)
        });
        match code {
            DONE if value.data.is_null() => Ok(None),
            DONE => Ok(Some(Sample { board_value: value, value: PhantomData })),
            ABSENT => Ok(None),
            _ => Err(Refusal(reason)),
        }
    }

    /// Writes a property, which readers see after this tick.
    /// A path without a leading slash lies below the module's own, such as `/tracker/object-1`; another one must not
    /// lie below another module's.
    ///
    /// # Errors
    /// When the path has another writer or interface, or belongs to another module.
    pub fn write<T: Interface + Copy>(&self, path: &str, value: &T) -> Result<(), Refusal> {
        let mut value = *value;
        let data = View::of(&mut value).bytes();
        let data = Bytes { data: data.as_ptr(), length: data.len() };
        let write = |interface: &[u8]| {
            let interface = Bytes { data: interface.as_ptr(), length: interface.len() };
            let schema = T::DESCRIPTOR.hash;
            // SAFETY: everything lives during the call.
            call_with_sink(|sink| unsafe {
                (self.write)(self.context, Bytes::of(path), schema, interface, data, 0, sink)
            })
        };
        let (mut code, mut reason) = write(&[]);
        if code == DESCRIBE {
            (code, reason) = write(&portable::encode_interface(T::DESCRIPTOR)?);
        }
        if code == DONE { Ok(()) } else { Err(Refusal(reason)) }
    }

    /// Returns the paths of properties of an interface that match a pattern.
    /// `*` stands for one part of a path, `**` for any number of parts.
    ///
    /// # Errors
    /// When it is not a pattern.
    pub fn matching<T: Interface + ?Sized>(&self, pattern: &str) -> Result<Vec<String>, Refusal> {
        let schema = T::DESCRIPTOR.hash;
        // SAFETY: everything lives during the call.
        let (code, text) =
            call_with_sink(|sink| unsafe { (self.matching)(self.context, Bytes::of(pattern), schema, sink) });
        if code == DONE { Ok(text.lines().map(str::to_owned).collect()) } else { Err(Refusal(text)) }
    }

    /// Returns the next event of the properties that match a pattern, with the path.
    /// Events count from the first call on.
    ///
    /// # Errors
    /// When it is not a pattern.
    pub fn event(&self, pattern: &str) -> Result<Option<(String, BoardEvent)>, Refusal> {
        let mut event = BoardEvent::default();
        // SAFETY: everything lives during the call.
        let (code, text) = call_with_sink(|sink| unsafe {
            (self.event)(self.context, Bytes::of(pattern), &raw mut event, sink)
        });
        match code {
            DONE => Ok(Some((text, event))),
            ABSENT => Ok(None),
            _ => Err(Refusal(text)),
        }
    }
}

/// Makes a call of a service with a sink for text; returns its result and the text.
pub fn call_with_sink(call: impl FnOnce(*const Sink) -> i32) -> (i32, String) {
    let mut written = Vec::new();
    let sink = Sink::into(&mut written);
    let code = call(&raw const sink);
    (code, String::from_utf8_lossy(&written).into_owned())
}

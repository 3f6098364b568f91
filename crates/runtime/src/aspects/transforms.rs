//! Aspect [`Transforms`]: frame trees.
//! Each module has one, which receives the transforms on the board.

use std::sync::Arc;

use slate_blackboard::channel::{Policy, QueueReader, Start};
use slate_blackboard::interface::{Descriptor, Interface};
use slate_blackboard::{Access, Board, Event, Observer, Property, Store};
use slate_interfaces::Transform;
use slate_module::aspect::{ABSENT, LATEST, RigidTransform, Transforms};
use slate_module::table::{Bytes, DONE, REFUSED, Sink};
use slate_sorted::SortedMap;
use slate_transforms::{FrameTree, SetError};

use super::calls::{every_path, name, say};
use super::{HostService, ServiceContext, in_place};

/// Most events of the board that wait for a module.
/// Beyond that it looks at all properties again.
const EVENTS: usize = 256;
/// Most properties that are read.
const SOURCES: usize = 256;
/// Minimum depth of a property of transforms, in values.
/// A slow module then misses no value of a fast one.
const DEPTH: usize = 64;
/// Most modules that read a property beside those linked to it.
const MODULES: u16 = 16;

/// Returns the store of a property, extended so that frame trees can follow it.
pub(crate) fn followed(descriptor: &Descriptor, mut store: Store) -> Store {
    if descriptor.hash == Transform::DESCRIPTOR.hash {
        store.depth = store.depth.max(DEPTH);
        store.budget.queues = store.budget.queues.saturating_add(MODULES);
    }
    store
}

struct TransformService {
    table: Transforms,
    board: Arc<Board>,
    frames: FrameTree,
    /// Sources by path, so that they are always read in the same order.
    sources: SortedMap<Arc<str>, FrameSource>,
    changes: Observer,
    /// Number of lost events; `None` before the first look.
    missed: Option<u64>,
    /// Last property that could not be used.
    /// It is part of the answer to a lookup of a missing frame.
    unused: Option<(Arc<str>, Unused)>,
}

struct FrameSource {
    property: Arc<Property>,
    reader: QueueReader,
}

/// Reason for which a property is not part of the tree.
enum Unused {
    Refused(SetError),
    NoReader(String),
    TooMany,
}

// SAFETY: the table's context is the service itself, which only the thread that runs the module uses.
unsafe impl Send for TransformService {}

pub(super) fn make(service_context: &ServiceContext, _: &Arc<str>) -> Box<dyn HostService> {
    in_place(|context| TransformService {
        // SAFETY: the context is the service, in which the table stays; these are its calls.
        table: unsafe { Transforms::new(context, lookup, latest_common_time, frames) },
        board: Arc::clone(&service_context.board),
        frames: FrameTree::default(),
        sources: SortedMap::new(),
        changes: service_context.board.observe(&every_path(), EVENTS, None),
        missed: None,
        unused: None,
    })
}

impl HostService for TransformService {
    fn table(&self) -> *const u8 {
        (&raw const self.table).cast()
    }

    fn prepare(&mut self, _: u64) {
        self.follow();
        for (path, FrameSource { reader, .. }) in &mut self.sources {
            // More than what is kept is not there, whatever the writer does meanwhile. Readers that skip are never
            // evicted.
            for _ in 0..DEPTH {
                if !reader.pull().is_ok_and(|count| count > 0) {
                    break;
                }
                for loan in reader.window() {
                    // SAFETY: the property is of this interface.
                    let transform = unsafe { Transform::from_raw(loan.as_ptr(), loan.items()) };
                    if let Err(error) = self.frames.apply(transform) {
                        self.unused = Some((Arc::clone(path), Unused::Refused(error)));
                    }
                }
            }
            reader.release();
        }
    }
}

impl TransformService {
    /// Adds new properties of transforms, and removes vanished ones.
    fn follow(&mut self) {
        let missed = self.changes.missed();
        let all = self.missed != Some(missed);
        self.missed = Some(missed);
        while let Some(event) = self.changes.next() {
            match event {
                Event::Appeared(path) if !all => {
                    if let Some((property, field)) = self.board.get(&path)
                        && field.is_empty()
                    {
                        self.open(&property);
                    }
                }
                Event::Vanished(path) => drop(self.sources.remove(&path)),
                _ => {}
            }
        }
        if all {
            let properties = self.board.matching_type(Transform::DESCRIPTOR.name, &every_path());
            // Vanished properties are closed; others are not reopened, as that makes events too.
            self.sources
                .retain(|_, source| properties.iter().any(|other| Arc::ptr_eq(other, &source.property)));
            properties.iter().for_each(|property| self.open(property));
        }
    }

    fn open(&mut self, property: &Arc<Property>) {
        // An input without a link has no frame.
        if property.descriptor().hash != Transform::DESCRIPTOR.hash || property.access() != Access::Output {
            return;
        }
        let path: Arc<str> = property.path().into();
        let Some(channel) = property.channel().filter(|_| !self.sources.contains_key(&path)) else { return };
        if self.sources.len() >= SOURCES {
            self.unused = Some((path, Unused::TooMany));
            return;
        }
        match channel.queue(Policy::Skip, Start::Oldest) {
            Ok(reader) => {
                drop(self.sources.insert(path, FrameSource { property: Arc::clone(property), reader }));
            }
            Err(error) => self.unused = Some((path, Unused::NoReader(error.to_string()))),
        }
    }

    /// Returns the reason of a failed lookup, with its likely cause.
    fn reason(&self, error: &dyn std::fmt::Display) -> String {
        match &self.unused {
            None => error.to_string(),
            Some((path, Unused::Refused(cause))) => format!("{error}; of /{path} was refused: {cause}"),
            Some((path, Unused::NoReader(cause))) => format!("{error}; /{path} can't be read: {cause}"),
            Some((path, Unused::TooMany)) => {
                format!("{error}; /{path} is not read, as {SOURCES} properties are read already")
            }
        }
    }

    fn lookup(&self, target: &str, source: &str, time: u64) -> Result<RigidTransform, String> {
        let found = match time {
            LATEST => self.frames.lookup_latest(target, source),
            time => self.frames.lookup(target, source, time),
        };
        let place = found.map_err(|error| self.reason(&error))?;
        let (at, turn) = (place.translation.vector, place.rotation.coords);
        Ok(RigidTransform { translation: at.into(), rotation: turn.into() })
    }
}

unsafe extern "C" fn lookup(
    context: *mut (),
    target: Bytes,
    source: Bytes,
    time: u64,
    place: *mut RigidTransform,
    sink: *const Sink,
) -> i32 {
    // SAFETY: the context is the service, which the module's tick uses alone; the rest lives during the call.
    unsafe {
        match (*context.cast::<TransformService>()).lookup(name(target), name(source), time) {
            Ok(found) => {
                place.write(found);
                DONE
            }
            Err(reason) => {
                say(sink, &reason);
                REFUSED
            }
        }
    }
}

unsafe extern "C" fn latest_common_time(
    context: *mut (),
    target: Bytes,
    source: Bytes,
    time: *mut u64,
    sink: *const Sink,
) -> i32 {
    // SAFETY: as for `lookup`.
    unsafe {
        let service = &*context.cast::<TransformService>();
        match service.frames.latest_common_time(name(target), name(source)) {
            Ok(Some(latest)) => {
                time.write(latest);
                DONE
            }
            Ok(None) => ABSENT,
            Err(error) => {
                say(sink, &service.reason(&error));
                REFUSED
            }
        }
    }
}

unsafe extern "C" fn frames(context: *mut (), sink: *const Sink) -> i32 {
    // SAFETY: as for `lookup`.
    unsafe {
        for frame in (*context.cast::<TransformService>()).frames.frames() {
            say(sink, frame);
            say(sink, "\n");
        }
    }
    DONE
}

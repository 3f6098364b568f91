//! Aspect [`BlackBoard`]: handles opened at run time, by path.

use std::sync::Arc;

use slate_blackboard::channel::{Budget, Latest, Writer};
use slate_blackboard::interface::CanonicalForm;
use slate_blackboard::{Access, Board, Event, Observer, Pattern, Property, Store};
use slate_module::aspect::{ABSENT, BlackBoard, BoardEvent, DESCRIBE, PropertyValue};
use slate_module::decode_interface;
use slate_module::role::TRUTH;
use slate_module::table::{Bytes, DONE, REFUSED, Sink};
use slate_sorted::SortedMap;

use super::calls::{every_path, say, text};
use super::{HostService, ServiceContext, followed, hash, in_place};
use slate_engine::digest::Digest;
use slate_engine::runner::AlignedMemory;

/// Most events that wait for a module.
const EVENTS: usize = 256;
/// Readers of a property that a module opens.
const BUDGET: Budget = Budget { latest: 16, queues: 4, window: 16 };

struct BlackboardService {
    table: BlackBoard,
    board: Arc<Board>,
    module: Arc<str>,
    readers: SortedMap<String, OpenReader>,
    writers: SortedMap<String, OpenWriter>,
    observers: SortedMap<String, Observer>,
    /// Observer of paths that get another property.
    changes: Observer,
    tick: u64,
}

struct OpenReader {
    property: Arc<Property>,
    reader: Latest,
    /// Tick of the last look, and true if it saw a new value.
    reported: (u64, bool),
}

struct OpenWriter {
    property: Arc<Property>,
    writer: Writer,
    form: CanonicalForm,
    /// Value that this tick writes.
    value: AlignedMemory,
    size: usize,
    set: bool,
    index: u32,
}

// SAFETY: the table's context is the service itself, which only the thread that runs the module uses.
unsafe impl Send for BlackboardService {}

pub(super) fn make(service_context: &ServiceContext, module: &Arc<str>) -> Box<dyn HostService> {
    in_place(|context| BlackboardService {
        // SAFETY: the context is the service, in which the table stays; these are its calls.
        table: unsafe { BlackBoard::new(context, read, write, matching, event) },
        board: Arc::clone(&service_context.board),
        module: Arc::clone(module),
        readers: SortedMap::new(),
        writers: SortedMap::new(),
        observers: SortedMap::new(),
        changes: service_context.board.observe(&every_path(), EVENTS, None),
        tick: 1,
    })
}

impl HostService for BlackboardService {
    fn table(&self) -> *const u8 {
        (&raw const self.table).cast()
    }

    fn prepare(&mut self, _: u64) {
        self.tick += 1;
        let missed = self.changes.missed();
        for event in &mut self.changes {
            if let Event::Vanished(path) = event {
                self.readers.remove(&*path);
            }
        }
        if missed > 0 && !self.readers.is_empty() {
            // Some of them may have vanished unseen.
            let board = &self.board;
            self.readers.retain(|path, open| {
                board.get(path).is_some_and(|(property, _)| Arc::ptr_eq(&property, &open.property))
            });
        }
    }

    fn commit(&mut self, now: u64, mut digest: Option<&mut Digest>) {
        for open in self.writers.values_mut().filter(|open| open.set) {
            open.set = false;
            // SAFETY: the memory has that size, and is not shared.
            let value = unsafe { open.form.canonical(open.value.as_mut_ptr(), open.size, 0) };
            if let Some(digest) = digest.as_deref_mut() {
                digest.add(open.index, value);
            }
            // Only a recorder in lockstep may hold a writer up; its readers then find nothing new.
            let _ = open.writer.write(value, 0, now);
        }
    }

    fn abandon(&mut self) {
        self.writers.values_mut().for_each(|open| open.set = false);
    }
}

impl Drop for BlackboardService {
    fn drop(&mut self) {
        for (path, open) in std::mem::take(&mut self.writers) {
            drop(open.writer);
            // Values of other readers do not change.
            if open.property.readers() == 0 {
                // It was there a moment ago.
                let _ = self.board.remove(&path);
            }
        }
    }
}

/// Refusal in words, or a missing property.
enum Not {
    There,
    Described,
    Allowed(String),
}

impl From<String> for Not {
    fn from(reason: String) -> Self {
        Self::Allowed(reason)
    }
}

impl BlackboardService {
    fn path(&self, path: &str) -> String {
        match path.strip_prefix('/') {
            Some(absolute) => absolute.into(),
            None => format!("{}/{path}", self.module),
        }
    }

    fn read(&mut self, path: &str, schema: u64) -> Result<PropertyValue, Not> {
        let tick = self.tick;
        let known = path.strip_prefix('/').is_some_and(|path| self.readers.contains_key(path));
        let own;
        let path = if known {
            path.trim_start_matches('/')
        } else {
            own = self.path(path);
            if !self.readers.contains_key(&own) {
                let open = self.open_reader(&own)?;
                self.readers.insert(own.clone(), open);
            }
            &own
        };
        let Some(open) = self.readers.get_mut(path) else { return Err(Not::There) };
        let descriptor = open.property.descriptor();
        if descriptor.hash != schema {
            return Err(format!(
                "/{path} is {} {:016x}, not {schema:016x}",
                descriptor.name, descriptor.hash
            )
            .into());
        }
        if open.reported.0 != tick {
            open.reported = (tick, open.reader.refresh());
        }
        let has_writer = open.property.has_writer().into();
        let nothing = PropertyValue {
            data: std::ptr::null(),
            items: 0,
            stamp: Default::default(),
            is_new: 0,
            has_writer,
        };
        Ok(open.reader.value().map_or(nothing, |loan| PropertyValue {
            data: loan.as_ptr(),
            items: loan.items(),
            stamp: loan.stamp(),
            is_new: open.reported.1.into(),
            has_writer,
        }))
    }

    /// Returns true if the module's outputs are ground truth.
    /// This is the case for the simulator and for referees.
    fn is_referee(&self) -> bool {
        let own = Pattern::parse(&format!("{}/**", self.module));
        own.is_ok_and(|own| self.board.matching(&own).iter().any(|property| property.part() == TRUTH))
    }

    fn open_reader(&self, path: &str) -> Result<OpenReader, Not> {
        let (property, field) = self.board.get(path).ok_or(Not::There)?;
        if !field.is_empty() {
            return Err(format!("/{path} is a field; open /{} and look at it", property.path()).into());
        }
        if property.part() == TRUTH && !self.is_referee() {
            return Err(format!(
                "/{path} is ground truth, which only referees read: give this module an input with the role `truth`"
            )
            .into());
        }
        let channel = property.channel().ok_or_else(|| format!("/{path} receives messages"))?;
        let reader = channel.latest().map_err(|error| format!("/{path}: {error}"))?;
        Ok(OpenReader { reader, reported: (0, false), property })
    }

    fn write(&mut self, path: &str, schema: u64, interface: &[u8], value: &[u8]) -> Result<(), Not> {
        let path = self.path(path);
        if !self.writers.contains_key(&path) {
            if interface.is_empty() {
                return Err(Not::Described);
            }
            let open = self.open_writer(&path, interface)?;
            self.writers.insert(path.clone(), open);
        }
        let Some(open) = self.writers.get_mut(&path) else { return Err(Not::There) };
        let descriptor = open.property.descriptor();
        if descriptor.hash != schema || value.len() != open.size {
            return Err(format!(
                "/{path} is {} {:016x}, not {schema:016x}",
                descriptor.name, descriptor.hash
            )
            .into());
        }
        // SAFETY: the memory has that size, and is not shared.
        unsafe { open.value.as_mut_ptr().copy_from_nonoverlapping(value.as_ptr(), value.len()) };
        open.set = true;
        Ok(())
    }

    fn open_writer(&self, path: &str, interface: &[u8]) -> Result<OpenWriter, Not> {
        let descriptor = decode_interface(interface).map_err(|refusal| refusal.0)?;
        let own = path.strip_prefix(&*self.module).is_some_and(|rest| rest.starts_with('/'));
        // Every module has parameters.
        let is_module = |name: &str| self.board.get(&format!("{name}/params")).is_some();
        if !own
            && let Some(owner) =
                path.match_indices('/').map(|(end, _)| &path[..end]).find(|name| is_module(name))
        {
            return Err(format!("/{path} lies below /{owner}, which is another module").into());
        }
        let property = match self.board.find(path) {
            Ok((property, field)) if field.is_empty() && property.path() == path => {
                if property.descriptor().hash != descriptor.hash {
                    let found = property.descriptor();
                    return Err(format!(
                        "/{path} is {} {:016x}, not {} {:016x}",
                        found.name, found.hash, descriptor.name, descriptor.hash
                    )
                    .into());
                }
                property
            }
            _ => {
                let store = followed(descriptor, Store { capacity: 0, depth: 1, budget: BUDGET });
                let doc = format!("Opened by {} at run time.", self.module);
                let added = self.board.add_channel(path, &doc, descriptor, store, Access::Output);
                added.map_err(|error| error.to_string())?
            }
        };
        let channel = property.channel().ok_or_else(|| format!("/{path} receives messages"))?;
        let writer = channel.writer().map_err(|error| format!("/{path}: {error}"))?;
        Ok(OpenWriter {
            writer,
            form: CanonicalForm::new(descriptor),
            value: AlignedMemory::zeroed(descriptor.size),
            size: descriptor.size,
            set: false,
            index: hash(path),
            property,
        })
    }

    fn matching(&self, pattern: &str, schema: u64) -> Result<String, String> {
        let pattern = Pattern::parse(pattern).map_err(|error| error.to_string())?;
        let found = self.board.matching(&pattern);
        let fits = found.iter().filter(|property| schema == 0 || property.descriptor().hash == schema);
        Ok(fits.map(|property| format!("/{}\n", property.path())).collect())
    }

    fn event(&mut self, pattern: &str) -> Result<Option<(Arc<str>, BoardEvent)>, String> {
        if !self.observers.contains_key(pattern) {
            let parsed = Pattern::parse(pattern).map_err(|error| error.to_string())?;
            self.observers.insert(pattern.into(), self.board.observe(&parsed, EVENTS, None));
        }
        let Some(observer) = self.observers.get_mut(pattern) else { return Ok(None) };
        let missed = observer.missed();
        Ok(observer.next().map(|event| {
            let (kind, generation) = match event {
                Event::Appeared(_) => (BoardEvent::ADDED, 0),
                Event::Vanished(_) => (BoardEvent::REMOVED, 0),
                Event::WriterCame(_, generation) => (BoardEvent::WRITER_ADDED, generation),
                Event::WriterLeft(_, generation) => (BoardEvent::WRITER_REMOVED, generation),
                Event::ReaderCame(_) => (BoardEvent::READER_ADDED, 0),
                Event::ReaderLeft(_) => (BoardEvent::READER_REMOVED, 0),
            };
            (Arc::clone(event.path()), BoardEvent { kind, generation, missed, reserved: 0 })
        }))
    }
}

/// # Safety
/// The sink is as the module made it.
unsafe fn code(sink: *const Sink, not: &Not) -> i32 {
    match not {
        Not::There => ABSENT,
        Not::Described => DESCRIBE,
        Not::Allowed(reason) => {
            // SAFETY: passed on to the caller.
            unsafe { say(sink, reason) };
            REFUSED
        }
    }
}

unsafe extern "C" fn read(
    context: *mut (),
    path: Bytes,
    schema: u64,
    seen: *mut PropertyValue,
    sink: *const Sink,
) -> i32 {
    // SAFETY: the context is the service, which the module's tick uses alone; the rest lives during the call.
    unsafe {
        let path = std::str::from_utf8(path.as_slice()).unwrap_or_default();
        match (*context.cast::<BlackboardService>()).read(path, schema) {
            Ok(value) => {
                seen.write(value);
                DONE
            }
            Err(not) => code(sink, &not),
        }
    }
}

unsafe extern "C" fn write(
    context: *mut (),
    path: Bytes,
    schema: u64,
    interface: Bytes,
    value: Bytes,
    _: usize,
    sink: *const Sink,
) -> i32 {
    // SAFETY: as for `read`.
    unsafe {
        let written = (*context.cast::<BlackboardService>()).write(
            &text(path),
            schema,
            interface.as_slice(),
            value.as_slice(),
        );
        written.map_or_else(|not| code(sink, &not), |()| DONE)
    }
}

unsafe extern "C" fn matching(context: *mut (), pattern: Bytes, schema: u64, sink: *const Sink) -> i32 {
    // SAFETY: as for `read`.
    unsafe {
        let found = (*context.cast::<BlackboardService>()).matching(&text(pattern), schema);
        say(sink, found.as_ref().unwrap_or_else(|reason| reason));
        if found.is_ok() { DONE } else { REFUSED }
    }
}

unsafe extern "C" fn event(
    context: *mut (),
    pattern: Bytes,
    event: *mut BoardEvent,
    sink: *const Sink,
) -> i32 {
    // SAFETY: as for `read`.
    unsafe {
        match (*context.cast::<BlackboardService>()).event(&text(pattern)) {
            Ok(Some((path, value))) => {
                event.write(value);
                say(sink, &format!("/{path}"));
                DONE
            }
            Ok(None) => ABSENT,
            Err(reason) => {
                say(sink, &reason);
                REFUSED
            }
        }
    }
}

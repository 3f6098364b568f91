//! Aspect [`Synchronization`](aspect::Synchronization): points of modules.
//! A module emits and reads them.

use std::sync::Arc;

use slate_module::aspect;
use slate_module::table::{Bytes, DONE, REFUSED, Sink};
use slate_sorted::SortedMap;

use super::calls::{name, say};
use super::{HostService, ServiceContext, in_place};
use slate_engine::digest::Digest;
use slate_engine::synchronization::{Emitter, Point, PointError, Synchronization};

struct SynchronizationService {
    table: aspect::Synchronization,
    synchronization: Arc<Synchronization>,
    module: Arc<str>,
    emitters: SortedMap<String, OpenEmitter>,
    /// Observed points, with their counts at the start of this tick.
    points: SortedMap<String, (Arc<Point>, u64)>,
}

struct OpenEmitter {
    emitter: Emitter,
    /// Number of times that this tick emits it.
    times: u32,
}

// SAFETY: the table's context is the service itself, which only the thread that runs the module uses.
unsafe impl Send for SynchronizationService {}

pub(super) fn make(service_context: &ServiceContext, module: &Arc<str>) -> Box<dyn HostService> {
    in_place(|context| SynchronizationService {
        // SAFETY: the context is the service, in which the table stays; these are its calls.
        table: unsafe { aspect::Synchronization::new(context, emit, count) },
        synchronization: Arc::clone(&service_context.synchronization),
        module: Arc::clone(module),
        emitters: SortedMap::new(),
        points: SortedMap::new(),
    })
}

impl HostService for SynchronizationService {
    fn table(&self) -> *const u8 {
        (&raw const self.table).cast()
    }

    fn prepare(&mut self, _: u64) {
        self.points.values_mut().for_each(|(point, count)| *count = point.count().get());
    }

    fn commit(&mut self, _: u64, _: Option<&mut Digest>) {
        for open in self.emitters.values_mut() {
            for _ in 0..std::mem::take(&mut open.times) {
                open.emitter.emit();
            }
        }
    }

    fn abandon(&mut self) {
        self.emitters.values_mut().for_each(|open| open.times = 0);
    }
}

impl SynchronizationService {
    fn emit(&mut self, name: &str) -> Result<(), PointError> {
        if let Some(open) = self.emitters.get_mut(name) {
            open.times += 1;
            return Ok(());
        }
        let emitter = self.synchronization.emitter(name, &self.module)?;
        self.emitters.insert(name.into(), OpenEmitter { emitter, times: 1 });
        Ok(())
    }

    fn count(&mut self, name: &str) -> Result<u64, PointError> {
        if let Some((_, count)) = self.points.get(name) {
            return Ok(*count);
        }
        let point = self.synchronization.point(name)?;
        let count = point.count().get();
        self.points.insert(name.into(), (point, count));
        Ok(count)
    }
}

unsafe extern "C" fn emit(context: *mut (), point: Bytes, sink: *const Sink) -> i32 {
    // SAFETY: the context is the service, which the module's tick uses alone; the rest lives during the call.
    unsafe {
        match (*context.cast::<SynchronizationService>()).emit(name(point)) {
            Ok(()) => DONE,
            Err(error) => {
                say(sink, &error.to_string());
                REFUSED
            }
        }
    }
}

unsafe extern "C" fn count(context: *mut (), point: Bytes, count: *mut u64, sink: *const Sink) -> i32 {
    // SAFETY: as for `emit`, and the place of the count lives during the call.
    unsafe {
        match (*context.cast::<SynchronizationService>()).count(name(point)) {
            Ok(found) => {
                count.write(found);
                DONE
            }
            Err(error) => {
                say(sink, &error.to_string());
                REFUSED
            }
        }
    }
}

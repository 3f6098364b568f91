//! Aspect [`TimeSource`](aspect::TimeSource): time of the next cycle.
//! A module sets it.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use slate_module::aspect;

use super::{HostService, ServiceContext, in_place};
use slate_engine::clock::TimeSource;
use slate_engine::digest::Digest;

/// Time of the next cycle as set by a module; [`NOTHING`] without one.
#[derive(Debug)]
pub(crate) struct TimePlace(AtomicU64);

const NOTHING: u64 = u64::MAX;

impl Default for TimePlace {
    fn default() -> Self {
        Self(AtomicU64::new(NOTHING))
    }
}

impl TimePlace {
    /// Returns the time, if a module has set one.
    pub fn get(&self) -> Option<u64> {
        Some(self.0.load(Ordering::Acquire)).filter(|time| *time != NOTHING)
    }

    /// Sets or clears the time.
    pub fn set(&self, time: Option<u64>) {
        self.0.store(time.unwrap_or(NOTHING), Ordering::Release);
    }
}

/// Time source of the loop that returns the module's time.
#[derive(Debug)]
pub(crate) struct PlaceTime(pub Arc<TimePlace>);

impl TimeSource for PlaceTime {
    fn next(&mut self, _: Option<u64>, planned: u64) -> u64 {
        match self.0.0.swap(NOTHING, Ordering::AcqRel) {
            NOTHING => planned,
            time => time,
        }
    }
}

struct TimeService {
    table: aspect::TimeSource,
    place: Arc<TimePlace>,
    now: u64,
    answered_at: u64,
}

// SAFETY: the table's context is the service itself, which only the thread that runs the module uses.
unsafe impl Send for TimeService {}

pub(super) fn make(service_context: &ServiceContext, _: &Arc<str>) -> Box<dyn HostService> {
    in_place(|context| TimeService {
        // SAFETY: the context is the service, in which the table stays; these are its calls.
        table: unsafe { aspect::TimeSource::new(context, next) },
        place: Arc::clone(&service_context.time),
        now: 0,
        answered_at: NOTHING,
    })
}

impl HostService for TimeService {
    fn table(&self) -> *const u8 {
        (&raw const self.table).cast()
    }

    fn prepare(&mut self, now: u64) {
        (self.now, self.answered_at) = (now, NOTHING);
    }

    fn commit(&mut self, _: u64, _: Option<&mut Digest>) {
        if self.answered_at != NOTHING {
            self.place.0.store(self.answered_at, Ordering::Release);
        }
    }
}

unsafe extern "C" fn next(context: *mut (), time: u64) -> i32 {
    // SAFETY: the context is the service, which the module's tick uses alone.
    let service = unsafe { &mut *context.cast::<TimeService>() };
    if time < service.now || time == NOTHING {
        return 0;
    }
    service.answered_at = time;
    1
}

//! Aspect [`Logger`](aspect::Logger): a module sets the log levels.

use std::sync::Arc;

use slate_module::Level;
use slate_module::aspect;
use slate_module::table::Bytes;

use super::calls::text;
use super::{HostService, ServiceContext, in_place};
use slate_engine::digest::Digest;
use slate_engine::log::Logger;

struct LoggerService {
    table: aspect::Logger,
    logger: Arc<Logger>,
    /// Changes of log levels that this tick requests.
    changes: Vec<(String, Level)>,
}

// SAFETY: the table's context is the service itself, which only the thread that runs the module uses.
unsafe impl Send for LoggerService {}

pub(super) fn make(service_context: &ServiceContext, _: &Arc<str>) -> Box<dyn HostService> {
    in_place(|context| LoggerService {
        // SAFETY: the context is the service, in which the table stays; these are its calls.
        table: unsafe { aspect::Logger::new(context, level, set_level, dropped) },
        logger: Arc::clone(&service_context.logger),
        changes: Vec::new(),
    })
}

impl HostService for LoggerService {
    fn table(&self) -> *const u8 {
        (&raw const self.table).cast()
    }

    fn commit(&mut self, _: u64, _: Option<&mut Digest>) {
        for (module, level) in self.changes.drain(..) {
            self.logger.set_level(Some(module.as_str()).filter(|module| !module.is_empty()), level);
        }
    }

    fn abandon(&mut self) {
        self.changes.clear();
    }
}

unsafe extern "C" fn level(context: *mut (), module: Bytes) -> u32 {
    // SAFETY: the context is the service, which the module's tick uses alone; the name lives during the call.
    unsafe { (*context.cast::<LoggerService>()).logger.level(&text(module)) as u32 }
}

unsafe extern "C" fn set_level(context: *mut (), module: Bytes, level: u32) {
    // SAFETY: as for `level`.
    unsafe { (*context.cast::<LoggerService>()).changes.push((text(module), Level::from_number(level))) }
}

unsafe extern "C" fn dropped(context: *mut ()) -> u64 {
    // SAFETY: as for `level`.
    unsafe { (*context.cast::<LoggerService>()).logger.dropped() }
}

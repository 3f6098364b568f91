use std::sync::Arc;

use slate_module::Level;
use slate_runtime::log::{LogTarget, Record};

use super::hub::Hub;
use super::messages;

/// The log, on its way into the recording.
pub(super) struct Lines {
    hub: Arc<Hub>,
}

impl Lines {
    pub fn new(hub: &Arc<Hub>) -> Self {
        Self { hub: Arc::clone(hub) }
    }
}

impl LogTarget for Lines {
    fn write(&mut self, record: &Record) {
        self.hub.push_whole(messages::LOG_TOPIC.id, 0, record.time, &messages::log(record, record.time));
        if record.level == Level::Error {
            self.hub.request_write();
        }
    }
}

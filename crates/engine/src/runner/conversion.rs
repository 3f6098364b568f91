use std::sync::Arc;

use slate_blackboard::Property;
use slate_blackboard::channel::{Latest, Writer};
use slate_module::{Flags, Level};

use slate_composition::Wire;
use slate_composition::link::{Filter, Program};

use super::{AlignedMemory, Health, ParameterReader, Slots};
use crate::log::ModuleLog;

/// What a link fills that does not fit as it is: a property of the module's own, which its runner writes before a step
/// when a source is new. So tools, logs and replay see what the module saw.
pub struct Conversion {
    /// What it fills.
    pub wire: Wire,
    /// The property that it writes.
    pub property: Arc<Property>,
    /// None for the parameters, which tools write too.
    pub writer: Option<Writer>,
    /// The value: what is set for it, and over that what came.
    pub value: AlignedMemory,
    /// Bytes of the value.
    pub bytes: usize,
    /// Items of its tail.
    pub items: usize,
    /// Whether a value is set for it, over which links write.
    pub is_set: bool,
    /// What it is made of.
    pub sources: Vec<ConvertedSource>,
    /// The place of its own reader.
    pub reader: usize,
    /// Whether news of it trigger a step.
    pub triggers: bool,
    /// Whether it waits for a module that is not loaded.
    pub is_pending: bool,
    /// Whether something came that is not written yet.
    pub unwritten: bool,
}

/// A property that fills a part of it.
pub struct ConvertedSource {
    /// The place of its reader.
    pub reader: usize,
    /// How the value becomes what the port takes.
    pub program: Arc<Program>,
    /// Which values pass, if not all.
    pub filter: Option<Arc<Filter>>,
    /// The module that writes it, if one does.
    pub writer: Option<Arc<Health>>,
    /// The age from which the source counts as stale, nanoseconds.
    pub stale_after: Option<u64>,
    /// Sequence and generation of the value that was looked at last.
    pub seen: (u64, u64),
    /// When the value that is in use was written; nothing before the first.
    pub time: Option<u64>,
    /// Whether the newest value has no such part, or one that is not allowed.
    pub is_missing: bool,
}

impl ConvertedSource {
    fn is_new(&self, readers: &[Latest]) -> bool {
        let stamp = readers[self.reader].value().map(|loan| loan.stamp());
        stamp.is_some_and(|stamp| (stamp.sequence, stamp.generation) != self.seen)
    }

    fn is_working(&self) -> bool {
        self.writer.as_ref().is_none_or(|health| health.condition().is_working())
    }

    fn is_stale(&self, now: u64) -> bool {
        let old = |time: u64| self.stale_after.is_some_and(|after| now.saturating_sub(time) > after);
        self.is_missing || self.time.is_none_or(old)
    }
}

impl Conversion {
    /// Takes over what is new of its sources; says whether one of them is not allowed any more.
    fn take(&mut self, readers: &[Latest]) -> bool {
        let value = self.value.bytes_mut(self.bytes);
        let mut refused = false;
        for source in &mut self.sources {
            let Some(loan) = readers[source.reader].value() else { continue };
            let stamp = loan.stamp();
            if source.seen == (stamp.sequence, stamp.generation) {
                continue;
            }
            source.seen = (stamp.sequence, stamp.generation);
            let passes = |filter: &Arc<Filter>| filter.passes(loan.bytes(), loan.items(), stamp.sequence);
            if !source.filter.as_ref().is_none_or(passes) {
                continue;
            }
            let is_missing = !source.program.run(loan.bytes(), loan.items(), value);
            refused |= is_missing && !source.is_missing;
            source.is_missing = is_missing;
            if !is_missing {
                source.time = Some(stamp.time);
                self.unwritten = true;
            }
        }
        refused
    }

    /// The value is as old as the oldest that is in it.
    fn time(&self) -> u64 {
        self.sources.iter().filter_map(|source| source.time).min().unwrap_or(0)
    }

    /// Whether every part has a value, so that no zeros stand for one that has not come yet.
    fn is_whole(&self) -> bool {
        self.is_set || !self.is_pending && self.sources.iter().all(|source| source.time.is_some())
    }

    /// Publishes what came, once it is whole.
    fn write(&mut self) {
        if !self.is_whole() {
            return;
        }
        let time = self.time();
        if let Some(writer) = &mut self.writer {
            self.unwritten = false;
            // Only a recorder in lockstep may hold a writer up; it then goes without this value.
            let _ = writer.write(self.value.bytes_mut(self.bytes), self.items, time);
        }
    }

    /// Writes what came into the parameters, over what tools have set.
    fn write_params(&mut self, sources: &[Latest], params: &mut ParameterReader) {
        if !self.unwritten {
            return;
        }
        let Some(mut setter) = self.property.try_setter() else { return };
        // Nobody else writes now, so what tools have set is not lost.
        let Some(present) = params.present() else { return };
        let time = self.time();
        let value = self.value.bytes_mut(self.bytes);
        let length = value.len().min(present.len());
        value[..length].copy_from_slice(&present[..length]);
        for source in self.sources.iter().filter(|source| source.time.is_some()) {
            if let Some(loan) = sources[source.reader].value() {
                source.program.run(loan.bytes(), loan.items(), value);
            }
        }
        self.unwritten = !setter.write(value, time);
        params.expect_change();
    }
}

/// All that links fill that do not fit as they are.
#[derive(Default)]
pub struct Conversions {
    /// The readers of what is converted.
    pub(super) sources: Vec<Latest>,
    pub(super) all: Vec<Conversion>,
}

impl Conversions {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// Brings what is new of the sources of links to the ports that they fill, which `readers` read, and to the parameters.
    pub(super) fn convert(&mut self, readers: &mut [Latest], params: &mut ParameterReader, log: &ModuleLog) {
        let Self { sources, all } = self;
        for conversion in all.iter_mut().filter(|conversion| conversion.wire != Wire::Enabled) {
            let refused = conversion.take(sources);
            match conversion.wire {
                Wire::Params => {
                    if refused {
                        let text = "a linked parameter is out of its range, and keeps its value";
                        log.write(Level::Warn, text);
                    }
                    conversion.write_params(sources, params);
                }
                _ if conversion.unwritten => {
                    conversion.write();
                    readers[conversion.reader].refresh();
                }
                _ => {}
            }
        }
    }

    /// As [`convert`](Conversions::convert), for what switches the module.
    pub(super) fn convert_switch(&mut self) {
        let Self { sources, all } = self;
        for conversion in all.iter_mut().filter(|conversion| conversion.wire == Wire::Enabled) {
            for source in &conversion.sources {
                sources[source.reader].refresh();
            }
            conversion.take(sources);
            if conversion.unwritten {
                conversion.write();
            }
        }
    }

    /// Inputs that links fill are as stale and alive as what fills them.
    pub(super) fn mark(&self, slots: &Slots, now: u64) {
        for conversion in &self.all {
            let Wire::Port(slot) = conversion.wire else { continue };
            let slot = &slots[slot];
            let mut flags = slot.flags.get();
            if !conversion.sources.iter().all(ConvertedSource::is_working) {
                flags = flags & !Flags::ALIVE | Flags::STALE;
            }
            if conversion.is_pending {
                flags = flags & !Flags::ALIVE | Flags::STALE;
            }
            if conversion.sources.iter().any(|source| source.is_stale(now)) {
                flags |= Flags::STALE;
            }
            slot.flags.set(flags);
        }
    }

    /// Whether a link that fills a part of a port that triggers has something new.
    pub(super) fn have_news(&self) -> bool {
        let triggers = self.all.iter().filter(|conversion| conversion.triggers);
        triggers
            .flat_map(|conversion| &conversion.sources)
            .any(|source| self.sources[source.reader].has_news() || source.is_new(&self.sources))
    }
}

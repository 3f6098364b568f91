use std::sync::Arc;

use slate_blackboard::Property;
use slate_blackboard::channel::{Latest, Writer};
use slate_module::{Flags, Level};

use slate_composition::LinkEnd;
use slate_composition::link::{Filter, Program};

use super::{AlignedMemory, Health, ParameterReader, Slots};
use crate::log::ModuleLog;

/// Conversion of linked values that do not fit the port directly.
/// The result is a property of the module's own, which its runner writes before a step when a source is new. So tools,
/// logs and replay see the value that the module saw.
pub struct Conversion {
    /// Target of the conversion.
    pub link_end: LinkEnd,
    /// Property that it writes.
    pub property: Arc<Property>,
    /// Writer; `None` for the parameters, which tools write too.
    pub writer: Option<Writer>,
    /// Value: the set one, overwritten by the parts of the sources.
    pub value: AlignedMemory,
    /// Size of the value, bytes.
    pub bytes: usize,
    /// Number of tail items.
    pub items: usize,
    /// True if a value is set for it, over which links write.
    pub is_set: bool,
    /// Sources of its parts.
    pub sources: Vec<ConvertedSource>,
    /// Index of its own reader.
    pub reader: usize,
    /// True if new values of it trigger a step.
    pub triggers: bool,
    /// True if it waits for a module that is not loaded.
    pub is_pending: bool,
    /// True if a new value has not been written yet.
    pub unwritten: bool,
}

/// Property that fills a part of the target.
pub struct ConvertedSource {
    /// Index of its reader.
    pub reader: usize,
    /// Program that converts the value to that of the port.
    pub program: Arc<Program>,
    /// Filter of the values; `None` if all pass.
    pub filter: Option<Arc<Filter>>,
    /// Module that writes it, if any.
    pub writer: Option<Arc<Health>>,
    /// Age from which the source counts as stale, ns.
    pub stale_after: Option<u64>,
    /// Sequence and generation of the value that was looked at last.
    pub seen: (u64, u64),
    /// Time stamp of the value in use, ns; `None` before the first.
    pub time: Option<u64>,
    /// True if the newest value has no such part, or one that is not allowed.
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
    /// Converts new values of its sources.
    /// True if one of them is newly rejected as not allowed.
    fn update(&mut self, readers: &[Latest]) -> bool {
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

    /// Returns the time of the value: that of its oldest part, ns.
    fn time(&self) -> u64 {
        self.sources.iter().filter_map(|source| source.time).min().unwrap_or(0)
    }

    /// Returns true if every part has a value.
    /// So no zeros stand for one that has not come yet.
    fn is_whole(&self) -> bool {
        self.is_set || !self.is_pending && self.sources.iter().all(|source| source.time.is_some())
    }

    /// Publishes the value, once it is complete.
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

    /// Writes new values into the parameters, over those set by tools.
    fn write_params(&mut self, sources: &[Latest], params: &mut ParameterReader) {
        if !self.unwritten {
            return;
        }
        let Some(mut setter) = self.property.try_setter() else { return };
        // No other writer exists now, so values set by tools are not lost.
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
    /// Readers of the sources.
    pub(super) sources: Vec<Latest>,
    pub(super) all: Vec<Conversion>,
}

impl Conversions {
    /// Returns true if it has no conversions.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// Converts new values of the linked sources to ports and parameters.
    /// The ports are those that `readers` read.
    pub(super) fn convert(&mut self, readers: &mut [Latest], params: &mut ParameterReader, log: &ModuleLog) {
        let Self { sources, all } = self;
        for conversion in all.iter_mut().filter(|conversion| conversion.link_end != LinkEnd::Enabled) {
            let refused = conversion.update(sources);
            match conversion.link_end {
                LinkEnd::Params => {
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

    /// Acts as [`convert`](Conversions::convert), for the module's switch.
    pub(super) fn convert_switch(&mut self) {
        let Self { sources, all } = self;
        for conversion in all.iter_mut().filter(|conversion| conversion.link_end == LinkEnd::Enabled) {
            for source in &conversion.sources {
                sources[source.reader].refresh();
            }
            conversion.update(sources);
            if conversion.unwritten {
                conversion.write();
            }
        }
    }

    /// Marks linked inputs as stale or alive, as their sources are.
    pub(super) fn mark(&self, slots: &Slots, now: u64) {
        for conversion in &self.all {
            let LinkEnd::Port(slot) = conversion.link_end else { continue };
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

    /// Returns true if a link that fills a part of a triggering port has a new value.
    pub(super) fn have_updates(&self) -> bool {
        let triggers = self.all.iter().filter(|conversion| conversion.triggers);
        triggers
            .flat_map(|conversion| &conversion.sources)
            .any(|source| self.sources[source.reader].has_news() || source.is_new(&self.sources))
    }
}

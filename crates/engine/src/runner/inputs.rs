use slate_blackboard::channel::Latest;
use slate_blackboard::commit::{CommitWord, pin, pin_both};
use slate_composition::own::PortName;

use super::{AlignedMemory, Conversions, InputPort, Requirements, Slots};

/// Number of further attempts to pin a group while its writer commits.
const PIN_TRIES: u32 = 4;

/// Group of inputs `first..end` with one writer, pinned together.
/// The sources of conversions with the same writer are pinned with them.
#[derive(Debug)]
pub struct Group {
    /// Counter of the writer's commits.
    pub word: CommitWord,
    /// Index of the first input.
    pub first: u32,
    /// Index behind the last input.
    pub end: u32,
    /// Index of the first source.
    pub first_source: u32,
    /// Index behind the last source.
    pub end_source: u32,
}

/// Inputs of a module, and the conversions that fill them.
#[repr(C)]
pub struct Inputs {
    /// Ports in the order of the groups.
    pub ports: Vec<InputPort>,
    /// Readers of `ports`, apart from them so that a group can be pinned in one go.
    pub(super) readers: Vec<Latest>,
    /// Groups of inputs that are pinned together.
    pub(super) groups: Vec<Group>,
    /// Conversions of links that do not fit the port directly.
    pub(super) conversions: Conversions,
    /// True if each input has another writer and is pinned before the step.
    /// The groups then contain no further information.
    pub(super) pins_singly: bool,
    /// Groups pinned at the beginning of a cycle instead of before the step.
    pub(super) previous_groups: Vec<Group>,
    /// Inputs that must have a value before the module runs.
    pub(super) requirements: Requirements,
}

impl Inputs {
    /// Inputs that no link fills yet.
    pub fn new(requirements: Requirements) -> Self {
        Self {
            ports: Vec::new(),
            readers: Vec::new(),
            groups: Vec::new(),
            conversions: Conversions::default(),
            pins_singly: false,
            previous_groups: Vec::new(),
            requirements,
        }
    }

    /// Returns true if some are pinned at the beginning of a cycle.
    pub fn have_previous(&self) -> bool {
        !self.previous_groups.is_empty()
    }

    /// Updates the flag that each input is pinned by itself.
    pub(super) fn update_pinning(&mut self) {
        self.pins_singly = self.previous_groups.is_empty() && self.groups.iter().all(Group::is_one_reader);
    }

    /// Returns true if a triggering input has a new value.
    pub(super) fn have_updates(&self) -> bool {
        self.ports.iter().zip(&self.readers).any(|(input, reader)| input.wakes && reader.has_news())
    }

    /// Returns true if a value pinned at the cycle's beginning was not in a step yet.
    pub(super) fn have_previous_updates(&self) -> bool {
        let readers = self.previous_groups.iter().flat_map(|group| group.first as usize..group.end as usize);
        let mut inputs =
            readers.filter_map(|at| Some((self.ports.get(at)?, self.readers[at].value()?.stamp())));
        inputs.any(|(input, stamp)| input.triggers && input.seen != (stamp.sequence, stamp.generation))
    }

    /// Pins the early values, those of the last cycle, before the steps of this one.
    pub(super) fn pin_previous(&mut self) {
        for group in &self.previous_groups {
            group.pin(&mut self.readers, &mut self.conversions.sources, PIN_TRIES);
        }
    }

    /// Pins the newest values.
    pub(super) fn pin(&mut self) {
        for group in &self.groups {
            group.pin(&mut self.readers, &mut self.conversions.sources, PIN_TRIES);
        }
    }

    /// Acts as [`pin`](Inputs::pin), for the loop's only step at that time.
    ///
    /// # Safety
    /// As for [`Latest::refresh_in_turn`].
    pub(super) unsafe fn take_in_turn(&mut self) {
        for group in &self.groups {
            // SAFETY: passed on to the caller.
            unsafe { group.take(&mut self.readers, &mut self.conversions.sources) };
        }
    }

    /// Pins all of each writer together, however often that takes.
    pub(super) fn pin_first(&mut self, tries: u32) {
        for group in self.groups.iter().chain(&self.previous_groups) {
            // Values of one writer belong together from the first step on.
            if group.count() > 1 {
                group.pin(&mut self.readers, &mut self.conversions.sources, tries);
            }
        }
    }

    /// Pins values read in turn, as any step may write them from now on.
    pub(super) fn hold(&mut self) {
        self.readers.iter_mut().for_each(Latest::hold);
    }

    /// Returns the first required input without a value.
    pub(super) fn missing(&mut self) -> Option<PortName> {
        self.requirements.missing(&self.ports, &self.readers)
    }

    /// Refreshes the sources of conversions.
    /// Otherwise that happens only before the step for which the module waits.
    pub(super) fn refresh_sources(&mut self) {
        for group in &self.groups {
            let sources = group.first_source as usize..group.end_source as usize;
            self.conversions.sources[sources].iter_mut().for_each(|source| _ = source.refresh());
        }
    }

    /// Shows the values to the next step.
    pub(super) fn fill(&mut self, slots: &mut Slots, zeros: &AlignedMemory, now: u64) {
        for (input, reader) in self.ports.iter_mut().zip(&self.readers) {
            input.show(reader, &mut slots[input.slot as usize], zeros, now);
        }
    }

    /// Takes and shows the newest values of inputs that are pinned singly.
    /// It is for the loop's only step at that time.
    ///
    /// # Safety
    /// As for [`Latest::refresh_in_turn`].
    #[inline(always)] // Part of every step.
    pub(super) unsafe fn show_in_turn(&mut self, slots: &mut Slots, zeros: &AlignedMemory, now: u64) {
        // Not zipped, which takes two calls where the compiler does not see through them.
        let mut readers = self.readers.iter_mut();
        for input in &mut self.ports {
            let Some(reader) = readers.next() else { break };
            // SAFETY: passed on to the caller.
            unsafe { reader.refresh_in_turn() };
            input.show(reader, &mut slots[input.slot as usize], zeros, now);
        }
    }

    /// Publishes the ages of the last step's values.
    pub(super) fn publish_ages(&self, slots: &Slots, now: u64) {
        for input in &self.ports {
            let written = slots[input.slot as usize].stamp.time;
            input.age.set((input.seen != (0, 0)).then(|| now.saturating_sub(written)));
        }
    }
}

impl Group {
    fn count(&self) -> u32 {
        self.end - self.first + self.end_source - self.first_source
    }

    /// Returns true if it is a single input.
    pub fn is_one_reader(&self) -> bool {
        self.end - self.first == 1 && self.first_source == self.end_source
    }

    /// Acts as [`pin`](Group::pin), while no other module of the loop is in a step.
    /// Values written by one of them are not pinned, as their last commit is complete.
    ///
    /// # Safety
    /// As for [`Latest::refresh_in_turn`].
    #[inline]
    unsafe fn take(&self, readers: &mut [Latest], sources: &mut [Latest]) {
        let own = &mut readers[self.first as usize..self.end as usize];
        if self.first_source == self.end_source && own.iter().all(Latest::is_in_turn) {
            for reader in own {
                // SAFETY: passed on to the caller.
                unsafe { reader.refresh_in_turn() };
            }
        } else {
            self.pin(readers, sources, PIN_TRIES);
        }
    }

    /// Pins the newest values, together if there are several.
    /// Values that can't be pinned together stay at the previous snapshot, which is consistent too.
    pub fn pin(&self, readers: &mut [Latest], sources: &mut [Latest], tries: u32) {
        let readers = &mut readers[self.first as usize..self.end as usize];
        let sources = &mut sources[self.first_source as usize..self.end_source as usize];
        match (readers, sources) {
            ([one], []) | ([], [one]) => {
                one.refresh();
            }
            (several, []) => {
                pin(&self.word, several, tries);
            }
            (readers, sources) => {
                pin_both(&self.word, readers, sources, tries);
            }
        }
    }
}

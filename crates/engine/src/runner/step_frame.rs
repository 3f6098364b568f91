use std::cell::Cell;
use std::sync::Arc;

use slate_blackboard::Stamp;
use slate_module::{Description, Frame, Host, PortDescription, PortSlot, Random};

use super::{AlignedMemory, Slots};

/// Frame of a step, with the slots of its ports and all to which both point.
#[repr(C)]
pub struct StepFrame {
    /// Argument of the next step.
    pub(super) frame: Frame,
    /// Slots of the ports in the frame.
    pub slots: Slots,
    /// Value of all zeros for inputs that were never written.
    pub(super) zeros: Arc<AlignedMemory>,
    /// Random stream to which `frame.random` points.
    random: Box<Cell<Random>>,
    /// Host to which `frame.host` points.
    #[allow(dead_code, reason = "the frame points to it")]
    host: Box<Host>,
}

impl StepFrame {
    /// Returns the frame of a module before its first step.
    pub fn new(description: &Description, zeros: &Arc<AlignedMemory>, random: Random, host: Host) -> Self {
        let (random, host) = (Box::new(Cell::new(random)), Box::new(host));
        let ports = &description.ports;
        let slots = Slots::new(ports.len(), |port| empty_slot(&ports[port], zeros));
        let frame = Frame {
            ports: slots.as_ptr(),
            port_count: ports.len(),
            params: zeros.as_ptr(),
            params_size: description.params.size,
            params_version: 0,
            now: 0,
            elapsed: 0,
            number: 0,
            random: &raw const *random,
            host: &raw const *host,
        };
        Self { frame, slots, zeros: Arc::clone(zeros), random, host }
    }

    /// Returns the number of steps begun.
    #[inline]
    pub fn number(&self) -> u64 {
        self.frame.number
    }

    /// Returns the state of the random stream.
    pub fn random(&self) -> Random {
        self.random.get()
    }

    /// Sets time and number of the next step, which follows that of `last_tick`.
    #[inline(always)] // Part of every step.
    pub(super) fn begin(&mut self, now: u64, last_tick: u64) {
        self.frame.now = now;
        self.frame.elapsed = if self.frame.number == 0 { 0 } else { now - last_tick };
        self.frame.number += 1;
    }

    /// Resumes after `number` steps.
    pub(super) fn restore(&mut self, number: u64, params_version: u64, random: Random) {
        (self.frame.number, self.frame.params_version) = (number, params_version);
        self.random.set(random);
    }
}

fn empty_slot(port: &PortDescription, zeros: &AlignedMemory) -> PortSlot {
    PortSlot {
        schema: port.descriptor.hash,
        direction: port.direction as u32,
        data: zeros.as_ptr().cast_mut(),
        items: Cell::new(0),
        capacity: port.capacity,
        stamp: Stamp::default(),
        flags: Cell::new(0),
        priority: Cell::new(0),
        entries: std::ptr::null(),
        count: Cell::new(0),
        missed: 0,
    }
}

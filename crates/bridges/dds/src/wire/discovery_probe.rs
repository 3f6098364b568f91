//! Discovery that keeps up with the announcements it receives.

use std::io;
use std::net::{Ipv4Addr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use rustdds::{
    DomainParticipant, DomainParticipantStatusEvent as Event, DomainParticipantStatusListener, RTPSEntity,
    StatusEvented,
};

/// Time between an answer and the next probe.
const PERIOD: Duration = Duration::from_secs(1);

/// Timeout of a probe's answer, unless discovery is behind.
/// Bridges read events every 100 ms.
const ANSWER_TIMEOUT: Duration = Duration::from_millis(200);

/// Time between repetitions of a probe. RustDDS handles faster ones as one.
const REPETITION_PERIOD: Duration = Duration::from_millis(1);

/// Repetitions after which another probe follows, as the answer may be lost.
const REPETITIONS: u32 = 4096;

/// Maximum period of probes while none was ever answered.
/// Such as where a firewall closes the loopback interface.
const LONGEST_PERIOD: Duration = Duration::from_secs(60);

/// Length of a probe, bytes.
const LENGTH: usize = 20 + 16 + 24 + 28;

/// Place of the sequence number's lower half in a probe.
const SEQUENCE: usize = 20 + 16 + 20;

/// Keeps the discovery of a participant from falling behind.
///
/// RustDDS 0.15 reads waiting announcements of participants when another one arrives, but stops at the first that is
/// unreadable. After many of those, each later announcement clears one, and no program is found until all are cleared.
/// A probe is a message to this participant alone, over the loopback interface: it disposes a participant that does
/// not exist, which RustDDS reports as an event. A missing event means that discovery is behind. Then the same message
/// is repeated, which adds nothing to the queue but lets RustDDS read on. All of it ends when this is dropped.
#[derive(Debug)]
pub struct DiscoveryProbe {
    /// GUID prefix of the participant that does not exist.
    prefix: [u8; 12],
    answers: Option<SyncSender<()>>,
    /// Set when events are read: without that no probe is answered.
    watched: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl DiscoveryProbe {
    /// Begins to probe a participant.
    ///
    /// # Errors
    /// No port or no thread is left.
    pub fn start(participant: &DomainParticipant) -> io::Result<Self> {
        // RTPS 2.5, 9.6.2.3. RustDDS listens there, so it is a port.
        let port = 7400 + 250 * participant.domain_id() + 10 + 2 * participant.participant_id();
        let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?;
        socket.connect((Ipv4Addr::LOCALHOST, port))?;
        let mut own = [0; 12];
        own.copy_from_slice(&participant.guid().to_bytes()[..12]);
        let mut prefix = own;
        prefix[11] ^= 0xff;
        let (sender, answers) = sync_channel(1);
        let watched = Arc::new(AtomicBool::new(false));
        let mut prober =
            Prober { socket, message: message(own, prefix), answers, watched: Arc::clone(&watched) };
        let thread = Builder::new().name("dds-probe".into()).spawn(move || prober.run())?;
        Ok(Self { prefix, answers: Some(sender), watched, thread: Some(thread) })
    }

    /// Returns the next event of the participant, without the answers to probes.
    pub fn next_event(&self, status: &DomainParticipantStatusListener) -> Option<Event> {
        self.watched.store(true, Ordering::Relaxed);
        loop {
            match status.try_recv_status()? {
                Event::ParticipantLost { id, .. } if id.as_ref() == self.prefix => {
                    // It fails when an answer is waiting, which is enough.
                    let _ = self.answers.as_ref().map(|answers| answers.try_send(()));
                }
                event => return Some(event),
            }
        }
    }
}

impl Drop for DiscoveryProbe {
    fn drop(&mut self) {
        // Ends the thread.
        self.answers = None;
        if let Some(thread) = self.thread.take() {
            // It does not panic.
            let _ = thread.join();
        }
    }
}

/// Returns a probe as an RTPS message (2.5, 9.4).
/// It has INFO_DST for `own`, and DATA with which `gone` disposes itself.
fn message(own: [u8; 12], gone: [u8; 12]) -> [u8; LENGTH] {
    const VENDOR: [u8; 2] = [0x01, 0x12];
    const READER: [u8; 4] = [0, 1, 0, 0xc7];
    const WRITER: [u8; 4] = [0, 1, 0, 0xc2];
    const PARTICIPANT: [u8; 4] = [0, 0, 1, 0xc1];
    let parts: [&[u8]; 16] = [
        b"RTPS",
        &[2, 3],
        &VENDOR,
        &gone,
        // INFO_DST, little endian.
        &[0x0e, 0x01, 12, 0],
        &own,
        // DATA, little endian, with a key and without inline QoS.
        &[0x15, 0x09, 48, 0, 0, 0, 16, 0],
        &READER,
        &WRITER,
        &[0; 8],
        // PL_CDR, little endian, with PID_PARTICIPANT_GUID and PID_SENTINEL.
        &[0, 3, 0, 0],
        &[0x50, 0, 16, 0],
        &gone,
        &PARTICIPANT,
        &[1, 0],
        &[0, 0],
    ];
    let mut message = [0; LENGTH];
    parts.iter().copied().flatten().zip(&mut message).for_each(|(byte, place)| *place = *byte);
    message
}

/// Thread that sends probes.
struct Prober {
    socket: UdpSocket,
    message: [u8; LENGTH],
    answers: Receiver<()>,
    watched: Arc<AtomicBool>,
}

impl Prober {
    /// Probes until the sender of answers is dropped.
    fn run(&mut self) {
        // Odd, because RustDDS drops waiting announcements at multiples of 64.
        let mut sequence = 1_u32;
        let mut period = PERIOD;
        let mut is_reached = false;
        loop {
            match self.answers.recv_timeout(period) {
                // Answer to an earlier probe.
                Ok(()) => continue,
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
            if self.watched.swap(false, Ordering::Relaxed) {
                self.message[SEQUENCE..SEQUENCE + 4].copy_from_slice(&sequence.to_le_bytes());
                sequence = sequence.wrapping_add(2);
                is_reached |= self.is_answered();
                period = if is_reached { PERIOD } else { LONGEST_PERIOD.min(2 * period) };
            }
        }
    }

    /// Repeats a probe until it is answered, unless that takes too many.
    fn is_answered(&self) -> bool {
        let mut wait = ANSWER_TIMEOUT;
        for _ in 0..REPETITIONS {
            // A lost message is repeated.
            let _ = self.socket.send(&self.message);
            match self.answers.recv_timeout(wait) {
                Err(RecvTimeoutError::Timeout) => wait = REPETITION_PERIOD,
                Ok(()) => return true,
                Err(RecvTimeoutError::Disconnected) => return false,
            }
        }
        false
    }
}

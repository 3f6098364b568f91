//! Session with a controller: a state machine without device and clock.
//!
//! Bytes go in by [`receive`](Session::receive), time by [`poll`](Session::poll), and what is to be sent gathers in
//! [`outgoing`](Session::outgoing). Times are durations since any beginning, by a clock that never stands still.

use std::time::Duration;

use crate::command::Command;
use crate::model::{MODELS, Model};
use crate::packet::{self, Decoder};
use crate::report::{Identity, Report};

/// Timeout of the connection.
pub const SILENCE: Duration = Duration::from_secs(1);
/// Timeout of an answer before a request is repeated.
const TIMEOUT: Duration = Duration::from_millis(300);
/// Number of attempts of a request before the session restarts.
const MAX_ATTEMPTS: u32 = 3;
/// Pause between the end of an old connection and a new one.
const PAUSE: Duration = Duration::from_millis(100);
/// Period at which an unchanged command is repeated.
/// Packets may get lost, and the robot stops after 2 s without a command.
const RENEWAL: Duration = Duration::from_millis(250);
/// Minimum interval between commands other than a stop.
/// The line carries 960 bytes per second.
const SPACING: Duration = Duration::from_millis(50);
/// Period of keep-alive packets at standstill.
const BEAT: Duration = Duration::from_millis(500);
/// Number of attempts to switch the motors.
const SWITCHES: u32 = 6;

/// Event of a session.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// Connected: the robot answers, and reports.
    Connected {
        /// Identity of the controller.
        identity: Identity,
        /// Model of the robot.
        model: &'static Model,
    },
    /// Standard report.
    Report(Report),
    /// Connection lost or not established; the next attempt begins at once.
    Lost(Loss),
}

/// Reason for a missing connection.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Loss {
    /// No answer.
    #[error("the robot does not answer: is it switched on, and connected?")]
    NoAnswer,
    /// Bytes came, but no packets.
    #[error("noise and no packet on the line: check the baud rate")]
    Noise,
    /// Unexpected packets.
    #[error("the robot's answers do not match the requests")]
    Confused,
    /// No report for a second.
    #[error("the robot stopped responding")]
    Silent,
    /// Only noise on the line for a second, after reports.
    #[error("the robot sends only noise: check line and baud rate")]
    Drowned,
    /// Unknown model.
    #[error("unknown robot model `{0}`: set `model` to one of {known}", known = known())]
    Unknown(String),
}

fn known() -> String {
    MODELS.map(|model| model.name).join(", ")
}

/// State of a session.
#[derive(Clone, Debug)]
enum SessionState {
    /// Ends the connection, and waits.
    Begin { pause: Duration },
    /// Waits for the controller to have ended it.
    Pause { until: Duration },
    /// Waits for the answer to a step of the synchronization.
    Sync { step: u8, requested_at: Duration, tries: u32 },
    /// Waits for the first report.
    Opening { identity: Identity, model: &'static Model, requested_at: Duration, tries: u32 },
    /// Reports come.
    Open(OpenConnection),
}

/// Open connection.
#[derive(Clone, Debug)]
struct OpenConnection {
    /// Arrival time of the last report.
    last_report: Duration,
    model: &'static Model,
    /// Last sent motion; `changed` is the time of its last change.
    sent: (i16, i16),
    changed: Duration,
    renewed: Duration,
    /// Reported motion state: true if the robot moves.
    moving: bool,
    motors: Switch,
    sonars: Switch,
}

/// Device state to switch on by commands that may get lost.
#[derive(Clone, Copy, Debug, Default)]
struct Switch {
    is_on: bool,
    tries: u32,
    tried: Duration,
}

impl Switch {
    /// Returns true if another attempt is due.
    fn due(&mut self, now: Duration) -> bool {
        let due = !self.is_on && self.tries < SWITCHES && now.saturating_sub(self.tried) >= TIMEOUT;
        if due {
            self.tries += 1;
            self.tried = now;
        }
        due
    }
}

/// Conversation with a controller.
#[derive(Clone, Debug)]
pub struct Session {
    state: SessionState,
    decoder: Decoder,
    outgoing: Vec<u8>,
    /// Time of the last sent packet.
    sent_at: Duration,
    /// Known model; else that of the controller.
    model: Option<&'static Model>,
    time_to_live: Duration,
    /// True if a person has switched the motors off at the robot.
    /// An earlier connection counts, too.
    switched_off: bool,
    /// Speeds of the wheels, rad/s, and when they were commanded.
    commanded: Option<([f64; 2], Duration)>,
    /// Bytes and packets that came since the connection was begun.
    bytes: u64,
    packets: u64,
}

impl Session {
    /// Returns a session that begins with the next [`poll`](Self::poll).
    ///
    /// Makes a session with a time to live of commands. The default model is that of the controller.
    pub fn new(model: Option<&'static Model>, time_to_live: Duration) -> Self {
        Self {
            state: SessionState::Begin { pause: PAUSE },
            decoder: Decoder::default(),
            outgoing: Vec::new(),
            sent_at: Duration::ZERO,
            model,
            time_to_live,
            switched_off: false,
            commanded: None,
            bytes: 0,
            packets: 0,
        }
    }

    /// Restarts on another line; drops unsent bytes and partial packets.
    pub fn begin(&mut self) {
        self.state = SessionState::Begin { pause: PAUSE };
        self.outgoing.clear();
        self.decoder.clear();
    }

    /// Commands the wheels, rad/s.
    pub fn drive(&mut self, left: f64, right: f64, now: Duration) {
        self.commanded = Some(([left, right], now));
    }

    /// Returns bytes to send; the caller removes those that were sent.
    pub fn outgoing(&mut self) -> &mut Vec<u8> {
        &mut self.outgoing
    }

    /// Returns the number of damaged packets.
    pub fn bad_checksums(&self) -> u64 {
        self.decoder.bad_checksums()
    }

    /// Stops the robot and ends the connection.
    pub fn close(&mut self) {
        self.commanded = None;
        for command in [Command::Stop, Command::Close] {
            command.encode(&mut self.outgoing);
        }
        self.state = SessionState::Begin { pause: PAUSE };
    }

    /// Decodes received bytes.
    pub fn receive(&mut self, bytes: &[u8], now: Duration, mut event: impl FnMut(Event)) {
        self.bytes += bytes.len() as u64;
        let mut decoder = std::mem::take(&mut self.decoder);
        decoder.receive(bytes, |data| {
            self.packets += 1;
            if let Some(happened) = self.packet(data, now) {
                event(happened);
            }
        });
        self.decoder = decoder;
    }

    fn packet(&mut self, data: &[u8], now: Duration) -> Option<Event> {
        match &mut self.state {
            SessionState::Sync { step, .. } if data.first() == Some(step) => {
                let step = *step;
                if step < 2 {
                    self.request_sync(step + 1, now);
                    return None;
                }
                let identity = Identity::decode(&data[1..]);
                let Some(model) = self.model.or_else(|| Model::reported(&identity.model)) else {
                    // It will not be another one soon.
                    self.state = SessionState::Begin { pause: SILENCE };
                    return Some(Event::Lost(Loss::Unknown(identity.model)));
                };
                self.state = SessionState::Opening { identity, model, requested_at: now, tries: 1 };
                self.open(now);
                None
            }
            SessionState::Opening { identity, model, .. } => {
                let report = Report::decode(data)?;
                let (identity, model) = (std::mem::take(identity), *model);
                self.state = SessionState::Open(OpenConnection {
                    last_report: now,
                    model,
                    sent: (0, 0),
                    changed: now,
                    renewed: Duration::ZERO,
                    moving: report.moving,
                    motors: Switch { is_on: self.switched_off, ..Switch::default() },
                    sonars: Switch::default(),
                });
                Some(Event::Connected { identity, model })
            }
            SessionState::Open(open) => {
                let report = Report::decode(data)?;
                open.last_report = now;
                open.moving = report.moving || report.left != 0 || report.right != 0;
                // Motors that a person switches off at the robot stay off: they are switched on once.
                self.switched_off = !report.motors() && open.motors.is_on;
                open.motors.is_on |= report.motors();
                open.sonars.is_on |= report.sonars();
                (self.bytes, self.packets) = (0, 0);
                Some(Event::Report(report))
            }
            _ => None,
        }
    }

    /// Advances the time: sends due packets, and detects timeouts.
    pub fn poll(&mut self, now: Duration) -> Option<Event> {
        match &mut self.state {
            SessionState::Begin { pause } => {
                let until = now + *pause;
                // A robot that its watchdog has stopped drives on at the next packet of any kind, as it was told last. So
                // the first one is a stop, and then the old connection ends, if there is one.
                self.send(Command::Stop, now);
                self.send(Command::Close, now);
                (self.bytes, self.packets) = (0, 0);
                self.state = SessionState::Pause { until };
                None
            }
            SessionState::Pause { until } => {
                if now >= *until {
                    self.request_sync(0, now);
                }
                None
            }
            SessionState::Sync { step, requested_at, tries } => {
                if now.saturating_sub(*requested_at) < TIMEOUT {
                    return None;
                }
                if *tries == MAX_ATTEMPTS {
                    return Some(self.lose(match (self.bytes, self.packets) {
                        (0, _) => Loss::NoAnswer,
                        (_, 0) => Loss::Noise,
                        _ => Loss::Confused,
                    }));
                }
                (*tries, *requested_at) = (*tries + 1, now);
                let step = *step;
                self.send(Command::Sync(step), now);
                None
            }
            SessionState::Opening { requested_at, tries, .. } => {
                if now.saturating_sub(*requested_at) < TIMEOUT {
                    return None;
                }
                if *tries == MAX_ATTEMPTS {
                    return Some(self.lose(Loss::Confused));
                }
                (*tries, *requested_at) = (*tries + 1, now);
                self.open(now);
                None
            }
            SessionState::Open(open) => {
                if now.saturating_sub(open.last_report) >= SILENCE {
                    // A packet may have been cut off.
                    let noise = self.bytes > packet::LARGEST as u64;
                    return Some(self.lose(if noise { Loss::Drowned } else { Loss::Silent }));
                }
                self.keep(now);
                None
            }
        }
    }

    fn lose(&mut self, loss: Loss) -> Event {
        self.state = SessionState::Begin { pause: PAUSE };
        Event::Lost(loss)
    }

    fn request_sync(&mut self, step: u8, now: Duration) {
        self.state = SessionState::Sync { step, requested_at: now, tries: 1 };
        self.send(Command::Sync(step), now);
    }

    fn open(&mut self, now: Duration) {
        self.send(Command::Open, now);
        self.send(Command::Pulse, now);
    }

    /// Sends a command over an open connection.
    fn keep(&mut self, now: Duration) {
        let fresh = self.commanded.filter(|(_, since)| now.saturating_sub(*since) < self.time_to_live);
        // Unsent commands would only grow old.
        let waits = !self.outgoing.is_empty();
        let sent_at = self.sent_at;
        let SessionState::Open(open) = &mut self.state else { return };
        if waits {
            return;
        }
        let mut commands = Vec::new();
        if open.motors.due(now) {
            commands.push(Command::Enable(true));
        }
        if open.sonars.due(now) {
            commands.push(Command::Sonar(true));
        }
        let motion = fresh.map_or((0, 0), |([left, right], _)| open.model.motion(left, right));
        let since = now.saturating_sub(open.renewed);
        let is_new = motion != open.sent;
        if is_new {
            open.changed = now;
        }
        let stands = motion == (0, 0) && !open.moving && now.saturating_sub(open.changed) > SILENCE;
        if (is_new && (motion == (0, 0) || since >= SPACING)) || (!stands && since >= RENEWAL) {
            (open.sent, open.renewed) = (motion, now);
            commands.extend([Command::Velocity(motion.0), Command::Rotation(motion.1)]);
        } else if now.saturating_sub(sent_at) >= BEAT {
            commands.push(Command::Pulse);
        }
        for command in commands {
            self.send(command, now);
        }
    }

    fn send(&mut self, command: Command<'_>, now: Duration) {
        // A blocked port must not let this grow; commands left out are sent again.
        if self.outgoing.len() < 256 {
            command.encode(&mut self.outgoing);
            self.sent_at = now;
        }
    }
}

//! Firmware of a controller: synchronization, commands, watchdog, reports.

use std::time::Duration;

use slate_arcos::command::Command;
use slate_arcos::packet::{self, Decoder};
use slate_arcos::report::{Identity, MOTORS, Range, Report, STOP_BUTTON};

use crate::body::SimulatedPioneer;

/// Watchdog timeout: the robot stops without a packet.
pub const WATCHDOG: Duration = Duration::from_secs(2);
/// Period of reports.
const CYCLE: Duration = Duration::from_millis(100);
/// Interval between the sonars of an array.
const SONAR: Duration = Duration::from_millis(40);
/// Time for which a stalled robot keeps its motors off.
const STALL: Duration = Duration::from_secs(1);
/// Sonars of an array.
const ARRAY: usize = 8;

/// State of a client.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ClientState {
    /// Number of completed steps of the synchronization.
    Synchronizing(u8),
    Open,
}

/// Software of a controller, without a line and without a clock.
#[derive(Debug)]
pub struct Firmware {
    identity: Identity,
    decoder: Decoder,
    outgoing: Vec<u8>,
    connection: ClientState,
    /// Arrival time of the last packet.
    received_at: Duration,
    motors: bool,
    sonars: bool,
    stop_button: bool,
    /// Last command: mm/s, degrees per second.
    velocity: f64,
    rotation: f64,
    /// Pose of the origin in the body's odometry: x, y, theta.
    origin: [f64; 3],
    stalled: Option<Duration>,
    next_report: Duration,
    next_sonar: Duration,
    /// Next sonar of each array.
    sonar: usize,
    ranges: Vec<Range>,
}

impl Firmware {
    /// Returns a controller that is switched on.
    pub fn new() -> Self {
        Self {
            identity: Identity { name: "slate-sim".into(), class: "Pioneer".into(), model: "p3dx-sh".into() },
            decoder: Decoder::default(),
            outgoing: Vec::new(),
            connection: ClientState::Synchronizing(0),
            received_at: Duration::ZERO,
            motors: false,
            sonars: false,
            stop_button: false,
            velocity: 0.0,
            rotation: 0.0,
            origin: [0.0; 3],
            stalled: None,
            next_report: Duration::ZERO,
            next_sonar: Duration::ZERO,
            sonar: 0,
            ranges: Vec::new(),
        }
    }

    /// Returns the bytes to send; the caller removes those it has sent.
    pub fn outgoing(&mut self) -> &mut Vec<u8> {
        &mut self.outgoing
    }

    /// Power-cycles the controller: drops its client and zeroes its odometry.
    /// The origin is then the present pose.
    pub fn restart(&mut self, body: &SimulatedPioneer) {
        let pose = body.odometry();
        *self = Self { origin: [pose.x, pose.y, pose.theta], ..Self::new() };
    }

    /// Presses the motors button, which switches them on or off.
    pub fn press_motors_button(&mut self) {
        self.motors = !self.motors && !self.stop_button;
    }

    /// Presses the stop button or releases it.
    pub fn set_stop_button(&mut self, pressed: bool) {
        self.stop_button = pressed;
        self.motors &= !pressed;
    }

    /// Returns true if a client is connected.
    pub fn is_open(&self) -> bool {
        self.connection == ClientState::Open
    }

    /// Returns true if the motors are on.
    pub fn motors(&self) -> bool {
        self.motors
    }

    /// Decodes received bytes.
    pub fn receive(&mut self, bytes: &[u8], body: &SimulatedPioneer, now: Duration) {
        let mut decoder = std::mem::take(&mut self.decoder);
        decoder.receive(bytes, |data| self.packet(data, body, now));
        self.decoder = decoder;
    }

    fn packet(&mut self, data: &[u8], body: &SimulatedPioneer, now: Duration) {
        if let ClientState::Synchronizing(done) = self.connection {
            self.synchronize(data, done, now);
            return;
        }
        self.received_at = now;
        match Command::decode(data) {
            Some(Command::Close) => {
                self.connection = ClientState::Synchronizing(0);
                (self.motors, self.sonars) = (false, false);
                self.halt();
            }
            Some(Command::Enable(on)) => {
                self.motors = on && !self.stop_button;
                self.halt();
            }
            Some(Command::Sonar(on)) => self.sonars = on,
            Some(Command::Velocity(speed)) => self.velocity = speed.into(),
            Some(Command::Rotation(turn)) => self.rotation = turn.into(),
            Some(Command::Wheels(left, right)) => {
                let (left, right) = (20.0 * f64::from(left), 20.0 * f64::from(right));
                self.velocity = (left + right) / 2.0;
                self.rotation = ((right - left) * 0.001 / 0.331).to_degrees();
            }
            Some(Command::Stop) => self.halt(),
            Some(Command::SetOrigin) => {
                let pose = body.odometry();
                self.origin = [pose.x, pose.y, pose.theta];
            }
            _ => {}
        }
    }

    fn synchronize(&mut self, data: &[u8], done: u8, now: Duration) {
        let &[step] = data else { return };
        if step == 1 && done == 3 {
            self.connection = ClientState::Open;
            (self.received_at, self.next_report, self.next_sonar) = (now, now + CYCLE, now + SONAR);
            self.ranges.clear();
            self.halt();
        } else if step < 3 && step <= done {
            self.connection = ClientState::Synchronizing(step + 1);
            let mut answer = vec![step];
            if step == 2 {
                answer.extend(self.identity.encode());
            }
            packet::encode(&answer, &mut self.outgoing);
        }
    }

    fn halt(&mut self) {
        (self.velocity, self.rotation) = (0.0, 0.0);
    }

    /// Advances the time to `now`.
    pub fn advance(&mut self, body: &mut SimulatedPioneer, now: Duration) {
        let is_alive = now.saturating_sub(self.received_at) < WATCHDOG;
        self.feel(body, now);
        if self.is_open() && self.motors && is_alive && self.stalled.is_none() {
            body.drive(self.velocity * 0.001, self.rotation.to_radians());
        } else {
            body.drive(0.0, 0.0);
        }
        body.advance(now.as_nanos() as u64);
        while self.next_sonar <= now {
            self.next_sonar += SONAR;
            if self.is_open() && self.sonars {
                self.listen(body);
            }
        }
        if self.is_open() && self.next_report <= now {
            // Reports that a busy machine has missed are not made up for.
            while self.next_report <= now {
                self.next_report += CYCLE;
            }
            let report = self.report(body).encode();
            packet::encode(&report, &mut self.outgoing);
        }
    }

    /// Stalls the robot while a bumper in the direction of travel is pressed.
    fn feel(&mut self, body: &SimulatedPioneer, now: Duration) {
        let (front, back) = body.bumpers();
        if (front && self.velocity > 0.0) || (back && self.velocity < 0.0) {
            self.stalled = Some(now + STALL);
        } else if front || back || self.stalled.is_some_and(|until| until <= now) {
            self.stalled = None;
        }
    }

    fn listen(&mut self, body: &mut SimulatedPioneer) {
        body.listen();
        for array in 0..2 {
            let sonar = array * ARRAY + self.sonar;
            if let Some(range) = body.range(sonar) {
                self.ranges.push(Range { sonar: sonar as u8, range: (range * 1000.0).round() as u16 });
            }
        }
        self.sonar = (self.sonar + 1) % ARRAY;
    }

    fn report(&mut self, body: &SimulatedPioneer) -> Report {
        let pose = body.odometry();
        let [x, y, theta] = self.origin;
        let (sin, cos) = (slate_module::math::sin(theta), slate_module::math::cos(theta));
        let (dx, dy) = (pose.x - x, pose.y - y);
        // 16 bits, which wrap around.
        let millimeters = |distance: f64| (distance * 1000.0).round() as i64 as u16;
        let angle = slate_module::math::wrap_angle(pose.theta - theta);
        let (left, right) = body.wheels();
        let stall = u8::from(self.stalled.is_some());
        // All five buttons of a bumper, as a body of one piece presses them.
        let buttons = |pressed: bool| if pressed { 0b11_1110 } else { 0 };
        let (front, back) = body.bumpers();
        let flag = |on: bool, bits: u16| if on { bits } else { 0 };
        Report {
            moving: left != 0.0 || right != 0.0,
            x: millimeters(dx * cos + dy * sin),
            y: millimeters(dy * cos - dx * sin),
            heading: (angle * 2048.0 / std::f64::consts::PI).round() as i16,
            left: (left * 1000.0).round() as i16,
            right: (right * 1000.0).round() as i16,
            battery: 126,
            left_stall_and_back_bumper: stall | buttons(back),
            right_stall_and_front_bumper: stall | buttons(front),
            control: 0,
            flags: flag(self.motors, MOTORS) | flag(self.sonars, 0b110) | flag(self.stop_button, STOP_BUTTON),
            compass: 0,
            ranges: std::mem::take(&mut self.ranges),
            rotation: Some((((right - left) / 0.331).to_degrees() * 10.0).round() as i16),
        }
    }
}

impl Default for Firmware {
    fn default() -> Self {
        Self::new()
    }
}

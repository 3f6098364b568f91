//! Player of a laser log as sensors.

use std::path::Path;

use serde::{Deserialize, Serialize};
use slate_interfaces::{LaserScan, MissionOutcome, MissionState, Odometry, Twist2, Verdict};
use slate_module::prelude::*;

use crate::block::SlamStatus;
use crate::carmen::{LaserLog, LogFormat, read_log};

/// Ports of [`LogPlayer`].
#[ports]
pub struct LogPlayerIo {
    /// Scan of the log.
    #[capacity(2048)]
    scan: Output<LaserScan>,
    /// Raw odometry of the log, without a twist.
    odometry: Output<Odometry>,
    /// Progress of the playback.
    progress: Output<LogProgress>,
}

/// Progress of the playback of a laser log.
#[interface]
#[derive(PartialEq)]
pub struct LogProgress {
    /// Number of scans that were played.
    pub scans: u32,
    /// Number of scans of the log.
    pub all_scans: u32,
    /// Time of the log since its first line.
    #[unit("s")]
    pub time: f64,
    /// True if all scans were played.
    pub has_ended: Bool,
}

/// Parameters of [`LogPlayer`].
#[params]
pub struct LogPlayerParams {
    #[param(default = "", doc = "log of CARMEN with `ODOM` and `FLASER` lines")]
    log_file: Text<252>,
    #[param(default = 1.0, range = 0.001..=1000.0, doc = "speed over that of the log")]
    speed: f64,
    #[param(default = std::f64::consts::PI, range = 0.01..=6.3, unit = "rad", doc = "angle over which the beams of a scan spread")]
    field_of_view: f64,
    #[param(default = 80.0, range = 0.1..=1000.0, unit = "m", doc = "maximum range of the laser")]
    max_range: f64,
    #[param(default = false, doc = "true: GMapping has moved the odometry of the log onto its own poses")]
    is_corrected: Bool,
}

/// Player of a CARMEN log: its scans and odometry.
/// It plays one scan in a cycle at most, and leaves none out.
///
/// With a scan comes the odometry at it. After the last line the odometry stands still.
pub struct LogPlayer;

/// State of [`LogPlayer`].
#[derive(Default, Serialize, Deserialize)]
pub struct LogPlayerState {
    /// Start time of the playback, s.
    began: Option<f64>,
    /// Scans and lines of the odometry that were played.
    scans: usize,
    lines: usize,
    /// Log and its file, or the error in it; read again after a restart.
    #[serde(skip)]
    log: Option<(String, Option<LaserLog>)>,
}

/// Plays a laser log of CARMEN as laser and odometry.
#[module(stage = SensorAcquire)]
impl Module for LogPlayer {
    type Io = LogPlayerIo;
    type Params = LogPlayerParams;
    type State = LogPlayerState;

    fn tick(state: &mut LogPlayerState, io: &LogPlayerIo, params: &LogPlayerParams, now: &Tick) -> Outcome {
        state.read(params, now);
        let Some((_, Some(log))) = &state.log else { return Outcome::Degraded };
        let began = *state.began.get_or_insert(now.seconds());
        let first = log.odometry.first().map_or(0.0, |line| line.time);
        let time = first + (now.seconds() - began) * params.speed;
        let scan = log.scans.get(state.scans).filter(|scan| scan.time <= time);
        // Lines of the odometry before the scan, by its place in the log.
        let is_due = |line: &&crate::carmen::LoggedPose| line.time <= time && line.scans <= state.scans;
        let lines = log.odometry[state.lines..].iter().take_while(is_due).count();
        state.lines += lines;
        if let Some(scan) = scan {
            state.scans += 1;
            io.odometry.set(Odometry { pose: scan.odometry, twist: Twist2::ZERO });
            io.scan.write(scan.ranges.len(), |written| {
                [written.angle_min, written.angle_increment] = scan.angles;
                (written.range_min, written.range_max) = (0.0, params.max_range);
                for (range, logged) in written.ranges.iter_mut().zip(&scan.ranges) {
                    *range = *logged as f32;
                }
            });
        }
        let has_ended = state.scans == log.scans.len() && state.lines == log.odometry.len();
        let newest = log.odometry[..state.lines].last();
        if let Some(line) = newest.filter(|_| scan.is_none() && (lines > 0 || has_ended)) {
            io.odometry.set(Odometry { pose: line.pose, twist: Twist2::ZERO });
        }
        io.progress.set(LogProgress {
            scans: state.scans as u32,
            all_scans: log.scans.len() as u32,
            time: time - first,
            has_ended: has_ended.into(),
        });
        Outcome::Ok
    }
}

impl LogPlayerState {
    /// Reads the log, when its name is new.
    fn read(&mut self, params: &LogPlayerParams, now: &Tick) {
        let file = params.log_file.as_str();
        if self.log.as_ref().is_some_and(|(read, _)| read == file) {
            return;
        }
        // Another one begins anew, but not that of a state which was restored.
        if self.log.is_some() {
            (self.began, self.scans, self.lines) = (None, 0, 0);
        }
        let format =
            LogFormat { field_of_view: params.field_of_view, is_corrected: params.is_corrected.get() };
        let log = read_log(Path::new(file), &format);
        let log = log.map_err(|error| now.error(format_args!("{error}; name another `log_file`"))).ok();
        // A restored state may be of a longer file.
        if let Some(log) = &log {
            self.scans = self.scans.min(log.scans.len());
            self.lines = self.lines.min(log.odometry.len());
        }
        self.log = Some((file.into(), log));
    }
}

/// Ports of [`LogReferee`].
#[ports]
pub struct LogRefereeIo {
    /// Progress of the player.
    progress: Input<LogProgress>,
    /// Progress of the SLAM.
    status: Input<SlamStatus>,
    /// Verdict: succeeded once the log has ended and the map has all of it.
    verdict: Output<Verdict>,
}

/// Ends a run when a log was played and mapped.
pub struct LogReferee;

/// State of [`LogReferee`].
#[derive(Default, Serialize, Deserialize)]
pub struct LogRefereeState {
    /// Status of the SLAM when the log had ended: one after it tells.
    ended_at: Option<u64>,
    has_decided: bool,
}

/// Ends a run when a laser log was played and mapped.
#[module(stage = PostLoop)]
impl Module for LogReferee {
    type Io = LogRefereeIo;
    type Params = ();
    type State = LogRefereeState;

    fn tick(state: &mut LogRefereeState, io: &LogRefereeIo, (): &(), _: &Tick) -> Outcome {
        let (Some(progress), Some(status)) = (io.progress.get(), io.status.get()) else { return Outcome::Ok };
        if state.has_decided {
            return Outcome::Ok;
        }
        let time = io.status.stamp().time;
        if progress.has_ended.get() {
            state.ended_at.get_or_insert(time);
        }
        state.has_decided = status.is_settled.get() && state.ended_at.is_some_and(|ended| time > ended);
        let is_on = if state.has_decided { MissionState::SUCCEEDED } else { MissionState::RUNNING };
        let reason = reason(progress, status);
        io.verdict.set(Verdict { state: is_on, outcome: MissionOutcome::OTHER, reason });
        Outcome::Ok
    }
}

fn reason(progress: &LogProgress, status: &SlamStatus) -> Text<64> {
    let LogProgress { scans, all_scans, .. } = progress;
    Text::new(&format!("{scans} of {all_scans} scans, {} loop closures", status.loop_closures))
}

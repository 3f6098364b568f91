//! Architecture of a robot (RoCS): the MAPE-K loop.
//! Monitor, Analyze, Plan, Execute around Knowledge.
//!
//! A robot has two routes. On the deliberative one a [`Monitor`] interprets sensors, an [`Analyze`] reports changes,
//! the [`Plan`] decides and [`ExecuteBlock`] performs its actions. On the reactive one a [`ReactiveModel`] is woken by
//! its sensors and sends a reflex straight to Execute, where it precedes all planned actions. All blocks
//! may read [`Knowledge`]. Every block is a module, and all that flows between them are properties and messages.
//!
//! ```
//! use serde::{Deserialize, Serialize};
//! use slate_interfaces::{Pose2, SonarScan, Twist2, WheelSpeeds};
//! use slate_mapek::{prelude::*, ReactiveBlock, Reflex};
//! use slate_module::prelude::*;
//!
//! // Mandatory: its sensors and actuators, and what it can do.
//!
//! /// Distance to the nearest obstacle.
//! #[interface]
//! pub struct Nearest {
//!     /// Meters.
//!     #[unit("m")]
//!     pub distance: f64,
//! }
//!
//! #[ports]
//! pub struct SonarIo {
//!     scan: Input<SonarScan>,
//! }
//!
//! /// The nearest echo of a ring of sonars.
//! pub struct Sonar;
//!
//! impl Sensor for Sonar {
//!     const NAME: &'static str = "sonar";
//!     type Io = SonarIo;
//!     type Params = ();
//!     type State = ();
//!     type Value = Nearest;
//!
//!     fn get_data(_: &mut (), io: &SonarIo, _: &(), _: &Tick) -> Option<Nearest> {
//!         let scan = io.scan.updated()?;
//!         let ranges = scan.echoes.iter().map(|echo| echo.range);
//!         Some(Nearest { distance: ranges.fold(scan.range_max, math::min) })
//!     }
//! }
//!
//! slate_mapek::driver_sensors! {
//!     Localizer("localizer", "Pose that a localizer outside of the robot publishes."): Pose2,
//! }
//!
//! #[ports]
//! pub struct WheelsIo {
//!     speeds: Output<WheelSpeeds>,
//! }
//!
//! /// Two driven wheels.
//! pub struct Wheels;
//!
//! impl Actuator for Wheels {
//!     const NAME: &'static str = "wheels";
//!     type Io = WheelsIo;
//!     type Params = ();
//!     type State = ();
//!     type Command = Twist2;
//!     const SAFE: Twist2 = Twist2::ZERO;
//!
//!     fn apply(_: &mut (), command: &Twist2, io: &WheelsIo, _: &(), _: &Tick) -> Outcome {
//!         // Wheels of 0.1 m radius, 0.33 m apart.
//!         let turn = command.angular * 0.165;
//!         let speeds = WheelSpeeds { left: (command.linear - turn) / 0.1, right: (command.linear + turn) / 0.1 };
//!         io.speeds.set(speeds);
//!         Outcome::Ok
//!     }
//! }
//!
//! /// Ports that actions act on.
//! #[ports]
//! pub struct Body {
//!     pose: Required<Pose2>,
//!     wheels: Command<Twist2>,
//! }
//!
//! /// Turns on the spot.
//! #[derive(Serialize, Deserialize)]
//! pub struct TurnTo {
//!     /// Radians.
//!     heading: f64,
//! }
//!
//! impl ActionKind for TurnTo {
//!     const KIND: &'static str = "TurnTo";
//!     type Arguments = f64;
//!
//!     fn start(heading: f64) -> Self {
//!         Self { heading }
//!     }
//! }
//!
//! impl Action<Body> for TurnTo {
//!     fn act(&mut self, acting: &Acting<'_, Body>) -> Step {
//!         let error = math::angle_between(acting.body.pose.theta, self.heading);
//!         if error.abs() < 0.05 {
//!             return Step::Done;
//!         }
//!         acting.body.wheels.send(Twist2 { linear: 0.0, angular: 2.0 * error }, acting.priority);
//!         Step::Running
//!     }
//! }
//!
//! /// Drives straight for a duration.
//! #[derive(Serialize, Deserialize)]
//! pub struct Drive {
//!     /// Meters per second.
//!     speed: f64,
//!     /// Remaining time, seconds.
//!     left: f64,
//! }
//!
//! /// Arguments of [`Drive`].
//! #[derive(Clone, Copy)]
//! pub struct Stretch {
//!     /// Meters per second.
//!     speed: f64,
//!     /// Seconds.
//!     duration: f64,
//! }
//! arguments!(Stretch { speed, duration });
//!
//! impl ActionKind for Drive {
//!     const KIND: &'static str = "Drive";
//!     type Arguments = Stretch;
//!
//!     fn start(stretch: Stretch) -> Self {
//!         Self { speed: stretch.speed, left: stretch.duration }
//!     }
//! }
//!
//! impl Action<Body> for Drive {
//!     fn act(&mut self, acting: &Acting<'_, Body>) -> Step {
//!         self.left -= acting.now.elapsed();
//!         if self.left <= 0.0 {
//!             return Step::Done;
//!         }
//!         acting.body.wheels.send(Twist2 { linear: self.speed, angular: 0.0 }, acting.priority);
//!         Step::Running
//!     }
//! }
//!
//! /// A macro-action: turns to the origin and drives there, in short legs.
//! #[derive(Serialize, Deserialize)]
//! pub struct GoToOrigin {
//!     leg: Option<InSequence<(TurnTo, Drive)>>,
//! }
//!
//! impl ActionKind for GoToOrigin {
//!     const KIND: &'static str = "GoToOrigin";
//!     type Arguments = ();
//!
//!     fn start((): ()) -> Self {
//!         Self { leg: None }
//!     }
//!
//!     fn children(&self, tree: &mut ActionTree) {
//!         if let Some(leg) = &self.leg {
//!             tree.child(leg);
//!         }
//!     }
//! }
//!
//! impl Action<Body> for GoToOrigin {
//!     fn act(&mut self, acting: &Acting<'_, Body>) -> Step {
//!         let pose = &acting.body.pose;
//!         if math::hypot(pose.x, pose.y) < 0.1 {
//!             return Step::Done;
//!         }
//!         let next = || {
//!             let stretch = Stretch { speed: 0.3, duration: 0.5 };
//!             InSequence::start((math::atan2(-pose.y, -pose.x), stretch))
//!         };
//!         let mut leg = self.leg.take().unwrap_or_else(next);
//!         if leg.act(acting) == Step::Done {
//!             // In the same cycle, so that the wheels never wait for a command.
//!             leg = next();
//!             leg.act(acting);
//!         }
//!         self.leg = Some(leg);
//!         Step::Running
//!     }
//! }
//!
//! repertoire! {
//!     /// All actions of the robot.
//!     pub enum Actions for Body { TurnTo, Drive, GoToOrigin }
//! }
//!
//! // Deliberative: how it perceives and decides.
//!
//! /// Whether the robot is at the origin.
//! #[interface]
//! #[derive(PartialEq)]
//! pub struct AtOrigin {
//!     /// Whether it is.
//!     pub there: Bool,
//! }
//!
//! #[ports]
//! pub struct PoseSensor {
//!     pose: Input<Pose2>,
//! }
//!
//! /// Forwards the pose.
//! pub struct PoseMonitor;
//!
//! impl Monitor for PoseMonitor {
//!     const NAME: &'static str = "pose_monitor";
//!     type Sensors = PoseSensor;
//!     type Params = ();
//!     type State = ();
//!     type Value = Pose2;
//!
//!     fn interpret(_: &mut (), sensors: &PoseSensor, _: &(), _: &Tick) -> Option<Pose2> {
//!         sensors.pose.fresh().copied()
//!     }
//! }
//!
//! #[ports]
//! pub struct ObservedPose {
//!     pose: Observed<Pose2>,
//! }
//!
//! /// Reports arrival at the origin and departure from it.
//! pub struct Arrival;
//!
//! impl Analyze for Arrival {
//!     const NAME: &'static str = "arrival";
//!     type Observed = ObservedPose;
//!     type Params = ();
//!     type State = Option<bool>;
//!     type Value = AtOrigin;
//!
//!     fn process(last: &mut Option<bool>, observed: &ObservedPose, _: &(), _: &Tick) -> Option<AtOrigin> {
//!         let pose = observed.pose.updated()?;
//!         let there = math::hypot(pose.x, pose.y) < 0.1;
//!         (last.replace(there) != Some(there)).then_some(AtOrigin { there: there.into() })
//!     }
//! }
//!
//! #[ports]
//! pub struct NoticedArrival {
//!     arrival: Noticed<AtOrigin>,
//! }
//!
//! /// Requests `GoToOrigin`, again after each reflex.
//! pub struct GoToOriginPlanner;
//!
//! impl Plan for GoToOriginPlanner {
//!     const NAME: &'static str = "go_to_origin_planner";
//!     type Noticed = NoticedArrival;
//!     type Params = ();
//!     type State = bool;
//!
//!     fn run(
//!         there: &mut bool,
//!         noticed: &NoticedArrival,
//!         situation: &Situation<'_>,
//!         _: &(),
//!         _: &Tick,
//!         plan: &mut Agenda<'_>,
//!     ) {
//!         if let Some(arrival) = noticed.arrival.newest() {
//!             *there = arrival.there.get();
//!         }
//!         if !*there && situation.needs_plan() {
//!             plan.replace(GoToOrigin::request(()));
//!         }
//!     }
//! }
//!
//! // Reactive: its reflexes.
//!
//! #[ports]
//! pub struct Bumper {
//!     nearest: Input<Nearest>,
//! }
//!
//! #[params]
//! pub struct BackOffParams {
//!     #[param(default = 0.2, range = 0.0..=2.0, unit = "m", doc = "distance below which it backs off")]
//!     distance: f64,
//! }
//!
//! /// Backs off from near obstacles.
//! pub struct BackOff;
//!
//! impl ReactiveModel for BackOff {
//!     const NAME: &'static str = "back_off";
//!     type Sensors = Bumper;
//!     type Params = BackOffParams;
//!     type State = ();
//!
//!     fn run(_: &mut (), sensors: &Bumper, params: &BackOffParams, _: &Tick) -> Option<ActionRequest> {
//!         let nearest = sensors.nearest.fresh()?;
//!         (nearest.distance < params.distance)
//!             .then(|| Drive::request(Stretch { speed: -0.2, duration: 0.5 }))
//!     }
//! }
//!
//! // The robot. A configuration can say the same.
//!
//! let robot = Robot::new("r2")
//!     .sensor::<Sonar>("sonar")
//!     .link("scan", "/simulator/r2/sonar")
//!     .sensor::<Localizer>("localizer")
//!     .link("source", "/localizer/pose")
//!     .monitor::<PoseMonitor>("pose_monitor")
//!     .sense::<Localizer>("localizer")
//!     .attach::<Arrival>("arrival")
//!     .analyze::<Arrival>("arrival")
//!     .attach::<GoToOriginPlanner>("planner")
//!     .plan::<GoToOriginPlanner>("planner")
//!     .reactive::<BackOff>("back_off")
//!     .params(|params| params.distance = 0.3)
//!     .sense::<Sonar>("sonar")
//!     .execute::<Actions>("execute")
//!     .link("pose", "localizer/value")
//!     .gate("wheels", Gate::new(Twist2::ZERO).limit("linear", -0.5..=0.5))
//!     .actuator::<Wheels>("wheels_driver")
//!     .link("command", "wheels/command");
//!
//! let configuration = robot.to_toml()?;
//! assert!(configuration.contains(r#"back_off = { params = { distance = 0.3 } }"#));
//! # let book = concat!(env!("CARGO_MANIFEST_DIR"), "/../../book/src/01-a-robot-in-mape-k.md");
//! # assert!(std::fs::read_to_string(book)?.contains(&configuration), "{configuration}");
//!
//! // Each block is tested by itself, without an agent and without a thread.
//!
//! let mut back_off = slate_module::testing::Fixture::<ReactiveBlock<BackOff>>::new();
//! back_off.set("nearest", Nearest { distance: 0.1 });
//! back_off.tick();
//! assert_eq!(back_off.sent::<Reflex>("reflex")[0].action, Drive::request(Stretch { speed: -0.2, duration: 0.5 }));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod action;
mod actuator;
mod analyze;
mod block;
mod driver;
mod execute;
mod in_place;
mod kind;
mod knowledge;
mod message;
mod monitor;
mod pipeline;
mod plain;
mod plan;
mod port;
mod published;
mod reactive;
mod repertoire;
mod robot;
mod sensor;
mod status;

pub use action::{
    Acting, Action, ActionKind, ActionTree, Arguments, InParallel, InSequence, ParallelWriter, Repeat, Step,
    Transmission,
};
pub use actuator::{Actuator, ActuatorBlock, ActuatorBlockState, ActuatorPorts};
pub use analyze::{Analyze, AnalyzeBlock};
pub use block::BlockState;
pub use driver::DriverPorts;
#[doc(hidden)]
pub use driver::driver_outcome;
pub use execute::{ExecuteBlock, ExecutePorts, Execution};
pub use in_place::InPlace;
pub use kind::{actuator, analyze, execute, knowledge, monitor, plan, reactive, sensor};
pub use knowledge::{
    ActuatorStatus, Device, DeviceHealth, Fact, FactTable, Facts, Kinematics, Knowledge, KnowledgeBlock,
    Live, Merge, MostCertain, Newest, PlanDescription, PlanLibrary, PlanOutcome, RobotModel, Role, Stated,
    Statements, Steering, StoredPlan, StrategyModel, StrategyPorts, StrategyRecord, StrategyReport, Union,
    Version, WorldModel,
};
pub use message::{ActionRequest, PlanStep, Planned, Rank, Reflex, RefusalReason};
pub use monitor::{Monitor, MonitorBlock};
pub use pipeline::{Admission, Origin, Pipeline, QueuedAction};
pub use plain::{PlainAnalyze, PlainModule, PlainPorts};
pub use plan::{Agenda, Plan, PlanBlock, PlanMemory, PlanPorts, Situation};
pub use port::{
    Change, Commanded, HandedOn, Known, Measurement, Noticed, Observed, Percept, PlanIn, PlanOut, ReflexIn,
    ReflexOut, Sensed,
};
pub use published::{AnalyzePorts, MonitorPorts, Published, SensorPorts};
pub use reactive::{ReactiveBlock, ReactiveModel, ReactivePorts};
pub use repertoire::{Repertoire, RequestError, read_arguments};
pub use robot::{Gate, Notices, Observes, Robot, RobotError, RobotErrors, RobotProblem, Senses};
pub use sensor::{Sensor, SensorBlock};
#[doc(hidden)]
pub use slate_interfaces::DriverStatus;
pub use slate_module::role;
pub use status::{Ended, Ending, ExecuteStatus, Route, WaitingAction, WaitingActions};
#[doc(hidden)]
pub use {serde, slate_module};

/// Imports of a robot's file, besides the other preludes.
/// The others are those of slate-module and slate-interfaces.
///
/// The blocks and what they exchange, the builder, actions, the pipeline and the parts of Knowledge.
pub mod prelude {
    pub use crate::{
        Acting, Action, ActionKind, ActionRequest, ActionTree, Actuator, ActuatorBlock, ActuatorStatus,
        Admission, Agenda, Analyze, AnalyzeBlock, BlockState, Change, DeviceHealth, Ended, Ending,
        ExecuteBlock, ExecuteStatus, Fact, FactTable, Facts, Gate, HandedOn, InParallel, InPlace, InSequence,
        Knowledge, KnowledgeBlock, Known, Measurement, Monitor, MonitorBlock, Noticed, Observed, Origin,
        Percept, Pipeline, Plan, PlanBlock, PlanStep, Planned, Rank, ReactiveBlock, ReactiveModel, Reflex,
        Repeat, Repertoire, Robot, RobotModel, Route, Sensed, Sensor, SensorBlock, Situation, Step,
        StrategyModel, Transmission, WorldModel, arguments, repertoire,
    };
}

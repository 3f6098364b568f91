//! Robot in MAPE-K that drives to a target and backs off from near obstacles.
//!
//! `cargo test` tests the blocks without a robot, `slate run PROJECT_NAME.toml` runs them in the simulator.

use serde::{Deserialize, Serialize};
use slate_plugin::prelude::*;

// --- actions of the robot -------------------------------------------------------------------------------------------

/// Body of the robot, on which actions act.
#[ports]
pub struct Body {
    /// Position of the robot.
    #[stale(after = "200ms")]
    position: Required<Position>,
    /// Heading of the robot.
    #[stale(after = "200ms")]
    orientation: Required<Orientation>,
    /// Command for the wheels.
    wheels: Command<WheelSpeeds>,
}

/// Wheel radius and track width, meters.
const WHEEL: f64 = 0.0975;
const TRACK: f64 = 0.331;

impl Body {
    /// Commands linear and angular velocity, m/s and rad/s.
    fn drive(&self, linear: f64, angular: f64, priority: Priority) {
        let turn = angular * TRACK / 2.0;
        let [left, right] = [linear - turn, linear + turn].map(|speed| speed / WHEEL);
        self.wheels.send(WheelSpeeds { left, right }, priority);
    }
}

/// Drives to a point in the map frame.
#[derive(Serialize, Deserialize)]
pub struct GoTo {
    /// Meters.
    x: f64,
    y: f64,
}

impl ActionKind for GoTo {
    const KIND: &'static str = "GoTo";
    type Arguments = [f64; 2];

    fn start([x, y]: [f64; 2]) -> Self {
        Self { x, y }
    }
}

impl Action<Body> for GoTo {
    fn act(&mut self, acting: &Acting<'_, Body>) -> Step {
        let body = acting.body;
        let (Some(position), Some(orientation)) = (body.position.fresh(), body.orientation.fresh())
        else {
            // Without a pose it commands nothing, and the gate stops the wheels.
            return Step::Running;
        };
        let (x, y) = (self.x - position.x, self.y - position.y);
        let distance = math::hypot(x, y);
        if distance < 0.05 {
            return Step::Done;
        }
        let error = math::angle_between(orientation.theta, math::atan2(y, x));
        // Slower while it faces away from the target, and near it.
        let speed = math::min(0.4, 2.0 * distance) * math::max(math::cos(error), 0.0);
        body.drive(speed, 2.0 * error, acting.priority);
        Step::Running
    }
}

/// Drives straight back for a while.
#[derive(Serialize, Deserialize)]
pub struct BackUp {
    /// Remaining time, seconds.
    left: f64,
}

impl ActionKind for BackUp {
    const KIND: &'static str = "BackUp";
    type Arguments = f64;

    fn start(seconds: f64) -> Self {
        Self { left: seconds }
    }
}

impl Action<Body> for BackUp {
    fn act(&mut self, acting: &Acting<'_, Body>) -> Step {
        self.left -= acting.now.elapsed();
        if self.left <= 0.0 {
            return Step::Done;
        }
        acting.body.drive(-0.2, 0.0, acting.priority);
        Step::Running
    }
}

repertoire! {
    /// Repertoire of the robot.
    pub enum Actions for Body as "MODULE_KIND_execute" { GoTo, BackUp }
}

// --- the deliberative route: Monitor, Analyze, Plan ------------------------------------------------------------------

/// Sensors of the Monitor.
#[ports]
pub struct Sensors {
    position: Required<Position>,
    orientation: Required<Orientation>,
}

/// Combines position and orientation into the pose.
pub struct PoseMonitor;

impl Monitor for PoseMonitor {
    const NAME: &'static str = "MODULE_KIND_pose_monitor";
    type Sensors = Sensors;
    type Params = ();
    type State = ();
    type Value = Pose2;

    fn interpret(_: &mut (), sensors: &Sensors, _: &(), _: &Tick) -> Option<Pose2> {
        let (position, orientation) = (sensors.position.fresh()?, sensors.orientation.fresh()?);
        Some(Pose2 {
            x: position.x,
            y: position.y,
            theta: orientation.theta,
        })
    }
}

/// Arrival of the robot at its target.
#[interface]
#[derive(PartialEq)]
pub struct AtTarget {
    /// True at the target.
    pub there: Bool,
}

/// Inputs of the Analyze: pose and target.
#[ports]
pub struct Observations {
    pose: Observed<Pose2>,
    target: Required<Point2>,
}

/// Reports arrival and departure, which are rarer than poses.
pub struct Arrival;

impl Analyze for Arrival {
    const NAME: &'static str = "MODULE_KIND_arrival";
    type Observed = Observations;
    type Params = ();
    type State = Option<bool>;
    type Value = AtTarget;

    fn process(
        last: &mut Option<bool>,
        observed: &Observations,
        _: &(),
        _: &Tick,
    ) -> Option<AtTarget> {
        let (pose, target) = (observed.pose.updated()?, &observed.target);
        let there = math::hypot(target.x - pose.x, target.y - pose.y) < 0.08;
        (last.replace(there) != Some(there)).then_some(AtTarget {
            there: there.into(),
        })
    }
}

/// Inputs of the Plan: arrival and target.
#[ports]
pub struct Notices {
    arrival: Noticed<AtTarget>,
    target: Required<Point2>,
}

/// Drives to the target, and replans after a reflex.
pub struct Planner;

impl Plan for Planner {
    const NAME: &'static str = "MODULE_KIND_planner";
    type Noticed = Notices;
    type Params = ();
    type State = bool;

    fn run(
        there: &mut bool,
        noticed: &Notices,
        situation: &Situation<'_>,
        _: &(),
        _: &Tick,
        plan: &mut Agenda<'_>,
    ) {
        if let Some(arrival) = noticed.arrival.newest() {
            *there = arrival.there.get();
        }
        if !*there && situation.needs_plan() {
            plan.replace(GoTo::request([noticed.target.x, noticed.target.y]));
        }
    }
}

// --- the reactive route ----------------------------------------------------------------------------------------------

/// Inputs of the reflex.
#[ports]
pub struct Ears {
    #[stale(after = "200ms")]
    sonar: Required<SonarScan>,
}

#[params]
pub struct ReflexParams {
    #[param(default = 0.15, range = 0.0..=2.0, unit = "m", doc = "distance below which it backs off")]
    distance: f64,
}

/// Backs off from a near obstacle.
pub struct BackOff;

impl ReactiveModel for BackOff {
    const NAME: &'static str = "MODULE_KIND_back_off";
    type Sensors = Ears;
    type Params = ReflexParams;
    type State = ();

    fn run(_: &mut (), sensors: &Ears, params: &ReflexParams, _: &Tick) -> Option<ActionRequest> {
        let scan = sensors.sonar.fresh()?;
        let nearest = scan
            .echoes
            .iter()
            .map(|echo| echo.range)
            .fold(scan.range_max, math::min);
        (nearest < params.distance).then(|| BackUp::request(0.5))
    }
}

plugin!(
    MonitorBlock<PoseMonitor>,
    AnalyzeBlock<Arrival>,
    PlanBlock<Planner>,
    ReactiveBlock<BackOff>,
    ExecuteBlock<Actions>;
    robot = robot
);

/// Creates the robot of PROJECT_NAME.toml as a program.
/// Run it with: slate run target/debug/libMODULE_KIND.so
///
/// Its simulated devices are part of the world.
pub fn robot() -> Robot {
    let target = Point2 { x: 1.5, y: 1.5 };
    let wheels = Gate::new(WheelSpeeds::ZERO)
        .limit("left", -12.3..=12.3)
        .limit("right", -12.3..=12.3)
        .time_to_live("100ms");
    Robot::new("pioneer")
        .monitor::<PoseMonitor>("pose_monitor")
        .attach::<Arrival>("arrival")
        .analyze::<Arrival>("arrival")
        .input("target", target)
        .attach::<Planner>("planner")
        .plan::<Planner>("planner")
        .input("target", target)
        .reactive::<BackOff>("back_off")
        .execute::<Actions>("execute")
        .gate("wheels", wheels)
        .world_of(include_str!("../PROJECT_NAME.toml"))
}

#[cfg(test)]
mod tests {
    use slate_plugin::module::testing::Fixture;

    use super::*;

    #[test]
    fn arrival_is_reported_once() {
        let mut arrival = Fixture::<AnalyzeBlock<Arrival>>::new();
        arrival.set("target", Point2 { x: 1.0, y: 0.0 });
        let mut tells = |x: f64| {
            arrival.set(
                "pose",
                Pose2 {
                    x,
                    y: 0.0,
                    theta: 0.0,
                },
            );
            arrival.tick();
            arrival
                .wrote("change")
                .then(|| arrival.output::<AtTarget>("change").unwrap().there.get())
        };
        assert_eq!(
            [tells(0.0), tells(0.5), tells(0.99), tells(1.0)],
            [Some(false), None, Some(true), None]
        );
    }

    #[test]
    fn backs_off_from_near_obstacles() {
        let mut reflex = Fixture::<ReactiveBlock<BackOff>>::new();
        reflex.write("sonar", 0, |scan: &mut SonarScan| scan.range_max = 0.1);
        reflex.tick();
        assert_eq!(
            reflex.sent::<Reflex>("reflex")[0].action,
            BackUp::request(0.5)
        );
        let mut calm = Fixture::<ReactiveBlock<BackOff>>::new();
        calm.write("sonar", 0, |scan: &mut SonarScan| scan.range_max = 3.0);
        calm.tick();
        assert!(calm.sent::<Reflex>("reflex").is_empty());
    }
}

//! Each block by itself.

use crate::common;

use slate_interfaces::{DriverStatus, GateMode, GateState, Twist2};
use slate_mapek::prelude::*;
use slate_mapek::{
    ActuatorBlock, ActuatorStatus, AnalyzeBlock, Device, Ended, ExecuteBlock, ExecuteStatus, Knowledge,
    KnowledgeBlock, MonitorBlock, PlanBlock, PlanStep, Planned, Rank, ReactiveBlock, Reflex, Route,
    SensorBlock, driver_actuator,
};
use slate_module::prelude::*;
use slate_module::testing::Fixture;
use slate_module::{ModuleKind, Sequence, Stage, Trigger};

use common::{Actions, AvoidNear, Drive, Free, Near, NearMonitor, Wanderer, WayIsFree};

fn near(distance: f64) -> Near {
    Near { distance }
}

fn on(ports: &[&str], timeout: Option<u64>) -> Trigger {
    Trigger::On { ports: ports.iter().map(|&port| port.into()).collect(), timeout }
}

fn when<M: Module>() -> (Stage, Trigger) {
    (M::STAGE, M::spec().trigger)
}

#[test]
fn each_block_is_woken_by_what_it_waits_for_in_its_stage() {
    // A sensor that stops must be noticed, so there is a timeout where a port can be stale.
    // A Monitor says that it is stale as soon as it is.
    assert_eq!(
        when::<MonitorBlock<NearMonitor>>(),
        (Stage::SensorProcess, on(&["range"], Some(100_000_001)))
    );
    assert_eq!(when::<ReactiveBlock<AvoidNear>>(), (Stage::SensorProcess, on(&["range"], Some(100_000_000))));
    assert_eq!(when::<AnalyzeBlock<WayIsFree>>(), (Stage::WorldState, on(&["near"], None)));
    // A Plan is not notified of changed parameters or knowledge.
    assert_eq!(when::<PlanBlock<Wanderer>>(), (Stage::Think, on(&["free", "situation"], Some(200_000_000))));
    assert_eq!(when::<ExecuteBlock<Actions>>(), (Stage::Act, on(&["plan", "reflexes"], Some(20_000_000))));
    assert_eq!(when::<KnowledgeBlock<Memory>>(), (Stage::WorldState, Trigger::Stage));
    assert_eq!(when::<SensorBlock<Thermometer>>(), (Stage::SensorAcquire, Trigger::Stage));
    assert_eq!(when::<ActuatorBlock<Motor>>(), (Stage::ActExec, on(&["command"], Some(20_000_000))));
}

#[test]
fn a_robot_has_one_plan_one_execute_and_one_knowledge() {
    assert_eq!(PlanBlock::<Wanderer>::spec().unique, "plan");
    assert_eq!(ExecuteBlock::<Actions>::spec().unique, "execute");
    assert_eq!(KnowledgeBlock::<Memory>::spec().unique, "knowledge");
    assert_eq!(MonitorBlock::<NearMonitor>::spec().unique, "");
    assert_eq!(AnalyzeBlock::<WayIsFree>::spec().unique, "");
    assert_eq!(ReactiveBlock::<AvoidNear>::spec().unique, "");
}

#[test]
fn ports_that_may_be_linked_have_the_same_role() {
    let role = |kind: ModuleKind, port: &str| {
        let setup = Setup { name: "test", seed: 0, period: 20_000_000, section: None, params: None };
        let description = kind.describe(&setup).unwrap();
        description
            .ports
            .iter()
            .find(|description| description.name == port)
            .map(|port| port.role.clone())
            .unwrap()
    };
    use slate_mapek::{analyze, execute, monitor, plan, reactive};
    assert_eq!(role(monitor::<NearMonitor>(), "percept"), role(analyze::<WayIsFree>(), "near"));
    assert_eq!(role(analyze::<WayIsFree>(), "change"), role(plan::<Wanderer>(), "free"));
    assert_eq!(role(plan::<Wanderer>(), "plan"), role(execute::<Actions>(), "plan"));
    assert_eq!(role(reactive::<AvoidNear>(), "reflex"), role(execute::<Actions>(), "reflexes"));
    assert_eq!(role(plan::<Wanderer>(), "situation"), role(execute::<Actions>(), "status"));
    let mut roles: Vec<_> = [
        role(monitor::<NearMonitor>(), "percept"),
        role(analyze::<WayIsFree>(), "change"),
        role(plan::<Wanderer>(), "plan"),
        role(reactive::<AvoidNear>(), "reflex"),
        role(execute::<Actions>(), "status"),
    ]
    .into();
    roles.sort_unstable();
    roles.dedup();
    assert_eq!(roles.len(), 5);
}

#[test]
fn monitor_publishes_its_interpretation() {
    let mut monitor = Fixture::<MonitorBlock<NearMonitor>>::new();
    monitor.set("range", near(3.0));
    monitor.tick();
    assert_eq!(monitor.output::<Near>("percept"), Some(near(1.5)));
    monitor.expire("range");
    monitor.tick();
    assert_eq!(monitor.output::<Near>("percept"), None);
}

#[test]
fn an_analyze_notifies_only_what_is_relevant() {
    let mut analyze = Fixture::<AnalyzeBlock<WayIsFree>>::new();
    let mut told = Vec::new();
    for distance in [2.0, 1.0, 0.9, 0.1, 0.2, 3.0] {
        analyze.set("near", near(distance));
        analyze.tick();
        told.push(analyze.output::<Free>("change").map(|change| change.free.get()));
    }
    assert_eq!(told, [Some(true), None, None, Some(false), None, Some(true)]);
}

fn free(free: bool) -> Free {
    Free { free: free.into() }
}

#[test]
fn a_plan_goes_to_execute_with_the_epoch_that_it_saw() {
    let mut plan = Fixture::<PlanBlock<Wanderer>>::new();
    plan.set("situation", ExecuteStatus { epoch: 7, ..ExecuteStatus::default() });
    plan.push("free", free(true));
    plan.tick();
    let sent = plan.sent::<Planned>("plan");
    let seen: Vec<_> = sent
        .iter()
        .map(|planned| (planned.epoch, planned.ticket, planned.step, planned.action.kind.as_str()))
        .collect();
    assert_eq!(seen, [(7, 1, PlanStep::REPLACE, "Drive"), (7, 2, PlanStep::APPEND, "Swerve")]);
}

#[test]
fn a_plan_on_its_way_is_not_made_again_unless_it_was_lost() {
    let mut plan = Fixture::<PlanBlock<Wanderer>>::new();
    let idle = ExecuteStatus::default();
    plan.set("situation", idle);
    plan.push("free", free(true));
    plan.tick();
    assert_eq!(plan.sent::<Planned>("plan").len(), 2);
    plan.advance(20_000_000);
    plan.tick();
    assert_eq!(plan.sent::<Planned>("plan").len(), 0);
    // Execute took both and is idle again: everything is done.
    plan.set("situation", ExecuteStatus { ticket: 2, ..idle });
    plan.tick();
    assert_eq!(plan.sent::<Planned>("plan").len(), 2);
    plan.advance(100_000_000);
    plan.tick();
    assert_eq!(plan.sent::<Planned>("plan").len(), 2);
}

#[test]
fn after_a_reflex_the_plan_is_made_anew() {
    let mut plan = Fixture::<PlanBlock<Wanderer>>::new();
    let busy = ExecuteStatus { route: Route::DELIBERATIVE, ..ExecuteStatus::default() };
    plan.set("situation", busy);
    plan.push("free", free(true));
    plan.tick();
    assert_eq!(plan.sent::<Planned>("plan").len(), 0);
    plan.set("situation", ExecuteStatus { epoch: 1, replan: true.into(), route: Route::REACTIVE, ..busy });
    plan.tick();
    assert_eq!(plan.sent::<Planned>("plan").first().map(|planned| planned.epoch), Some(1));
}

#[test]
fn a_plan_sees_every_change_and_every_ending_once() {
    let mut plan = Fixture::<PlanBlock<Wanderer>>::new();
    for value in [true, false, true] {
        plan.push("free", free(value));
    }
    let ended = |number, ticket| Ended { number, ticket, ..Ended::default() };
    let status = |ended: &[Ended]| ExecuteStatus { ended: Sequence::new(ended), ..ExecuteStatus::default() };
    plan.set("situation", status(&[ended(1, 11), ended(2, 12)]));
    plan.tick();
    plan.set("situation", status(&[ended(1, 11), ended(2, 12), ended(3, 13)]));
    plan.tick();
    #[derive(serde::Deserialize)]
    struct Saved {
        state: common::Wandering,
    }
    let saved: Saved = slate_module::decode(&plan.save().unwrap()).unwrap();
    assert_eq!((saved.state.changes, saved.state.ended), (3, vec![11, 12, 13]));
}

#[test]
fn a_reflex_has_the_rank_of_its_model_or_its_input() {
    let mut model = Fixture::<ReactiveBlock<AvoidNear>>::new();
    model.set("range", near(0.1));
    model.tick();
    let ranks = |model: &Fixture<_>| {
        model.sent::<Reflex>("reflex").iter().map(|reflex| reflex.rank).collect::<Vec<_>>()
    };
    assert_eq!(ranks(&model), [3]);
    model.set("rank", Rank { rank: -1 });
    model.tick();
    assert_eq!(ranks(&model), [-1]);
    model.set("range", near(1.0));
    model.tick();
    assert!(ranks(&model).is_empty());
}

/// Counts up.
struct Thermometer;

impl Sensor for Thermometer {
    const NAME: &'static str = "thermometer";
    type Io = ();
    type Params = ();
    type State = u32;
    type Value = Near;

    fn get_data(count: &mut u32, (): &(), (): &(), _: &Tick) -> Option<Near> {
        *count += 1;
        (*count % 2 == 1).then(|| near((*count).into()))
    }
}

#[test]
fn a_sensor_publishes_what_it_measures_when_there_is_something() {
    let mut sensor = Fixture::<SensorBlock<Thermometer>>::new();
    sensor.tick();
    assert_eq!(sensor.output::<Near>("value"), Some(near(1.0)));
    sensor.tick();
    assert_eq!(sensor.output::<Near>("value"), None);
}

#[ports]
struct MotorIo {
    moves: Output<Twist2>,
}

/// Moves as commanded.
struct Motor;

impl Actuator for Motor {
    const NAME: &'static str = "motor";
    type Io = MotorIo;
    type Params = ();
    type State = ();
    type Command = Twist2;
    const SAFE: Twist2 = Twist2::ZERO;

    fn apply((): &mut (), command: &Twist2, io: &MotorIo, (): &(), _: &Tick) -> Outcome {
        io.moves.set(*command);
        Outcome::Ok
    }
}

#[test]
fn an_actuator_without_a_fresh_command_does_what_is_safe() {
    let mut actuator = Fixture::<ActuatorBlock<Motor>>::new();
    assert_eq!(actuator.tick(), Outcome::Degraded);
    assert_eq!(actuator.output("moves"), Some(Twist2::ZERO));
    let command = Twist2 { linear: 1.0, angular: 0.0 };
    actuator.set("command", command);
    assert_eq!(actuator.tick(), Outcome::Ok);
    assert_eq!(actuator.output("moves"), Some(command));
    actuator.expire("command");
    assert_eq!(actuator.tick(), Outcome::Degraded);
    assert_eq!(actuator.output("moves"), Some(Twist2::ZERO));
}

/// Health that an actuator reported last.
fn health<A: Actuator<Params = ()>>(actuator: &Fixture<ActuatorBlock<A>>) -> Option<DeviceHealth> {
    actuator.output::<ActuatorStatus>("status").map(|status| status.health)
}

#[test]
fn an_actuator_reports_its_gate_and_its_command() {
    let mut actuator = Fixture::<ActuatorBlock<Motor>>::new();
    actuator.tick();
    assert_eq!(health(&actuator), Some(DeviceHealth::SAFE), "nothing commands it");
    let moving = Twist2 { linear: 1.0, angular: 0.0 };
    actuator.set("command", moving);
    actuator.tick();
    assert_eq!(health(&actuator), Some(DeviceHealth::READY), "without a gate that it reads");
    let active = GateState { age: Optional::some(0), ..GateState::default() };
    for (mode, age, expected) in [
        (GateMode::DISARMED, Optional::none(), DeviceHealth::DISARMED),
        (GateMode::ARMED, Optional::none(), DeviceHealth::SAFE),
        (GateMode::ARMED, active.age, DeviceHealth::READY),
        (GateMode::STOPPED, Optional::none(), DeviceHealth::STOPPED),
    ] {
        // The gate gives a command in each cycle, the safe one too.
        actuator.set("command", moving);
        actuator.set("gate", GateState { mode, age, ..active });
        actuator.tick();
        assert_eq!(health(&actuator), Some(expected), "{mode:?}");
    }
    actuator.set("command", moving);
    actuator.tick();
    assert!(!actuator.wrote("status"), "it has not changed");
}

driver_actuator!(Wheels("test_wheels", "Wheels of a driver."), WheelPorts { wheels: Twist2 });

#[test]
fn an_actuator_whose_driver_fails_or_hangs_has_failed() {
    let mut actuator = Fixture::<ActuatorBlock<Wheels>>::new();
    let mut step = |prepare: &dyn Fn(&mut Fixture<ActuatorBlock<Wheels>>)| {
        actuator.set("command", Twist2::ZERO);
        prepare(&mut actuator);
        (actuator.tick() == Outcome::Ok, health(&actuator))
    };
    let driver = |fault: bool| DriverStatus { fault: fault.into() };
    assert_eq!(step(&|_| ()), (true, Some(DeviceHealth::READY)), "a simulator reports nothing");
    let failed = (false, Some(DeviceHealth::FAILED));
    assert_eq!(step(&|actuator| actuator.set("driver", driver(true))), failed);
    let ready = (true, Some(DeviceHealth::READY));
    assert_eq!(step(&|actuator| actuator.set("driver", driver(false))), ready);
    assert_eq!(step(&|actuator| actuator.expire("driver")), failed, "it hangs");
}

#[ports]
struct Reported {
    #[role("actuator_status")]
    wheels: Input<ActuatorStatus>,
    robot: Output<RobotModel>,
}

/// Knows the wheels.
struct Health;

impl Knowledge for Health {
    const NAME: &'static str = "health";
    type Models = Reported;
    type Params = ();
    type State = ();

    fn update((): &mut (), models: &Reported, (): &(), _: &Tick) {
        let mut wheels = Device { name: Text::new("wheels"), ..Device::default() };
        wheels.report(&models.wheels);
        models.robot.set(RobotModel { actuators: Sequence::new(&[wheels]), ..RobotModel::default() });
    }
}

#[test]
fn a_robot_model_has_the_health_of_its_actuators() {
    let mut knowledge = Fixture::<KnowledgeBlock<Health>>::new();
    let mut health = |prepare: &dyn Fn(&mut Fixture<KnowledgeBlock<Health>>)| {
        prepare(&mut knowledge);
        knowledge.tick();
        knowledge.output::<RobotModel>("robot").unwrap().actuator("wheels").unwrap().health
    };
    assert_eq!(health(&|_| ()), DeviceHealth::UNKNOWN);
    let stopped = ActuatorStatus { health: DeviceHealth::STOPPED };
    assert_eq!(health(&|knowledge| knowledge.set("wheels", stopped)), DeviceHealth::STOPPED);
    assert_eq!(health(&|knowledge| knowledge.expire("wheels")), DeviceHealth::FAILED, "its block hangs");
}

#[ports]
struct Models {
    seen: Input<Near>,
    known: Output<Near>,
}

/// Remembers the least distance.
struct Memory;

impl Knowledge for Memory {
    const NAME: &'static str = "memory";
    type Models = Models;
    type Params = ();
    type State = Option<f64>;

    fn update(least: &mut Option<f64>, models: &Models, (): &(), _: &Tick) {
        if let Some(seen) = models.seen.updated() {
            let known = least.map_or(seen.distance, |least| math::min(least, seen.distance));
            *least = Some(known);
            models.known.set(near(known));
        }
    }
}

#[test]
fn knowledge_is_what_blocks_can_read() {
    let mut knowledge = Fixture::<KnowledgeBlock<Memory>>::new();
    for distance in [2.0, 1.0, 3.0] {
        knowledge.set("seen", near(distance));
        knowledge.tick();
    }
    assert_eq!(knowledge.output::<Near>("known"), Some(near(1.0)));
}

#[ports]
struct Clash {
    percept: Input<Near>,
}

/// Names a port like the framework's.
struct ClashMonitor;

impl Monitor for ClashMonitor {
    const NAME: &'static str = "clash_monitor";
    type Sensors = Clash;
    type Params = ();
    type State = ();
    type Value = Near;

    fn interpret((): &mut (), sensors: &Clash, (): &(), _: &Tick) -> Option<Near> {
        sensors.percept.fresh().copied()
    }
}

#[test]
fn a_port_named_like_one_of_the_framework_is_refused() {
    let refusal = Fixture::<MonitorBlock<ClashMonitor>>::with(()).err().unwrap();
    assert_eq!(refusal.0, "there are two ports `percept`, of which one is the framework's: rename yours");
}

#[test]
fn a_request_names_its_kind_and_carries_its_arguments() {
    let request = Drive::request((1.5, 2.0));
    assert_eq!((request.kind.as_str(), &request.arguments[..]), ("Drive", &[1.5, 2.0][..]));
}

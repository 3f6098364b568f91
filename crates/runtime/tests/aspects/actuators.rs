//! The aspect Actuators.

use slate_module::Plugin;
use slate_module::aspect::{ActuatorState, Actuators, Aspect};
use slate_module::prelude::*;
use slate_runtime::Options;
use slate_runtime::configuration::Configuration;

use crate::aspects::common::{Number, Pair, load, number};
use crate::aspects::{agent, complaint, full, logged, says, steps, try_agent, wait};

#[params]
pub struct CaptainParams {
    #[param(default = 1, doc = "offers a command from that tick on")]
    from: u64,
    #[param(default = 1000, doc = "and up to that one")]
    to: u64,
    #[param(default = 7.0, doc = "the command")]
    value: f64,
    #[param(default = false, doc = "offers no number")]
    is_nan: Bool,
    #[param(default = 1, doc = "how urgent it is")]
    priority: u64,
    #[param(default = 0, doc = "fails in that tick")]
    fail_at: u64,
    #[param(default = 0, doc = "panics in that tick")]
    panic_at: u64,
    #[param(default = 0, doc = "stops the actuator in that tick")]
    stop_at: u64,
    #[param(default = 0, doc = "stops all actuators in that tick")]
    stop_all_at: u64,
    #[param(default = 0, doc = "offers a command of another interface in that tick")]
    pair_at: u64,
    #[param(default = 0, doc = "hangs for a second in that tick")]
    hang_at: u64,
    #[param(default = "wheel", doc = "the actuator")]
    actuator: Text<60>,
}

#[ports]
pub struct CaptainIo {
    actuators: Aspect<Actuators>,
    mode: Output<Number>,
    mine: Output<Number>,
}

/// Follows its parameters, and logs refusals and the holder of the lease.
pub struct Captain;

#[module(stage = Think)]
impl Module for Captain {
    type Io = CaptainIo;
    type Params = CaptainParams;
    type State = ();

    fn tick(_: &mut (), io: &CaptainIo, params: &CaptainParams, now: &Tick) -> Outcome {
        let (name, number) = (params.actuator.as_str(), now.number());
        let priority = match params.priority {
            3 => Priority::Reflex,
            2 => Priority::Teleoperation,
            _ => Priority::Plan,
        };
        let show = |reason: &dyn std::fmt::Display| now.warn(format_args!("{reason}"));
        if (params.from..=params.to).contains(&number) {
            let value = if params.is_nan.get() { f64::NAN } else { params.value };
            // Only the last one counts.
            let _ = io.actuators.offer(name, priority, &Number { value: 99.0 });
            if let Err(reason) = io.actuators.offer(name, priority, &Number { value }) {
                show(&reason);
            }
        }
        if number == params.pair_at
            && let Err(reason) = io.actuators.offer(name, priority, &Pair { first: 0.0, second: 0.0 })
        {
            show(&reason);
        }
        if number == params.stop_at
            && let Err(reason) = io.actuators.stop(name, "as the test wants")
        {
            show(&reason);
        }
        if number == params.stop_all_at {
            io.actuators.stop_all("as the test wants");
        }
        match io.actuators.state(name) {
            Ok((state, holder)) => {
                now.info(format_args!("held by [{holder}]"));
                io.mode.set(Number { value: state.mode.into() });
                io.mine.set(Number { value: f64::from(state.is_mine) });
                assert_eq!(state.is_stopped(), state.mode == ActuatorState::STOPPED);
                assert_eq!(state.is_leased(), !holder.is_empty());
            }
            Err(reason) => show(&reason),
        }
        if number == params.hang_at {
            std::thread::sleep(std::time::Duration::from_secs(1));
        }
        if number == params.panic_at {
            panic!("as the test wants");
        }
        if number == params.fail_at { Outcome::Failed } else { Outcome::Ok }
    }
}

fn plugins() -> Vec<Plugin> {
    vec![Plugin::linked::<Captain>()]
}

/// A captain with those parameters and its actuators: one that it may command, with another commander.
fn ship(params: &str) -> String {
    format!(
        "loop.period = \"10ms\"\n[modules.captain]\n{params}\n[modules.driver]\nenabled = false\n[modules.other]\n\
         kind = \"driver\"\nenabled = false\n[links]\n\"driver/input\" = \"clock/number\"\n\
         \"other/input\" = \"clock/number\"\n\
         [actuators.wheel]\ncommand = \"driver/wheel\"\nmodules = [\"captain\"]\n\
         limits = {{ value = [-50.0, 50.0] }}\n\
         [actuators.rudder]\ncommand = \"other/wheel\"\n"
    )
}

#[test]
fn a_module_commands_an_actuator_that_names_it() {
    let mut agent = agent(&ship("params.from = 2"), &plugins());
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "wheel/command/value"), 0.0);
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "wheel/command/value"), 7.0);
    assert_eq!(number(&agent, "wheel/gate/passed"), 1.0, "only the last of a tick is offered");
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "captain/mine/value"), 1.0);
    assert_eq!(number(&agent, "wheel/gate/holder"), 2.0, "after the one with a port");
}

#[test]
fn a_command_ends_with_the_first_tick_that_does_not_renew_it() {
    let mut agent = agent(&ship("params.to = 3"), &plugins());
    steps(&mut agent, 3);
    assert_eq!(number(&agent, "wheel/command/value"), 7.0);
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "wheel/command/value"), 0.0);
}

#[test]
fn a_command_out_of_limits_is_held_at_the_limit() {
    let mut agent = agent(&ship("params.value = 70.0"), &plugins());
    steps(&mut agent, 2);
    assert_eq!(number(&agent, "wheel/command/value"), 50.0);
}

#[test]
fn a_failing_ticks_command_is_dropped_and_the_last_one_ends() {
    for how in ["fail_at", "panic_at"] {
        let mut agent = agent(&ship(&format!("params = {{ {how} = 3 }}")), &plugins());
        steps(&mut agent, 2);
        assert_eq!(number(&agent, "wheel/command/value"), 7.0, "{how}");
        steps(&mut agent, 1);
        assert_eq!(number(&agent, "wheel/command/value"), 0.0, "{how}");
        assert_eq!(number(&agent, "wheel/gate/passed"), 2.0, "{how}");
        steps(&mut agent, 1);
        assert_eq!(number(&agent, "wheel/command/value"), 7.0, "{how}");
    }
}

#[test]
fn disabled_or_unloaded_module_commands_no_more() {
    let mut agent = agent(&ship(""), &plugins());
    steps(&mut agent, 2);
    agent.composer().enable("captain", false).unwrap();
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "wheel/command/value"), 0.0);
    agent.composer().enable("captain", true).unwrap();
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "wheel/command/value"), 7.0);
    agent.composer().unload("captain").unwrap();
    assert_eq!(number(&agent, "wheel/command/value"), 0.0, "at once");
}

#[test]
fn the_lease_is_one_of_all_commanders() {
    let (mut agent, log) = logged(&ship("params = { priority = 2, from = 3, to = 4 }"), &plugins());
    agent.composer().enable("driver", true).unwrap();
    steps(&mut agent, 2);
    assert_eq!(number(&agent, "wheel/command/value"), 2.0, "the driver's");
    assert!(says(&agent, &log, "captain", "held by [driver/wheel]"), "{:?}", log.lines());
    steps(&mut agent, 2);
    assert_eq!(number(&agent, "wheel/command/value"), 7.0, "the more urgent one takes it");
    assert!(says(&agent, &log, "captain", "held by [captain]"), "{:?}", log.lines());
    steps(&mut agent, 1);
    assert_eq!(number(&agent, "wheel/command/value"), 5.0, "and gives it back");
}

#[test]
fn among_equals_the_first_one_keeps_the_actuator() {
    let mut agent = agent(&ship("params.from = 3"), &plugins());
    agent.composer().enable("driver", true).unwrap();
    steps(&mut agent, 5);
    assert_eq!(number(&agent, "wheel/command/value"), 5.0);
    assert_eq!(number(&agent, "captain/mine/value"), 0.0);
}

#[test]
fn a_stop_acts_within_the_tick_also_of_one_that_fails() {
    for (stop, fail) in [("stop_at", "fail_at"), ("stop_all_at", "panic_at")] {
        let params = format!("params = {{ {stop} = 3, {fail} = 3 }}");
        let mut agent = agent(&ship(&params), &plugins());
        agent.composer().enable("other", true).unwrap();
        steps(&mut agent, 2);
        assert_eq!(number(&agent, "captain/mode/value"), f64::from(ActuatorState::ARMED));
        steps(&mut agent, 3);
        assert_eq!(number(&agent, "captain/mode/value"), f64::from(ActuatorState::STOPPED));
        assert_eq!(number(&agent, "wheel/command/value"), 0.0);
        let other = number(&agent, "rudder/command/value");
        assert!(!agent.arm(), "a stop is reset first");
        assert_eq!(other, if stop == "stop_at" { 5.0 } else { 0.0 }, "{stop}");
        agent.reset();
        steps(&mut agent, 1);
        assert_eq!(number(&agent, "captain/mode/value"), f64::from(ActuatorState::DISARMED));
        assert!(agent.arm());
        steps(&mut agent, 1);
        assert_eq!(number(&agent, "wheel/command/value"), 7.0);
    }
}

#[test]
fn unnamed_module_commands_nothing() {
    let text = ship("").replace("modules = [\"captain\"]\n", "");
    let (mut agent, log) = logged(&text, &plugins());
    steps(&mut agent, 2);
    let reason = "captain may not command `wheel`: add modules = [\"captain\"] to [actuators.wheel]";
    assert!(says(&agent, &log, "captain", reason), "{:?}", log.lines());
    assert_eq!(number(&agent, "wheel/command/value"), 0.0);
    assert_eq!(number(&agent, "captain/mode/value"), f64::from(ActuatorState::ARMED), "but looks at it");
}

#[test]
fn missing_and_mismatched_values_are_described() {
    let (mut agent, log) = logged(&ship("params.actuator = \"sail\""), &plugins());
    steps(&mut agent, 1);
    let reason = "no actuator `sail`; available: rudder, wheel";
    assert!(says(&agent, &log, "captain", reason), "{:?}", log.lines());
    let (mut agent, log) = logged(&ship("params.pair_at = 2"), &plugins());
    steps(&mut agent, 2);
    assert!(says(&agent, &log, "captain", "`wheel` takes Number"), "{:?}", log.lines());
    assert_eq!(number(&agent, "wheel/command/value"), 7.0, "the one that fits counts");
}

#[test]
fn a_number_that_is_none_leaves_the_actuator_safe() {
    let mut agent = agent(&ship("params.is_nan = true"), &plugins());
    steps(&mut agent, 2);
    assert_eq!(number(&agent, "wheel/command/value"), 0.0);
    assert_eq!(number(&agent, "wheel/gate/refused"), 2.0);
}

#[test]
fn configuration_names_modules_that_can_command() {
    let text = complaint(&ship("").replace("[\"captain\"]", "[\"nobody\"]"), &plugins());
    assert!(text.contains("there is no module `nobody`"), "{text}");
    let text = complaint(&ship("").replace("[\"captain\"]", "[\"driver\"]"), &plugins());
    assert!(text.contains("`driver` has no aspect Actuators"), "{text}");
    let text = ship("").replace("modules = [\"captain\"]", "modules = 3");
    let error = Configuration::from_text("test.toml", &text, &Default::default()).unwrap_err();
    assert!(full(&error).contains("`modules` takes text, found a whole number"), "{}", full(&error));
}

#[test]
fn an_actuator_may_be_commanded_by_such_modules_alone() {
    let text = "[modules.captain]\n[modules.relay]\n[links]\n\"relay/input\" = \"wheel/command\"\n\
                [actuators.wheel]\nmodules = [\"captain\"]\n";
    let mut agent = agent(text, &plugins());
    steps(&mut agent, 2);
    assert_eq!(number(&agent, "wheel/command/value"), 7.0);
    assert_eq!(number(&agent, "relay/output/value"), 8.0);
}

#[test]
fn followers_of_actuator_run_after_its_commanders() {
    // Both are of one stage; by name the relay would come first.
    let text = "[modules.captain]\nparams.to = 1\n[modules.a]\nkind = \"relay\"\nstage = \"Think\"\n[links]\n\
                \"a/input\" = \"wheel/command\"\n[actuators.wheel]\nmodules = [\"captain\"]\n";
    match try_agent(text, &plugins(), Options::default()) {
        Ok(mut agent) => {
            steps(&mut agent, 1);
            assert_eq!(number(&agent, "a/output/value"), 8.0, "it saw the command of the same cycle");
        }
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn a_module_that_hangs_loses_its_actuators_and_comes_back() {
    let text = ship("params.hang_at = 20").replace("loop.period", "loop.hang = \"50ms\"\nloop.period");
    let mut agent = load(
        &format!("{text}[modules.clock]\nkind = \"counter\"\n"),
        &plugins(),
        Options { armed: true, ..Options::default() },
    )
    .unwrap();
    let (board, stopper, composer) =
        (std::sync::Arc::clone(agent.board()), agent.stopper(), agent.composer());
    let command = move || {
        let value = board.read("wheel/command").unwrap().map(|(value, _)| value);
        value.and_then(|value| value.get("value").and_then(|value| value.as_f64())).unwrap_or(0.0)
    };
    let late = move || composer.modules().iter().any(|module| module.condition == "LATE");
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
                wait("a command", || command() == 7.0);
                wait("the late module", &late);
                wait("the safe command", || command() == 0.0);
                wait("its return", || command() == 7.0);
            }));
            stopper.stop();
            result.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        });
        agent.run(Box::new(|_| slate_runtime::Control::Continue)).unwrap();
    });
}

#[test]
fn names_in_a_robot_are_those_of_the_robot() {
    let robot = |name: &str, module: &str| {
        format!(
            "[robots.{name}.modules.captain]\n[robots.{name}.modules.driver]\nenabled = false\n\
             [robots.{name}.links]\n\"driver/input\" = \"/clock/number\"\n\
             [robots.{name}.actuators.wheel]\ncommand = \"driver/wheel\"\nmodules = [\"{module}\"]\n"
        )
    };
    let text = robot("r1", "captain") + &robot("r2", "captain");
    let mut agent = agent(&text, &plugins());
    steps(&mut agent, 2);
    for name in ["r1", "r2"] {
        assert_eq!(number(&agent, &format!("{name}/wheel/command/value")), 7.0);
        assert_eq!(number(&agent, &format!("{name}/captain/mine/value")), 1.0);
    }
    let text = complaint(&robot("r1", "/captain"), &plugins());
    assert!(text.contains("there is no module `captain`"), "{text}");
}

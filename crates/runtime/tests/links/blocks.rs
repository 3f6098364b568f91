//! The rules of attachment while an agent runs, and facts of Knowledge of any size.

use serde::{Deserialize, Serialize};
use slate_blackboard::interface::Value;
use slate_mapek::prelude::*;
use slate_mapek::{analyze, execute, knowledge, monitor, plan, sensor};
use slate_module::Plugin;
use slate_module::prelude::*;
use slate_runtime::configuration::{Database, Options as Reading};
use slate_runtime::{Agent, NewLink, Options, Rate};

use crate::links::common::Number;
use crate::links::support::{all, steps};

/// A large value.
#[interface]
pub struct Grid {
    /// Number of the value.
    pub number: u64,
    /// Where its writer or its reader has it in memory.
    pub place: u64,
    /// Of a map, the bytes between where a Sensor wrote the measurement and where the Analyze read the percept.
    pub handed: u64,
    /// Cells.
    pub cells: [u8],
}

const CELLS: usize = 300_000;

#[ports]
pub struct DeviceIo {
    number: Input<Number>,
    #[capacity(300_000)]
    value: Measurement<Grid>,
}

pub struct Device;

impl Sensor for Device {
    const NAME: &'static str = "device";
    type Io = DeviceIo;
    type Params = ();
    type State = ();
    type Value = InPlace<Grid>;

    fn get_data((): &mut (), io: &DeviceIo, (): &(), _: &Tick) -> Option<InPlace<Grid>> {
        let number = io.number.updated()?.value as u64;
        Some(io.value.write(CELLS, |grid| {
            grid.number = number;
            grid.place = std::ptr::from_ref(&grid.number).addr() as u64;
            grid.cells.fill(7);
        }))
    }
}

#[ports]
pub struct Devices {
    percept: HandedOn<Grid>,
}

pub struct HandOn;

impl Monitor for HandOn {
    const NAME: &'static str = "hand_on";
    type Sensors = Devices;
    type Params = ();
    type State = ();
    type Value = InPlace<Grid>;

    fn interpret((): &mut (), devices: &Devices, (): &(), _: &Tick) -> Option<InPlace<Grid>> {
        Some(devices.percept.as_it_is())
    }
}

#[ports]
pub struct Seen {
    grid: Observed<Grid>,
    #[capacity(300_000)]
    change: Change<Grid>,
}

/// Writes a map in place, and where that is.
pub struct Mapper;

impl Analyze for Mapper {
    const NAME: &'static str = "mapper";
    type Observed = Seen;
    type Params = ();
    type State = ();
    type Value = InPlace<Grid>;

    fn process((): &mut (), seen: &Seen, (): &(), _: &Tick) -> Option<InPlace<Grid>> {
        let percept = seen.grid.updated()?;
        Some(seen.change.write(CELLS, |map| {
            map.number = percept.number;
            map.place = std::ptr::from_ref(&map.number).addr() as u64;
            map.handed = (std::ptr::from_ref(&percept.number).addr() as u64).abs_diff(percept.place);
            map.cells.copy_from_slice(&percept.cells);
        }))
    }
}

#[ports]
pub struct Known1 {
    map: Known<Grid>,
    seen: Output<Number>,
}

pub struct Atlas;

impl Knowledge for Atlas {
    const NAME: &'static str = "atlas";
    type Models = Known1;
    type Params = ();
    type State = ();

    fn update((): &mut (), models: &Known1, (): &(), _: &Tick) {
        if let Some(map) = models.map.updated() {
            models.seen.set(Number { value: map.number as f64 });
        }
    }
}

#[ports]
pub struct MapOnly {
    map: Input<Grid>,
}

/// Number of the map that was read, and how far from its writer's place it was.
#[interface]
pub struct Reading1 {
    /// Number of the map.
    pub number: u64,
    /// Bytes between where it was written and where it was read.
    pub distance: u64,
    /// Sum of the cells.
    pub sum: u64,
}

pub struct Surveyor;

impl Analyze for Surveyor {
    const NAME: &'static str = "surveyor";
    type Observed = MapOnly;
    type Params = ();
    type State = ();
    type Value = Reading1;

    fn process((): &mut (), io: &MapOnly, (): &(), _: &Tick) -> Option<Reading1> {
        let map = io.map.updated()?;
        Some(Reading1 {
            number: map.number,
            distance: (std::ptr::from_ref(&map.number).addr() as u64).abs_diff(map.place),
            sum: map.cells.iter().map(|cell| u64::from(*cell)).sum(),
        })
    }
}

#[ports]
pub struct RoverPorts {
    reading: Noticed<Reading1>,
    aim: Input<Number>,
    seen: Output<Number>,
}

pub struct Rover;

impl Plan for Rover {
    const NAME: &'static str = "rover";
    type Noticed = RoverPorts;
    type Params = ();
    type State = ();

    fn run((): &mut (), noticed: &RoverPorts, _: &Situation<'_>, (): &(), _: &Tick, _: &mut Agenda<'_>) {
        let _ = noticed.reading.newest();
        noticed.seen.set(noticed.aim.get().copied().unwrap_or_default());
    }
}

#[ports]
pub struct Body {
    arm: Output<Number>,
}

#[derive(Serialize, Deserialize)]
pub struct Halt;

impl ActionKind for Halt {
    const KIND: &'static str = "Halt";
    type Arguments = ();

    fn start((): ()) -> Self {
        Self
    }
}

impl Action<Body> for Halt {
    fn act(&mut self, acting: &Acting<'_, Body>) -> Step {
        acting.body.arm.set(Number { value: 0.0 });
        Step::Done
    }
}

repertoire! {
    pub enum Actions for Body { Halt }
}

const TEXT: &str = r#"
time.source = "counter"
[modules]
counter = {}
dice = {}
[robots.r2.modules]
device = {}
hand_on = {}
mapper = {}
knowledge = { kind = "atlas" }
surveyor = {}
planner = { kind = "rover" }
[robots.r2.links]
"device/number" = "/counter/number"
"knowledge/map" = "mapper/change"
"surveyor/map" = "knowledge/map"
"planner/aim" = false
"#;

const RULE: &str = "a Plan reads Analyzes, Knowledge and Execute's status: `/r2/planner/aim` can't read";

fn agent() -> Agent {
    agent_of(TEXT)
}

fn agent_of(text: &str) -> Agent {
    let database = Database::from_text("test.toml", text, Reading::default()).unwrap();
    let blocks = [
        sensor::<Device>(),
        monitor::<HandOn>(),
        analyze::<Mapper>(),
        knowledge::<Atlas>(),
        analyze::<Surveyor>(),
        plan::<Rover>(),
        execute::<Actions>(),
    ];
    let plugins: Vec<_> = all().into_iter().chain(blocks.map(Plugin::from)).collect();
    let options = Options { rate: Rate::Max, ..Options::default() };
    Agent::load_with(&database, &plugins, options).unwrap()
}

fn number(agent: &Agent, path: &str) -> u64 {
    let read = agent.board().read(path).unwrap();
    read.and_then(|(value, _)| value.as_f64()).unwrap_or_default() as u64
}

#[test]
fn fact_reaches_analyze_in_its_cycle_without_a_copy() {
    let mut agent = agent();
    for _ in 0..5 {
        steps(&mut agent, 1);
        let counted = number(&agent, "counter/number/value");
        assert!(counted > 0);
        for path in
            ["mapper/change/number", "knowledge/map/number", "knowledge/seen/value", "surveyor/change/number"]
        {
            assert_eq!(number(&agent, &format!("r2/{path}")), counted, "{path}");
        }
        // Where the writer has put it, whatever its size.
        assert_eq!(number(&agent, "r2/surveyor/change/distance"), 0);
        assert_eq!(number(&agent, "r2/surveyor/change/sum"), 7 * CELLS as u64);
    }
}

#[test]
fn a_handed_on_percept_reaches_analyze_in_its_cycle_uncopied() {
    let mut agent = agent();
    for _ in 0..5 {
        steps(&mut agent, 1);
        let counted = number(&agent, "counter/number/value");
        assert!(counted > 0);
        for path in ["device/value/number", "hand_on/percept/number", "mapper/change/number"] {
            assert_eq!(number(&agent, &format!("r2/{path}")), counted, "{path}");
        }
        assert_eq!(number(&agent, "r2/mapper/change/handed"), 0);
    }
    // It is one property, with one channel.
    let of = |path: &str| agent.board().find(path).unwrap().0;
    assert!(std::sync::Arc::ptr_eq(&of("r2/hand_on/percept"), &of("r2/device/value")));
    let links = agent.composer().links();
    let observes = links.iter().find(|link| link.to == "r2/mapper/grid").unwrap();
    assert_eq!(observes.from, "/r2/hand_on/percept");
}

#[test]
fn relinking_against_the_rules_is_refused_and_changes_nothing() {
    let mut agent = agent();
    let composer = agent.composer();
    for from in ["/counter/number", "/counter/number/value", "slate://test/counter/number"] {
        let to = if from.ends_with("value") { "r2/planner/aim/value" } else { "r2/planner/aim" };
        let refused = format!("{:?}", composer.link(&NewLink::new(to, from)).unwrap_err());
        let rule = RULE.replace("r2/planner/aim", to);
        assert!(refused.contains(rule.as_str()), "{refused}");
        assert!(refused.contains("give it a Sensor, a Monitor and an Analyze"), "{refused}");
    }
    assert!(composer.links().iter().all(|link| !link.to.starts_with("r2/planner/aim")));
    composer.link(&NewLink::new("r2/planner/aim", "/r2/knowledge/seen")).unwrap();
    steps(&mut agent, 3);
    assert!(number(&agent, "r2/planner/seen/value") > 0);
}

#[test]
fn relinking_a_second_plan_or_a_block_to_a_sensor_is_refused() {
    let other = "[robots.r3.modules]\nmapper = {}\nsurveyor = {}\n";
    let more = format!("[modules.pilot]\nkind = \"rover\"\n{other}[robots.r2.modules.execute]\n");
    let agent = agent_of(&TEXT.replace("[robots.r2.modules]\n", &format!("{more}[robots.r2.modules]\n")));
    let composer = agent.composer();
    let senders = || composer.links().into_iter().filter(|link| link.to == "r2/execute/plan").count();
    assert_eq!(senders(), 1);
    for (to, from, rule) in [
        ("r2/execute/plan", "/pilot/plan", "a robot has one Plan: `/r2/execute/plan`"),
        ("r2/device/number", "/r2/planner/seen", "a Sensor reads devices, other Sensors"),
        ("r2/device/number", "/r2/knowledge/seen", "a Sensor reads devices, other Sensors"),
        ("r3/surveyor/map", "/r2/knowledge/map", "a block reads blocks of its own robot: `/r3/surveyor/map`"),
    ] {
        let refused = format!("{:?}", composer.link(&NewLink::new(to, from)).unwrap_err());
        assert!(refused.contains(rule), "{refused}");
    }
    assert_eq!(senders(), 1);
    assert!(
        composer.links().iter().any(|link| link.to == "r2/device/number" && link.from == "/counter/number")
    );
}

#[test]
fn plugin_that_breaks_a_rule_is_not_loaded() {
    let agent = agent();
    let composer = agent.composer();
    composer.unload("dice").unwrap();
    // What it will be is not known yet.
    composer.link(&NewLink::new("r2/planner/aim", "/dice/number")).unwrap();
    // A message is broken into lines.
    let refused = format!("{:?}", composer.load("dice").unwrap_err()).replace("\n  │ ", "");
    assert!(refused.contains(RULE) && refused.contains("`/dice/number`"), "{refused}");
    assert!(agent.modules().iter().all(|module| module != "dice"));
}

#[test]
fn person_sets_the_port_of_a_plan() {
    let mut agent = agent();
    agent.board().write("r2/planner/aim/value", &Value::Float(3.0), 0).unwrap();
    steps(&mut agent, 2);
    assert_eq!(number(&agent, "r2/planner/seen/value"), 3);
}

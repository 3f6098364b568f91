//! Robots whose blocks state facts, and what the others see of them.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test that fails panics")]

use crate::agents;

use std::sync::Arc;
use std::thread::JoinHandle;

use agents::scout::{Scout, Victim, say};
use agents::{Folder, wait_for};
use slate_blackboard::Board;
use slate_blackboard::interface::Value;
use slate_mapek::{FactTable, MostCertain, Newest, Statements, Union, WorldModel};
use slate_module::Plugin;
use slate_module::prelude::*;
use slate_module::testing::Fixture;
use slate_runtime::configuration::{Configuration, Options as Reading};
use slate_runtime::log::MemoryTarget;
use slate_runtime::sharing::{TeamCarrier, TeamExchange};
use slate_runtime::{Agent, Control, Options, Rate, Stopper};
use slate_share::agent::AgentSharing;
use slate_share::team::robot_number;

mod other {
    use slate_module::interface;

    /// As another robot sees victims.
    #[interface]
    #[derive(PartialEq, serde::Serialize, serde::Deserialize)]
    pub struct Victim {
        /// Where.
        #[unit("cm")]
        pub x: f64,
    }
}

/// Ports of [`Stranger`].
#[ports]
pub struct StrangerIo {
    found: Output<FactTable<other::Victim>>,
}

/// States something of another schema.
pub struct Stranger;

#[module(stage = Think)]
impl Module for Stranger {
    type Io = StrangerIo;
    type Params = ();
    type State = Statements<other::Victim>;

    fn tick(state: &mut Statements<other::Victim>, io: &StrangerIo, _: &(), now: &Tick) -> Outcome {
        state.state(now.now(), "9", 1.0, other::Victim { x: 9.0 });
        state.write(now.now(), &io.found);
        Outcome::Ok
    }
}

/// What a rescuer sees.
#[interface]
#[derive(PartialEq)]
pub struct Seen {
    /// Facts about all victims.
    pub facts: f64,
    /// Where victim 3 is by the newest and by the surest fact; -1 for nowhere.
    pub newest: f64,
    /// As above.
    pub surest: f64,
    /// How often something has changed.
    pub changes: f64,
    /// How long the last one was known when it was seen, nanoseconds.
    pub age: f64,
}

/// Ports of [`Rescuer`].
#[ports]
pub struct RescuerIo {
    victims: Input<FactTable<Victim>>,
    seen: Output<Seen>,
}

/// Looks at what the team knows.
pub struct Rescuer;

#[module(stage = Think)]
impl Module for Rescuer {
    type Io = RescuerIo;
    type Params = ();
    type State = (WorldModel<String, Victim>, f64);

    fn tick(state: &mut Self::State, io: &RescuerIo, _: &(), now: &Tick) -> Outcome {
        let (world, changes) = state;
        *changes += io.victims.get().map_or(0, |victims| world.replace(victims).len()) as f64;
        let facts = world.facts(&"3".to_owned());
        let x = |fact: Option<f64>| fact.unwrap_or(-1.0);
        io.seen.set(Seen {
            facts: world.view::<Union>().map(|(_, facts)| facts.count() as f64).sum(),
            newest: x(facts.and_then(|facts| Some(facts.view::<Newest>()?.value?.x))),
            surest: x(facts.and_then(|facts| Some(facts.view::<MostCertain>()?.value?.x))),
            changes: *changes,
            age: io
                .victims
                .get()
                .and_then(|victims| victims.first())
                .map_or(-1.0, |fact| now.now().saturating_sub(fact.head.heard) as f64),
        });
        Outcome::Ok
    }
}

/// A robot that runs until this is dropped.
struct Robot {
    board: Arc<Board>,
    team: Arc<dyn TeamExchange>,
    log: MemoryTarget,
    stopper: Stopper,
    thread: Option<JoinHandle<()>>,
}

fn plugins() -> [Plugin; 3] {
    [Plugin::linked::<Scout>(), Plugin::linked::<Stranger>(), Plugin::linked::<Rescuer>()]
}

fn load(name: &str, text: &str, log: &MemoryTarget) -> Result<Agent, String> {
    let configuration = Configuration::from_text(&format!("{name}.toml"), text, &Reading::default());
    let configuration = configuration.map_err(|report| report.to_string())?;
    let mut sharing = AgentSharing::default();
    sharing.limits = agents::limits();
    let options = Options {
        rate: Rate::REALTIME,
        sharing: Some(Box::new(sharing)),
        log: vec![Box::new(log.clone())],
        ..Options::default()
    };
    Agent::load(&configuration, &plugins(), options).map_err(|error| error.to_string())
}

/// A robot with a scout and a rescuer that knows those robots.
fn text(folder: &Folder, name: &str, knows: &[&str], more: &str) -> String {
    let knows = knows.iter().map(|other| format!("agents.{other}.at = \"{}\"\n", folder.endpoint(other)));
    format!(
        "[agent]\nname = \"{name}\"\n[loop]\nperiod = \"10ms\"\n[modules]\nscout = {{}}\nrescuer = {{}}\n\
         [links]\n\"rescuer/victims\" = \"slate://team/victims\"\n\
         [share]\nlisten = \"{}\"\n{}[share.knowledge]\nperiod = \"20ms\"\nfacts.victims = \"scout/found\"\n{more}",
        folder.endpoint(name),
        knows.collect::<String>(),
    )
}

impl Robot {
    fn start(name: &str, text: &str) -> Self {
        let log = MemoryTarget::default();
        let mut agent = load(name, text, &log).unwrap();
        let (board, stopper) = (Arc::clone(agent.board()), agent.stopper());
        let team = agent.composer().team().unwrap();
        let thread = std::thread::spawn(move || {
            agent.run(Box::new(|_| Control::Continue)).unwrap();
        });
        Self { board, team, log, stopper, thread: Some(thread) }
    }

    /// Whether a line of its log has all of these words.
    fn logs(&self, words: &[&str]) -> bool {
        self.log.lines().iter().any(|record| words.iter().all(|word| record.text.contains(word)))
    }

    fn say(&self, victim: u32, x: f64, certainty: f64, retract: bool) {
        say(&self.board, victim, x, certainty, retract);
    }

    fn read(&self, path: &str) -> Option<Value> {
        self.board.read(path).ok().flatten().map(|(value, _)| value)
    }

    fn number(&self, path: &str) -> f64 {
        match self.read(path) {
            Some(Value::Float(number)) => number,
            Some(Value::Integer(number)) => number as f64,
            _ => f64::NAN,
        }
    }

    fn sees(&self, field: &str, what: f64) -> bool {
        self.number(&format!("rescuer/seen/{field}")) == what
    }
}

impl Drop for Robot {
    fn drop(&mut self) {
        self.stopper.stop();
        self.thread.take().unwrap().join().unwrap();
    }
}

/// Robots that know the one before them.
fn chain(folder: &Folder, names: &[&str]) -> Vec<Robot> {
    let start = |i: usize| {
        let before = if i == 0 { &[][..] } else { &names[i - 1..i] };
        Robot::start(names[i], &text(folder, names[i], before, ""))
    };
    (0..names.len()).map(start).collect()
}

#[test]
fn a_fact_reaches_robots_that_its_origin_does_not_know() {
    let folder = Folder::new();
    let team = chain(&folder, &["one", "two", "three"]);
    team[0].say(3, 1.5, 0.8, false);
    wait_for("the fact", || team.iter().all(|robot| robot.sees("newest", 1.5)));
    // Its origin is kept, and shows on the board of the others.
    let fact = |name: &str| team[2].read(&format!("team/victims/facts/0/{name}"));
    assert_eq!(fact("robot"), Some(Value::Text("one".into())));
    assert_eq!(fact("key"), Some(Value::Text("3".into())));
    assert_eq!(fact("certainty"), Some(Value::Float(0.8)));
    assert_eq!(fact("value/x"), Some(Value::Float(1.5)));
    assert!(team[2].number("rescuer/seen/age") >= 0.0);
    // Another robot states another thing about the same victim: nothing is overwritten, and readers choose.
    team[2].say(3, 2.5, 0.3, false);
    wait_for("both facts", || team.iter().all(|robot| robot.sees("facts", 2.0)));
    wait_for("the newest", || {
        team.iter().all(|robot| robot.sees("newest", 2.5) && robot.sees("surest", 1.5))
    });
    // What is taken back disappears, and the other's word stays.
    team[0].say(3, 0.0, 0.0, true);
    wait_for("one fact", || team.iter().all(|robot| robot.sees("facts", 1.0) && robot.sees("surest", 2.5)));
    team[2].say(3, 0.0, 0.0, true);
    wait_for("no fact", || team.iter().all(|robot| robot.sees("facts", 0.0) && robot.sees("newest", -1.0)));
    assert!(team[1].number("rescuer/seen/changes") >= 3.0, "a block is told what changes");
    let counted = |name: &str| team[1].number(&format!("share/knowledge/{name}"));
    assert!(counted("sent") > 0.0 && counted("received") > 0.0 && counted("refused") == 0.0);
    assert_eq!(team[1].read("share/knowledge/contested"), Some(Value::Bool(false)));
}

/// Carries messages to one other robot.
struct Wire {
    from: &'static str,
    to: Arc<dyn TeamExchange>,
}

impl TeamCarrier for Wire {
    fn send(&self, _: &str, message: &[u8]) -> bool {
        self.to.receive(self.from, message.to_vec());
        true
    }
}

#[test]
fn facts_travel_by_a_carrier_beside_the_sessions() {
    let folder = Folder::new();
    let [one, two] = ["one", "two"].map(|name| Robot::start(name, &text(&folder, name, &[], "")));
    for (from, to, name) in [(&one, &two, ["one", "two"]), (&two, &one, ["two", "one"])] {
        from.team.set_carrier(Some(Arc::new(Wire { from: name[0], to: Arc::clone(&to.team) })));
        from.team.meet(name[1]);
    }
    one.say(3, 1.5, 0.8, false);
    two.say(4, 2.5, 0.8, false);
    wait_for("both facts", || one.sees("facts", 2.0) && two.sees("facts", 2.0));
    // By a session, too: the robot is there as long as one of both reaches it.
    let three = Robot::start("three", &text(&folder, "three", &["one"], ""));
    let neighbours = || one.number("share/knowledge/neighbours");
    wait_for("another robot", || neighbours() == 2.0 && three.sees("facts", 2.0));
    one.team.meet("three");
    one.team.part("three");
    one.team.part("three");
    one.say(5, 0.5, 0.8, false);
    wait_for("the fact", || three.sees("facts", 3.0));
    assert_eq!(neighbours(), 2.0);
    for robot in [&one, &two] {
        robot.team.set_carrier(None);
    }
    one.team.part("two");
    wait_for("its absence", || neighbours() == 1.0);
    one.say(6, 0.5, 0.8, false);
    wait_for("the fact", || three.sees("facts", 4.0));
    assert!(two.sees("facts", 3.0));
}

#[test]
fn mismatched_fact_is_named_hidden_and_forwarded() {
    let folder = Folder::new();
    let strange = text(&folder, "strange", &["middle"], "")
        .replace("scout = {}", "scout = { kind = \"stranger\" }")
        .replace("rescuer = {}", "")
        .replace("\"rescuer/victims\" = \"slate://team/victims\"", "");
    let alike = strange.replace("strange\"", "alike\"").replace("/strange", "/alike");
    let middle = Robot::start("middle", &text(&folder, "middle", &[], ""));
    let strange = Robot::start("strange", &strange);
    let alike = Robot::start("alike", &alike);
    middle.say(1, 1.0, 1.0, false);
    wait_for("the fact to be kept out", || middle.number("team/victims/unfit") == 2.0);
    wait_for("its own, which is seen", || middle.sees("facts", 1.0));
    // Both of the other kind see each other's through the one in the middle, and not its.
    for robot in [&strange, &alike] {
        wait_for("both facts", || robot.read("team/victims/facts/1/value/x") == Some(Value::Float(9.0)));
        wait_for("the other kind", || robot.number("team/victims/unfit") == 1.0);
    }
    for (robot, here, there) in [(&middle, "m", "cm"), (&strange, "cm", "m"), (&alike, "cm", "m")] {
        let difference = format!("`facts/value/x` is f64 in {here} here and f64 in {there} there");
        let words = ["facts about `victims` don't fit and are only passed on", &difference];
        wait_for("the difference", || robot.logs(&words));
    }
}

#[test]
fn a_robot_without_a_use_for_a_topic_shows_it_all_the_same() {
    let folder = Folder::new();
    let one = Robot::start("one", &text(&folder, "one", &[], ""));
    let onlooker = format!(
        "[agent]\nname = \"onlooker\"\n[loop]\nperiod = \"10ms\"\n[share]\nlisten = \"{}\"\nagents.one.at = \"{}\"\n\
         [share.knowledge]\n",
        folder.endpoint("onlooker"),
        folder.endpoint("one")
    );
    let onlooker = Robot::start("onlooker", &onlooker);
    one.say(7, 7.0, 1.0, false);
    wait_for("the fact", || onlooker.read("team/victims/facts/0/value/x") == Some(Value::Float(7.0)));
}

#[test]
fn knowledge_is_saved_and_damaged_file_set_aside() {
    let folder = Folder::new();
    let saved = format!("save = \"{}\"\n", folder.path("known").display());
    let own = text(&folder, "one", &[], &saved);
    let robot = Robot::start("one", &own);
    robot.say(3, 3.0, 1.0, false);
    wait_for("the fact", || robot.sees("newest", 3.0));
    drop(robot);
    // It knows its own former word when it starts again, and can take it back.
    let robot = Robot::start("one", &own);
    wait_for("the former word", || robot.sees("newest", 3.0));
    robot.say(3, 0.0, 0.0, true);
    wait_for("no fact", || robot.sees("facts", 0.0) && robot.sees("changes", 2.0));
    drop(robot);
    let file = folder.path("known/one.knowledge");
    let mut bytes = std::fs::read(&file).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(&file, &bytes).unwrap();
    let robot = Robot::start("one", &own);
    wait_for("its property", || robot.sees("facts", 0.0));
    assert_eq!(std::fs::read(folder.path("known/one.knowledge.damaged")).unwrap(), bytes);
}

#[test]
fn agent_outside_of_team_receives_nothing() {
    let folder = Folder::new();
    let own = text(&folder, "one", &[], "[share.security]\nallow.two.read = [\"**\"]\n");
    let (one, two) = (Robot::start("one", &own), Robot::start("two", &text(&folder, "two", &["one"], "")));
    one.say(1, 1.0, 1.0, false);
    two.say(2, 2.0, 1.0, false);
    wait_for("its own facts", || one.sees("facts", 1.0) && two.sees("facts", 1.0));
    wait_for("the connection", || two.number("share/knowledge/sent") > 10.0);
    for field in ["neighbours", "dropped", "sent", "received"] {
        assert_eq!(one.number(&format!("share/knowledge/{field}")), 0.0, "{field}");
    }
}

#[test]
fn unread_topic_keeps_layout_while_facts_fit() {
    let folder = Folder::new();
    let plain = |name: &str, knows: &str, more: &str| {
        format!(
            "[agent]\nname = \"{name}\"\n[loop]\nperiod = \"10ms\"\n{more}[share]\nlisten = \"{}\"\n\
             agents.{knows}.at = \"{}\"\n[share.knowledge]\n",
            folder.endpoint(name),
            folder.endpoint(knows),
        )
    };
    let one = Robot::start("one", &text(&folder, "one", &[], ""));
    let onlooker = Robot::start("onlooker", &plain("onlooker", "one", ""));
    one.say(99, 7.0, 1.0, false);
    let shown = || onlooker.read("team/victims/facts/0/value/x");
    wait_for("the fact", || shown() == Some(Value::Float(7.0)));
    let (property, _) = onlooker.board.get("team/victims").unwrap();
    // What this one states comes first in the table, and is of another kind.
    let strange = plain("strange", "onlooker", "[modules.stranger]\n");
    let strange = Robot::start("strange", &format!("{strange}facts.victims = \"stranger/found\"\n"));
    wait_for("the other kind", || onlooker.number("team/victims/unfit") == 1.0);
    assert!(Arc::ptr_eq(&property, &onlooker.board.get("team/victims").unwrap().0));
    assert_eq!(shown(), Some(Value::Float(7.0)));
    // When nothing of its kind is left, the other one is shown.
    one.say(99, 0.0, 0.0, true);
    wait_for("what is left", || shown() == Some(Value::Float(9.0)));
    drop(strange);
}

#[test]
fn tables_of_different_facts_have_different_numbers() {
    let folder = Folder::new();
    let robots = ["one", "two"].map(|name| Robot::start(name, &text(&folder, name, &[], "")));
    let mut rescuer = Fixture::<Rescuer>::new();
    for (robot, x) in robots.iter().zip([1.5, 2.5]) {
        robot.say(3, x, 1.0, false);
        wait_for("its fact", || robot.sees("newest", x));
        // What is saved with the one table learns the other one.
        let saved = rescuer.save().unwrap();
        rescuer = Fixture::new();
        rescuer.restore(&saved).unwrap();
        let Some(Value::Integer(revision)) = robot.read("team/victims/revision") else { panic!("a number") };
        rescuer.write::<FactTable<Victim>>("victims", 1, |table| {
            table.head.revision = revision as u64;
            table.facts[0].head.key = "3".into();
            table.facts[0].value = Victim { x };
        });
        assert_eq!(rescuer.tick(), Outcome::Ok);
        assert_eq!(rescuer.output::<Seen>("seen").unwrap().newest, x);
    }
}

/// Two names that have the same number.
fn alike() -> (String, String) {
    let mut known = slate_sorted::SortedMap::new();
    (0..)
        .find_map(|i| Some((known.insert(robot_number(&format!("r{i}")), i)?, i)))
        .map(|(one, other)| (format!("r{one}"), format!("r{other}")))
        .unwrap()
}

#[test]
fn robots_with_same_number_are_reported() {
    let folder = Folder::new();
    let (first, second) = alike();
    let middle = Robot::start("middle", &text(&folder, "middle", &[], ""));
    let _team = [&first, &second].map(|name| Robot::start(name, &text(&folder, name, &["middle"], "")));
    wait_for("what is wrong", || {
        middle.logs(&["have the same number", &first, &second, "rename one of them"])
    });
}

#[test]
fn errors_are_reported_at_load() {
    let folder = Folder::new();
    let own = text(&folder, "one", &[], "");
    let refused = |text: &str| load("one", text, &MemoryTarget::default()).err().unwrap_or_default();
    let typo = refused(&own.replace("facts.victims = \"scout/found\"", "facts.victims = \"scout/fund\""));
    assert!(typo.contains("scout/fund") && typo.contains("scout/found"), "{typo}");
    let alone = refused(own.split("[share.knowledge]").next().unwrap());
    assert!(alone.contains("takes part in no team"), "{alone}");
    let topic = refused(&own.replace("facts.victims", "facts.\"Victims!\""));
    assert!(topic.contains("topic"), "{topic}");
    let team = refused(&own.replace("name = \"one\"", "name = \"team\""));
    assert!(team.contains("no agent can be called `team`"), "{team}");
    let (first, second) = alike();
    let known = format!("[share]\nagents.{first}.at = \"local:x\"\nagents.{second}.at = \"local:y\"");
    let clash = refused(&own.replace("[share]", &known));
    assert!(clash.contains("have the same number") && clash.contains(&first), "{clash}");
}

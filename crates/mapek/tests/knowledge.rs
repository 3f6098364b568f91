//! Facts, and what readers see of them.

use proptest::prelude::*;
use slate_interfaces::{FactHead, Point2};
use slate_mapek::{
    ActionRequest, Fact, FactTable, Facts, MostCertain, Newest, PlanDescription, PlanLibrary, Statements,
    StrategyModel, Union, Version, WorldModel,
};
use slate_module::prelude::*;
use slate_module::testing::Fixture;
use slate_module::{Outcome, Refusal, Sequence, Setup, Spec, Stage, Text, Trigger};

fn fact(origin: u32, sequence: u64, time: u64, certainty: f64, value: Option<i32>) -> Fact<i32> {
    Fact { origin, version: Version { epoch: 0, sequence }, time, certainty, value }
}

#[test]
fn a_view_chooses_among_origins() {
    let mut facts = Facts::default();
    facts.insert(fact(2, 1, 30, 0.5, Some(20)));
    facts.insert(fact(1, 1, 10, 0.9, Some(10)));
    facts.insert(fact(3, 1, 20, 0.9, Some(30)));
    assert_eq!(facts.view::<Newest>().and_then(|fact| fact.value), Some(20));
    assert_eq!(facts.view::<MostCertain>().and_then(|fact| fact.value), Some(30));
    assert_eq!(facts.view::<Union>().filter_map(|fact| fact.value).collect::<Vec<_>>(), [10, 20, 30]);
}

#[test]
fn an_origin_takes_back_only_what_it_said() {
    let mut facts = Facts::default();
    facts.insert(fact(1, 1, 10, 1.0, Some(10)));
    facts.insert(fact(2, 1, 20, 1.0, Some(20)));
    assert!(facts.insert(fact(2, 2, 30, 1.0, None)));
    assert_eq!(facts.view::<Newest>().and_then(|fact| fact.value), Some(10));
    // What was taken back is not resurrected by a copy that comes late.
    assert!(!facts.insert(fact(2, 1, 20, 1.0, Some(20))));
    assert_eq!(facts.view::<Union>().count(), 1);
}

#[test]
fn a_restarted_origin_is_newer_than_its_former_life() {
    let mut facts = Facts::default();
    facts.insert(fact(1, 100, 10, 1.0, Some(10)));
    let restarted = Fact { version: Version { epoch: 1, sequence: 1 }, ..fact(1, 1, 20, 1.0, Some(11)) };
    assert!(facts.insert(restarted));
    assert_eq!(facts.view::<Newest>().and_then(|fact| fact.value), Some(11));
}

proptest! {
    #[test]
    fn facts_converge_whatever_the_order(
        statements in prop::collection::vec((0..4_u32, 0..3_u64, 0..5_u64), 0..30),
        seed in any::<u64>(),
    ) {
        // A version is stated once, so its content follows from it.
        let fact = |&(origin, epoch, sequence): &(u32, u64, u64)| Fact {
            origin,
            version: Version { epoch, sequence },
            time: epoch * 7 + sequence,
            certainty: 0.5,
            value: (sequence != 3).then_some((epoch * 10 + sequence) as i32),
        };
        let mut shuffled = statements.clone();
        let mut random = slate_module::Random::new(seed, "shuffle");
        for i in (1..shuffled.len()).rev() {
            shuffled.swap(i, (random.bits() % (i as u64 + 1)) as usize);
        }
        let (mut one, mut other) = (Facts::default(), Facts::default());
        statements.iter().for_each(|statement| { one.insert(fact(statement)); });
        shuffled.iter().chain(&statements).for_each(|statement| { other.insert(fact(statement)); });
        prop_assert_eq!(&one, &other);
        for origin in 0..4 {
            let last = statements.iter().filter(|statement| statement.0 == origin).max();
            let known = one.all().iter().find(|fact| fact.origin == origin);
            prop_assert_eq!(known.cloned(), last.map(fact));
        }
    }
}

#[test]
fn a_world_model_is_saved_with_its_facts() {
    let mut world = WorldModel::<(u8, u8), i32>::default();
    world.insert((1, 2), fact(1, 1, 10, 1.0, Some(5)));
    world.insert((0, 0), fact(1, 1, 10, 1.0, Some(6)));
    let saved = slate_module::encode(&world).unwrap();
    assert_eq!(slate_module::decode::<WorldModel<(u8, u8), i32>>(&saved).unwrap(), world);
    let seen: Vec<_> =
        world.view::<Newest>().map(|(key, fact)| (*key, fact.and_then(|fact| fact.value))).collect();
    assert_eq!(seen, [((0, 0), Some(6)), ((1, 2), Some(5))]);
    assert!(world.facts(&(9, 9)).is_none());
}

#[test]
fn the_plan_that_succeeded_more_often_is_the_best_of_its_role() {
    let mut strategy = StrategyModel::default();
    strategy.take_role("attacker");
    let actions = [ActionRequest::default()];
    strategy.add_plan("dribble", "attacker", &actions);
    strategy.add_plan("shoot", "attacker", &actions);
    strategy.add_plan("block", "defender", &actions);
    let plan = |name: &str, role: &str| PlanDescription {
        name: Text::new(name),
        role: Text::new(role),
        actions: Sequence::new(&actions),
    };
    let plans = [plan("dribble", "attacker"), plan("shoot", "attacker"), plan("block", "defender")];
    let library = |plans: &[PlanDescription]| PlanLibrary { plans: Sequence::new(plans) };
    let all = library(&plans);
    assert_eq!(strategy.best(&all).map(|plan| plan.name.as_str()), Some("dribble"));
    assert!(strategy.record("dribble", false, 3.0));
    assert!(strategy.record("shoot", true, 2.0));
    assert!(!strategy.record("block", true, 1.0));
    assert_eq!(strategy.best(&all).map(|plan| plan.name.as_str()), Some("shoot"));
    let best = strategy.best(&library(&plans[..1])).map(|plan| plan.name.as_str());
    assert_eq!(best, Some("dribble"), "what is no longer in the library is not chosen");
    strategy.take_role("keeper");
    assert_eq!(strategy.best(&all), None);
    let report = strategy.report();
    let records: Vec<_> = report
        .records
        .iter()
        .map(|record| (record.name.as_str().to_owned(), record.tried, record.succeeded))
        .collect();
    assert_eq!(records, [("dribble".into(), 1, 0), ("shoot".into(), 1, 1), ("block".into(), 0, 0)]);
    let saved = slate_module::encode(&strategy).unwrap();
    assert_eq!(slate_module::decode::<StrategyModel>(&saved).unwrap(), strategy);
}

/// What is stated about a room.
#[interface]
#[derive(PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Room {
    /// How warm it is.
    pub warmth: f64,
}

/// Ports of [`Warden`].
#[ports]
pub struct WardenIo {
    /// What is known.
    rooms: Input<FactTable<Room>>,
    /// What to state: the number of a room, and how warm it is; below 0 it is taken back.
    say: Queue<Point2>,
    /// Stated value.
    #[capacity(3)]
    stated: Output<FactTable<Room>>,
    /// How many keys have changed, and whether all that is stated was written.
    changes: Output<Point2>,
}

/// States given facts, and counts changes.
pub struct Warden;

impl Module for Warden {
    type Io = WardenIo;
    type Params = ();
    type State = (Statements<Room>, WorldModel<String, Room>);

    const NAME: &'static str = "warden";
    const DOC: &'static str = "";
    const STAGE: Stage = Stage::Think;

    fn spec() -> Spec {
        Spec { trigger: Trigger::Stage, deadline: None, unique: "" }
    }

    fn create(_: &Setup<'_>, (): &()) -> Result<Self::State, Refusal> {
        Ok(Self::State::default())
    }

    fn tick((own, world): &mut Self::State, io: &WardenIo, (): &(), now: &Tick) -> Outcome {
        for say in io.say.iter() {
            let key = say.x.to_string();
            if say.y < 0.0 {
                own.retract(now.now(), &key);
            } else {
                own.state(now.now(), &key, 1.0, Room { warmth: say.y });
            }
        }
        let written = f64::from(u8::from(own.write(now.now(), &io.stated)));
        let changes = io.rooms.get().map_or(0, |rooms| world.replace(rooms).len());
        io.changes.set(Point2 { x: changes as f64, y: written });
        Outcome::Ok
    }
}

fn told(warden: &mut Fixture<Warden>, say: &[(f64, f64)]) -> Point2 {
    warden.advance(1000);
    say.iter().for_each(|(x, y)| warden.push("say", Point2 { x: *x, y: *y }));
    assert_eq!(warden.tick(), Outcome::Ok);
    warden.output("changes").unwrap_or_default()
}

/// A table of facts, each with a key, an origin, a number and a value.
fn show(warden: &mut Fixture<Warden>, revision: u64, facts: &[(&str, u32, u64, f64)]) -> f64 {
    warden.write::<FactTable<Room>>("rooms", facts.len(), |table| {
        table.head.revision = revision;
        for (fact, (key, origin, sequence, warmth)) in table.facts.iter_mut().zip(facts) {
            fact.head = FactHead {
                key: Text::new(key),
                origin: *origin,
                sequence: *sequence,
                order: *sequence,
                ..FactHead::default()
            };
            fact.value = Room { warmth: *warmth };
        }
    });
    told(warden, &[]).x
}

#[test]
fn block_receives_changes_of_table() {
    let mut warden = Fixture::<Warden>::new();
    assert_eq!(
        show(&mut warden, 1, &[("hall", 1, 1, 20.0), ("hall", 2, 5, 21.0), ("loft", 1, 2, 30.0)]),
        2.0
    );
    assert_eq!(show(&mut warden, 1, &[]), 0.0, "it is the same table");
    assert_eq!(
        show(&mut warden, 2, &[("hall", 1, 1, 20.0), ("hall", 2, 6, 22.0), ("loft", 1, 2, 30.0)]),
        1.0
    );
    assert_eq!(
        show(&mut warden, 3, &[("hall", 1, 1, 20.0), ("loft", 1, 2, 30.0)]),
        1.0,
        "one was taken back"
    );
    assert_eq!(show(&mut warden, 4, &[]), 2.0);
}

#[test]
fn statements_are_written_on_change_and_when_they_fit() {
    let mut warden = Fixture::<Warden>::new();
    let wrote = |warden: &Fixture<Warden>| warden.wrote("stated");
    assert_eq!(told(&mut warden, &[(1.0, 20.0), (2.0, 21.0)]).y, 1.0);
    assert!(wrote(&warden));
    told(&mut warden, &[(1.0, 20.0)]);
    assert!(!wrote(&warden), "it says the same again");
    told(&mut warden, &[(1.0, -1.0)]);
    assert!(wrote(&warden), "it takes something back");
    assert_eq!(told(&mut warden, &[(3.0, 1.0), (4.0, 1.0)]).y, 0.0, "that has to be seen first");
    assert!(!wrote(&warden));
    warden.advance(1_000_000_000);
    assert_eq!(told(&mut warden, &[]).y, 1.0, "now it makes room");
    assert_eq!(told(&mut warden, &[(5.0, 1.0)]).y, 0.0, "there is room for three");
    assert!(!wrote(&warden));
}

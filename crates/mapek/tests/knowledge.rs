//! Facts, and what readers see of them.

use proptest::prelude::*;
use slate_mapek::{
    ActionRequest, Fact, Facts, MostCertain, Newest, StrategyModel, Union, Version, WorldModel,
};

fn fact(origin: u32, sequence: u64, time: u64, certainty: f64, value: Option<i32>) -> Fact<i32> {
    Fact { origin, version: Version { epoch: 0, sequence }, time, certainty, value }
}

#[test]
fn a_view_chooses_among_origins() {
    let mut facts = Facts::default();
    facts.tell(fact(2, 1, 30, 0.5, Some(20)));
    facts.tell(fact(1, 1, 10, 0.9, Some(10)));
    facts.tell(fact(3, 1, 20, 0.9, Some(30)));
    assert_eq!(facts.view::<Newest>().and_then(|fact| fact.value), Some(20));
    assert_eq!(facts.view::<MostCertain>().and_then(|fact| fact.value), Some(30));
    assert_eq!(facts.view::<Union>().filter_map(|fact| fact.value).collect::<Vec<_>>(), [10, 20, 30]);
}

#[test]
fn an_origin_takes_back_only_what_it_said() {
    let mut facts = Facts::default();
    facts.tell(fact(1, 1, 10, 1.0, Some(10)));
    facts.tell(fact(2, 1, 20, 1.0, Some(20)));
    assert!(facts.tell(fact(2, 2, 30, 1.0, None)));
    assert_eq!(facts.view::<Newest>().and_then(|fact| fact.value), Some(10));
    // What was taken back is not resurrected by a copy that comes late.
    assert!(!facts.tell(fact(2, 1, 20, 1.0, Some(20))));
    assert_eq!(facts.view::<Union>().count(), 1);
}

#[test]
fn a_restarted_origin_is_newer_than_its_former_life() {
    let mut facts = Facts::default();
    facts.tell(fact(1, 100, 10, 1.0, Some(10)));
    let restarted = Fact { version: Version { epoch: 1, sequence: 1 }, ..fact(1, 1, 20, 1.0, Some(11)) };
    assert!(facts.tell(restarted));
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
        statements.iter().for_each(|statement| { one.tell(fact(statement)); });
        shuffled.iter().chain(&statements).for_each(|statement| { other.tell(fact(statement)); });
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
    world.tell((1, 2), fact(1, 1, 10, 1.0, Some(5)));
    world.tell((0, 0), fact(1, 1, 10, 1.0, Some(6)));
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
    strategy.learn("dribble", "attacker", &actions);
    strategy.learn("shoot", "attacker", &actions);
    strategy.learn("block", "defender", &actions);
    assert_eq!(strategy.best().map(|plan| plan.name.as_str()), Some("dribble"));
    assert!(strategy.record("dribble", false, 3.0));
    assert!(strategy.record("shoot", true, 2.0));
    assert!(!strategy.record("block", true, 1.0));
    assert_eq!(strategy.best().map(|plan| plan.name.as_str()), Some("shoot"));
    strategy.take_role("keeper");
    assert_eq!(strategy.best(), None);
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

//! Knowledge of a team.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;

use common::{TIGHT, seen, talk, value};
use slate_share::knowledge::{Changed, Limits, Refusal, Replica, RestoreError, Statement, View};

fn robot(robot: u32) -> Replica {
    Replica::new(robot, 1000 + robot, Limits::default())
}

fn tight(robot: u32, random: u32) -> Replica {
    Replica::new(robot, random, TIGHT)
}

fn same(team: &[Replica]) -> bool {
    team.windows(2).all(|pair| pair[0].versions().eq(pair[1].versions()))
}

#[test]
fn facts_reach_unacquainted_robots_without_waiting_for_a_tick() {
    let mut chain: Vec<Replica> = (0..5).map(robot).collect();
    for (place, robot) in chain.iter_mut().enumerate() {
        for neighbor in [place.wrapping_sub(1), place + 1] {
            if neighbor < 5 {
                robot.add_neighbor(neighbor as u32);
            }
        }
    }
    chain[0].state(7, b"door", value(b"open")).unwrap();
    for place in 0..5 {
        while let Some(message) = chain[place].outgoing() {
            chain[message.to as usize].receive(place as u32, &message.bytes).unwrap();
        }
    }
    assert_eq!(seen(&chain[4], "door"), [(0, b"open".to_vec())]);
}

#[test]
fn each_origin_keeps_its_word_and_the_reader_chooses() {
    let mut team = vec![robot(0), robot(1), robot(2)];
    for (place, certainty, time) in [(0, 0.5, 30), (1, 0.9, 20), (2, 0.1, 10)] {
        let statement = Statement { schema: 3, certainty, value: &[place as u8] };
        team[place].state(time, b"ball", statement).unwrap();
    }
    for (one, other) in [(0, 1), (1, 2), (0, 1)] {
        talk(&mut team, one, other);
    }
    for replica in &team {
        let origins = |view| replica.view(b"ball", view).iter().map(|fact| fact.origin).collect::<Vec<_>>();
        assert_eq!(origins(View::Newest), [0]);
        assert_eq!(origins(View::MostCertain), [1]);
        assert_eq!(origins(View::Union), [0, 1, 2]);
    }
    // Robot 0 retracts its own fact, and no other.
    assert_eq!(team[0].retract(40, b"ball"), Ok(true));
    assert_eq!(team[0].retract(41, b"ball"), Ok(false));
    talk(&mut team, 0, 1);
    assert_eq!(seen(&team[1], "ball"), [(1, vec![1]), (2, vec![2])]);
}

#[test]
fn knowledge_of_a_fact_orders_statements_across_clock_offsets() {
    let hour = 3_600_000_000_000;
    let mut team = vec![robot(0), robot(1)];
    team[0].state(9 * hour, b"ball", value(b"left")).unwrap();
    talk(&mut team, 0, 1);
    team[1].state(4 * hour, b"ball", value(b"right")).unwrap();
    talk(&mut team, 0, 1);
    for replica in &team {
        let fact = replica.view(b"ball", View::Newest)[0];
        assert_eq!((fact.origin, fact.time, fact.order), (1, 4 * hour, 9 * hour + 1));
    }
}

#[test]
fn a_long_absent_robot_revives_no_forgotten_retraction() {
    let mut team = vec![tight(0, 1), tight(1, 2), tight(2, 3)];
    team[0].state(0, b"victim", value(b"here")).unwrap();
    team[0].state(0, b"exit", value(b"north")).unwrap();
    for other in [1, 2] {
        talk(&mut team, 0, other);
    }
    // Robot 2 goes away. Far more is retracted than is remembered.
    assert_eq!(team[0].retract(1, b"victim"), Ok(true));
    for number in 0..200_u8 {
        team[0].state(2, &[number], value(b"")).unwrap();
        assert_eq!(team[0].retract(3, &[number]), Ok(true));
    }
    talk(&mut team, 0, 1);
    assert!(seen(&team[1], "victim").is_empty());
    assert_eq!(seen(&team[2], "victim").len(), 1);

    talk(&mut team, 1, 2);
    for replica in &team {
        assert!(seen(replica, "victim").is_empty());
        assert_eq!(seen(replica, "exit"), [(0, b"north".to_vec())]);
        assert_eq!(replica.keys().len(), 1);
    }
    assert!(same(&team));
}

#[test]
fn a_robot_without_its_disk_loses_nothing_and_has_the_last_word() {
    let mut team = vec![robot(0), robot(1)];
    for (key, word) in [("a", "1"), ("b", "2"), ("c", "3")] {
        team[0].state(5, key.as_bytes(), value(word.as_bytes())).unwrap();
    }
    talk(&mut team, 0, 1);

    // A random number below the first one: the new life comes before the former until robot 0 hears of that.
    team[0] = Replica::new(0, 1, Limits::default());
    team[0].state(6, b"a", value(b"new")).unwrap();
    talk(&mut team, 0, 1);
    for replica in &team {
        let facts = ["a", "b", "c"].map(|key| seen(replica, key));
        assert_eq!(facts, [[(0, b"new".to_vec())], [(0, b"2".to_vec())], [(0, b"3".to_vec())]]);
    }
    // What it has said in its former life it can take back.
    assert_eq!(team[0].retract(7, b"b"), Ok(true));
    talk(&mut team, 0, 1);
    assert!(team.iter().all(|replica| seen(replica, "b").is_empty()));
    assert!(same(&team));
}

#[test]
fn a_fact_of_an_absent_robot_survives_restarts_of_its_origin() {
    let mut team = vec![robot(0), robot(1), robot(2)];
    team[0].state(1, b"map", value(b"kitchen")).unwrap();
    talk(&mut team, 0, 1);
    // Robot 1 is away; robot 0 loses its disk and continues with robot 2.
    team[0] = Replica::new(0, 77, Limits::default());
    team[0].state(2, b"pose", value(b"hall")).unwrap();
    talk(&mut team, 0, 2);
    assert!(seen(&team[2], "map").is_empty());

    talk(&mut team, 1, 2);
    for random in 0..20 {
        team[0] = Replica::new(0, random, Limits::default());
        talk(&mut team, 0, 2);
        team[0].state(3, b"pose", value(&[random as u8])).unwrap();
        talk(&mut team, 0, 2);
    }
    assert_eq!(seen(&team[2], "map"), [(0, b"kitchen".to_vec())]);
    assert_eq!(team[2].versions().filter(|(origin, _)| *origin == 0).count(), Limits::default().lives);
    talk(&mut team, 1, 2);
    assert_eq!(seen(&team[1], "map"), [(0, b"kitchen".to_vec())]);
    assert_eq!(seen(&team[1], "pose"), [(0, vec![19])]);
}

#[test]
fn saved_facts_are_restored_at_any_age() {
    let mut team = vec![robot(0), robot(1)];
    team[0].state(1, b"a", value(b"old")).unwrap();
    team[0].state(1, b"b", value(b"old")).unwrap();
    team[1].state(1, b"c", value(b"of robot 1")).unwrap();
    talk(&mut team, 0, 1);
    let saved = team[0].save();
    team[0].state(2, b"a", value(b"new")).unwrap();
    team[0].retract(2, b"b").unwrap();
    talk(&mut team, 0, 1);

    let alone = Replica::restore(0, 5, Limits::default(), &saved).unwrap();
    assert_eq!(seen(&alone, "a"), [(0, b"old".to_vec())]);
    assert_eq!(seen(&alone, "c"), [(1, b"of robot 1".to_vec())]);
    team[0] = alone;
    talk(&mut team, 0, 1);
    for replica in &team {
        assert_eq!(seen(replica, "a"), [(0, b"new".to_vec())]);
        assert!(seen(replica, "b").is_empty());
    }
    assert!(same(&team));
}

#[test]
fn a_saved_state_that_is_damaged_or_of_another_robot_is_refused() {
    let mut replica = robot(3);
    replica.state(1, b"a", value(b"1")).unwrap();
    let saved = replica.save();
    for length in 0..saved.len() {
        assert_eq!(
            Replica::restore(3, 1, Limits::default(), &saved[..length]).unwrap_err(),
            RestoreError::Damaged
        );
    }
    for at in 0..saved.len() {
        let mut damaged = saved.clone();
        damaged[at] ^= 0x10;
        assert_eq!(Replica::restore(3, 1, Limits::default(), &damaged).unwrap_err(), RestoreError::Damaged);
    }
    let error = Replica::restore(4, 1, Limits::default(), &saved).unwrap_err();
    assert_eq!(
        error.to_string(),
        "this was saved by robot 3, and this is robot 4; start with that robot's file or without one"
    );
    let error = Replica::restore(3, 1, Limits { key: 0, ..TIGHT }, &saved).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the saved knowledge of the team doesn't fit: refused at byte 17 of 39: a length within the limits should \
         be there"
    );
}

#[test]
fn a_life_that_comes_in_parts_is_seen_as_a_whole_or_not_at_all() {
    let mut team = [tight(0, 1), tight(1, 2)];
    for number in 0..12_u8 {
        team[0].state(1, &[number], value(&[number; 64])).unwrap();
    }
    team[0].add_neighbor(1);
    team[1].add_neighbor(0);
    team[1].tick();
    let mut parts = 0;
    let mut queue = vec![];
    while let Some(message) = team[1].outgoing().or_else(|| queue.pop()) {
        if message.to == 0 {
            team[0].receive(1, &message.bytes).unwrap();
        } else {
            parts += 1;
            team[1].receive(0, &message.bytes).unwrap();
        }
        queue.extend(std::iter::from_fn(|| team[0].outgoing()));
        assert!(matches!(team[1].keys().len(), 0 | 12));
    }
    assert!(parts > 3);
    assert_eq!(team[1].keys().len(), 12);
}

#[test]
fn stating_too_much_is_refused_and_retracting_makes_room() {
    let mut replica = tight(0, 1);
    for number in 0..16_u8 {
        replica.state(1, &[number], value(b"x")).unwrap();
    }
    let error = replica.state(1, b"more", value(b"x")).unwrap_err();
    assert_eq!(
        error.to_string(),
        "this robot states 16 facts in 3104 bytes, and may state no more; retract some first"
    );
    replica.state(2, &[3], value(b"other")).unwrap();
    replica.retract(2, &[4]).unwrap();
    replica.state(2, b"more", value(b"x")).unwrap();
    assert_eq!(replica.keys().len(), 16);

    assert_eq!(replica.state(3, &[0; 17], value(b"")), Err(Refusal::Key { length: 17, limit: 16 }));
    assert_eq!(replica.state(3, b"k", value(&[0; 65])), Err(Refusal::Value { length: 65, limit: 64 }));
    for certainty in [-0.1, 1.1, f64::NAN] {
        let statement = Statement { certainty, ..value(b"") };
        assert_eq!(replica.state(3, b"k", statement), Err(Refusal::Certainty));
    }
}

#[test]
fn robots_beyond_the_limit_are_refused_and_displace_no_other() {
    let mut team: Vec<Replica> = (0..6).map(|number| tight(number, number)).collect();
    for (place, replica) in team.iter_mut().enumerate() {
        replica.state(1, b"k", value(&[place as u8])).unwrap();
    }
    for other in 1..6 {
        talk(&mut team, 0, other);
    }
    assert_eq!(seen(&team[0], "k").len(), 4);
    assert!(team[0].counters().refused > 0);
    let mut full = tight(9, 9);
    for other in 0..4 {
        let mut pair = [full, team[other + 1].clone()];
        talk(&mut pair, 0, 1);
        [full, _] = pair;
    }
    assert_eq!(full.state(1, b"k", value(b"")), Err(Refusal::Robots { limit: 4 }));
}

#[test]
fn two_robots_of_one_number_are_detected_and_do_not_fight() {
    let mut team = vec![robot(0), Replica::new(0, 5, Limits::default()), robot(2)];
    team[0].state(1, b"k", value(b"one")).unwrap();
    team[1].state(1, b"k", value(b"other")).unwrap();
    for _ in 0..50 {
        talk(&mut team, 0, 2);
        talk(&mut team, 1, 2);
    }
    assert!(team[0].counters().contested || team[1].counters().contested);
    let newest = team[2].versions().next().map(|(_, version)| version.epoch >> 32);
    assert!(newest < Some(20), "{newest:?}");
}

#[test]
fn untaken_messages_are_bounded_and_counted() {
    let mut replica = tight(0, 1);
    for neighbor in 1..4 {
        replica.add_neighbor(neighbor);
    }
    for _ in 0..1000 {
        replica.tick();
    }
    assert_eq!(replica.counters().dropped, 2000 - TIGHT.outgoing as u64);
    assert!(replica.memory() <= TIGHT.memory());
    for neighbor in 1..4 {
        replica.remove_neighbor(neighbor);
    }
    assert_eq!(replica.outgoing(), None);
}

#[test]
fn reader_receives_changed_keys() {
    let mut team = vec![robot(0), robot(1)];
    team[0].state(1, b"a", value(b"1")).unwrap();
    team[0].state(1, b"b", value(b"1")).unwrap();
    talk(&mut team, 0, 1);
    let changed = |replica: &mut Replica| -> Vec<Vec<u8>> {
        let Changed::Keys(keys) = replica.take_changed() else { panic!("all") };
        keys.iter().map(|key| key.to_vec()).collect()
    };
    assert_eq!(changed(&mut team[1]), [b"a", b"b"]);
    team[0].retract(2, b"b").unwrap();
    talk(&mut team, 0, 1);
    assert_eq!(changed(&mut team[1]), [b"b"]);
    talk(&mut team, 0, 1);
    assert!(changed(&mut team[1]).is_empty());

    // A robot without queries is informed, and costs no more memory.
    let mut replica = tight(0, 1);
    for number in 0..200_u8 {
        replica.state(1, &[number], value(b"")).unwrap();
        replica.retract(1, &[number]).unwrap();
        assert!(replica.memory() <= TIGHT.memory());
    }
    assert_eq!(replica.take_changed(), Changed::All);
    assert_eq!(replica.take_changed(), Changed::default());
}

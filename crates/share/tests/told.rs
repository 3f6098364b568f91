//! Messages of the team's knowledge between two sessions, and what a member makes of them.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use proptest::prelude::*;
use slate_mapek::FactTable;
use slate_module::{Interface, interface};
use slate_share::session::{Application, Event, Identity, LONGEST_KNOWLEDGE, Limits, Sample, Session};
use slate_share::team::{Layout, Member, SavedKnowledge, robot_number};

/// A place.
#[interface]
#[derive(PartialEq)]
pub struct Place {
    /// Where.
    pub x: f64,
}

#[derive(Default)]
struct Heard(Vec<Vec<u8>>);

impl Application for Heard {
    fn event(&mut self, event: Event) {
        if let Event::Told { bytes } = event {
            self.0.push(bytes);
        }
    }

    fn sample(&mut self, _: u32, _: &Sample, _: u64, _: &[u8]) {}

    fn has_news(&mut self, _: u32) -> bool {
        false
    }

    fn take(&mut self, _: u32, _: &mut Vec<u8>) -> Option<Sample> {
        None
    }
}

fn pair() -> [Session; 2] {
    let session = |agent: &str| {
        let identity = Identity { agent: agent.into(), instance: robot_number(agent).into() };
        Session::new(identity, None, Limits::default())
    };
    [session("one"), session("two")]
}

/// Lets both send until they are silent; `keeps` says which packets of the first one arrive.
fn exchange(
    pair: &mut [Session; 2],
    now: u64,
    largest: usize,
    mut keeps: impl FnMut() -> bool,
) -> [Vec<Vec<u8>>; 2] {
    let (mut heard, mut packet) = ([Heard::default(), Heard::default()], Vec::new());
    let mut quiet = 0;
    while quiet < 2 {
        quiet += 1;
        for (from, to) in [(0, 1), (1, 0)] {
            while pair[from].outgoing(now, largest, &mut packet, &mut heard[from]) {
                assert!(packet.len() <= largest.max(1024));
                quiet = 0;
                if from == 1 || keeps() {
                    pair[to].receive(now, &packet, &mut heard[to]);
                }
            }
        }
    }
    heard.map(|heard| heard.0)
}

proptest! {
    /// Whatever is lost, what arrives are whole messages in order; without losses all of them.
    #[test]
    fn messages_arrive_whole_or_not_at_all(
        lengths in prop::collection::vec(0_usize..20_000, 1..12),
        largest in 1024_usize..70_000,
        losses in prop::collection::vec(any::<bool>(), 0..64),
    ) {
        let mut pair = pair();
        exchange(&mut pair, 1, 1024, || true);
        prop_assert!(pair[0].other().is_some());
        let messages: Vec<Vec<u8>> =
            lengths.iter().enumerate().map(|(i, length)| vec![i as u8; *length]).collect();
        for message in &messages {
            prop_assert!(pair[0].tell(message));
        }
        let mut lost = losses.iter();
        let [_, heard] = exchange(&mut pair, 2, largest, || !lost.next().copied().unwrap_or(false));
        let mut left = messages.iter();
        for message in &heard {
            prop_assert!(left.any(|sent| sent == message), "a message that was not sent, or sent before");
        }
        if !losses.contains(&true) {
            prop_assert_eq!(heard, messages);
        }
    }
}

#[test]
fn what_waits_is_bounded_and_needs_a_connection() {
    let mut pair = pair();
    assert!(!pair[0].tell(b"nobody is there"));
    exchange(&mut pair, 1, 1024, || true);
    assert!(!pair[0].tell(&vec![0; LONGEST_KNOWLEDGE + 1]));
    let message = vec![0; LONGEST_KNOWLEDGE];
    let taken = (0..1000).take_while(|_| pair[0].tell(&message)).count();
    assert!((1..100).contains(&taken));
    let [_, heard] = exchange(&mut pair, 2, 8192, || true);
    assert_eq!(heard.len(), taken);
    assert!(pair[0].tell(&message), "there is room again");
}

/// Lets all members tick and carries their messages, among those that know each other.
fn rounds(team: &mut [Member], rounds: usize) {
    for _ in 0..rounds {
        for from in 0..team.len() {
            team[from].tick();
            let name = team[from].name().to_owned();
            while let Some((to, message)) = team[from].outgoing() {
                let to = to.to_owned();
                if let Some(to) = team.iter_mut().find(|member| member.name() == to) {
                    to.hear(&name, &message).unwrap();
                }
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// All come to know what each has stated last, by names.
    #[test]
    fn members_of_a_chain_come_to_know_the_same(
        words in prop::collection::vec((0_usize..5, 0_u8..6, any::<bool>()), 1..40),
    ) {
        let names = ["a", "b", "c", "d", "e"];
        let mut team: Vec<Member> =
            names.iter().map(|name| Member::new(name, robot_number(name), None).unwrap()).collect();
        for i in 1..names.len() {
            team[i].meet(names[i - 1]).unwrap();
            team[i - 1].meet(names[i]).unwrap();
        }
        let layout = Layout::of(FactTable::<Place>::DESCRIPTOR).unwrap();
        let mut wanted = std::collections::BTreeMap::new();
        for (at, (robot, key, retracts)) in words.iter().enumerate() {
            let key = key.to_string();
            if *retracts {
                team[*robot].retract(at as u64, "places", &key).unwrap();
                wanted.remove(&(key, names[*robot].to_owned()));
            } else {
                let value = (at as f64).to_ne_bytes();
                team[*robot].state(at as u64, ("places", &key), &layout, 0.5, &value).unwrap();
                wanted.insert((key, names[*robot].to_owned()), value.to_vec());
            }
            rounds(&mut team, 1);
        }
        rounds(&mut team, 60);
        for member in &team {
            let known = member.known();
            let known = known.get("places").into_iter().flatten();
            let known: std::collections::BTreeMap<_, _> = known
                .map(|known| ((known.key.to_owned(), known.robot.clone()), known.fact.statement.value.to_vec()))
                .collect();
            prop_assert_eq!(&known, &wanted);
        }
    }
}

#[test]
fn interfaces_travel_with_the_facts() {
    let mut team = [Member::new("a", 1, None).unwrap(), Member::new("b", 2, None).unwrap()];
    team[0].meet("b").unwrap();
    team[1].meet("a").unwrap();
    let descriptor = FactTable::<Place>::DESCRIPTOR;
    let layout = Layout::of(descriptor).unwrap();
    assert_eq!(layout.value_size(), 8);
    team[0].state(1, ("places", "here"), &layout, 1.0, &1.0_f64.to_ne_bytes()).unwrap();
    rounds(&mut team, 3);
    let found = team[1].interface(descriptor.hash).unwrap();
    assert_eq!((found.hash, found.name), (descriptor.hash, "FactTable"));
    assert!(team[1].interface(7).is_none());
    assert!(Layout::of(Place::DESCRIPTOR).is_err());
}

#[test]
fn a_robot_that_takes_no_part_is_told_less_and_less_but_never_given_up() {
    let mut member = Member::new("a", 1, None).unwrap();
    member.meet("silent").unwrap();
    let mut told = |ticks: usize| {
        (0..ticks)
            .map(|_| {
                member.tick();
                std::iter::from_fn(|| member.outgoing().map(drop)).count()
            })
            .sum::<usize>()
    };
    assert_eq!(told(20), 20);
    assert_eq!((told(10), told(100)), (4, 0), "nothing was heard of it");
    assert!(told(200) > 0, "it may have begun to take part");
}

#[test]
fn another_robots_file_is_set_aside() {
    let folder = std::env::temp_dir().join(format!("slate-told-{}", std::process::id()));
    let mut member = Member::new("a", 1, None).unwrap();
    let layout = Layout::of(FactTable::<Place>::DESCRIPTOR).unwrap();
    member.state(1, ("places", "here"), &layout, 1.0, &1.0_f64.to_ne_bytes()).unwrap();
    let (a, b) = (SavedKnowledge::new(&folder, "a"), SavedKnowledge::new(&folder, "b"));
    a.save(&member).unwrap();
    let (again, trouble) = a.restore("a", 2);
    assert!(trouble.is_none());
    assert_eq!(again.unwrap().known()["places"].len(), 1);
    std::fs::rename(a.file(), b.file()).unwrap();
    let (other, trouble) = b.restore("b", 3);
    assert!(other.unwrap().known().is_empty());
    let trouble = trouble.unwrap();
    assert!(trouble.contains("b.knowledge") && trouble.contains("set aside"), "{trouble}");
    assert!(!b.file().exists());
    std::fs::remove_dir_all(&folder).unwrap();
}

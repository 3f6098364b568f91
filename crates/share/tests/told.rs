//! Messages of the team's knowledge between two sessions, and what a member makes of them.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use proptest::prelude::*;
use slate_mapek::FactTable;
use slate_module::{Interface, interface};
use slate_share::session::{Application, Event, Identity, Limits, MAX_KNOWLEDGE_SIZE, Session};
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
        if let Event::Knowledge { bytes } = event {
            self.0.push(bytes);
        }
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
            prop_assert!(pair[0].send_knowledge(message));
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
fn pending_messages_are_bounded_and_need_connection() {
    let mut pair = pair();
    assert!(!pair[0].send_knowledge(b"nobody is there"));
    exchange(&mut pair, 1, 1024, || true);
    assert!(!pair[0].send_knowledge(&vec![0; MAX_KNOWLEDGE_SIZE + 1]));
    let message = vec![0; MAX_KNOWLEDGE_SIZE];
    let taken = (0..1000).take_while(|_| pair[0].send_knowledge(&message)).count();
    assert!((1..100).contains(&taken));
    let [_, heard] = exchange(&mut pair, 2, 8192, || true);
    assert_eq!(heard.len(), taken);
    assert!(pair[0].send_knowledge(&message), "there is room again");
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
                    to.receive(&name, &message).unwrap();
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
            team[i].add_neighbor(names[i - 1]).unwrap();
            team[i - 1].add_neighbor(names[i]).unwrap();
        }
        let layout = Layout::of(FactTable::<Place>::DESCRIPTOR).unwrap();
        let mut wanted = slate_sorted::SortedMap::new();
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
            let known: slate_sorted::SortedMap<_, _> = known
                .map(|known| ((known.key.to_owned(), known.robot.clone()), known.fact.statement.value.to_vec()))
                .collect();
            prop_assert_eq!(&known, &wanted);
        }
    }
}

#[test]
fn interfaces_travel_with_the_facts() {
    let mut team = [Member::new("a", 1, None).unwrap(), Member::new("b", 2, None).unwrap()];
    team[0].add_neighbor("b").unwrap();
    team[1].add_neighbor("a").unwrap();
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
fn a_robot_that_takes_no_part_is_polled_ever_less_but_kept() {
    let mut member = Member::new("a", 1, None).unwrap();
    member.add_neighbor("silent").unwrap();
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

/// A stream of random numbers (xorshift), of which so many in a hundred are lost.
struct Loss {
    state: u64,
    percent: u64,
}

impl Loss {
    fn loses(&mut self) -> bool {
        self.state ^= self.state << 13;
        self.state ^= self.state >> 7;
        self.state ^= self.state << 17;
        (self.state >> 32) % 100 < self.percent
    }
}

/// A team of those that state something and then say nothing new, and how many neighbors the first and the others have at
/// least from then on.
fn quiet(robots: usize, knows: impl Fn(usize, usize) -> bool, percent: u64) -> (usize, usize) {
    let names: Vec<String> = (0..robots).map(|robot| format!("r{robot}")).collect();
    let mut team: Vec<Member> =
        names.iter().map(|name| Member::new(name, robot_number(name), None).unwrap()).collect();
    let layout = Layout::of(FactTable::<Place>::DESCRIPTOR).unwrap();
    for (robot, member) in team.iter_mut().enumerate() {
        let others = (0..robots).filter(|other| *other != robot && knows(robot, *other));
        others.for_each(|other| member.add_neighbor(&names[other]).unwrap());
        member.state(1, ("places", "here"), &layout, 1.0, &[0; 8]).unwrap();
    }
    let mut loss = Loss { state: 0x9e37_79b9_7f4a_7c15, percent };
    let mut least = (robots, robots);
    for _ in 0..500 {
        for from in 0..robots {
            team[from].tick();
            let mut speaking = vec![from];
            while let Some(from) = speaking.pop() {
                while let Some((to, message)) = team[from].outgoing() {
                    let to = to[1..].parse::<usize>().unwrap();
                    if !loss.loses() {
                        team[to].receive(&names[from], &message).unwrap();
                        speaking.push(to);
                    }
                }
            }
        }
        let others = team[1..].iter().map(Member::neighbors).min().unwrap();
        least = (least.0.min(team[0].neighbors()), least.1.min(others));
    }
    least
}

#[test]
fn quiet_robots_stay_in_a_large_team() {
    for percent in [0, 30] {
        assert_eq!(quiet(32, |_, _| true, percent), (31, 31), "all know all, {percent} % are lost");
        let star = quiet(32, |one, other| one == 0 || other == 0, percent);
        assert_eq!(star, (31, 1), "all know one, {percent} % are lost");
    }
}

/// Beside the interface of places, so that another one must be sent.
#[interface]
#[derive(PartialEq)]
pub struct Color {
    /// How red.
    pub red: f64,
}

#[test]
fn interface_is_sent_once_it_fits() {
    let mut member = Member::new("a", 1, None).unwrap();
    let places = Layout::of(FactTable::<Place>::DESCRIPTOR).unwrap();
    let colors = Layout::of(FactTable::<Color>::DESCRIPTOR).unwrap();
    let value = |length: usize| vec![0; length];
    for length in [4096, 1024, 64] {
        let mut key = 0;
        while member.state(1, ("places", &format!("{length} {key}")), &places, 1.0, &value(length)).is_ok() {
            key += 1;
        }
        assert!(key > 0 || length < 4096);
    }
    let mut state = || member.state(2, ("colours", "sky"), &colors, 1.0, &[0; 8]);
    assert!(state().is_err() && state().is_err(), "there is no room");
    for key in 0..8 {
        member.retract(3, "places", &format!("4096 {key}")).unwrap();
    }
    member.state(4, ("colours", "sky"), &colors, 1.0, &[0; 8]).unwrap();
    assert!(member.interface(FactTable::<Color>::DESCRIPTOR.hash).is_some());
}

#[test]
fn peer_is_member_until_it_is_silent() {
    let mut team = [Member::new("a", 1, None).unwrap(), Member::new("b", 2, None).unwrap()];
    let layout = Layout::of(FactTable::<Place>::DESCRIPTOR).unwrap();
    team[1].add_neighbor("a").unwrap();
    team[1].state(1, ("places", "here"), &layout, 1.0, &[0; 8]).unwrap();
    // It was said to be gone, after it had come.
    team[0].add_neighbor("b").unwrap();
    team[0].remove_neighbor("b");
    rounds(&mut team, 3);
    assert_eq!((team[0].neighbors(), team[1].neighbors()), (1, 1));
    assert!(team[0].known().contains_key("places"));
    // What came last of one that is really gone.
    team[1].tick();
    let (_, last) = team[1].outgoing().unwrap();
    team[0].remove_neighbor("b");
    team[0].receive("b", &last).unwrap();
    let mut told = 0;
    for _ in 0..1000 {
        team[0].tick();
        told += std::iter::from_fn(|| team[0].outgoing().map(drop)).count();
    }
    assert_eq!(team[0].neighbors(), 0);
    assert!(told < 30, "it is not tried again: {told}");
}

#[test]
fn a_file_that_cant_be_read_is_kept() {
    let folder = std::env::temp_dir().join(format!("slate-kept-{}", std::process::id()));
    let member = Member::new("a", 1, None).unwrap();
    let mut saved = SavedKnowledge::new(&folder, "a");
    // A folder can't be read as a file.
    std::fs::create_dir_all(saved.file()).unwrap();
    std::fs::write(saved.file().join("memory"), "dear").unwrap();
    let aside = saved.file().with_extension("knowledge.damaged");
    let (restored, trouble) = saved.restore("a", 2);
    assert!(restored.is_some());
    let trouble = trouble.unwrap();
    assert!(trouble.contains("set aside"), "{trouble}");
    assert_eq!(std::fs::read_to_string(aside.join("memory")).unwrap(), "dear");
    saved.save(&member).unwrap();
    // What can't be set aside stays, and nothing takes its place.
    std::fs::write(saved.file(), "damaged").unwrap();
    assert!(saved.restore("a", 3).1.unwrap().contains("can't be set aside"));
    assert!(saved.save(&member).is_err());
    assert_eq!(std::fs::read_to_string(saved.file()).unwrap(), "damaged");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn another_robots_file_is_set_aside() {
    let folder = std::env::temp_dir().join(format!("slate-told-{}", std::process::id()));
    let mut member = Member::new("a", 1, None).unwrap();
    let layout = Layout::of(FactTable::<Place>::DESCRIPTOR).unwrap();
    member.state(1, ("places", "here"), &layout, 1.0, &1.0_f64.to_ne_bytes()).unwrap();
    let (mut a, mut b) = (SavedKnowledge::new(&folder, "a"), SavedKnowledge::new(&folder, "b"));
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

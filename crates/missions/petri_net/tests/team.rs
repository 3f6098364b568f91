//! Plans of several robots: their parts, and how the robots agree.

use std::collections::BTreeMap;

use proptest::prelude::*;
use slate_petri_net::{
    ActionEvent, ActionProgress, CheckLimits, ConflictOrder, FindingKind, JointNet, NetGuard, PetriNet,
    PetriNetExecutor, PetriPlan, PlanAction, PlanHost, PlanTransition, RobotStatement, SynchronizationEntry,
    Synchronizer, check_joint,
};

use crate::common::{Script, net};

const SECOND: u64 = 1_000_000_000;
const TIMEOUT: u64 = SECOND;
const PERIOD: u64 = SECOND / 50;

/// What a robot states.
type Statement = (RobotStatement, Vec<(String, SynchronizationEntry)>);

/// A robot that executes its part.
struct Robot {
    name: String,
    executor: PetriNetExecutor,
    synchronizer: Synchronizer,
    script: Script,
    error: Option<String>,
    /// Identifiers of the transitions that have fired.
    fired: Vec<String>,
}

struct TeamHost<'a>(&'a mut Script, &'a mut Synchronizer);

impl PlanHost for TeamHost<'_> {
    fn condition(&mut self, index: usize, name: &str) -> Option<bool> {
        let absent = name.strip_prefix("absent_").and_then(|robot| self.1.is_absent(robot));
        absent.or_else(|| self.0.condition(index, name))
    }
    fn progress(&mut self, index: usize, action: &PlanAction) -> ActionProgress {
        self.0.progress(index, action)
    }
    fn permits(&mut self, transition: PlanTransition, holds: bool) -> bool {
        self.1.permits(transition.transition, holds)
    }
    fn control(&mut self, index: usize, action: &PlanAction, event: ActionEvent) {
        self.0.control(index, action, event);
    }
}

impl Robot {
    fn new(net: &PetriNet, name: &str, now: u64) -> Self {
        let part = JointNet::new(net).unwrap().unwrap().robot(name).unwrap();
        let plan = PetriPlan::new(part.net.clone(), |_| Ok(None)).unwrap();
        Self {
            name: name.into(),
            executor: PetriNetExecutor::new(plan.into(), ConflictOrder::File),
            synchronizer: Synchronizer::new(&part, name, now),
            script: Script::default(),
            error: None,
            fired: Vec::new(),
        }
    }

    /// Another process that continues from a snapshot.
    fn resumed(&self, net: &PetriNet) -> Self {
        let mut other = Self::new(net, &self.name, 77);
        let plan = other.executor.plan().clone();
        other.executor =
            PetriNetExecutor::restore(plan, ConflictOrder::File, &self.executor.state()).unwrap();
        let text = serde_json::to_string(&self.synchronizer.state()).unwrap();
        other.synchronizer.restore(&serde_json::from_str(&text).unwrap()).unwrap();
        other.script.conditions = self.script.conditions.clone();
        other.script.progress = self.script.progress.clone();
        (other.fired, other.error) = (self.fired.clone(), self.error.clone());
        other
    }

    /// A run of the robot, which has heard these statements.
    fn run(&mut self, now: u64, heard: &BTreeMap<String, Statement>) {
        self.synchronizer.begin(now, TIMEOUT);
        for (robot, (statement, entries)) in heard.iter().filter(|(robot, _)| **robot != self.name) {
            let entries = entries.iter().map(|(id, entry)| (id.as_str(), *entry));
            self.synchronizer.receive(robot, *statement, entries);
        }
        if self.error.is_none() {
            self.error = self.synchronizer.decide().err().map(|error| error.to_string());
        }
        while self.error.is_none() {
            self.synchronizer.begin_step();
            self.executor.step(&mut TeamHost(&mut self.script, &mut self.synchronizer)).unwrap();
            for fired in self.executor.fired() {
                self.synchronizer.fired(fired.transition);
                self.fired.push(self.executor.plan().net().transitions()[fired.transition].id.clone());
            }
            if self.executor.fired().is_empty() {
                break;
            }
        }
        let has_ended = self.error.is_some() || self.executor.progress() != ActionProgress::Running;
        let (net, marking) = (self.executor.plan().net(), self.executor.marking(0));
        self.synchronizer.end(net, marking, has_ended);
    }

    fn statement(&self) -> Statement {
        let entries = self.synchronizer.entries().map(|(id, entry)| (id.to_owned(), entry));
        (self.synchronizer.statement(), entries.collect())
    }

    fn marking(&self) -> String {
        self.executor.plan().net().marking_text(self.executor.marking(0))
    }
}

/// Robots in lockstep that hear each other's statements of the run before.
struct Team {
    robots: Vec<Robot>,
    heard: BTreeMap<String, Statement>,
    now: u64,
}

impl Team {
    fn new(net: &PetriNet, names: &[&str]) -> Self {
        let robots = names.iter().map(|name| Robot::new(net, name, SECOND)).collect();
        let mut team = Self { robots, heard: BTreeMap::new(), now: SECOND };
        team.run(1);
        team
    }

    /// Runs until the second robot has promised to follow the first one.
    fn run_to_promise(&mut self) {
        let is_bound = |team: &Self| team.robots[1].statement().1[0].1.open > 0;
        for _ in 0..10 {
            if is_bound(self) {
                return;
            }
            self.run(1);
        }
        assert!(is_bound(self), "no promise");
    }

    fn run(&mut self, runs: usize) {
        for _ in 0..runs {
            self.now += PERIOD;
            self.robots.iter_mut().for_each(|robot| robot.run(self.now, &self.heard));
            for robot in &self.robots {
                self.heard.insert(robot.name.clone(), robot.statement());
            }
        }
    }

    fn markings(&self) -> Vec<String> {
        self.robots.iter().map(Robot::marking).collect()
    }
}

/// Both work, meet, and reach their goals; a waiting robot gives up when the other one is absent.
fn meeting() -> PetriNet {
    net(
        "meeting",
        &[
            ("work@r1.exec", 1),
            ("work@r2.exec", 1),
            ("waiting @r1", 0),
            ("waiting @r2", 0),
            ("lift@r1.exec", 0),
            ("lift@r2.exec", 0),
            ("goal @r1", 0),
            ("goal @r2", 0),
            ("fail @r1", 0),
            ("fail @r2", 0),
        ],
        &[
            ("work@r1.end", &[0], &[2]),
            ("work@r2.end", &[1], &[3]),
            ("meet [free@r2]", &[2, 3], &[4, 5]),
            ("*.end", &[4], &[6]),
            ("*.end", &[5], &[7]),
            ("[absent_r2]", &[2], &[8]),
            ("[or absent_r1 tired]", &[3], &[9]),
        ],
    )
}

/// The first robot passes a door, then the second.
fn door() -> PetriNet {
    net(
        "door",
        &[
            ("pass@r1.exec", 1),
            ("goal @r1", 0),
            ("waiting @r2", 1),
            ("free @r2", 0),
            ("pass@r2.exec", 0),
            ("goal @r2", 0),
            ("fail @r2", 0),
        ],
        &[
            ("pass@r1.end", &[0], &[1, 3]),
            ("*.start", &[2, 3], &[4]),
            ("*.end", &[4], &[5]),
            ("[and absent_r1 late]", &[2], &[6]),
        ],
    )
}

fn error(net: &PetriNet) -> String {
    JointNet::new(net).unwrap_err().to_string()
}

#[test]
fn a_joint_plan_is_split_into_the_parts_of_its_robots() {
    let joint = JointNet::new(&meeting()).unwrap().unwrap();
    assert_eq!(joint.robots(), ["r1", "r2"]);
    assert_eq!((joint.firing(0), joint.firing(2)), (&[0][..], &[0, 1][..]));
    let (first, second) = (joint.robot("r1").unwrap(), joint.robot("r2").unwrap());
    assert_eq!(first.net.actions(), ["work", "lift"]);
    assert_eq!(first.net.places()[0].name, "work.exec");
    assert_eq!(first.net.conditions(), ["absent_r2"]);
    assert_eq!(second.net.conditions(), ["free", "absent_r1", "tired"]);
    let meet = &first.hard[0];
    assert_eq!((meet.id.as_str(), meet.robots.clone()), ("t3", vec!["r1".to_owned(), "r2".to_owned()]));
    assert_eq!(first.net.transitions()[meet.transition].guard, None, "r2 looks whether it is free");
    let guard = &second.net.transitions()[second.hard[0].transition].guard;
    assert!(matches!(guard, Some(NetGuard::Condition(0))), "{guard:?}");
    assert_eq!(joint.robot("r3"), None);
    assert_eq!(JointNet::new(&net("alone", &[("go.exec", 1)], &[])), Ok(None));
}

#[test]
fn tokens_for_another_robot_are_sent_and_received() {
    let joint = JointNet::new(&door()).unwrap().unwrap();
    let (first, second) = (joint.robot("r1").unwrap(), joint.robot("r2").unwrap());
    assert_eq!((first.sent, first.received.len()), (vec![(0, "t1>".into())], 0));
    let received = &second.received[0];
    assert_eq!((received.id.as_str(), received.robot.as_str()), ("t1>", "r1"));
    let transition = &second.net.transitions()[received.transition];
    assert!(transition.inputs.is_empty());
    assert_eq!(transition.outputs, [(1, 1)], "the place `free`");
}

#[test]
fn joint_plan_that_cannot_be_split_is_refused() {
    let ends = ("goal @r2", 0);
    let free = error(&net("n", &[("go@r1.exec", 1), ("nowhere", 0)], &[]));
    assert!(free.contains("place `p2` (`nowhere`) belongs to no robot"), "{free}");
    let both = error(&net("n", &[("go@r1.exec @r2", 1)], &[]));
    assert!(both.contains("place `p1` belongs to one robot, found `r2` and `r1`"), "{both}");
    let source = error(&net("n", &[("go@r1.exec", 1)], &[("", &[], &[0])]));
    assert!(source.contains("transition t1 has no place before it"), "{source}");
    let event = error(&net("n", &[("go@r1.exec", 1), ends], &[("go@r2.end", &[0], &[1])]));
    assert!(event.contains("transition t1 (go@r2.end) is not fired by `r2`"), "{event}");
    let seen = error(&net("n", &[("go@r1.exec", 1), ends], &[("[x@r2]", &[0], &[1])]));
    assert!(seen.contains("`r1` does not know what `r2` sees"), "{seen}");
    let mixed = net("n", &[("@r1", 1), ("@r2", 1)], &[("[or x@r1 y@r2]", &[0, 1], &[])]);
    assert!(error(&mixed).contains("expected parts of several robots that `and` joins"));
    assert!(error(&net("n", &[("go@.exec", 1)], &[])).contains("expected the name of a robot"));
}

#[test]
fn robots_fire_a_hard_synchronization_together() {
    let mut team = Team::new(&meeting(), &["r1", "r2"]);
    team.robots[0].script.end("work", ActionProgress::Succeeded);
    team.run(20);
    assert_eq!(team.markings(), ["waiting @r1", "work.exec"].map(|text| text.replace(" @r1", "")));
    team.robots[1].script.end("work", ActionProgress::Succeeded);
    team.run(10);
    assert_eq!(team.markings(), ["waiting", "waiting"], "it is unknown whether r2 is free");
    team.robots[1].script.set("free", true);
    team.run(5);
    assert_eq!(team.markings(), ["lift.exec", "lift.exec"]);
    assert_eq!(team.robots[0].script.orders(), ["start work", "end work", "start lift"]);
    team.robots.iter_mut().for_each(|robot| robot.script.end("lift", ActionProgress::Succeeded));
    team.run(2);
    assert_eq!(team.markings(), ["goal", "goal"]);
}

#[test]
fn a_robot_waits_until_the_other_one_has_passed() {
    let mut team = Team::new(&door(), &["r1", "r2"]);
    team.run(100);
    assert_eq!(team.markings(), ["pass.exec", "waiting"]);
    team.robots[0].script.end("pass", ActionProgress::Succeeded);
    team.run(2);
    assert_eq!(team.markings(), ["goal", "pass.exec"], "the token comes though its sender has ended");
    team.run(100);
    assert_eq!(team.robots[1].fired.iter().filter(|id| *id == "t1").count(), 1, "and comes once");
}

#[test]
fn robot_waiting_for_absent_partner_takes_alternative() {
    let mut team = Team::new(&meeting(), &["r1", "r2"]);
    team.robots[0].script.end("work", ActionProgress::Succeeded);
    team.run(10);
    team.robots.truncate(1);
    let runs = usize::try_from(TIMEOUT / PERIOD).unwrap();
    team.run(runs - 10);
    assert_eq!(team.markings(), ["waiting"]);
    team.run(12);
    assert_eq!(team.markings(), ["fail"]);
    // One that has ended is absent at once.
    let mut team = Team::new(&meeting(), &["r1", "r2"]);
    team.robots.iter_mut().for_each(|robot| robot.script.end("work", ActionProgress::Succeeded));
    team.robots[1].script.set("tired", true);
    team.run(3);
    assert_eq!(team.markings(), ["fail", "fail"]);
}

#[test]
fn a_restored_robot_goes_on_in_the_middle_of_an_agreement() {
    let plan = meeting();
    for moment in 0..12 {
        let mut team = Team::new(&plan, &["r1", "r2"]);
        team.robots.iter_mut().for_each(|robot| robot.script.end("work", ActionProgress::Succeeded));
        team.robots[1].script.set("free", true);
        team.run(moment);
        let mut other = Team { robots: Vec::new(), heard: team.heard.clone(), now: team.now };
        other.robots = team.robots.iter().map(|robot| robot.resumed(&plan)).collect();
        for _ in 0..12 {
            team.run(1);
            other.run(1);
            assert_eq!(other.heard, team.heard, "resumed after {moment} runs");
        }
        assert_eq!(other.markings(), ["lift.exec", "lift.exec"]);
    }
}

#[test]
fn a_plan_without_what_a_robot_has_promised_is_refused() {
    let plan = meeting();
    let mut team = Team::new(&plan, &["r1", "r2"]);
    team.robots.iter_mut().for_each(|robot| robot.script.end("work", ActionProgress::Succeeded));
    team.robots[1].script.set("free", true);
    team.run_to_promise();
    let part = JointNet::new(&door()).unwrap().unwrap().robot("r2").unwrap();
    let mut changed = Synchronizer::new(&part, "r2", 0);
    let reason = changed.restore(&team.robots[1].synchronizer.state()).unwrap_err();
    assert_eq!(reason, "the plan lacks the transition `t3`, which others wait for");
}

#[test]
fn a_deciding_robot_that_is_silent_leaves_no_half_decision() {
    let plan = meeting();
    let mut team = Team::new(&plan, &["r1", "r2"]);
    team.robots.iter_mut().for_each(|robot| robot.script.end("work", ActionProgress::Succeeded));
    team.robots[1].script.set("free", true);
    team.run_to_promise();
    // r1 is heard no more, whatever it does now.
    let heard = team.heard.clone();
    let mut decider = team.robots.remove(0);
    for _ in 0..60 {
        team.now += PERIOD;
        team.robots[0].run(team.now, &heard);
    }
    let error = team.robots[0].error.clone().unwrap();
    assert!(error.starts_with("`r1` is not heard since it was to decide about `t3`"), "{error}");
    assert_eq!(team.markings(), ["waiting"], "neither way was taken");
    // r1 fires by the promise, and hears later that it was not followed.
    let promised = BTreeMap::from([("r2".to_owned(), heard_of(&team.robots[0], false))]);
    decider.run(team.now, &promised);
    assert_eq!(decider.marking(), "lift.exec");
    decider.run(team.now + PERIOD, &BTreeMap::from([("r2".to_owned(), heard_of(&team.robots[0], true))]));
    assert_eq!(
        decider.error.as_deref(),
        Some("`r2` has ended its plan and not followed `t3`: start the plans again")
    );
}

fn heard_of(robot: &Robot, has_ended: bool) -> Statement {
    let (statement, entries) = robot.statement();
    (RobotStatement { has_ended, ..statement }, entries)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]

    /// Statements come late or not at all, robots stand still for a while or vanish, and give up when they are tired.
    #[test]
    fn a_synchronization_is_fired_by_all_or_by_none(
        runs in proptest::collection::vec((0usize..3, 0usize..6, any::<bool>(), any::<bool>()), 150),
        killed in proptest::option::of((0usize..3, 0usize..80)),
        tired in 0usize..120,
    ) {
        let plan = rendezvous();
        let mut team: Vec<Robot> = ["r1", "r2", "r3"].map(|name| Robot::new(&plan, name, SECOND)).into();
        for robot in &mut team {
            robot.run(SECOND, &BTreeMap::new());
            robot.script.end("work", ActionProgress::Succeeded);
        }
        // What each robot has heard of each other one: late, but never older than before.
        let mut heard: Vec<BTreeMap<String, Statement>> = vec![BTreeMap::new(); 3];
        let mut now = SECOND;
        for (number, (robot, listener, hears, stands)) in runs.into_iter().enumerate() {
            now += PERIOD;
            for index in 0..3 {
                let is_dead = killed.is_some_and(|(dead, time)| dead == index && number >= time);
                if is_dead || stands && index == robot {
                    continue;
                }
                team[index].script.set("tired", number >= tired);
                team[index].run(now, &heard[index]);
            }
            if hears {
                let statement = team[robot].statement();
                let name = team[robot].name.clone();
                let is_dead = killed.is_some_and(|(dead, time)| dead == robot && number >= time);
                if !is_dead {
                    heard[listener % 3].insert(name, statement);
                }
            }
        }
        let met = |robot: &Robot| robot.fired.iter().any(|id| id == "t4");
        let left = |robot: &Robot| robot.fired.iter().any(|id| ["t5", "t6", "t7"].contains(&id.as_str()));
        let any_met = team.iter().any(met);
        for robot in &team {
            prop_assert!(!(met(robot) && left(robot)));
            prop_assert!(!(any_met && left(robot)), "{} left, and others met: {:?}", robot.name, robot.fired);
        }
    }
}

/// Three robots that meet, each of which may leave before.
fn rendezvous() -> PetriNet {
    net(
        "rendezvous",
        &[
            ("work@r1.exec", 1),
            ("work@r2.exec", 1),
            ("work@r3.exec", 1),
            ("waiting @r1", 0),
            ("waiting @r2", 0),
            ("waiting @r3", 0),
            ("goal @r1", 0),
            ("goal @r2", 0),
            ("goal @r3", 0),
            ("fail @r1", 0),
            ("fail @r2", 0),
            ("fail @r3", 0),
        ],
        &[
            ("*.end", &[0], &[3]),
            ("*.end", &[1], &[4]),
            ("*.end", &[2], &[5]),
            ("meet", &[3, 4, 5], &[6, 7, 8]),
            ("[or tired absent_r2 absent_r3]", &[3], &[9]),
            ("[or tired absent_r1 absent_r3]", &[4], &[10]),
            ("[or tired absent_r1 absent_r2]", &[5], &[11]),
        ],
    )
}

#[test]
fn a_deadlock_across_robots_has_the_way_to_it() {
    let joint = |net: &PetriNet| JointNet::new(net).unwrap().unwrap();
    let sound = check_joint(&joint(&meeting()), &CheckLimits::default());
    assert!(sound.is_sound() && sound.findings.is_empty(), "{sound:?}");
    // r1 may go home alone, and r2 waits for it.
    let stuck = net(
        "stuck",
        &[("start @r1", 1), ("waiting @r2", 1), ("goal @r1", 0), ("goal @r2", 0)],
        &[("meet", &[0, 1], &[2, 3]), ("[tired]", &[0], &[2])],
    );
    let report = check_joint(&joint(&stuck), &CheckLimits::default());
    let found: Vec<_> = report.findings.iter().map(|one| (one.kind, one.text.as_str())).collect();
    assert_eq!(found[0].0, FindingKind::Deadlock);
    assert_eq!(found[0].1, "no transition of r2 is enabled in the marking waiting @r2, goal @r1");
    assert_eq!(report.findings[0].path.as_ref().unwrap().transitions, [1]);
    assert_eq!(found[1].0, FindingKind::Dependent);
    assert!(found[1].1.starts_with("r2 waits for others with waiting @r2, forever if they are absent"));
    // A robot at its goal fires no more: r1 never meets.
    let over =
        net("over", &[("goal @r1", 1), ("waiting @r2", 1), ("goal @r2", 0)], &[("meet", &[0, 1], &[2])]);
    let report = check_joint(&joint(&over), &CheckLimits::default());
    let kinds: Vec<_> = report.findings.iter().map(|one| one.kind).collect();
    assert!(kinds.contains(&FindingKind::Deadlock) && kinds.contains(&FindingKind::UnreachableGoal));
}

//! The Plans of two robots that follow one net.

use slate_executive::petri_net_plan::{MissionStatus, PetriNetPlan, PetriNetPlanParams};
use slate_executive::team::MissionStatement;
use slate_petri_net::{NetBuilder, PetriNet, write_pnml};
use slate_plugin::interfaces::{FactHead, MissionState, Verdict};
use slate_plugin::mapek::{Ending, FactTable, PlanBlock};
use slate_plugin::module::Text;
use slate_plugin::module::testing::Fixture;

use crate::common::{sent, status};

type Planning = Fixture<PlanBlock<PetriNetPlan>>;

/// r1 goes, then both lift at once; a robot that is alone looks for help.
fn lift() -> PetriNet {
    let mut net = NetBuilder::new("lift");
    let going = net.place("Go_1@r1.exec", 1);
    let waiting = [net.place("waiting @r1", 0), net.place("waiting @r2", 1)];
    let lifting = [net.place("Lift@r1.exec", 0), net.place("Lift@r2.exec", 0)];
    let goals = [net.place("goal @r1", 0), net.place("goal @r2", 0)];
    let looking = [net.place("Look@r1.exec", 0), net.place("Look@r2.exec", 0)];
    net.transition("*.end", &[(going, 1)], &[(waiting[0], 1)]);
    let both = |places: [usize; 2]| places.map(|place| (place, 1));
    net.transition("*.start", &both(waiting), &both(lifting));
    for (robot, other) in [(0, "r2"), (1, "r1")] {
        net.transition("*.end", &[(lifting[robot], 1)], &[(goals[robot], 1)]);
        let alone = format!("*.start [absent_{other}]");
        net.transition(&alone, &[(waiting[robot], 1)], &[(looking[robot], 1)]);
    }
    net.finish().unwrap()
}

fn file(name: &str, net: &PetriNet) -> Text<252> {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("team-plan");
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join(format!("{name}.pnml"));
    std::fs::write(&file, write_pnml(net)).unwrap();
    Text::new(file.to_str().unwrap())
}

fn planning(plan_filename: Text<252>, robot: &str) -> Planning {
    let robot = Text::new(robot);
    Planning::with(PetriNetPlanParams { plan_filename, robot, ..PetriNetPlanParams::default() }).unwrap()
}

/// Two robots that hear each other's statements of the run before.
struct Pair {
    robots: [Planning; 2],
    stated: [Option<MissionStatement>; 2],
    markings: [String; 2],
    verdicts: [MissionState; 2],
}

impl Pair {
    fn new(plan: Text<252>) -> Self {
        Self {
            robots: ["r1", "r2"].map(|robot| planning(plan, robot)),
            stated: [None; 2],
            markings: [const { String::new() }; 2],
            verdicts: [MissionState::RUNNING; 2],
        }
    }

    /// Another process that continues from a snapshot after so many runs.
    fn resumed(&self, plan: Text<252>, runs: u64) -> Self {
        let mut other = Self::new(plan);
        for (robot, own) in other.robots.iter_mut().zip(&self.robots) {
            robot.restore(&own.save().unwrap()).unwrap();
            robot.advance(runs * 20_000_000);
        }
        (other.stated, other.markings) = (self.stated, self.markings.clone());
        other
    }

    /// Both run once; returns what their Plans send.
    fn run(&mut self) -> [Vec<String>; 2] {
        let heard = self.stated;
        [0, 1].map(|index| {
            let robot = &mut self.robots[index];
            if let Some(statement) = heard[1 - index] {
                robot.write::<FactTable<MissionStatement>>("partners", 1, |table| {
                    table.facts[0].head =
                        FactHead { key: Text::new(["r2", "r1"][index]), ..FactHead::default() };
                    table.facts[0].value = statement;
                });
            }
            let sent = sent(robot);
            let stated = robot.read::<FactTable<MissionStatement>, _>("claims", |table| table.facts[0].value);
            self.stated[index] = stated.or(self.stated[index]);
            if let Some(mission) = robot.output::<MissionStatus>("mission") {
                mission.marking.as_str().clone_into(&mut self.markings[index]);
            }
            if let Some(verdict) = robot.output::<Verdict>("verdict") {
                self.verdicts[index] = verdict.state;
            }
            sent
        })
    }

    fn ends(&mut self, robot: usize, number: u64) {
        self.robots[robot].set("situation", status(number, number, Some(Ending::COMPLETED)));
    }
}

#[test]
fn two_plans_start_an_action_at_once_after_they_agree() {
    let mut pair = Pair::new(file("lift", &lift()));
    assert_eq!(pair.run(), [vec!["Go 1"], vec![]]);
    pair.robots[0].set("situation", status(0, 1, None));
    for _ in 0..20 {
        assert_eq!(pair.run(), [Vec::<String>::new(), Vec::new()]);
    }
    pair.ends(0, 1);
    let started: Vec<_> = (0..6).map(|_| pair.run()).collect();
    let first = |robot: usize| started.iter().position(|sent| sent[robot] == ["Lift"]).unwrap();
    assert_eq!(first(1), first(0) + 1, "r2 hears the decision a run later: {started:?}");
    assert_eq!(pair.markings, ["Lift.exec", "Lift.exec"]);
    pair.ends(0, 2);
    pair.ends(1, 1);
    pair.run();
    assert_eq!(pair.verdicts, [MissionState::SUCCEEDED; 2]);
}

#[test]
fn a_robot_whose_partner_was_killed_takes_its_way_out() {
    let mut pair = Pair::new(file("killed", &lift()));
    pair.run();
    pair.run();
    let [_, second] = &mut pair.robots;
    // 3 s without r1.
    let alone: Vec<_> = (0..160).map(|_| sent(second)).collect();
    let moment = alone.iter().position(|sent| *sent == ["Look"]).unwrap();
    assert!((145..=155).contains(&moment), "{moment}");
}

#[test]
fn plans_resumed_in_the_middle_of_an_agreement_go_on() {
    let plan = file("resumed", &lift());
    for moment in 0..6 {
        let mut pair = Pair::new(plan);
        pair.run();
        pair.robots[0].set("situation", status(0, 1, None));
        // Some beats, so that a statement depends on the time.
        (0..40).for_each(|_| drop(pair.run()));
        pair.ends(0, 1);
        (0..moment).for_each(|_| drop(pair.run()));
        let mut other = pair.resumed(plan, moment + 41);
        for pair in [&mut pair, &mut other] {
            pair.ends(0, 1);
            (0..6).for_each(|_| drop(pair.run()));
        }
        let states = |pair: &Pair| pair.robots.each_ref().map(|robot| robot.save().unwrap());
        assert_eq!(states(&other), states(&pair), "resumed after {moment} runs");
        assert_eq!(other.stated, pair.stated);
        assert_eq!(other.markings, ["Lift.exec", "Lift.exec"]);
    }
}

#[test]
fn a_plan_of_several_robots_needs_the_name_of_one() {
    let plan = file("names", &lift());
    let reason = |robot: &str| {
        let mut plan = planning(plan, robot);
        sent(&mut plan);
        plan.output::<Verdict>("verdict").unwrap().reason.as_str().to_owned()
    };
    for robot in ["", "r3"] {
        let reason = reason(robot);
        assert!(reason.starts_with("names.pnml: the plan is for the robots `r1`"), "{reason}");
    }
}

//! Defects of a plan of several robots, found before it runs.

use super::check::{
    CheckLimits, FindingKind, NetFinding, NetReport, conflicts, dead_transitions, finding, growth, labels,
    unsafe_places,
};
use super::space::{StateSpace, explore};
use crate::joint::JointNet;
use crate::net::{NetPlace, PetriNet};

/// Checks a plan of several robots, without their sub-plans.
///
/// A robot whose part has reached its goal or failed fires no more, while others continue. Guards are ignored, as by
/// [`check_net`](crate::check_net); that a robot vanishes is found as a dependence on others.
pub fn check_joint(joint: &JointNet, limits: &CheckLimits<'_>) -> NetReport {
    let net = joint.net();
    let may_fire = |marking: &[u32], transition: usize| {
        joint.firing(transition).iter().all(|robot| !has_ended(joint, *robot, marking))
    };
    let space = explore(net, limits.most_states, true, may_fire);
    let mut findings = Vec::new();
    labels(net, limits, &mut findings);
    growth(net, &space, &mut findings);
    deadlocks(joint, &space, &may_fire, &mut findings);
    goals(joint, &space, &mut findings);
    dependences(joint, &space, &mut findings);
    unsafe_places(net, &space, &mut findings);
    dead_transitions(net, &space, &mut findings);
    conflicts(net, &mut findings);
    findings.sort_by_key(|finding| finding.kind);
    NetReport { states: space.states(), is_complete: space.is_complete(), findings }
}

/// Returns the places of a robot, with their tokens.
fn own<'a>(
    joint: &'a JointNet,
    robot: usize,
    marking: &'a [u32],
) -> impl Iterator<Item = (&'a NetPlace, u32)> {
    let places = joint.net().places().iter().zip(marking).enumerate();
    places.filter(move |(place, _)| joint.owner(*place) == robot).map(|(_, (place, tokens))| (place, *tokens))
}

/// Returns true if each counting place of a robot has its tokens.
/// At least one must count.
fn fits(joint: &JointNet, robot: usize, marking: &[u32], count: impl Fn(&NetPlace) -> Option<u32>) -> bool {
    let mut counts = own(joint, robot, marking).filter_map(|(place, tokens)| Some(count(place)? == tokens));
    counts.next().is_some_and(|first| first && counts.all(|fits| fits))
}

fn is_at_goal(joint: &JointNet, robot: usize, marking: &[u32]) -> bool {
    fits(joint, robot, marking, |place| place.goal)
}

fn has_ended(joint: &JointNet, robot: usize, marking: &[u32]) -> bool {
    is_at_goal(joint, robot, marking) || fits(joint, robot, marking, |place| place.fail)
}

/// Places of a robot that have tokens.
fn marking_text(joint: &JointNet, robot: usize, marking: &[u32]) -> String {
    let alone: Vec<u32> = marking
        .iter()
        .enumerate()
        .map(|(place, tokens)| if joint.owner(place) == robot { *tokens } else { 0 })
        .collect();
    joint.net().marking_text(&alone)
}

/// Finds robots in a deadlock, whatever the others do.
fn deadlocks(
    joint: &JointNet,
    space: &StateSpace,
    may_fire: &impl Fn(&[u32], usize) -> bool,
    findings: &mut Vec<NetFinding>,
) {
    let net: &PetriNet = joint.net();
    let stands_still = |state: &usize| {
        let marking = space.marking(*state);
        let fires = |(index, transition): (usize, &crate::net::NetTransition)| {
            transition.is_enabled(marking) && may_fire(marking, index)
        };
        let is_over = (0..joint.robots().len()).all(|robot| has_ended(joint, robot, marking));
        !is_over && !net.transitions().iter().enumerate().any(fires)
    };
    let mut states = (0..space.states()).filter(stands_still);
    let Some(first) = states.next() else { return };
    let marking = space.marking(first);
    let waiting: Vec<&str> = joint
        .robots()
        .iter()
        .enumerate()
        .filter(|(robot, _)| !has_ended(joint, *robot, marking))
        .map(|(_, name)| name.as_str())
        .collect();
    let others = match states.count() {
        0 => String::new(),
        count => format!(", and {count} more such markings"),
    };
    let text = format!(
        "no transition of {} is enabled in the marking {}{others}",
        waiting.join(" and "),
        net.marking_text(marking)
    );
    findings.push(finding(FindingKind::Deadlock, text, Some(space.path(first))));
}

/// Robots that never reach their goal, or have none.
fn goals(joint: &JointNet, space: &StateSpace, findings: &mut Vec<NetFinding>) {
    for (robot, name) in joint.robots().iter().enumerate() {
        let places = joint.net().places().iter().enumerate();
        let mut own = places.filter(|(place, _)| joint.owner(*place) == robot);
        if !own.any(|(_, place)| place.goal.is_some()) {
            let text = format!("{name} has no place `goal`: its part runs until it is stopped");
            findings.push(finding(FindingKind::NoGoal, text, None));
        } else if space.is_complete()
            && !(0..space.states()).any(|state| is_at_goal(joint, robot, space.marking(state)))
        {
            let text = format!("no marking that can be reached is the goal of {name}");
            findings.push(finding(FindingKind::UnreachableGoal, text, None));
        }
    }
}

/// Finds robots that wait for ever when the others vanish.
/// No transition of their own has its tokens.
fn dependences(joint: &JointNet, space: &StateSpace, findings: &mut Vec<NetFinding>) {
    for (robot, name) in joint.robots().iter().enumerate() {
        let depends = |state: &usize| {
            let marking = space.marking(*state);
            let is_own = |(index, transition): (usize, &crate::net::NetTransition)| {
                joint.firing(index) == [robot] && transition.is_enabled(marking)
            };
            !has_ended(joint, robot, marking) && !joint.net().transitions().iter().enumerate().any(is_own)
        };
        let Some(first) = (0..space.states()).find(depends) else { continue };
        let text = format!(
            "{name} waits for others with {}, forever if they are absent: add a transition with a guard such as `[absent_...]`",
            marking_text(joint, robot, space.marking(first))
        );
        findings.push(finding(FindingKind::Dependent, text, Some(space.path(first))));
    }
}

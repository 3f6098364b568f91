//! Defects of a net, found before it runs.

use super::space::{FiringPath, StateSpace, state_space};
use crate::joint::split_robot;
use crate::label::action_name;
use crate::net::{NetTransition, PetriNet};

/// Assumptions and limits of a check.
#[derive(Clone, Copy)]
pub struct CheckLimits<'a> {
    /// Maximum number of markings that are explored.
    pub most_states: usize,
    /// Predicate of known actions, by name or with their arguments.
    /// `None` if every action is known.
    pub is_known_action: Option<&'a dyn Fn(&str) -> bool>,
}

impl Default for CheckLimits<'_> {
    fn default() -> Self {
        Self { most_states: 100_000, is_known_action: None }
    }
}

/// Kind of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum FindingKind {
    /// Tokens of a place grow without bound.
    Unbounded,
    /// Deadlock without goal or failure.
    Deadlock,
    /// Goal that no reachable marking satisfies.
    UnreachableGoal,
    /// Action that the robot does not have.
    UnknownAction,
    /// Wait that only other robots can end.
    Dependent,
    /// Place that can have more than one token.
    Unsafe,
    /// Transition that is never enabled.
    DeadTransition,
    /// Transition whose tokens another one without a guard takes first.
    Conflict,
    /// Plan without a goal: it runs until it is stopped.
    NoGoal,
    /// Word in a label that is neither an event nor a guard, and so has no effect.
    UnknownLabel,
    /// Exploration that ended before all markings were seen.
    Unfinished,
}

impl FindingKind {
    /// Returns whether the plan can't work.
    pub fn is_error(self) -> bool {
        matches!(self, Self::Unbounded | Self::Deadlock | Self::UnreachableGoal | Self::UnknownAction)
    }

    /// Returns the name, such as `dead transition`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Unbounded => "unbounded",
            Self::Deadlock => "deadlock",
            Self::UnreachableGoal => "unreachable goal",
            Self::UnknownAction => "unknown action",
            Self::Dependent => "dependent",
            Self::Unsafe => "not 1-safe",
            Self::DeadTransition => "dead transition",
            Self::Conflict => "conflict",
            Self::NoGoal => "no goal",
            Self::UnknownLabel => "unknown label",
            Self::Unfinished => "unfinished",
        }
    }
}

/// Finding about a net.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NetFinding {
    /// Kind.
    pub kind: FindingKind,
    /// Description of the finding, with the place or transition.
    pub text: String,
    /// Shortest firing sequence that leads to it.
    pub path: Option<FiringPath>,
}

/// Result of a check.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NetReport {
    /// Explored markings.
    pub states: usize,
    /// True if the list is complete.
    pub is_complete: bool,
    /// Findings, errors first.
    pub findings: Vec<NetFinding>,
}

impl NetReport {
    /// Returns whether no finding is an error, and all markings were explored.
    pub fn is_sound(&self) -> bool {
        self.is_complete && !self.findings.iter().any(|finding| finding.kind.is_error())
    }
}

/// Checks a net without its sub-plans, which are nets of their own.
///
/// Guards are ignored: each may hold or not. So a defect may need conditions that never come together, and a deadlock
/// that guards alone cause is missed.
pub fn check_net(net: &PetriNet, limits: &CheckLimits<'_>) -> NetReport {
    let space = state_space(net, limits.most_states, true);
    let mut findings = Vec::new();
    labels(net, limits, &mut findings);
    growth(net, &space, &mut findings);
    deadlocks(net, &space, &mut findings);
    goal(net, &space, &mut findings);
    unsafe_places(net, &space, &mut findings);
    dead_transitions(net, &space, &mut findings);
    conflicts(net, &mut findings);
    findings.sort_by_key(|finding| finding.kind);
    NetReport { states: space.states(), is_complete: space.is_complete(), findings }
}

pub(super) fn finding(kind: FindingKind, text: impl Into<String>, path: Option<FiringPath>) -> NetFinding {
    NetFinding { kind, text: text.into(), path }
}

pub(super) fn labels(net: &PetriNet, limits: &CheckLimits<'_>, findings: &mut Vec<NetFinding>) {
    if let Some(is_known) = limits.is_known_action {
        let texts = net.actions().iter().map(|text| split_robot(text).0);
        let unknown = texts.filter(|text| !is_known(text) && !is_known(action_name(text)));
        findings.extend(unknown.map(|text| {
            let text =
                format!("the robot has no action `{}`, which the plan calls `{text}`", action_name(text));
            finding(FindingKind::UnknownAction, text, None)
        }));
    }
    let words = |transition: &NetTransition| {
        let title = transition.title();
        transition.unknown.clone().into_iter().filter(|word| word.contains('.')).map(move |word| {
            let events = "start, end, fail, interrupt or resume";
            let text = format!("`{word}` of transition {title}: expected an event after the dot: {events}");
            finding(FindingKind::UnknownLabel, text, None)
        })
    };
    findings.extend(net.transitions().iter().flat_map(words));
    let has_dot = net.places().iter().filter(|place| {
        place.action.is_none() && place.goal.is_none() && place.fail.is_none() && place.name.contains('.')
    });
    findings.extend(has_dot.map(|place| {
        let text =
            format!("place {} `{}` runs no action: expected `exec` after the dot", place.id, place.name);
        finding(FindingKind::UnknownLabel, text, None)
    }));
}

pub(super) fn growth(net: &PetriNet, space: &StateSpace, findings: &mut Vec<NetFinding>) {
    if let Some(path) = space.growth() {
        let repeated = path.repeated.unwrap_or_default();
        let mut before = net.initial_marking();
        for transition in &path.transitions[..repeated] {
            // The path was explored, so no place overflows.
            let _ = net.transitions()[*transition].fire(&mut before, u32::MAX);
        }
        let grown = net.places().iter().zip(before.iter().zip(&path.marking));
        let grown = grown.filter(|(_, (before, after))| after > before).map(|(place, _)| place.title());
        let grown: Vec<&str> = grown.collect();
        let text = format!("the tokens of {} grow without bound", grown.join(", "));
        findings.push(finding(FindingKind::Unbounded, text, Some(path)));
    } else if !space.is_complete() {
        let text = format!(
            "more than {} markings: deadlocks, dead transitions and the goal may be beyond them",
            space.states()
        );
        findings.push(finding(FindingKind::Unfinished, text, None));
    }
}

fn deadlocks(net: &PetriNet, space: &StateSpace, findings: &mut Vec<NetFinding>) {
    let stands_still = |state: &usize| {
        let marking = space.marking(*state);
        !net.is_goal(marking)
            && !net.is_failure(marking)
            && !net.transitions().iter().any(|transition| transition.is_enabled(marking))
    };
    let mut states = (0..space.states()).filter(stands_still);
    if let Some(first) = states.next() {
        let others = match states.count() {
            0 => String::new(),
            count => format!(", and {count} more such markings"),
        };
        let text = format!(
            "no transition is enabled in the marking {}{others}",
            net.marking_text(space.marking(first))
        );
        findings.push(finding(FindingKind::Deadlock, text, Some(space.path(first))));
    }
}

fn goal(net: &PetriNet, space: &StateSpace, findings: &mut Vec<NetFinding>) {
    let goals: Vec<usize> =
        (0..net.places().len()).filter(|place| net.places()[*place].goal.is_some()).collect();
    let is_output = |place: &usize| {
        let mut outputs = net.transitions().iter().flat_map(|transition| &transition.outputs);
        outputs.any(|(output, _)| output == place)
    };
    if goals.is_empty() || !goals.iter().any(is_output) && !net.is_goal(&net.initial_marking()) {
        let text = "no transition leads to a place `goal`: the plan runs until it is stopped";
        findings.push(finding(FindingKind::NoGoal, text, None));
    } else if space.is_complete() && !(0..space.states()).any(|state| net.is_goal(space.marking(state))) {
        let wanted = goals.iter().map(|place| {
            let place = &net.places()[*place];
            format!("{} in `{}`", place.goal.unwrap_or_default(), place.title())
        });
        let wanted: Vec<String> = wanted.collect();
        let text = format!("no marking that can be reached has exactly {} tokens", wanted.join(" and "));
        findings.push(finding(FindingKind::UnreachableGoal, text, None));
    }
}

pub(super) fn unsafe_places(net: &PetriNet, space: &StateSpace, findings: &mut Vec<NetFinding>) {
    for (index, place) in net.places().iter().enumerate() {
        // A place that counts on purpose says so.
        let most = place.goal.unwrap_or(1).max(place.fail.unwrap_or(1)).max(1);
        if let Some(state) = (0..space.states()).find(|state| space.marking(*state)[index] > most) {
            let tokens = space.marking(state)[index];
            let text = format!("place `{}` can have {tokens} tokens", place.title());
            findings.push(finding(FindingKind::Unsafe, text, Some(space.path(state))));
        }
    }
}

pub(super) fn dead_transitions(net: &PetriNet, space: &StateSpace, findings: &mut Vec<NetFinding>) {
    if !space.is_complete() {
        return;
    }
    let mut fires = vec![false; net.transitions().len()];
    for (_, transition, _) in space.edges() {
        fires[*transition] = true;
    }
    for (transition, _) in net.transitions().iter().zip(&fires).filter(|(_, fires)| !**fires) {
        let inputs: Vec<&str> =
            transition.inputs.iter().map(|(place, _)| net.places()[*place].title()).collect();
        let text = format!("transition {} never has the tokens of {}", transition.title(), inputs.join(", "));
        findings.push(finding(FindingKind::DeadTransition, text, None));
    }
}

/// Finds transitions that never win in the order of the file.
/// Places have one token at most.
pub(super) fn conflicts(net: &PetriNet, findings: &mut Vec<NetFinding>) {
    let tokens = |transition: &NetTransition, place: usize| {
        let found = transition.inputs.iter().find(|(input, _)| *input == place);
        found.map_or(0, |(_, weight)| *weight)
    };
    for (index, later) in net.transitions().iter().enumerate() {
        let first = net.transitions()[..index].iter().find(|earlier| {
            earlier.guard.is_none()
                && !earlier.inputs.is_empty()
                && earlier.inputs.iter().all(|(place, weight)| tokens(later, *place) >= *weight)
        });
        if let Some(earlier) = first {
            let text = format!(
                "transition {} loses its tokens to {}, which has no guard and stands before it",
                later.title(),
                earlier.title()
            );
            findings.push(finding(FindingKind::Conflict, text, None));
        }
    }
}

//! View of a Petri Net Plan.
//! Places, transitions and arcs of the plan and of its sub-plans.

use std::fmt::Write;

use slate_petri_net::{
    ActionProgress, ActionQuery, NetGuard, NetPlace, PetriNet, PetriNetExecutor, PlanTransition,
};
use slate_plugin::prelude::Text;

use super::activity::{ActivityWriter, MissionItemStatus, MissionSight};
use super::drawing::{MissionDrawing, MissionElementKind, MissionMark};
use crate::activity_hash::ActivityHash;

/// Prefix of conditions about the time since the newest start of an action.
/// `elapsed_30`, in seconds.
pub const ELAPSED: &str = "elapsed_";

/// Returns whether a condition of a net holds; `None` while it is unknown.
pub fn condition(seen: &MissionSight<'_>, name: &str) -> Option<bool> {
    match name.strip_prefix(ELAPSED).and_then(|seconds| seconds.parse::<f64>().ok()) {
        Some(seconds) => Some(seen.actions.elapsed(seen.now) >= seconds),
        None => seen.conditions.get(name),
    }
}

/// Element of a net.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NetElement {
    /// Place with its action: run of a net, place.
    Place(usize, usize),
    /// Transition.
    Transition(PlanTransition),
    /// Net, or an arc.
    Other,
}

/// Returns the numbers of the first elements of each run of a net.
/// Its group, its places, and its transitions.
fn starts(executor: &PetriNetExecutor) -> impl Iterator<Item = (usize, [usize; 3])> {
    (0..executor.instances()).scan(0, |next, instance| {
        let net = executor.net(instance);
        let places = *next + 1;
        let transitions = places + net.places().len();
        let group = std::mem::replace(next, transitions + net.transitions().len());
        Some((instance, [group, places, transitions]))
    })
}

/// Returns the element of a number.
pub fn element(executor: &PetriNetExecutor, number: usize) -> NetElement {
    for (instance, [_, places, transitions]) in starts(executor) {
        let net = executor.net(instance);
        if (places..transitions).contains(&number) {
            return NetElement::Place(instance, number - places);
        }
        if (transitions..transitions + net.transitions().len()).contains(&number) {
            return NetElement::Transition(PlanTransition { instance, transition: number - transitions });
        }
    }
    NetElement::Other
}

/// Draws the nets.
pub fn draw(executor: &PetriNetExecutor) -> MissionDrawing {
    let mut drawing = MissionDrawing::new(executor.plan().net().name());
    for (instance, [group, ..]) in starts(executor) {
        let net = executor.net(instance);
        let none = usize::MAX;
        drawing.node(MissionElementKind::GROUP, MissionMark::PLAIN, none, executor.path(instance));
        for place in net.places() {
            drawing.node(MissionElementKind::PLACE, mark(place), group, place.title());
        }
        for transition in net.transitions() {
            let label = match transition.name.trim() {
                "" => &transition.id,
                name => name,
            };
            drawing.node(MissionElementKind::TRANSITION, MissionMark::PLAIN, group, label);
        }
    }
    for (instance, [_, places, transitions]) in starts(executor) {
        for (index, transition) in executor.net(instance).transitions().iter().enumerate() {
            let own = transitions + index;
            for (place, weight) in &transition.inputs {
                drawing.edge((places + place, own), MissionMark::PLAIN, *weight, "");
            }
            for (place, weight) in &transition.outputs {
                drawing.edge((own, places + place), MissionMark::PLAIN, *weight, "");
            }
        }
    }
    drawing
}

fn mark(place: &NetPlace) -> MissionMark {
    match place {
        NetPlace { goal: Some(_), .. } => MissionMark::GOAL,
        NetPlace { fail: Some(_), .. } => MissionMark::FAILURE,
        NetPlace { action: Some(_), .. } => MissionMark::PERFORMS,
        NetPlace { initial: 1.., .. } => MissionMark::START,
        _ => MissionMark::PLAIN,
    }
}

/// Hashes markings, what runs, and conditions about time.
pub fn hash(executor: &PetriNetExecutor, seen: &MissionSight<'_>, hash: &mut ActivityHash) {
    for instance in 0..executor.instances() {
        executor.marking(instance).iter().for_each(|tokens| hash.number(u64::from(*tokens)));
        let actions = 0..executor.net(instance).actions().len();
        actions.for_each(|action| hash.number(u64::from(executor.is_active(instance, action))));
    }
    let times = executor.plan().conditions().iter().filter(|name| name.starts_with(ELAPSED));
    times.for_each(|name| hash.number(u64::from(condition(seen, name) == Some(true))));
}

/// Describes tokens, and why each transition does not fire.
pub fn describe(executor: &PetriNetExecutor, seen: &MissionSight<'_>, activity: &mut ActivityWriter<'_>) {
    let runs = executor.runs();
    for (instance, [group, places, transitions]) in starts(executor) {
        let net = executor.net(instance);
        if runs[instance] {
            activity.element(group, MissionItemStatus::RUNNING, 0, format_args!(""));
        }
        let marked = net.places().iter().zip(executor.marking(instance)).enumerate();
        for (index, (place, tokens)) in marked.filter(|(_, (_, tokens))| **tokens > 0) {
            let progress = action_progress(executor, instance, place, seen);
            activity.element(places + index, MissionItemStatus::MARKED, *tokens, format_args!("{progress}"));
        }
        for index in (0..net.transitions().len()).filter(|_| runs[instance]) {
            let (status, reason) = enabling(executor, instance, index, seen);
            activity.element(transitions + index, status, 0, format_args!("{reason}"));
        }
    }
    let names = executor.plan().conditions().iter();
    names.filter(|name| condition(seen, name).is_none()).for_each(|name| activity.unknown(name));
}

fn action_progress(
    executor: &PetriNetExecutor,
    instance: usize,
    place: &NetPlace,
    seen: &MissionSight<'_>,
) -> &'static str {
    let Some(action) = place.action else { return "" };
    match (executor.is_active(instance, action), executor.host_action(instance, action)) {
        (false, _) => "begins with the next step",
        (true, None) => "the sub-plan runs",
        (true, Some(index)) => match seen.actions.progress(index, seen.now) {
            ActionProgress::Succeeded => "the action has succeeded",
            ActionProgress::Failed => "the action has failed",
            ActionProgress::Preempted => "a reflex has preempted the action",
            ActionProgress::Idle | ActionProgress::Running => "the action runs",
        },
    }
}

/// Returns whether a transition fires with the next step, and why not.
fn enabling(
    executor: &PetriNetExecutor,
    instance: usize,
    index: usize,
    seen: &MissionSight<'_>,
) -> (MissionItemStatus, Text<124>) {
    let net = executor.net(instance);
    let transition = &net.transitions()[index];
    let marking = executor.marking(instance);
    let mut reason = Text::default();
    // A text takes what fits.
    let lacking = transition.inputs.iter().filter(|(place, weight)| marking[*place] < *weight);
    for (number, (place, weight)) in lacking.enumerate() {
        let place = &net.places()[*place];
        let _ = match (number, *weight) {
            (0, 1) => write!(reason, "no token in `{}`", place.title()),
            (0, weight) => write!(reason, "fewer than {weight} tokens in `{}`", place.title()),
            _ => write!(reason, ", `{}`", place.title()),
        };
    }
    if !reason.as_str().is_empty() {
        return (MissionItemStatus::WAITING, reason);
    }
    let Some(guard) = &transition.guard else {
        return (MissionItemStatus::ENABLED, Text::new("fires with the next step"));
    };
    let mut answer = |name: &str| condition(seen, name);
    match executor.holds(instance, guard, &mut answer) {
        Some(true) => (MissionItemStatus::ENABLED, Text::new("fires with the next step")),
        _ => {
            guard.atoms(&mut |atom| {
                let holds = executor.holds(instance, atom, &mut answer);
                let comma = if reason.as_str().is_empty() { "" } else { ", " };
                let _ = write!(reason, "{comma}");
                write_atom(net, atom, holds, &mut reason);
            });
            (MissionItemStatus::WAITING, reason)
        }
    }
}

fn write_atom(net: &PetriNet, atom: &NetGuard, holds: Option<bool>, text: &mut Text<124>) {
    let verb = match (atom, holds) {
        (_, None) => "is unknown",
        (NetGuard::Action(_, ActionQuery::Finished), Some(false)) => "has not succeeded yet",
        (NetGuard::Action(_, ActionQuery::Failed), Some(false)) => "has not failed",
        (NetGuard::Action(_, ActionQuery::Preempted), Some(false)) => "was not preempted",
        (NetGuard::Action(_, ActionQuery::Running), Some(false)) => "does not run",
        (_, Some(false)) => "is false",
        (_, Some(true)) => "is true",
    };
    let name = match (atom, holds) {
        (NetGuard::Action(action, _), Some(false)) => net.actions()[*action].clone(),
        _ => net.guard_text(atom),
    };
    let _ = write!(text, "`{name}` {verb}");
}

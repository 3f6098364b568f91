//! Steps against a reference written from the definition, on random nets.

use std::collections::BTreeMap;
use std::sync::Arc;

use proptest::prelude::*;
use slate_petri_net::{
    ActionEvent, ActionProgress, ConflictOrder, NetBuilder, PetriNetExecutor, PetriPlan, PlanAction,
    PlanHost, parse_pnml, write_pnml,
};

/// A transition as it was made: takes, puts, events, and its guard as a list of conditions that hold or not.
#[derive(Clone, Debug)]
struct Made {
    takes: Vec<(usize, u32)>,
    puts: Vec<(usize, u32)>,
    events: Vec<(usize, &'static str)>,
    guard: Vec<(usize, bool)>,
}

#[derive(Clone, Debug)]
struct MadeNet {
    /// Tokens, action, goal.
    places: Vec<(u32, Option<usize>, Option<u32>)>,
    transitions: Vec<Made>,
}

/// What the world answers in a step: conditions, and how far each action has come if it runs.
type World = (Vec<bool>, Vec<u8>);

const CONDITIONS: usize = 3;
const ACTIONS: usize = 3;
const EVENTS: [&str; 5] = ["start", "end", "fail", "interrupt", "resume"];

fn arcs() -> impl Strategy<Value = Vec<(usize, u32)>> {
    prop::collection::btree_map(0usize..6, prop_oneof![4 => Just(1u32), 1 => Just(2)], 0..3)
        .prop_map(|arcs| arcs.into_iter().collect())
}

fn transition() -> impl Strategy<Value = Made> {
    let events = prop::collection::vec((0..ACTIONS, prop::sample::select(&EVENTS[..])), 0..3);
    let guard = prop::collection::vec((0..CONDITIONS, any::<bool>()), 0..3);
    (arcs(), arcs(), events, guard).prop_map(|(takes, puts, mut events, guard)| {
        let mut seen = Vec::new();
        events.retain(|event| {
            !seen.contains(event) && {
                seen.push(*event);
                true
            }
        });
        Made { takes, puts, events, guard }
    })
}

fn made_net() -> impl Strategy<Value = MadeNet> {
    let goal = prop_oneof![8 => Just(None), 1 => (0u32..3).prop_map(Some)];
    let place = (0u32..2, prop::option::weighted(0.4, 0..ACTIONS), goal);
    let places = prop::collection::vec(place, 6);
    (places, prop::collection::vec(transition(), 1..8))
        .prop_map(|(places, transitions)| MadeNet { places, transitions })
}

fn worlds() -> impl Strategy<Value = Vec<World>> {
    let world = (prop::collection::vec(any::<bool>(), CONDITIONS), prop::collection::vec(0u8..4, ACTIONS));
    prop::collection::vec(world, 1..40)
}

fn build(made: &MadeNet) -> PetriPlan {
    let mut net = NetBuilder::new("random");
    for (tokens, action, goal) in &made.places {
        let action = action.map(|action| format!("a{action}.exec")).unwrap_or_default();
        let goal = goal.map(|goal| format!("goal({goal})")).unwrap_or_default();
        net.place(&format!("{action} {goal}"), *tokens);
    }
    for made in &made.transitions {
        let events: Vec<String> =
            made.events.iter().map(|(action, event)| format!("a{action}.{event}")).collect();
        let guard: Vec<String> = made
            .guard
            .iter()
            .map(
                |(condition, holds)| {
                    if *holds { format!("c{condition}") } else { format!("(not c{condition})") }
                },
            )
            .collect();
        let guard = if guard.is_empty() { String::new() } else { format!("[and {}]", guard.join(" ")) };
        net.transition(&format!("{} {guard}", events.join(" ")), &made.takes, &made.puts);
    }
    let net = net.finish().unwrap();
    // A file in between changes nothing.
    PetriPlan::new(parse_pnml("random", write_pnml(&net).as_bytes()).unwrap(), |_| Ok(None)).unwrap()
}

fn progress(code: u8) -> ActionProgress {
    match code {
        0 | 1 => ActionProgress::Running,
        2 => ActionProgress::Succeeded,
        _ => ActionProgress::Failed,
    }
}

/// The reference: actions by number with `active`, `suspended` or nothing, and how far they have come.
struct Reference<'a> {
    net: &'a MadeNet,
    marking: Vec<u32>,
    phase: BTreeMap<usize, &'static str>,
    came: BTreeMap<usize, ActionProgress>,
    log: Vec<String>,
}

impl Reference<'_> {
    fn is_over(&self) -> bool {
        let goals: Vec<bool> = self
            .net
            .places
            .iter()
            .zip(&self.marking)
            .filter_map(|((_, _, goal), tokens)| goal.map(|goal| goal == *tokens))
            .collect();
        !goals.is_empty() && goals.iter().all(|fits| *fits)
    }

    fn holds(&self, action: usize) -> bool {
        let mut places = self.net.places.iter().zip(&self.marking);
        places.any(|((_, own, _), tokens)| *own == Some(action) && *tokens > 0)
    }

    fn apply(&mut self, action: usize, event: &'static str) {
        let was = self.phase.get(&action).copied();
        match (event, was) {
            ("start", _) | ("resume", None | Some("suspended")) => {
                self.phase.insert(action, "active");
                self.came.insert(action, ActionProgress::Running);
            }
            ("end" | "fail", Some(phase)) => {
                self.phase.remove(&action);
                if phase == "suspended" {
                    return;
                }
            }
            ("interrupt", Some("active")) => {
                self.phase.insert(action, "suspended");
            }
            _ => return,
        }
        self.log.push(format!("{event} a{action}"));
    }

    /// Returns the transitions that fire, and those that come too late.
    fn step(&mut self, (conditions, ends): &World, actions: &[usize]) -> (Vec<usize>, Vec<usize>) {
        if self.is_over() {
            return (Vec::new(), Vec::new());
        }
        for (place, (_, action, _)) in self.net.places.iter().enumerate() {
            if let Some(action) = *action
                && self.marking[place] > 0
                && self.phase.get(&action) != Some(&"active")
            {
                self.apply(action, "start");
            }
        }
        for action in actions {
            if self.phase.get(action) == Some(&"active") {
                self.came.insert(*action, progress(ends[*action]));
            }
        }
        let enabled =
            |marking: &[u32], made: &Made| made.takes.iter().all(|(place, n)| marking[*place] >= *n);
        let guard = |made: &Made| {
            if !made.guard.is_empty() {
                return made.guard.iter().all(|(condition, holds)| conditions[*condition] == *holds);
            }
            made.events.iter().all(|(action, event)| match *event {
                "end" => self.came.get(action) == Some(&ActionProgress::Succeeded),
                "fail" => self.came.get(action) == Some(&ActionProgress::Failed),
                _ => true,
            })
        };
        let net = self.net;
        let candidates: Vec<usize> = (0..net.transitions.len())
            .filter(|index| {
                enabled(&self.marking, &net.transitions[*index]) && guard(&net.transitions[*index])
            })
            .collect();
        let (mut fired, mut late) = (Vec::new(), Vec::new());
        for index in candidates {
            let made = &net.transitions[index];
            if !enabled(&self.marking, made) {
                late.push(index);
                continue;
            }
            made.takes.iter().for_each(|(place, n)| self.marking[*place] -= n);
            made.puts.iter().for_each(|(place, n)| self.marking[*place] += n);
            made.events.iter().for_each(|(action, event)| self.apply(*action, event));
            for action in made.takes.iter().filter_map(|(place, _)| net.places[*place].1) {
                if !self.holds(action) {
                    self.apply(action, "interrupt");
                }
            }
            fired.push(index);
            if self.is_over() {
                break;
            }
        }
        if self.is_over() {
            for action in actions {
                self.apply(*action, "end");
            }
        }
        (fired, late)
    }
}

struct Host<'a> {
    world: &'a World,
    log: Vec<String>,
}

fn number(name: &str) -> usize {
    name[1..].parse().unwrap()
}

impl PlanHost for Host<'_> {
    fn condition(&mut self, _: usize, name: &str) -> Option<bool> {
        Some(self.world.0[number(name)])
    }

    fn progress(&mut self, _: usize, action: &PlanAction) -> ActionProgress {
        progress(self.world.1[number(action.text())])
    }

    fn control(&mut self, _: usize, action: &PlanAction, event: ActionEvent) {
        self.log.push(format!("{} {}", event.word(), action.text()));
    }
}

fn compare(made: &MadeNet, worlds: &[World], saved: usize) -> Result<(), TestCaseError> {
    let plan = Arc::new(build(made));
    // Actions in the order in which the labels name them.
    let actions: Vec<usize> = plan.net().actions().iter().map(|text| number(text)).collect();
    let marking = made.places.iter().map(|(tokens, ..)| *tokens).collect();
    let mut reference =
        Reference { net: made, marking, phase: BTreeMap::new(), came: BTreeMap::new(), log: Vec::new() };
    let mut executor = PetriNetExecutor::new(Arc::clone(&plan), ConflictOrder::File);
    for (step, world) in worlds.iter().enumerate() {
        if step == saved {
            executor =
                PetriNetExecutor::restore(Arc::clone(&plan), ConflictOrder::File, &executor.state()).unwrap();
        }
        let mut host = Host { world, log: Vec::new() };
        executor.step(&mut host).unwrap();
        let (fired, late) = reference.step(world, &actions);
        let indices = |transitions: &[slate_petri_net::PlanTransition]| -> Vec<usize> {
            transitions.iter().map(|fired| fired.transition).collect()
        };
        prop_assert_eq!(indices(executor.fired()), fired);
        prop_assert_eq!(indices(executor.conflicts()), late);
        prop_assert_eq!(executor.marking(0), &reference.marking[..]);
        prop_assert_eq!(&host.log, &reference.log);
        prop_assert_eq!(executor.progress() == ActionProgress::Succeeded, reference.is_over());
        reference.log.clear();
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn steps_are_those_of_the_definition(made in made_net(), worlds in worlds(), saved in 0usize..40) {
        compare(&made, &worlds, saved)?;
    }
}

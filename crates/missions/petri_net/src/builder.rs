//! Building of nets: from labels to actions, events and guards.

use crate::error::NetError;
use crate::guard::{ActionQuery, NetGuard, parse_guard};
use crate::label::{ActionEvent, place_words, transition_words};
use crate::net::{NetPlace, NetTransition, PetriNet};

/// Maximum number of places, transitions and arcs of a net.
pub(crate) const MOST_PARTS: usize = 10_000;
/// Longest label, bytes.
const LONGEST_LABEL: usize = 4096;

/// Places with weights.
type Arcs = Vec<(usize, u32)>;

/// Name and label of a transition or place, and its line in a file.
pub(crate) struct NodeLabel {
    pub id: String,
    pub name: String,
    pub line: Option<usize>,
}

/// Builds a [`PetriNet`] from its parts.
///
/// ```
/// use slate_petri_net::NetBuilder;
///
/// let mut net = NetBuilder::new("fetch");
/// let start = net.place("start", 1);
/// let driving = net.place("goto_6_2.exec", 0);
/// let goal = net.place("goal", 0);
/// net.transition("goto_6_2.start", &[(start, 1)], &[(driving, 1)]);
/// net.transition("goto_6_2.end", &[(driving, 1)], &[(goal, 1)]);
/// let net = net.finish()?;
/// assert_eq!(net.actions(), ["goto_6_2"]);
/// # Ok::<(), slate_petri_net::NetError>(())
/// ```
pub struct NetBuilder {
    pub(crate) name: String,
    pub(crate) places: Vec<(NodeLabel, u32)>,
    /// Labels, input arcs and output arcs.
    pub(crate) transitions: Vec<(NodeLabel, Arcs, Arcs)>,
}

impl NetBuilder {
    /// Returns a builder of a net without places.
    pub fn new(name: &str) -> Self {
        Self { name: name.into(), places: Vec::new(), transitions: Vec::new() }
    }

    /// Adds a place with a label and tokens; returns its index.
    pub fn place(&mut self, name: &str, tokens: u32) -> usize {
        let id = format!("p{}", self.places.len() + 1);
        self.places.push((NodeLabel { id, name: name.into(), line: None }, tokens));
        self.places.len() - 1
    }

    /// Adds a transition with a label and weighted arcs; returns its index.
    /// `inputs` are places with the tokens that it takes, `outputs` those that it puts.
    pub fn transition(&mut self, name: &str, inputs: &[(usize, u32)], outputs: &[(usize, u32)]) -> usize {
        let id = format!("t{}", self.transitions.len() + 1);
        let part = NodeLabel { id, name: name.into(), line: None };
        self.transitions.push((part, inputs.to_vec(), outputs.to_vec()));
        self.transitions.len() - 1
    }

    /// Reads the labels and checks the net.
    pub fn finish(self) -> Result<PetriNet, NetError> {
        compile(self)
    }
}

fn compile(builder: NetBuilder) -> Result<PetriNet, NetError> {
    let NetBuilder { name, places, transitions } = builder;
    if places.len() + transitions.len() > MOST_PARTS {
        return Err(NetError::new(format!(
            "expected at most {MOST_PARTS} places and transitions, found more"
        )));
    }
    let (mut actions, mut conditions) = (Vec::new(), Vec::new());
    let mut compiled = Vec::new();
    for (part, initial) in places {
        let place = place(&part, initial, &mut actions).map_err(|reason| of_part("place", &part, reason))?;
        compiled.push(place);
    }
    let mut pending = Vec::new();
    for (part, inputs, outputs) in transitions {
        let transition =
            transition(&part, arcs(inputs, &part)?, arcs(outputs, &part)?, &compiled, &mut actions)
                .map_err(|reason| of_part("transition", &part, reason))?;
        pending.push((part, transition));
    }
    // Guards come last: they name actions of any label.
    let mut transitions = Vec::new();
    for (part, mut transition) in pending {
        transition.guard = guard(&transition, &actions, &mut conditions)
            .map_err(|reason| of_part("transition", &part, reason))?;
        transitions.push(transition);
    }
    Ok(PetriNet { name, places: compiled, transitions, actions, conditions })
}

fn of_part(kind: &str, part: &NodeLabel, reason: String) -> NetError {
    NetError::at(part.line, format!("{kind} `{}`: {reason}", part.id))
}

/// Arcs with the weights of those between the same two nodes added.
fn arcs(arcs: Vec<(usize, u32)>, part: &NodeLabel) -> Result<Vec<(usize, u32)>, NetError> {
    let mut joined: Vec<(usize, u32)> = Vec::with_capacity(arcs.len());
    for (place, weight) in arcs {
        match joined.iter_mut().find(|(other, _)| *other == place) {
            Some((_, sum)) => {
                *sum = sum.checked_add(weight).ok_or_else(|| {
                    of_part("transition", part, "the weights of its arcs are too large".into())
                })?;
            }
            None => joined.push((place, weight)),
        }
    }
    Ok(joined)
}

/// Refuses labels that no editor shows, whose words would be searched for long.
fn check_length(part: &NodeLabel) -> Result<(), String> {
    match part.name.len() {
        ..=LONGEST_LABEL => Ok(()),
        length => Err(format!("expected a label of at most {LONGEST_LABEL} bytes, found {length}")),
    }
}

fn place(part: &NodeLabel, initial: u32, actions: &mut Vec<String>) -> Result<NetPlace, String> {
    check_length(part)?;
    let words = place_words(&part.name)?;
    Ok(NetPlace {
        id: part.id.clone(),
        name: part.name.trim().into(),
        initial,
        action: words.action.map(|action| intern(actions, action)),
        goal: words.goal,
        fail: words.fail,
    })
}

fn transition(
    part: &NodeLabel,
    inputs: Vec<(usize, u32)>,
    outputs: Vec<(usize, u32)>,
    places: &[NetPlace],
    actions: &mut Vec<String>,
) -> Result<NetTransition, String> {
    check_length(part)?;
    let words = transition_words(&part.name)?;
    let mut events = Vec::new();
    for (action, event) in &words.events {
        if *action != "*" {
            add(&mut events, (intern(actions, action), *event));
            continue;
        }
        let near = if event.activates() { &outputs } else { &inputs };
        for action in near.iter().filter_map(|(place, _)| places[*place].action) {
            add(&mut events, (action, *event));
        }
    }
    let unknown = words.unknown.iter().map(|word| (*word).to_owned()).collect();
    Ok(NetTransition {
        id: part.id.clone(),
        name: part.name.trim().into(),
        inputs,
        outputs,
        events,
        guard: None,
        unknown,
    })
}

fn add(events: &mut Vec<(usize, ActionEvent)>, event: (usize, ActionEvent)) {
    if !events.contains(&event) {
        events.push(event);
    }
}

/// Returns the guard of the label, or that of `end` and `fail` without one.
fn guard(
    transition: &NetTransition,
    actions: &[String],
    conditions: &mut Vec<String>,
) -> Result<Option<NetGuard>, String> {
    if let Some(text) = transition_words(&transition.name)?.guard {
        return parse_guard(text, |word| atom(word, actions, conditions)).map(Some);
    }
    let mut implied: Vec<NetGuard> = transition
        .events
        .iter()
        .filter_map(|(action, event)| match event {
            ActionEvent::End => Some(NetGuard::Action(*action, ActionQuery::Finished)),
            ActionEvent::Fail => Some(NetGuard::Action(*action, ActionQuery::Failed)),
            _ => None,
        })
        .collect();
    Ok(match implied.len() {
        0 => None,
        1 => implied.pop(),
        _ => Some(NetGuard::And(implied)),
    })
}

fn atom(word: &str, actions: &[String], conditions: &mut Vec<String>) -> Result<NetGuard, String> {
    if let Some((action, query)) = word.rsplit_once('.')
        && let Some(query) = ActionQuery::parse(query)
    {
        let known = actions.iter().position(|other| other == action);
        return known.map(|action| NetGuard::Action(action, query)).ok_or_else(|| {
            format!("the guard names the action `{action}`, expected one of the net: {}", actions.join(", "))
        });
    }
    Ok(NetGuard::Condition(intern(conditions, word)))
}

fn intern(names: &mut Vec<String>, name: &str) -> usize {
    match names.iter().position(|other| other == name) {
        Some(index) => index,
        None => {
            names.push(name.into());
            names.len() - 1
        }
    }
}

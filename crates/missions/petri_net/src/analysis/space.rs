//! State spaces of nets.

use std::collections::HashMap;

use crate::net::PetriNet;

/// Maximum number of numbers of tokens that are kept, places times markings.
const MOST_NUMBERS: usize = 1 << 25;
/// Maximum number of tokens of a place in an analysis.
const MOST_TOKENS: u32 = u32::MAX;

/// Reachable markings of a net, breadth first.
/// The path to each is thus a shortest one.
///
/// Guards are ignored: each may hold or not. So a plan reaches no other markings, but perhaps not all of these.
#[derive(Clone, Debug)]
pub struct StateSpace {
    places: usize,
    markings: Vec<u32>,
    /// Predecessor and transition of each state but the first.
    origins: Vec<(usize, usize)>,
    /// State, transition, and the state that it leads to.
    edges: Vec<(usize, usize, usize)>,
    is_complete: bool,
    growth: Option<(usize, usize)>,
}

/// Firing sequence from the initial marking.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FiringPath {
    /// Transitions in the order in which they fire.
    pub transitions: Vec<usize>,
    /// First transition of the part that can be repeated.
    /// Only for a growth without bound.
    pub repeated: Option<usize>,
    /// Marking at the end.
    pub marking: Vec<u32>,
}

/// Explores at most `most_states` markings of a net.
/// Fewer where they would take more than 256 MB.
///
/// With `stops`, nothing follows a goal or a failure, as in a plan that runs, and a growth without bound ends the
/// exploration. Without it, all markings of the net follow from the initial one.
pub fn state_space(net: &PetriNet, most_states: usize, stops: bool) -> StateSpace {
    explore(net, most_states, stops, |marking, _| !stops || !net.is_goal(marking) && !net.is_failure(marking))
}

/// Explores the markings reachable by the transitions that `may_fire`.
pub(super) fn explore(
    net: &PetriNet,
    most_states: usize,
    stops: bool,
    may_fire: impl Fn(&[u32], usize) -> bool,
) -> StateSpace {
    let initial = net.initial_marking();
    let mut space = StateSpace {
        places: initial.len(),
        markings: initial.clone(),
        origins: vec![(0, 0)],
        edges: Vec::new(),
        is_complete: false,
        growth: None,
    };
    // Tokens of each state, and the least number of tokens on its path.
    let mut sums = vec![sum(&initial)];
    let mut least = sums.clone();
    let mut known = HashMap::from([(initial.clone(), 0)]);
    let mut marking = initial;
    let mut state = 0;
    while state < space.states() {
        for (index, transition) in net.transitions().iter().enumerate() {
            marking.copy_from_slice(space.marking(state));
            if !transition.is_enabled(&marking) || !may_fire(&marking, index) {
                continue;
            }
            if transition.fire(&mut marking, MOST_TOKENS).is_err() {
                return space;
            }
            if let Some(next) = known.get(&marking) {
                space.edges.push((state, index, *next));
                continue;
            }
            if space.states() >= most_states || space.markings.len() >= MOST_NUMBERS {
                return space;
            }
            let next = space.states();
            known.insert(marking.clone(), next);
            space.markings.extend_from_slice(&marking);
            space.origins.push((state, index));
            space.edges.push((state, index, next));
            let tokens = sum(&marking);
            sums.push(tokens);
            least.push(least[state].min(tokens));
            if stops && tokens > least[state] {
                space.growth = space.covered(net, next, &sums).map(|from| (from, next));
                if space.growth.is_some() {
                    return space;
                }
            }
        }
        state += 1;
    }
    space.is_complete = true;
    space
}

fn sum(marking: &[u32]) -> u64 {
    marking.iter().map(|tokens| u64::from(*tokens)).sum()
}

impl StateSpace {
    /// Returns the number of markings.
    pub fn states(&self) -> usize {
        self.origins.len()
    }

    /// Returns a marking, tokens of each place; that of state 0 is the initial one.
    pub fn marking(&self, state: usize) -> &[u32] {
        &self.markings[state * self.places..(state + 1) * self.places]
    }

    /// Returns the firings: state, transition, and the state that it leads to.
    pub fn edges(&self) -> &[(usize, usize, usize)] {
        &self.edges
    }

    /// Returns whether all markings were explored.
    pub fn is_complete(&self) -> bool {
        self.is_complete
    }

    /// Returns a path of unbounded growth, if the exploration found one.
    pub fn growth(&self) -> Option<FiringPath> {
        let (from, to) = self.growth?;
        Some(FiringPath { repeated: Some(self.path(from).transitions.len()), ..self.path(to) })
    }

    /// Returns a shortest firing sequence to a state.
    pub fn path(&self, state: usize) -> FiringPath {
        let mut transitions = Vec::new();
        let mut at = state;
        while at != 0 {
            let (before, transition) = self.origins[at];
            transitions.push(transition);
            at = before;
        }
        transitions.reverse();
        FiringPath { transitions, repeated: None, marking: self.marking(state).to_vec() }
    }

    /// Returns a state on the path to another one that is covered by it.
    /// It has fewer tokens in some places and more in none.
    ///
    /// The firings between them can be repeated without end, because a goal or a failure does not come between: places
    /// that count for one have equal tokens in both.
    fn covered(&self, net: &PetriNet, state: usize, sums: &[u64]) -> Option<usize> {
        let last = self.marking(state);
        let mut at = state;
        while at != 0 {
            at = self.origins[at].0;
            if sums[at] >= sums[state] {
                continue;
            }
            let covers =
                net.places().iter().zip(self.marking(at)).zip(last).all(|((place, before), after)| {
                    let counts = place.goal.is_some() || place.fail.is_some();
                    if counts { before == after } else { before <= after }
                });
            if covers {
                return Some(at);
            }
        }
        None
    }
}

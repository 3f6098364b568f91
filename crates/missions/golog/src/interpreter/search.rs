//! Depth-first search for executions of a program that end.

use std::collections::{HashMap, HashSet};

use super::effects::{EffectKind, SituationStore};
use super::ground_action::GroundAction;
use super::remaining::RemainingPrograms;
use super::transition::{ProgramTransition, TransitionMode, TransitionReader};
use crate::error::GologRunError;
use crate::theory::ActionTheory;
use crate::theory::formula::SituationView;

/// Result of a part of a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SearchProgress {
    /// Path to a program that may end.
    Found,
    /// Exhausted: no further solution exists.
    Exhausted,
    /// Limit of transitions reached.
    Interrupted,
}

/// Program and situation on the path of a search.
#[derive(Clone, Debug)]
struct SearchFrame {
    program: u32,
    /// Action that has led here.
    action: Option<GroundAction>,
    /// Hash of the situation.
    situation: u64,
    mark: usize,
    /// Range of its remaining transitions in `open`: `next` to `end`.
    next: usize,
    end: usize,
}

/// Depth-first search in the order of the text, which can be interrupted.
#[derive(Clone, Debug)]
pub(crate) struct DepthFirstSearch {
    situation: SituationStore,
    frames: Vec<SearchFrame>,
    /// Transitions of the frames, one after the other.
    open: Vec<ProgramTransition>,
    /// Programs and situations that need no second visit; `None` to find every path.
    visited: Option<VisitedPlaces>,
    most_depth: usize,
    /// Number of transitions so far.
    pub transitions: u64,
    /// True if a path was longer than `most_depth`.
    pub is_cut: bool,
}

/// Visited programs with their situations.
#[derive(Clone, Debug, Default)]
struct VisitedPlaces {
    situations: HashMap<Box<[i32]>, u32>,
    places: HashSet<(u32, u32)>,
}

impl VisitedPlaces {
    /// Marks a place as visited; returns true if it is new.
    fn visit(&mut self, program: u32, cells: &[i32]) -> bool {
        let situation = match self.situations.get(cells) {
            Some(known) => *known,
            None => {
                let number = self.situations.len() as u32;
                self.situations.insert(cells.into(), number);
                number
            }
        };
        self.places.insert((program, situation))
    }
}

impl DepthFirstSearch {
    /// Returns the search for one path.
    /// It visits each program in each situation once.
    pub fn of_plan(cells: &[i32]) -> Self {
        Self::new(cells, Some(VisitedPlaces::default()), usize::MAX)
    }

    /// Returns the search for all paths of at most so many transitions.
    pub fn of_all(cells: &[i32], most_depth: usize) -> Self {
        Self::new(cells, None, most_depth)
    }

    fn new(cells: &[i32], visited: Option<VisitedPlaces>, most_depth: usize) -> Self {
        let situation = SituationStore::new(cells.to_vec());
        let (frames, open) = (Vec::new(), Vec::new());
        Self { situation, frames, open, visited, most_depth, transitions: 0, is_cut: false }
    }

    /// Begins with a program; returns true if it may end at once.
    pub fn begin(
        &mut self,
        theory: &ActionTheory,
        programs: &mut RemainingPrograms,
        program: u32,
    ) -> Result<bool, GologRunError> {
        self.enter(theory, programs, program, None, 0)
    }

    /// Actions of the path.
    pub fn actions(&self) -> impl Iterator<Item = &GroundAction> {
        self.frames.iter().filter_map(|frame| frame.action.as_ref())
    }

    /// Returns the programs of the path.
    /// Each with the hash of its situation, and the action that has led to it.
    pub fn path(&self) -> impl DoubleEndedIterator<Item = (u32, u64, Option<GroundAction>)> {
        self.frames.iter().map(|frame| (frame.program, frame.situation, frame.action))
    }

    /// Continues for a limited number of transitions.
    pub fn run(
        &mut self,
        theory: &ActionTheory,
        programs: &mut RemainingPrograms,
        budget: u64,
    ) -> Result<SearchProgress, GologRunError> {
        let most = self.transitions.saturating_add(budget);
        while let Some(frame) = self.frames.last_mut() {
            if frame.next == frame.end {
                let SearchFrame { mark, .. } = *frame;
                self.frames.pop();
                self.situation.undo(mark);
                let end = self.frames.last().map_or(0, |frame| frame.end);
                self.open.truncate(end);
                continue;
            }
            if self.transitions == most {
                return Ok(SearchProgress::Interrupted);
            }
            let ProgramTransition { action, program, .. } = self.open[frame.next];
            frame.next += 1;
            self.transitions += 1;
            let mark = self.situation.mark();
            if let Some(action) = &action {
                self.situation.apply(theory, action, EffectKind::Planned)?;
            }
            let is_new = match &mut self.visited {
                Some(visited) => visited.visit(program, &self.situation.cells),
                None => true,
            };
            if !is_new {
                self.situation.undo(mark);
            } else if self.enter(theory, programs, program, action, mark)? {
                return Ok(SearchProgress::Found);
            }
        }
        Ok(SearchProgress::Exhausted)
    }

    /// Enters a program; returns true if it may end.
    fn enter(
        &mut self,
        theory: &ActionTheory,
        programs: &mut RemainingPrograms,
        program: u32,
        action: Option<GroundAction>,
        mark: usize,
    ) -> Result<bool, GologRunError> {
        let view = SituationView { theory, cells: &self.situation.cells };
        let mut reader = TransitionReader::new(view, programs, TransitionMode::Planned);
        let next = self.open.len();
        let is_final = reader.is_final(program)?;
        reader.transitions(program, &mut self.open)?;
        if self.frames.len() == self.most_depth && self.open.len() > next {
            self.is_cut = true;
            self.open.truncate(next);
        }
        // Only plans need it.
        let situation = if self.visited.is_some() { self.situation.hash() } else { 0 };
        self.frames.push(SearchFrame { program, action, situation, mark, next, end: self.open.len() });
        Ok(is_final)
    }
}

//! Offline execution: all action sequences of a program that end.

use crate::error::GologRunError;
use crate::interpreter::{DepthFirstSearch, RemainingPrograms, SearchProgress};
use crate::theory::ActionTheory;
use crate::theory::formula::MOST_VARIABLES;

/// Limits of an offline execution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SolutionLimits {
    /// Maximum number of transitions of a sequence, tests included.
    pub most_depth: usize,
    /// Maximum number of transitions of all.
    pub most_transitions: u64,
}

/// Extent of an offline execution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SolutionReport {
    /// Number of action sequences.
    pub solutions: u64,
    /// Number of transitions.
    pub transitions: u64,
    /// True if no limit was reached.
    pub is_complete: bool,
}

/// Executes the main program offline: `Do` of Golog.
///
/// Calls `found` with each sequence of actions that ends, such as `["go(desk)", "grasp(cup)"]`, in the order of the
/// text; a sequence comes once for each way to it. `found` returns whether to continue.
///
/// # Errors
/// If a formula can't be evaluated.
pub fn solutions(
    theory: &ActionTheory,
    limits: &SolutionLimits,
    mut found: impl FnMut(&[String]) -> bool,
) -> Result<SolutionReport, GologRunError> {
    let mut programs = RemainingPrograms::new();
    let body = theory.procedures[theory.main].body;
    let program = programs.code(&theory.nodes, body, &[0; MOST_VARIABLES]);
    let mut search = DepthFirstSearch::of_all(&theory.initial, limits.most_depth);
    let mut is_found = search.begin(theory, &mut programs, program)?;
    let mut report = SolutionReport { solutions: 0, transitions: 0, is_complete: false };
    loop {
        if is_found {
            report.solutions += 1;
            let actions: Vec<String> = search.actions().map(|action| action.text(theory)).collect();
            if !found(&actions) {
                break;
            }
        }
        let budget = limits.most_transitions - search.transitions;
        is_found = match search.run(theory, &mut programs, budget)? {
            SearchProgress::Found => true,
            SearchProgress::Exhausted => {
                report.is_complete = !search.is_cut;
                break;
            }
            SearchProgress::Interrupted => break,
        };
    }
    report.transitions = search.transitions;
    Ok(report)
}

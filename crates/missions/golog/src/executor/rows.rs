//! Program that remains, as rows of text.

use super::GologExecutor;
use super::state::visible;
use crate::interpreter::*;
use crate::theory::program::ProgramStep;

/// Maximum number of rows; a program that is longer is cut.
const MOST_ROWS: usize = 128;

/// Row of a program that remains.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RemainingRow {
    /// Level of the part; 0 for the next one.
    pub level: usize,
    /// Text such as `go_to(p), p = desk`.
    pub text: String,
    /// Slot of an action that the robot performs.
    pub slot: Option<usize>,
}

/// Rows of the program of an execution.
pub(super) struct RowWriter<'a> {
    pub executor: &'a GologExecutor,
    pub rows: Vec<RemainingRow>,
}

impl RowWriter<'_> {
    /// Writes a remaining program and its parts.
    pub fn write(&mut self, program: u32, level: usize) {
        let programs = &self.executor.programs;
        match programs.get(program) {
            Remaining::Nil => {}
            Remaining::Code(node, bindings) => {
                let values = programs.bindings(bindings);
                let node = node as usize;
                let scopes = visible(&self.executor.theory, self.executor.theory.nodes[node].scope);
                let variables = scopes.iter().rev().map(|scope| {
                    let value = self.executor.theory.domains[scope.domain].text(values[scope.slot]);
                    format!(", {} = {value}", scope.name)
                });
                let variables: String = variables.collect();
                self.code(node, level, &variables);
            }
            Remaining::Then(first, second) => {
                self.write(first, level);
                self.write(second, level);
            }
            Remaining::Both(first, second) => self.pair("together ||", first, second, level),
            Remaining::Priority(high, low) => self.pair("by priority >>", high, low, level),
            Remaining::Search(inner) => {
                self.add(level, "search".into(), None);
                self.write(inner, level + 1);
            }
            Remaining::Plan(first) => {
                self.add(level, "plan".into(), None);
                let steps = std::iter::successors(Some(first), |step| programs.plans[*step as usize].next);
                for action in steps.filter_map(|step| programs.plans[step as usize].action) {
                    self.add(level + 1, action.text(&self.executor.theory), None);
                }
            }
            Remaining::Performing(slot) => {
                let slot = slot as usize;
                let own = self.executor.performances.get(slot).copied().flatten();
                let text = own.map(|own| own.action.text(&self.executor.theory)).unwrap_or_default();
                self.add(level, text, Some(slot));
            }
        }
    }

    fn pair(&mut self, title: &str, first: u32, second: u32, level: usize) {
        self.add(level, title.into(), None);
        self.write(first, level + 1);
        self.write(second, level + 1);
    }

    /// Writes a node that has not begun; `variables` has the values of its variables.
    fn code(&mut self, node: usize, level: usize, variables: &str) {
        let own = &self.executor.theory.nodes[node];
        let head = own.title.split('{').next().unwrap_or_default().trim_end();
        let title = match &own.step {
            ProgramStep::Nil => return,
            ProgramStep::Sequence(first, second) => {
                self.code(*first, level, variables);
                return self.code(*second, level, variables);
            }
            ProgramStep::Choice(_) => "one of |",
            ProgramStep::Concurrent(..) => "together ||",
            ProgramStep::Priority(..) => "by priority >>",
            ProgramStep::Test(_) | ProgramStep::Act(..) | ProgramStep::Call(..) => &own.title,
            _ => head,
        };
        self.add(level, format!("{title}{variables}"), None);
        for child in own.step.children() {
            self.code(child, level + 1, "");
        }
    }

    fn add(&mut self, level: usize, text: String, slot: Option<usize>) {
        if self.rows.len() < MOST_ROWS {
            self.rows.push(RemainingRow { level, text, slot });
        }
    }
}

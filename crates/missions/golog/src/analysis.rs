//! Defects of a theory that can be read, and the outline of its procedures.

use crate::theory::{ActionTheory, PerformedAction};

/// Kind of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum GologFindingKind {
    /// Action that the robot does not have.
    UnknownAction,
    /// Procedure that the main program does not reach.
    UnreachableProcedure,
    /// Action that no program performs.
    UnusedAction,
    /// Fluent without a reader.
    UnusedFluent,
    /// Fluent that is unknown at the start, and never changes.
    UnsetFluent,
}

impl GologFindingKind {
    /// Returns whether the program can't work.
    pub fn is_error(self) -> bool {
        self == Self::UnknownAction
    }

    /// Returns the name, such as `unused fluent`.
    pub fn name(self) -> &'static str {
        match self {
            Self::UnknownAction => "unknown action",
            Self::UnreachableProcedure => "unreachable procedure",
            Self::UnusedAction => "unused action",
            Self::UnusedFluent => "unused fluent",
            Self::UnsetFluent => "unset fluent",
        }
    }
}

/// Defect of a theory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GologFinding {
    /// Kind.
    pub kind: GologFindingKind,
    /// Line in the file, from 1.
    pub line: usize,
    /// Description of the defect.
    pub text: String,
}

/// Finds defects of a theory, in the order of their kinds and of the file.
///
/// `is_known` returns whether the robot has an action; `None` if it has every one.
pub fn check_theory(theory: &ActionTheory, is_known: Option<&dyn Fn(&str) -> bool>) -> Vec<GologFinding> {
    let mut findings = Vec::new();
    let mut add = |kind, line, text| findings.push(GologFinding { kind, line, text });
    for PerformedAction { name, line, .. } in theory.robot_actions() {
        if is_known.is_some_and(|known| !known(name)) {
            add(GologFindingKind::UnknownAction, line, format!("the robot's action `{name}` is unknown"));
        }
    }
    let is_reached = reached(theory);
    for (procedure, _) in theory.procedures.iter().zip(&is_reached).filter(|(_, reached)| !**reached) {
        let text = format!("nothing calls `{}`", procedure.name);
        add(GologFindingKind::UnreachableProcedure, procedure.line, text);
    }
    for action in theory.actions.iter().filter(|action| !action.is_used && !action.is_exogenous) {
        let text = format!("no program performs `{}`", action.name);
        add(GologFindingKind::UnusedAction, action.line, text);
    }
    for fluent in theory.fluents.iter().filter(|fluent| !fluent.is_read) {
        add(GologFindingKind::UnusedFluent, fluent.line, format!("nothing reads `{}`", fluent.name));
    }
    for defined in theory.defined.iter().filter(|defined| !defined.is_read) {
        add(GologFindingKind::UnusedFluent, defined.line, format!("nothing reads `{}`", defined.name));
    }
    for fluent in theory.fluents.iter().filter(|fluent| !fluent.is_written && !fluent.is_condition) {
        let cells = &theory.initial[fluent.base..fluent.base + fluent.count];
        if cells.contains(&crate::theory::formula::UNKNOWN) {
            let text = format!("`{}` has no initial value, and no action sets it", fluent.name);
            add(GologFindingKind::UnsetFluent, fluent.line, text);
        }
    }
    findings
}

/// Returns for each procedure whether the main program reaches it.
fn reached(theory: &ActionTheory) -> Vec<bool> {
    let mut is_reached = vec![false; theory.procedures.len()];
    let mut open = vec![theory.main];
    while let Some(procedure) = open.pop() {
        if !std::mem::replace(&mut is_reached[procedure], true) {
            open.extend(&theory.procedures[procedure].calls);
        }
    }
    is_reached
}

/// Row of the outline of a program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProgramRow {
    /// Row of the enclosing part; `None` for a procedure.
    pub parent: Option<usize>,
    /// Level of the part; 0 for a procedure.
    pub level: usize,
    /// Text such as `while not done` or `go_to(desk)`.
    pub text: String,
    /// True for an action, a test or a call.
    pub is_leaf: bool,
    /// True for an action.
    pub is_action: bool,
}

/// Returns the procedures with the parts of their programs.
/// They are in the order of the file.
pub fn outline(theory: &ActionTheory) -> Vec<ProgramRow> {
    let mut rows = Vec::new();
    for procedure in &theory.procedures {
        let arguments = procedure.domains.iter().map(|domain| theory.domains[*domain].name.clone());
        let arguments: Vec<String> = arguments.collect();
        let text = match arguments.is_empty() {
            true => format!("procedure {}", procedure.name),
            false => format!("procedure {}({})", procedure.name, arguments.join(", ")),
        };
        rows.push(ProgramRow { parent: None, level: 0, text, is_leaf: false, is_action: false });
        let parent = rows.len() - 1;
        add_rows(theory, procedure.body, parent, 1, &mut rows);
    }
    rows
}

fn add_rows(theory: &ActionTheory, node: usize, parent: usize, level: usize, rows: &mut Vec<ProgramRow>) {
    use crate::theory::program::ProgramStep;
    let own = &theory.nodes[node];
    let head = || own.title.split('{').next().unwrap_or_default().trim_end().to_owned();
    let (text, is_leaf, is_action) = match &own.step {
        ProgramStep::Nil => return,
        ProgramStep::Sequence(first, second) => {
            add_rows(theory, *first, parent, level, rows);
            return add_rows(theory, *second, parent, level, rows);
        }
        ProgramStep::ForRound(_, _, body) => return add_rows(theory, *body, parent, level, rows),
        ProgramStep::Test(_) | ProgramStep::Call(..) => (own.title.clone(), true, false),
        ProgramStep::Act(..) => (own.title.clone(), true, true),
        ProgramStep::Choice(_) => ("one of |".into(), false, false),
        ProgramStep::Concurrent(..) => ("together ||".into(), false, false),
        ProgramStep::Priority(..) => ("by priority >>".into(), false, false),
        _ => (head(), false, false),
    };
    rows.push(ProgramRow { parent: Some(parent), level, text, is_leaf, is_action });
    let parent = rows.len() - 1;
    for child in own.step.children() {
        add_rows(theory, child, parent, level + 1, rows);
    }
}

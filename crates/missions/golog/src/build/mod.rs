//! Theories from their text.

mod actions;
mod cycles;
mod formulas;
mod programs;

use std::path::Path;

use cycles::CycleCheck;
use programs::ProgramBuilder;
use slate_sorted::SortedMap;

use crate::error::GologError;
use crate::text::*;
use crate::theory::formula::{GologFormula, MOST_VARIABLES};
use crate::theory::*;

/// Maximum number of values of a domain.
const MOST_VALUES: usize = 1000;
/// Maximum number of fluents, counted for each of their arguments.
const MOST_CELLS: usize = 100_000;
/// Maximum number of exogenous actions, counted for each of their arguments.
const MOST_EXOGENOUS: usize = 10_000;
/// Domain of truth values.
pub(crate) const TRUTH: usize = 0;
/// Name of the domain of truth values.
const BOOL: &str = "bool";

/// Named part of a theory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum NamedPart {
    Domain(usize),
    /// Domain and value.
    Symbol(usize, i32),
    Table(usize),
    Fluent(usize),
    Defined(usize),
    Action(usize),
    Procedure(usize),
}

impl NamedPart {
    fn title(self) -> &'static str {
        match self {
            Self::Domain(_) => "a domain",
            Self::Symbol(..) => "a value",
            Self::Table(_) => "a table",
            Self::Fluent(_) => "a fluent",
            Self::Defined(_) => "a defined fluent",
            Self::Action(_) => "an action",
            Self::Procedure(_) => "a procedure",
        }
    }
}

/// Variable that is visible.
#[derive(Clone, Debug)]
struct VisibleVariable {
    name: String,
    slot: usize,
    domain: usize,
}

/// Theory that is being built.
struct TheoryBuilder<'a> {
    text: &'a str,
    /// First byte of each line.
    lines: Vec<usize>,
    theory: ActionTheory,
    names: SortedMap<String, NamedPart>,
    variables: Vec<VisibleVariable>,
}

impl ActionTheory {
    /// Reads a file.
    ///
    /// # Errors
    /// If it can't be read or is invalid; with line and column.
    pub fn read(file: &Path) -> Result<Self, GologError> {
        let text = std::fs::read_to_string(file)
            .map_err(|error| GologError::new(format!("can't be read: {error}")).of_file(file))?;
        let mut theory = Self::parse(&text).map_err(|error| error.of_file(file))?;
        if theory.name.is_empty() {
            theory.name = file.file_stem().and_then(|name| name.to_str()).unwrap_or_default().into();
        }
        Ok(theory)
    }

    /// Parses a text.
    ///
    /// # Errors
    /// If it is invalid; with line and column.
    pub fn parse(text: &str) -> Result<Self, GologError> {
        build(text)
    }
}

/// Builds a theory.
fn build(text: &str) -> Result<ActionTheory, GologError> {
    let declarations = parse(text)?;
    let truth =
        ValueDomain { name: BOOL.into(), low: 0, high: 1, symbols: vec!["false".into(), "true".into()] };
    let theory = ActionTheory { domains: vec![truth], ..ActionTheory::default() };
    let (names, variables) = (SortedMap::new(), Vec::new());
    let lines = [0].into_iter().chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
    let mut builder = TheoryBuilder { text, lines, theory, names, variables };
    builder.names.insert("false".into(), NamedPart::Symbol(TRUTH, 0));
    builder.names.insert("true".into(), NamedPart::Symbol(TRUTH, 1));
    let is_domain = |declaration: &&WrittenDeclaration| {
        matches!(declaration.content, WrittenContent::Symbols(_) | WrittenContent::Range(..))
    };
    for declaration in declarations.iter().filter(is_domain) {
        builder.declare_domain(declaration)?;
    }
    for declaration in declarations.iter().filter(|declaration| !is_domain(declaration)) {
        builder.declare(declaration)?;
    }
    let mut indices = [0; 3];
    let is_initial =
        |declaration: &&WrittenDeclaration| matches!(declaration.content, WrittenContent::Initially { .. });
    let (initial, others): (Vec<_>, Vec<_>) = declarations.iter().partition(is_initial);
    for declaration in others.into_iter().chain(initial) {
        builder.define(declaration, &mut indices)?;
    }
    let check = CycleCheck { text, lines: &builder.lines, theory: &builder.theory };
    let parts = check.check(&declarations)?;
    builder.theory.nodes.iter_mut().zip(parts).for_each(|(node, parts)| node.parts = parts);
    match builder.names.get("main") {
        Some(NamedPart::Procedure(main)) if builder.theory.procedures[*main].domains.is_empty() => {
            builder.theory.main = *main;
        }
        _ => return Err(GologError::new("expected `procedure main { ... }` without arguments")),
    }
    Ok(builder.theory)
}

impl TheoryBuilder<'_> {
    fn error(&self, range: TextRange, reason: impl Into<String>) -> GologError {
        GologError::at(self.text, range.start, range.end, reason)
    }

    fn line(&self, range: TextRange) -> usize {
        self.lines.partition_point(|start| *start <= range.start)
    }

    fn take_name(&mut self, name: &WrittenName, part: NamedPart) -> Result<(), GologError> {
        let own = match self.names.get(&name.text) {
            Some(other) => Some(other.title()),
            None => (name.text == BOOL).then_some("a domain"),
        };
        if let Some(title) = own {
            return Err(self.error(name.range, format!("the name `{}` is taken: it is {title}", name.text)));
        }
        self.names.insert(name.text.clone(), part);
        Ok(())
    }

    fn declare_domain(&mut self, declaration: &WrittenDeclaration) -> Result<(), GologError> {
        let name = &declaration.name;
        let domain = self.theory.domains.len();
        self.take_name(name, NamedPart::Domain(domain))?;
        let model = match &declaration.content {
            WrittenContent::Symbols(symbols) => {
                for (value, symbol) in symbols.iter().enumerate() {
                    // More values are refused below.
                    self.take_name(symbol, NamedPart::Symbol(domain, value as i32))?;
                }
                let symbols: Vec<String> = symbols.iter().map(|symbol| symbol.text.clone()).collect();
                ValueDomain { name: name.text.clone(), low: 0, high: symbols.len() as i32 - 1, symbols }
            }
            WrittenContent::Range(low, high) => {
                ValueDomain { name: name.text.clone(), low: *low, high: *high, symbols: Vec::new() }
            }
            _ => return Ok(()),
        };
        self.add_domain(model, name.range).map(|_| ())
    }

    fn add_domain(&mut self, domain: ValueDomain, range: TextRange) -> Result<usize, GologError> {
        if domain.size() > MOST_VALUES {
            let reason =
                format!("expected at most {MOST_VALUES} values of a domain, found {}", domain.size());
            return Err(self.error(range, reason));
        }
        self.theory.domains.push(domain);
        Ok(self.theory.domains.len() - 1)
    }

    fn domain(&mut self, written: &WrittenType) -> Result<usize, GologError> {
        match written {
            WrittenType::Range(low, high, range) => {
                let is_own = |domain: &ValueDomain| {
                    domain.symbols.is_empty() && (domain.low, domain.high) == (*low, *high)
                };
                if let Some(known) = self.theory.domains.iter().position(is_own) {
                    return Ok(known);
                }
                let name = format!("{low}..{high}");
                let domain = ValueDomain { name, low: *low, high: *high, symbols: Vec::new() };
                self.add_domain(domain, *range)
            }
            WrittenType::Named(name) if name.text == BOOL => Ok(TRUTH),
            WrittenType::Named(name) => match self.names.get(&name.text) {
                Some(NamedPart::Domain(domain)) => Ok(*domain),
                _ => Err(self.unknown(name, "domain", |part| matches!(part, NamedPart::Domain(_)))),
            },
        }
    }

    fn domains(&mut self, written: &[WrittenType], range: TextRange) -> Result<Vec<usize>, GologError> {
        if written.len() > MOST_ARGUMENTS {
            let reason = format!("expected at most {MOST_ARGUMENTS} arguments, found {}", written.len());
            return Err(self.error(range, reason));
        }
        written.iter().map(|domain| self.domain(domain)).collect()
    }

    /// Domains of parameters.
    fn parameters(
        &mut self,
        written: &[WrittenVariable],
        range: TextRange,
    ) -> Result<Vec<usize>, GologError> {
        let types: Vec<WrittenType> = written.iter().map(|variable| variable.domain.clone()).collect();
        self.domains(&types, range)
    }

    /// Returns the error for a name that is unknown, or is something else.
    fn unknown(&self, name: &WrittenName, kind: &str, is_wanted: impl Fn(&NamedPart) -> bool) -> GologError {
        if let Some(part) = self.names.get(&name.text) {
            return self
                .error(name.range, format!("expected a {kind}, found `{}`, {}", name.text, part.title()));
        }
        let own = self.names.iter().filter(|(_, part)| is_wanted(part)).map(|(own, _)| own.as_str());
        let visible = self.variables.iter().map(|variable| variable.name.as_str());
        let visible = visible.filter(|_| is_wanted(&NamedPart::Symbol(0, 0)));
        let near = own
            .chain(visible)
            .map(|own| (strsim::levenshtein(own, &name.text), own))
            .filter(|(distance, own)| *distance <= own.len().min(name.text.len()) / 3 + 1)
            .min();
        self.error(name.range, format!("unknown {kind} `{}`", name.text))
            .with_help(near.map(|(_, own)| format!("did you mean `{own}`?")))
    }

    /// Declares the names of a declaration, so that others can use them before.
    fn declare(&mut self, declaration: &WrittenDeclaration) -> Result<(), GologError> {
        let name = &declaration.name;
        let line = self.line(name.range);
        match &declaration.content {
            WrittenContent::Mission => {
                self.theory.name = name.text.clone();
            }
            WrittenContent::Table { domains, .. } => {
                let domains = self.domains(domains, name.range)?;
                self.take_name(name, NamedPart::Table(self.theory.tables.len()))?;
                self.theory.tables.push(NumberTable { name: name.text.clone(), domains, values: Vec::new() });
            }
            WrittenContent::Fluent { domains, value_type, .. } => {
                let value = value_type.as_ref().map_or(Ok(TRUTH), |own| self.domain(own))?;
                self.declare_fluent(name, domains, value, false)?;
            }
            WrittenContent::Condition { domains, .. } => self.declare_fluent(name, domains, TRUTH, true)?,
            WrittenContent::Define { variables, .. } => {
                let domains = self.parameters(variables, name.range)?;
                self.take_name(name, NamedPart::Defined(self.theory.defined.len()))?;
                let formula = GologFormula::Constant(0);
                let name = name.text.clone();
                self.theory.defined.push(DefinedFluent { name, line, domains, formula, is_read: false });
            }
            WrittenContent::Action { variables, action } => {
                let domains = self.parameters(variables, name.range)?;
                let sizes = domains.iter().map(|domain| self.theory.domains[*domain].size());
                if action.is_exogenous && sizes.fold(1, usize::saturating_mul) > MOST_EXOGENOUS {
                    let reason =
                        format!("expected an exogenous action for at most {MOST_EXOGENOUS} arguments");
                    return Err(self.error(name.range, reason));
                }
                self.take_name(name, NamedPart::Action(self.theory.actions.len()))?;
                self.theory.actions.push(ActionModel {
                    name: name.text.clone(),
                    line,
                    domains,
                    is_exogenous: action.is_exogenous,
                    possible: None,
                    performs: None,
                    has_performs: action.performs.is_some(),
                    senses: None,
                    effects: Vec::new(),
                    failure_effects: None,
                    is_used: false,
                });
            }
            WrittenContent::Procedure { variables, .. } => {
                let domains = self.parameters(variables, name.range)?;
                self.take_name(name, NamedPart::Procedure(self.theory.procedures.len()))?;
                let (name, calls) = (name.text.clone(), Vec::new());
                self.theory.procedures.push(ProcedureModel { name, line, domains, body: 0, calls });
            }
            WrittenContent::Initially { .. } | WrittenContent::Symbols(_) | WrittenContent::Range(..) => {}
        }
        Ok(())
    }

    fn declare_fluent(
        &mut self,
        name: &WrittenName,
        domains: &[WrittenType],
        value: usize,
        is_condition: bool,
    ) -> Result<(), GologError> {
        let domains = self.domains(domains, name.range)?;
        self.take_name(name, NamedPart::Fluent(self.theory.fluents.len()))?;
        let base = self.theory.initial.len();
        let sizes = domains.iter().map(|domain| self.theory.domains[*domain].size());
        let count = sizes.fold(1usize, usize::saturating_mul);
        if base.saturating_add(count) > MOST_CELLS {
            let reason = format!("expected at most {MOST_CELLS} fluents, each counted for all its arguments");
            return Err(self.error(name.range, reason));
        }
        self.theory.initial.resize(base + count, crate::theory::formula::UNKNOWN);
        self.theory.fluents.push(FluentModel {
            name: name.text.clone(),
            line: self.line(name.range),
            domains,
            value,
            base,
            count,
            is_condition,
            is_read: false,
            is_written: false,
        });
        Ok(())
    }

    /// Builds the content of a declaration.
    /// `indices` count actions, defined fluents and procedures.
    fn define(
        &mut self,
        declaration: &WrittenDeclaration,
        indices: &mut [usize; 3],
    ) -> Result<(), GologError> {
        self.variables.clear();
        match &declaration.content {
            WrittenContent::Fluent { initial: Some(value), .. }
            | WrittenContent::Condition { initial: Some(value), .. } => {
                if let Some(NamedPart::Fluent(fluent)) = self.names.get(&declaration.name.text).copied() {
                    let FluentModel { base, count, value: domain, .. } = self.theory.fluents[fluent];
                    let value = self.constant(value, domain)?;
                    self.theory.initial[base..base + count].fill(value);
                }
            }
            WrittenContent::Initially { arguments, value } => {
                self.define_initial(&declaration.name, arguments, value)?;
            }
            WrittenContent::Table { entries, .. } => self.define_table(&declaration.name, entries)?,
            WrittenContent::Define { variables, formula } => {
                self.bind(variables)?;
                let built = self.truth(formula)?;
                self.theory.defined[indices[1]].formula = built;
                indices[1] += 1;
            }
            WrittenContent::Action { variables, action } => {
                self.bind(variables)?;
                self.define_action(indices[0], action)?;
                indices[0] += 1;
            }
            WrittenContent::Procedure { variables, body } => {
                self.bind(variables)?;
                ProgramBuilder::new(self, indices[2]).build(body)?;
                indices[2] += 1;
            }
            _ => {}
        }
        Ok(())
    }

    /// Adds variables to the scope.
    fn bind(&mut self, written: &[WrittenVariable]) -> Result<(), GologError> {
        written.iter().try_for_each(|variable| self.bind_one(variable).map(|_| ()))
    }

    /// Adds a variable to the scope; returns its slot and domain.
    fn bind_one(&mut self, written: &WrittenVariable) -> Result<(usize, usize), GologError> {
        let WrittenVariable { name, domain } = written;
        let domain = self.domain(domain)?;
        if let Some(part) = self.names.get(&name.text) {
            return Err(
                self.error(name.range, format!("the name `{}` is taken: it is {}", name.text, part.title()))
            );
        }
        if self.variables.iter().any(|variable| variable.name == name.text) {
            return Err(self.error(name.range, format!("the variable `{}` is there already", name.text)));
        }
        let slot = self.variables.len();
        if slot == MOST_VARIABLES {
            let reason = format!("expected at most {MOST_VARIABLES} variables at a time");
            return Err(self.error(name.range, reason));
        }
        self.variables.push(VisibleVariable { name: name.text.clone(), slot, domain });
        Ok((slot, domain))
    }
}

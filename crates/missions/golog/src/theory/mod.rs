//! Action theory: domains, fluents, actions and procedures.

pub(crate) mod formula;
pub(crate) mod program;

use formula::GologFormula;
use program::ProgramNode;

/// Maximum number of arguments of an action, fluent or procedure.
pub(crate) const MOST_ARGUMENTS: usize = 8;

/// Finite set of values: symbols, or numbers of a range.
#[derive(Clone, Debug)]
pub(crate) struct ValueDomain {
    pub name: String,
    pub low: i32,
    pub high: i32,
    /// Empty for numbers.
    pub symbols: Vec<String>,
}

impl ValueDomain {
    pub fn size(&self) -> usize {
        // A range is at most as large as the limit of domains.
        (i64::from(self.high) - i64::from(self.low) + 1) as usize
    }

    /// Returns the index of a value in the domain.
    pub fn index(&self, value: i32) -> Option<usize> {
        (self.low..=self.high).contains(&value).then(|| (i64::from(value) - i64::from(self.low)) as usize)
    }

    pub fn outside(&self, value: i32, name: &str) -> String {
        format!("expected a value of {} for `{name}`, found {value}", self.title())
    }

    pub fn title(&self) -> String {
        match self.symbols.is_empty() {
            true => format!("{}..{}", self.low, self.high),
            false => format!("`{}`", self.name),
        }
    }

    /// Returns the text of a value.
    pub fn text(&self, value: i32) -> String {
        match self.symbols.get(value as usize) {
            Some(symbol) => symbol.clone(),
            None => value.to_string(),
        }
    }

    /// Parses a text to a value of the domain.
    pub fn parse(&self, text: &str) -> Option<i32> {
        let value = match self.symbols.is_empty() {
            true => text.parse().ok()?,
            false => i32::try_from(self.symbols.iter().position(|symbol| symbol == text)?).ok()?,
        };
        self.index(value).map(|_| value)
    }
}

#[derive(Clone, Debug)]
pub(crate) struct FluentModel {
    pub name: String,
    pub line: usize,
    pub domains: Vec<usize>,
    pub value: usize,
    /// First cell of the fluent.
    pub base: usize,
    /// Number of its cells.
    pub count: usize,
    pub is_condition: bool,
    pub is_read: bool,
    pub is_written: bool,
}

#[derive(Clone, Debug)]
pub(crate) struct DefinedFluent {
    pub name: String,
    pub line: usize,
    pub domains: Vec<usize>,
    pub formula: GologFormula,
    pub is_read: bool,
}

/// Numbers by symbols, for arguments of the robot's actions.
#[derive(Clone, Debug)]
pub(crate) struct NumberTable {
    pub name: String,
    pub domains: Vec<usize>,
    pub values: Vec<f64>,
}

#[derive(Clone, Debug)]
pub(crate) struct ActionEffect {
    /// Slots and domains of the variables that it holds for.
    pub variables: Vec<(usize, usize)>,
    pub fluent: usize,
    pub arguments: Box<[GologFormula]>,
    pub value: GologFormula,
    pub condition: Option<GologFormula>,
}

/// Argument of an action of the robot.
#[derive(Clone, Debug)]
pub(crate) enum RobotArgument {
    Number(f64),
    Table(usize, Box<[GologFormula]>),
    Formula(GologFormula),
}

#[derive(Clone, Debug)]
pub(crate) struct ActionModel {
    pub name: String,
    pub line: usize,
    pub domains: Vec<usize>,
    pub is_exogenous: bool,
    pub possible: Option<GologFormula>,
    /// Name and arguments of the robot's action; `None` if it only changes fluents.
    pub performs: Option<(String, Vec<RobotArgument>)>,
    /// True if the text declares the performed action.
    pub has_performs: bool,
    /// Fluent and arguments.
    pub senses: Option<(usize, Box<[GologFormula]>)>,
    pub effects: Vec<ActionEffect>,
    /// `None` if a failure ends the mission.
    pub failure_effects: Option<Vec<ActionEffect>>,
    pub is_used: bool,
}

/// Action of the robot that performs one of a theory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PerformedAction<'a> {
    /// Name of the robot's action.
    pub name: &'a str,
    /// Number of its arguments.
    pub arguments: usize,
    /// Line of the theory's action, from 1.
    pub line: usize,
    /// True if the robot's arguments are known.
    /// The arguments of the theory's action are numbers, or `performs` gives those of the robot.
    pub is_plain: bool,
}

#[derive(Clone, Debug)]
pub(crate) struct ProcedureModel {
    pub name: String,
    pub line: usize,
    pub domains: Vec<usize>,
    pub body: usize,
    /// Procedures that it calls, in the order of the file.
    pub calls: Vec<usize>,
}

/// Variable that is visible in a part of a program, and the scope around it.
#[derive(Clone, Debug)]
pub(crate) struct VariableScope {
    pub outer: Option<usize>,
    pub name: String,
    pub slot: usize,
    pub domain: usize,
}

/// Action theory and its procedures, read from text.
#[derive(Clone, Debug, Default)]
pub struct ActionTheory {
    pub(crate) name: String,
    pub(crate) domains: Vec<ValueDomain>,
    pub(crate) fluents: Vec<FluentModel>,
    pub(crate) defined: Vec<DefinedFluent>,
    pub(crate) tables: Vec<NumberTable>,
    pub(crate) actions: Vec<ActionModel>,
    pub(crate) procedures: Vec<ProcedureModel>,
    pub(crate) nodes: Vec<ProgramNode>,
    pub(crate) scopes: Vec<VariableScope>,
    /// Value of each cell at the start.
    pub(crate) initial: Vec<i32>,
    /// Index of the procedure `main`.
    pub(crate) main: usize,
}

impl ActionTheory {
    /// Returns the name of the mission.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the names of actions that a program performs, in the order of the file.
    pub fn actions(&self) -> impl Iterator<Item = &str> {
        self.actions.iter().filter(|action| !action.is_exogenous).map(|action| action.name.as_str())
    }

    /// Returns how the robot performs each action, in the order of the file.
    pub fn robot_actions(&self) -> impl Iterator<Item = PerformedAction<'_>> {
        let own = self.actions.iter().filter(|action| !action.is_exogenous);
        own.filter_map(|action| {
            let (name, arguments) = action.performs.as_ref()?;
            let (arguments, line) = (arguments.len(), action.line);
            let is_plain = action.has_performs
                || action.domains.iter().all(|domain| self.domains[*domain].symbols.is_empty());
            Some(PerformedAction { name, arguments, line, is_plain })
        })
    }

    /// Returns the names of procedures, in the order of the file.
    pub fn procedures(&self) -> impl Iterator<Item = &str> {
        self.procedures.iter().map(|procedure| procedure.name.as_str())
    }

    /// Returns the number of fluents, those with arguments once for all their values.
    pub fn fluents(&self) -> usize {
        self.initial.len()
    }

    /// Returns the names with arguments of conditions, such as `door_is_open(kitchen)`.
    pub fn conditions(&self) -> Vec<String> {
        let conditions = self.fluents.iter().filter(|fluent| fluent.is_condition);
        conditions.flat_map(|fluent| (0..fluent.count).map(|cell| self.cell_name(fluent, cell))).collect()
    }

    /// Returns the names with arguments of exogenous actions, such as `closes(door)`.
    pub fn exogenous_actions(&self) -> Vec<String> {
        let exogenous = self.actions.iter().filter(|action| action.is_exogenous);
        let names = exogenous.map(|action| {
            let count = (0..self.combinations(&action.domains))
                .map(|index| self.arguments_at(&action.domains, index));
            count
                .map(|arguments| self.call_name(&action.name, &action.domains, &arguments))
                .collect::<Vec<String>>()
        });
        names.flatten().collect()
    }

    /// Returns the text of a fluent with the arguments of one of its cells.
    pub(crate) fn cell_name(&self, fluent: &FluentModel, cell: usize) -> String {
        self.call_name(&fluent.name, &fluent.domains, &self.arguments_at(&fluent.domains, cell))
    }

    /// Returns the number of combinations of arguments.
    pub(crate) fn combinations(&self, domains: &[usize]) -> usize {
        domains.iter().map(|domain| self.domains[*domain].size()).product()
    }

    /// Arguments of a number; the last one counts fastest.
    pub(crate) fn arguments_at(&self, domains: &[usize], number: usize) -> Vec<i32> {
        let mut rest = number;
        let mut arguments = Vec::new();
        for domain in domains.iter().rev() {
            let domain = &self.domains[*domain];
            // An index within a domain fits.
            arguments.push(domain.low + (rest % domain.size()) as i32);
            rest /= domain.size();
        }
        arguments.reverse();
        arguments
    }

    /// Returns the text of a name with arguments.
    pub(crate) fn call_name(&self, name: &str, domains: &[usize], arguments: &[i32]) -> String {
        if domains.is_empty() {
            return name.into();
        }
        let texts = domains.iter().zip(arguments).map(|(domain, value)| self.domains[*domain].text(*value));
        format!("{name}({})", texts.collect::<Vec<String>>().join(", "))
    }

    /// Parses the arguments in a text such as `f(a, 2)`.
    /// `None` if its name and its domains are others.
    pub(crate) fn parse_call(&self, text: &str, name: &str, domains: &[usize]) -> Option<Vec<i32>> {
        let rest = text.strip_prefix(name)?;
        if domains.is_empty() {
            return rest.is_empty().then(Vec::new);
        }
        let inner = rest.strip_prefix('(')?.strip_suffix(')')?;
        let texts: Vec<&str> = inner.split(',').map(str::trim).collect();
        if texts.len() != domains.len() {
            return None;
        }
        texts.iter().zip(domains).map(|(text, domain)| self.domains[*domain].parse(text)).collect()
    }

    /// Returns the cell of a fluent with arguments.
    pub(crate) fn cell_of(&self, fluent: &FluentModel, arguments: &[i32]) -> Option<usize> {
        let mut cell = 0;
        for (value, domain) in arguments.iter().zip(&fluent.domains) {
            let domain = &self.domains[*domain];
            cell = cell * domain.size() + domain.index(*value)?;
        }
        Some(fluent.base + cell)
    }

    /// Returns the entry of a table.
    pub(crate) fn entry(&self, table: &NumberTable, keys: &[i32]) -> Option<f64> {
        let mut entry = 0;
        for (value, domain) in keys.iter().zip(&table.domains) {
            let domain = &self.domains[*domain];
            entry = entry * domain.size() + domain.index(*value)?;
        }
        table.values.get(entry).copied()
    }
}

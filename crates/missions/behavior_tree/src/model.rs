//! Models of leaves: the actions and conditions that a tree may name.

use slate_sorted::SortedMap;

/// Kind of a leaf: action or condition.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LeafKind {
    /// Acts on the world, over several ticks.
    Action,
    /// Condition, answered within a tick.
    Condition,
}

/// Direction of a port.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PortDirection {
    /// Port that the leaf reads.
    Input,
    /// Port that the leaf writes.
    Output,
    /// Port that the leaf reads and writes.
    InOut,
}

/// Port of a leaf.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PortModel {
    /// Name of the attribute.
    pub name: String,
    /// Direction.
    pub direction: PortDirection,
    /// Value where the tree has none; an input without one must be given.
    pub default: Option<String>,
}

/// Kind and ports of a leaf.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LeafModel {
    /// Kind: action or condition.
    pub kind: LeafKind,
    /// Ports, or `None` if any are allowed.
    pub ports: Option<Vec<PortModel>>,
}

/// Numbers by the names that scripts have for them.
pub(crate) type Enumerations = SortedMap<String, f64>;

/// Models by names, and names of numbers.
/// The models of a file's `TreeNodesModel` are added to them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LeafModels {
    models: SortedMap<String, LeafModel>,
    enumerations: Enumerations,
}

impl LeafModels {
    /// Adds an action, with any ports.
    pub fn action(self, name: &str) -> Self {
        self.with(name, LeafModel { kind: LeafKind::Action, ports: None })
    }

    /// Adds a condition, with any ports.
    pub fn condition(self, name: &str) -> Self {
        self.with(name, LeafModel { kind: LeafKind::Condition, ports: None })
    }

    /// Adds a model.
    pub fn with(mut self, name: &str, model: LeafModel) -> Self {
        self.insert(name, model);
        self
    }

    /// Adds a name that scripts and the cases of a `Switch` may use for a number.
    pub fn enumeration(mut self, name: &str, number: i32) -> Self {
        self.enumerations.insert(name.into(), number.into());
        self
    }

    pub(crate) fn enumerations(&self) -> &Enumerations {
        &self.enumerations
    }

    pub(crate) fn insert(&mut self, name: &str, model: LeafModel) {
        self.models.insert(name.into(), model);
    }

    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.models.keys().map(String::as_str)
    }

    pub(crate) fn get(&self, name: &str) -> Option<&LeafModel> {
        self.models.get(name)
    }
}

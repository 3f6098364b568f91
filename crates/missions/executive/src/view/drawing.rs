//! Drawing of a mission: what does not change while its file is the same.

use slate_plugin::prelude::*;

use crate::activity_hash::ActivityHash;

/// Number for no element.
pub const NO_ELEMENT: u16 = u16::MAX;

/// Maximum number of elements of a graph.
/// Its values are small enough for the last seconds that an agent keeps.
pub const MOST_ELEMENTS: usize = 640;

/// Notation of a mission.
#[interface]
pub enum MissionNotation {
    /// Petri Net Plan.
    PetriNet,
    /// Behavior tree.
    BehaviorTree,
    /// State machines of skills.
    StateMachines,
    /// Golog program.
    GologProgram,
}

/// Kind of an element of a mission.
#[interface]
pub enum MissionElementKind {
    /// Net, or state machine, whose elements name it as their parent.
    Group,
    /// Place of a net.
    Place,
    /// Transition of a net.
    Transition,
    /// State of a machine.
    State,
    /// Arc of a net, or transition of a machine, from one element to another.
    Edge,
    /// Node of a tree, or part of a program, that has parts.
    Control,
    /// Node of a tree, or part of a program.
    /// It has no parts that the executive performs itself.
    Step,
    /// Action of the robot.
    Action,
    /// Condition that the robot answers.
    Condition,
    /// Exogenous action of a Golog program.
    Event,
}

/// Mark of an element.
#[interface]
pub enum MissionMark {
    /// No mark.
    Plain,
    /// Start of the mission.
    Start,
    /// Success of the mission.
    Goal,
    /// Failure of the mission.
    Failure,
    /// Transition that follows when time is over.
    Timeout,
    /// Place whose action runs while it has a token.
    Performs,
}

/// Element of a mission.
#[interface]
#[derive(PartialEq)]
pub struct MissionElement {
    /// Kind.
    pub kind: MissionElementKind,
    /// Mark of the element.
    pub mark: MissionMark,
    /// Number of the group or node that it belongs to; 65535 for none.
    pub parent: u16,
    /// Number of the element at which an edge begins; 65535 for other elements.
    pub from: u16,
    /// Number of the element to which an edge leads; 65535 for other elements.
    pub to: u16,
    /// Tokens that an arc moves; 0 for other elements.
    pub weight: u16,
    /// Label in the file.
    pub label: Text<76>,
}

/// Drawing of a mission; elements are numbered in their order, from 0.
#[interface]
pub struct MissionGraph {
    /// Notation of the mission.
    pub notation: MissionNotation,
    /// Number that another drawing does not have.
    pub id: u32,
    /// True if elements are missing, as the mission has more than fit.
    pub is_cut: Bool,
    /// Name of the mission.
    pub name: Text<60>,
    /// Elements: groups and nodes, then edges.
    pub elements: [MissionElement],
}

/// Elements of a mission.
#[derive(Default)]
pub struct MissionDrawing {
    name: String,
    elements: Vec<MissionElement>,
    is_cut: bool,
}

impl MissionDrawing {
    /// Returns an empty drawing of a mission of that name.
    pub fn new(name: &str) -> Self {
        Self { name: name.into(), ..Self::default() }
    }

    /// Adds an element other than an edge.
    /// A parent that is no element's number means no parent.
    pub fn node(&mut self, kind: MissionElementKind, mark: MissionMark, parent: usize, label: &str) {
        let (from, to) = (NO_ELEMENT, NO_ELEMENT);
        let parent = number(parent);
        self.add(MissionElement { kind, mark, parent, from, to, weight: 0, label: cut(label) });
    }

    /// Adds an edge between two elements.
    pub fn edge(&mut self, (from, to): (usize, usize), mark: MissionMark, weight: u32, label: &str) {
        self.add(MissionElement {
            kind: MissionElementKind::EDGE,
            mark,
            parent: NO_ELEMENT,
            from: number(from),
            to: number(to),
            weight: u16::try_from(weight).unwrap_or(u16::MAX),
            label: cut(label),
        });
    }

    fn add(&mut self, element: MissionElement) {
        if self.elements.len() < MOST_ELEMENTS {
            self.elements.push(element);
        } else {
            self.is_cut = true;
        }
    }

    /// Returns a number that depends on all elements; never 0.
    pub fn id(&self) -> u32 {
        let mut hash = ActivityHash::default();
        hash.text(&self.name);
        for MissionElement { kind, mark, parent, from, to, weight, label } in &self.elements {
            let numbers = [u64::from(kind.0), u64::from(mark.0)];
            numbers.into_iter().for_each(|number| hash.number(number));
            [parent, from, to, weight].into_iter().for_each(|number| hash.number(u64::from(*number)));
            hash.text(label.as_str());
        }
        // The lower half is as good as all.
        (hash.finish() as u32).max(1)
    }

    /// Writes the graph, as far as it fits.
    pub fn write(&self, notation: MissionNotation, port: &Output<MissionGraph>) {
        let count = self.elements.len().min(port.capacity());
        port.write(count, |graph| {
            graph.notation = notation;
            graph.id = self.id();
            graph.is_cut = (self.is_cut || count < self.elements.len()).into();
            graph.name = Text::new(&self.name);
            graph.elements.copy_from_slice(&self.elements[..count]);
        });
    }
}

fn number(index: usize) -> u16 {
    u16::try_from(index).unwrap_or(NO_ELEMENT)
}

/// Returns a label, with a mark if it is cut.
fn cut<const N: usize>(text: &str) -> Text<N> {
    let label: Text<N> = Text::new(text);
    if label.as_str().len() == text.len() {
        return label;
    }
    let mut end = N - '…'.len_utf8();
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    Text::new(&format!("{}…", &text[..end]))
}

//! Plans of several robots in one net, and the part of each robot.

use slate_sorted::SortedSet;

use crate::error::NetError;
use crate::guard::NetGuard;
use crate::net::{NetPlace, NetTransition, PetriNet};

/// Net for several robots.
/// `@r1` in the label of each place names the robot that it belongs to.
///
/// A transition is fired by the robots of the places that it takes from: by one alone, or by several at once, which is a
/// hard synchronization. Tokens that it puts into places of other robots are a soft synchronization: they are sent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JointNet {
    net: PetriNet,
    /// Names of the robots, in order.
    robots: Vec<String>,
    /// Robot of each place.
    owners: Vec<usize>,
    /// Robots that fire each transition, in order.
    firing: Vec<Vec<usize>>,
}

/// Part of a [`JointNet`] that one robot executes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RobotNet {
    /// Net, without the robot's name in actions, conditions and labels of places.
    pub net: PetriNet,
    /// Transitions that it fires together with others.
    pub hard: Vec<HardSynchronization>,
    /// Transitions that send tokens: index, and identifier of the tokens.
    pub sent: Vec<(usize, String)>,
    /// Transitions that stand for one of another robot, and put its tokens.
    pub received: Vec<ReceivedTokens>,
}

/// Transition that several robots fire at once.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HardSynchronization {
    /// Index in the robot's net.
    pub transition: usize,
    /// Identifier in the file.
    pub id: String,
    /// Robots that fire it, in order: the first one decides.
    pub robots: Vec<String>,
}

/// Transition that receives the tokens sent by another robot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReceivedTokens {
    /// Index in the robot's net.
    pub transition: usize,
    /// Identifier of the tokens.
    pub id: String,
    /// Sender.
    pub robot: String,
}

/// Splits `goto_6_2@r1` into `goto_6_2` and `r1`.
pub(crate) fn split_robot(text: &str) -> (&str, Option<&str>) {
    match text.rsplit_once('@') {
        Some((name, robot)) => (name, Some(robot)),
        None => (text, None),
    }
}

/// Returns the robots that the words of a label name alone, such as `@r1`.
fn words(label: &str) -> impl Iterator<Item = &str> {
    label.split_whitespace().filter_map(|word| word.strip_prefix('@')).filter(|robot| !robot.contains('.'))
}

impl JointNet {
    /// Returns the joint plan of a net.
    /// `None` if its labels name no robot.
    ///
    /// # Errors
    /// If a place has no robot, or a transition that of an action or a condition does not fire.
    pub fn new(net: &PetriNet) -> Result<Option<Self>, NetError> {
        let named = net.actions.iter().chain(&net.conditions).filter_map(|text| split_robot(text).1);
        let alone = net.places.iter().flat_map(|place| words(&place.name));
        let names: SortedSet<&str> = named.chain(alone).collect();
        if names.is_empty() {
            return Ok(None);
        }
        let is_plain = |name: &&str| {
            !name.is_empty() && name.chars().all(|sign| sign.is_alphanumeric() || "_-".contains(sign))
        };
        if let Some(name) = names.iter().find(|name| !is_plain(name)) {
            return Err(NetError::new(format!(
                "expected the name of a robot such as `@r1`, found `@{name}`"
            )));
        }
        let robots: Vec<String> = names.into_iter().map(Into::into).collect();
        let owners = net.places.iter().map(|place| owner(net, place, &robots)).collect::<Result<_, _>>()?;
        let mut joint = Self { net: net.clone(), robots, owners, firing: Vec::new() };
        joint.firing =
            net.transitions.iter().map(|transition| joint.firing_of(transition)).collect::<Result<_, _>>()?;
        for robot in 0..joint.robots.len() {
            joint.part(robot)?;
        }
        Ok(Some(joint))
    }

    fn firing_of(&self, transition: &NetTransition) -> Result<Vec<usize>, NetError> {
        let firing: SortedSet<usize> =
            transition.inputs.iter().map(|(place, _)| self.owners[*place]).collect();
        if firing.is_empty() {
            let title = transition.title();
            return Err(NetError::new(format!(
                "transition {title} has no place before it, and so no robot fires it"
            )));
        }
        let named = words(&transition.name).map(Some);
        let events = transition.events.iter().filter(|(action, event)| {
            // A token that arrives at another robot starts the action there.
            let arrives = |(place, _): &(usize, u32)| self.net.places[*place].action == Some(*action);
            !(event.activates() && transition.outputs.iter().any(arrives))
        });
        let actions = events.map(|(action, _)| split_robot(&self.net.actions[*action]).1);
        for robot in named.chain(actions) {
            let Some(robot) = robot else {
                return Err(NetError::new(format!(
                    "transition {} has an action without a robot, such as `look@{}`",
                    transition.title(),
                    self.robots[0]
                )));
            };
            if !firing.iter().any(|own| self.robots[*own] == robot) {
                return Err(NetError::new(format!(
                    "transition {} is not fired by `{robot}`: expected a place of that robot before it",
                    transition.title()
                )));
            }
        }
        Ok(firing.into_iter().collect())
    }

    /// Returns the net of all robots.
    pub fn net(&self) -> &PetriNet {
        &self.net
    }

    /// Returns the names of the robots, in order.
    pub fn robots(&self) -> &[String] {
        &self.robots
    }

    /// Returns the robot that a place belongs to, an index of [`Self::robots`].
    pub fn owner(&self, place: usize) -> usize {
        self.owners[place]
    }

    /// Returns the robots that fire a transition, in order.
    /// Several for a hard synchronization.
    pub fn firing(&self, transition: usize) -> &[usize] {
        &self.firing[transition]
    }

    /// Returns the part of a robot; `None` if the net does not name it.
    pub fn robot(&self, name: &str) -> Option<RobotNet> {
        let robot = self.robots.iter().position(|robot| robot == name)?;
        // All parts were made once.
        self.part(robot).ok()
    }

    fn part(&self, robot: usize) -> Result<RobotNet, NetError> {
        let mut part =
            RobotPart { joint: self, robot, places: Vec::new(), made: RobotNet::empty(&self.net.name) };
        part.add_places();
        for (index, transition) in self.net.transitions.iter().enumerate() {
            part.add_transition(index, transition)?;
        }
        Ok(part.made)
    }
}

fn owner(net: &PetriNet, place: &NetPlace, robots: &[String]) -> Result<usize, NetError> {
    let action = place.action.map(|action| {
        let text = &net.actions[action];
        split_robot(text).1.ok_or_else(|| {
            NetError::new(format!(
                "place `{}`: expected a robot, such as `{text}@{}.exec`",
                place.id, robots[0]
            ))
        })
    });
    let mut named: Vec<&str> = words(&place.name).chain(action.transpose()?).collect();
    named.dedup();
    match named[..] {
        // The names of all labels are known.
        [robot] => Ok(robots.iter().position(|other| other == robot).unwrap_or_default()),
        [] => Err(NetError::new(format!(
            "place `{}` (`{}`) belongs to no robot: expected one in its label, such as `@{}`",
            place.id, place.name, robots[0]
        ))),
        _ => Err(NetError::new(format!(
            "place `{}` belongs to one robot, found `{}`",
            place.id,
            named.join("` and `")
        ))),
    }
}

impl RobotNet {
    fn empty(name: &str) -> Self {
        let net = PetriNet {
            name: name.into(),
            places: Vec::new(),
            transitions: Vec::new(),
            actions: Vec::new(),
            conditions: Vec::new(),
        };
        Self { net, hard: Vec::new(), sent: Vec::new(), received: Vec::new() }
    }
}

/// Builder of a robot's part.
struct RobotPart<'a> {
    joint: &'a JointNet,
    robot: usize,
    /// Place in the part of each place of the joint net.
    places: Vec<Option<usize>>,
    made: RobotNet,
}

impl<'a> RobotPart<'a> {
    fn add_places(&mut self) {
        let joint = self.joint;
        let suffix = format!("@{}", joint.robots[self.robot]);
        for (place, owner) in joint.net.places.iter().zip(&joint.owners) {
            let is_own = *owner == self.robot;
            self.places.push(is_own.then_some(self.made.net.places.len()));
            if is_own {
                let action = place.action.map(|action| self.action(action));
                let name = place.name.replace(&suffix, "").trim().into();
                self.made.net.places.push(NetPlace { action, name, ..place.clone() });
            }
        }
    }

    fn action(&mut self, action: usize) -> usize {
        intern(&mut self.made.net.actions, split_robot(&self.joint.net.actions[action]).0)
    }

    fn own(&self, arcs: &[(usize, u32)]) -> Vec<(usize, u32)> {
        arcs.iter().filter_map(|(place, weight)| Some((self.places[*place]?, *weight))).collect()
    }

    fn add_transition(&mut self, index: usize, transition: &NetTransition) -> Result<(), NetError> {
        let joint = self.joint;
        let firing = &joint.firing[index];
        let (inputs, outputs) = (self.own(&transition.inputs), self.own(&transition.outputs));
        let at = self.made.net.transitions.len();
        let id = transition.id.clone();
        let made = NetTransition { inputs, outputs, events: Vec::new(), guard: None, ..transition.clone() };
        if !firing.contains(&self.robot) {
            if !made.outputs.is_empty() {
                let (id, robot) = (sent_id(&id), joint.robots[firing[0]].clone());
                self.made.net.transitions.push(made);
                self.made.received.push(ReceivedTokens { transition: at, id, robot });
            }
            return Ok(());
        }
        let robot = joint.robots[self.robot].as_str();
        let own = |action: &usize| split_robot(&joint.net.actions[*action]).1 == Some(robot);
        let events = transition.events.iter().filter(|(action, _)| own(action));
        let events = events.map(|(action, event)| (self.action(*action), *event)).collect();
        let guard = match &transition.guard {
            Some(guard) => self
                .guard(guard, firing.len())
                .map_err(|reason| NetError::new(format!("transition {}: {reason}", transition.title())))?,
            None => None,
        };
        self.made.net.transitions.push(NetTransition { events, guard, ..made });
        if firing.len() > 1 {
            let robots = firing.iter().map(|robot| joint.robots[*robot].clone()).collect();
            self.made.hard.push(HardSynchronization { transition: at, id: id.clone(), robots });
        }
        let leaves = |(place, _): &(usize, u32)| !firing.contains(&joint.owners[*place]);
        if firing[0] == self.robot && transition.outputs.iter().any(leaves) {
            self.made.sent.push((at, sent_id(&id)));
        }
        Ok(())
    }

    /// Returns the part of a guard that the robot evaluates.
    /// Operands of a conjunction without a robot are each robot's.
    fn guard(&mut self, guard: &NetGuard, robots: usize) -> Result<Option<NetGuard>, String> {
        let operands = match guard {
            NetGuard::And(operands) if robots > 1 => operands.as_slice(),
            _ => std::slice::from_ref(guard),
        };
        let own = self.joint.robots[self.robot].as_str();
        let mut kept = Vec::new();
        for operand in operands {
            let mut named = SortedSet::new();
            operand.atoms(&mut |atom| named.extend(self.robot_of(atom)));
            let names: Vec<&str> = named.into_iter().collect();
            match names[..] {
                [] => kept.push(self.renamed(operand)),
                [robot] if robot == own => kept.push(self.renamed(operand)),
                // Another robot evaluates it.
                [_] if robots > 1 => {}
                [robot] => {
                    return Err(format!(
                        "`{own}` does not know what `{robot}` sees: expected a place that `{robot}` puts a token into"
                    ));
                }
                _ => {
                    return Err(format!(
                        "expected parts of several robots that `and` joins, found one of `{}`",
                        names.join("` and `")
                    ));
                }
            }
        }
        Ok(match kept.len() {
            0 => None,
            1 => kept.pop(),
            _ => Some(NetGuard::And(kept)),
        })
    }

    fn robot_of(&self, atom: &NetGuard) -> Option<&'a str> {
        let net = &self.joint.net;
        match atom {
            NetGuard::Condition(index) => split_robot(&net.conditions[*index]).1,
            NetGuard::Action(index, _) => split_robot(&net.actions[*index]).1,
            _ => None,
        }
    }

    /// Returns the guard with the indices of the part.
    fn renamed(&mut self, guard: &NetGuard) -> NetGuard {
        match guard {
            NetGuard::Condition(index) => {
                let name = split_robot(&self.joint.net.conditions[*index]).0;
                NetGuard::Condition(intern(&mut self.made.net.conditions, name))
            }
            NetGuard::Action(index, query) => NetGuard::Action(self.action(*index), *query),
            NetGuard::Not(operand) => NetGuard::Not(Box::new(self.renamed(operand))),
            NetGuard::And(operands) => NetGuard::And(operands.iter().map(|one| self.renamed(one)).collect()),
            NetGuard::Or(operands) => NetGuard::Or(operands.iter().map(|one| self.renamed(one)).collect()),
        }
    }
}

/// Returns the identifier of the tokens that a transition sends.
/// It differs from that of a hard synchronization.
fn sent_id(id: &str) -> String {
    format!("{id}>")
}

fn intern(names: &mut Vec<String>, name: &str) -> usize {
    names.iter().position(|other| other == name).unwrap_or_else(|| {
        names.push(name.into());
        names.len() - 1
    })
}

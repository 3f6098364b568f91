//! Plan with its sub-plans.

use std::path::Path;

use slate_sorted::SortedMap;

use crate::error::NetError;
use crate::joint::JointNet;
use crate::label::{action_arguments, action_name};
use crate::net::PetriNet;
use crate::pnml::read_pnml;

/// Maximum number of runs of sub-plans in a plan.
const MOST_INSTANCES: usize = 1024;
/// Deepest nesting of sub-plans.
const DEPTH: usize = 32;

/// Plan with the sub-plans that its actions name, ready to run.
///
/// An action is a sub-plan where a net has its name, arguments included: `patrol_2` is the net `patrol_2`.
#[derive(Clone, Debug)]
pub struct PetriPlan {
    pub(crate) nets: Vec<PetriNet>,
    pub(crate) instances: Vec<NetRun>,
    /// Actions that the host performs.
    pub(crate) actions: Vec<PlanAction>,
    pub(crate) conditions: Vec<String>,
    pub(crate) places: usize,
    pub(crate) states: usize,
}

/// Net in the tree of sub-plans.
#[derive(Clone, Debug)]
pub(crate) struct NetRun {
    pub net: usize,
    /// Names of the nets and actions that lead to it, such as `patrol/inspect_3`.
    pub path: String,
    /// Index of the first place among those of all instances.
    pub places: usize,
    /// Index of the first action among those of all instances.
    pub states: usize,
    /// Performer of each action.
    pub performers: Vec<Performer>,
    /// Number in the plan of each condition.
    pub conditions: Vec<usize>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Performer {
    /// Action of the host, by its number.
    Host(usize),
    /// Sub-plan.
    Instance(usize),
}

/// Action that the host performs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlanAction {
    text: String,
    path: String,
}

impl PlanAction {
    /// Returns the action with its arguments, as in the net: `goto_6_2`.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Returns the name: `goto`.
    pub fn name(&self) -> &str {
        action_name(&self.text)
    }

    /// Returns the arguments: `6` and `2`.
    pub fn arguments(&self) -> impl Iterator<Item = &str> {
        action_arguments(&self.text)
    }

    /// Returns the plan that it belongs to, with those above: `patrol/inspect_3`.
    pub fn path(&self) -> &str {
        &self.path
    }
}

impl PetriPlan {
    /// Reads a plan and its sub-plans.
    /// Sub-plans are the files `NAME.pnml` of the same folder.
    pub fn read(file: &Path) -> Result<Self, NetError> {
        Self::with_folder(read_pnml(file)?, file)
    }

    /// Combines a net of a file with the sub-plans in the file's folder.
    /// The net is, for example, a robot's part.
    pub fn with_folder(root: PetriNet, file: &Path) -> Result<Self, NetError> {
        let folder = file.parent().unwrap_or(Path::new(""));
        Self::new(root, |name| {
            let file = folder.join(format!("{name}.pnml"));
            // A name with other signs is not a file's.
            let is_plain = name.chars().all(|sign| sign.is_alphanumeric() || "_-.".contains(sign));
            if !is_plain || !file.is_file() {
                return Ok(None);
            }
            let net = read_pnml(&file)?;
            match JointNet::new(&net) {
                Ok(None) => Ok(Some(net)),
                _ => Err(NetError::new("expected a sub-plan of one robot, without `@` in its labels")
                    .of_file(&file)),
            }
        })
        .map_err(|error| error.of_file(file))
    }

    /// Combines a net with the sub-plans that `find` returns by their names.
    pub fn new(
        root: PetriNet,
        mut find: impl FnMut(&str) -> Result<Option<PetriNet>, NetError>,
    ) -> Result<Self, NetError> {
        let mut plan = Self {
            nets: Vec::new(),
            instances: Vec::new(),
            actions: Vec::new(),
            conditions: Vec::new(),
            places: 0,
            states: 0,
        };
        let name = root.name().to_owned();
        let mut known = SortedMap::from([(name.clone(), Some(0))]);
        plan.nets.push(root);
        plan.add(0, name, &mut Vec::new(), &mut known, &mut find)?;
        Ok(plan)
    }

    /// Adds a run of a net, and those inside; returns its index.
    fn add(
        &mut self,
        net: usize,
        path: String,
        above: &mut Vec<usize>,
        known: &mut SortedMap<String, Option<usize>>,
        find: &mut impl FnMut(&str) -> Result<Option<PetriNet>, NetError>,
    ) -> Result<usize, NetError> {
        self.check_nesting(net, &path, above)?;
        above.push(net);
        let index = self.instances.len();
        let texts = self.nets[net].actions.clone();
        let names = self.nets[net].conditions.clone();
        let conditions = names.into_iter().map(|name| intern(&mut self.conditions, name)).collect();
        let (places, states) = (self.places, self.states);
        let instance = NetRun { net, path: path.clone(), places, states, performers: Vec::new(), conditions };
        self.instances.push(instance);
        self.places += self.nets[net].places.len();
        self.states += texts.len();
        for text in texts {
            let sub_plan = match known.get(&text) {
                Some(found) => *found,
                None => {
                    let found = find(&text)?;
                    let found = found.map(|net| {
                        self.nets.push(net);
                        self.nets.len() - 1
                    });
                    known.insert(text.clone(), found);
                    found
                }
            };
            let performer = match sub_plan {
                Some(net) => {
                    Performer::Instance(self.add(net, format!("{path}/{text}"), above, known, find)?)
                }
                None => {
                    self.actions.push(PlanAction { text, path: path.clone() });
                    Performer::Host(self.actions.len() - 1)
                }
            };
            self.instances[index].performers.push(performer);
        }
        above.pop();
        Ok(index)
    }

    fn check_nesting(&self, net: usize, path: &str, above: &[usize]) -> Result<(), NetError> {
        if above.contains(&net) {
            return Err(NetError::new(format!(
                "a plan can't be a part of itself: `{path}` leads back to `{}`",
                self.nets[net].name()
            )));
        }
        if above.len() >= DEPTH {
            return Err(NetError::new(format!("expected at most {DEPTH} levels of sub-plans: `{path}`")));
        }
        if self.instances.len() >= MOST_INSTANCES {
            return Err(NetError::new(format!("expected at most {MOST_INSTANCES} sub-plans, found more")));
        }
        Ok(())
    }

    /// Returns the net of the plan itself.
    pub fn net(&self) -> &PetriNet {
        &self.nets[0]
    }

    /// Returns the plan's net and those of its sub-plans, each once.
    pub fn nets(&self) -> &[PetriNet] {
        &self.nets
    }

    /// Returns the actions that the host performs, those of sub-plans included.
    pub fn actions(&self) -> &[PlanAction] {
        &self.actions
    }

    /// Returns the conditions that the host answers, those of sub-plans included.
    pub fn conditions(&self) -> &[String] {
        &self.conditions
    }

    /// Returns whether an action of a net is a sub-plan.
    pub fn is_sub_plan(&self, action: &str) -> bool {
        self.instances.iter().any(|instance| {
            let texts = &self.nets[instance.net].actions;
            let own = texts.iter().zip(&instance.performers);
            own.into_iter()
                .any(|(text, performer)| text == action && matches!(performer, Performer::Instance(_)))
        })
    }
}

fn intern(names: &mut Vec<String>, name: String) -> usize {
    names.iter().position(|other| *other == name).unwrap_or_else(|| {
        names.push(name);
        names.len() - 1
    })
}

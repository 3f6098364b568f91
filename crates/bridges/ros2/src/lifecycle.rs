//! State of the agent as a lifecycle node.
//!
//! A node is `active` while all actuators are armed, else `inactive`; without actuators it is always active.

use std::sync::Arc;

use serde_json::{Value as Json, json};
use slate_control::ControlSurface;
use slate_ros_messages::WireFormat;
use slate_runtime::Composer;
use slate_topics::{AgentOperations, NodeAccess, RosError, ServiceType};

use crate::services::{ServiceGroup, ServiceHandler, ServiceServer};
use crate::settings::{RosSettings, TABLE};
use crate::wire::NodeWire;

/// Messages in services and events.
pub const MESSAGES: &str = "\
====
MSG: lifecycle_msgs/State
uint8 id
string label
====
MSG: lifecycle_msgs/Transition
uint8 id
string label
====
MSG: lifecycle_msgs/TransitionDescription
Transition transition
State start_state
State goal_state
";

/// Operation of a lifecycle service.
#[derive(Clone, Copy, Debug)]
enum LifecycleService {
    GetState,
    ChangeState,
    States,
    Transitions,
    Graph,
}

/// Name in the node, type, definition and operation.
const SERVICES: [(&str, &str, &str, LifecycleService); 5] = [
    ("get_state", "GetState", "---\nState current_state", LifecycleService::GetState),
    (
        "change_state",
        "ChangeState",
        "Transition transition\n---\nbool success",
        LifecycleService::ChangeState,
    ),
    ("get_available_states", "GetAvailableStates", "---\nState[] available_states", LifecycleService::States),
    ("get_available_transitions", "GetAvailableTransitions", TRANSITIONS, LifecycleService::Transitions),
    ("get_transition_graph", "GetAvailableTransitions", TRANSITIONS, LifecycleService::Graph),
];

const TRANSITIONS: &str = "---\nTransitionDescription[] available_transitions";

/// Reason of a stop that a transition made, and that a transition ends.
const DEACTIVATED: &str = "deactivated by ROS";

/// State of an agent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AgentState {
    Inactive,
    Active,
}

/// States, with numbers and names as in `lifecycle_msgs/msg/State`.
const STATES: [AgentState; 2] = [AgentState::Inactive, AgentState::Active];

impl AgentState {
    /// Returns the present state.
    pub fn of(composer: &Composer) -> Self {
        let is_armed = |(name, _): (String, Option<String>)| {
            let mode = composer.board().read(&format!("{name}/gate/mode")).ok().flatten();
            mode.is_some_and(|(mode, _)| mode.as_str() == Some("ARMED"))
        };
        if composer.actuators().into_iter().all(is_armed) { Self::Active } else { Self::Inactive }
    }

    fn message(self) -> Json {
        match self {
            Self::Inactive => json!({ "id": 2, "label": "inactive" }),
            Self::Active => json!({ "id": 3, "label": "active" }),
        }
    }

    /// Returns the transition that leaves the state, and its destination.
    fn transition(self) -> (u64, &'static str, Self) {
        match self {
            Self::Inactive => (3, "activate", Self::Active),
            Self::Active => (4, "deactivate", Self::Inactive),
        }
    }

    /// Returns the transition that leaves the state, as `TransitionDescription`.
    pub fn description(self) -> Json {
        let (id, label, goal) = self.transition();
        json!({
            "transition": { "id": id, "label": label },
            "start_state": self.message(),
            "goal_state": goal.message(),
        })
    }
}

/// Returns the services of a lifecycle node, unless settings have none.
///
/// # Errors
/// When the middleware refuses.
pub fn lifecycle_services(
    wire: &dyn NodeWire,
    surface: &Arc<ControlSurface>,
    settings: &RosSettings,
) -> Result<Option<ServiceGroup>, RosError> {
    if settings.lifecycle == NodeAccess::None {
        return Ok(None);
    }
    let mut servers = Vec::new();
    for (name, kind, definition, _) in SERVICES {
        let service = settings.node.private(name)?;
        let of = format!("lifecycle_msgs/srv/{kind}");
        let of = ServiceType::parse(WireFormat::Cdr, &of, &format!("{definition}\n{MESSAGES}"));
        let of = of.map_err(|reason| RosError::definition(kind, reason))?;
        servers.push(ServiceServer::open(wire, &service, &of)?);
    }
    let handler = Box::new(LifecycleHandler {
        operations: AgentOperations::new(surface, TABLE)?,
        composer: surface.agent.composer().clone(),
        is_settable: settings.lifecycle == NodeAccess::Set,
    });
    Ok(Some(ServiceGroup { name: "ros2-lifecycle", servers, handler }))
}

/// Answers for all five services.
struct LifecycleHandler {
    operations: AgentOperations,
    composer: Composer,
    is_settable: bool,
}

impl ServiceHandler for LifecycleHandler {
    fn answer(&mut self, service: usize, request: &Json) -> Json {
        let state = AgentState::of(&self.composer);
        let Some((.., service)) = SERVICES.get(service) else { return json!({}) };
        match service {
            LifecycleService::GetState => json!({ "current_state": state.message() }),
            LifecycleService::States => json!({ "available_states": STATES.map(AgentState::message) }),
            LifecycleService::Graph => {
                json!({ "available_transitions": STATES.map(AgentState::description) })
            }
            LifecycleService::Transitions => {
                let is_possible = self.is_settable && !self.composer.actuators().is_empty();
                let all: Vec<_> = is_possible.then(|| state.description()).into_iter().collect();
                json!({ "available_transitions": all })
            }
            LifecycleService::ChangeState => json!({ "success": self.change(state, &request["transition"]) }),
        }
    }
}

impl LifecycleHandler {
    /// Arms or stops the actuators.
    /// Returns whether a transition was possible and has succeeded.
    fn change(&self, state: AgentState, transition: &Json) -> bool {
        let (id, label, _) = state.transition();
        // A transition is named by its number, or else by its label.
        let is_it = match transition["id"].as_u64() {
            Some(0) | None => transition["label"] == label,
            Some(given) => given == id,
        };
        let actuators = self.composer.actuators();
        if !is_it || !self.is_settable || actuators.is_empty() {
            return false;
        }
        let carry_out = |name: &str, body: Json| self.operations.carry_out(name, &[], body).is_ok();
        match state {
            AgentState::Active => carry_out("stop", json!({ "reason": DEACTIVATED })),
            AgentState::Inactive => {
                // Stops of others are not for a node to end.
                let is_own = |(_, reason): &(String, Option<String>)| {
                    reason.as_ref().is_none_or(|reason| reason == DEACTIVATED)
                };
                let is_stopped = actuators.iter().any(|(_, reason)| reason.is_some());
                actuators.iter().all(is_own)
                    && (!is_stopped || carry_out("reset", json!({})))
                    && carry_out("arm", json!({}))
            }
        }
    }
}

//! Types of actions.

use slate_ros_messages::WireFormat;

use crate::message_type::MessageType;
use crate::service_type::ServiceType;

/// Line between goal, result and feedback of a definition.
const SEPARATOR: &str = "---";

/// Messages that each action has.
const COMMON_MESSAGES: &str = "\
====
MSG: unique_identifier_msgs/UUID
uint8[16] uuid
====
MSG: action_msgs/GoalInfo
unique_identifier_msgs/UUID goal_id
builtin_interfaces/Time stamp
====
MSG: action_msgs/GoalStatus
GoalInfo goal_info
int8 status
";

/// Type of an action: its goal, its result and its feedback.
/// Also the services and topics that transport them.
#[derive(Clone, Debug, PartialEq)]
pub struct ActionType {
    name: String,
    goal: MessageType,
    result: MessageType,
    feedback: MessageType,
    send_goal: ServiceType,
    get_result: ServiceType,
    feedback_message: MessageType,
}

impl ActionType {
    /// Returns whether a type is an action, such as `nav2_msgs/action/NavigateToPose`.
    pub fn is_name(name: &str) -> bool {
        let parts: Vec<_> = name.split('/').collect();
        matches!(parts[..], [package, "action", own] if !package.is_empty() && !own.is_empty())
    }

    /// Parses a `.action` file.
    /// Messages in it follow, each after a line of `=` and `MSG: package/Name`.
    ///
    /// # Errors
    /// The name or the text is invalid; the reason in words.
    pub fn parse(name: &str, definition: &str) -> Result<Self, String> {
        if !Self::is_name(name) {
            return Err(format!(
                "`{name}` is not a type of an action, such as nav2_msgs/action/NavigateToPose"
            ));
        }
        let lines: Vec<_> = definition.lines().collect();
        let own = lines.iter().position(|line| line.starts_with("===")).unwrap_or(lines.len());
        let (own, inside) = lines.split_at(own);
        let parts: Vec<_> = own.split(|line| line.trim() == SEPARATOR).collect();
        let [goal, result, feedback] = parts[..] else {
            return Err(format!(
                "{name} has {} parts, expected goal, result and feedback between lines `{SEPARATOR}`",
                parts.len()
            ));
        };
        let inside = inside.join("\n");
        let message =
            |part: &str, text: String| MessageType::parse(WireFormat::Cdr, &format!("{name}_{part}"), &text);
        let part = |part: &str, lines: &[&str]| message(part, format!("{}\n{inside}", lines.join("\n")));
        let short = name.replacen("/action/", "/", 1);
        let wrapped = |part: &str, lines: &[&str], around: &str| {
            let lines = lines.join("\n");
            format!("{around}\n====\nMSG: {short}_{part}\n{lines}\n{COMMON_MESSAGES}{inside}")
        };
        let own = short.rsplit('/').next().unwrap_or_default();
        let request = format!(
            "unique_identifier_msgs/UUID goal_id\n{own}_Goal goal\n---\nbool accepted\nbuiltin_interfaces/Time stamp"
        );
        let response = format!("unique_identifier_msgs/UUID goal_id\n---\nint8 status\n{own}_Result result");
        let around = format!("unique_identifier_msgs/UUID goal_id\n{own}_Feedback feedback");
        let service = |part: &str, text: String| {
            ServiceType::parse_named(WireFormat::Cdr, &format!("{name}_{part}"), &text)
        };
        Ok(Self {
            name: name.into(),
            goal: part("Goal", goal)?,
            result: part("Result", result)?,
            feedback: part("Feedback", feedback)?,
            send_goal: service("SendGoal", wrapped("Goal", goal, &request))?,
            get_result: service("GetResult", wrapped("Result", result, &response))?,
            feedback_message: message("FeedbackMessage", wrapped("Feedback", feedback, &around))?,
        })
    }

    /// Returns the name in ROS, such as `nav2_msgs/action/NavigateToPose`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the goal.
    pub fn goal(&self) -> &MessageType {
        &self.goal
    }

    /// Returns the result.
    pub fn result(&self) -> &MessageType {
        &self.result
    }

    /// Returns the feedback.
    pub fn feedback(&self) -> &MessageType {
        &self.feedback
    }

    /// Returns the service that takes goals.
    pub fn send_goal(&self) -> &ServiceType {
        &self.send_goal
    }

    /// Returns the service that responds when a goal has ended.
    pub fn get_result(&self) -> &ServiceType {
        &self.get_result
    }

    /// Returns the message of the topic of feedback.
    pub fn feedback_message(&self) -> &MessageType {
        &self.feedback_message
    }

    /// Returns the service that cancels goals, `action_msgs/srv/CancelGoal`.
    ///
    /// # Errors
    /// None: its definition is valid.
    pub fn cancel_goal() -> Result<ServiceType, String> {
        let text = format!(
            "GoalInfo goal_info\n---\nint8 return_code\nGoalInfo[] goals_canceling\n{COMMON_MESSAGES}"
        );
        ServiceType::parse(WireFormat::Cdr, "action_msgs/srv/CancelGoal", &text)
    }

    /// Returns the message of the state topic, `action_msgs/msg/GoalStatusArray`.
    ///
    /// # Errors
    /// None: its definition is valid.
    pub fn status() -> Result<MessageType, String> {
        let text = format!("GoalStatus[] status_list\n{COMMON_MESSAGES}");
        MessageType::parse(WireFormat::Cdr, "action_msgs/msg/GoalStatusArray", &text)
    }
}

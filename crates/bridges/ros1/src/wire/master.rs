//! Calls of the master, and of other nodes.

use super::http::{HttpAddress, post};
use super::xml::{XmlValue, call, read_answer};

/// Reason why a call has no value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CallError {
    /// No ROS peer answers.
    Unreachable(String),
    /// The answer is no.
    Refused(String),
}

impl std::fmt::Display for CallError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (Self::Unreachable(reason) | Self::Refused(reason)) = self;
        f.write_str(reason)
    }
}

/// Calls a method, and returns the value of the answer.
/// The answer also has a code and a text.
///
/// # Errors
/// The call was refused, or the other end was not reached.
pub async fn call_method(
    address: &HttpAddress,
    method: &str,
    arguments: &[XmlValue],
) -> Result<XmlValue, CallError> {
    let answer = post(address, &call(method, arguments)).await;
    let answer = answer.and_then(|text| read_answer(&text)).map_err(CallError::Unreachable)?;
    match answer.as_list() {
        Some([code, text, value]) => match (code.as_integer(), text.as_text()) {
            (Some(1), _) => Ok(value.clone()),
            (_, text) => Err(CallError::Refused(text.unwrap_or("it refuses").into())),
        },
        _ => Err(CallError::Unreachable(format!("`{method}` has another answer than in ROS"))),
    }
}

/// Master, for one node.
#[derive(Clone, Debug)]
pub struct MasterClient {
    pub address: HttpAddress,
    /// Node that calls.
    pub node: String,
}

impl MasterClient {
    /// Calls a method on behalf of the node.
    ///
    /// # Errors
    /// Reason why no value was returned.
    pub async fn call(&self, method: &str, rest: Vec<XmlValue>) -> Result<XmlValue, CallError> {
        let arguments = [vec![XmlValue::from(self.node.as_str())], rest].concat();
        call_method(&self.address, method, &arguments).await
    }
}

/// Error of reading or making a message.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// A value has another size than its interface.
    #[error("a value of {interface} has {expected} bytes, not {found}")]
    Size {
        /// The interface.
        interface: String,
        /// Expected number of bytes.
        expected: String,
        /// Number of bytes found.
        found: usize,
    },
    /// A message does not match its definition.
    #[error("at byte {at} of the message: {reason}")]
    Message {
        /// Bytes from its beginning.
        at: usize,
        /// Found and expected.
        reason: String,
    },
    /// A field of a message fits no value of the interface.
    #[error("`{field}` of the message {reason}")]
    Field {
        /// Path of the field.
        field: String,
        /// Found and expected.
        reason: String,
    },
    /// A definition can't be read.
    #[error("line {line} of the definition of {name}: {reason}")]
    Definition {
        /// The message that it defines.
        name: String,
        /// The line, from 1.
        line: usize,
        /// Found and expected.
        reason: String,
    },
}

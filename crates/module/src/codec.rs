//! States, descriptions and what else crosses a boundary as CBOR.

use crate::Refusal;

/// A state as CBOR with field names.
///
/// # Errors
/// What can't be written.
pub fn encode<T: serde::Serialize>(state: &T) -> Result<Vec<u8>, Refusal> {
    let mut bytes = Vec::new();
    ciborium::into_writer(state, &mut bytes).map_err(|error| Refusal(error.to_string()))?;
    Ok(bytes)
}

/// A state from CBOR; it fits if it deserialises.
///
/// # Errors
/// What doesn't fit.
pub fn decode<T: serde::de::DeserializeOwned>(bytes: &[u8]) -> Result<T, Refusal> {
    ciborium::from_reader(bytes).map_err(|error| {
        Refusal(match error {
            ciborium::de::Error::Io(_) => "it ends too early".into(),
            ciborium::de::Error::Syntax(at) => format!("byte {at} is no CBOR"),
            ciborium::de::Error::Semantic(_, problem) => problem,
            ciborium::de::Error::RecursionLimitExceeded => "it is nested too deeply".into(),
        })
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that fails panics")]
mod tests {
    use super::{decode, encode};

    #[test]
    fn state_that_does_not_fit_is_refused_in_words() {
        let saved = encode(&None::<u64>).unwrap();
        assert_eq!(decode::<u64>(&saved).unwrap_err().0, "invalid type: null, expected integer");
        assert_eq!(decode::<u64>(&[]).unwrap_err().0, "it ends too early");
    }
}

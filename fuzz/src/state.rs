//! States of modules: they are read and written as ciborium does.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct State {
    number: Option<i64>,
    wide: u128,
    text: String,
    kinds: Vec<Kind>,
    #[serde(flatten)]
    rest: BTreeMap<String, Tree>,
}

#[derive(Debug, PartialEq, Serialize, Deserialize)]
enum Kind {
    Unit,
    Newtype(char),
    Tuple(bool, i16),
    Struct { items: Vec<u8> },
}

#[derive(Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
enum Tree {
    Float(f32),
    Text(String),
    List(Vec<Tree>),
}

/// A state of each kind of value, as bytes.
pub fn example() -> Vec<u8> {
    let rest = vec![Tree::Float(0.1), Tree::Text("left".into()), Tree::List(vec![Tree::Float(-1.0e9)])];
    let state = State {
        number: Some(-70_000),
        wide: u128::MAX,
        text: "\u{e9}".repeat(30),
        kinds: vec![
            Kind::Unit,
            Kind::Newtype('\u{1f916}'),
            Kind::Tuple(true, 300),
            Kind::Struct { items: vec![1, 200] },
        ],
        rest: BTreeMap::from([("rest".to_owned(), Tree::List(rest))]),
    };
    slate_module::encode(&state).expect("a vector takes all")
}

/// Reads a state from those bytes.
pub fn run(bytes: &[u8]) {
    let Ok(state) = slate_module::decode::<State>(bytes) else { return };
    let mut written = Vec::new();
    ciborium::into_writer(&state, &mut written).expect("a vector takes all");
    assert_eq!(slate_module::encode(&state).expect("a vector takes all"), written);
    // It refuses some tags that say nothing here. Bytes are compared, as NaN is unequal to NaN.
    if let Ok(other) = ciborium::from_reader::<State, _>(bytes) {
        assert_eq!(slate_module::encode(&other).expect("a vector takes all"), written);
    }
}

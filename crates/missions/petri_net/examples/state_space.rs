//! Prints the state space of each net of standard input.
//! For `tests/compare_snakes.py`.
//!
//! A line is a net: `{"places": [1, 0], "transitions": [[[[0, 1]], [[1, 2]]]]}` has a transition that takes a token of
//! place 0 and puts two into place 1. The answer is a line with `complete`, `markings` and `edges`.

use std::error::Error;
use std::io::{BufRead, Write};

use serde::Deserialize;
use slate_petri_net::{NetBuilder, state_space};

/// Markings after which a net is given up.
const MOST_STATES: usize = 150;

#[derive(Deserialize)]
struct Line {
    places: Vec<u32>,
    transitions: Vec<[Vec<(usize, u32)>; 2]>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut output = std::io::stdout().lock();
    for line in std::io::stdin().lock().lines() {
        let line: Line = serde_json::from_str(&line?)?;
        let mut net = NetBuilder::new("net");
        for tokens in line.places {
            net.place("", tokens);
        }
        for [inputs, outputs] in line.transitions {
            net.transition("", &inputs, &outputs);
        }
        let space = state_space(&net.finish()?, MOST_STATES, false);
        let markings: Vec<&[u32]> = (0..space.states()).map(|state| space.marking(state)).collect();
        let answer = serde_json::json!({
            "complete": space.is_complete(), "markings": markings, "edges": space.edges(),
        });
        writeln!(output, "{answer}")?;
    }
    Ok(())
}

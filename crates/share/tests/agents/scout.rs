//! Block that states given facts.

use slate_blackboard::Board;
use slate_blackboard::interface::Value;
use slate_mapek::{FactTable, Statements};
use slate_module::prelude::*;

/// A victim that was found.
#[interface]
#[derive(PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Victim {
    /// Where.
    #[unit("m")]
    pub x: f64,
}

/// What a scout is to say.
#[interface]
#[derive(PartialEq)]
pub struct Say {
    /// Where the victim is.
    pub x: f64,
    /// How sure it is.
    pub certainty: f64,
    /// The victim; 0 for nothing.
    pub victim: u32,
    /// Whether to take it back.
    pub retract: u32,
}

/// Ports of [`Scout`].
#[ports]
pub struct ScoutIo {
    say: Input<Say>,
    found: Output<FactTable<Victim>>,
}

/// States given facts.
pub struct Scout;

#[module(stage = Think)]
impl Module for Scout {
    type Io = ScoutIo;
    type Params = ();
    type State = Statements<Victim>;

    fn tick(state: &mut Statements<Victim>, io: &ScoutIo, _: &(), now: &Tick) -> Outcome {
        if let Some(say) = io.say.updated().filter(|say| say.victim > 0) {
            let key = say.victim.to_string();
            if say.retract > 0 {
                state.retract(now.now(), &key);
            } else {
                assert!(state.state(now.now(), &key, say.certainty, Victim { x: say.x }));
            }
        }
        assert!(state.write(now.now(), &io.found));
        Outcome::Ok
    }
}

/// Tells the scout of an agent what to state about a victim.
pub fn say(board: &Board, victim: u32, x: f64, certainty: f64, retract: bool) {
    let (victim, retract) = (i128::from(victim), i128::from(retract));
    let say = Value::Table(vec![
        ("x".into(), Value::Float(x)),
        ("certainty".into(), Value::Float(certainty)),
        ("victim".into(), Value::Integer(victim)),
        ("retract".into(), Value::Integer(retract)),
    ]);
    board.write("scout/say", &say, 0).unwrap();
}

//! Any row of links and cycles comes to what a model of it says.

use proptest::prelude::*;
use slate_runtime::NewLink;

use crate::links::common::number;
use crate::links::support::{lockstep, steps};

const WRITERS: [(&str, f64); 3] = [("a", 0.0), ("b", 1000.0), ("c", 5000.0)];
const READERS: usize = 4;

#[derive(Clone, Debug)]
enum Action {
    Link { reader: usize, writer: usize, previous: bool },
    Unlink { reader: usize },
    Cycles(u64),
}

fn action() -> impl Strategy<Value = Action> {
    prop_oneof![
        3 => (0..READERS, 0..WRITERS.len(), any::<bool>())
            .prop_map(|(reader, writer, previous)| Action::Link { reader, writer, previous }),
        1 => (0..READERS).prop_map(|reader| Action::Unlink { reader }),
        3 => (1..4_u64).prop_map(Action::Cycles),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn random_links_of_a_running_agent(actions in proptest::collection::vec(action(), 1..24)) {
        let mut text = String::new();
        for (name, offset) in WRITERS {
            text += &format!("[modules.{name}]\nkind = \"twins\"\nstage = \"Think\"\nparams.offset = {offset:?}\n");
        }
        for reader in 0..READERS {
            text += &format!(
                "[modules.r{reader}]\nkind = \"driver\"\nstage = \"Think\"\ninputs.input.value = {reader}.5\n"
            );
        }
        let mut agent = lockstep(&text);
        let mut links: [Option<(usize, bool)>; READERS] = [None; READERS];
        let mut cycles = 0;
        for action in actions {
            match action {
                Action::Link { reader, writer, previous } => {
                    let link = NewLink::new(format!("r{reader}/input"), format!("{}/number", WRITERS[writer].0));
                    agent.composer().link(&link.previous(previous)).unwrap();
                    links[reader] = Some((writer, previous));
                }
                Action::Unlink { reader } => {
                    prop_assert_eq!(agent.composer().unlink(&format!("r{reader}/input")).is_ok(), links[reader].is_some());
                    links[reader] = None;
                }
                Action::Cycles(count) => {
                    steps(&mut agent, count);
                    cycles += count;
                    for (reader, link) in links.iter().enumerate() {
                        let expected = match link {
                            None => reader as f64 + 0.5,
                            Some((_, true)) if cycles == 1 => 0.0,
                            Some((writer, previous)) => {
                                WRITERS[*writer].1 + cycles as f64 - f64::from(u8::from(*previous))
                            }
                        };
                        prop_assert_eq!(number(&agent, &format!("r{reader}/wheel/value")), expected, "{} {:?}", reader, link);
                        prop_assert_eq!(agent.counts(&format!("r{reader}")).unwrap().0, cycles);
                    }
                }
            }
        }
    }
}

//! Links that change under load: no reader ever sees values that do not belong together.

use std::sync::Arc;
use std::time::{Duration, Instant};

use slate_runtime::{Control, Mode};

use crate::links::support::agent;

const TEXT: &str = r#"
[loop]
period = "1ms"
[modules.a]
kind = "twins"
every = "50us"
[modules.b]
kind = "twins"
every = "70us"
params.offset = 1e9
[modules.judge]
every = "60us"
[modules.on_loop]
kind = "judge"
[links]
"judge/left" = "a/one"
"judge/right" = "a/two"
"on_loop/left" = "b/one"
"on_loop/right" = "b/two"
"#;

/// Both inputs of each judge are relinked together, again and again, while writers and readers run as fast as they can.
#[test]
fn values_of_one_writer_stay_together_while_links_change() {
    let mut agent = agent(TEXT, Mode::Threaded);
    let database = agent.database().unwrap().clone();
    let (stopper, board) = (agent.stopper(), Arc::clone(agent.board()));
    let run = std::thread::spawn(move || {
        let end = agent.run(Box::new(|_| Control::Continue));
        (agent, end)
    });
    let start = Instant::now();
    let mut changes = 0;
    while start.elapsed() < Duration::from_secs(2) || changes < 20 {
        let (left, right) = if changes % 2 == 0 { ("b", "a") } else { ("a", "b") };
        let texts: Vec<_> = [("judge", left), ("on_loop", right)]
            .iter()
            .flat_map(|(judge, twins)| {
                [("left", "one"), ("right", "two")]
                    .map(|(to, from)| (format!("links.\"{judge}/{to}\""), format!("{twins}/{from}")))
            })
            .collect();
        assert_eq!(database.set(&texts).unwrap().len(), 4);
        changes += 1;
    }
    stopper.stop();
    let (agent, end) = run.join().unwrap();
    end.unwrap();
    let read = |path: &str| board.read(path).unwrap().unwrap().0.as_f64().unwrap();
    for judge in ["judge", "on_loop"] {
        assert!(agent.counts(judge).unwrap().0 > 20, "it has run");
        assert_eq!(read(&format!("{judge}/torn/value")), 0.0, "after {changes} changes");
        assert!(read(&format!("{judge}/seen/first")) > 0.0);
    }
}

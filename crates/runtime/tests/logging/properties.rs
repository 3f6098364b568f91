use slate_blackboard::channel::{Policy, Start};
use slate_blackboard::interface::Value;
use slate_module::Plugin;
use slate_runtime::{Agent, Options, Rate};

use crate::logging::Talker;
use crate::logging::common::load;

fn agent(text: &str) -> Agent {
    let options = Options { rate: Rate::Max, ..Options::default() };
    load(&format!("time.source = \"talker\"\n{text}"), &[Plugin::linked::<Talker>()], options).unwrap()
}

fn read(agent: &Agent, path: &str) -> Value {
    agent.logger().flush(crate::logging::LONG);
    agent.board().read(path).unwrap().unwrap().0
}

#[test]
fn the_last_lines_are_on_the_blackboard_also_for_late_readers() {
    let mut agent = agent("[modules.talker]\n");
    (0..100).for_each(|_| assert!(agent.step()));
    assert_eq!(read(&agent, "log/tail/text"), Value::Text("error 100".into()));
    assert_eq!(read(&agent, "log/tail/module"), Value::Text("talker".into()));
    assert_eq!(read(&agent, "log/tail/level"), Value::Text("ERROR".into()));
    assert_eq!(read(&agent, "log/tail/time"), Value::Integer(99 * 20_000_000));
    assert_eq!(read(&agent, "log/counts/written"), Value::Integer(300));
    let (property, _) = agent.board().find("log/tail").unwrap();
    let mut reader = property.channel().unwrap().queue(Policy::Skip, Start::Oldest).unwrap();
    let mut seen = 0;
    while reader.pull().unwrap() > 0 {
        seen += reader.len();
    }
    assert_eq!(seen, 256);
}

#[test]
fn counts_tell_of_repetitions() {
    let mut agent = agent("[modules.talker]\nparams.lines = 20\n");
    assert!(agent.step());
    // Twice 20 lines of one text, of which 5 are written and the rest is summed up.
    assert_eq!(read(&agent, "log/counts/suppressed"), Value::Integer(30));
    // A sum of each when another message comes, and one at the end.
    assert_eq!(read(&agent, "log/counts/written"), Value::Integer(20 + 5 + 5 + 2 + 2));
    assert_eq!(read(&agent, "log/counts/dropped"), Value::Integer(0));
}

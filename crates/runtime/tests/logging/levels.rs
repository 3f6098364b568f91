use slate_module::{Level, Plugin};
use slate_runtime::Options;
use slate_runtime::log::{MemoryTarget, Record};

use crate::logging::common::load;
use crate::logging::{Talker, lines_of};

const THREE: &str = r#"
time.source = "a"
[modules.a]
kind = "talker"
[modules."r2/b"]
kind = "talker"
[modules."r2/c"]
kind = "talker"
"#;

fn module_lines(lines: &[Record]) -> Vec<(&str, &str)> {
    lines.iter().map(|line| (&*line.module, line.text.as_str())).collect()
}

#[test]
fn each_module_has_its_level_and_the_longest_name_wins() {
    let text =
        format!("log.level = \"warn\"\nlog.levels = {{ r2 = \"error\", \"r2/b\" = \"debug\" }}\n{THREE}");
    let expected = [
        ("a", "warn 1"),
        ("a", "error 1"),
        ("r2/b", "debug 1"),
        ("r2/b", "info 1 0"),
        ("r2/b", "warn 1"),
        ("r2/b", "error 1"),
        ("r2/c", "error 1"),
    ];
    assert_eq!(module_lines(&lines_of(&text, Options::default(), 1)), expected);
}

#[test]
fn running_modules_follow_a_change_with_their_next_line() {
    let target = MemoryTarget::default();
    let options =
        Options { log: vec![Box::new(target.clone())], rate: slate_runtime::Rate::Max, ..Options::default() };
    let text = format!("log.level = \"error\"\n{THREE}");
    let mut agent = load(&text, &[Plugin::linked::<Talker>()], options).unwrap();
    assert!(agent.step());
    agent.logger().set_level(Some("r2"), Level::Warn);
    assert_eq!(agent.logger().level("r2/c"), Level::Warn);
    assert!(agent.step());
    agent.logger().set_level(Some("r2/b"), Level::Error);
    agent.logger().set_level(None, Level::Info);
    assert!(agent.step());
    drop(agent);
    let expected = [
        ("a", "error 1"),
        ("r2/b", "error 1"),
        ("r2/c", "error 1"),
        ("a", "error 2"),
        ("r2/b", "warn 2"),
        ("r2/b", "error 2"),
        ("r2/c", "warn 2"),
        ("r2/c", "error 2"),
        ("a", "info 3 0"),
        ("a", "warn 3"),
        ("a", "error 3"),
        ("r2/b", "error 3"),
        ("r2/c", "warn 3"),
        ("r2/c", "error 3"),
    ];
    assert_eq!(module_lines(&target.lines()), expected);
}

#[test]
fn the_agent_itself_has_a_level_too() {
    let target = MemoryTarget::default();
    let logger = crate::logging::logger(0, vec![Box::new(target.clone())]);
    logger.set_level(Some("agent"), Level::Warn);
    logger.log(0, Level::Info, "quiet");
    logger.log(0, Level::Warn, "loud");
    drop(logger);
    assert_eq!(module_lines(&target.lines()), [("agent", "loud")]);
}

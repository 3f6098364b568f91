//! Queues between modules: each reader has a cursor of its own.

use slate_runtime::NewLink;
use slate_runtime::log::MemoryTarget;

use crate::links::common::number;
use crate::links::support::{lockstep, steps};

/// The example of figure 3 of OpenRDK's paper: hwInterface pushes odometry into a queue, and the localizer, linked to
/// it by configuration, takes all that came since it looked last, when it looks.
#[test]
fn a_localizer_takes_all_odometry_since_it_looked_last() {
    let text = r#"
[modules.hwinterface]
kind = "counter"
[modules.localizer]
kind = "collector"
every = "60ms"
[modules.mapper]
kind = "collector"
[links]
"localizer/numbers" = "slate://test/hwinterface/number"
"mapper/numbers" = "hwinterface/number"
"#;
    let mut agent = lockstep(text);
    let mut seen = Vec::new();
    for _ in 0..7 {
        steps(&mut agent, 1);
        seen.push((number(&agent, "localizer/count/value"), number(&agent, "mapper/count/value")));
    }
    // Every third cycle of 20 ms it has three more; none is lost, in their order, and the other reader has its own.
    assert_eq!(seen, [(1., 1.), (1., 2.), (1., 3.), (4., 4.), (4., 5.), (4., 6.), (7., 7.)]);
    assert_eq!(number(&agent, "localizer/sum/value"), 28.0);
}

#[test]
fn a_slow_reader_is_counted_and_the_other_loses_nothing() {
    let text = r#"
[modules.a]
kind = "counter"
[modules.slow]
kind = "collector"
every = "2s"
[modules.quick]
kind = "collector"
[links]
"slow/numbers" = { from = "a/number", window = 4 }
"quick/numbers" = "a/number"
"#;
    let mut agent = lockstep(text);
    steps(&mut agent, 101);
    assert_eq!(number(&agent, "quick/count/value"), 101.0);
    let links = agent.composer().links();
    let (_, lost) = links.iter().find(|link| link.to == "slow/numbers").unwrap().queue.unwrap();
    assert!(lost > 0 && lost < 100, "{lost}");
    assert_eq!(number(&agent, "slow/count/value") + lost as f64 + waiting(&agent), 101.0);
    assert_eq!(links.iter().find(|link| link.to == "quick/numbers").unwrap().queue, Some((0, 0)));
}

fn waiting(agent: &slate_runtime::Agent) -> f64 {
    let links = agent.composer().links();
    links.iter().find(|link| link.to == "slow/numbers").unwrap().queue.unwrap().0 as f64
}

#[test]
fn a_subscription_filters() {
    let text = r#"
[modules.a]
kind = "counter"
[modules.fifth]
kind = "collector"
[modules.small]
kind = "collector"
[links]
"fifth/numbers" = { from = "a/number", every = 5 }
"small/numbers" = { from = "a/number", when = "value < 4" }
"#;
    let mut agent = lockstep(text);
    steps(&mut agent, 20);
    assert_eq!((number(&agent, "fifth/count/value"), number(&agent, "fifth/sum/value")), (4.0, 50.0));
    assert_eq!((number(&agent, "small/count/value"), number(&agent, "small/sum/value")), (3.0, 6.0));
}

#[test]
fn evicted_reader_gets_no_values_and_is_reported_once() {
    let text = r#"
[modules.a]
kind = "counter"
[modules.slow]
kind = "collector"
every = "2s"
[links]
"slow/numbers" = { from = "a/number", policy = "evict", window = 20 }
"#;
    let mut agent = lockstep(text);
    let log = MemoryTarget::default();
    agent.logger().add_target(Box::new(log.clone()));
    let status = |agent: &slate_runtime::Agent| agent.composer().links().remove(0);
    steps(&mut agent, 2);
    assert!(!status(&agent).evicted);
    assert_eq!(
        status(&agent).options,
        [("policy".to_owned(), "\"evict\"".to_owned()), ("window".to_owned(), "20".to_owned())]
    );
    steps(&mut agent, 500);
    assert_eq!(number(&agent, "slow/count/value"), 1.0);
    let link = status(&agent);
    let (waiting, lost) = link.queue.unwrap();
    assert!(link.evicted && waiting == 0 && lost > 350, "{waiting} {lost}");
    agent.logger().flush(std::time::Duration::from_secs(10));
    let told = log.lines().into_iter().filter(|line| line.text.contains("`numbers` fell behind")).count();
    assert_eq!(told, 1);
    // Linked anew, it reads again.
    agent.composer().unlink("slow/numbers").unwrap();
    agent.composer().link(&NewLink::new("slow/numbers", "a/number")).unwrap();
    steps(&mut agent, 100);
    assert!(!status(&agent).evicted && number(&agent, "slow/count/value") > 1.0);
    // What waits is what is kept at most.
    steps(&mut agent, 300);
    let (waiting, _) = status(&agent).queue.unwrap();
    let kept = agent.board().find("a/number").unwrap().0.channel().unwrap().depth() as u64;
    assert!(waiting > 0 && waiting <= kept, "{waiting} of {kept}");
}

#[test]
fn a_queue_can_be_linked_to_any_output_while_the_agent_runs() {
    let text = r#"
[modules.a]
kind = "counter"
[modules.b]
kind = "counter"
[modules.one]
kind = "collector"
[modules.two]
kind = "collector"
every = "120ms"
[modules.three]
kind = "collector"
[links]
"one/numbers" = "a/number"
"#;
    let mut agent = lockstep(text);
    steps(&mut agent, 3);
    let composer = agent.composer();
    // There is a queue already, so it keeps enough.
    composer.link(&NewLink::new("three/numbers", "a/number")).unwrap();
    // Nothing comes of a question.
    composer.check_link(&NewLink::new("two/numbers", "b/number")).unwrap();
    assert_eq!(agent.board().find("b/number").unwrap().0.channel().unwrap().depth(), 1);
    composer.link(&NewLink::new("two/numbers", "b/number")).unwrap();
    steps(&mut agent, 30);
    assert_eq!(number(&agent, "three/count/value"), 30.0);
    // Every one from the fourth on, in its own time.
    let count = number(&agent, "two/count/value");
    assert!(count >= 25.0, "{count}");
    assert_eq!(number(&agent, "two/sum/value"), (4..4 + count as u64).sum::<u64>() as f64);
    let links = composer.links();
    assert_eq!(links.iter().find(|link| link.to == "two/numbers").unwrap().queue.unwrap().1, 0);
    // One with a wider window needs more again, and the others continue.
    composer.link(&NewLink::new("three/numbers", "b/number").with("window", "200")).unwrap();
    steps(&mut agent, 12);
    assert_eq!(number(&agent, "three/count/value"), 42.0);
    assert_eq!(agent.board().find("b/number").unwrap().0.channel().unwrap().depth(), 400);
    let count = number(&agent, "two/count/value");
    assert_eq!(number(&agent, "two/sum/value"), (4..4 + count as u64).sum::<u64>() as f64);
    // The end of a queue is a value, too.
    assert_eq!(number(&agent, "two/numbers/value"), 45.0);
}

#[test]
fn a_queue_links_to_an_unwritten_property_with_enough_room() {
    let text = r#"
[modules.a]
kind = "counter"
[modules.b]
kind = "counter"
[modules.one]
kind = "watcher"
[modules.two]
kind = "watcher"
[links]
"one/states" = "a/state"
"#;
    let mut agent = lockstep(text);
    steps(&mut agent, 3);
    let composer = agent.composer();
    let refused = composer.link(&NewLink::new("two/states", "b/state")).unwrap_err().to_string();
    assert!(
        refused.contains("`/b/state` keeps 1 values, and `two/states` takes up to 16 at once"),
        "{refused}"
    );
    // A queue is linked to it since the start.
    composer.link(&NewLink::new("two/states", "a/state")).unwrap();
    let window = NewLink::new("two/states", "a/state").with("window", "100");
    let refused = composer.link(&window).unwrap_err().to_string();
    assert!(refused.contains("takes up to 100 at once, which needs 200"), "{refused}");
    composer.enable("a", false).unwrap();
    steps(&mut agent, 2);
    assert_eq!(number(&agent, "two/count/value"), 1.0);
}

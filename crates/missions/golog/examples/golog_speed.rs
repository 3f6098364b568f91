//! Speed of choice points online, and of searches.

use std::error::Error;
use std::sync::Arc;

use slate_golog::{ActionTheory, GologExecutor, GologHost, GologProgress, RobotAction, SearchLimits};

/// Robot whose actions succeed at once.
struct Quick;

impl GologHost for Quick {
    fn start(&mut self, _: usize, _: &RobotAction<'_>) -> Result<(), String> {
        Ok(())
    }

    fn progress(&mut self, _: usize) -> GologProgress {
        GologProgress::Succeeded
    }

    fn stop(&mut self, _: usize) {}
}

const THEORY: &str = "
domain place = 0..15
condition near
fluent at: place = 0
fluent visited(place) = false
action go(p: place) possible if at != p and not visited(p) at becomes p visited(p) becomes true
action forget all p: place: visited(p) becomes false
action up performs nothing possible if at < 15 at becomes at + 1
action down performs nothing possible if at > 0 at becomes at - 1
";

fn main() -> Result<(), Box<dyn Error>> {
    // The last value that is possible is far back, and the interrupts are looked at first.
    let online = "procedure main { interrupt near { forget } >> interrupt near and at == 3 { forget } >>
        while true { pick p: place { go(p) } | forget } }";
    let searched = "procedure main { search { repeat { up | down | pick p: place { go(p) } }; test at == 15 and \
                    visited(3) and not visited(7) and near } }";
    let mut executor = GologExecutor::new(
        Arc::new(ActionTheory::parse(&format!("{THEORY}{online}"))?),
        SearchLimits::default(),
    );
    executor.observe(|_| Some(false))?;
    #[expect(clippy::disallowed_methods, reason = "a measurement")]
    let start = std::time::Instant::now();
    while executor.steps() < 300_000 {
        executor.tick(&mut Quick)?;
    }
    let seconds = start.elapsed().as_secs_f64();
    println!("online: {:.2} us a transition with its choice point", seconds * 1e6 / executor.steps() as f64);

    let limits = SearchLimits { transitions_per_tick: 100_000, most_transitions: 100_000 };
    let theory = Arc::new(ActionTheory::parse(&format!("{THEORY}{searched}"))?);
    let mut executor = GologExecutor::new(theory, limits);
    executor.observe(|_| Some(false))?;
    #[expect(clippy::disallowed_methods, reason = "a measurement")]
    let start = std::time::Instant::now();
    // It finds no plan, and is refused at its limit.
    let refused = executor.tick(&mut Quick).is_err();
    let seconds = start.elapsed().as_secs_f64();
    println!("search: {:.2} us a transition, refused: {refused}", seconds * 1e6 / 1e5);
    Ok(())
}

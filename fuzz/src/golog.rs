//! Golog theories as text, their checks, executions and states.

use std::sync::Arc;

use slate_golog::{
    ActionTheory, GologExecutor, GologHost, GologProgress, GologState, RobotAction, SearchLimits,
    SolutionLimits, check_theory, outline, solutions,
};

use crate::memory::within;

/// A host whose answers come from a counter.
#[derive(Clone)]
struct Host(u32);

impl Host {
    fn draw(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        self.0 >> 30
    }
}

impl GologHost for Host {
    fn start(&mut self, _: usize, _: &RobotAction<'_>) -> Result<(), String> {
        Ok(())
    }

    fn progress(&mut self, _: usize) -> GologProgress {
        match self.draw() {
            0 => GologProgress::Failed,
            1 => GologProgress::Running,
            _ => GologProgress::Succeeded,
        }
    }

    fn stop(&mut self, _: usize) {}
}

/// Reads a theory; a valid one is checked and executed.
/// It continues from its saved state as from its own.
pub fn run(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let theory = within((64 << 20) + 1024 * bytes.len(), || ActionTheory::parse(text));
    let theory = match theory {
        Ok(theory) => Arc::new(theory),
        Err(error) => {
            let _ = error.render();
            return;
        }
    };
    check_theory(&theory, None);
    outline(&theory);
    // A refusal is fine.
    let _ = solutions(&theory, &SolutionLimits { most_depth: 8, most_transitions: 20 }, |_| true);
    let limits = SearchLimits { transitions_per_tick: 4, most_transitions: 20 };
    let mut executor = GologExecutor::new(Arc::clone(&theory), limits);
    let mut host = Host(1);
    let tick = |executor: &mut GologExecutor, host: &mut Host, number: u32| {
        executor.observe(|name| Some((name.len() as u32 + number).is_multiple_of(3)))?;
        executor.tick(host)
    };
    for number in 0..3 {
        if tick(&mut executor, &mut host, number).is_err() {
            return;
        }
    }
    let text = serde_json::to_string(&executor.state()).expect("it has text keys");
    let state: GologState = serde_json::from_str(&text).expect("it was written here");
    let mut restored = GologExecutor::restore(theory, limits, &state).expect("it is of this theory");
    let mut other = host.clone();
    for number in 3..6 {
        let (left, right) = (tick(&mut executor, &mut host, number), tick(&mut restored, &mut other, number));
        assert_eq!(left, right, "the restored run differs");
        if left.is_err() {
            return;
        }
    }
    assert_eq!(executor.state(), restored.state(), "the restored state differs");
}

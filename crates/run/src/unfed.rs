//! Modules of a run that still wait for a required input.

use slate_module::Level;
use slate_runtime::{Agent, Composer, ModuleStatus};
use slate_sorted::SortedMap;

/// Time after which a run reports modules that still wait, ns of the agent's time.
const REPORT_DELAY: u64 = 2_000_000_000;

/// Reports once which required inputs of a run have no value.
pub struct UnfedInputs {
    composer: Composer,
    /// Source of each linked input at the start of the run.
    /// A link is not looked up later: a change of the agent may wait for the cycle that asks.
    sources: SortedMap<String, String>,
    /// Time of the report, ns of the agent's time; unknown before the first cycle.
    due: Option<u64>,
    is_reported: bool,
}

impl UnfedInputs {
    pub fn new(agent: &Agent) -> Self {
        let composer = agent.composer();
        let sources = composer.links().into_iter().map(|link| (link.to, link.from)).collect();
        Self { composer, sources, due: None, is_reported: false }
    }

    /// Logs the inputs without a value when the time has come; called in every cycle.
    pub fn note(&mut self, now: u64) {
        let due = *self.due.get_or_insert(now.saturating_add(REPORT_DELAY));
        if self.is_reported || now < due {
            return;
        }
        self.is_reported = true;
        let line = |module: ModuleStatus| {
            let input = format!("{}/{}", module.name, module.waiting_for?);
            Some(match self.sources.get(&input) {
                Some(source) => format!("`{input}` (source `{source}`)"),
                None => format!("`{input}` (no source)"),
            })
        };
        let waiting: Vec<_> = self.composer.modules().into_iter().filter_map(line).collect();
        if !waiting.is_empty() {
            let text = format!("modules wait for required inputs without a value: {}", waiting.join(", "));
            self.composer.log(Level::Warn, &text);
        }
    }
}

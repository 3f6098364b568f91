use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::output;

#[derive(Debug, Args)]
pub struct TraceOptions {
    /// How long to record, seconds.
    #[arg(long, default_value_t = 5.0, value_parser = seconds)]
    pub seconds: f64,
    /// The file, which <https://ui.perfetto.dev> opens.
    #[arg(long, default_value = "trace.json")]
    pub out: PathBuf,
    #[command(flatten)]
    pub agent: AgentOption,
}

fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds > 0.0 && seconds <= 3600.0 => Ok(seconds),
        _ => Err("expected seconds, more than 0 and at most 3600".into()),
    }
}

/// Records what the modules of a running agent do when.
pub fn trace(options: &TraceOptions) -> Result<bool, Failure> {
    let file = std::path::absolute(&options.out)
        .map_err(|source| Failure::File { path: options.out.clone(), source })?;
    let mut client = options.agent.connect()?;
    // A file that can't be written is told before the recording, and not after it.
    client.export_trace(&file, 0, 0)?;
    let from = client.record_trace(true)?;
    std::thread::sleep(Duration::try_from_secs_f64(options.seconds).unwrap_or(Duration::ZERO));
    let to = client.record_trace(false)?;
    let spans = client.export_trace(&file, from, to)?;
    output::line(format_args!(
        "{spans} spans in {}; open it in https://ui.perfetto.dev",
        slate::runtime::printable(&file)
    ));
    Ok(true)
}

//! Log of the agent, set up by the configuration.

use std::io;

use slate_blackboard::Board;
use slate_module::Level;

use slate_configuration::{Configuration, Diagnostic, Report, Span};
use slate_engine::log::{
    ConsoleTarget, FileTarget, LogSettings, LogTarget, Logger, RemoteTarget, Rotation, SyslogTarget,
};

/// Returns the log settings of a configuration.
pub(super) fn settings(configuration: &Configuration, lockstep: bool) -> LogSettings {
    let log = configuration.log();
    let modules = configuration.modules().len();
    LogSettings { levels: log.levels(), repeat: log.repeat.value, lockstep, modules }
}

/// Adds the log's properties to the board, which modules may read.
///
/// # Errors
/// When another property has the name of one.
pub(super) fn show(logger: &Logger, board: &Board) -> Result<(), Report> {
    logger.publish_on(board).map_err(|error| Diagnostic::without_place(error.to_string(), None).into())
}

/// Adds the targets that a configuration names.
///
/// # Errors
/// The target that can't be opened or made, at its place in the configuration.
pub(super) fn configure(logger: &Logger, configuration: &Configuration) -> Result<(), Report> {
    let wanted = &configuration.log().targets;
    let mut opened: Vec<Box<dyn LogTarget>> = Vec::new();
    let cannot = |span: Span, what: String, error: &io::Error, help: &str| {
        Report::from(vec![configuration.diagnostic(span, format!("{what}: {error}"), Some(help.into()))])
    };
    let mut address = None;
    // Targets without files come first, so that a refused configuration makes no file.
    if let Some(remote) = &wanted.remote {
        let target = RemoteTarget::bind(remote.value).map_err(|error| {
            let what = format!("the log can't be offered at {}", remote.value);
            cannot(remote.span, what, &error, "choose an address of this machine and a free port")
        })?;
        address = Some(target.address());
        opened.push(Box::new(target));
    }
    if let Some(syslog) = &wanted.syslog {
        opened.push(Box::new(SyslogTarget::new(syslog.value.clone(), configuration.agent_name())));
    }
    if wanted.console {
        opened.push(Box::new(ConsoleTarget));
    }
    if let Some(file) = &wanted.file {
        let rotation = Rotation { size: file.size, keep: file.keep };
        let target = FileTarget::open(&file.path.value, rotation).map_err(|error| {
            let what =
                format!("the log file {} can't be opened", slate_configuration::printable(&file.path.value));
            cannot(file.path.span, what, &error, "choose a file that this user may write")
        })?;
        opened.push(Box::new(target));
    }
    opened.into_iter().for_each(|target| logger.add_target(target));
    if let Some(address) = address {
        logger.log(0, Level::Info, &format!("the log is offered at {address}"));
    }
    Ok(())
}

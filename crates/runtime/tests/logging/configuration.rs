use std::fs;
use std::net::TcpListener;
use std::os::unix::net::UnixDatagram;

use slate_module::prelude::{Module, Outcome, Output, Tick, module, ports};
use slate_module::{Level, Plugin};
use slate_runtime::configuration::{Configuration, Options, Report};
use slate_runtime::log::{Rotation, SyslogAddress};
use slate_runtime::{Rate, StartError};

use crate::logging::common::{Number, load};
use crate::logging::{Talker, folder};

fn parsed(text: &str) -> Result<Configuration, Report> {
    Configuration::from_text("robot.toml", text, &Options::default())
}

fn refused(text: &str) -> (String, Option<usize>) {
    let report = parsed(text).unwrap_err();
    assert_eq!(report.diagnostics().len(), 1, "{report}");
    let diagnostic = &report.diagnostics()[0];
    assert!(diagnostic.help_text().is_some());
    (diagnostic.message().into(), diagnostic.line())
}

#[test]
fn targets_are_read() {
    let text = r#"
[log]
level = "warn"
repeat = 9
[log.levels]
r2 = "debug"
[log.targets]
console = true
file = { path = "logs/agent.log", size = "2MiB", keep = 3 }
syslog = true
remote = "127.0.0.1:7411"
"#;
    let configuration = parsed(text).unwrap();
    let log = configuration.log();
    assert_eq!((log.level_of("r2/planner"), log.level_of("r3/planner")), (Level::Debug, Level::Warn));
    assert_eq!(log.repeat.value, 9);
    assert!(log.targets.console);
    let file = log.targets.file.as_ref().unwrap();
    assert_eq!(file.path.value.to_str(), Some("logs/agent.log"));
    assert_eq!(Rotation { size: file.size, keep: file.keep }, Rotation { size: 2 << 20, keep: 3 });
    assert_eq!(log.targets.syslog.as_ref().unwrap().value, SyslogAddress::Socket("/dev/log".into()));
    assert_eq!(log.targets.remote.unwrap().value.port(), 7411);
}

#[test]
fn targets_are_off_by_default_and_a_later_layer_removes_one() {
    let log = parsed("").unwrap().log().clone();
    assert!(!log.targets.console && log.targets.file.is_none());
    assert!(log.targets.syslog.is_none() && log.targets.remote.is_none());
    assert_eq!(log.repeat.value, 5);
    let off = ["file", "syslog", "remote"].map(|name| format!("log.targets.{name}=false"));
    let text = "[log.targets]\nfile = \"a.log\"\nsyslog = \"10.0.0.1:514\"\nremote = \"[::1]:1\"\n";
    assert!(parsed(text).unwrap().log().targets.file.is_some());
    let options = Options { sets: off.into(), ..Options::default() };
    let log = Configuration::from_text("robot.toml", text, &options).unwrap().log().clone();
    assert!(log.targets.file.is_none() && log.targets.syslog.is_none() && log.targets.remote.is_none());
}

#[test]
fn errors_are_shown_at_their_place() {
    let wrong = [
        ("[log]\nrepeat = -1\n", "`repeat` takes a whole number from 0, found -1"),
        ("[log]\ntarget = 1\n", "unknown key `target` in [log]"),
        ("[log.targets]\nfiles = 1\n", "unknown key `files` in [log.targets]"),
        ("[log.targets]\nconsole = 1\n", "`console` takes true or false, found a whole number"),
        ("[log.targets]\nfile = 1\n", "`file` takes a path or a table, found a whole number"),
        ("[log.targets]\nfile = { size = \"1MB\" }\n", "the log file has no `path`"),
        ("[log.targets]\nfile = { path = \"a\", size = \"1M\" }\n", "`size` takes a size above zero"),
        ("[log.targets]\nfile = { path = \"a\", size = \"0MB\" }\n", "`size` takes a size above zero"),
        (
            "[log.targets]\nfile = { path = \"a\", size = \"99999999999GB\" }\n",
            "`size` takes a size above zero",
        ),
        (
            "[log.targets]\nfile = { path = \"a\", keep = \"all\" }\n",
            "`keep` takes a whole number from 0, found text",
        ),
        ("[log.targets]\nfile = { path = \"a\", kep = 1 }\n", "unknown key `kep` in [log.targets.file]"),
        (
            "[log.targets]\nsyslog = \"nowhere\"\n",
            "`syslog` takes true, the path of a socket, or the address of a server",
        ),
        ("[log.targets]\nremote = 7411\n", "`remote` takes an IP address and a port as text"),
        ("[log.targets]\nremote = true\n", "`remote` takes an IP address and a port as text"),
    ];
    for (text, message) in wrong {
        assert_eq!(refused(text), (message.into(), Some(2)), "{text}");
    }
}

fn start(text: &str) -> Result<slate_runtime::Agent, StartError> {
    let options = slate_runtime::Options { rate: Rate::Max, ..Default::default() };
    let text = format!("time.source = \"talker\"\n[modules.talker]\n{text}");
    load(&text, &[Plugin::linked::<Talker>(), Plugin::linked::<Tail>()], options)
}

fn complaint(text: &str) -> (String, Option<usize>) {
    match start(text) {
        Err(StartError::Configuration(report)) => {
            (report.diagnostics()[0].message().into(), report.diagnostics()[0].line())
        }
        other => panic!("it should be refused: {other:?}"),
    }
}

#[test]
fn the_agent_writes_to_the_targets_of_its_configuration() {
    let folder = folder("configured");
    let socket = UnixDatagram::bind(folder.join("syslog")).unwrap();
    let text =
        format!("[log.targets]\nfile = \"{0}/logs/agent.log\"\nsyslog = \"{0}/syslog\"\n", folder.display());
    let mut agent = start(&text).unwrap();
    assert!(agent.step());
    drop(agent);
    let file = fs::read_to_string(folder.join("logs/agent.log")).unwrap();
    let lines: Vec<_> = file.lines().collect();
    assert_eq!(
        lines,
        [
            "     0.000 info  talker: info 1 0",
            "     0.000 warn  talker: warn 1",
            "     0.000 error talker: error 1"
        ]
    );
    let mut bytes = [0; 100];
    let count = socket.recv(&mut bytes).unwrap();
    let line = String::from_utf8_lossy(&bytes[..count]).into_owned();
    assert!(line.starts_with("<14>test[") && line.ends_with("]: talker: info 1 0"), "{line}");
}

#[test]
fn a_target_that_cannot_be_opened_stops_the_start_cleanly() {
    let folder = folder("refused");
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap();
    let (message, line) =
        complaint(&format!("[log.targets]\nremote = \"{address}\"\nfile = \"{}/a.log\"\n", folder.display()));
    assert!(message.starts_with(&format!("the log can't be offered at {address}: Address already in use")));
    assert_eq!(line, Some(4));
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 0);
    let (message, line) = complaint(&format!("[log.targets]\nfile = \"{}\"\n", folder.display()));
    assert!(message.contains("can't be opened: Is a directory"), "{message}");
    assert_eq!(line, Some(4));
}

/// A port with the name of the log's own property.
#[ports]
pub struct TailIo {
    tail: Output<Number>,
}

/// Stands in the way of the log.
pub struct Tail;

#[module(stage = Think)]
impl Module for Tail {
    type Io = TailIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &TailIo, _: &(), _: &Tick) -> Outcome {
        io.tail.set(Number { value: 1.0 });
        Outcome::Ok
    }
}

#[test]
fn a_module_cannot_take_the_place_of_the_tail() {
    let (message, line) = complaint("[modules.log]\nkind = \"tail\"\n");
    assert_eq!((message.as_str(), line), ("no module can be named `log`: `log` is the log", Some(3)));
}

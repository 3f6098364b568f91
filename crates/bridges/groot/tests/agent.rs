//! An agent whose modules show trees.

use std::sync::Arc;
use std::thread::JoinHandle;

use slate_executive::tree_view::TreeView;
use slate_groot::{GrootBridge, GrootSettings};
use slate_module::Plugin;
use slate_module::prelude::*;
use slate_runtime::configuration::{Configuration, Database, Options as Sources};
use slate_runtime::{Agent, Composer, Control, Options, Stopper};

#[interface]
pub struct Count {
    pub ticks: u64,
}

#[ports]
pub struct ShownIo {
    #[capacity(64)]
    tree_xml: Debug<TreeView>,
    tree_nodes: Debug<TreeView>,
    tree_blackboards: Debug<TreeView>,
    count: Output<Count>,
}

#[params]
pub struct ShownParams {
    #[param(default = "<root/>", doc = "text that is shown as the tree")]
    xml: Text<124>,
}

/// Shows a tree as a Plan does.
pub struct Shown;

#[module(stage = Think)]
impl Module for Shown {
    type Io = ShownIo;
    type Params = ShownParams;
    type State = u64;

    fn tick(state: &mut u64, io: &ShownIo, params: &ShownParams, _: &Tick) -> Outcome {
        *state += 1;
        io.count.set(Count { ticks: *state });
        show(&io.tree_xml, params.xml.as_str().as_bytes());
        show(&io.tree_nodes, &[1, 12, 3]);
        show(
            &io.tree_blackboards,
            br#"[["main","x",1],["main","y",-0.5],["main","z",300],["main/1 go","to","kitchen"]]"#,
        );
        Outcome::Ok
    }
}

fn show(port: &Debug<TreeView>, content: &[u8]) {
    let head = |view: &mut TreeView| (view.fingerprint, view.size) = (7, content.len() as u64);
    let is_written = port.write(content.len(), |view| {
        head(view);
        view.content.copy_from_slice(content);
    });
    if !is_written {
        port.write(0, head);
    }
}

pub fn database(text: &str) -> Database {
    let sources = Sources { extra_tables: vec!["groot".into()], ..Sources::default() };
    let text = format!("agent.name = \"r2\"\nloop.period = \"1ms\"\n{text}");
    Database::from_text("test.toml", &text, sources).unwrap()
}

pub fn loaded(database: &Database) -> Agent {
    Agent::load_with(database, &[Plugin::linked::<Shown>()], Options::default()).unwrap()
}

pub fn settings(configuration: &Configuration) -> GrootSettings {
    GrootSettings::of(configuration).unwrap().unwrap()
}

/// An agent that runs until this is dropped.
pub struct RunningAgent {
    pub bridge: Option<GrootBridge>,
    pub composer: Composer,
    stopper: Stopper,
    thread: Option<JoinHandle<()>>,
}

impl RunningAgent {
    pub fn start(text: &str) -> Self {
        let database = database(text);
        let mut agent = loaded(&database);
        let (composer, stopper) = (agent.composer(), agent.stopper());
        let configuration: Arc<Configuration> = database.current();
        let bridge = GrootBridge::open(&composer, &settings(&configuration)).unwrap();
        let run = move || agent.run(Box::new(|_| Control::Continue)).map(|_| ()).unwrap();
        Self { bridge: Some(bridge), composer, stopper, thread: Some(std::thread::spawn(run)) }
    }

    /// The ports of the trees, in the order of the configuration.
    pub fn ports(&self) -> Vec<u16> {
        self.bridge.iter().flat_map(|bridge| bridge.addresses()).map(|(_, address)| address.port()).collect()
    }

    pub fn ticks(&self) -> f64 {
        let read = self.composer.board().read("planner/count/ticks").unwrap();
        read.and_then(|(value, _)| value.as_f64()).unwrap_or(0.0)
    }
}

impl Drop for RunningAgent {
    fn drop(&mut self) {
        self.bridge = None;
        self.stopper.stop();
        let ended = self.thread.take().map(JoinHandle::join);
        assert!(std::thread::panicking() || ended.is_none_or(|ended| ended.is_ok()));
    }
}

//! A vision module runs only while a vision master does, and that one can't be unloaded while it is used.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and files are read in their own time"
)]

mod detection;

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use slate_module::Plugin;
use slate_module::aspect::Aspect;
use slate_module::blackboard::interface::Value;
use slate_module::prelude::*;
use slate_runtime::configuration::{self, Configuration};
use slate_runtime::log::MemoryTarget;
use slate_runtime::{Agent, Options, PluginError, Rate, StartError};
use slate_vision::{BlobFinder, Vision, VisionMaster, VisionMasterIo, VisionMasterState};

/// What the viewer saw.
#[interface]
pub struct View {
    /// Pictures seen.
    pub pictures: u64,
    /// When the last one was taken.
    #[unit("ns")]
    pub time: u64,
}

/// Ports of [`Viewer`].
#[ports]
pub struct ViewerIo {
    vision: Aspect<Vision>,
    #[safe(View { pictures: 0, time: 0 })]
    view: Output<View>,
}

/// Parameters of [`Viewer`].
#[params]
pub struct ViewerParams {
    #[param(default = "pattern:64x48@50", doc = "the camera")]
    camera: Text<124>,
}

/// Counts pictures.
pub struct Viewer;

#[module(stage = WorldState)]
impl Module for Viewer {
    type Io = ViewerIo;
    type Params = ViewerParams;
    type State = (u64, u64);

    fn tick((pictures, last): &mut (u64, u64), io: &ViewerIo, params: &ViewerParams, now: &Tick) -> Outcome {
        match io.vision.capture(params.camera.as_str()) {
            Ok(Some(picture)) => {
                assert!(picture.stamp().time <= now.now());
                if picture.stamp().time != *last {
                    *pictures += 1;
                    *last = picture.stamp().time;
                }
            }
            Ok(None) => {}
            Err(refusal) => {
                now.error(format_args!("{refusal}"));
                return Outcome::Failed;
            }
        }
        io.view.set(View { pictures: *pictures, time: *last });
        Outcome::Ok
    }
}

/// Whether [`Fragile`] breaks in its next tick.
static BREAKS: AtomicBool = AtomicBool::new(false);

/// Vision master that panics on request.
pub struct Fragile;

#[module(stage = SensorAcquire)]
impl Module for Fragile {
    type Io = VisionMasterIo;
    type Params = ();
    type State = VisionMasterState;

    fn tick(state: &mut VisionMasterState, io: &VisionMasterIo, (): &(), now: &Tick) -> Outcome {
        if BREAKS.swap(false, Ordering::SeqCst) {
            panic!("as the test wants");
        }
        VisionMaster::tick(state, io, &(), now)
    }
}

/// The clock.
pub struct Beat;

#[module(stage = PreLoop)]
impl Module for Beat {
    type Io = ();
    type Params = ();
    type State = ();

    fn tick(_: &mut (), (): &(), (): &(), _: &Tick) -> Outcome {
        Outcome::Ok
    }
}

fn configuration(text: &str) -> Configuration {
    let text = format!(
        "time.source = \"beat\"\n[loop]\nperiod = \"20ms\"\nhang = \"300ms\"\n[modules.beat]\n{text}"
    );
    Configuration::from_text("test.toml", &text, &configuration::Options::default()).unwrap()
}

fn load_with(text: &str, plugins: &[Plugin], workers: usize) -> Result<(Agent, MemoryTarget), StartError> {
    let log = MemoryTarget::default();
    let log_options = vec![Box::new(log.clone()) as Box<_>];
    let options = Options {
        rate: Rate::Max,
        log: log_options,
        workers,
        always_help: workers > 0,
        ..Options::default()
    };
    let mut all = vec![Plugin::linked::<Beat>()];
    all.extend_from_slice(plugins);
    Ok((Agent::load(&configuration(text), &all, options)?, log))
}

fn load(text: &str, plugins: &[Plugin]) -> (Agent, MemoryTarget) {
    load_with(text, plugins, 0).unwrap()
}

fn steps(agent: &mut Agent, count: u64) {
    (0..count).for_each(|_| assert!(agent.step()));
}

fn number(agent: &Agent, path: &str) -> f64 {
    agent.board().read(path).unwrap().map_or(f64::NAN, |(value, _)| value.as_f64().unwrap())
}

fn condition(agent: &Agent, module: &str) -> &'static str {
    let modules = agent.composer().modules();
    modules.into_iter().find(|status| status.name == module).unwrap().condition
}

fn master_and_finder() -> [Plugin; 2] {
    [Plugin::linked::<VisionMaster>(), Plugin::linked::<BlobFinder>()]
}

const ROBOT: &str = "
[modules.vision_master]
[modules.blob_finder]
params.camera = \"pattern:64x48@50\"
";

#[test]
fn the_finder_follows_the_disc() {
    let (mut agent, _) = load(ROBOT, &master_and_finder());
    steps(&mut agent, 3);
    for _ in 0..100 {
        steps(&mut agent, 1);
        let seconds = agent.now() as f64 * 1e-9;
        let angle = std::f64::consts::TAU * (seconds / 4.0);
        let (x, y) =
            (31.5 + 14.4 * slate_module::math::cos(angle), 23.5 + 14.4 * slate_module::math::sin(angle));
        let found = (number(&agent, "blob_finder/blob/x"), number(&agent, "blob_finder/blob/y"));
        assert!((found.0 - x).abs() < 0.6 && (found.1 - y).abs() < 0.6, "{found:?} {x} {y}");
        assert_eq!(number(&agent, "blob_finder/blob/time"), agent.now() as f64);
    }
}

#[test]
fn lockstep_repeats_it_with_any_number_of_workers() {
    let digest = |workers| {
        let (mut agent, _) = load_with(ROBOT, &master_and_finder(), workers).unwrap();
        steps(&mut agent, 200);
        assert!(number(&agent, "blob_finder/blob/pixels") > 10.0);
        agent.digest().unwrap()
    };
    let first = digest(0);
    assert_eq!([digest(0), digest(1), digest(2)], [first; 3]);
}

#[test]
fn vision_master_shows_picture_to_watchers() {
    let (mut agent, _) = load(ROBOT, &master_and_finder());
    steps(&mut agent, 5);
    assert!(agent.board().read("vision_master/image").unwrap().is_none());
    let (property, _) = agent.board().find("vision_master/image").unwrap();
    let watching = property.watch();
    steps(&mut agent, 2);
    let (value, _) = agent.board().read("vision_master/image").unwrap().unwrap();
    assert_eq!(value.get("width"), Some(&Value::Integer(64)));
    let Some(Value::List(pixels)) = value.get("data") else { panic!("{value:?}") };
    assert_eq!(pixels.len(), 64 * 48);
    assert!(pixels.contains(&Value::Integer(255)));
    drop(watching);
}

#[test]
fn without_a_master_a_vision_module_does_not_start() {
    let Err(StartError::Configuration(report)) =
        load_with("[modules.blob_finder]\n", &master_and_finder(), 0).map(|_| ())
    else {
        panic!("it should not start")
    };
    let text = report.to_string();
    assert!(text.contains("`blob_finder` needs `vision 1`, which nothing provides"), "{text}");
    let twice = "[modules.one]\nkind = \"vision_master\"\n[modules.two]\nkind = \"vision_master\"\n";
    let Err(StartError::Configuration(report)) =
        load_with(&format!("{twice}[modules.blob_finder]\n"), &master_and_finder(), 0).map(|_| ())
    else {
        panic!("it should not start")
    };
    let text = report.to_string();
    assert!(text.contains("which both `one` and `two` provide"), "{text}");
}

#[test]
fn only_an_unused_master_can_be_unloaded() {
    let (mut agent, _) = load(ROBOT, &master_and_finder());
    steps(&mut agent, 5);
    let composer = agent.composer();
    let error = composer.unload("vision_master").unwrap_err();
    let PluginError::Unfit(report) = &error else { panic!("{error}") };
    let text = report.to_string();
    assert!(text.contains("`blob_finder` needs `vision 1`, which nothing provides"), "{text}");
    let before = agent.counts("blob_finder").unwrap().0;
    steps(&mut agent, 5);
    assert_eq!(agent.counts("blob_finder").unwrap().0, before + 5);
    assert_eq!(condition(&agent, "blob_finder"), "WORKING");
    composer.unload("blob_finder").unwrap();
    composer.unload("vision_master").unwrap();
    assert_eq!(agent.modules(), ["beat"]);
    steps(&mut agent, 5);
}

#[test]
fn while_the_master_is_not_there_after_a_panic_its_users_wait() {
    let text = "[modules.fragile]\n[modules.viewer]\n";
    let (mut agent, _) = load(text, &[Plugin::linked::<Fragile>(), Plugin::linked::<Viewer>()]);
    steps(&mut agent, 10);
    let seen = number(&agent, "viewer/view/pictures");
    assert!(seen >= 5.0, "{seen}");
    BREAKS.store(true, Ordering::SeqCst);
    steps(&mut agent, 1);
    // Its users wait in the very cycle, with safe outputs, and hold no code of the instance that is gone.
    assert_eq!(condition(&agent, "viewer"), "WAITING");
    assert_eq!(number(&agent, "viewer/view/pictures"), 0.0);
    assert_eq!(agent.counts("fragile").unwrap().2, 1);
    steps(&mut agent, 10);
    assert_eq!(condition(&agent, "viewer"), "WORKING");
    let now = number(&agent, "viewer/view/pictures");
    assert!(now > seen, "{seen} {now}");
}

/// Steps until it is true.
fn until(agent: &mut Agent, log: &MemoryTarget, what: &str, mut is: impl FnMut(&Agent) -> bool) {
    let start = Instant::now();
    while !is(agent) {
        if start.elapsed() > Duration::from_secs(20) {
            agent.logger().flush(Duration::from_secs(1));
            let lines: Vec<_> = log.lines().into_iter().map(|record| record.text).collect();
            panic!("never: {what}; the log: {lines:#?}");
        }
        steps(agent, 1);
        std::thread::sleep(Duration::from_millis(1));
    }
}

struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("slate-vision-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }

    /// A picture with one bright pixel. It is there as a whole or not at all.
    fn write(&self, file: &str, bright: usize) {
        let mut bytes = b"P5 # of a test\n8 4 255\n".to_vec();
        bytes.extend((0..32).map(|pixel| if pixel == bright { 250 } else { 10 }));
        self.put(file, &bytes);
    }

    fn put(&self, file: &str, bytes: &[u8]) {
        let draft = self.0.join("draft");
        std::fs::write(&draft, bytes).unwrap();
        std::fs::rename(draft, self.0.join(file)).unwrap();
    }

    fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[test]
fn files_are_pictures_in_order_and_broken_ones_are_named() {
    let folder = Folder::new("files");
    folder.write("1.pgm", 9);
    folder.write("2.pgm", 18);
    let text = format!(
        "[modules.vision_master]\n[modules.blob_finder]\nparams.camera = \"file:{}/%d.pgm@500\"\n",
        folder.path().display()
    );
    let (mut agent, log) = load(&text, &master_and_finder());
    let at = |x: f64, y: f64| {
        move |agent: &Agent| {
            (number(agent, "blob_finder/blob/x"), number(agent, "blob_finder/blob/y")) == (x, y)
        }
    };
    until(&mut agent, &log, "the first picture", at(1.0, 1.0));
    until(&mut agent, &log, "the second one", at(2.0, 2.0));
    until(&mut agent, &log, "the first one again", at(1.0, 1.0));
    folder.put("1.pgm", b"P5 8 4 255\nshort");
    folder.put("2.pgm", b"P6");
    let logged = |what: &str| log.lines().iter().any(|record| record.text.contains(what));
    until(&mut agent, &log, "a refusal", |_| logged("1.pgm ends before its last pixel"));
    until(&mut agent, &log, "another refusal", |_| logged("2.pgm is no PGM"));
    assert_eq!(condition(&agent, "blob_finder"), "FAILED");
    folder.put("1.pgm", &[b"P5 8 5 255\n".as_slice(), &[0; 40]].concat());
    until(&mut agent, &log, "a size that changed", |_| logged("1.pgm has 40 pixels"));
    folder.write("1.pgm", 27);
    folder.write("2.pgm", 27);
    until(&mut agent, &log, "a picture again", at(3.0, 3.0));
    assert_eq!(condition(&agent, "blob_finder"), "WORKING");
    drop(agent);
}

/// The library of this crate, which is built with its tests.
fn library() -> PathBuf {
    let test = std::env::current_exe().unwrap();
    let folders = [test.parent().unwrap(), test.parent().unwrap().parent().unwrap()];
    let name = format!("{}slate_vision{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let found = folders.iter().map(|folder| folder.join(&name)).find(|file| file.exists());
    found.expect("cargo builds the library for its tests")
}

/// A configuration with the master from its library and a viewer of that file.
fn with_library(file: &Path) -> String {
    format!(
        "[plugins.slate-vision]\nfile = \"{}\"\n[modules.vision_master]\n[modules.viewer]\n\
         params.camera = \"file:{}@500\"\n",
        library().display(),
        file.display()
    )
}

#[cfg(target_os = "linux")]
#[test]
fn a_camera_that_hangs_keeps_the_masters_code_and_lets_it_go_on() {
    let folder = Folder::new("pipe");
    let file = folder.path().join("picture.pgm");
    assert!(std::process::Command::new("mkfifo").arg(&file).status().unwrap().success());
    // Its reader waits for values that may still be written.
    let pipe = std::fs::OpenOptions::new().read(true).write(true).open(&file).unwrap();
    let (mut agent, log) = load(&with_library(&file), &[Plugin::linked::<Viewer>()]);
    let is_pipe = |entry: std::io::Result<std::fs::DirEntry>| {
        entry.and_then(|entry| std::fs::read_link(entry.path())).is_ok_and(|target| target == file)
    };
    let open = || std::fs::read_dir("/proc/self/fd").unwrap().map(is_pipe).filter(|is| *is).count();
    until(&mut agent, &log, "the camera's thread reads the pipe", |_| open() == 2);
    let composer = agent.composer();
    let error = composer.reload("slate-vision", None).unwrap_err();
    let expected =
        "thread `camera-0` of module `vision_master` has not ended within 300ms after the stop request";
    assert_eq!(error.to_string(), expected);
    let ticks = agent.counts("vision_master").unwrap().0;
    steps(&mut agent, 5);
    assert_eq!(agent.counts("vision_master").unwrap().0, ticks + 5);
    folder.write("picture.pgm", 9);
    drop(pipe);
    until(&mut agent, &log, "a picture", |agent| number(agent, "viewer/view/pictures") > 0.0);
    assert!(composer.reload("slate-vision", None).unwrap().in_place);
}

#[test]
fn the_library_of_a_used_master_is_reloaded_not_unloaded() {
    let folder = Folder::new("reload");
    folder.write("picture.pgm", 9);
    let text = with_library(&folder.path().join("picture.pgm"));
    let (mut agent, log) = load(&text, &[Plugin::linked::<Viewer>()]);
    let composer = agent.composer();
    let mut seen = 0.0;
    for _ in 0..3 {
        until(&mut agent, &log, "more pictures", |agent| number(agent, "viewer/view/pictures") > seen + 3.0);
        seen = number(&agent, "viewer/view/pictures");
        let error = composer.unload("slate-vision").unwrap_err();
        assert!(matches!(&error, PluginError::Unfit(_)), "{error}");
        // The thread that reads the files ends first, then the code is exchanged, and the viewer continues.
        let reload = composer.reload("slate-vision", None).unwrap();
        assert!(reload.in_place);
        assert_eq!(reload.modules, [("vision_master".to_owned(), Ok(()))]);
        steps(&mut agent, 1);
    }
    until(&mut agent, &log, "more pictures", |agent| number(agent, "viewer/view/pictures") > seen + 3.0);
    assert_eq!(agent.counts("viewer").unwrap().2, 0);
    composer.unload("viewer").unwrap();
    let libraries = composer.unload("slate-vision").unwrap();
    assert_ne!(libraries[0].1, "open");
}

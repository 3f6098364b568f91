//! Vision modules run on recordings, and see the pictures of then.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test that fails panics, and files are read in their own time"
)]

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use slate_module::Plugin;
use slate_module::prelude::*;
use slate_record::Recorder;
use slate_replay::{Plan, Player, Recomputation};
use slate_runtime::configuration::{Database, Options as Layers};
use slate_runtime::{Agent, Options, Rate};
use slate_vision::{BlobFinder, VisionMaster, VisionPlayer};

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

fn plugins() -> Vec<Plugin> {
    let linked = [Plugin::linked::<VisionMaster>(), Plugin::linked::<VisionPlayer>()];
    linked.into_iter().chain([Plugin::linked::<BlobFinder>(), Plugin::linked::<Beat>()]).collect()
}

fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("vision-replay-{name}"));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// A clock, a master, and what else is said.
fn robot(text: &str) -> String {
    format!(
        "agent.name = \"robot\"\ntime.source = \"beat\"\nlog.targets.console = false\nrecord.enabled = true\n\
         [loop]\nperiod = \"20ms\"\n[modules.beat]\n[modules.vision_master]\n{text}"
    )
}

/// Records cycles; before each, something may be done.
fn record(path: &Path, text: &str, cycles: usize, mut before: impl FnMut(usize)) {
    let database = Database::from_text("robot.toml", text, Layers::default()).unwrap();
    let recorder = Recorder::new(database.current().record());
    let options = Options {
        rate: Rate::Max,
        recording: Some(Arc::new(recorder.clone())),
        log: vec![recorder.log_target()],
        ..Options::default()
    };
    let mut agent = Agent::load_with(&database, &plugins(), options).unwrap();
    recorder.begin(&agent, path);
    for cycle in 0..cycles {
        before(cycle);
        assert!(agent.step());
    }
    recorder.end(&mut agent).unwrap();
}

fn plan(modules: &[&str]) -> Plan {
    Plan { modules: modules.iter().map(|name| (*name).to_owned()).collect(), ..Plan::default() }
}

/// Plays a recording to its end, and looks at the agent then.
fn play(path: &Path, plan: Plan, look: impl FnOnce(&Agent)) -> Recomputation {
    let mut player = Player::open(path, &plugins(), plan).unwrap();
    let options = Options {
        rate: Rate::Max,
        recording: player.recording(None),
        playback: Some(player.playback()),
        ..Options::default()
    };
    let database = player.configuration().unwrap();
    let mut agent =
        Agent::load_with(&database, &plugins(), options).unwrap_or_else(|error| panic!("{error:?}"));
    player.run(&mut agent, &AtomicBool::new(false)).unwrap();
    look(&agent);
    player.outcome().unwrap().unwrap()
}

fn refusal(path: &Path, plan: Plan) -> String {
    Player::open(path, &plugins(), plan).map(drop).unwrap_err().to_string()
}

/// How many of the values of a property are the same.
fn same(outcome: &Recomputation, url: &str) -> u64 {
    outcome.properties.iter().find(|own| own.url == url).map_or(0, |own| own.same)
}

/// Two cameras, one of which two modules use; one looks from the middle on.
const FINDERS: &str = "
[modules.left]
kind = \"blob_finder\"
params.camera = \"pattern:64x48@30\"
[modules.right]
kind = \"blob_finder\"
params.camera = \"pattern:32x32@11\"
[modules.early]
kind = \"blob_finder\"
stage = \"PreLoop\"
params.camera = \"pattern:64x48@30\"
";

#[test]
fn each_vision_module_writes_on_a_recording_what_it_wrote_then() {
    let path = folder("each").join("run.mcap");
    record(&path, &robot(FINDERS), 100, |_| {});
    for modules in [&["left"][..], &["right"], &["early"], &["left", "right"]] {
        let outcome = play(&path, plan(modules), |_| {});
        assert_eq!(outcome.first, None, "{modules:?}");
        for module in modules {
            assert!(same(&outcome, &format!("/{module}/blob")) > 20, "{outcome:?}");
        }
        // What is added is nothing of the recorded agent's.
        assert!(outcome.properties.iter().all(|own| !own.url.contains("played")), "{outcome:?}");
    }
    // With the master itself all is made again, also its pictures.
    let outcome = play(&path, plan(&["vision_master", "left", "right", "early"]), |_| {});
    assert_eq!(outcome.first, None);
    assert!(same(&outcome, "/vision_master/image") > 50, "{outcome:?}");
    let alone = refusal(&path, plan(&["vision_master"]));
    let asked = "what early and left and right asked of vision_master by `vision 1` is not recorded: let all of them run";
    assert!(alone.contains(asked), "{alone}");
}

#[test]
fn a_module_that_begins_later_sees_the_picture_that_was_there() {
    let path = folder("later").join("run.mcap");
    record(&path, &robot(FINDERS), 100, |_| {});
    let outcome = play(&path, Plan { start: Some(1_000_000_000), ..plan(&["right"]) }, |_| {});
    // Whether it has seen that picture before is what it remembered then.
    let own = outcome.properties.iter().find(|own| own.url == "/right/blob").unwrap();
    assert!(
        own.different == 0 && own.only_recorded == 0 && own.only_recomputed <= 1 && own.same > 8,
        "{own:?}"
    );
}

#[test]
fn another_parameter_is_tried_on_the_same_pictures() {
    let path = folder("other").join("run.mcap");
    record(&path, &robot(FINDERS), 50, |_| {});
    let sets = vec!["modules.left.params.min_brightness=0.2".to_owned()];
    let outcome = play(&path, Plan { sets, ..plan(&["left"]) }, |_| {});
    let first = outcome.first.unwrap();
    assert_eq!(first.url, "/left/blob");
    // So is a module that the robot did not have.
    let sets = ["kind=\"blob_finder\"", "params.camera=\"pattern:32x32@11\""];
    let sets = sets.map(|set| format!("modules.new.{set}")).to_vec();
    let outcome = play(&path, Plan { sets, ..plan(&["new"]) }, |agent| {
        assert!(agent.board().read("new/blob").unwrap().is_some());
    });
    assert!(
        outcome.properties.iter().any(|own| own.url == "/new/blob" && own.only_recomputed > 8),
        "{outcome:?}"
    );
}

/// The files are gone, as those of a camera that was real would be.
#[test]
fn pictures_that_came_from_outside_are_those_of_the_recording() {
    let folder = folder("files");
    let picture = |bright: usize| {
        let mut bytes = b"P5 8 4 255\n".to_vec();
        bytes.extend((0..32).map(|pixel| if pixel == bright { 250 } else { 10 }));
        let draft = folder.join("draft");
        std::fs::write(&draft, bytes).unwrap();
        std::fs::rename(draft, folder.join("picture.pgm")).unwrap();
    };
    let text = format!(
        "[modules.finder]\nkind = \"blob_finder\"\nparams.camera = \"file:{}/picture.pgm@200\"\n",
        folder.display()
    );
    let path = folder.join("run.mcap");
    record(&path, &robot(&text), 120, |cycle| {
        match cycle {
            // There are times without a picture.
            40 => std::fs::remove_file(folder.join("picture.pgm")).unwrap(),
            cycle if !(30..=70).contains(&cycle) => picture(cycle % 32),
            _ => {}
        }
        std::thread::sleep(Duration::from_millis(4));
    });
    std::fs::remove_file(folder.join("picture.pgm")).unwrap();
    let outcome = play(&path, plan(&["finder"]), |agent| {
        assert!(!agent.modules().iter().any(|name| name == "vision_master"));
    });
    assert_eq!(outcome.first, None, "{outcome:?}");
    assert!(same(&outcome, "/finder/blob") > 10, "{outcome:?}");
    // It has worked, failed and worked again.
    assert!(same(&outcome, "/finder/state") >= 3, "{outcome:?}");
}

#[test]
fn a_missing_player_of_recorded_pictures_is_named() {
    let path = folder("nothing").join("run.mcap");
    record(&path, &robot(FINDERS), 10, |_| {});
    let without: Vec<_> = plugins().into_iter().filter(|plugin| plugin.name() != "vision_player").collect();
    let told = Player::open(&path, &without, plan(&["left"])).map(drop).unwrap_err().to_string();
    let words = "`left` needs `vision 1` of `vision_master`, which no module can give it out of a recording: let \
                 `vision_master` run too";
    assert!(told.contains(words), "{told}");
}

#[test]
fn missing_pictures_are_reported_before_run() {
    let folder = folder("missing");
    let path = folder.join("none.mcap");
    let recorded = |path: &Path, how: &str| {
        let text =
            robot(FINDERS).replace("record.enabled = true", &format!("record.enabled = true\nrecord.{how}"));
        record(path, &text, 30, |_| {});
    };
    recorded(&path, "exclude = [\"/vision_master/image\", \"/vision_master/image_2\"]");
    let told = refusal(&path, plan(&["left"]));
    assert!(told.contains("nothing of /vision_master/image is recorded"), "{told}");
    // They run all the same, and fail as a camera without pictures has them fail.
    let outcome = play(&path, Plan { is_partial: true, ..plan(&["left"]) }, |agent| {
        let modules = agent.composer().modules();
        assert_eq!(modules.iter().find(|own| own.name == "left").unwrap().condition, "FAILED");
    });
    assert!(outcome.first.is_some());
    let path = folder.join("some.mcap");
    recorded(&path, "rules = [{ select = \"/vision_master/image\", rate = 5.0 }]");
    let told = refusal(&path, plan(&["left"]));
    assert!(told.contains("of /vision_master/image are recorded"), "{told}");
    // A never watched value is not missing.
    let path = folder.join("enough.mcap");
    recorded(&path, "select = [\"/vision_master/**\", \"/right/**\"]");
    assert_eq!(play(&path, plan(&["right"]), |_| {}).first, None);
}

//! Recording beside the crate of the format and Copper's log.
//! The time goes from the module that writes the value until the file has it, as lockstep waits for room.

#[allow(missing_docs, reason = "what the macro makes has none")]
mod copper;

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::sync::Arc;

use slate_interfaces::Image;
use slate_module::Plugin;
use slate_module::prelude::*;
use slate_record::Recorder;
use slate_runtime::configuration::Record;
use slate_runtime::recording::Recording;
use slate_runtime::{Agent, Options, Rate, RecordedTimes};

use super::agents;
use super::caterpillar::{MODULES, Recorded, copper_on};
use crate::machine::unpin;
use crate::measure::{Contest, Effort, Samples};
use crate::table::{Role, Table};

/// Bytes of an image: 640 by 480 pixels of three.
const IMAGE: usize = 640 * 480 * 3;

/// The ports of a camera.
#[ports]
pub struct CameraIo {
    #[capacity(921600)]
    image: Output<Image>,
}

/// Takes pictures.
pub struct Camera;

#[module(stage = SensorAcquire)]
impl Module for Camera {
    type Io = CameraIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &CameraIo, _: &(), now: &Tick) -> Outcome {
        io.image.write(IMAGE, |image| image.data[now.number() as usize % IMAGE] = 1);
        Outcome::Ok
    }
}

/// Measures all lines.
pub fn run(effort: Effort, table: &mut Table) {
    // The writer of the file has a thread of its own.
    unpin();
    let images = effort.count(300);
    let mut contest = Contest::new("record", "an image of 0.92 MB");
    contest.with("Slate, with the cycle of its module", Role::Slate, move |samples| camera(images, samples));
    contest.with("Copper (cu29), with the cycle of its task", Role::Lesser, move |samples| {
        let folder = super::folder();
        let mut step = copper::start(folder.path()).expect("there is room for a log");
        for _ in 0..images / 10 {
            samples.burst(10, |_| step());
        }
    });
    contest.with("mcap crate alone", Role::Floor, move |samples| {
        let folder = super::folder();
        let mut file = Mcap::create(folder.path(), 1);
        let bytes = vec![1; IMAGE];
        for number in 0..images / 10 {
            samples.burst(10, |i| file.write(0, number as u64 * 10 + i, &bytes));
        }
    });
    contest.run(effort, table);

    let cycles = effort.count(20_000);
    let mut contest = Contest::new("record", format!("{MODULES} numbers of a cycle"));
    contest.with("Slate, with the cycle of the modules", Role::Slate, move |samples| {
        let folder = super::folder();
        let mut recorded = Recorded::start(folder.path());
        for _ in 0..cycles / 100 {
            samples.burst(100, |_| assert!(recorded.agent.step()));
        }
        recorded.end();
    });
    contest.with("Copper (cu29), with the cycle of the tasks", Role::Lesser, move |samples| {
        let folder = super::folder();
        let mut step = copper_on::start(folder.path()).expect("there is room for a log");
        for _ in 0..cycles / 100 {
            samples.burst(100, |_| step());
        }
    });
    contest.with("mcap crate alone", Role::Floor, move |samples| {
        let folder = super::folder();
        let mut file = Mcap::create(folder.path(), MODULES);
        for number in 0..cycles / 100 {
            samples.burst(100, |i| {
                (0..MODULES).for_each(|place| file.write(place, number as u64 * 100 + i, &i.to_le_bytes()));
            });
        }
    });
    contest.run(effort, table);
}

fn camera(images: usize, samples: &mut Samples) {
    let folder = super::folder();
    let mut settings = Record { enabled: true, ..Record::default() };
    settings.flight.enabled = false;
    let recorder = Recorder::on_demand(&settings);
    let options = Options {
        rate: Rate::Max,
        time_source: Some(Box::new(RecordedTimes::new(Vec::new()))),
        recording: Some(Arc::new(recorder.clone()) as Arc<dyn Recording>),
        log: vec![recorder.log_target()],
        ..Options::default()
    };
    let database = agents::database("[log.targets]\nconsole = false\n[modules.camera]\n");
    let agent = Agent::load_with(&database, &[Plugin::linked::<Camera>()], options);
    let mut agent = agent.expect("the modules of a bench fit");
    recorder.attach(&agent, folder.path());
    for _ in 0..images / 10 {
        samples.burst(10, |_| assert!(agent.step()));
    }
    let recorded = recorder.finish(&mut agent).expect("it recorded").expect("the disk is not full");
    assert_eq!(recorded.dropped, 0, "everything is recorded");
}

/// A file of the format, as the crate writes it without compression.
pub(super) struct Mcap {
    writer: mcap::Writer<BufWriter<File>>,
    channels: Vec<u16>,
}

impl Mcap {
    pub fn create(folder: &Path, channels: usize) -> Self {
        let file = File::create(folder.join("floor.mcap")).expect("there is room for a file");
        let options = mcap::WriteOptions::new().compression(None);
        let mut writer = options.create(BufWriter::new(file)).expect("there is room for a file");
        let schema = writer.add_schema("bytes", "", &[]).expect("the first schema");
        let channel = |i| writer.add_channel(schema, &format!("c{i}"), "", &BTreeMap::new());
        let channels: Result<Vec<_>, _> = (0..channels).map(channel).collect();
        Self { channels: channels.expect("there are few channels"), writer }
    }

    pub fn write(&mut self, channel: usize, number: u64, bytes: &[u8]) {
        let header = mcap::records::MessageHeader {
            channel_id: self.channels[channel],
            sequence: number as u32,
            log_time: number,
            publish_time: number,
        };
        self.writer.write_to_known_channel(&header, bytes).expect("there is room for the file");
    }
}

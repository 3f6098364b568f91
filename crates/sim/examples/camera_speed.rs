//! Benchmark of the rendered camera: time and mean processor time of an image.
//! `cargo run --release -p slate-sim --example camera_speed`. Images are written as PNG into a folder that is named
//! behind `--`.

// Wall time is what is measured here.
#![allow(clippy::disallowed_methods)]

use std::error::Error;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use slate_sim::drive::Wheels;
use slate_sim::geometry::Pose;
use slate_sim::robot::{CameraDescription, RobotDescription};
use slate_sim::world::World;
use slate_sim::{Placement, RenderedWorld, Simulation};

const STEP: u64 = 10_000_000;
const IMAGES: usize = 600;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1);
    let folder = folder.as_deref().map(Path::new);
    println!("| 320 x 240 | images | p50 | p99 | max | processor time | digest |");
    println!("|---|---|---|---|---|---|---|");
    let camera = summit()?;
    let lens = CameraDescription { distortion: [-0.2, 0.03], ..camera.clone() };
    let long = CameraDescription { exposure: 0.03, gain: 0.33, ..camera.clone() };
    measure("at rest", &camera, 0.0, false, folder)?;
    measure("turning at 0.5 rad/s, the head at 1.5 rad/s", &camera, 0.5, true, folder)?;
    measure("the same with 30 ms of exposure", &long, 0.5, true, folder)?;
    measure(
        "the same with distortion",
        &CameraDescription { distortion: [-0.2, 0.03], ..long },
        0.5,
        true,
        None,
    )?;
    measure("at rest with distortion", &lens, 0.0, false, folder)
}

fn summit() -> Result<CameraDescription, Box<dyn Error>> {
    let mut robot = RobotDescription::load("summit_xl")?;
    robot.camera.remove("pan_tilt").ok_or_else(|| "no such camera".into())
}

/// Renders images of a robot that turns in the middle of the hall.
fn measure(
    name: &str,
    camera: &CameraDescription,
    turn: f64,
    sweeps: bool,
    folder: Option<&Path>,
) -> Result<(), Box<dyn Error>> {
    let world = World::load("rescue_arena")?;
    let mut description = RobotDescription::load("pioneer_p3dx")?;
    description.sonar.clear();
    let pose = Pose { x: -1.2, y: 0.2, theta: 0.0 };
    let robot = Placement { name: "r".into(), description, sonar: String::new(), pose, script: None };
    let mut simulation = Simulation::new(&world, &[robot], 1, STEP)?;
    simulation.mount_camera(0, camera, &Arc::new(RenderedWorld::new(&world, false)), 1);
    let side = turn * 0.331 / 2.0 / 0.0975;
    simulation.command(0, Wheels { left: -side, right: side });
    let begin = processor_time();
    let (mut times, mut digest) = (Vec::new(), 0xcbf2_9ce4_8422_2325_u64);
    let mut step = 0_u32;
    while times.len() < IMAGES {
        if sweeps && step.is_multiple_of(400) {
            let to = if (step / 400).is_multiple_of(2) { 1.5 } else { -1.5 };
            simulation.command_head(0, [to, 0.3 * to]);
        }
        // At rest it looks around every four seconds, so that not one view is measured.
        if !sweeps && step.is_multiple_of(400) {
            simulation
                .command_head(0, [f64::from(step / 400 % 10) * 0.6 - 2.7, f64::from(step / 400 % 3) * 0.2]);
        }
        simulation.step();
        let before = digest;
        let start = Instant::now();
        simulation.sense();
        let time = start.elapsed();
        if simulation.shown_image(0).is_some() {
            let image = simulation.image(0);
            digest = image
                .iter()
                .fold(before, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3));
            if let Some(folder) = folder.filter(|_| times.len() % 60 == 17) {
                let file = format!("{}-{:03}.png", name.replace([' ', ',', '/'], "_"), times.len());
                write_png(&folder.join(file), camera, image)?;
            }
            times.push(time);
        }
        step += 1;
    }
    // Of all, as the system counts in steps of milliseconds; a step of the physics takes microseconds.
    let all = processor_time().zip(begin).map(|(end, begin)| end - begin);
    times.sort_unstable();
    let milliseconds = |share: f64| times[((times.len() - 1) as f64 * share) as usize].as_secs_f64() * 1e3;
    println!(
        "| {name} | {IMAGES} | {:.2} ms | {:.2} ms | {:.2} ms | {} | {digest:016x} |",
        milliseconds(0.5),
        milliseconds(0.99),
        milliseconds(1.0),
        all.map_or_else(
            || "unknown".into(),
            |all| format!("{:.2} ms", all.as_secs_f64() * 1e3 / IMAGES as f64)
        ),
    );
    Ok(())
}

/// Time that this thread has had a processor, where the system tells it.
fn processor_time() -> Option<Duration> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    text.split_whitespace().next()?.parse().ok().map(Duration::from_nanos)
}

fn write_png(path: &Path, camera: &CameraDescription, pixels: &[u8]) -> Result<(), Box<dyn Error>> {
    let file = std::io::BufWriter::new(std::fs::File::create(path)?);
    let mut encoder = png::Encoder::new(file, camera.width, camera.height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header()?.write_image_data(pixels)?;
    Ok(())
}

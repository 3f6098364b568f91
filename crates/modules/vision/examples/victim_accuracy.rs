//! Precision and recall of victim detection in rendered images of random rooms.
//! Run it with `cargo run --release -p slate-vision --example victim_accuracy -- 200 1000`, with the number of rooms
//! and the first seed. Images with errors are written as PPM into a folder that is named behind that.
//!
//! A victim counts when it is at most 4 m away and at least 60 % of it is in the image and before everything else. A detection
//! is right when its middle is in the box of a victim of which anything is seen.

// Wall time is measured here.
#![allow(clippy::disallowed_methods)]

use std::error::Error;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use slate_module::Random;
use slate_module::math::{atan2, cos, sin};
use slate_sim::geometry::Pose;
use slate_sim::robot::{CameraDescription, RobotDescription};
use slate_sim::world::{
    Body, Bounds, DecoyDescription, DecoyShape, FireDescription, Material, Posture, Scenery, SignDescription,
    VictimDescription, World,
};
use slate_sim::{Placement, RenderedWorld, Simulation};
use slate_vision::VictimDetector;

/// Half a side of the room, m.
const HALF: f64 = 4.0;
/// Range within which a victim must be found, m.
const REACH: f64 = 4.0;
/// Share of a victim that must be seen.
const SHARE: f64 = 0.6;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(3);
    let mut named = std::env::args().skip(1).take(2).map(|word| word.parse::<u64>());
    let (rooms, first) = (named.next().unwrap_or(Ok(60))?, named.next().unwrap_or(Ok(0))?);
    let mut total = Counts::default();
    for seed in first..first + rooms {
        let counts = judge(&Room::random(seed), seed, folder.as_deref().map(Path::new))?;
        total.add(&counts);
    }
    let Counts { required, found, right, false_alarms, .. } = total;
    println!("| rooms from {first} | victims | found | detections | false alarms | P | R | detector, mean |");
    println!("|---|---|---|---|---|---|---|---|");
    println!(
        "| {rooms} | {required} | {found} | {} | {false_alarms} | {:.3} | {:.3} | {:.2} ms |",
        right + false_alarms,
        right as f64 / (right + false_alarms).max(1) as f64,
        found as f64 / required.max(1) as f64,
        total.time.as_secs_f64() * 1e3 / rooms as f64,
    );
    Ok(())
}

/// Results of the detection.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    /// Victims that must be found.
    required: usize,
    /// Number of them that were found.
    found: usize,
    /// Detections of victims.
    right: usize,
    false_alarms: usize,
    time: Duration,
}

impl Counts {
    fn add(&mut self, other: &Self) {
        self.required += other.required;
        self.found += other.found;
        self.right += other.right;
        self.false_alarms += other.false_alarms;
        self.time += other.time;
    }
}

/// Room with a robot in it.
struct Room {
    world: World,
    pose: Pose,
    /// Pan of the head, and steps since its command: it may still move.
    pan: f64,
    steps: u32,
}

impl Room {
    fn random(seed: u64) -> Self {
        let mut random = Random::new(seed, "room");
        let bounds = Bounds { minimum: [-HALF; 2], maximum: [HALF; 2] };
        let mut world =
            World { name: "room".into(), bounds, bodies: Vec::new(), scenery: Scenery::default(), map: None };
        let materials = [
            Material::Brick,
            Material::Concrete,
            Material::Gravel,
            Material::Metal,
            Material::Plaster,
            Material::Tiles,
            Material::Wood,
        ];
        let material = |random: &mut Random| materials[(random.unit() * 7.0) as usize];
        for (name, x, y) in
            [("east", HALF, 0.0), ("west", -HALF, 0.0), ("north", 0.0, HALF), ("south", 0.0, -HALF)]
        {
            let size = if y == 0.0 { [0.1, 2.0 * HALF] } else { [2.0 * HALF, 0.1] };
            let wall = Body::rectangle(name, [x, y], size);
            world.bodies.push(Body { material: Some(material(&mut random)), ..wall });
        }
        for number in 0..4 {
            let place = away(&mut random);
            let body = Body::rectangle(
                &format!("box {number}"),
                place,
                [random.uniform(0.3, 1.0), random.uniform(0.2, 0.6)],
            );
            let (height, material) = (random.uniform(0.2, 1.4), material(&mut random));
            world.bodies.push(Body { height: Some(height), material: Some(material), ..body });
        }
        let scenery = &mut world.scenery;
        scenery.wall_height = Some(2.2);
        scenery.floor = Some(material(&mut random));
        scenery.floor_roughness = Some(random.unit());
        scenery.ambience = Some(random.uniform(0.35, 0.9));
        for number in 0..4 {
            scenery.victims.push(victim(seed, number, &mut random));
        }
        for number in 0..5 {
            let [x, y] = away(&mut random);
            let shape =
                [DecoyShape::Ball, DecoyShape::Cloth, DecoyShape::Board][(random.unit() * 3.0) as usize];
            let side = random.uniform(0.15, 0.6);
            let size = if shape == DecoyShape::Ball { [side; 2] } else { [side, random.uniform(0.2, 0.9)] };
            let name = format!("decoy {seed} {number}");
            scenery.decoys.push(DecoyDescription { name, position: [x, y, 0.0], shape, size });
        }
        let [x, y] = away(&mut random);
        scenery.fires.push(FireDescription { name: "fire".into(), position: [x, y, 0.0], size: [0.4, 0.7] });
        let sign = SignDescription {
            name: "sign".into(),
            position: [HALF - 0.05, random.uniform(-3.0, 3.0), 0.9],
            theta: std::f64::consts::PI,
            size: 0.3,
            qr: Some(format!("room {seed}")),
            april_tag: None,
        };
        scenery.signs.push(sign);
        let pose = Pose {
            x: random.uniform(-0.3, 0.3),
            y: random.uniform(-0.3, 0.3),
            theta: random.uniform(-std::f64::consts::PI, std::f64::consts::PI),
        };
        let (pan, steps) = (random.uniform(-0.8, 0.8), 2 + (random.unit() * 100.0) as u32);
        Self { world, pose, pan, steps }
    }

    /// Returns an image of the robot's camera in a world.
    fn image(&self, world: &World, camera: &CameraDescription, seed: u64) -> Result<Vec<u8>, Box<dyn Error>> {
        let mut description = RobotDescription::load("pioneer_p3dx")?;
        description.sonar.clear();
        let (sonar, pose) = (String::new(), self.pose);
        let robot = Placement { name: "r".into(), description, sonar, pose, script: None };
        let mut simulation = Simulation::new(world, &[robot], seed, 10_000_000)?;
        simulation.mount_camera(0, camera, &Arc::new(RenderedWorld::new(world, false)), seed);
        simulation.command_head(0, [self.pan, 0.0]);
        (0..self.steps).for_each(|_| simulation.step());
        simulation.sense();
        Ok(simulation.image(0).to_vec())
    }
}

/// Returns a place at least a meter from the middle.
fn away(random: &mut Random) -> [f64; 2] {
    loop {
        let (x, y) = (random.uniform(-3.5, 3.5), random.uniform(-3.5, 3.5));
        if x * x + y * y > 1.3 * 1.3 {
            return [x, y];
        }
    }
}

fn victim(seed: u64, number: u32, random: &mut Random) -> VictimDescription {
    let postures = [Posture::Lying, Posture::Sitting, Posture::Standing, Posture::Trapped];
    let posture = postures[(random.unit() * 4.0) as usize];
    let [x, y] = away(random);
    let side = (random.unit() * 4.0).floor();
    let (mut position, mut theta) = ([x, y, 0.0], 0.0);
    if posture == Posture::Trapped {
        // On one of the four walls.
        theta = side * std::f64::consts::FRAC_PI_2;
        let (depth, along) = (-(HALF - 0.05), random.uniform(-3.0, 3.0));
        let (c, s) = (cos(theta).round(), sin(theta).round());
        position = [depth * c - along * s, depth * s + along * c, random.uniform(0.1, 0.8)];
    }
    let waves = random.unit() < 0.5;
    VictimDescription { name: format!("victim {seed} {number}"), position, theta, posture, waves }
}

/// Visible part of a victim: number of pixels and their box.
struct Seen {
    pixels: usize,
    corners: [usize; 4],
}

fn difference(one: &[u8], other: &[u8], width: usize) -> Seen {
    let mut seen = Seen { pixels: 0, corners: [usize::MAX, usize::MAX, 0, 0] };
    for (pixel, (a, b)) in one.chunks_exact(3).zip(other.chunks_exact(3)).enumerate() {
        if a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > 12) {
            let (x, y) = (pixel % width, pixel / width);
            let [left, top, right, bottom] = seen.corners;
            seen.corners = [left.min(x), top.min(y), right.max(x), bottom.max(y)];
            seen.pixels += 1;
        }
    }
    seen
}

fn judge(room: &Room, seed: u64, folder: Option<&Path>) -> Result<Counts, Box<dyn Error>> {
    let mut robot = RobotDescription::load("summit_xl")?;
    let camera = robot.camera.remove("pan_tilt").ok_or("no such camera")?;
    let exact = CameraDescription { noise_read: 0.0, noise_shot: 0.0, ..camera.clone() };
    let image = room.image(&room.world, &camera, seed)?;
    let width = camera.width as usize;
    let mut detector = VictimDetector::default();
    let start = Instant::now();
    let found = detector.detect(width, image.chunks_exact(3 * width)).to_vec();
    let time = start.elapsed();
    let clear = room.image(&room.world, &exact, seed)?;
    let mut all = Vec::new();
    for number in 0..room.world.scenery.victims.len() {
        if !is_ahead(room, &room.world.scenery.victims[number]) {
            continue;
        }
        let mut without = room.world.clone();
        let victim = without.scenery.victims.remove(number);
        let seen = difference(&clear, &room.image(&without, &exact, seed)?, width);
        if seen.pixels > 0 {
            all.push((
                distance(room, &victim),
                seen.pixels as f64 / whole(room, &victim, &exact, seed)?,
                seen,
            ));
        }
    }
    let mut counts = Counts { time, ..Counts::default() };
    let is_in = |corners: [usize; 4], seen: &Seen| {
        let [left, top, right, bottom] = corners;
        let (x, y) = ((left + right) / 2, (top + bottom) / 2);
        (seen.corners[0]..=seen.corners[2]).contains(&x) && (seen.corners[1]..=seen.corners[3]).contains(&y)
    };
    for (distance, share, seen) in &all {
        if *distance <= REACH && *share >= SHARE {
            counts.required += 1;
            counts.found += usize::from(found.iter().any(|one| is_in(one.corners, seen)));
        }
    }
    for one in &found {
        let is_right = all.iter().any(|(_, _, seen)| is_in(one.corners, seen));
        counts.right += usize::from(is_right);
        counts.false_alarms += usize::from(!is_right);
    }
    if let Some(folder) = folder.filter(|_| counts.false_alarms > 0 || counts.found < counts.required) {
        let head = format!("P6 {width} {} 255\n", camera.height);
        let boxes: Vec<_> = found.iter().map(|one| one.corners).collect();
        println!("seed {seed}: {counts:?} {boxes:?}");
        std::fs::write(folder.join(format!("{seed}.ppm")), [head.as_bytes(), &image].concat())?;
    }
    Ok(counts)
}

fn distance(room: &Room, victim: &VictimDescription) -> f64 {
    let (x, y) = (victim.position[0] - room.pose.x, victim.position[1] - room.pose.y);
    (x * x + y * y).sqrt()
}

/// Returns true if a part of a victim may be in the image.
fn is_ahead(room: &Room, victim: &VictimDescription) -> bool {
    let bearing = atan2(victim.position[1] - room.pose.y, victim.position[0] - room.pose.x);
    let off = slate_module::math::angle_between(room.pose.theta + room.pan, bearing);
    // The head may still be on its way.
    off.abs() < 1.6
}

/// Pixels of a victim alone, by a camera that sees beyond the borders of the image.
fn whole(
    room: &Room,
    victim: &VictimDescription,
    exact: &CameraDescription,
    seed: u64,
) -> Result<f64, Box<dyn Error>> {
    let [cx, cy] = exact.center();
    let (width, height) = (exact.width, exact.height);
    let camera = CameraDescription {
        width: 3 * width,
        height: 3 * height,
        principal_point: Some([cx + f64::from(width), cy + f64::from(height)]),
        ..exact.clone()
    };
    let mut world = World { bodies: Vec::new(), ..room.world.clone() };
    world.scenery =
        Scenery { floor: Some(Material::Metal), floor_roughness: Some(0.0), ..Scenery::default() };
    let empty = room.image(&world, &camera, seed)?;
    world.scenery.victims.push(victim.clone());
    let seen = difference(&room.image(&world, &camera, seed)?, &empty, 3 * width as usize);
    Ok(seen.pixels.max(1) as f64)
}

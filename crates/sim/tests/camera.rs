//! Rendered cameras: where things are in an image, blur, noise, and errors of descriptions.
#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // Tests say what went wrong by failing.

use std::sync::Arc;

use slate_module::{decode, encode};
use slate_sim::drive::Wheels;
use slate_sim::geometry::Pose;
use slate_sim::robot::{CameraDescription, HeadDescription, RobotDescription};
use slate_sim::world::{Body, Material, Posture, Scenery, SignDescription, VictimDescription, World};
use slate_sim::{Placement, RenderedWorld, Simulation};

const STEP: u64 = 10_000_000;

/// A camera of 160 x 120 pixels, exact, 0.5 m above the middle of the robot.
fn exact() -> CameraDescription {
    CameraDescription {
        mount: [0.0, 0.0, 0.5, 0.0, 0.0],
        width: 160,
        height: 120,
        focal_length: [140.0, 140.0],
        principal_point: None,
        distortion: [0.0; 2],
        rate: 50.0,
        exposure: 0.01,
        gain: 1.0,
        noise_read: 0.0,
        noise_shot: 0.0,
        head: Some(HeadDescription {
            pan: [-3.0, 3.0],
            tilt: [-1.0, 1.0],
            maximum_pan_rate: 2.0,
            maximum_tilt_rate: 1.0,
        }),
    }
}

/// A sign in front of a wall in the east.
fn sign(position: [f64; 3], size: f64) -> World {
    let mut world =
        World::parse("w", "name = \"w\"\n[bounds]\nminimum = [-9, -9]\nmaximum = [9, 9]").unwrap();
    let sign = SignDescription {
        name: "s".into(),
        position,
        theta: std::f64::consts::PI,
        size,
        qr: None,
        april_tag: Some(0),
    };
    world.bodies.push(Body::rectangle("wall", [4.0, 0.0], [0.2, 8.0]));
    world.scenery.signs.push(sign);
    world
}

fn simulation(world: &World, camera: &CameraDescription, seed: u64) -> Simulation {
    let mut description = RobotDescription::named("pioneer_p3dx").unwrap().unwrap();
    description.sonar.clear();
    let (sonar, pose) = (String::new(), Pose::default());
    let robot = Placement { name: "r".into(), description, sonar, pose, script: None };
    let mut simulation = Simulation::new(world, &[robot], seed, STEP).unwrap();
    simulation.mount_camera(0, camera, &Arc::new(RenderedWorld::new(world, false)), seed);
    simulation
}

/// An image once the head is where it should be, after so many steps.
fn image(mut simulation: Simulation, angles: [f64; 2], steps: usize) -> Vec<u8> {
    simulation.command_head(0, angles);
    (0..steps).for_each(|_| simulation.step());
    simulation.sense();
    simulation.image(0).to_vec()
}

/// Where the camera shows a point, by the model of a pinhole.
fn projected(camera: &CameraDescription, [x, y, z]: [f64; 3], [pan, tilt]: [f64; 2]) -> [f64; 2] {
    let (ahead, left) = (x * pan.cos() + y * pan.sin(), y * pan.cos() - x * pan.sin());
    let (depth, up) = (ahead * tilt.cos() - z * tilt.sin(), ahead * tilt.sin() + z * tilt.cos());
    let [cx, cy] = camera.center();
    [cx - camera.focal_length[0] * left / depth, cy - camera.focal_length[1] * up / depth]
}

/// Bounding box of dark pixels: left, top, right, bottom.
fn dark(image: &[u8], width: usize) -> [usize; 4] {
    let mut found = [usize::MAX, usize::MAX, 0, 0];
    for (number, pixel) in image.chunks_exact(3).enumerate().filter(|(_, pixel)| pixel[1] < 80) {
        let (x, y) = (number % width, number / width);
        found = [found[0].min(x), found[1].min(y), found[2].max(x), found[3].max(y)];
        assert!(pixel[0].abs_diff(pixel[2]) < 30, "nothing else is dark: {pixel:?}");
    }
    found
}

#[test]
fn a_sign_is_where_the_camera_model_says() {
    // Its face is 5 mm before its position.
    let (x, y, z, half) = (2.0, 0.2, 0.6, 0.2);
    let world = sign([x + 0.005, y, z], 2.0 * half);
    let camera = exact();
    for angles in [[0.0, 0.0], [0.3, 0.0], [-0.2, 0.0], [0.0, 0.25], [0.0, -0.25], [0.25, 0.2], [-0.1, -0.3]]
    {
        let seen = dark(&image(simulation(&world, &camera, 1), angles, 60), 160).map(|side| side as f64);
        let corners = [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]];
        let places =
            corners.map(|[left, up]| projected(&camera, [x, y + left * half, z + up * half - 0.5], angles));
        let of = |axis: usize| places.map(|place| place[axis]);
        let least = |axis| of(axis).into_iter().fold(f64::INFINITY, f64::min);
        let most = |axis| of(axis).into_iter().fold(f64::NEG_INFINITY, f64::max);
        let expected = [least(0), least(1), most(0), most(1)];
        for side in 0..4 {
            assert!((seen[side] - expected[side]).abs() < 1.6, "{angles:?}: {seen:?} {expected:?}");
        }
        // Edges are grey, so that the middle is known better.
        for side in 0..2 {
            let off = seen[side] + seen[side + 2] - expected[side] - expected[side + 2];
            assert!((off / 2.0).abs() < 0.6, "{angles:?}: {seen:?} {expected:?}");
        }
    }
}

#[test]
fn distortion_moves_pixels_as_plumb_bob_says() {
    let world = sign([1.505, 0.45, 0.8], 0.12);
    let camera = CameraDescription { distortion: [-0.25, 0.05], ..exact() };
    let [left, top, right, bottom] = dark(&image(simulation(&world, &camera, 1), [0.0; 2], 3), 160);
    let [x, y] = projected(&camera, [1.5, 0.45, 0.3], [0.0; 2]);
    let [cx, cy] = camera.center();
    let (x, y) = ((x - cx) / 140.0, (y - cy) / 140.0);
    let square = x * x + y * y;
    let factor = 1.0 + square * (-0.25 + 0.05 * square);
    let (x, y) = (cx + 140.0 * x * factor, cy + 140.0 * y * factor);
    let (seen_x, seen_y) = ((left + right) as f64 / 2.0, (top + bottom) as f64 / 2.0);
    assert!((seen_x - x).abs() < 1.0 && (seen_y - y).abs() < 1.0, "{seen_x} {seen_y}, {x} {y}");
}

#[test]
fn a_head_moves_as_fast_as_it_may_and_to_its_limits() {
    let mut simulation = simulation(&sign([2.0, 0.0, 0.6], 0.3), &exact(), 1);
    simulation.command_head(0, [0.5, 9.0]);
    (0..20).for_each(|_| simulation.step());
    let ([pan, tilt], rates) = simulation.head(0).unwrap();
    assert!((pan - 0.4).abs() < 1e-9 && (tilt - 0.2).abs() < 1e-9, "{pan} {tilt}");
    assert_eq!(rates, [2.0, 1.0]);
    (0..200).for_each(|_| simulation.step());
    assert_eq!(simulation.head(0).unwrap(), ([0.5, 1.0], [0.0, 0.0]));
    simulation.command_head(0, [f64::NAN, 0.0]);
    (0..200).for_each(|_| simulation.step());
    assert_eq!(simulation.head(0).unwrap().0, [0.5, 0.0]);
}

#[test]
fn images_are_the_same_bytes_again_and_after_a_snapshot() {
    let camera = CameraDescription { noise_read: 0.004, noise_shot: 0.012, rate: 15.0, ..exact() };
    let world = sign([2.0, 0.2, 0.6], 0.4);
    let start = |seed: u64| {
        let mut simulation = simulation(&world, &camera, seed);
        simulation.command(0, Wheels { left: 1.0, right: 2.0 });
        simulation.command_head(0, [1.0, 0.3]);
        simulation
    };
    let go = |simulation: &mut Simulation| -> Vec<Vec<u8>> {
        let cycles = (0..20).map(|_| {
            simulation.step();
            simulation.sense();
            simulation.shown_image(0).map(<[u8]>::to_vec)
        });
        cycles.collect::<Vec<_>>().into_iter().flatten().collect()
    };
    let mut first = start(1);
    let before = go(&mut first);
    assert!(before.len() == 4 && before == go(&mut start(1)) && before != go(&mut start(2)));
    let mut resumed = start(1);
    let state = encode(&first).unwrap();
    resumed.resume(decode(&state).unwrap());
    assert_eq!(go(&mut first), go(&mut resumed));
}

/// Number of sharp edges between pixels of a row.
fn edges(image: &[u8]) -> usize {
    let rows = image.chunks_exact(160 * 3);
    rows.flat_map(|row| row.windows(4)).filter(|own| own[0].abs_diff(own[3]) > 60).count()
}

#[test]
fn blur_grows_with_the_speed_of_robot_and_head() {
    let world = sign([2.0, 0.0, 0.6], 0.5);
    let seen = |exposure: f64, wheels: f64, pan: f64| {
        let camera = CameraDescription { exposure, gain: 0.01 / exposure, ..exact() };
        let mut simulation = simulation(&world, &camera, 1);
        simulation.command(0, Wheels { left: -wheels, right: wheels });
        simulation.command_head(0, [pan, 0.0]);
        // Until it has its speed; the sign stays in view.
        (0..12).for_each(|_| simulation.step());
        simulation.sense();
        edges(simulation.image(0))
    };
    let (rest, slow, fast) = (seen(0.03, 0.0, 0.0), seen(0.03, 0.5, 0.0), seen(0.03, 2.0, 0.0));
    assert!(rest > slow && slow > 2 * fast, "{rest} {slow} {fast}");
    let (long, short) = (seen(0.03, 0.0, 1.0), seen(0.005, 0.0, 1.0));
    assert!(rest > 2 * long && short > 2 * long, "{rest} {long} {short}");
}

#[test]
fn a_victim_behind_a_wall_is_not_seen() {
    let seen = |distance: f64| {
        let mut world = sign([3.9, 2.5, 0.6], 0.1);
        let victim = VictimDescription {
            name: "v".into(),
            position: [distance, 0.0, 0.0],
            theta: 0.0,
            posture: Posture::Standing,
            waves: true,
        };
        world.scenery.wall_height = Some(2.5);
        world.scenery.victims.push(victim);
        image(simulation(&world, &exact(), 1), [0.0; 2], 3)
    };
    let empty = image(simulation(&tall(), &exact(), 1), [0.0; 2], 3);
    assert_eq!(seen(4.5), empty);
    assert_ne!(seen(3.0), empty);
}

fn tall() -> World {
    let mut world = sign([3.9, 2.5, 0.6], 0.1);
    world.scenery.wall_height = Some(2.5);
    world
}

#[test]
fn noise_is_as_large_as_described() {
    let camera = CameraDescription { noise_read: 0.02, ..exact() };
    let world = sign([2.0, 0.0, 0.6], 0.1);
    let (exact, noisy) = (
        image(simulation(&world, &exact(), 1), [0.0; 2], 3),
        image(simulation(&world, &camera, 1), [0.0; 2], 3),
    );
    // In linear values, of those far from black and white.
    let linear = |byte: u8| ((f64::from(byte) / 255.0 + 0.055) / 1.055).powf(2.4);
    let errors: Vec<f64> = exact
        .iter()
        .zip(&noisy)
        .filter(|(byte, _)| (60..230).contains(*byte))
        .map(|(a, b)| linear(*b) - linear(*a))
        .collect();
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    let variance = errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64;
    assert!(mean.abs() < 0.001 && (variance.sqrt() - 0.02).abs() < 0.001, "{mean} {}", variance.sqrt());
}

#[test]
fn worlds_of_before_have_surfaces_by_default() {
    let world = World::named("rocs_arena").unwrap().unwrap();
    assert_eq!(world.scenery, Scenery::default());
    let image = image(simulation(&world, &exact(), 1), [0.0; 2], 3);
    let middle = &image[3 * (60 * 160 + 80)..][..3];
    assert!(image.len() == 160 * 120 * 3 && middle.iter().all(|byte| *byte > 60), "{middle:?}");
}

#[test]
fn a_camera_that_can_not_be_is_refused_at_the_value() {
    let robot = include_str!("../../../robots/summit_xl.toml");
    for (from, to, expected) in [
        ("width = 320", "width = 4", "from 8 to 1920"),
        ("focal_length = [277.13, 277.13]", "focal_length = [0.0, 277.0]", "pixels"),
        ("exposure = 0.01", "exposure = 0.5", "0.2 s"),
        ("rate = 15.0 ", "rate = nan ", "hertz"),
        ("noise_shot = 0.012", "noise_shot = -1.0", "standard deviation"),
        ("mount = [0.15, 0.0, 0.6, 0, 0]", "mount = [0.15, 0.0, 0.6, 0, 20]", "on a head"),
        ("pan = [-2.8, 2.8]", "pan = [2.8, -2.8]", "limits"),
        ("noise_read = 0.004", "noise_read = 0.004\ndistortion = [-2.0, 0.0]", "fold"),
    ] {
        assert!(robot.contains(from), "{from}");
        let text = robot.replacen(from, to, 1);
        let error = RobotDescription::parse("r.toml", &text).unwrap_err();
        let line = text.lines().position(|line| line.contains(to.lines().last().unwrap())).unwrap() + 1;
        assert_eq!(error.position.map(|(line, _)| line), Some(line), "{error}");
        assert!(error.message.contains(expected), "{error}");
    }
}

#[test]
fn scenery_that_can_not_be_is_refused_at_the_value() {
    let world = include_str!("../../../worlds/rescue_arena.toml");
    for (from, to, expected) in [
        ("april_tag = 7", "april_tag = 30", "from 0 to 29"),
        ("april_tag = 7", "april_tag = 7\nqr = \"both\"", "either `qr` or `april_tag`"),
        ("qr = \"room 1: gravel\"", "qr = \"\"", "1 to 120 bytes"),
        ("posture = \"lying\"", "posture = \"flying\"", "`lying`"),
        ("roughness = 0.8", "roughness = 1.8", "from 0 to 1"),
        ("height = 0.6", "height = -0.6", "a height above 0"),
        ("size = [0.5, 0.8]", "size = [0.5, 0.0]", "from 0.01 to 20 m"),
    ] {
        assert!(world.contains(from), "{from}");
        let text = world.replacen(from, to, 1);
        let error = World::parse("w.toml", &text).unwrap_err();
        assert!(error.position.is_some() && error.message.contains(expected), "{error}");
    }
    let world = World::parse("w.toml", world).unwrap();
    assert_eq!(
        (world.scenery.floor, world.bodies[8].material),
        (Some(Material::Tiles), Some(Material::Wood))
    );
}

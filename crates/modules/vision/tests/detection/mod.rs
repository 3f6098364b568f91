//! Detections in images that a simulated camera renders.

use std::sync::Arc;

use slate_interfaces::{Image, ImageFormat, PanTiltCommand};
use slate_module::testing::Fixture;
use slate_sim::geometry::Pose;
use slate_sim::robot::RobotDescription;
use slate_sim::world::{
    Body, DecoyDescription, DecoyShape, Posture, SignDescription, VictimDescription, World,
};
use slate_sim::{Placement, RenderedWorld, Simulation};
use slate_vision::{ImageDetections, ImageProcessor, ImageSharpness, PanTiltController};

/// A wall in the east.
fn plain() -> World {
    let mut world =
        World::parse("w", "name = \"w\"\n[bounds]\nminimum = [-9, -9]\nmaximum = [9, 9]").unwrap();
    world.scenery.floor_roughness = Some(0.0);
    world.scenery.wall_height = Some(2.0);
    world.bodies.push(Body::rectangle("wall", [4.0, 0.0], [0.2, 8.0]));
    world
}

/// Detections and sharpness of an image that is taken while the head moves to a pan.
fn process(world: &World, pan: f64) -> (ImageDetections, ImageSharpness) {
    let mut description = RobotDescription::named("summit_xl").unwrap().unwrap();
    let camera = description.camera["pan_tilt"].clone();
    description.sonar.clear();
    let (sonar, pose) = (String::new(), Pose::default());
    let robot = Placement { name: "r".into(), description, sonar, pose, script: None };
    let mut simulation = Simulation::new(world, &[robot], 1, 10_000_000).unwrap();
    simulation.mount_camera(0, &camera, &Arc::new(RenderedWorld::new(world, false)), 1);
    simulation.command_head(0, [pan, 0.0]);
    (0..7).for_each(|_| simulation.step());
    simulation.sense();
    let mut processor = Fixture::<ImageProcessor>::new();
    let pixels = simulation.image(0);
    processor.write::<Image>("image", pixels.len(), |image| {
        (image.width, image.height, image.step) = (320, 240, 960);
        image.format = ImageFormat::RGB8;
        image.data.copy_from_slice(pixels);
    });
    processor.tick();
    (processor.output("detections").unwrap(), processor.output("sharpness").unwrap())
}

#[test]
fn a_victim_is_found_and_things_in_its_colors_are_not() {
    let mut world = plain();
    for (number, shape) in [DecoyShape::Ball, DecoyShape::Cloth, DecoyShape::Board].into_iter().enumerate() {
        let position = [2.5, number as f64 - 1.0, 0.0];
        let (name, size) = (format!("decoy {number}"), [0.4, 0.4]);
        world.scenery.decoys.push(DecoyDescription { name, position, shape, size });
    }
    assert!(process(&world, 0.0).0.list.is_empty());
    for (posture, name) in [(Posture::Standing, "anna"), (Posture::Lying, "ben"), (Posture::Sitting, "carla")]
    {
        let mut world = plain();
        let (name, theta) = (name.into(), 0.0);
        world.scenery.victims.push(VictimDescription {
            name,
            position: [3.0, 0.3, 0.0],
            theta,
            posture,
            waves: false,
        });
        let found = process(&world, 0.0).0;
        let [victim] = &found.list[..] else { panic!("{found:?}") };
        // Its middle is a tenth to the left.
        assert!((victim.x - (159.5 - 277.13 * 0.3 / 2.85)).abs() < 25.0, "{victim:?}");
        assert_eq!(victim.label.as_str(), "victim");
    }
}

#[test]
fn a_qr_code_is_read_in_a_rendered_image() {
    let mut world = plain();
    world.scenery.signs.push(SignDescription {
        name: "code".into(),
        position: [1.5, 0.2, 0.7],
        theta: std::f64::consts::PI,
        size: 0.4,
        qr: Some("exit 3".into()),
        april_tag: None,
    });
    let found = process(&world, 0.0).0;
    let [code] = &found.list[..] else { panic!("{found:?}") };
    assert_eq!(code.label.as_str(), "qr exit 3");
    assert!((code.width - 277.13 * 0.4 / 1.345).abs() < 5.0, "{code:?}");
}

#[test]
fn a_tag_is_read_from_the_front_and_aslant() {
    for (number, distance, turn) in [(7, 1.5, 0.0), (0, 1.0, 0.6), (29, 2.5, -0.5), (13, 3.0, 0.3)] {
        let mut world = plain();
        world.scenery.signs.push(SignDescription {
            name: "tag".into(),
            position: [distance, 0.1, 0.7],
            theta: std::f64::consts::PI + turn,
            size: 0.4,
            qr: None,
            april_tag: Some(number),
        });
        let found = process(&world, 0.0).0;
        let [tag] = &found.list[..] else { panic!("{number}: {found:?}") };
        assert_eq!(tag.label.as_str(), format!("tag {number}"));
        // The camera stands 0.155 m ahead of the robot's middle; the nearer side of a turned tag is larger.
        let height = 277.13 * 0.4 / (distance - 0.155);
        assert!((tag.height - height).abs() < 0.2 * height, "{number}: {tag:?}, {height} expected");
    }
}

#[test]
fn nothing_is_a_tag_in_a_world_without_one() {
    let mut world = plain();
    world.scenery.signs.push(SignDescription {
        name: "code".into(),
        position: [2.5, 0.2, 0.7],
        theta: std::f64::consts::PI,
        size: 0.4,
        qr: Some("no tag".into()),
        april_tag: None,
    });
    for pan in [-1.0, -0.4, 0.0, 0.5] {
        let found = process(&world, pan).0;
        assert!(found.list.iter().all(|found| !found.label.as_str().starts_with("tag")), "{found:?}");
    }
}

#[test]
fn an_image_of_a_moving_head_is_less_sharp() {
    let sharpness = |pan: f64| process(&plain(), pan).1.laplacian_variance;
    let (still, moving) = (sharpness(0.0), sharpness(1.0));
    assert!(still > 1.1 * moving && moving > 0.0, "{still} {moving}");
}

#[test]
fn a_head_is_commanded_by_its_input_or_else_by_parameters() {
    let mut controller = Fixture::<PanTiltController>::new();
    controller.tick();
    assert_eq!(controller.output::<PanTiltCommand>("command").unwrap().pan, 0.0);
    controller.set("position", PanTiltCommand { pan: 0.5, tilt: -0.1 });
    controller.tick();
    assert_eq!(controller.output("command"), Some(PanTiltCommand { pan: 0.5, tilt: -0.1 }));
}

//! A tick of the blocks that look at other robots allocates nothing, once they know their own body.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate::interfaces::{
    Echo, Odometry, Orientation, Position, Sighting, Sightings, SonarPlacement, SonarScan,
};
use slate::mapek::{AnalyzeBlock, ReactiveBlock};
use slate::module::testing::Fixture;
use slate::module::{Bool, Sequence, Text};
use slate_avoidance::SensorRule;
use slate_testing::{Counted, allocations};
use slate_wheeled::avoid_obstacle::AvoidObstacleModel;
use slate_wheeled::give_way::GiveWayModel;
use slate_wheeled::knowledge::{WheeledKnowledgeParams, WheeledModel};
use slate_wheeled::local_map::MapObstacles;

#[test]
fn a_tick_with_robots_in_sight_allocates_nothing() {
    let robot = WheeledModel::load("summit_xl", "vrep").unwrap();
    let mut avoid = Fixture::<Counted<ReactiveBlock<AvoidObstacleModel>>>::new();
    let mut map = Fixture::<Counted<AnalyzeBlock<MapObstacles>>>::new();
    let rule = |sensor: &str| SensorRule { distance: 0.3, sensor: Text::new(sensor) };
    let sensor_rules = Sequence::new(&[rule("sonar"), rule("robot_sensor")]);
    let rules =
        WheeledKnowledgeParams { sensor_rules, drive_distance: 0.4, ..WheeledKnowledgeParams::default() }
            .rules();
    let mut give_way = Fixture::<Counted<ReactiveBlock<GiveWayModel>>>::new();
    let placement = SonarPlacement { x: 0.3, y: 0.0, theta: 0.0 };
    let mut first = None;
    for cycle in 0..200_u32 {
        // Ever more robots, which come and go; most of them are new ones.
        let seen: Vec<_> = (0..cycle % 9)
            .map(|number| Sighting {
                range: 0.6 + 0.3 * f64::from(number),
                bearing: f64::from(number),
                name: Text::new(&format!("robot {}", cycle / 50 + number)),
            })
            .collect();
        let echo = Echo { range: 0.5, heard: Bool::from(cycle % 3 == 0) };
        let scan = SonarScan {
            field_of_view: 0.5,
            range_max: 1.0,
            placements: Sequence::new(&[placement]),
            echoes: Sequence::new(&[echo]),
            ..SonarScan::default()
        };
        avoid.set("rules", rules);
        give_way.set("rules", rules);
        macro_rules! run {
            ($block:expr, $scan:literal) => {
                $block.set("robots", Sightings { list: Sequence::new(&seen) });
                $block.set("robot", robot);
                $block.set($scan, scan);
                $block.advance(20_000_000);
                $block.tick();
            };
        }
        macro_rules! place {
            ($block:expr) => {
                $block.set("position", Position { x: 0.01 * f64::from(cycle), y: 0.0, z: 0.0 });
                $block.set("orientation", Orientation { theta: 0.1 });
            };
        }
        place!(map);
        give_way.set("odometry", Odometry::default());
        run!(avoid, "sonar");
        run!(give_way, "sonar");
        run!(map, "range");
        first.get_or_insert(allocations());
        if cycle % 40 == 20 {
            let saved = map.save().unwrap();
            map.restore(&saved).unwrap();
        }
    }
    assert_eq!(allocations(), first.unwrap());
}

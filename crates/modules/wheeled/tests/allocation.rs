//! A tick of the blocks that look at other robots allocates nothing, once they know their own body.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate::interfaces::{
    Echo, Orientation, Point2, Position, Sighting, Sightings, SonarPlacement, SonarScan, Twist2,
};
use slate::mapek::ReactiveBlock;
use slate::module::testing::Fixture;
use slate::module::{Bool, Sequence, Text};
use slate::sim::robot::RobotDescription;
use slate_testing::{Counted, allocations};
use slate_wheeled::avoid_obstacle::AvoidObstacleModel;
use slate_wheeled::give_way::GiveWayModel;
use slate_wheeled::knowledge::WheeledModel;

#[test]
fn a_tick_with_robots_in_sight_allocates_nothing() {
    let chassis = RobotDescription::named("summit_xl").unwrap().unwrap().chassis();
    let mut avoid = Fixture::<Counted<ReactiveBlock<AvoidObstacleModel>>>::new();
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
        avoid.set("motion", Twist2 { linear: 0.3, angular: 0.0 });
        macro_rules! run {
            ($block:expr) => {
                $block.set("robots", Sightings { list: Sequence::new(&seen) });
                $block.set("sonar", scan);
                $block.set("position", Position { x: 0.01 * f64::from(cycle), y: 0.0, z: 0.0 });
                $block.set("orientation", Orientation { theta: 0.1 });
                $block.set("goal", Point2 { x: 1.5, y: 0.2 });
                $block.set("robot", WheeledModel { chassis, ..WheeledModel::default() });
                $block.advance(20_000_000);
                $block.tick();
            };
        }
        run!(avoid);
        run!(give_way);
        first.get_or_insert(allocations());
        if cycle % 40 == 20 {
            let saved = avoid.save().unwrap();
            avoid.restore(&saved).unwrap();
        }
    }
    let first = first.unwrap();
    assert!(first > 0, "it makes itself a footprint, which shows that allocations are seen");
    assert_eq!(allocations(), first);
}

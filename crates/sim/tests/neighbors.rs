//! Search of neighbors: the same result as an exhaustive search.

#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // Tests say what went wrong by failing.

use proptest::prelude::*;
use slate_sim::geometry::{Extent, Point, Polygon, Pose};
use slate_sim::grid::Grid;
use slate_sim::surroundings::{Hull, Surroundings};

prop_compose! {
    fn extent()(x in -20.0..20.0, y in -20.0..20.0, width in 0.0..3.0, height in 0.0..30.0) -> Extent {
        let minimum = Point::new(x, y);
        Extent { minimum, maximum: minimum.plus(Point::new(width, height), 1.0) }
    }
}

fn meet(a: &Extent, b: &Extent) -> bool {
    a.minimum.x <= b.maximum.x
        && b.minimum.x <= a.maximum.x
        && a.minimum.y <= b.maximum.y
        && b.minimum.y <= a.maximum.y
}

prop_compose! {
    fn rectangle()(
        x in -8.0..8.0,
        y in -8.0..8.0,
        theta in -3.0..3.0,
        width in 0.05..6.0,
        height in 0.05..0.6,
    ) -> Polygon {
        let mut placed = Polygon::default();
        Polygon::rectangle(Point::default(), width, height).place(&Pose { x, y, theta }.frame(), &mut placed);
        placed
    }
}

proptest! {
    #[test]
    fn a_grid_tells_all_that_meets_an_extent_and_each_once(
        items in proptest::collection::vec(extent(), 0..80),
        other in proptest::collection::vec(extent(), 0..80),
        asked in proptest::collection::vec(extent(), 1..10),
    ) {
        let mut grid = Grid::default();
        // What was in it before leaves nothing behind.
        grid.fill(other.into_iter());
        grid.fill(items.iter().copied());
        for asked in asked {
            let mut found = Vec::new();
            grid.near(&asked, |item| found.push(item));
            found.sort_unstable();
            prop_assert!(found.windows(2).all(|pair| pair[0] < pair[1]), "{found:?}");
            let expected: Vec<_> = (0..items.len()).filter(|item| meet(&items[*item], &asked)).collect();
            prop_assert!(expected.iter().all(|item| found.contains(item)), "{found:?} {expected:?}");
            prop_assert!(!grid.covered_by(&asked) || found.len() == items.len());
        }
    }

    #[test]
    fn the_clearance_is_the_least_gap_of_all(
        bodies in proptest::collection::vec(rectangle(), 0..30),
        robots in proptest::collection::vec((-9.0..9.0, -9.0..9.0, -3.0..3.0), 1..40),
        spread in 0.1..10.0,
    ) {
        let bodies = bodies.into_iter().enumerate().map(|(i, polygon)| (i.to_string(), polygon)).collect();
        let mut surroundings = Surroundings::new(bodies, None);
        for (x, y, theta) in robots {
            let outline = Polygon::rectangle(Point::new(0.1, 0.0), 0.5, 0.3);
            surroundings.add(Hull::new(outline, Pose { x: x * spread, y: y * spread, theta }.frame()));
        }
        surroundings.arrange();
        for (i, hull) in surroundings.robots().iter().enumerate() {
            let bodies = surroundings.bodies().iter().map(|(_, polygon)| polygon);
            let others = surroundings.robots().iter().enumerate().filter(|(other, _)| *other != i);
            let all = bodies.chain(others.map(|(_, other)| other.outline()));
            let nearest = all.map(|other| hull.outline().gap(other).distance).fold(f64::INFINITY, f64::min);
            prop_assert_eq!(surroundings.clearance(i), nearest);
        }
    }
}

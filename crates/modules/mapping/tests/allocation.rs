//! A tick of the modules allocates nothing, once they know how large the map is.
#![allow(unsafe_code, reason = "an allocator that counts")]
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::marker::PhantomData;

use slate_interfaces::{
    LaserScan, MapMark, MapStroke, OccupancyGrid, Odometry, Path, Point2, Pose2, PoseEstimate,
};
use slate_mapping::{OccupancyMapper, PathPlanner, PoseEstimator};
use slate_module::testing::Fixture;
use slate_module::{Module, Outcome, Refusal, Sequence, Setup, Spec, Stage, Tick, math};

struct Counting;

thread_local! {
    static ACTIVE: Cell<bool> = const { Cell::new(false) };
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: passed on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if ACTIVE.get() {
            COUNT.set(COUNT.get() + 1);
        }
        // SAFETY: passed on to the caller.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: passed on to the caller.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// A module whose ticks are watched, without what the fixture itself does around them.
struct Watched<M>(PhantomData<fn() -> M>);

impl<M: Module> Module for Watched<M> {
    type Io = M::Io;
    type Params = M::Params;
    type State = M::State;

    const NAME: &'static str = M::NAME;
    const STAGE: Stage = M::STAGE;

    fn spec() -> Spec {
        M::spec()
    }

    fn create(setup: &Setup<'_>, params: &M::Params) -> Result<M::State, Refusal> {
        M::create(setup, params)
    }

    fn tick(state: &mut M::State, io: &M::Io, params: &M::Params, now: &Tick) -> Outcome {
        ACTIVE.set(true);
        let outcome = M::tick(state, io, params, now);
        ACTIVE.set(false);
        outcome
    }
}

#[test]
fn a_tick_allocates_nothing_once_the_size_of_the_map_is_known() {
    let mut estimator = Fixture::<Watched<PoseEstimator>>::new();
    let mut mapper = Fixture::<Watched<OccupancyMapper>>::new();
    let mut planner = Fixture::<Watched<PathPlanner>>::new();
    let (mut first, mut longest) = (None, 0.0);
    for cycle in 0..60_u32 {
        let turn = f64::from(cycle) * 0.1;
        let pose = Pose2 { x: math::cos(turn), y: math::sin(turn), theta: math::wrap_angle(turn) };
        estimator.set("odometry", Odometry { pose, ..Odometry::default() });
        mapper.set("pose", pose);
        mapper.write::<LaserScan>("scan", 181, |scan| {
            (scan.angle_min, scan.angle_increment) = (-1.57, 0.01745);
            (scan.range_min, scan.range_max) = (0.05, 4.0);
            for (beam, range) in scan.ranges.iter_mut().enumerate() {
                *range = 1.0 + (beam as u32 * cycle % 29) as f32 * 0.1;
            }
        });
        let mark = if cycle % 5 == 4 { MapMark::UNDO } else { MapMark::OCCUPIED };
        let (from, to) = (Point2 { x: -3.0, y: 0.1 * f64::from(cycle % 20) }, Point2 { x: 2.0, y: 1.0 });
        let points = Sequence::new(&[from, to]);
        mapper.push("strokes", MapStroke { width: 0.2, mark, reserved: [0; 7], points });
        let grid: Vec<i8> = {
            mapper.advance(1_000_000_000);
            mapper.tick();
            mapper.read("map", |map: &OccupancyGrid| map.data.to_vec()).unwrap()
        };
        planner.write::<OccupancyGrid>("map", grid.len(), |map| {
            (map.origin, map.resolution) = (Pose2 { x: -5.0, y: -5.0, theta: 0.0 }, 0.05);
            (map.width, map.height) = (200, 200);
            map.data.copy_from_slice(&grid);
        });
        planner.set("pose", pose);
        planner.set("goal", Point2 { x: 4.5, y: 4.0 - 0.15 * f64::from(cycle) });
        planner.tick();
        longest = math::max(longest, planner.read("path", |path: &Path| path.length).unwrap());
        estimator.tick();
        assert!(estimator.output::<PoseEstimate>("estimate").is_some());
        first.get_or_insert(COUNT.get());
    }
    assert!(longest > 4.0, "it plans ways: {longest}");
    assert!(first > Some(0), "the counter counts");
    assert_eq!(Some(COUNT.get()), first, "of the first tick alone");
}

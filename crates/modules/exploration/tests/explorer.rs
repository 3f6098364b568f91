//! The block `explorer`, and its referee.

use std::path::Path;

use slate_exploration::{
    ExplorationCoverage, ExplorationProgress, ExplorationReferee, ExplorationRefereeParams, FrontierExplorer,
    FrontierExplorerParams, FrontierPoints,
};
use slate_grid::{Geometry, OccupancyMap};
use slate_interfaces::{MissionOutcome, MissionState, OccupancyGrid, Point2, Pose2, Verdict};
use slate_map_file::{MapFileOptions, write_map};
use slate_mapek::AnalyzeBlock;
use slate_module::testing::Fixture;
use slate_module::{Outcome, Text};

/// A corridor of 8 m by 2 m in cells of 0.1 m, of which the columns up to one are known.
fn occupancy(known: usize) -> Vec<i8> {
    let cell = |cell: usize| {
        let (column, row) = (cell % 80, cell / 80);
        match column {
            _ if column >= known => -1,
            0 | 79 => 100,
            _ if row == 0 || row == 19 => 100,
            _ => 0,
        }
    };
    (0..1600).map(cell).collect()
}

fn explorer(change: impl FnOnce(&mut FrontierExplorerParams)) -> Fixture<AnalyzeBlock<FrontierExplorer>> {
    let mut params = FrontierExplorerParams { robot_radius: 0.2, ..FrontierExplorerParams::default() };
    change(&mut params);
    Fixture::with(params).unwrap()
}

fn see(
    block: &mut Fixture<AnalyzeBlock<FrontierExplorer>>,
    known: usize,
    x: f64,
) -> (Option<Point2>, ExplorationProgress) {
    write(block, "map", &occupancy(known));
    block.set("pose", Pose2 { x, y: 1.0, theta: 0.0 });
    block.advance(1_000_000_000);
    assert_eq!(block.tick(), Outcome::Ok);
    (block.output("goal"), block.output("progress").unwrap())
}

fn write<M: slate_module::Module>(fixture: &mut Fixture<M>, port: &str, cells: &[i8]) {
    fixture.write::<OccupancyGrid>(port, 1600, |map| {
        (map.resolution, map.width, map.height) = (0.1, 80, 20);
        map.data.copy_from_slice(cells);
    });
}

#[test]
fn goals_lead_to_the_unknown_until_nothing_is_left() {
    let mut block = explorer(|_| ());
    let (goal, progress) = see(&mut block, 30, 1.0);
    assert!(goal.unwrap().x > 1.5 && progress.frontiers == 1 && progress.information_gain > 1.0);
    let points = block.read::<FrontierPoints, usize>("change", |frontiers| frontiers.points.len());
    assert_eq!(points, Some(18));
    let (goal, _) = see(&mut block, 60, 2.5);
    assert!(goal.unwrap().x > 4.5);
    for second in 0..6 {
        let (goal, progress) = see(&mut block, 80, 6.0);
        assert_eq!((progress.frontiers, progress.is_done.get()), (0, second >= 4));
        assert_eq!(goal, Some(Point2 { x: 6.0, y: 1.0 }));
    }
}

#[test]
fn a_goal_without_progress_goes_on_the_blacklist() {
    let mut block = explorer(|params| {
        params.progress_timeout = 3.0;
        params.retries = 0;
        params.blacklist_radius = 5.0;
        params.done_after = 0.0;
    });
    let blacklisted: Vec<u32> = (0..6).map(|_| see(&mut block, 30, 1.0).1.blacklisted).collect();
    assert_eq!(blacklisted, [0, 0, 0, 0, 1, 1]);
    assert!(see(&mut block, 30, 1.0).1.is_done.get());
}

#[test]
fn a_restored_explorer_goes_on_as_the_saved_one() {
    let change = |params: &mut FrontierExplorerParams| params.progress_timeout = 2.0;
    let (mut first, mut second) = (explorer(change), explorer(change));
    for _ in 0..4 {
        see(&mut first, 30, 1.0);
    }
    second.advance(4_000_000_000);
    second.restore(&first.save().unwrap()).unwrap();
    for known in [30, 31, 40, 50, 80] {
        let (one, other) = (see(&mut first, known, 1.5), see(&mut second, known, 1.5));
        assert!(one == other);
    }
    assert!(first.save().unwrap() == second.save().unwrap());
}

#[test]
fn the_referee_knows_the_share_of_the_free_area() {
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("corridor.yaml");
    let geometry = Geometry::new([0.0, 0.0], [8.0, 2.0], 0.1, 10_000).unwrap();
    write_map(&file, &OccupancyMap { geometry, cells: occupancy(80) }, &MapFileOptions::default()).unwrap();
    let yaml_filename = Text::new(file.to_str().unwrap());
    let mut referee =
        Fixture::<ExplorationReferee>::with(ExplorationRefereeParams { yaml_filename, ..Default::default() })
            .unwrap();
    let mut judge = |known: usize, is_done: bool| {
        write(&mut referee, "map", &occupancy(known));
        referee.set(
            "progress",
            ExplorationProgress { is_done: is_done.into(), ..ExplorationProgress::default() },
        );
        referee.advance(1_000_000_000);
        assert_eq!(referee.tick(), Outcome::Ok);
        let coverage: Option<ExplorationCoverage> = referee.output("coverage");
        let verdict: Option<Verdict> = referee.output("verdict");
        (
            coverage.map(|coverage| coverage.known_share),
            verdict.map(|verdict| (verdict.state, verdict.outcome)),
        )
    };
    let (share, verdict) = judge(40, false);
    assert!((share.unwrap() - 0.5).abs() < 0.01, "{share:?}");
    assert_eq!(verdict, Some((MissionState::RUNNING, MissionOutcome::OTHER)));
    let (share, verdict) = judge(80, true);
    assert_eq!((share, verdict), (Some(1.0), Some((MissionState::SUCCEEDED, MissionOutcome::GOAL_REACHED))));
    assert_eq!(judge(80, true), (None, None));
}

//! Monte Carlo localization of a robot with a laser in buildings.

mod ambiguity;
mod building;
mod drive;
mod office;
mod settings;
mod trial;

use std::path::Path;

use slate_localization::LikelihoodField;
use slate_map_file::{MapFileOptions, read_map_image};
use slate_sim::robot::{LaserDescription, RobotDescription};

use crate::figures::percentile;
use crate::trials::each;
use crate::{DataError, Evaluation, Figure, FigureGoal};
use ambiguity::{Ambiguity, SPACING};
use building::Building;
use office::office;
use trial::{Errors, PoseSearch, SearchKind, TrialSetting, poses, track};

/// Image of a hospital that comes with Stage, whose worlds give it a width of 40 m.
const HOSPITAL: &str = "maps/hospital_section.png";
const HOSPITAL_WIDTH: f64 = 40.0;
/// Robot and laser of the trials.
const ROBOT: &str = "pioneer_p3dx";
const LASER: &str = "utm_30lx";
/// Routes on which a pose is followed, and the length of each, m.
const ROUTES: usize = 10;
const ROUTE_LENGTH: f64 = 100.0;

/// Evaluates the localization in an office, and in the hospital of a folder.
/// It measures errors of a known pose, and how often `starts` unknown poses are found, or those after the robot was
/// kidnapped.
///
/// # Errors
/// The folder has no map, or one that can't be used.
pub fn evaluate(folder: Option<&Path>, starts: usize) -> Result<Vec<Evaluation>, DataError> {
    let laser = laser()?;
    let hospital = folder.map(hospital).transpose()?;
    let buildings: Vec<Building> = hospital.into_iter().chain([office()?]).collect();
    buildings.iter().map(|building| evaluate_building(building, &laser, starts)).collect()
}

fn laser() -> Result<LaserDescription, DataError> {
    let robot =
        RobotDescription::load(ROBOT).map_err(|error| DataError::new(ROBOT.as_ref(), error.to_string()))?;
    let missing = || DataError::new(ROBOT.as_ref(), format!("has no laser `{LASER}`"));
    robot.laser.get(LASER).cloned().ok_or_else(missing)
}

fn hospital(folder: &Path) -> Result<Building, DataError> {
    let file = folder.join(HOSPITAL);
    let map = read_map_image(&file, HOSPITAL_WIDTH, &MapFileOptions::default())
        .map_err(|error| DataError::new(&file, error.to_string()))?;
    let walls: Vec<bool> = map.cells.iter().map(|cell| *cell > 50).collect();
    Building::new("hospital_section of 40 m by 16 m".into(), map.geometry, &walls)
}

fn evaluate_building(
    building: &Building,
    laser: &LaserDescription,
    starts: usize,
) -> Result<Evaluation, DataError> {
    let field = building.field(settings::sensor_model(laser.range_max));
    let field: LikelihoodField =
        field.ok_or_else(|| DataError::new(building.name.as_ref(), "has no likelihood field"))?;
    let setting = TrialSetting { building, laser, field: &field };
    let ambiguity = Ambiguity::new(building, laser);
    let mut notes = vec![noise(laser)];
    let mut figures = vec![Figure::new("area where the robot can be, m²", building.drivable_area())];
    figures.extend(tracking(setting, starts));
    for (kind, name) in
        [(SearchKind::Global, "global localization"), (SearchKind::Kidnapped, "kidnapped robot")]
    {
        let searches = each(starts, |seed| {
            let search = kind.run(setting, seed).unwrap_or(PoseSearch::FAILED);
            (search, ambiguity.is_ambiguous(&poses(setting, kind, seed, SPACING)))
        });
        figures.extend(rates(name, &searches, &mut notes));
    }
    let name =
        format!("{} ({} x {} cells)", building.name, building.geometry.width, building.geometry.height);
    Ok(Evaluation { name, figures, notes })
}

fn tracking(setting: TrialSetting<'_>, starts: usize) -> Vec<Figure> {
    let routes = each(starts.min(ROUTES), |seed| track(setting, seed, ROUTE_LENGTH));
    let (mut positions, mut headings) = (Vec::new(), Vec::new());
    for route in routes {
        let Errors { position, heading } = route.unwrap_or_else(Errors::unknown);
        positions.extend(position);
        headings.extend(heading.into_iter().map(f64::to_degrees));
    }
    vec![
        Figure::new("driving: RMSE of the position, m", root_mean_square(&positions))
            .with_goal(FigureGoal::AtMost(0.05)),
        Figure::new("driving: largest error of the position, m", largest(&positions)),
        Figure::new("driving: RMSE of the heading, degrees", root_mean_square(&headings))
            .with_goal(FigureGoal::AtMost(1.0)),
        Figure::new("driving: largest error of the heading, degrees", largest(&headings)),
    ]
}

/// Figures of searches, each with whether it is ambiguous.
fn rates(name: &str, searches: &[(PoseSearch, bool)], notes: &mut Vec<String>) -> Vec<Figure> {
    let seeded = || (0..).zip(searches);
    let list = |chosen: &dyn Fn(&PoseSearch, bool) -> bool| {
        let seeds = seeded().filter(|(_, (search, is_ambiguous))| chosen(search, *is_ambiguous));
        seeds.map(|(seed, _)| seed).collect::<Vec<u64>>()
    };
    let ambiguous = list(&|_, is_ambiguous| is_ambiguous);
    let failed = list(&|search, is_ambiguous| !is_ambiguous && !search.is_found());
    let all_failed = list(&|search, _| !search.is_found());
    let mut distances: Vec<f64> =
        searches.iter().map(|(search, _)| search.found_after).filter(|after| after.is_finite()).collect();
    let clear = searches.len() - ambiguous.len();
    for (what, seeds) in [("failed", &failed), ("ambiguous", &ambiguous)] {
        if !seeds.is_empty() {
            notes.push(format!("{name}: {what} seeds {}", join(seeds)));
        }
    }
    vec![
        Figure::new(format!("{name}: starts"), searches.len() as f64),
        Figure::new(format!("{name}: of which the map leaves ambiguous"), ambiguous.len() as f64),
        Figure::new(format!("{name}: found within 20 m, %"), percent(clear - failed.len(), clear))
            .with_goal(FigureGoal::AtLeast(98.0)),
        Figure::new(format!("{name}: 95 % interval from, %"), 100.0 * wilson(clear - failed.len(), clear)),
        Figure::new(
            format!("{name}: found with ambiguous ones, %"),
            percent(searches.len() - all_failed.len(), searches.len()),
        ),
        Figure::new(format!("{name}: median distance until found, m"), percentile(&mut distances, 0.5)),
        Figure::new(format!("{name}: 95th percentile, m"), percentile(&mut distances, 0.95)),
    ]
}

fn noise(laser: &LaserDescription) -> String {
    let drive::OdometryErrors { translation_factor, rotation_factor, translation_stddev, rotation_stddev } =
        drive::ODOMETRY;
    format!(
        "laser {LASER} of {ROBOT}: {} beams, {} of them used, noise of {} m + {} of the range, {} % drop-outs, {} % mixed \
         pixels at edges; odometry: factors of 1 +- {translation_factor} (translation) and 1 +- {rotation_factor} \
         (rotation) for a run, {translation_stddev} m/sqrt(m) and {rotation_stddev} rad/sqrt(m)",
        laser.beams,
        settings::BEAMS,
        laser.noise_constant,
        laser.noise_proportional,
        100.0 * laser.dropout,
        100.0 * laser.mixed_pixels,
    )
}

/// Returns the least share by the Wilson interval of 95 % (Wilson, 1927).
fn wilson(successes: usize, trials: usize) -> f64 {
    const Z: f64 = 1.959_964;
    let (count, share) = (trials.max(1) as f64, successes as f64 / trials.max(1) as f64);
    let square = Z * Z / count;
    let spread = Z * (share * (1.0 - share) / count + square / (4.0 * count)).sqrt();
    (share + square / 2.0 - spread) / (1.0 + square)
}

/// Returns a percentage; NaN without trials, which reaches no goal.
fn percent(part: usize, whole: usize) -> f64 {
    100.0 * part as f64 / whole as f64
}

/// Returns the root mean square; NaN without values.
fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

/// Returns the largest value; NaN without values.
fn largest(values: &[f64]) -> f64 {
    values.iter().copied().reduce(slate_module::math::max).unwrap_or(f64::NAN)
}

fn join(seeds: &[u64]) -> String {
    seeds.iter().map(u64::to_string).collect::<Vec<_>>().join(", ")
}

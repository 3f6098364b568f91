//! One key for the sensor profile of a robot: that of the simulated world is also that of its RobotModel.

use slate_runtime::configuration::{Configuration, Database, Module, Report};

/// Kinds of Knowledge whose parameter `profile` names the profile of the robot's sensors.
const KINDS: [&str; 2] = ["wheeled_knowledge", "strategic_knowledge"];

/// Reads a configuration so that each RobotModel has the sensor profile of its robot in `[world]`: `world.robots.ROBOT.profile`,
/// or else `world.profile`. A profile that the configuration itself gives the RobotModel stays.
///
/// # Errors
/// Those of `read`, which takes settings of the command line.
pub fn with_sensor_profile(
    sets: Vec<String>,
    read: impl Fn(Vec<String>) -> Result<Database, Report>,
) -> Result<Database, Report> {
    let database = read(sets.clone())?;
    let profiles = settings(&database.current());
    if profiles.is_empty() { Ok(database) } else { read([profiles, sets].concat()) }
}

fn settings(configuration: &Configuration) -> Vec<String> {
    let text = |path: &str| configuration.value(path)?.value.as_str().map(str::to_owned);
    let of_world = text("world.profile");
    let is_open = |module: &&Module| {
        KINDS.contains(&module.kind.value.as_str()) && module.params.get("profile").is_none()
    };
    let knows = configuration.modules().iter().filter(is_open);
    let settings = knows.filter_map(|module| {
        let (robot, name) = module.name.value.split_once('/')?;
        let profile = text(&format!("world.robots.{robot}.profile")).or_else(|| of_world.clone())?;
        (!profile.is_empty()).then(|| format!("robots.{robot}.modules.{name}.params.profile={profile:?}"))
    });
    settings.collect()
}

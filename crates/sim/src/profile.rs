//! Selection of a robot's sensor profiles.
//! Keys of the world and of the robot's own entry select them.

use slate_sorted::{SortedMap, SortedSet};

use crate::error::{DescriptionError, unknown};
use crate::robot::RobotDescription;

/// Profile that a key names.
struct ProfileChoice<'a> {
    profile: &'a str,
    /// Path of the key.
    setting: String,
    /// Level of the key: true for the robot's, false for the world's.
    is_own: bool,
    /// Scope of the key: true for one kind of sensor, false for all kinds.
    is_single: bool,
}

/// Keys of a table that name profiles; an empty name selects none.
#[derive(Clone, Copy)]
pub(crate) struct ProfileKeys<'a> {
    /// Profile of all sensors.
    pub profile: Option<&'a str>,
    /// Profile of the sonars.
    pub sonar: Option<&'a str>,
    /// Profile of the sensor that sees other robots.
    pub robot_sensor: Option<&'a str>,
}

/// Keys that select a robot's profiles.
pub(crate) struct Profiles<'a> {
    /// Keys of the robot's entry.
    pub own: ProfileKeys<'a>,
    /// Keys of the world's table.
    pub of_world: ProfileKeys<'a>,
    /// Path of the robot's entry in the configuration.
    pub place: &'a str,
}

impl<'a> Profiles<'a> {
    /// Returns the key that selects the profile of a kind of sensor.
    /// The robot's takes precedence over the world's, then the sensor's over the general one.
    fn choice(
        &self,
        sensor: &str,
        own: Option<&'a str>,
        of_world: Option<&'a str>,
    ) -> Option<ProfileChoice<'a>> {
        let keys = [
            (own, true, true),
            (self.own.profile, true, false),
            (of_world, false, true),
            (self.of_world.profile, false, false),
        ];
        let (profile, is_own, is_single) =
            keys.into_iter().find_map(|(name, is_own, is_single)| Some((name?, is_own, is_single)))?;
        let key = if is_single { sensor } else { "profile" };
        let table = if is_own { self.place } else { "world" };
        Some(ProfileChoice { profile, setting: format!("{table}.{key}"), is_own, is_single })
    }

    fn sonar(&self) -> Option<ProfileChoice<'a>> {
        self.choice("sonar", self.own.sonar, self.of_world.sonar)
    }

    fn robot_sensor(&self) -> Option<ProfileChoice<'a>> {
        self.choice("robot_sensor", self.own.robot_sensor, self.of_world.robot_sensor)
    }

    /// Returns the sonar profile; empty for none.
    pub fn sonar_of(&self, description: &RobotDescription) -> String {
        let choice = self.sonar().filter(|choice| is_meant(choice, &description.sonar));
        choice.map_or_else(String::new, |choice| choice.profile.into())
    }

    /// Keeps the selected profile of each kind of sensor, except the sonars.
    /// A placement may choose the profile of the sonars.
    ///
    /// # Errors
    /// The key with a profile that the robot does not have.
    pub fn choose(&self, description: &mut RobotDescription, has_imu: bool) -> Result<(), DescriptionError> {
        let general = self.choice("profile", None, None);
        if let Some(choice) = &general {
            choice.check_name(description)?;
        }
        if let Some(choice) = self.sonar() {
            choice.check("sonar", description, &description.sonar)?;
        }
        if let Some(choice) = self.robot_sensor() {
            choice.check("robot_sensor", description, &description.robot_sensor)?;
            description.robot_sensor.retain(|name, _| name == choice.profile);
        }
        if let Some(choice) = general {
            choice.check("positioning", description, &description.positioning)?;
            choice.check("odometry", description, &description.odometry)?;
            if has_imu {
                choice.check("imu", description, &description.imu)?;
                description.imu.retain(|name, _| name == choice.profile);
            }
            description.positioning.retain(|name, _| name == choice.profile);
            description.odometry.retain(|name, _| name == choice.profile);
        }
        Ok(())
    }
}

/// Returns whether a key applies to a kind of sensor with these profiles.
/// A key of the world, or a general one, does not apply to robots without such a sensor.
fn is_meant<T>(choice: &ProfileChoice<'_>, profiles: &SortedMap<String, T>) -> bool {
    (choice.is_own && choice.is_single) || !profiles.is_empty()
}

impl ProfileChoice<'_> {
    /// Checks that the robot has the profile for any of its sensors.
    fn check_name(&self, description: &RobotDescription) -> Result<(), DescriptionError> {
        let RobotDescription { sonar, robot_sensor, positioning, odometry, .. } = description;
        let known: SortedSet<&str> = sonar
            .keys()
            .chain(robot_sensor.keys())
            .chain(positioning.keys())
            .chain(odometry.keys())
            .map(String::as_str)
            .collect();
        if self.profile.is_empty() || known.is_empty() || known.contains(self.profile) {
            return Ok(());
        }
        let message = unknown("sensor profile", self.profile, known.iter().copied());
        Err(DescriptionError::new(&self.setting, format!("{}: {message}", description.name)))
    }

    /// Checks that the robot has the profile for a kind of sensor.
    fn check<T>(
        &self,
        sensor: &str,
        description: &RobotDescription,
        profiles: &SortedMap<String, T>,
    ) -> Result<(), DescriptionError> {
        if self.profile.is_empty() || !is_meant(self, profiles) || profiles.contains_key(self.profile) {
            return Ok(());
        }
        let known = profiles.keys().map(String::as_str);
        let message = match (sensor, profiles.is_empty()) {
            ("robot_sensor", true) => {
                format!("unknown profile `{}`: it has no sensor that sees other robots", self.profile)
            }
            _ => unknown(&format!("{sensor} profile"), self.profile, known),
        };
        let help = match self.is_single {
            true => String::new(),
            false => format!("; add [{sensor}.{}] to the robot", self.profile),
        };
        Err(DescriptionError::new(&self.setting, format!("{}: {message}{help}", description.name)))
    }
}

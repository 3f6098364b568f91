//! Former names of parameters and ports.

/// Former and present names.
/// A former name may have several present ones, in different modules.
const RENAMED: [(&str, &str); 66] = [
    ("berth", "inflation_margin"),
    ("careful_speed", "careful_linear_velocity"),
    ("distance", "following_distance"),
    ("distance", "release_distance"),
    ("distance", "wall_distance"),
    ("far", "free_distance"),
    ("farthest", "max_gap"),
    ("fixed", "corrected_clamp"),
    ("gain", "distance_gain"),
    ("heading_for", "local_goal"),
    ("hold", "hold_time"),
    ("hold_share", "hold_fraction"),
    ("hold_within", "hold_tolerance"),
    ("horizon", "prediction_horizon"),
    ("invalid", "max_invalid_fraction"),
    ("late", "late_timeout"),
    ("leash", "max_displacement"),
    ("leave", "replan_distance"),
    ("look_ahead", "lookahead_distance"),
    ("margin", "min_clearance"),
    ("memory", "obstacle_timeout"),
    ("memory", "wall_timeout"),
    ("near", "crowded_distance"),
    ("near", "min_separation"),
    ("nearest", "min_gap"),
    ("next", "waypoint"),
    ("occupied", "occupied_threshold"),
    ("orientation_deviation", "orientation_stddev"),
    ("patience", "progress_timeout"),
    ("patience", "release_timeout"),
    ("patience", "track_timeout"),
    ("period", "publish_period"),
    ("period", "replan_period"),
    ("place", "initial_pose"),
    ("position_deviation", "position_stddev"),
    ("radius", "robot_radius"),
    ("range", "max_range"),
    ("reach", "half_width"),
    ("reach", "max_wall_range"),
    ("recovery", "recovery_time"),
    ("room", "min_clearance"),
    ("room", "room_half_width"),
    ("share", "min_brightness"),
    ("share", "min_fraction"),
    ("silent", "silent_timeout"),
    ("speed", "linear_velocity"),
    ("speed", "max_linear_velocity"),
    ("square", "cell_size"),
    ("start_deviation", "start_position_stddev"),
    ("start_turn_deviation", "start_heading_stddev"),
    ("step", "min_change"),
    ("step", "min_displacement"),
    ("step", "min_rotation"),
    ("theta", "mount_theta"),
    ("tolerance", "goal_tolerance"),
    ("turn_deviation", "odometry_rotation_stddev"),
    ("turn_gain", "bearing_gain"),
    ("turn_rate", "max_angular_velocity"),
    ("unchanged", "stuck_distance"),
    ("way_deviation", "odometry_translation_stddev"),
    ("x", "center_x"),
    ("x", "mount_x"),
    ("x", "origin_x"),
    ("y", "center_y"),
    ("y", "mount_y"),
    ("y", "origin_y"),
];

/// Returns the present name, or path, for the former name `name`.
/// It must be among `names`.
pub(super) fn renamed(name: &str, names: &[&str]) -> Option<String> {
    let (prefix, last) =
        name.rsplit_once('/').map_or(("", name), |(_, last)| (&name[..name.len() - last.len()], last));
    let present =
        RENAMED.iter().filter(|(former, _)| *former == last).map(|(_, present)| format!("{prefix}{present}"));
    present.into_iter().find(|present| names.contains(&present.as_str()))
}

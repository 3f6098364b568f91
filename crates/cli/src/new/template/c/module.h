/// @file
/// Ports and parameters of the module, which its test has too.

#pragma once

#include <slate.h>

#include "interfaces.h"

/// Ports by their places in the description; the configuration links them.
enum { POSITION, ORIENTATION, TARGET, WHEELS };

/// Parameters, in the order of the description.
typedef struct Params {
    /// Maximum linear velocity [m/s].
    double max_linear_velocity;
    /// Linear velocity per meter of distance to the target [1/s].
    double gain;
    /// Distance from the target that counts as reached [m].
    double goal_tolerance;
    /// Radius of a wheel [m].
    double wheel_radius;
    /// Distance between the wheels [m].
    double track;
} Params;

extern const SlatePluginTable slate_plugin_MODULE_KIND;

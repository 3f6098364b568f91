/// @file
/// Drives a robot with two wheels to a target.

#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>

#include <slate.hpp>

#include "interfaces.hpp"

/// Turns to the target and drives there.
struct Follower {
    static constexpr const char *name = "MODULE_KIND";
    static constexpr const char *doc = "Turns to the target and drives there.";
    static constexpr slate::Stage stage = slate::Stage::Act;

    /// Ports of the module; the configuration links them.
    struct Io {
        slate::Required<interfaces::Position> position;
        slate::Required<interfaces::Orientation> orientation;
        slate::Required<interfaces::Point2> target;
        slate::Command<interfaces::WheelSpeeds> wheels;

        static constexpr auto ports() {
            using namespace std::chrono_literals;
            return slate::ports(
                slate::port<&Io::position>("position", "Position of the robot.").stale_after(200ms),
                slate::port<&Io::orientation>("orientation", "Heading of the robot.").stale_after(200ms),
                slate::port<&Io::target>("target", "Target position."),
                slate::port<&Io::wheels>("wheels", "Command for the wheels."));
        }
    };

    struct Params {
        double max_linear_velocity;
        double gain;
        double goal_tolerance;
        double wheel_radius;
        double track;

        static constexpr auto params() {
            using slate::param;
            return slate::params(
                param<&Params::max_linear_velocity>("max_linear_velocity", 0.4).range(0.0, 1.2).unit("m/s").doc(
                    "maximum linear velocity"),
                param<&Params::gain>("gain", 2.0).range(0.0, 10.0).unit("1/s").doc(
                    "linear velocity per meter of distance to the target"),
                param<&Params::goal_tolerance>("goal_tolerance", 0.05).range(0.0, 1.0).unit("m").doc(
                    "distance from the target that counts as reached"),
                param<&Params::wheel_radius>("wheel_radius", 0.0975).range(0.01, 1.0).unit("m").doc(
                    "radius of a wheel"),
                param<&Params::track>("track", 0.331).range(0.01, 2.0).unit("m").doc("distance between the wheels"));
        }
    };

    /// State between two ticks, which a reload of the code keeps.
    struct State {
        /// Commands so far.
        std::uint64_t commands = 0;

        static constexpr auto fields() { return slate::fields(slate::field<&State::commands>("commands")); }
    };

    static slate::Outcome tick(State &state, const Io &io, const Params &params, const slate::Tick &) {
        const auto *position = io.position.fresh();
        const auto *orientation = io.orientation.fresh();
        if (position == nullptr || orientation == nullptr) {
            // Without a pose it commands nothing, and the gate stops the wheels.
            return slate::Outcome::Degraded;
        }
        state.commands += 1;
        const double x = io.target->x - position->x, y = io.target->y - position->y;
        const double distance = std::hypot(x, y);
        if (distance < params.goal_tolerance) {
            io.wheels.send({}, slate::Priority::Plan);
            return slate::Outcome::Ok;
        }
        const double bearing = std::atan2(y, x) - orientation->theta;
        const double error = std::atan2(std::sin(bearing), std::cos(bearing));
        // Slower while it faces away from the target, and near it.
        const double velocity = std::min(params.max_linear_velocity, params.gain * distance);
        const double speed = velocity * std::max(std::cos(error), 0.0);
        const double turn = params.gain * error * params.track / 2.0;
        io.wheels.send({(speed - turn) / params.wheel_radius, (speed + turn) / params.wheel_radius},
                       slate::Priority::Plan);
        return slate::Outcome::Ok;
    }
};

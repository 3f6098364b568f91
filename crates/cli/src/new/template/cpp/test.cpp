// Tests of the module without an agent and without a robot.

#include <slate/testing.hpp>

#include "MODULE_KIND.hpp"

using interfaces::Orientation;
using interfaces::Point2;
using interfaces::Position;
using interfaces::WheelSpeeds;
using slate::Outcome;
using Fixture = slate::testing::Fixture<Follower>;

/// Returns the command at the origin with heading 0.
static WheelSpeeds wheels(Point2 target) {
    Fixture follower;
    follower.set("position", Position{0.0, 0.0, 0.0});
    follower.set("orientation", Orientation{0.0});
    follower.set("target", target);
    SLATE_CHECK(follower.tick() == Outcome::Ok);
    return follower.output<WheelSpeeds>("wheels").value();
}

static void drives_straight_to_a_target_ahead() {
    const WheelSpeeds speeds = wheels({2.0, 0.0});
    SLATE_CHECK(speeds.left == speeds.right && speeds.left > 0.0);
}

static void turns_to_a_target_beside_it() {
    const WheelSpeeds speeds = wheels({0.0, 1.0});
    SLATE_CHECK(speeds.right > 0.0 && speeds.left < 0.0);
}

static void stands_still_at_the_target() {
    const WheelSpeeds speeds = wheels({0.0, 0.01});
    SLATE_CHECK(speeds.left == 0.0 && speeds.right == 0.0);
}

static void commands_nothing_without_a_fresh_position() {
    Fixture follower;
    follower.set("target", Point2{1.0, 0.0});
    SLATE_CHECK(follower.tick().waiting_for == "position");
    follower.set("position", Position{});
    follower.set("orientation", Orientation{0.0});
    follower.expire("position");
    SLATE_CHECK(follower.tick() == Outcome::Degraded);
    SLATE_CHECK(!follower.output<WheelSpeeds>("wheels"));
}

int main() {
    drives_straight_to_a_target_ahead();
    turns_to_a_target_beside_it();
    stands_still_at_the_target();
    commands_nothing_without_a_fresh_position();
}

// Tests of the module without an agent and without a robot.

#include <slate/testing.h>

#include "MODULE_KIND.h"

static const Params PARAMS = { 0.4, 2.0, 0.05, 0.0975, 0.331 };

// Opens the module at the origin with heading 0.
static void open(SlateFixture *fixture) {
    slate_fixture_open(fixture, &slate_plugin_MODULE_KIND.modules[0], &PARAMS, sizeof PARAMS);
    slate_fixture_port(fixture, POSITION, SLATE_DIRECTION_INPUT, sizeof(Position));
    slate_fixture_port(fixture, ORIENTATION, SLATE_DIRECTION_INPUT, sizeof(Orientation));
    slate_fixture_port(fixture, TARGET, SLATE_DIRECTION_INPUT, sizeof(Point2));
    slate_fixture_port(fixture, WHEELS, SLATE_DIRECTION_COMMAND, sizeof(WheelSpeeds));
    const Position position = { 0.0, 0.0, 0.0 };
    const Orientation orientation = { 0.0 };
    slate_fixture_set(fixture, POSITION, &position);
    slate_fixture_set(fixture, ORIENTATION, &orientation);
}

// Returns the command for a target.
static WheelSpeeds wheels(double x, double y) {
    SlateFixture fixture;
    open(&fixture);
    const Point2 target = { x, y };
    slate_fixture_set(&fixture, TARGET, &target);
    SLATE_CHECK(slate_fixture_tick(&fixture) == SLATE_OUTCOME_OK);
    const WheelSpeeds *output = slate_fixture_output(&fixture, WHEELS);
    SLATE_CHECK(output);
    const WheelSpeeds speeds = *output;
    slate_fixture_close(&fixture);
    return speeds;
}

static void drives_straight_to_a_target_ahead(void) {
    const WheelSpeeds speeds = wheels(2.0, 0.0);
    SLATE_CHECK(speeds.left == speeds.right && speeds.left > 0.0);
}

static void turns_to_a_target_beside_it(void) {
    const WheelSpeeds speeds = wheels(0.0, 1.0);
    SLATE_CHECK(speeds.right > 0.0 && speeds.left < 0.0);
}

static void stands_still_at_the_target(void) {
    const WheelSpeeds speeds = wheels(0.0, 0.01);
    SLATE_CHECK(speeds.left == 0.0 && speeds.right == 0.0);
}

static void commands_nothing_without_a_fresh_position(void) {
    SlateFixture fixture;
    open(&fixture);
    const Point2 target = { 1.0, 0.0 };
    slate_fixture_set(&fixture, TARGET, &target);
    slate_fixture_expire(&fixture, POSITION);
    SLATE_CHECK(slate_fixture_tick(&fixture) == SLATE_OUTCOME_DEGRADED);
    SLATE_CHECK(slate_fixture_output(&fixture, WHEELS) == NULL);
    slate_fixture_close(&fixture);
}

int main(void) {
    drives_straight_to_a_target_ahead();
    turns_to_a_target_beside_it();
    stands_still_at_the_target();
    commands_nothing_without_a_fresh_position();
    return 0;
}

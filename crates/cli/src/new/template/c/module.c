// Drives a robot with two wheels to a target.

#include "MODULE_KIND.h"

#include <math.h>
#include <stdlib.h>

#define DOC "Turns to the target and drives there."

SLATE_OUTLINE("{\"abi\":3,\"symbol\":\"slate_plugin_MODULE_KIND\",\"name\":\"MODULE_KIND\",\"version\":\"0.1.0\","
              "\"depends\":[],\"modules\":[{\"name\":\"MODULE_KIND\",\"doc\":\"" DOC "\",\"stage\":\"Act\"}]}");

// Description of the module in JSON; the chapter on plugins of the book has its keys.
static const char *const DESCRIPTION[] = {
    "{\"stage\":\"Act\",\"ports\":[",
    "{\"name\":\"position\",\"doc\":\"Position of the robot.\",\"direction\":\"Input\",\"required\":true,",
    "\"stale_after\":200000000,\"interface\":" POSITION_INTERFACE "},",
    "{\"name\":\"orientation\",\"doc\":\"Heading of the robot.\",\"direction\":\"Input\",\"required\":true,",
    "\"stale_after\":200000000,\"interface\":" ORIENTATION_INTERFACE "},",
    "{\"name\":\"target\",\"doc\":\"Target position.\",\"direction\":\"Input\",\"required\":true,",
    "\"interface\":" POINT2_INTERFACE "},",
    "{\"name\":\"wheels\",\"doc\":\"Command for the wheels.\",\"direction\":\"Command\",",
    "\"interface\":" WHEEL_SPEEDS_INTERFACE "}],",
    "\"params\":{\"name\":\"Params\",\"fields\":[",
    "{\"name\":\"max_linear_velocity\",\"unit\":\"m/s\",\"kind\":\"f64\",\"doc\":\"maximum linear velocity\"},",
    "{\"name\":\"gain\",\"unit\":\"1/s\",\"kind\":\"f64\",\"doc\":\"linear velocity per meter of distance\"},",
    "{\"name\":\"goal_tolerance\",\"unit\":\"m\",\"kind\":\"f64\",\"doc\":\"distance that counts as reached\"},",
    "{\"name\":\"wheel_radius\",\"unit\":\"m\",\"kind\":\"f64\",\"doc\":\"radius of a wheel\"},",
    "{\"name\":\"track\",\"unit\":\"m\",\"kind\":\"f64\",\"doc\":\"distance between the wheels\"}]},",
    "\"parameters\":[{\"name\":\"max_linear_velocity\",\"default\":0.4,\"range\":[0.0,1.2]},",
    "{\"name\":\"gain\",\"default\":2.0,\"range\":[0.0,10.0]},",
    "{\"name\":\"goal_tolerance\",\"default\":0.05,\"range\":[0.0,1.0]},",
    "{\"name\":\"wheel_radius\",\"default\":0.0975,\"range\":[0.01,1.0]},",
    "{\"name\":\"track\",\"default\":0.331,\"range\":[0.01,2.0]}]}",
};

static int32_t describe(const SlateSetupTable *setup, const SlateSink *sink) {
    (void)setup;
    for (size_t i = 0; i < sizeof DESCRIPTION / sizeof DESCRIPTION[0]; ++i) {
        slate_write(sink, DESCRIPTION[i], strlen(DESCRIPTION[i]));
    }
    return SLATE_DONE;
}

// State between two ticks, which a reload of the code keeps.
typedef struct State {
    // Commands so far.
    uint64_t commands;
} State;

static int32_t create(const SlateSetupTable *setup, SlateBytes params, void **instance, const SlateSink *sink) {
    (void)setup;
    if (params.length != sizeof(Params)) {
        return slate_refuse(sink, "the parameters have another size than Params");
    }
    *instance = calloc(1, sizeof(State));
    return *instance ? SLATE_DONE : slate_refuse(sink, "no memory is left for the state");
}

static int32_t tick(void *instance, const SlateFrame *frame) {
    State *state = instance;
    const Params *params = (const Params *)frame->params;
    if (slate_is_stale(frame, POSITION) || slate_is_stale(frame, ORIENTATION)) {
        // Without a pose it commands nothing, and the gate stops the wheels.
        return SLATE_OUTCOME_DEGRADED;
    }
    const Position *position = slate_input(frame, POSITION);
    const Orientation *orientation = slate_input(frame, ORIENTATION);
    const Point2 *target = slate_input(frame, TARGET);
    state->commands += 1;
    WheelSpeeds *wheels = slate_command(frame, WHEELS, SLATE_PRIORITY_PLAN);
    const double x = target->x - position->x, y = target->y - position->y;
    const double distance = hypot(x, y);
    if (distance < params->goal_tolerance) {
        wheels->left = wheels->right = 0.0;
        return SLATE_OUTCOME_OK;
    }
    const double bearing = atan2(y, x) - orientation->theta;
    const double error = atan2(sin(bearing), cos(bearing));
    // Slower while it faces away from the target, and near it.
    const double speed = fmin(params->max_linear_velocity, params->gain * distance) * fmax(cos(error), 0.0);
    const double turn = params->gain * error * params->track / 2.0;
    wheels->left = (speed - turn) / params->wheel_radius;
    wheels->right = (speed + turn) / params->wheel_radius;
    return SLATE_OUTCOME_OK;
}

static int32_t save(const void *instance, const SlateSink *sink) {
    slate_write(sink, instance, sizeof(State));
    return SLATE_DONE;
}

static int32_t restore(void *instance, SlateBytes state, const SlateSink *sink) {
    if (state.length != sizeof(State)) {
        return slate_refuse(sink, "the state has another size");
    }
    memcpy(instance, state.data, sizeof(State));
    return SLATE_DONE;
}

static int32_t may_unload(const void *instance, const SlateSink *sink) {
    (void)instance, (void)sink;
    return SLATE_DONE;
}

static int32_t destroy(void *instance, const SlateSink *sink) {
    (void)sink;
    free(instance);
    return SLATE_DONE;
}

static const SlateModuleTable MODULES[] = {
    { SLATE_TEXT("MODULE_KIND"), SLATE_TEXT(DOC), { NULL, 0 }, describe, create, tick, save, restore, may_unload, destroy },
};

SLATE_PLUGIN(MODULE_KIND, MODULES);

/// @file
/// Tests of modules in C without an agent: a fixture feeds inputs, makes steps and reads outputs.
///
/// The test is linked with the plugin's source and drives the calls of its table, as an agent does. It knows the ports
/// by their places in the description, and their sizes from the test:
///
///     SlateFixture fixture;
///     slate_fixture_open(&fixture, &slate_plugin_follower.modules[0], &params, sizeof params);
///     slate_fixture_port(&fixture, TARGET, SLATE_DIRECTION_INPUT, sizeof(Point2));
///     slate_fixture_set(&fixture, TARGET, &target);
///     SLATE_CHECK(slate_fixture_tick(&fixture) == SLATE_OUTCOME_OK);
///     const WheelSpeeds *wheels = slate_fixture_output(&fixture, WHEELS);
///     slate_fixture_close(&fixture);

#pragma once

#include "../slate.h"

#include <stdio.h>
#include <stdlib.h>

/// Largest number of ports of a module in a fixture.
#define SLATE_FIXTURE_PORTS 32

/// Most messages of a port in a step.
#define SLATE_FIXTURE_MESSAGES 16

/// Module on its own, driven by the calls that an agent makes.
typedef struct SlateFixture {
    const SlateModuleTable *table;
    void *instance;
    const void *params;
    size_t params_size;
    SlatePortSlot ports[SLATE_FIXTURE_PORTS];
    /// Sizes of the values of the ports, bytes.
    size_t sizes[SLATE_FIXTURE_PORTS];
    size_t port_count;
    SlateRandom random;
    /// Host's time of the next step, ns.
    uint64_t now;
    uint64_t last;
    uint64_t number;
    /// Last refusal or log message, as text.
    char text[512];
} SlateFixture;

/// Ends the program with a message if a condition does not hold.
#define SLATE_CHECK(condition)                                                                   \
    do {                                                                                         \
        if (!(condition)) {                                                                      \
            fprintf(stderr, "%s:%d: does not hold: %s\n", __FILE__, __LINE__, #condition);       \
            exit(1);                                                                             \
        }                                                                                        \
    } while (0)

static inline void slate_fixture_write_(void *context, const uint8_t *data, size_t length) {
    char *text = (char *)context;
    const size_t used = strlen(text), room = 511 - used;
    memcpy(text + used, data, length < room ? length : room);
    text[used + (length < room ? length : room)] = 0;
}

static inline void slate_fixture_log_(const void *context, uint32_t level, const uint8_t *text, size_t length) {
    SlateFixture *fixture = *(SlateFixture *const *)context;
    (void)level;
    fixture->text[0] = 0;
    slate_fixture_write_(fixture->text, text, length);
    printf("%s\n", fixture->text);
}

/// Returns the sink of a fixture, which keeps the beginning of what is written as its text.
static inline SlateSink slate_fixture_sink(SlateFixture *fixture) {
    SlateSink sink = { fixture->text, slate_fixture_write_ };
    fixture->text[0] = 0;
    return sink;
}

/// Creates an instance with those parameters, which live as long as it; ends the program if the module refuses.
static inline void slate_fixture_open(SlateFixture *fixture, const SlateModuleTable *table, const void *params, size_t size) {
    memset(fixture, 0, sizeof *fixture);
    fixture->table = table;
    fixture->params = params;
    fixture->params_size = size;
    fixture->random.state[0] = 1;
    const SlateSetupTable setup = { table->name, 0, 20000000, { NULL, 0 }, { NULL, 0 } };
    const SlateBytes bytes = { (const uint8_t *)params, size };
    const SlateSink sink = slate_fixture_sink(fixture);
    if (table->create(&setup, bytes, &fixture->instance, &sink) != SLATE_DONE) {
        fprintf(stderr, "the module refuses its setup: %s\n", fixture->text);
        exit(1);
    }
}

/// Declares a port by its place in the description, and the size of its values in bytes.
static inline void slate_fixture_port(SlateFixture *fixture, size_t port, SlateDirection direction, size_t size) {
    SLATE_CHECK(port < SLATE_FIXTURE_PORTS);
    SlatePortSlot *slot = &fixture->ports[port];
    const size_t many = direction == SLATE_DIRECTION_OUTBOX || direction == SLATE_DIRECTION_INBOX || direction == SLATE_DIRECTION_QUEUE
                            ? SLATE_FIXTURE_MESSAGES : 0;
    slot->direction = (uint32_t)direction;
    slot->flags = direction == SLATE_DIRECTION_INPUT ? SLATE_FLAG_STALE : 0;
    slot->data = (uint8_t *)calloc(1, size + 1);
    slot->entries = (SlateEntry *)calloc(many + 1, sizeof(SlateEntry));
    SLATE_CHECK(slot->data && slot->entries);
    for (size_t i = 0; i < many; ++i) {
        slot->entries[i].data = (uint8_t *)calloc(1, size + 1);
        SLATE_CHECK(slot->entries[i].data);
    }
    slot->capacity = direction == SLATE_DIRECTION_OUTBOX ? many : 0;
    fixture->sizes[port] = size;
    fixture->port_count = port < fixture->port_count ? fixture->port_count : port + 1;
}

/// Sets an input.
static inline void slate_fixture_set(SlateFixture *fixture, size_t port, const void *value) {
    SlatePortSlot *slot = &fixture->ports[port];
    SLATE_CHECK(port < fixture->port_count && slot->direction == SLATE_DIRECTION_INPUT);
    memcpy(slot->data, value, fixture->sizes[port]);
    slot->stamp.sequence += 1;
    slot->stamp.time = fixture->now;
    slot->flags = SLATE_FLAG_NEW | SLATE_FLAG_ALIVE;
}

/// Puts a message into an inbox, or a value into a queue.
static inline void slate_fixture_push(SlateFixture *fixture, size_t port, const void *value) {
    SlatePortSlot *slot = &fixture->ports[port];
    SLATE_CHECK(port < fixture->port_count && slot->count < SLATE_FIXTURE_MESSAGES && slot->direction != SLATE_DIRECTION_OUTBOX);
    memcpy(slot->entries[slot->count].data, value, fixture->sizes[port]);
    slot->entries[slot->count].answer = 0;
    slot->count += 1;
}

/// Makes an input stale, as when its writer stopped.
static inline void slate_fixture_expire(SlateFixture *fixture, size_t port) {
    SLATE_CHECK(port < fixture->port_count);
    fixture->ports[port].flags |= SLATE_FLAG_STALE;
}

/// Makes one step, and returns its outcome. The test sets required inputs before the first one.
static inline int32_t slate_fixture_tick(SlateFixture *fixture) {
    const SlateHost host = { &fixture, slate_fixture_log_ };
    for (size_t i = 0; i < fixture->port_count; ++i) {
        SLATE_CHECK(fixture->ports[i].data && "every port up to the last one is declared");
        fixture->ports[i].flags &= ~(uint32_t)SLATE_FLAG_SET;
        if (fixture->ports[i].direction == SLATE_DIRECTION_OUTBOX) {
            fixture->ports[i].stamp.sequence += fixture->ports[i].count;
            fixture->ports[i].count = 0;
        }
    }
    SlateFrame frame;
    frame.ports = fixture->ports;
    frame.port_count = fixture->port_count;
    frame.params = (const uint8_t *)fixture->params;
    frame.params_size = fixture->params_size;
    frame.params_version = 1;
    frame.now = fixture->now;
    frame.elapsed = fixture->number == 0 ? 0 : fixture->now - fixture->last;
    frame.number = ++fixture->number;
    frame.random = &fixture->random;
    frame.host = &host;
    const int32_t outcome = fixture->table->tick(fixture->instance, &frame);
    fixture->last = fixture->now;
    for (size_t i = 0; i < fixture->port_count; ++i) {
        fixture->ports[i].flags &= ~(uint32_t)SLATE_FLAG_NEW;
        if (fixture->ports[i].direction != SLATE_DIRECTION_OUTBOX) {
            fixture->ports[i].count = 0;
        }
    }
    return outcome;
}

/// Returns the value of an output in the last step; null if it was not written.
static inline const void *slate_fixture_output(const SlateFixture *fixture, size_t port) {
    SLATE_CHECK(port < fixture->port_count);
    return fixture->ports[port].flags & SLATE_FLAG_SET ? fixture->ports[port].data : NULL;
}

/// Returns a message that the last step sent by its place; null beyond the last.
static inline const void *slate_fixture_sent(const SlateFixture *fixture, size_t port, size_t index) {
    SLATE_CHECK(port < fixture->port_count && fixture->ports[port].direction == SLATE_DIRECTION_OUTBOX);
    return index < fixture->ports[port].count ? fixture->ports[port].entries[index].data : NULL;
}

/// Ends the instance and frees the memory of the ports.
static inline void slate_fixture_close(SlateFixture *fixture) {
    const SlateSink sink = slate_fixture_sink(fixture);
    fixture->table->destroy(fixture->instance, &sink);
    for (size_t i = 0; i < fixture->port_count; ++i) {
        SlatePortSlot *slot = &fixture->ports[i];
        for (size_t m = 0; slot->entries && m < SLATE_FIXTURE_MESSAGES && slot->entries[m].data; ++m) {
            free(slot->entries[m].data);
        }
        free(slot->entries);
        free(slot->data);
    }
}

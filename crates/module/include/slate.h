// C interface of Slate's plugins.
//
// A plugin is a shared library that exports a `SlatePluginTable` under the name `slate_plugin_<name>`, with an outline in
// its section `.slate` (see SLATE_OUTLINE).
//
// Made from crates/module; do not edit.

#pragma once

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#ifdef __cplusplus
#define SLATE_STATIC_ASSERT(condition, text) static_assert(condition, text)
#define SLATE_EXPORT extern "C" __attribute__((visibility("default")))
#else
#define SLATE_STATIC_ASSERT(condition, text) _Static_assert(condition, text)
#define SLATE_EXPORT extern __attribute__((visibility("default")))
#endif

// Outline of the library as JSON: modules and requirements. Hosts read it from the file before they open the library:
//
//     SLATE_OUTLINE("{\"abi\":3,\"symbol\":\"slate_plugin_smoother\",\"name\":\"smoother\",\"version\":\"1.0.0\","
//                   "\"depends\":[],\"modules\":[{\"name\":\"smoother\",\"stage\":\"Think\"}]}");
#define SLATE_OUTLINE(json) __attribute__((used, section(".slate"))) static const char slate_outline[] = json

// Constant text in a table, such as a module's name.
#define SLATE_TEXT(literal) { (const uint8_t *)(literal), sizeof(literal) - 1 }

// Exports the plugin's table: an array of SlateModuleTable.
#define SLATE_PLUGIN(name, modules)                                                         \
    SLATE_EXPORT const SlatePluginTable slate_plugin_##name;                                \
    const SlatePluginTable slate_plugin_##name = { SLATE_ABI, sizeof(SlateModuleTable), modules, \
                                                   sizeof(modules) / sizeof((modules)[0]) }

// Version of this interface; a host refuses libraries of another one.
//
// 3: a setup may have parameters, and a description hardware of robots.
#define SLATE_ABI 3

// Success of a call.
#define SLATE_DONE 0

// Refusal of a call; the sink has the reason.
#define SLATE_REFUSED 1

// Result of `tick` after a panic.
#define SLATE_PANICKED -1

// Input: not read by an earlier tick.
#define SLATE_FLAG_NEW 1

// Input: older than its declaration allows, or its writer is gone or late.
#define SLATE_FLAG_STALE 2

// Input: something writes it now, by a link.
#define SLATE_FLAG_ALIVE 4

// Output: was written in this tick.
#define SLATE_FLAG_SET 8

// Output: is just being written in place.
#define SLATE_FLAG_BUSY 16

// Severity of a log message.
enum SlateLevel
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    // Failure of a part.
    SLATE_LEVEL_ERROR = 0,
    // Problem with which the robot goes on.
    SLATE_LEVEL_WARN = 1,
    // Information for users.
    SLATE_LEVEL_INFO = 2,
    // Information for developers.
    SLATE_LEVEL_DEBUG = 3,
    // Detailed trace.
    SLATE_LEVEL_TRACE = 4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum SlateLevel SlateLevel;
#else
typedef uint32_t SlateLevel;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Direction of a port, and its delivery.
enum SlateDirection
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    // Reads the newest value.
    SLATE_DIRECTION_INPUT,
    // Reads every value in order.
    SLATE_DIRECTION_QUEUE,
    // Writes a value.
    SLATE_DIRECTION_OUTPUT,
    // Writes a value only while somebody reads it.
    SLATE_DIRECTION_DEBUG,
    // Writes an actuator's command, which passes the gate.
    SLATE_DIRECTION_COMMAND,
    // Receives messages.
    SLATE_DIRECTION_INBOX,
    // Sends messages.
    SLATE_DIRECTION_OUTBOX,
    // Uses a service of the host or of another module.
    SLATE_DIRECTION_ASPECT,
    // Provides a service to other modules.
    SLATE_DIRECTION_PROVIDER,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum SlateDirection SlateDirection;
#else
typedef uint32_t SlateDirection;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Outcome of a tick.
enum SlateOutcome
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    // Intended result.
    SLATE_OUTCOME_OK = 0,
    // Degraded result, such as with a stale input; the reason belongs in the log.
    SLATE_OUTCOME_DEGRADED = 1,
    // Failure; its outputs are dropped, and outputs with a safe value take that.
    SLATE_OUTCOME_FAILED = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum SlateOutcome SlateOutcome;
#else
typedef int32_t SlateOutcome;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Command priority of an actuator; the highest wins.
enum SlatePriority
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    // Planned action.
    SLATE_PRIORITY_PLAN = 1,
    // Operator at the controls.
    SLATE_PRIORITY_TELEOPERATION = 2,
    // Reflex.
    SLATE_PRIORITY_REFLEX = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum SlatePriority SlatePriority;
#else
typedef uint32_t SlatePriority;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Bytes that stay unchanged during a call.
// Those of a table stay so as long as its library is open.
typedef struct SlateBytes {
    // Address of the first byte; any value for an empty range.
    const uint8_t *data;
    // Length, bytes.
    size_t length;
} SlateBytes;

// Setup of a module.
typedef struct SlateSetupTable {
    // Name of the module in the agent, such as `r2/planner`.
    struct SlateBytes name;
    // Seed of the run.
    uint64_t seed;
    // Period of the main loop, ns.
    uint64_t period;
    // Configuration table that the module asked for, as CBOR; empty if missing.
    struct SlateBytes section;
    // Value of the parameter interface, for a description with parameters; else empty.
    // Only a kind that describes hardware is described so.
    struct SlateBytes params;
} SlateSetupTable;

// Sink of bytes from a module; writes are appended.
// It takes a description, a state, or the reason of a refusal.
typedef struct SlateSink {
    // Context, passed to each call.
    void *context;
    // Takes bytes, which may be gone after the call.
    void (*write)(void *context, const uint8_t *data, size_t length);
} SlateSink;

// Time and writer of a value.
typedef struct SlateStamp {
    // Number of values written up to and including this one; 0 for never written.
    uint64_t sequence;
    // The host's time of the write, in nanoseconds.
    uint64_t time;
    // Counts the writers that this property has had; the first is 1.
    uint64_t generation;
} SlateStamp;

// Value in a queue, an inbox or an outbox.
typedef struct SlateEntry {
    // Value.
    uint8_t *data;
    // Number of tail items.
    size_t items;
    // Stamp of the value.
    // Outbox: its sequence is the number of an earlier message, to which `answer` belongs.
    struct SlateStamp stamp;
    // Answer to a message.
    // Inbox: answer of the receiver; 0 is done, else the reason of the refusal. Outbox: delivery of that message; 0 is
    // waiting, 1 done, 2 lost without an answer, 65536 plus the reason a refusal.
    uint32_t answer;
    // Inbox: number of the sender.
    uint32_t sender;
} SlateEntry;

// Port of a frame.
typedef struct SlatePortSlot {
    // Schema hash of the port's interface, which binding checks.
    uint64_t schema;
    // Input: value. Output: working slot; null for a debug output without a reader.
    uint8_t *data;
    // Tail items of the value.
    size_t items;
    // Output: room in the tail. Outbox: how many messages fit.
    size_t capacity;
    // Input: stamp of the value. Outbox: its sequence counts earlier messages.
    // Earlier messages are those of earlier ticks.
    struct SlateStamp stamp;
    // See `SLATE_FLAG_NEW` and those that follow it.
    uint32_t flags;
    // `SlateDirection`, which binding checks.
    uint32_t direction;
    // Command: priority.
    uint32_t priority;
    // Queue, inbox, outbox: the values.
    struct SlateEntry *entries;
    // Number of entries that hold a value.
    size_t count;
    // Input and queue: values that this reader never saw.
    uint64_t missed;
} SlatePortSlot;

// Stream of pseudo-random numbers: xoshiro256++ (Blackman and Vigna, 2021).
// It is plain data that a snapshot can hold.
typedef struct SlateRandom {
    uint64_t state[4];
} SlateRandom;

// Services of the host during a tick.
typedef struct SlateHost {
    // Context, passed to each call.
    const void *context;
    // Takes a log message; `level` is a `SlateLevel`.
    void (*log)(const void *context, uint32_t level, const uint8_t *text, size_t length);
} SlateHost;

// Frame of one tick: inputs and room for outputs, filled by the host.
//
// No atomic is part of it: the host pins all inputs before the step and commits the outputs after it, so one path
// serves modules that are linked in, loaded, isolated, replayed and tested.
typedef struct SlateFrame {
    // Slots of the ports, in the order of the description.
    struct SlatePortSlot *ports;
    // Number of ports.
    size_t port_count;
    // Value of the module's parameter interface.
    const uint8_t *params;
    // Size of the parameters, bytes.
    size_t params_size;
    // Counts the changes of the parameters.
    uint64_t params_version;
    // Host's time, ns.
    uint64_t now;
    // Time since this module's last tick, ns; 0 in the first.
    uint64_t elapsed;
    // Counts this module's ticks from 1.
    uint64_t number;
    // Random stream of the module.
    struct SlateRandom *random;
    // Services of the host during a tick.
    const struct SlateHost *host;
} SlateFrame;

// Calls of a kind of module, over memory and threads of the host. None unwinds.
//
// The host makes one call at a time to an instance, from any thread.
typedef struct SlateModuleTable {
    // Name by which configuration finds it, in snake case.
    struct SlateBytes name;
    // Description of the module.
    struct SlateBytes doc;
    // Configuration table that sets it up; empty for most kinds.
    struct SlateBytes section;
    // Writes ports, parameters and trigger, or the reason of a refusal.
    // They are those under a setup, as CBOR or JSON.
    int32_t (*describe)(const struct SlateSetupTable *setup, const struct SlateSink *sink);
    // Makes an instance; the bytes are a value of the parameter interface.
    int32_t (*create)(const struct SlateSetupTable *setup,
                      struct SlateBytes params,
                      void **instance,
                      const struct SlateSink *sink);
    // Makes one step: 0 as intended, 1 degraded, 2 failed, -1 after a panic.
    int32_t (*tick)(void *instance, const struct SlateFrame *frame);
    // Writes the state.
    int32_t (*save)(const void *instance, const struct SlateSink *sink);
    // Restores a saved state; refuses one that doesn't fit, and keeps the present one.
    int32_t (*restore)(void *instance, struct SlateBytes state, const struct SlateSink *sink);
    // Refuses when the module can't be unloaded now, with the reason.
    int32_t (*may_unload)(const void *instance, const struct SlateSink *sink);
    // Ends an instance; a refusal only describes an error.
    int32_t (*destroy)(void *instance, const struct SlateSink *sink);
} SlateModuleTable;

// Table that a library exports as `slate_plugin_<crate>`.
typedef struct SlatePluginTable {
    // `SLATE_ABI` at the time of its build.
    uint32_t abi;
    // Size of a `SlateModuleTable` at the time of its build, bytes.
    uint32_t module_size;
    // Kinds of modules.
    const struct SlateModuleTable *modules;
    // Number of kinds.
    size_t module_count;
} SlatePluginTable;


// Returns a text as bytes.
static inline SlateBytes slate_text(const char *text) {
    SlateBytes bytes;
    bytes.data = (const uint8_t *)text;
    bytes.length = strlen(text);
    return bytes;
}

// Writes bytes to the host, such as a state; writes are appended.
static inline void slate_write(const SlateSink *sink, const void *data, size_t length) {
    sink->write(sink->context, (const uint8_t *)data, length);
}

// Refuses a call, with the reason: `return slate_refuse(sink, "the arm is raised");`.
static inline int32_t slate_refuse(const SlateSink *sink, const char *reason) {
    slate_write(sink, reason, strlen(reason));
    return SLATE_REFUSED;
}

// Returns the port at that index of the description; null beyond the last one.
static inline SlatePortSlot *slate_port(const SlateFrame *frame, size_t port) {
    return port < frame->port_count ? &frame->ports[port] : NULL;
}

// Returns the newest value of an input; null before the first write. A required input has one in every tick.
static inline const void *slate_input(const SlateFrame *frame, size_t port) {
    const SlatePortSlot *slot = slate_port(frame, port);
    return slot && slot->stamp.sequence > 0 ? slot->data : NULL;
}

// Returns 1 if an input was written since this module's last tick.
static inline int slate_is_new(const SlateFrame *frame, size_t port) {
    const SlatePortSlot *slot = slate_port(frame, port);
    return slot && (slot->flags & SLATE_FLAG_NEW) != 0;
}

// Returns 1 if an input is older than declared, or its writer is gone or late.
static inline int slate_is_stale(const SlateFrame *frame, size_t port) {
    const SlatePortSlot *slot = slate_port(frame, port);
    return !slot || (slot->flags & SLATE_FLAG_STALE) != 0;
}

// Sets an output and returns the address of its value, which is committed after the tick. Fill all of it, as it holds an
// earlier value. Null for a debug output without a reader.
static inline void *slate_output(const SlateFrame *frame, size_t port) {
    SlatePortSlot *slot = slate_port(frame, port);
    if (!slot || !slot->data) {
        return NULL;
    }
    slot->flags |= SLATE_FLAG_SET;
    return slot->data;
}

// Commands an actuator: as slate_output, with the priority of the command.
static inline void *slate_command(const SlateFrame *frame, size_t port, SlatePriority priority) {
    SlatePortSlot *slot = slate_port(frame, port);
    if (!slot) {
        return NULL;
    }
    slot->priority = (uint32_t)priority;
    return slate_output(frame, port);
}

// Writes to the agent's log.
static inline void slate_log(const SlateFrame *frame, SlateLevel level, const char *text) {
    frame->host->log(frame->host->context, (uint32_t)level, (const uint8_t *)text, strlen(text));
}

#if UINTPTR_MAX == UINT64_MAX
SLATE_STATIC_ASSERT(sizeof(SlateBytes) == 16, "Bytes");
SLATE_STATIC_ASSERT(offsetof(SlateBytes, data) == 0, "Bytes.data");
SLATE_STATIC_ASSERT(offsetof(SlateBytes, length) == 8, "Bytes.length");
SLATE_STATIC_ASSERT(sizeof(SlateSink) == 16, "Sink");
SLATE_STATIC_ASSERT(offsetof(SlateSink, context) == 0, "Sink.context");
SLATE_STATIC_ASSERT(offsetof(SlateSink, write) == 8, "Sink.write");
SLATE_STATIC_ASSERT(sizeof(SlateSetupTable) == 64, "SetupTable");
SLATE_STATIC_ASSERT(offsetof(SlateSetupTable, name) == 0, "SetupTable.name");
SLATE_STATIC_ASSERT(offsetof(SlateSetupTable, seed) == 16, "SetupTable.seed");
SLATE_STATIC_ASSERT(offsetof(SlateSetupTable, period) == 24, "SetupTable.period");
SLATE_STATIC_ASSERT(offsetof(SlateSetupTable, section) == 32, "SetupTable.section");
SLATE_STATIC_ASSERT(offsetof(SlateSetupTable, params) == 48, "SetupTable.params");
SLATE_STATIC_ASSERT(sizeof(SlateModuleTable) == 104, "ModuleTable");
SLATE_STATIC_ASSERT(offsetof(SlateModuleTable, name) == 0, "ModuleTable.name");
SLATE_STATIC_ASSERT(offsetof(SlateModuleTable, doc) == 16, "ModuleTable.doc");
SLATE_STATIC_ASSERT(offsetof(SlateModuleTable, section) == 32, "ModuleTable.section");
SLATE_STATIC_ASSERT(offsetof(SlateModuleTable, describe) == 48, "ModuleTable.describe");
SLATE_STATIC_ASSERT(offsetof(SlateModuleTable, create) == 56, "ModuleTable.create");
SLATE_STATIC_ASSERT(offsetof(SlateModuleTable, tick) == 64, "ModuleTable.tick");
SLATE_STATIC_ASSERT(offsetof(SlateModuleTable, save) == 72, "ModuleTable.save");
SLATE_STATIC_ASSERT(offsetof(SlateModuleTable, restore) == 80, "ModuleTable.restore");
SLATE_STATIC_ASSERT(offsetof(SlateModuleTable, may_unload) == 88, "ModuleTable.may_unload");
SLATE_STATIC_ASSERT(offsetof(SlateModuleTable, destroy) == 96, "ModuleTable.destroy");
SLATE_STATIC_ASSERT(sizeof(SlatePluginTable) == 24, "PluginTable");
SLATE_STATIC_ASSERT(offsetof(SlatePluginTable, abi) == 0, "PluginTable.abi");
SLATE_STATIC_ASSERT(offsetof(SlatePluginTable, module_size) == 4, "PluginTable.module_size");
SLATE_STATIC_ASSERT(offsetof(SlatePluginTable, modules) == 8, "PluginTable.modules");
SLATE_STATIC_ASSERT(offsetof(SlatePluginTable, module_count) == 16, "PluginTable.module_count");
SLATE_STATIC_ASSERT(sizeof(SlateStamp) == 24, "Stamp");
SLATE_STATIC_ASSERT(offsetof(SlateStamp, sequence) == 0, "Stamp.sequence");
SLATE_STATIC_ASSERT(offsetof(SlateStamp, time) == 8, "Stamp.time");
SLATE_STATIC_ASSERT(offsetof(SlateStamp, generation) == 16, "Stamp.generation");
SLATE_STATIC_ASSERT(sizeof(SlateRandom) == 32, "Random");
SLATE_STATIC_ASSERT(sizeof(SlateHost) == 16, "Host");
SLATE_STATIC_ASSERT(offsetof(SlateHost, context) == 0, "Host.context");
SLATE_STATIC_ASSERT(offsetof(SlateHost, log) == 8, "Host.log");
SLATE_STATIC_ASSERT(sizeof(SlateEntry) == 48, "Entry");
SLATE_STATIC_ASSERT(offsetof(SlateEntry, data) == 0, "Entry.data");
SLATE_STATIC_ASSERT(offsetof(SlateEntry, items) == 8, "Entry.items");
SLATE_STATIC_ASSERT(offsetof(SlateEntry, stamp) == 16, "Entry.stamp");
SLATE_STATIC_ASSERT(offsetof(SlateEntry, answer) == 40, "Entry.answer");
SLATE_STATIC_ASSERT(offsetof(SlateEntry, sender) == 44, "Entry.sender");
SLATE_STATIC_ASSERT(sizeof(SlatePortSlot) == 96, "PortSlot");
SLATE_STATIC_ASSERT(offsetof(SlatePortSlot, schema) == 0, "PortSlot.schema");
SLATE_STATIC_ASSERT(offsetof(SlatePortSlot, data) == 8, "PortSlot.data");
SLATE_STATIC_ASSERT(offsetof(SlatePortSlot, items) == 16, "PortSlot.items");
SLATE_STATIC_ASSERT(offsetof(SlatePortSlot, capacity) == 24, "PortSlot.capacity");
SLATE_STATIC_ASSERT(offsetof(SlatePortSlot, stamp) == 32, "PortSlot.stamp");
SLATE_STATIC_ASSERT(offsetof(SlatePortSlot, flags) == 56, "PortSlot.flags");
SLATE_STATIC_ASSERT(offsetof(SlatePortSlot, direction) == 60, "PortSlot.direction");
SLATE_STATIC_ASSERT(offsetof(SlatePortSlot, priority) == 64, "PortSlot.priority");
SLATE_STATIC_ASSERT(offsetof(SlatePortSlot, entries) == 72, "PortSlot.entries");
SLATE_STATIC_ASSERT(offsetof(SlatePortSlot, count) == 80, "PortSlot.count");
SLATE_STATIC_ASSERT(offsetof(SlatePortSlot, missed) == 88, "PortSlot.missed");
SLATE_STATIC_ASSERT(sizeof(SlateFrame) == 80, "Frame");
SLATE_STATIC_ASSERT(offsetof(SlateFrame, ports) == 0, "Frame.ports");
SLATE_STATIC_ASSERT(offsetof(SlateFrame, port_count) == 8, "Frame.port_count");
SLATE_STATIC_ASSERT(offsetof(SlateFrame, params) == 16, "Frame.params");
SLATE_STATIC_ASSERT(offsetof(SlateFrame, params_size) == 24, "Frame.params_size");
SLATE_STATIC_ASSERT(offsetof(SlateFrame, params_version) == 32, "Frame.params_version");
SLATE_STATIC_ASSERT(offsetof(SlateFrame, now) == 40, "Frame.now");
SLATE_STATIC_ASSERT(offsetof(SlateFrame, elapsed) == 48, "Frame.elapsed");
SLATE_STATIC_ASSERT(offsetof(SlateFrame, number) == 56, "Frame.number");
SLATE_STATIC_ASSERT(offsetof(SlateFrame, random) == 64, "Frame.random");
SLATE_STATIC_ASSERT(offsetof(SlateFrame, host) == 72, "Frame.host");
#endif

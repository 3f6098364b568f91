/* A plugin in C, built as one that must not be opened by the host. STEP and VERSION are set by the test. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct { const uint8_t *data; size_t length; } Bytes;
typedef struct { void *context; void (*write)(void *, const uint8_t *, size_t); } Sink;
typedef struct {
    uint64_t schema; uint8_t *data; size_t items, capacity; uint64_t stamp[3];
    uint32_t flags, direction, priority; const void *entries; size_t count; uint64_t missed;
} PortSlot;
typedef struct {
    PortSlot *ports; size_t port_count; const uint8_t *params; size_t params_size;
    uint64_t params_version, now, elapsed, number; void *random; const void *host;
} Frame;
typedef struct {
    Bytes name, doc, section;
    int32_t (*describe)(const void *, const Sink *);
    int32_t (*create)(const void *, Bytes, void **, const Sink *);
    int32_t (*tick)(void *, const Frame *);
    int32_t (*save)(const void *, const Sink *);
    int32_t (*restore)(void *, Bytes, const Sink *);
    int32_t (*may_unload)(const void *, const Sink *);
    int32_t (*destroy)(void *, const Sink *);
} Module;
typedef struct { uint32_t abi, module_size; const Module *modules; size_t module_count; } Plugin;

#ifndef PANIC
#define PANIC "abort"
#endif

/* What is done when it is opened, if anything. */
#ifdef OPENED
__attribute__((constructor)) static void opened(void) { OPENED; }
#endif

#define TEXT(text) { (const uint8_t *)text, sizeof(text) - 1 }

static int32_t describe(const void *setup, const Sink *sink) {
    static const char text[] = "{\"stage\": \"Think\", \"ports\": [{\"name\": \"number\", \"direction\": \"Output\","
        " \"interface\": {\"name\": \"Number\", \"fields\": [{\"name\": \"value\", \"kind\": \"f64\"}]}}]}";
    sink->write(sink->context, (const uint8_t *)text, sizeof text - 1);
    return 0;
}
static int32_t create(const void *setup, Bytes params, void **instance, const Sink *sink) {
    *instance = calloc(1, sizeof(double));
    return 0;
}
static int32_t tick(void *instance, const Frame *frame) {
    double *count = instance;
    *count += STEP;
    memcpy(frame->ports[0].data, count, sizeof *count);
    frame->ports[0].flags |= 8;
    return 0;
}
static int32_t save(const void *instance, const Sink *sink) {
    sink->write(sink->context, instance, sizeof(double));
    return 0;
}
static int32_t restore(void *instance, Bytes state, const Sink *sink) {
    memcpy(instance, state.data, sizeof(double));
    return 0;
}
static int32_t may_unload(const void *instance, const Sink *sink) {
    static const char text[] = "it counts on";
    if (*(const double *)instance < 10) {
        sink->write(sink->context, (const uint8_t *)text, sizeof text - 1);
        return 1;
    }
    return 0;
}
static int32_t destroy(void *instance, const Sink *sink) { free(instance); (void)sink; return 0; }

static const Module MODULE = {
    TEXT("c_counter"), TEXT("Counts."), TEXT(""), describe, create, tick, save, restore, may_unload, destroy
};
const Plugin slate_plugin_c_counter = { 3, sizeof(Module), &MODULE, 1 };

__attribute__((section(".slate"), used)) static const char OUTLINE[] =
    "{\"abi\": 3, \"symbol\": \"slate_plugin_c_counter\", \"name\": \"c_counter\", \"version\": \"" VERSION "\","
    " \"panic\": \"" PANIC "\", \"modules\": [{\"name\": \"c_counter\"}]}";

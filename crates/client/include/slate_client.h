// Client of an agent of Slate for programs in C and C++: libslate.
//
//     SlateError *error = NULL;
//     SlateAgent *agent = slate_agent_connect("exp1", &error);
//     double x;
//     if (!agent || !slate_agent_read_number(agent, "/simulator/r2/truth/x", &x, &error)) {
//         fprintf(stderr, "%s\nhelp: %s\n", slate_error_message(error), slate_error_help(error));
//         slate_error_free(error);
//     }
//     slate_agent_free(agent);
//
// The last argument of a call takes its error, and may be NULL. A call that returns a text or an object gives it to the
// caller, who frees it. Values are those of JSON as the HTTP API has them: null for infinity and NaN, SI units.
//
// Made from crates/client; do not edit.

#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// Kind of an error.
typedef enum SlateErrorKind {
    // An argument of the call is invalid.
    SLATE_ERROR_KIND_INVALID_ARGUMENT,
    // No agent of that name runs on this machine.
    SLATE_ERROR_KIND_NO_AGENT,
    // The agent does not answer, or the connection broke.
    SLATE_ERROR_KIND_UNREACHABLE,
    // The agent has another version of the operations.
    SLATE_ERROR_KIND_VERSION_MISMATCH,
    // The agent refuses.
    SLATE_ERROR_KIND_REFUSED,
    // The agent's answer makes no sense.
    SLATE_ERROR_KIND_INVALID_ANSWER,
    // Defect of this library.
    SLATE_ERROR_KIND_INTERNAL,
} SlateErrorKind;

// Connection to an agent, until `slate_agent_free`.
// Several threads may use it at the same time; their calls take turns.
typedef struct SlateAgent SlateAgent;

// Error of a call, until `slate_error_free`.
typedef struct SlateError SlateError;

// Values of a property as they come, until `slate_watch_free`.
// It has a connection of its own. One thread uses it at a time.
typedef struct SlateWatch SlateWatch;

// Value of a property.
// The text belongs to the caller, who frees it with `slate_text_free`.
typedef struct SlateSample {
    // Value as JSON; null before the first write.
    char *json;
    // Number of values written up to this one; 0 before the first write.
    uint64_t sequence;
    // Agent's time of the write, s.
    double time;
    // Number of values before this one that the reader was too slow for.
    uint64_t missed;
} SlateSample;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Connects to the agent of that name on this machine.
// NULL or an empty name is that in the variable SLATE_AGENT, or the only agent that runs.
// Returns NULL on an error.
struct SlateAgent *slate_agent_connect(const char *name, struct SlateError **error);

// Connects to an agent elsewhere with the secret of a role.
// The address is one such as `https://robot.local:7878`. `certificate` is the file of the certificates to trust; NULL for those that the system trusts.
// Returns NULL on an error.
struct SlateAgent *slate_agent_connect_remote(const char *address,
                                              const char *token,
                                              const char *certificate,
                                              struct SlateError **error);

// Closes a connection; null is allowed.
void slate_agent_free(struct SlateAgent *agent);

// Returns the name of an agent, until its connection is freed.
const char *slate_agent_name(const struct SlateAgent *agent);

// Carries out an operation of the HTTP API, and returns the answer as JSON.
// `path` stands behind `/api/v1`, such as `/modules`; `body` is JSON, or NULL for none. Returns NULL on an error; free
// the answer with `slate_text_free`.
char *slate_agent_call(const struct SlateAgent *agent,
                       const char *method,
                       const char *path,
                       const char *body,
                       struct SlateError **error);

// Reads the newest value of a property or a field.
// The URL is one such as `/r2/pose` or `/r2/pose/x`. Before the first write the JSON of the sample is NULL. Returns false on an error.
bool slate_agent_read(const struct SlateAgent *agent,
                      const char *url,
                      struct SlateSample *sample,
                      struct SlateError **error);

// Reads the newest value of a field that is a number.
// It is NaN before the first write, and for infinity and NaN. Returns false on an error, also if it is not a number.
bool slate_agent_read_number(const struct SlateAgent *agent,
                             const char *url,
                             double *value,
                             struct SlateError **error);

// Sets a parameter, an input without a link, or fields of one.
// The value is JSON; fields that it does not name keep theirs. Returns false on an error.
bool slate_agent_set(const struct SlateAgent *agent,
                     const char *url,
                     const char *value,
                     struct SlateError **error);

// Sets a setting of the configuration.
// Path and value are those that `slate run --set PATH=VALUE` takes. Returns false on an error.
bool slate_agent_configure(const struct SlateAgent *agent,
                           const char *path,
                           const char *value,
                           struct SlateError **error);

// Sends a message to an inbox, and returns the outcome, such as `done`.
// The message is JSON. Returns NULL on an error; free the outcome with `slate_text_free`.
char *slate_agent_send(const struct SlateAgent *agent,
                       const char *url,
                       const char *message,
                       struct SlateError **error);

// Stops all actuators until they are reset and armed.
// It works while the agent is busy. Returns false on an error.
bool slate_agent_stop(const struct SlateAgent *agent, const char *reason, struct SlateError **error);

// Returns the kind of an error.
enum SlateErrorKind slate_error_kind(const struct SlateError *error);

// Returns what is wrong, until the error is freed.
const char *slate_error_message(const struct SlateError *error);

// Returns what to do, until the error is freed; empty without advice.
const char *slate_error_help(const struct SlateError *error);

// Returns the code of an error, such as `S004`, until the error is freed.
// `slate explain` describes it; empty without one.
const char *slate_error_code(const struct SlateError *error);

// Frees an error; null is allowed.
void slate_error_free(struct SlateError *error);

// Frees a text that a call returned; null is allowed.
void slate_text_free(char *text);

// Begins to watch a property or a field; its newest value is the first one.
// Returns NULL on an error.
struct SlateWatch *slate_agent_watch(const struct SlateAgent *agent,
                                     const char *url,
                                     struct SlateError **error);

// Waits for the next value for at most `timeout` seconds.
// Returns 1 with it in `sample`, 0 if none comes in time, and -1 on an error.
int32_t slate_watch_next(struct SlateWatch *watch,
                         double timeout,
                         struct SlateSample *sample,
                         struct SlateError **error);

// Ends a watch; null is allowed.
void slate_watch_free(struct SlateWatch *watch);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

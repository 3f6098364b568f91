// Talks to a live agent with every call of the client, and ends with a message at the first surprise.

#include <slate_client.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define CHECK(condition)                                                                         \
    do {                                                                                         \
        if (!(condition)) {                                                                      \
            fprintf(stderr, "%d: does not hold: %s\n", __LINE__, #condition);                    \
            exit(1);                                                                             \
        }                                                                                        \
    } while (0)

// Ends the program unless a call ended with an error of that kind, whose texts have those words.
static void expect(SlateError *error, SlateErrorKind kind, const char *message, const char *help) {
    CHECK(error);
    if (slate_error_kind(error) != kind || !strstr(slate_error_message(error), message) || !strstr(slate_error_help(error), help)) {
        fprintf(stderr, "kind %u: %s\nhelp: %s\n", (unsigned)slate_error_kind(error), slate_error_message(error),
                slate_error_help(error));
        exit(1);
    }
    slate_error_free(error);
}

static void is_done(bool done, SlateError *error) {
    if (!done) {
        fprintf(stderr, "%s\nhelp: %s\n", slate_error_message(error), slate_error_help(error));
        exit(1);
    }
}

// Waits until the sum is a number but for the millionths that count the steps.
static void wait_for_sum(SlateAgent *agent, double expected) {
    SlateError *error = NULL;
    SlateWatch *watch = slate_agent_watch(agent, "/adder/sum/value", &error);
    is_done(watch != NULL, error);
    double value = 0.0;
    uint64_t before = 0;
    for (int i = 0; i < 1000 && !(value >= expected && value < expected + 0.1); ++i) {
        SlateSample sample;
        const int32_t came = slate_watch_next(watch, 10.0, &sample, &error);
        is_done(came >= 0, error);
        CHECK(came == 1 && sample.sequence > before);
        before = sample.sequence;
        value = atof(sample.json);
        slate_text_free(sample.json);
    }
    CHECK(value >= expected && value < expected + 0.1);
    slate_watch_free(watch);
}

int main(int count, char **arguments) {
    CHECK(count == 2);
    SlateError *error = NULL;

    CHECK(!slate_agent_connect("no-such-agent", &error));
    expect(error, SLATE_ERROR_KIND_NO_AGENT, "no agent `no-such-agent` runs here", arguments[1]);
    CHECK(!slate_agent_connect_remote("nonsense", "abc", NULL, &error));
    expect(error, SLATE_ERROR_KIND_INVALID_ARGUMENT, "not an address of an agent", "http://127.0.0.1:7878");
    CHECK(!slate_agent_connect_remote("http://127.0.0.1:9", "abc", NULL, &error));
    expect(error, SLATE_ERROR_KIND_UNREACHABLE, "127.0.0.1:9", "slate ps");
    // Without a place for the error it is dropped.
    CHECK(!slate_agent_connect("no-such-agent", NULL));

    SlateAgent *agent = slate_agent_connect(arguments[1], &error);
    is_done(agent != NULL, error);
    CHECK(strcmp(slate_agent_name(agent), arguments[1]) == 0);

    wait_for_sum(agent, 0.5);
    double number = 0.0;
    is_done(slate_agent_read_number(agent, "/adder/sum/value", &number, &error), error);
    CHECK(number >= 0.5 && number < 0.6);
    SlateSample sample;
    is_done(slate_agent_read(agent, "/adder/sum", &sample, &error), error);
    CHECK(strstr(sample.json, "\"value\":0.5") && sample.sequence > 0 && sample.missed == 0 && sample.time >= 0.0);
    slate_text_free(sample.json);
    is_done(slate_agent_read(agent, "/adder/input", &sample, &error), error);
    CHECK(sample.json == NULL && sample.sequence == 0);
    is_done(slate_agent_read_number(agent, "/adder/input/value", &number, &error), error);
    CHECK(isnan(number));

    // An input, a parameter by its property and by its setting, and a message.
    is_done(slate_agent_set(agent, "/adder/input", "{\"value\": 2.0}", &error), error);
    wait_for_sum(agent, 2.5);
    is_done(slate_agent_set(agent, "/adder/params/offset", "0.75", &error), error);
    wait_for_sum(agent, 2.75);
    is_done(slate_agent_configure(agent, "modules.adder.params.offset", "1.0", &error), error);
    wait_for_sum(agent, 3.0);
    char *outcome = slate_agent_send(agent, "/adder/inbox", "{\"value\": 4.0}", &error);
    is_done(outcome != NULL, error);
    CHECK(strcmp(outcome, "done") == 0);
    slate_text_free(outcome);
    wait_for_sum(agent, 7.0);

    // Refusals have the agent's words.
    CHECK(!slate_agent_set(agent, "/adder/params/offset", "1.5", &error));
    expect(error, SLATE_ERROR_KIND_REFUSED, "1.5", "");
    CHECK(!slate_agent_read(agent, "/adder/summ", &sample, &error));
    expect(error, SLATE_ERROR_KIND_REFUSED, "summ", "");
    CHECK(!slate_agent_watch(agent, "/nothing", &error));
    expect(error, SLATE_ERROR_KIND_REFUSED, "nothing", "");
    CHECK(!slate_agent_set(agent, "/adder/input", "{value", &error));
    expect(error, SLATE_ERROR_KIND_INVALID_ARGUMENT, "the value is no JSON", "{\"x\": 1.0}");
    CHECK(!slate_agent_read_number(agent, "/adder/sum", &number, &error));
    expect(error, SLATE_ERROR_KIND_INVALID_ARGUMENT, "expected a number at `/adder/sum`", "a field");
    CHECK(!slate_agent_read(agent, NULL, &sample, &error));
    expect(error, SLATE_ERROR_KIND_INVALID_ARGUMENT, "the URL is NULL", "pass a text");
    CHECK(!slate_agent_read(agent, "\xff", &sample, &error));
    expect(error, SLATE_ERROR_KIND_INVALID_ARGUMENT, "the URL is no UTF-8", "UTF-8");
    CHECK(!slate_agent_read(NULL, "/adder/sum", &sample, &error));
    expect(error, SLATE_ERROR_KIND_INVALID_ARGUMENT, "the agent is NULL", "");

    // Any operation of the API.
    char *modules = slate_agent_call(agent, "GET", "/modules", NULL, &error);
    is_done(modules != NULL, error);
    CHECK(strstr(modules, "\"adder\""));
    slate_text_free(modules);
    CHECK(!slate_agent_call(agent, "GET", "/nonsense", NULL, &error));
    expect(error, SLATE_ERROR_KIND_REFUSED, "", "");

    // Nothing new comes to an input that nobody writes.
    SlateWatch *watch = slate_agent_watch(agent, "/adder/input", &error);
    is_done(watch != NULL, error);
    CHECK(slate_watch_next(watch, 5.0, &sample, &error) == 1);
    slate_text_free(sample.json);
    CHECK(slate_watch_next(watch, 0.05, &sample, &error) == 0);
    CHECK(slate_watch_next(watch, NAN, &sample, &error) == -1);
    expect(error, SLATE_ERROR_KIND_INVALID_ARGUMENT, "timeout", "seconds");
    slate_watch_free(watch);

    is_done(slate_agent_stop(agent, "from C", &error), error);
    char *reset = slate_agent_call(agent, "POST", "/reset", NULL, &error);
    is_done(reset != NULL, error);
    CHECK(strstr(reset, "was_stopped"));
    slate_text_free(reset);

    slate_agent_free(agent);
    slate_agent_free(NULL);
    slate_watch_free(NULL);
    slate_error_free(NULL);
    slate_text_free(NULL);
    printf("done\n");
    return 0;
}

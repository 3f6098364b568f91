// Reads a number of a live agent, linked with the static library.

#include <slate_client.h>

#include <cmath>
#include <cstdio>

int main(int, char **arguments) {
    SlateError *error = nullptr;
    SlateAgent *agent = slate_agent_connect(arguments[1], &error);
    double sum = NAN;
    // Its first step may not be made yet.
    while (agent != nullptr && error == nullptr && std::isnan(sum)) {
        slate_agent_read_number(agent, "/adder/sum/value", &sum, &error);
    }
    if (error != nullptr) {
        std::fprintf(stderr, "%s\nhelp: %s\n", slate_error_message(error), slate_error_help(error));
        return 1;
    }
    std::printf("sum %f\n", sum);
    slate_agent_free(agent);
}

// A message of ROS 2 from one process to another, one at a time, by the library that all its languages stand on: `rcl reader`,
// `rcl writer SIZE COUNT`. The reader waits in a thread of its own for what came, and prints the nanoseconds that each took.
#include <rcl/error_handling.h>
#include <rcl/rcl.h>
#include <std_msgs/msg/empty.h>
#include <std_msgs/msg/u_int8_multi_array.h>

#include <inttypes.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static uint64_t now(void) {
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (uint64_t)time.tv_sec * 1000000000 + (uint64_t)time.tv_nsec;
}

static void must(rcl_ret_t done) {
    if (done != RCL_RET_OK) {
        fprintf(stderr, "%s\n", rcl_get_error_string().str);
        exit(1);
    }
}

static rcl_context_t context;
static rcl_node_t node;
static rcl_publisher_t publisher;
static rcl_subscription_t subscription;
static rcl_wait_set_t waiting;

static const rosidl_message_type_support_t *value_type(void) {
    return ROSIDL_GET_MSG_TYPE_SUPPORT(std_msgs, msg, UInt8MultiArray);
}

static const rosidl_message_type_support_t *got_type(void) { return ROSIDL_GET_MSG_TYPE_SUPPORT(std_msgs, msg, Empty); }

static void start(int reads) {
    rcl_init_options_t options = rcl_get_zero_initialized_init_options();
    must(rcl_init_options_init(&options, rcl_get_default_allocator()));
    context = rcl_get_zero_initialized_context();
    must(rcl_init(0, NULL, &options, &context));
    node = rcl_get_zero_initialized_node();
    rcl_node_options_t settings = rcl_node_get_default_options();
    must(rcl_node_init(&node, reads ? "reader" : "writer", "", &context, &settings));
    publisher = rcl_get_zero_initialized_publisher();
    rcl_publisher_options_t publishes = rcl_publisher_get_default_options();
    must(rcl_publisher_init(&publisher, &node, reads ? got_type() : value_type(), reads ? "got" : "value", &publishes));
    subscription = rcl_get_zero_initialized_subscription();
    rcl_subscription_options_t subscribes = rcl_subscription_get_default_options();
    must(rcl_subscription_init(&subscription, &node, reads ? value_type() : got_type(), reads ? "value" : "got", &subscribes));
    waiting = rcl_get_zero_initialized_wait_set();
    must(rcl_wait_set_init(&waiting, 1, 0, 0, 0, 0, 0, &context, rcl_get_default_allocator()));
}

// Leaves nothing behind in shared memory.
static void finish(void) {
    must(rcl_wait_set_fini(&waiting));
    must(rcl_subscription_fini(&subscription, &node));
    must(rcl_publisher_fini(&publisher, &node));
    must(rcl_node_fini(&node));
    must(rcl_shutdown(&context));
    must(rcl_context_fini(&context));
}

static volatile sig_atomic_t ended;

static void end(int signal) { ended = signal; }

// Waits until something came, for at most so many milliseconds.
static int comes(int milliseconds) {
    must(rcl_wait_set_clear(&waiting));
    must(rcl_wait_set_add_subscription(&waiting, &subscription, NULL));
    rcl_ret_t waited = rcl_wait(&waiting, (int64_t)milliseconds * 1000000);
    return waited == RCL_RET_OK && waiting.subscriptions[0] != NULL;
}

static void read_values(void) {
    start(1);
    std_msgs__msg__UInt8MultiArray *value = std_msgs__msg__UInt8MultiArray__create();
    std_msgs__msg__Empty *got = std_msgs__msg__Empty__create();
    signal(SIGTERM, end);
    while (!ended) {
        if (!comes(100) || rcl_take(&subscription, value, NULL, NULL) != RCL_RET_OK) {
            continue;
        }
        uint64_t took = now(), sent;
        memcpy(&sent, value->data.data, sizeof sent);
        printf("%" PRIu64 "\n", took - sent);
        fflush(stdout);
        must(rcl_publish(&publisher, got, NULL));
    }
    finish();
}

static int write_values(size_t size, int count) {
    start(0);
    size_t there = 0, back = 0;
    for (int tries = 0; there == 0 || back == 0; ++tries) {
        if (tries == 2000) {
            fprintf(stderr, "the reader is not found\n");
            return 1;
        }
        usleep(10000);
        must(rcl_publisher_get_subscription_count(&publisher, &there));
        must(rcl_subscription_get_publisher_count(&subscription, &back));
    }
    usleep(300000);
    std_msgs__msg__UInt8MultiArray *value = std_msgs__msg__UInt8MultiArray__create();
    std_msgs__msg__Empty *got = std_msgs__msg__Empty__create();
    rosidl_runtime_c__uint8__Sequence__init(&value->data, size);
    memset(value->data.data, 7, size);
    for (int i = 0; i < count; ++i) {
        usleep(500);
        uint64_t sent = now();
        memcpy(value->data.data, &sent, sizeof sent);
        must(rcl_publish(&publisher, value, NULL));
        if (!comes(10000)) {
            fprintf(stderr, "the reader does not answer\n");
            return 1;
        }
        must(rcl_take(&subscription, got, NULL, NULL));
    }
    finish();
    return 0;
}

int main(int count, char **words) {
    if (count == 2 && strcmp(words[1], "reader") == 0) {
        read_values();
        return 0;
    }
    return count == 4 ? write_values(strtoul(words[2], NULL, 10), atoi(words[3])) : 2;
}

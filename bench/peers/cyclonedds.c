// A message of CycloneDDS from one process to another, one at a time: `cyclonedds reader`, `cyclonedds writer SIZE COUNT`. The
// reader waits in a thread of its own for what came, and prints the nanoseconds that each took.
#include <dds/dds.h>

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "cyclonedds.h"

static uint64_t now(void) {
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (uint64_t)time.tv_sec * 1000000000 + (uint64_t)time.tv_nsec;
}

// Gives what is not an entity as a mistake, and ends.
static dds_entity_t made(dds_entity_t entity, const char *what) {
    if (entity < 0) {
        fprintf(stderr, "%s: %s\n", what, dds_strretcode(-entity));
        exit(1);
    }
    return entity;
}

static dds_entity_t values, answers, waiting;

static void start(int reads) {
    dds_qos_t *qos = dds_create_qos();
    dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(10));
    dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 10);
    dds_entity_t part = made(dds_create_participant(DDS_DOMAIN_DEFAULT, NULL, NULL), "participant");
    dds_entity_t value = made(dds_create_topic(part, &Value_desc, "value", NULL, NULL), "topic");
    dds_entity_t got = made(dds_create_topic(part, &Got_desc, "got", NULL, NULL), "topic");
    values = made(reads ? dds_create_reader(part, value, qos, NULL) : dds_create_writer(part, value, qos, NULL), "values");
    answers = made(reads ? dds_create_writer(part, got, qos, NULL) : dds_create_reader(part, got, qos, NULL), "answers");
    waiting = made(dds_create_waitset(part), "waitset");
    dds_entity_t comes = reads ? values : answers;
    dds_entity_t condition = made(dds_create_readcondition(comes, DDS_ANY_STATE), "condition");
    made(dds_waitset_attach(waiting, condition, 0), "waitset");
    dds_delete_qos(qos);
}

static int matched(void) {
    dds_publication_matched_status_t there;
    dds_subscription_matched_status_t back;
    dds_get_publication_matched_status(values, &there);
    dds_get_subscription_matched_status(answers, &back);
    return there.current_count > 0 && back.current_count > 0;
}

static void read_values(void) {
    start(1);
    Got got = {0};
    for (;;) {
        made(dds_waitset_wait(waiting, NULL, 0, DDS_INFINITY), "waiting");
        void *sample = NULL;
        dds_sample_info_t information;
        while (dds_take(values, &sample, &information, 1, 1) > 0) {
            uint64_t took = now();
            if (information.valid_data) {
                printf("%" PRIu64 "\n", took - ((Value *)sample)->time);
                fflush(stdout);
                dds_write(answers, &got);
            }
            dds_return_loan(values, &sample, 1);
        }
    }
}

static int write_values(size_t size, int count) {
    start(0);
    for (int tries = 0; !matched(); ++tries) {
        if (tries == 2000) {
            fprintf(stderr, "the reader is not found\n");
            return 1;
        }
        usleep(10000);
    }
    usleep(300000);
    // The time is a part of it.
    size_t length = size - sizeof(uint64_t);
    Value value = {0};
    value.bytes._buffer = malloc(length);
    value.bytes._length = value.bytes._maximum = (uint32_t)length;
    memset(value.bytes._buffer, 7, length);
    for (int i = 0; i < count; ++i) {
        usleep(500);
        value.time = now();
        made(dds_write(values, &value), "write");
        Got got;
        void *sample = &got;
        dds_sample_info_t information;
        if (dds_waitset_wait(waiting, NULL, 0, DDS_SECS(10)) <= 0) {
            fprintf(stderr, "the reader does not answer\n");
            return 1;
        }
        dds_take(answers, &sample, &information, 1, 1);
    }
    return 0;
}

int main(int count, char **words) {
    if (count == 2 && strcmp(words[1], "reader") == 0) {
        read_values();
    }
    return count == 4 ? write_values(strtoul(words[2], NULL, 10), atoi(words[3])) : 2;
}

// A message of LCM from one process to another, one at a time: `lcm reader SIZE`, `lcm writer SIZE COUNT`. The reader prints the
// nanoseconds that each took.
#include <lcm/lcm.h>

#include <cstdint>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <string>
#include <unistd.h>
#include <vector>

static int64_t now() {
    timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return int64_t(time.tv_sec) * 1000000000 + time.tv_nsec;
}

static void take(const lcm_recv_buf_t *buffer, const char *, void *user) {
    int64_t took = now();
    int64_t sent;
    memcpy(&sent, buffer->data, sizeof sent);
    // The first messages only find out whether somebody is there.
    if (sent > 0) {
        printf("%lld\n", static_cast<long long>(took - sent));
        fflush(stdout);
    }
    lcm_publish(static_cast<lcm_t *>(user), "got", "", 1);
}

static void answered(const lcm_recv_buf_t *, const char *, void *user) { ++*static_cast<int *>(user); }

int main(int argc, char **argv) {
    std::string role = argc > 2 ? argv[1] : "";
    size_t size = argc > 2 ? std::stoul(argv[2]) : 64;
    int count = argc > 3 ? std::stoi(argv[3]) : 0;
    lcm_t *lcm = lcm_create("udpm://239.255.76.67:7667?ttl=0");
    if (!lcm) {
        fprintf(stderr, "LCM needs multicast on the loopback interface\n");
        return 1;
    }
    if (role == "reader") {
        lcm_subscribe(lcm, "value", take, lcm);
        while (lcm_handle(lcm) == 0) {
        }
        return 0;
    }
    int answers = 0;
    lcm_subscribe(lcm, "got", answered, &answers);
    std::vector<uint8_t> bytes(size, 7);
    memset(bytes.data(), 0, 8);
    for (int tries = 0; answers == 0; ++tries) {
        if (tries == 200) {
            fprintf(stderr, "the reader does not answer\n");
            return 1;
        }
        lcm_publish(lcm, "value", bytes.data(), size);
        lcm_handle_timeout(lcm, 100);
    }
    while (lcm_handle_timeout(lcm, 200) > 0) {
    }
    for (int i = 0; i < count; ++i) {
        usleep(500);
        int before = answers;
        int64_t sent = now();
        memcpy(bytes.data(), &sent, sizeof sent);
        lcm_publish(lcm, "value", bytes.data(), size);
        // A message that is lost is sent again: LCM promises nothing.
        for (int tries = 0; answers == before && tries < 50; ++tries) {
            lcm_handle_timeout(lcm, 20);
        }
    }
    return 0;
}

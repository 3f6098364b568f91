// A message of roscpp, one at a time, from one process to another: `roscpp reader SIZE`, `roscpp writer SIZE COUNT`; in one
// process: `roscpp turns SIZE COUNT` where one thread publishes and then calls back, `roscpp threads SIZE COUNT` where another
// one does. Who reads prints the nanoseconds that each took.
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <std_msgs/ByteMultiArray.h>
#include <std_msgs/Empty.h>

#include <boost/make_shared.hpp>

#include <atomic>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <string>
#include <vector>

static int64_t now() {
    timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return int64_t(time.tv_sec) * 1000000000 + time.tv_nsec;
}

static int read(ros::NodeHandle &node) {
    ros::Publisher got = node.advertise<std_msgs::Empty>("got", 10);
    auto take = [&](const std_msgs::ByteMultiArray::ConstPtr &message) {
        int64_t took = now();
        int64_t sent;
        memcpy(&sent, message->data.data(), sizeof sent);
        printf("%lld\n", static_cast<long long>(took - sent));
        fflush(stdout);
        got.publish(std_msgs::Empty());
    };
    boost::function<void(const std_msgs::ByteMultiArray::ConstPtr &)> callback = take;
    ros::Subscriber values = node.subscribe<std_msgs::ByteMultiArray>(
        "value", 10, callback, ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay());
    ros::spin();
    return 0;
}

static int write(ros::NodeHandle &node, size_t size, int count) {
    int answers = 0;
    ros::Publisher values = node.advertise<std_msgs::ByteMultiArray>("value", 10);
    boost::function<void(const std_msgs::Empty::ConstPtr &)> callback = [&](const std_msgs::Empty::ConstPtr &) { ++answers; };
    ros::Subscriber got = node.subscribe<std_msgs::Empty>(
        "got", 10, callback, ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay());
    ros::WallTime end = ros::WallTime::now() + ros::WallDuration(20);
    while (values.getNumSubscribers() == 0 || got.getNumPublishers() == 0) {
        if (ros::WallTime::now() > end) {
            fprintf(stderr, "the reader is not found\n");
            return 1;
        }
        ros::spinOnce();
        usleep(1000);
    }
    usleep(300000);
    std_msgs::ByteMultiArray message;
    message.data.assign(size, 7);
    for (int i = 0; i < count; ++i) {
        usleep(500);
        int64_t sent = now();
        memcpy(message.data.data(), &sent, sizeof sent);
        values.publish(message);
        while (answers <= i && ros::ok()) {
            ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.1));
        }
    }
    return 0;
}

// Publishes shared pointers, which are handed on as they are in a process.
static int hand_on(ros::NodeHandle &node, size_t size, int count, bool threads) {
    std::atomic<int> answers(0);
    std::vector<int64_t> times;
    times.reserve(count);
    boost::function<void(const std_msgs::ByteMultiArray::ConstPtr &)> take = [&](const std_msgs::ByteMultiArray::ConstPtr &message) {
        int64_t took = now(), sent;
        memcpy(&sent, message->data.data(), sizeof sent);
        times.push_back(took - sent);
        ++answers;
    };
    ros::Publisher values = node.advertise<std_msgs::ByteMultiArray>("value", 10);
    ros::Subscriber reader = node.subscribe<std_msgs::ByteMultiArray>("value", 10, take);
    ros::AsyncSpinner spinner(1);
    if (threads) {
        spinner.start();
    }
    ros::WallTime end = ros::WallTime::now() + ros::WallDuration(20);
    while (values.getNumSubscribers() == 0) {
        if (ros::WallTime::now() > end) {
            fprintf(stderr, "the subscriber is not found\n");
            return 1;
        }
        usleep(1000);
    }
    for (int i = 0; i < count; ++i) {
        usleep(1000);
        std_msgs::ByteMultiArray::Ptr message = boost::make_shared<std_msgs::ByteMultiArray>();
        message->data.assign(size, 7);
        int64_t sent = now();
        memcpy(message->data.data(), &sent, sizeof sent);
        values.publish(message);
        while (answers <= i && ros::ok()) {
            if (threads) {
                usleep(20);
            } else {
                ros::getGlobalCallbackQueue()->callAvailable();
            }
        }
    }
    for (int64_t took : times) {
        printf("%lld\n", static_cast<long long>(took));
    }
    return 0;
}

int main(int argc, char **argv) {
    std::string role = argc > 2 ? argv[1] : "";
    size_t size = argc > 2 ? std::stoul(argv[2]) : 64;
    int count = argc > 3 ? std::stoi(argv[3]) : 0;
    ros::init(argc, argv, "slate_bench_" + role, ros::init_options::NoSigintHandler);
    ros::NodeHandle node;
    if (role == "turns" || role == "threads") {
        return hand_on(node, size, count, role == "threads");
    }
    return role == "reader" ? read(node) : write(node, size, count);
}

// Every kind of port, field, parameter and state of slate.hpp, driven by its fixture.

#include <slate.hpp>
#include <slate/testing.hpp>
#if __has_include(<Eigen/Core>)
#include <slate/eigen.hpp>
#endif

using namespace std::chrono_literals;
using slate::Outcome;

enum class Gear : std::uint8_t { Neutral, First };

template <>
struct slate::Enumeration<Gear> {
    static constexpr const char *name = "Gear";
    static constexpr slate::Constant constants[] = {{"NEUTRAL", 0, "No drive."}, {"FIRST", 1}};
};

struct Point {
    double x{}, y{};

    static constexpr auto interface() {
        return slate::interface("Point", "Point in the plane.", slate::field<&Point::x>("x", "m"), slate::field<&Point::y>("y", "m"));
    }
};

struct Everything {
    slate::Bool flag;
    std::int16_t small;
    std::uint64_t large;
    float single;
    Gear gear;
    slate::Text<8> text;
    slate::Optional<double> optional;
    std::array<double, 4> array;
    slate::Sequence<Point, 3> sequence;
    Point nested;

    static constexpr auto interface() {
        using slate::field;
        return slate::interface("Everything", "Every kind of field.", field<&Everything::flag>("flag"), field<&Everything::small>("small"),
                                field<&Everything::large>("large", "ticks"), field<&Everything::single>("single", "m"),
                                field<&Everything::gear>("gear"), field<&Everything::text>("text"),
                                field<&Everything::optional>("optional"), field<&Everything::array>("array"),
                                field<&Everything::sequence>("sequence"), field<&Everything::nested>("nested"));
    }
};

struct Ranges {
    float resolution;

    static constexpr auto interface() {
        return slate::interface("Ranges", "Ranges of a scanner.", slate::field<&Ranges::resolution>("resolution", "rad"),
                                slate::tail<double>("ranges", "m", "Distances."));
    }
};

/// Uses every kind of port.
struct User {
    static constexpr const char *name = "user";
    static constexpr const char *doc = "Uses \"every\" kind of port.";
    static constexpr slate::Stage stage = slate::Stage::Think;
    static constexpr auto trigger = slate::on(1s, "everything", "queue");
    static constexpr auto deadline = 5ms;

    struct Io {
        slate::Required<Everything> everything;
        slate::Input<Ranges> ranges;
        slate::Queue<Point> queue;
        slate::Inbox<Point> inbox;
        slate::Output<Point> sum;
        slate::Output<Ranges> doubled;
        slate::Debug<Point> debug;
        slate::Command<Point> command;
        slate::Outbox<Point> outbox;

        static constexpr auto ports() {
            using slate::port;
            return slate::ports(port<&Io::everything>("everything", "Every kind of field.").stale_after(200ms),
                                port<&Io::ranges>("ranges"), port<&Io::queue>("queue").window(4), port<&Io::inbox>("inbox"),
                                port<&Io::sum>("sum").safe({1.0, 2.0}), port<&Io::doubled>("doubled").capacity(4),
                                port<&Io::debug>("debug"), port<&Io::command>("command"), port<&Io::outbox>("outbox").window(2));
        }
    };
    struct Params {
        double gain{};
        std::int32_t limit;
        slate::Bool fails;

        static constexpr auto params() {
            using slate::param;
            return slate::params(param<&Params::gain>("gain", 0.5).range(0.0, 1.0).unit("1/s").doc("Gain."),
                                 param<&Params::limit>("limit", 3), param<&Params::fails>("fails", false));
        }
    };
    struct State {
        double sum = 0.0;
        std::int64_t count = -7;
        bool moved = false;
        std::string text;
        std::vector<std::array<std::int16_t, 2>> pairs;
        std::optional<float> last;

        static constexpr auto fields() {
            using slate::field;
            return slate::fields(field<&State::sum>("sum"), field<&State::count>("count"), field<&State::moved>("moved"),
                                 field<&State::text>("text"), field<&State::pairs>("pairs"), field<&State::last>("last"));
        }
    };

    static State create(const slate::Setup &setup, const Params &params) {
        if (params.limit < 0) {
            throw slate::Refusal("limit: expected 0 or more");
        }
        State state;
        state.text = setup.name;
        return state;
    }

    static Outcome tick(State &state, const Io &io, const Params &params, const slate::Tick &now) {
        if (params.fails) {
            throw std::runtime_error("the motor does not answer");
        }
        const Everything *everything = io.everything.fresh();
        if (everything == nullptr) {
            return Outcome::Degraded;
        }
        state.sum += params.gain * everything->array[3] + everything->nested.x;
        state.pairs.push_back({-1, 300});
        state.last = everything->single;
        for (const auto point : io.queue) {
            state.sum += point->x;
        }
        for (const auto message : io.inbox) {
            message.refuse(7);
        }
        if (io.ranges.get() != nullptr) {
            io.doubled.write(io.ranges.tail().size(), [&](Ranges &ranges, slate::Span<double> tail) {
                ranges.resolution = io.ranges.get()->resolution;
                for (std::size_t i = 0; i < tail.size(); ++i) {
                    tail[i] = 2.0 * io.ranges.tail()[i];
                }
            });
        }
        io.sum.set({state.sum, now.random().unit()});
        io.debug.set([] { return Point{3.0, 4.0}; });
        io.command.send({state.sum, 0.0}, slate::Priority::Reflex);
        const auto number = io.outbox.send({1.0, 2.0});
        SLATE_CHECK(number && io.outbox.delivery(*number).state == slate::Delivery::Waiting);
        SLATE_CHECK(io.outbox.send({3.0, 4.0}) && !io.outbox.send({5.0, 6.0}));
        now.info("made a step", {{"sum", state.sum}, {"gear", "first"}, {"moved", state.moved}});
        return Outcome::Ok;
    }

    static void may_unload(const State &state) {
        if (state.sum > 100.0) {
            throw slate::Refusal("the arm is raised");
        }
    }
};

SLATE_MODULES(user, "1.2.3", User);

/// Throws what is no exception of the standard library.
struct Thrower {
    static constexpr const char *name = "thrower";
    static constexpr slate::Stage stage = slate::Stage::Act;
    using Io = slate::Nothing;
    using Params = slate::Nothing;
    /// It is not copied, and frees what it holds.
    struct State {
        std::unique_ptr<int> held = std::make_unique<int>(3);
    };

    static Outcome tick(State &state, const Io &, const Params &, const slate::Tick &) { throw *state.held; }
    static std::string save(const State &state) { return std::to_string(*state.held); }
    static State restore(std::string_view bytes) { return {std::make_unique<int>(std::stoi(std::string(bytes)))}; }
};

/// Describes its fields in another order than that of the members.
struct Swapped {
    double x, y;

    static constexpr auto interface() {
        return slate::interface("Swapped", "", slate::field<&Swapped::y>("y"), slate::field<&Swapped::x>("x"));
    }
};

struct SwappedReader {
    static constexpr const char *name = "swapped_reader";
    static constexpr slate::Stage stage = slate::Stage::Act;
    struct Io {
        slate::Input<Swapped> input;

        static constexpr auto ports() { return slate::ports(slate::port<&Io::input>("input")); }
    };
    using Params = slate::Nothing;
    using State = slate::Nothing;

    static Outcome tick(State &, const Io &, const Params &, const slate::Tick &) { return Outcome::Ok; }
};

/// Returns the message of the exception that a call throws.
template <typename Call>
std::string thrown(Call &&call) {
    try {
        call();
    } catch (const std::exception &error) {
        return error.what();
    }
    return "nothing";
}

bool has(const std::string &text, std::string_view part) { return text.find(part) != std::string::npos; }

void uses_every_port() {
    slate::testing::Fixture<User> user;
    SLATE_CHECK(user.tick().waiting_for == "everything");
    Everything everything{};
    everything.array[3] = 4.0;
    everything.nested.x = 0.25;
    everything.single = 1.5F;
    user.set("everything", everything);
    user.set("ranges", Ranges{0.5F}, {1.0, 2.0, 3.0});
    user.push("queue", Point{10.0, 0.0});
    user.push("inbox", Point{});
    SLATE_CHECK(user.tick() == Outcome::Ok);
    SLATE_CHECK(user.output<Point>("sum")->x == 12.25);
    SLATE_CHECK(user.output<Ranges>("doubled")->resolution == 0.5F);
    SLATE_CHECK(user.output_tail<Ranges>("doubled") == std::vector<double>({2.0, 4.0, 6.0}));
    SLATE_CHECK(user.output<Point>("debug")->y == 4.0);
    SLATE_CHECK(user.priority("command") == slate::Priority::Reflex);
    SLATE_CHECK(user.sent<Point>("outbox").size() == 2 && user.sent<Point>("outbox")[1].x == 3.0);
    SLATE_CHECK(user.log().back() == "made a step\x1fsum=12.25\x1fgear=first\x1fmoved=false");
    user.set("ranges", Ranges{}, std::vector<double>(5));
    user.tick();
    SLATE_CHECK(!user.output<Ranges>("doubled"));
    user.expire("everything");
    SLATE_CHECK(user.tick() == Outcome::Degraded);
    SLATE_CHECK(!user.output<Point>("sum"));
}

void throws_as_a_failure() {
    slate::testing::Fixture<User> user;
    user.set("everything", Everything{});
    user.params().fails = true;
    const auto result = user.tick();
    SLATE_CHECK(result.outcome == Outcome::Failed && has(result.error, "threw an exception: the motor does not answer"));
    slate::testing::Fixture<Thrower> thrower;
    SLATE_CHECK(has(thrower.tick().error, "not a std::exception"));
}

void keeps_its_state() {
    slate::testing::Fixture<User> user, other;
    user.set("everything", Everything{});
    user.tick();
    const std::string state = user.save();
    other.restore(state);
    SLATE_CHECK(other.save() == state);
    SLATE_CHECK(has(state, "user"));
    for (std::size_t length = 0; length < state.size(); ++length) {
        SLATE_CHECK(thrown([&] { other.restore(state.substr(0, length)); }) != "nothing");
    }
    for (std::size_t i = 0; i < state.size(); ++i) {
        for (const int flip : {1, 0x20, 0x80, 0xff}) {
            std::string damaged = state;
            damaged[i] = static_cast<char>(damaged[i] ^ flip);
            thrown([&] { other.restore(damaged); });
        }
    }
    const std::string missing = thrown([&] { other.restore("\xa1\x63sum\xfb" + std::string(8, '\0')); });
    SLATE_CHECK(missing == "its state does not fit: it has no field `count`");
    slate::testing::Fixture<Thrower> thrower;
    thrower.restore("42");
    SLATE_CHECK(thrower.save() == "42");
    SLATE_CHECK(thrown([&] { thrower.restore("x"); }) != "nothing" && thrower.save() == "42");
}

void refuses_in_words() {
    using Fixture = slate::testing::Fixture<User>;
    SLATE_CHECK(thrown([] { Fixture({0.5, -1, false}); }) == "limit: expected 0 or more");
    Fixture user;
    SLATE_CHECK(has(thrown([&] { user.set("sum", Everything{}); }), "port `sum` carries Point, not Everything"));
    SLATE_CHECK(has(thrown([&] { user.expire("nothing"); }), "no port `nothing`; expected one of everything, ranges"));
    Everything everything{};
    everything.nested.x = 200.0;
    user.set("everything", everything);
    user.may_unload();
    user.tick();
    SLATE_CHECK(thrown([&] { user.may_unload(); }) == "the arm is raised");
    SLATE_CHECK(thrown([] { slate::testing::Fixture<SwappedReader>{}; }) ==
                "field `y` of Swapped is at byte 8 of the struct, but its place in the description makes 0: describe the fields in "
                "the order of the members");
}

void stores_values_in_place() {
    slate::Text<8> text = "käfer und mehr";
    SLATE_CHECK(text.view() == "käfer u" && slate::Text<4>("aaaä").view() == "aaa");
    slate::Sequence<int, 2> two;
    SLATE_CHECK(two.push_back(1) && two.push_back(2) && !two.push_back(3) && two.size() == 2);
    slate::Optional<double> none, some = 2.0;
    SLATE_CHECK(!none && *some == 2.0 && none.value_or(3.0) == 3.0);
#if __has_include(<Eigen/Core>)
    std::array<double, 4> values = {1.0, 2.0, 3.0, 4.0};
    slate::eigen::matrix<2, 2>(values)(0, 1) = 5.0;
    const auto &read = values;
    SLATE_CHECK(values[1] == 5.0 && slate::eigen::vector(read).sum() == 13.0 && slate::eigen::matrix<2, 2>(read).trace() == 5.0);
    SLATE_CHECK(slate::eigen::vector(two).prod() == 2 && slate::eigen::vector(slate::Span<double>(values.data(), 2)).sum() == 6.0);
#endif
}

int main() {
    uses_every_port();
    throws_as_a_failure();
    keeps_its_state();
    refuses_in_words();
    stores_values_in_place();
    // What the agent would read, for the test that compares it.
    std::printf("DESCRIPTION %s\nOUTLINE %s\n", slate::detail::description<User>().c_str(), slate_outline.data());
}

// The controller of `controller.rs`, statement by statement.

#include <slate.hpp>

struct Pose {
    double x, y, theta;

    static constexpr auto interface() {
        return slate::interface("Pose", "Position and heading.", slate::field<&Pose::x>("x", "m"), slate::field<&Pose::y>("y", "m"),
                                slate::field<&Pose::theta>("theta", "rad"));
    }
};

struct Twist {
    double linear, angular;

    static constexpr auto interface() {
        return slate::interface("Twist", "Velocity.", slate::field<&Twist::linear>("linear", "m/s"),
                                slate::field<&Twist::angular>("angular", "rad/s"));
    }
};

/// Proportional-integral control of a pose.
struct Controller {
    static constexpr const char *name = "controller";
    static constexpr slate::Stage stage = slate::Stage::Act;

    struct Io {
        slate::Required<Pose> pose;
        slate::Required<Pose> target;
        slate::Input<Twist> feedforward;
        slate::Output<Twist> twist;

        static constexpr auto ports() {
            using namespace std::chrono_literals;
            return slate::ports(slate::port<&Io::pose>("pose").stale_after(200ms), slate::port<&Io::target>("target"),
                                slate::port<&Io::feedforward>("feedforward").stale_after(200ms), slate::port<&Io::twist>("twist"));
        }
    };
    struct Params {
        double gain, integral_gain, max_linear_velocity;

        static constexpr auto params() {
            using slate::param;
            return slate::params(param<&Params::gain>("gain", 0.8), param<&Params::integral_gain>("integral_gain", 0.1),
                                 param<&Params::max_linear_velocity>("max_linear_velocity", 1.0));
        }
    };
    struct State {
        double integral = 0.0;
        std::uint64_t steps = 0;

        static constexpr auto fields() {
            return slate::fields(slate::field<&State::integral>("integral"), slate::field<&State::steps>("steps"));
        }
    };

    static slate::Outcome tick(State &state, const Io &io, const Params &params, const slate::Tick &now) {
        const Pose *pose = io.pose.fresh();
        if (pose == nullptr) {
            return slate::Outcome::Degraded;
        }
        const double error = io.target->x - pose->x;
        state.integral += error * now.elapsed();
        state.steps += 1;
        const Twist *feedforward = io.feedforward.fresh();
        const double base = feedforward == nullptr ? 0.0 : feedforward->linear;
        const double linear = base + params.gain * error + params.integral_gain * state.integral;
        const double most = params.max_linear_velocity;
        io.twist.set({linear > most ? most : linear, params.gain * (io.target->theta - pose->theta)});
        return slate::Outcome::Ok;
    }
};

SLATE_MODULES(controller, "0.1.0", Controller);

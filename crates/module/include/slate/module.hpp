/// @file
/// Modules: a pure step over inputs, outputs and parameters that the host owns, and a state that it saves and restores.

#pragma once

#include "ports.hpp"
#include "state.hpp"

namespace slate {

/// Stages of the main loop, in order.
enum class Stage {
    PreLoop,
    SensorAcquire,
    SensorPrepare,
    SensorProcess,
    WorldState,
    Think,
    Skill,
    Act,
    ActExec,
    PostLoop,
};

/// Outcome of a tick.
enum class Outcome : std::int32_t {
    /// Intended result.
    Ok = SLATE_OUTCOME_OK,
    /// Degraded result, such as with a stale input; the reason belongs in the log.
    Degraded = SLATE_OUTCOME_DEGRADED,
    /// Failure; its outputs are dropped, and outputs with a safe value take that.
    Failed = SLATE_OUTCOME_FAILED,
};

/// Refusal in words, such as of a setup or of unloading: `throw slate::Refusal("the arm is raised");`.
class Refusal : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// Ports, parameters or state of a module without any.
struct Nothing {
    static constexpr std::tuple<> ports() { return {}; }
    static constexpr std::tuple<> params() { return {}; }
};

/// Setup of a module.
struct Setup {
    /// Name of the module in the agent, such as `r2/planner`.
    std::string_view name;
    /// Seed of the run.
    std::uint64_t seed;
    /// Period of the main loop.
    std::chrono::nanoseconds period;
};

/// Parameter, which users may tune; `param` makes it.
template <auto Member>
struct Parameter {
    using Type = typename Field<Member>::Type;

    Field<Member> field;
    Type value;
    bool has_range = false;
    double low = 0.0, high = 0.0;

    /// Declares the smallest and the largest value.
    [[nodiscard]] constexpr Parameter range(double lowest, double highest) const {
        Parameter copy = *this;
        copy.has_range = true;
        copy.low = lowest;
        copy.high = highest;
        return copy;
    }
    /// Declares the unit, such as `m/s`.
    [[nodiscard]] constexpr Parameter unit(const char *name) const {
        Parameter copy = *this;
        copy.field.unit = name;
        return copy;
    }
    /// Declares the documentation.
    [[nodiscard]] constexpr Parameter doc(const char *text) const {
        Parameter copy = *this;
        copy.field.doc = text;
        return copy;
    }
};

/// Returns a parameter with its default: `param<&Params::gain>("gain", 0.5).range(0.0, 1.0).unit("1/s")`.
template <auto Member>
constexpr Parameter<Member> param(const char *name, typename Field<Member>::Type value) {
    return {field<Member>(name), value};
}

/// Returns the parameters of a module, in the order of the members of its `Params`.
template <typename... Parameters>
constexpr std::tuple<Parameters...> params(Parameters... parameters) {
    return {parameters...};
}

/// Trigger of a module; `every` and `on` make it.
struct Trigger {
    std::int64_t period = 0, timeout = 0;
    std::array<const char *, 8> ports{};
};

/// Returns the trigger of a period.
constexpr Trigger every(std::chrono::nanoseconds period) { return {period.count(), 0, {}}; }

/// Returns the trigger of new values of ports, and of a time without any: `on(1s, "scan", "goal")`.
template <typename... Ports>
constexpr Trigger on(std::chrono::nanoseconds timeout, Ports... ports) {
    return {0, timeout.count(), {ports...}};
}

} // namespace slate

/// @file
/// Descriptions of modules, which the agent reads as JSON, and outlines of libraries.

#pragma once

#include "module.hpp"

namespace slate {

namespace detail {

constexpr const char *stage_name(Stage stage) {
    constexpr const char *names[] = {"PreLoop", "SensorAcquire", "SensorPrepare", "SensorProcess", "WorldState",
                                     "Think",   "Skill",         "Act",           "ActExec",       "PostLoop"};
    return names[static_cast<int>(stage)];
}

constexpr const char *direction_name(SlateDirection direction) {
    constexpr const char *names[] = {"Input", "Queue", "Output", "Debug", "Command", "Inbox", "Outbox"};
    return names[direction];
}

template <typename M, typename = void>
struct DocOf {
    static constexpr const char *value = "";
};
template <typename M>
struct DocOf<M, std::void_t<decltype(M::doc)>> {
    static constexpr const char *value = M::doc;
};

template <typename M, typename = void>
struct HasTrigger : std::false_type {};
template <typename M>
struct HasTrigger<M, std::void_t<decltype(M::trigger)>> : std::true_type {};

template <typename M, typename = void>
struct HasDeadline : std::false_type {};
template <typename M>
struct HasDeadline<M, std::void_t<decltype(M::deadline)>> : std::true_type {};

template <typename M, typename = void>
struct HasUnique : std::false_type {};
template <typename M>
struct HasUnique<M, std::void_t<decltype(M::unique)>> : std::true_type {};

template <typename M, typename = void>
struct HasCreate : std::false_type {};
template <typename M>
struct HasCreate<M, std::void_t<decltype(M::create(std::declval<const Setup &>(), std::declval<const typename M::Params &>()))>>
    : std::true_type {};

template <typename M, typename = void>
struct HasSave : std::false_type {};
template <typename M>
struct HasSave<M, std::void_t<decltype(M::save(std::declval<const typename M::State &>()))>> : std::true_type {};

template <typename M, typename = void>
struct HasMayUnload : std::false_type {};
template <typename M>
struct HasMayUnload<M, std::void_t<decltype(M::may_unload(std::declval<const typename M::State &>()))>> : std::true_type {};

/// Layout of a struct of parameters.
template <typename P>
struct ParamsSchema {
    static constexpr auto parameters = P::params();
    static constexpr auto fields =
        std::apply([](const auto &...parameter) { return std::tuple(parameter.field...); }, parameters);
    static constexpr Layout layout = Layout::of("Params", fields);
    static constexpr bool is_empty = std::tuple_size_v<decltype(fields)> == 0;
    static_assert(std::is_trivially_copyable_v<P>, "parameters are plain data");
    static_assert(is_empty || layout.fixed == sizeof(P), "all members of Params are listed as parameters");
};

/// Writes a value as JSON.
template <typename Out, typename T>
void write_value(Out &out, const T &value) {
    if constexpr (std::is_same_v<T, Bool>) {
        raw(out, value ? "true" : "false");
    } else if constexpr (std::is_enum_v<T>) {
        number(out, static_cast<std::underlying_type_t<T>>(value));
    } else if constexpr (std::is_arithmetic_v<T>) {
        number(out, value);
    } else if constexpr (std::is_convertible_v<T, std::string_view>) {
        quoted(out, value);
    } else {
        char before = '[';
        for (const auto &item : value) {
            out.put(before);
            write_value(out, item);
            before = ',';
        }
        raw(out, before == '[' ? "[]" : "]");
    }
}

template <typename Out, typename Port>
[[gnu::cold, gnu::noinline]] void write_port(Out &out, const Port &port) {
    using T = typename Port::Value;
    raw(out, "{\"name\":");
    quoted(out, port.name);
    key(out, "doc");
    quoted(out, port.doc);
    key(out, "direction");
    quoted(out, direction_name(Port::Type::direction));
    key(out, "interface");
    Schema<T>::write(out);
    if (Port::Type::is_required) {
        raw(out, ",\"required\":true");
    }
    if (*port.role_name != 0) {
        key(out, "role");
        quoted(out, port.role_name);
    }
    const auto positive = [&out](const char *name, auto value) {
        if (value > 0) {
            key(out, name);
            number(out, value);
        }
    };
    positive("stale_after", port.stale_ns);
    positive("capacity", port.tail_capacity);
    positive("window", port.window_length);
    if (port.has_safe) {
        std::array<std::uint8_t, Schema<T>::layout.size> bytes{};
        std::memcpy(bytes.data(), &port.safe_value, std::min(sizeof(T), bytes.size()));
        key(out, "safe");
        write_value(out, bytes);
    }
    out.put('}');
}

template <typename Out, typename P>
[[gnu::cold, gnu::noinline]] void write_params(Out &out) {
    using Of = ParamsSchema<P>;
    if constexpr (!Of::is_empty) {
        check_order<P>("Params", Of::fields);
        key(out, "params");
        write_interface(out, "Params", "", Of::fields, Of::layout.hash);
        key(out, "parameters");
        char before = '[';
        const auto one = [&](const auto &parameter) {
            out.put(before);
            raw(out, "{\"name\":");
            quoted(out, parameter.field.name);
            key(out, "default");
            write_value(out, parameter.value);
            if (parameter.has_range) {
                key(out, "range");
                write_value(out, std::array<double, 2>{parameter.low, parameter.high});
            }
            out.put('}');
            before = ',';
        };
        std::apply([&one](const auto &...parameter) { (one(parameter), ...); }, Of::parameters);
        out.put(']');
    }
}

template <typename Out>
void write_trigger(Out &out, const Trigger &trigger) {
    key(out, "trigger");
    if (trigger.period > 0) {
        raw(out, "{\"Every\":");
        number(out, trigger.period);
        out.put('}');
        return;
    }
    raw(out, "{\"On\":{\"ports\":");
    char before = '[';
    for (const char *port : trigger.ports) {
        if (port != nullptr) {
            out.put(before);
            quoted(out, port);
            before = ',';
        }
    }
    out.put(']');
    if (trigger.timeout > 0) {
        key(out, "timeout");
        number(out, trigger.timeout);
    }
    raw(out, "}}");
}

/// Writes the description of a module as the agent reads it.
template <typename M>
[[gnu::cold, gnu::noinline]] std::string description() {
    Growing out;
    raw(out, "{\"stage\":");
    quoted(out, stage_name(M::stage));
    key(out, "ports");
    out.put('[');
    bool is_first = true;
    const auto one = [&](const auto &port) {
        if (!is_first) {
            out.put(',');
        }
        write_port(out, port);
        is_first = false;
    };
    constexpr auto ports = M::Io::ports();
    std::apply([&one](const auto &...port) { (one(port), ...); }, ports);
    out.put(']');
    write_params<Growing, typename M::Params>(out);
    if constexpr (HasTrigger<M>::value) {
        write_trigger(out, M::trigger);
    }
    if constexpr (HasDeadline<M>::value) {
        key(out, "deadline");
        number(out, std::chrono::nanoseconds(M::deadline).count());
    }
    if constexpr (HasUnique<M>::value) {
        key(out, "unique");
        quoted(out, M::unique);
    }
    out.put('}');
    return std::move(out.text);
}

template <typename Out>
constexpr void write_carried(Out &out, const char *name, std::uint64_t hash) {
    raw(out, "\"interface\":");
    quoted(out, name);
    key(out, "schema");
    out.put('"');
    hexadecimal(out, hash);
    out.put('"');
}

template <typename M, typename Out>
constexpr void outline_module(Out &out, bool is_first) {
    raw(out, is_first ? "{\"name\":" : ",{\"name\":");
    quoted(out, M::name);
    key(out, "doc");
    quoted(out, DocOf<M>::value);
    key(out, "stage");
    quoted(out, stage_name(M::stage));
    if constexpr (!ParamsSchema<typename M::Params>::is_empty) {
        key(out, "params");
        out.put('{');
        write_carried(out, "Params", ParamsSchema<typename M::Params>::layout.hash);
        out.put('}');
    }
    key(out, "ports");
    bool is_first_port = true;
    const auto one = [&](const auto &port) {
        using Port = std::decay_t<decltype(port)>;
        raw(out, is_first_port ? "{\"name\":" : ",{\"name\":");
        quoted(out, port.name);
        key(out, "direction");
        quoted(out, direction_name(Port::Type::direction));
        out.put(',');
        write_carried(out, Schema<typename Port::Value>::description.name, Schema<typename Port::Value>::hash);
        out.put('}');
        is_first_port = false;
    };
    out.put('[');
    constexpr auto ports = M::Io::ports();
    std::apply([&one](const auto &...port) { (one(port), ...); }, ports);
    raw(out, "]}");
}

/// Writes the outline of a library, which hosts read before they open it.
template <typename... Modules, typename Out>
constexpr void write_outline(Out &out, const char *plugin, const char *version) {
    raw(out, "{\"abi\":");
    whole(out, SLATE_ABI);
    raw(out, ",\"symbol\":\"slate_plugin_");
    raw(out, plugin);
    raw(out, "\",\"name\":");
    quoted(out, plugin);
    key(out, "version");
    quoted(out, version);
    raw(out, ",\"depends\":[],\"modules\":[");
    bool is_first = true;
    ((outline_module<Modules>(out, is_first), is_first = false), ...);
    raw(out, "]}");
    out.put('\0');
}

template <typename... Modules>
constexpr std::size_t outline_length(const char *plugin, const char *version) {
    Counter out;
    write_outline<Modules...>(out, plugin, version);
    return out.length;
}

template <std::size_t N, typename... Modules>
constexpr std::array<char, N> outline(const char *plugin, const char *version) {
    Characters<N> out;
    write_outline<Modules...>(out, plugin, version);
    return out.bytes;
}

} // namespace detail

} // namespace slate

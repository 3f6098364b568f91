/// @file
/// Plugins: the calls by which a host drives modules. No exception leaves them.

#pragma once

#include <exception>
#include <memory>

#include "description.hpp"

namespace slate {

namespace detail {

/// Refuses a frame that was not filled for this module.
[[noreturn, gnu::cold, gnu::noinline]] inline void wrong_frame() {
    throw std::logic_error("the host fills a frame with a slot for every port, in the order of the description");
}

template <typename Port>
void bind_port(Port &port, SlatePortSlot *slot, std::uint64_t schema) {
    if (slot->schema != schema || slot->direction != Port::direction) {
        wrong_frame();
    }
    port.bind(slot);
}

/// Binds the ports of a tick.
template <typename Io, typename... Ports>
Io bind(const SlateFrame *frame, const std::tuple<Ports...> &) {
    static_assert(sizeof...(Ports) == 0 || sizeof(Io) == sizeof...(Ports) * sizeof(void *), "all members of Io are listed as ports");
    Io io{};
    if (frame->port_count < sizeof...(Ports)) {
        wrong_frame();
    }
    [[maybe_unused]] SlatePortSlot *slot = frame->ports;
    (bind_port(io.*Ports::member, slot++, Schema<typename Ports::Value>::hash), ...);
    return io;
}

/// Logs the exception that is being handled, without allocating.
[[gnu::cold, gnu::noinline]] inline std::int32_t log_exception(const SlateFrame *frame) noexcept {
    const auto log = [frame](const char *reason) {
        char line[512] = "threw an exception: ";
        std::strncat(line, reason, sizeof line - std::strlen(line) - 1);
        Tick(frame).error(line);
    };
    try {
        throw;
    } catch (const std::exception &error) {
        log(error.what());
    } catch (...) {
        log("not a std::exception");
    }
    return SLATE_PANICKED;
}

/// Runs a call, and writes its bytes or the reason of its exception.
template <typename Call>
[[gnu::cold, gnu::noinline]] std::int32_t answer(const SlateSink *sink, Call &&call) noexcept {
    try {
        const std::string bytes = call();
        slate_write(sink, bytes.data(), bytes.size());
        return SLATE_DONE;
    } catch (const std::exception &error) {
        return slate_refuse(sink, error.what());
    } catch (...) {
        return slate_refuse(sink, "threw an exception that is not a std::exception");
    }
}

inline std::string_view view(SlateBytes bytes) {
    return bytes.data == nullptr ? std::string_view() : std::string_view(reinterpret_cast<const char *>(bytes.data), bytes.length);
}

/// Calls of a module for its host. No exception leaves them.
template <typename M>
struct ModuleCalls {
    using State = typename M::State;
    using Params = typename M::Params;
    using Io = typename M::Io;

    static std::int32_t describe(const SlateSetupTable *, const SlateSink *sink) noexcept {
        return answer(sink, description<M>);
    }

    static std::int32_t create(const SlateSetupTable *setup, SlateBytes bytes, void **instance, const SlateSink *sink) noexcept {
        return answer(sink, [=] {
            Params params{};
            if constexpr (!ParamsSchema<Params>::is_empty) {
                if (bytes.length != sizeof params) {
                    throw Refusal(std::to_string(bytes.length) + " bytes of parameters, expected " + std::to_string(sizeof params));
                }
                std::memcpy(static_cast<void *>(&params), bytes.data, sizeof params);
            }
            if constexpr (HasCreate<M>::value) {
                const Setup own{view(setup->name), setup->seed, std::chrono::nanoseconds(static_cast<std::int64_t>(setup->period))};
                *instance = new State(M::create(own, params));
            } else {
                *instance = new State{};
            }
            return std::string();
        });
    }

    static std::int32_t tick(void *instance, const SlateFrame *frame) noexcept {
        try {
            const Io io = bind<Io>(frame, ports);
            const Params &params = *reinterpret_cast<const Params *>(frame->params);
            return static_cast<std::int32_t>(M::tick(*static_cast<State *>(instance), io, params, Tick(frame)));
        } catch (...) {
            return log_exception(frame);
        }
    }

    static std::int32_t save(const void *instance, const SlateSink *sink) noexcept {
        return answer(sink, [=] {
            const State &state = *static_cast<const State *>(instance);
            if constexpr (HasSave<M>::value) {
                return std::string(M::save(state));
            } else if constexpr (std::is_empty_v<State>) {
                return std::string();
            } else {
                static_assert(HasFields<State>::value,
                              "a state lists its members in a static function `fields`, or the module has `save` and `restore`");
                StateWriter writer;
                writer.write(state);
                return writer.finish();
            }
        });
    }

    static std::int32_t restore(void *instance, SlateBytes bytes, const SlateSink *sink) noexcept {
        return answer(sink, [=] {
            // The present state is kept until the other one is there.
            if constexpr (HasSave<M>::value) {
                *static_cast<State *>(instance) = M::restore(view(bytes));
            } else if constexpr (!std::is_empty_v<State>) {
                *static_cast<State *>(instance) = StateReader(view(bytes)).template whole<State>();
            }
            return std::string();
        });
    }

    static std::int32_t may_unload(const void *instance, const SlateSink *sink) noexcept {
        return answer(sink, [=] {
            if constexpr (HasMayUnload<M>::value) {
                M::may_unload(*static_cast<const State *>(instance));
            }
            return std::string();
        });
    }

    static std::int32_t destroy(void *instance, const SlateSink *sink) noexcept {
        return answer(sink, [=] {
            std::unique_ptr<State>(static_cast<State *>(instance)).reset();
            return std::string();
        });
    }

    static constexpr auto ports = Io::ports();
};

/// Returns the table of a module.
template <typename M>
SlateModuleTable module_table() {
    using Calls = ModuleCalls<M>;
    return {slate_text(M::name), slate_text(DocOf<M>::value), {nullptr, 0},    Calls::describe, Calls::create,
            Calls::tick,         Calls::save,                 Calls::restore, Calls::may_unload, Calls::destroy};
}

template <typename... Modules>
std::array<SlateModuleTable, sizeof...(Modules)> module_tables() {
    return {module_table<Modules>()...};
}

} // namespace detail

} // namespace slate

/// Makes the library a plugin with those modules, once per library: `SLATE_MODULES(follower, "0.1.0", Follower)`.
#define SLATE_MODULES(plugin, version, ...)                                                                        \
    __attribute__((used, section(".slate"))) static constexpr auto slate_outline =                                 \
        ::slate::detail::outline<::slate::detail::outline_length<__VA_ARGS__>(#plugin, version), __VA_ARGS__>(     \
            #plugin, version);                                                                                     \
    static const auto slate_modules = ::slate::detail::module_tables<__VA_ARGS__>();                               \
    SLATE_EXPORT const SlatePluginTable slate_plugin_##plugin;                                                     \
    const SlatePluginTable slate_plugin_##plugin = {SLATE_ABI, sizeof(SlateModuleTable), slate_modules.data(),     \
                                                    slate_modules.size()}

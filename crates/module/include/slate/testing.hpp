/// @file
/// Tests of modules without an agent: a fixture feeds inputs, makes steps and reads outputs.

#pragma once

#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>

#include "plugin.hpp"

namespace slate::testing {

/// Result of a step.
struct TickResult {
    /// Outcome; `Failed` after an exception, and `Ok` of a step that was not made.
    Outcome outcome = Outcome::Ok;
    /// Required input that has no value; empty when the step was made.
    std::string waiting_for;
    /// Message of the exception that ended the step; empty for none.
    std::string error;

    friend bool operator==(const TickResult &result, Outcome outcome) {
        return result.waiting_for.empty() && result.error.empty() && result.outcome == outcome;
    }
};

/// Module on its own, driven by the calls that an agent makes.
///
///     slate::testing::Fixture<Doubler> doubler;
///     doubler.set("input", Number{1.5});
///     SLATE_CHECK(doubler.tick() == slate::Outcome::Ok);
///     SLATE_CHECK(doubler.output<Number>("doubled")->value == 3.0);
template <typename M>
class Fixture {
public:
    /// Creates an instance with default parameters, seed 0, at time 0; throws the module's refusal.
    Fixture() : Fixture(defaults()) {}

    /// Creates an instance with those parameters; throws the module's refusal.
    explicit Fixture(const typename M::Params &values) : params_(values) {
        const SlateSetupTable setup = {slate_text(M::name), 0, 20000000, {nullptr, 0}, {nullptr, 0}};
        answered([&](const SlateSink *sink) { return table_.describe(&setup, sink); });
        const SlateBytes bytes = {reinterpret_cast<const std::uint8_t *>(&params_), sizeof params_};
        answered([&](const SlateSink *sink) { return table_.create(&setup, bytes, &instance_, sink); });
        constexpr auto ports = M::Io::ports();
        std::apply([this](const auto &...port) { (this->add(port), ...); }, ports);
        seed(random_, M::name);
    }
    Fixture(const Fixture &) = delete;
    Fixture &operator=(const Fixture &) = delete;
    ~Fixture() {
        const SlateSink sink = {nullptr, [](void *, const std::uint8_t *, std::size_t) {}};
        table_.destroy(instance_, &sink);
    }

    /// Sets an input.
    template <typename T>
    void set(std::string_view port, const T &value) {
        write(typed<T>(port), bytes_of(value, 0, nullptr), 0);
    }
    /// Sets an input whose value has a tail.
    template <typename T>
    void set(std::string_view port, const T &value, const std::vector<detail::Item<T>> &tail) {
        write(typed<T>(port), bytes_of(value, tail.size(), tail.data()), tail.size());
    }
    /// Puts a message into an inbox, or a value into a queue.
    template <typename T>
    void push(std::string_view port, const T &value) {
        typed<T>(port).messages.push_back(bytes_of(value, 0, nullptr));
    }
    /// Makes an input stale, as when its writer stopped.
    void expire(std::string_view port) { of(port).is_stale = true; }
    /// Parameters, which may be changed between two steps.
    typename M::Params &params() { return params_; }
    /// Advances the time.
    void advance(std::chrono::nanoseconds time) { now_ += static_cast<std::uint64_t>(time.count()); }

    /// Makes one step, or says which required input has no value.
    TickResult tick() {
        TickResult result;
        for (Memory &memory : ports_) {
            memory.is_set = false;
            memory.sent.clear();
            if (memory.is_required && memory.stamp.sequence == 0) {
                result.waiting_for = memory.name;
                return result;
            }
        }
        std::vector<SlatePortSlot> slots;
        for (Memory &memory : ports_) {
            slots.push_back(slot(memory));
        }
        const SlateHost host = {this, log};
        const SlateFrame frame = {slots.data(),
                                  slots.size(),
                                  reinterpret_cast<const std::uint8_t *>(&params_),
                                  sizeof params_,
                                  1,
                                  now_,
                                  number_ == 0 ? 0 : now_ - last_,
                                  number_ + 1,
                                  &random_,
                                  &host};
        const std::int32_t code = table_.tick(instance_, &frame);
        ++number_;
        last_ = now_;
        for (std::size_t i = 0; i < slots.size(); ++i) {
            take(ports_[i], slots[i]);
        }
        result.outcome = code == SLATE_PANICKED ? Outcome::Failed : static_cast<Outcome>(code);
        result.error = code == SLATE_PANICKED ? log_.back() : "";
        return result;
    }

    /// Returns the value of an output in the last step; nothing if it was not written.
    template <typename T>
    std::optional<T> output(std::string_view port) {
        Memory &memory = typed<T>(port);
        if (!memory.is_set) {
            return std::nullopt;
        }
        T value{};
        std::memcpy(static_cast<void *>(&value), memory.words.data(), sizeof value);
        return value;
    }
    /// Returns the tail of an output in the last step.
    template <typename T>
    std::vector<detail::Item<T>> output_tail(std::string_view port) {
        Memory &memory = typed<T>(port);
        std::vector<detail::Item<T>> tail(memory.is_set ? memory.items : 0);
        if (!tail.empty()) {
            const auto *bytes = reinterpret_cast<const std::uint8_t *>(memory.words.data());
            std::memcpy(tail.data(), bytes + detail::Schema<T>::layout.size, tail.size() * sizeof(detail::Item<T>));
        }
        return tail;
    }
    /// Returns the messages that the last step sent.
    template <typename T>
    std::vector<T> sent(std::string_view port) {
        std::vector<T> all;
        for (const Words &words : typed<T>(port).sent) {
            T value{};
            std::memcpy(static_cast<void *>(&value), words.data(), sizeof value);
            all.push_back(value);
        }
        return all;
    }
    /// Returns the priority with which the last step sent a command; nothing if it sent none.
    std::optional<Priority> priority(std::string_view port) {
        const Memory &memory = of(port);
        return memory.is_set ? std::optional(static_cast<Priority>(memory.priority)) : std::nullopt;
    }
    /// Returns the messages of the log so far, with their fields after the character 31.
    [[nodiscard]] const std::vector<std::string> &log() const { return log_; }

    /// Saves the module's state.
    std::string save() {
        return answered([this](const SlateSink *sink) { return table_.save(instance_, sink); });
    }
    /// Restores a saved state; throws for one that does not fit.
    void restore(const std::string &state) {
        const SlateBytes bytes = {reinterpret_cast<const std::uint8_t *>(state.data()), state.size()};
        answered([&](const SlateSink *sink) { return table_.restore(instance_, bytes, sink); });
    }
    /// Throws the reason why the module can't be unloaded now, if it has one.
    void may_unload() {
        answered([this](const SlateSink *sink) { return table_.may_unload(instance_, sink); });
    }

private:
    /// Aligned memory of a value.
    using Words = std::vector<std::max_align_t>;

    struct Memory {
        std::string name;
        std::uint64_t schema;
        const char *interface;
        SlateDirection direction;
        bool is_required;
        std::size_t size, item, capacity, window;
        Words words;
        std::size_t items = 0;
        SlateStamp stamp{};
        bool is_new = false, is_stale = false, is_set = false;
        std::uint32_t priority = 0;
        /// Values of a queue, and messages of an inbox or an outbox.
        std::vector<Words> messages, sent;
        std::vector<SlateEntry> entries;
    };

    static typename M::Params defaults() {
        typename M::Params values{};
        constexpr auto parameters = M::Params::params();
        const auto one = [&values](const auto &parameter) { values.*std::decay_t<decltype(parameter.field)>::member = parameter.value; };
        std::apply([&one](const auto &...parameter) { (one(parameter), ...); }, parameters);
        return values;
    }

    /// Makes the stream of a name, as an agent does with seed 0.
    static void seed(SlateRandom &random, std::string_view name) {
        std::uint64_t hash = 0xcbf29ce484222325U;
        for (const char byte : name) {
            hash = detail::hash_byte(hash, static_cast<std::uint8_t>(byte));
        }
        for (std::uint64_t &word : random.state) {
            hash += 0x9e3779b97f4a7c15U;
            std::uint64_t z = hash;
            z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9U;
            z = (z ^ (z >> 27U)) * 0x94d049bb133111ebU;
            word = z ^ (z >> 31U);
        }
    }

    /// Makes a call; returns its bytes, or throws its refusal.
    template <typename Call>
    static std::string answered(Call &&call) {
        std::string text;
        const SlateSink sink = {&text, [](void *context, const std::uint8_t *data, std::size_t length) {
                                    static_cast<std::string *>(context)->append(reinterpret_cast<const char *>(data), length);
                                }};
        if (call(&sink) != SLATE_DONE) {
            throw Refusal(text);
        }
        return text;
    }

    static void log(const void *context, std::uint32_t, const std::uint8_t *text, std::size_t length) {
        // The fixture is not constant; only its address crosses the call as if it were.
        auto *self = const_cast<Fixture *>(static_cast<const Fixture *>(context));
        self->log_.emplace_back(reinterpret_cast<const char *>(text), length);
        std::printf("%s\n", self->log_.back().c_str());
    }

    static Words room(std::size_t bytes) { return Words(bytes / sizeof(std::max_align_t) + 1); }

    template <typename Port>
    void add(const Port &port) {
        using Of = detail::Schema<typename Port::Value>;
        Memory memory{};
        memory.name = port.name;
        memory.schema = Of::hash;
        memory.interface = Of::description.name;
        memory.direction = Port::Type::direction;
        memory.is_required = Port::Type::is_required;
        memory.size = Of::layout.size;
        memory.item = Of::layout.item;
        memory.capacity = memory.item == 0 ? 0 : port.tail_capacity > 0 ? port.tail_capacity : 1024;
        memory.window = port.window_length > 0 ? port.window_length : 16;
        memory.words = room(memory.size + memory.capacity * memory.item);
        ports_.push_back(std::move(memory));
    }

    Memory &of(std::string_view port) {
        std::string names;
        for (Memory &memory : ports_) {
            if (memory.name == port) {
                return memory;
            }
            names += (names.empty() ? "" : ", ") + memory.name;
        }
        throw std::logic_error("no port `" + std::string(port) + "`; expected one of " + names);
    }

    template <typename T>
    Memory &typed(std::string_view port) {
        Memory &memory = of(port);
        if (memory.schema != detail::Schema<T>::hash) {
            throw std::logic_error("port `" + memory.name + "` carries " + memory.interface + ", not " + detail::Schema<T>::description.name);
        }
        return memory;
    }

    template <typename T>
    static Words bytes_of(const T &value, std::size_t items, const void *tail) {
        using Of = detail::Schema<T>;
        Words words = room(Of::layout.size + items * Of::layout.item);
        std::memcpy(words.data(), &value, sizeof value);
        if (items > 0) {
            std::memcpy(reinterpret_cast<std::uint8_t *>(words.data()) + Of::layout.size, tail, items * Of::layout.item);
        }
        return words;
    }

    void write(Memory &memory, Words words, std::size_t items) {
        memory.words = std::move(words);
        memory.items = items;
        memory.stamp = {memory.stamp.sequence + 1, now_, 1};
        memory.is_new = true;
        memory.is_stale = false;
    }

    SlatePortSlot slot(Memory &memory) {
        const bool is_outbox = memory.direction == SLATE_DIRECTION_OUTBOX;
        if (is_outbox) {
            memory.messages.assign(memory.window, room(memory.size));
        }
        memory.entries.clear();
        for (Words &words : memory.messages) {
            memory.entries.push_back({reinterpret_cast<std::uint8_t *>(words.data()), 0, {memory.entries.size() + 1, now_, 1}, 0, 0});
        }
        // No message has an answer yet, and those of earlier steps are forgotten.
        for (SlateEntry &entry : memory.entries) {
            entry.stamp.sequence = is_outbox ? 0 : entry.stamp.sequence;
        }
        const bool is_input = memory.direction == SLATE_DIRECTION_INPUT;
        const bool is_stale = is_input && (memory.is_stale || memory.stamp.sequence == 0);
        SlatePortSlot slot{};
        slot.schema = memory.schema;
        slot.data = reinterpret_cast<std::uint8_t *>(memory.words.data());
        slot.items = is_input ? memory.items : 0;
        slot.capacity = is_outbox ? memory.window : memory.capacity;
        slot.stamp = memory.stamp;
        slot.flags = (memory.is_new ? SLATE_FLAG_NEW : 0U) | (is_stale ? SLATE_FLAG_STALE : SLATE_FLAG_ALIVE);
        slot.direction = memory.direction;
        slot.entries = memory.entries.data();
        slot.count = is_outbox ? 0 : memory.entries.size();
        return slot;
    }

    static void take(Memory &memory, const SlatePortSlot &slot) {
        memory.is_new = false;
        memory.is_set = (slot.flags & SLATE_FLAG_SET) != 0;
        memory.priority = slot.priority;
        memory.items = slot.items;
        if (memory.direction == SLATE_DIRECTION_OUTBOX) {
            memory.messages.resize(slot.count);
            memory.sent = memory.messages;
            memory.stamp.sequence += slot.count;
        }
        memory.messages.clear();
    }

    SlateModuleTable table_ = detail::module_table<M>();
    typename M::Params params_;
    void *instance_ = nullptr;
    std::vector<Memory> ports_;
    SlateRandom random_{};
    std::uint64_t now_ = 0, last_ = 0, number_ = 0;
    std::vector<std::string> log_;
};

/// Ends the program with a message if a condition does not hold; `SLATE_CHECK` calls it.
inline void check(bool holds, const char *condition, const char *file, int line) {
    if (!holds) {
        std::fprintf(stderr, "%s:%d: does not hold: %s\n", file, line, condition);
        std::exit(1);
    }
}

} // namespace slate::testing

/// Ends the test as failed if a condition does not hold.
#define SLATE_CHECK(...) ::slate::testing::check(static_cast<bool>(__VA_ARGS__), #__VA_ARGS__, __FILE__, __LINE__)

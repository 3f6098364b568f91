/// @file
/// Ports of a module: typed views of the slots of a frame, valid during one tick.

#pragma once

#include <cstring>
#include <iterator>
#include <optional>

#include "interface.hpp"
#include "tick.hpp"

namespace slate {

/// Stamp of a value: its number, the host's time of the write in ns, and the number of its writer.
using Stamp = SlateStamp;

namespace detail {

template <typename T>
using Item = typename Schema<T>::Item;

/// Items of a tail; an interface without one has none.
template <typename T, typename = void>
struct TailSpan {
    using Read = void;
    using Write = void;
};
template <typename T>
struct TailSpan<T, std::enable_if_t<!std::is_void_v<Item<T>>>> {
    using Read = Span<const Item<T>>;
    using Write = Span<Item<T>>;
};

template <typename T>
const T *value_at(const std::uint8_t *data) {
    return reinterpret_cast<const T *>(data);
}

template <typename T>
typename TailSpan<T>::Read tail_at(const std::uint8_t *data, std::size_t items) {
    static_assert(!std::is_void_v<Item<T>>, "this interface has no tail");
    return {reinterpret_cast<const Item<T> *>(data + Schema<T>::layout.size), items};
}

/// Part that all ports share.
template <typename T, SlateDirection Direction>
class Port {
public:
    using Value = T;
    static constexpr SlateDirection direction = Direction;
    static constexpr bool is_required = false;

    /// Refers to the slot of a frame.
    void bind(SlatePortSlot *slot) { slot_ = slot; }

protected:
    [[nodiscard]] bool has(std::uint32_t flag) const { return (slot_->flags & flag) != 0; }

    SlatePortSlot *slot_ = nullptr;
};

/// Part that inputs share.
template <typename T>
class ReadPort : public Port<T, SLATE_DIRECTION_INPUT> {
public:
    /// Returns the value if it was written since this module's last tick, else null.
    [[nodiscard]] const T *updated() const { return is_new() ? value() : nullptr; }
    /// Returns true if the value was written since this module's last tick.
    [[nodiscard]] bool is_new() const { return this->has(SLATE_FLAG_NEW); }
    /// Returns true if the value is older than declared or missing, or its writer is gone or late.
    [[nodiscard]] bool is_stale() const { return this->has(SLATE_FLAG_STALE); }
    /// Returns true if a link writes the property now.
    [[nodiscard]] bool has_writer() const { return this->has(SLATE_FLAG_ALIVE); }
    /// Returns time and number of the value; the sequence is 0 before the first write.
    [[nodiscard]] Stamp stamp() const { return this->slot_->stamp; }
    /// Returns the number of values that this module never saw.
    [[nodiscard]] std::uint64_t missed() const { return this->slot_->missed; }
    /// Returns the items of the value's tail.
    [[nodiscard]] typename TailSpan<T>::Read tail() const { return tail_at<T>(this->slot_->data, this->slot_->items); }

protected:
    [[nodiscard]] bool has_value() const { return this->slot_->stamp.sequence > 0; }
    [[nodiscard]] const T *value() const { return value_at<T>(this->slot_->data); }

    template <typename, SlateDirection>
    friend class WritePort;
};

/// Part that outputs share.
template <typename T, SlateDirection Direction>
class WritePort : public Port<T, Direction> {
protected:
    void put(const T &value) const {
        static_assert(std::is_void_v<Item<T>>, "a value with a tail is written in place: use `write`");
        std::memcpy(this->slot_->data, &value, sizeof(T));
        this->slot_->flags |= SLATE_FLAG_SET;
    }

    /// Writes in place a value that begins all zero; false if its tail exceeds the capacity.
    template <typename Write>
    bool fill(std::size_t items, Write &&write) const {
        using Of = Schema<T>;
        static_assert(!std::is_void_v<Item<T>>, "only a value with a tail is written in place: use `set`");
        if (items > this->slot_->capacity) {
            return false;
        }
        this->slot_->items = items;
        std::uint8_t *data = this->slot_->data;
        std::memset(data, 0, Of::layout.size + items * Of::layout.item);
        auto *tail = reinterpret_cast<Item<T> *>(data + Of::layout.size);
        write(*reinterpret_cast<T *>(data), typename TailSpan<T>::Write{tail, items});
        this->slot_->flags |= SLATE_FLAG_SET;
        return true;
    }

    bool copy_of(const ReadPort<T> &input) const {
        using Of = Schema<T>;
        const SlatePortSlot *from = input.slot_;
        if (from->stamp.sequence == 0 || from->items > this->slot_->capacity) {
            return false;
        }
        this->slot_->items = from->items;
        std::memcpy(this->slot_->data, from->data, Of::layout.size + from->items * Of::layout.item);
        this->slot_->flags |= SLATE_FLAG_SET;
        return true;
    }
};

} // namespace detail

/// Input with the newest value of the linked property, which may not have a value yet.
/// The value is the same during a whole tick.
template <typename T>
class Input : public detail::ReadPort<T> {
public:
    /// Returns the newest value, however old; null before the first write.
    [[nodiscard]] const T *get() const { return this->has_value() ? this->value() : nullptr; }
    /// Returns the newest value unless it is stale; else null.
    [[nodiscard]] const T *fresh() const { return this->has_value() && !this->is_stale() ? this->value() : nullptr; }
};

/// Required input: the module does not run before its first value.
template <typename T>
class Required : public detail::ReadPort<T> {
public:
    static constexpr bool is_required = true;

    [[nodiscard]] const T &operator*() const { return *this->value(); }
    [[nodiscard]] const T *operator->() const { return this->value(); }
    /// Returns the value unless it is stale; else null.
    [[nodiscard]] const T *fresh() const { return this->is_stale() ? nullptr : this->value(); }
};

/// Received value or message, with its stamp.
template <typename T>
class Received {
public:
    /// Refers to an entry of a frame.
    explicit Received(SlateEntry *entry) : entry_(entry) {}

    [[nodiscard]] const T &operator*() const { return *detail::value_at<T>(entry_->data); }
    [[nodiscard]] const T *operator->() const { return detail::value_at<T>(entry_->data); }
    /// Returns the items of the value's tail.
    [[nodiscard]] typename detail::TailSpan<T>::Read tail() const { return detail::tail_at<T>(entry_->data, entry_->items); }
    /// Returns the stamp of the write.
    [[nodiscard]] Stamp stamp() const { return entry_->stamp; }
    /// Returns the number of the message's sender.
    [[nodiscard]] std::uint32_t sender() const { return entry_->sender; }
    /// Refuses the message, with a reason that the interface defines (not 0); its sender receives the reason.
    void refuse(std::uint16_t reason) const { entry_->answer = reason == 0 ? 1 : reason; }

private:
    SlateEntry *entry_;
};

namespace detail {

/// Port with several values in each tick, oldest first.
template <typename T, SlateDirection Direction>
class ManyPort : public Port<T, Direction> {
public:
    /// Iterator over the values.
    class Iterator {
    public:
        using iterator_category = std::input_iterator_tag;
        using value_type = Received<T>;
        using difference_type = std::ptrdiff_t;
        using pointer = const Received<T> *;
        using reference = Received<T>;

        explicit Iterator(SlateEntry *entry) : entry_(entry) {}
        Received<T> operator*() const { return Received<T>(entry_); }
        Iterator &operator++() {
            ++entry_;
            return *this;
        }
        Iterator operator++(int) { return Iterator(entry_++); }
        friend bool operator==(Iterator left, Iterator right) { return left.entry_ == right.entry_; }
        friend bool operator!=(Iterator left, Iterator right) { return left.entry_ != right.entry_; }

    private:
        SlateEntry *entry_;
    };

    [[nodiscard]] Iterator begin() const { return Iterator(this->slot_->entries); }
    [[nodiscard]] Iterator end() const { return Iterator(this->slot_->entries + size()); }
    /// Returns the number of values.
    [[nodiscard]] std::size_t size() const { return this->slot_->entries == nullptr ? 0 : this->slot_->count; }
};

} // namespace detail

/// Queue input with every value of the linked property, in order; at most a window per tick.
template <typename T>
class Queue : public detail::ManyPort<T, SLATE_DIRECTION_QUEUE> {
public:
    /// Returns the number of values that this reader lost because it lagged.
    [[nodiscard]] std::uint64_t missed() const { return this->slot_->missed; }
};

/// Receives messages in the order in which they were sent; one that is not refused counts as done.
template <typename T>
class Inbox : public detail::ManyPort<T, SLATE_DIRECTION_INBOX> {};

/// Writes a property; the only writer it has.
template <typename T>
class Output : public detail::WritePort<T, SLATE_DIRECTION_OUTPUT> {
public:
    /// Writes the property; readers see it after the tick. The last call counts.
    void set(const T &value) const { this->put(value); }
    /// Writes a value with a tail of `items` items in place; it begins all zero. `write` takes `T &` and the span.
    /// False if that exceeds the configured capacity; nothing is written then.
    template <typename Write>
    bool write(std::size_t items, Write &&write) const {
        return this->fill(items, std::forward<Write>(write));
    }
    /// Copies the newest value of an input once, straight into the property.
    /// False without a value, or if its tail exceeds the configured capacity; nothing is written then.
    bool copy(const detail::ReadPort<T> &input) const { return this->copy_of(input); }
    /// Returns the number of tail items that fit.
    [[nodiscard]] std::size_t capacity() const { return this->slot_->capacity; }
};

/// Debug output: writes a property only while somebody reads it.
template <typename T>
class Debug : public detail::WritePort<T, SLATE_DIRECTION_DEBUG> {
public:
    /// Returns true if somebody reads it.
    [[nodiscard]] bool is_read() const { return this->slot_->data != nullptr; }
    /// Computes and writes the value if somebody reads it.
    template <typename Compute>
    void set(Compute &&compute) const {
        if (is_read()) {
            this->put(compute());
        }
    }
    /// Writes a value with a tail in place if somebody reads it; see `Output::write`.
    template <typename Write>
    bool write(std::size_t items, Write &&write) const {
        return is_read() && this->fill(items, std::forward<Write>(write));
    }
};

/// Command priority of an actuator; the highest wins.
enum class Priority : std::uint32_t { Plan = 1, Teleoperation = 2, Reflex = 3 };

/// Output of commands to an actuator. They pass the gate: lease, limits, time to live, stop.
template <typename T>
class Command : public detail::WritePort<T, SLATE_DIRECTION_COMMAND> {
public:
    /// Commands the actuator until the command's time to live ends.
    void send(const T &value, Priority priority) const {
        this->slot_->priority = static_cast<std::uint32_t>(priority);
        this->put(value);
    }
};

/// Delivery state of a sent message.
struct Delivery {
    enum State { Waiting, Done, Refused, Lost } state;
    /// Reason of a refusal, which the interface defines.
    std::uint16_t reason = 0;
};

/// Sends messages to the inbox that it is linked to.
template <typename T>
class Outbox : public detail::Port<T, SLATE_DIRECTION_OUTBOX> {
public:
    /// Sends a message when the tick ends, and returns its number for `delivery`; nothing when no more fit in this tick.
    std::optional<std::uint64_t> send(const T &value) const {
        static_assert(std::is_void_v<detail::Item<T>>, "a message has no tail");
        SlatePortSlot *slot = this->slot_;
        if (slot->count >= slot->capacity) {
            return std::nullopt;
        }
        std::memcpy(slot->entries[slot->count].data, &value, sizeof(T));
        return slot->stamp.sequence + ++slot->count;
    }
    /// Returns the delivery state of a message posted in this tick or an earlier one.
    /// As many are remembered as fit into one tick.
    [[nodiscard]] Delivery delivery(std::uint64_t number) const {
        const SlatePortSlot *slot = this->slot_;
        const std::uint64_t sent = slot->stamp.sequence;
        if (number > sent && number <= sent + slot->count) {
            return {Delivery::Waiting};
        }
        if (number == 0 || slot->entries == nullptr || slot->capacity == 0) {
            return {Delivery::Lost};
        }
        const SlateEntry &entry = slot->entries[(number - 1) % slot->capacity];
        if (entry.stamp.sequence != number || entry.answer == 2) {
            return {Delivery::Lost};
        }
        if (entry.answer >> 16U == 1) {
            return {Delivery::Refused, static_cast<std::uint16_t>(entry.answer)};
        }
        return {entry.answer == 0 ? Delivery::Waiting : entry.answer == 1 ? Delivery::Done : Delivery::Lost};
    }
};

/// Description of a port; `port` makes it.
template <auto Member>
struct PortDescription {
    using Class = typename detail::MemberOf<decltype(Member)>::Class;
    using Type = typename detail::MemberOf<decltype(Member)>::Type;
    using Value = typename Type::Value;
    static constexpr auto member = Member;

    const char *name;
    const char *doc;
    const char *role_name = "";
    std::int64_t stale_ns = 0;
    std::size_t tail_capacity = 0;
    std::size_t window_length = 0;
    bool has_safe = false;
    Value safe_value{};

    /// Declares the age from which an input's value is stale.
    [[nodiscard]] constexpr PortDescription stale_after(std::chrono::nanoseconds age) const {
        PortDescription copy = *this;
        copy.stale_ns = age.count();
        return copy;
    }
    /// Declares the value of an output after a failure, a hang or the end of the module.
    [[nodiscard]] constexpr PortDescription safe(const Value &value) const {
        PortDescription copy = *this;
        copy.has_safe = true;
        copy.safe_value = value;
        return copy;
    }
    /// Declares the role that makes the module a block, such as `percept`.
    [[nodiscard]] constexpr PortDescription role(const char *name) const {
        PortDescription copy = *this;
        copy.role_name = name;
        return copy;
    }
    /// Declares the number of tail items that fit.
    [[nodiscard]] constexpr PortDescription capacity(std::size_t items) const {
        PortDescription copy = *this;
        copy.tail_capacity = items;
        return copy;
    }
    /// Declares the longest window of a queue, or the messages per tick of an inbox or outbox.
    [[nodiscard]] constexpr PortDescription window(std::size_t length) const {
        PortDescription copy = *this;
        copy.window_length = length;
        return copy;
    }
};

/// Returns the description of a port: `port<&Io::scan>("scan", "Ranges.").stale_after(200ms)`.
template <auto Member>
constexpr PortDescription<Member> port(const char *name, const char *doc = "") {
    return {name, doc};
}

/// Returns the ports of a module, in the order of the members of its `Io`.
template <typename... Ports>
constexpr std::tuple<Ports...> ports(Ports... ports) {
    return {ports...};
}

} // namespace slate

/// @file
/// States of modules as CBOR with field names (RFC 8949), for snapshots and reloads.

#pragma once

#include <cstring>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "interface.hpp"

namespace slate {

/// Returns the fields of a state: `fields(field<&State::mean>("mean"))`.
/// Members are numbers, truth values, enumerations, `std::string`, `std::vector`, `std::array`, `std::optional`, and
/// structs with fields of their own.
template <typename... Fields>
constexpr std::tuple<Fields...> fields(Fields... fields) {
    return {fields...};
}

namespace detail {

template <typename T, typename = void>
struct HasFields : std::false_type {};
template <typename T>
struct HasFields<T, std::void_t<decltype(T::fields())>> : std::true_type {};

/// Major types of CBOR.
enum class Major : std::uint8_t { Unsigned, Negative, Bytes, Text, List, Map, Tag, Simple };

/// Writer of CBOR.
class StateWriter {
public:
    /// Returns the bytes.
    std::string finish() { return std::move(bytes_); }

    void write(bool value) { head(Major::Simple, value ? 21 : 20); }
    void write(Bool value) { write(static_cast<bool>(value)); }
    void write(const std::string &text) {
        head(Major::Text, text.size());
        bytes_ += text;
    }
    template <typename T>
    void write(const std::vector<T> &items) {
        list(items, items.size());
    }
    template <typename T, std::size_t N>
    void write(const std::array<T, N> &items) {
        list(items, N);
    }
    template <typename T>
    void write(const std::optional<T> &value) {
        if (value) {
            write(*value);
        } else {
            head(Major::Simple, 22);
        }
    }
    template <typename T>
    void write(const T &value) {
        if constexpr (std::is_enum_v<T>) {
            write(static_cast<std::underlying_type_t<T>>(value));
        } else if constexpr (std::is_floating_point_v<T>) {
            const double wide = value;
            std::uint64_t bits = 0;
            std::memcpy(&bits, &wide, sizeof bits);
            bytes_.push_back(static_cast<char>(0xfb));
            big_endian(bits, 8);
        } else if constexpr (std::is_integral_v<T>) {
            if (value < T{}) {
                head(Major::Negative, static_cast<std::uint64_t>(-(static_cast<std::int64_t>(value) + 1)));
            } else {
                head(Major::Unsigned, static_cast<std::uint64_t>(value));
            }
        } else {
            static_assert(HasFields<T>::value, "a struct in a state lists its members in a static function `fields`");
            constexpr auto all = T::fields();
            head(Major::Map, std::tuple_size_v<decltype(all)>);
            const auto one = [this, &value](const auto &field) {
                write(std::string(field.name));
                write(value.*std::decay_t<decltype(field)>::member);
            };
            std::apply([&one](const auto &...field) { (one(field), ...); }, all);
        }
    }

private:
    void head(Major major, std::uint64_t value) {
        const auto first = static_cast<std::uint8_t>(static_cast<unsigned>(major) << 5U);
        if (value < 24) {
            bytes_.push_back(static_cast<char>(first | value));
            return;
        }
        const unsigned width = value <= 0xff ? 0 : value <= 0xffff ? 1 : value <= 0xffffffff ? 2 : 3;
        bytes_.push_back(static_cast<char>(first | (24 + width)));
        big_endian(value, 1U << width);
    }
    void big_endian(std::uint64_t value, unsigned width) {
        while (width > 0) {
            --width;
            bytes_.push_back(static_cast<char>(value >> (8 * width)));
        }
    }
    template <typename Items>
    void list(const Items &items, std::size_t size) {
        head(Major::List, size);
        for (const auto &item : items) {
            write(item);
        }
    }

    std::string bytes_;
};

/// Reader of CBOR as `StateWriter` writes it.
class StateReader {
public:
    /// Reads bytes, which outlive it.
    explicit StateReader(std::string_view bytes) : rest_(bytes) {}

    /// Returns the state; throws for one that does not fit.
    template <typename T>
    T whole() {
        T value{};
        read(value);
        if (!rest_.empty()) {
            refuse("it has more bytes than expected");
        }
        return value;
    }

    void read(bool &value) {
        const std::uint64_t simple = expect(Major::Simple, "a truth value");
        if (simple != 20 && simple != 21) {
            refuse("expected a truth value");
        }
        value = simple == 21;
    }
    void read(Bool &value) {
        bool plain = false;
        read(plain);
        value = plain;
    }
    void read(std::string &text) { text = take(expect(Major::Text, "a text")); }
    template <typename T>
    void read(std::vector<T> &items) {
        const std::uint64_t size = expect(Major::List, "a list");
        items.clear();
        for (std::uint64_t i = 0; i < size; ++i) {
            T item{};
            read(item);
            items.push_back(std::move(item));
        }
    }
    template <typename T, std::size_t N>
    void read(std::array<T, N> &items) {
        if (expect(Major::List, "a list") != N) {
            refuse("expected a list of " + std::to_string(N) + " items");
        }
        for (T &item : items) {
            read(item);
        }
    }
    template <typename T>
    void read(std::optional<T> &value) {
        if (!rest_.empty() && static_cast<std::uint8_t>(rest_[0]) == 0xf6) {
            take(1);
            value.reset();
        } else {
            read(value.emplace());
        }
    }
    template <typename T>
    void read(T &value) {
        if constexpr (std::is_enum_v<T>) {
            std::underlying_type_t<T> carrier{};
            read(carrier);
            value = static_cast<T>(carrier);
        } else if constexpr (std::is_floating_point_v<T>) {
            if (byte() != 0xfb) {
                refuse("expected a number");
            }
            const std::uint64_t bits = big_endian(8);
            double wide = 0;
            std::memcpy(&wide, &bits, sizeof wide);
            value = static_cast<T>(wide);
        } else if constexpr (std::is_integral_v<T>) {
            integer(value);
        } else {
            structure(value);
        }
    }

private:
    [[noreturn]] static void refuse(const std::string &reason) { throw std::runtime_error("its state does not fit: " + reason); }

    std::string_view take(std::uint64_t length) {
        if (length > rest_.size()) {
            refuse("it ends too early");
        }
        const std::string_view taken = rest_.substr(0, length);
        rest_.remove_prefix(length);
        return taken;
    }
    std::uint8_t byte() { return static_cast<std::uint8_t>(take(1)[0]); }
    std::uint64_t big_endian(unsigned width) {
        std::uint64_t value = 0;
        for (const char part : take(width)) {
            value = value << 8U | static_cast<std::uint8_t>(part);
        }
        return value;
    }
    std::pair<Major, std::uint64_t> head() {
        const std::uint8_t first = byte();
        const auto major = static_cast<Major>(first >> 5U);
        const unsigned value = first & 31U;
        if (value < 24) {
            return {major, value};
        }
        if (value > 27) {
            refuse("it is no CBOR of a known length");
        }
        return {major, big_endian(1U << (value - 24))};
    }
    std::uint64_t expect(Major major, const char *what) {
        const auto [found, value] = head();
        if (found != major) {
            refuse(std::string("expected ") + what);
        }
        return value;
    }
    template <typename T>
    void integer(T &value) {
        const auto [major, number] = head();
        const bool is_negative = major == Major::Negative;
        if (!is_negative && major != Major::Unsigned) {
            refuse("expected a whole number");
        }
        const auto most = static_cast<std::uint64_t>(std::numeric_limits<T>::max());
        if (number > most || (is_negative && std::is_unsigned_v<T>)) {
            refuse("a number is out of the range of its type");
        }
        value = is_negative ? static_cast<T>(-1 - static_cast<std::int64_t>(number)) : static_cast<T>(number);
    }
    template <typename T>
    void structure(T &value) {
        constexpr auto all = T::fields();
        std::array<bool, std::tuple_size_v<decltype(all)> + 1> found{};
        for (std::uint64_t left = expect(Major::Map, "fields"); left > 0; --left) {
            std::string name;
            read(name);
            std::size_t index = 0;
            bool is_known = false;
            const auto one = [&](const auto &field) {
                if (!is_known && name == field.name) {
                    read(value.*std::decay_t<decltype(field)>::member);
                    found[index] = is_known = true;
                }
                ++index;
            };
            std::apply([&one](const auto &...field) { (one(field), ...); }, all);
            if (!is_known) {
                skip(32);
            }
        }
        std::size_t index = 0;
        const auto missing = [&](const auto &field) {
            if (!found[index++]) {
                refuse(std::string("it has no field `") + field.name + "`");
            }
        };
        std::apply([&missing](const auto &...field) { (missing(field), ...); }, all);
    }
    /// Passes over a value that no field reads.
    void skip(int depth) {
        if (depth == 0) {
            refuse("it is nested too deeply");
        }
        const auto [major, value] = head();
        if (major == Major::Text || major == Major::Bytes) {
            take(value);
        }
        const std::uint64_t items = major == Major::List || major == Major::Tag ? (major == Major::Tag ? 1 : value) : 0;
        for (std::uint64_t i = 0; i < items + (major == Major::Map ? 2 * value : 0); ++i) {
            skip(depth - 1);
        }
    }

    std::string_view rest_;
};

} // namespace detail

} // namespace slate

/// @file
/// JSON, written at compile time into an array or at run time into a string.

#pragma once

#include <array>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <type_traits>

namespace slate::detail {

/// Output that counts bytes.
struct Counter {
    std::size_t length = 0;

    constexpr void put(char) { ++length; }
};

/// Output into an array of known size.
template <std::size_t N>
struct Characters {
    std::array<char, N> bytes{};
    std::size_t length = 0;

    constexpr void put(char byte) { bytes[length++] = byte; }
};

/// Output into a string.
struct Growing {
    std::string text;

    [[gnu::noinline]] void put(char byte) { text.push_back(byte); }
};

template <typename Out>
[[gnu::noinline]] constexpr void raw(Out &out, std::string_view text) {
    for (const char byte : text) {
        out.put(byte);
    }
}

/// Writes a JSON string.
template <typename Out>
[[gnu::noinline]] constexpr void quoted(Out &out, std::string_view text) {
    out.put('"');
    for (const char byte : text) {
        if (byte == '"' || byte == '\\') {
            out.put('\\');
        }
        out.put(static_cast<unsigned char>(byte) < 0x20 ? ' ' : byte);
    }
    out.put('"');
}

/// Writes a key in front of a value.
template <typename Out>
[[gnu::noinline]] constexpr void key(Out &out, std::string_view name, bool is_first = false) {
    if (!is_first) {
        out.put(',');
    }
    quoted(out, name);
    out.put(':');
}

template <typename Out>
[[gnu::noinline]] constexpr void whole(Out &out, std::uint64_t value) {
    if (value > 9) {
        whole(out, value / 10);
    }
    out.put(static_cast<char>('0' + value % 10));
}

template <typename Out>
[[gnu::noinline]] constexpr void hexadecimal(Out &out, std::uint64_t value) {
    for (int shift = 60; shift >= 0; shift -= 4) {
        out.put("0123456789abcdef"[(value >> shift) & 15U]);
    }
}

/// Writes a number; JSON has no infinity, so the largest one is written instead.
template <typename Out, typename T>
[[gnu::noinline]] void number(Out &out, T value) {
    if constexpr (std::is_floating_point_v<T>) {
        const T most = std::numeric_limits<T>::max();
        value = value > most ? most : value < -most ? -most : value;
    }
    char text[40];
    const auto end = std::to_chars(text, text + sizeof text, value).ptr;
    raw(out, {text, static_cast<std::size_t>(end - text)});
}

} // namespace slate::detail

/// @file
/// Types of fields of interfaces, laid out as Slate's own.

#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <type_traits>
#if __cplusplus >= 202002L
#include <span>
#endif

namespace slate {

#if __cplusplus >= 202002L
/// Items in memory of somebody else: `std::span`.
template <typename T>
using Span = std::span<T>;
#else
/// Items in memory of somebody else; with C++20 `std::span`.
template <typename T>
class Span {
public:
    constexpr Span() = default;
    /// Refers to items.
    constexpr Span(T *data, std::size_t size) : data_(data), size_(size) {}

    /// Returns the address of the first item.
    [[nodiscard]] constexpr T *data() const { return data_; }
    /// Returns the number of items.
    [[nodiscard]] constexpr std::size_t size() const { return size_; }
    /// Returns true if there are no items.
    [[nodiscard]] constexpr bool empty() const { return size_ == 0; }
    [[nodiscard]] constexpr T *begin() const { return data_; }
    [[nodiscard]] constexpr T *end() const { return data_ + size_; }
    [[nodiscard]] constexpr T &operator[](std::size_t index) const { return data_[index]; }

private:
    T *data_ = nullptr;
    std::size_t size_ = 0;
};
#endif

/// Boolean that accepts every byte: 0 is false, anything else true.
/// A `bool` of C++ may hold only 0 and 1, which values of other programs need not.
class Bool {
public:
    constexpr Bool() = default;
    /// Stores a truth value.
    constexpr Bool(bool value) : byte_(value ? 1 : 0) {}
    constexpr operator bool() const { return byte_ != 0; }

private:
    std::uint8_t byte_ = 0;
};

namespace detail {

/// Returns the length of `text` up to `limit` bytes, cut at a character of UTF-8.
constexpr std::size_t cut(std::string_view text, std::size_t limit) {
    if (text.size() <= limit) {
        return text.size();
    }
    while (limit > 0 && (static_cast<unsigned char>(text[limit]) & 0xc0U) == 0x80U) {
        --limit;
    }
    return limit;
}

} // namespace detail

/// UTF-8 text of at most `N` bytes (a multiple of 4), stored in place.
template <std::size_t N>
class Text {
    static_assert(N % 4 == 0, "the capacity of a Text is a multiple of 4 bytes");

public:
    constexpr Text() = default;
    /// Stores as much of `text` as fits, cut at a character.
    constexpr Text(std::string_view text) {
        const std::size_t end = detail::cut(text, N);
        for (std::size_t i = 0; i < end; ++i) {
            bytes_[i] = text[i];
        }
        length_ = static_cast<std::uint32_t>(end);
    }
    constexpr Text(const char *text) : Text(std::string_view(text)) {}

    /// Returns the text.
    [[nodiscard]] constexpr std::string_view view() const {
        return {bytes_, std::min<std::size_t>(length_, N)};
    }
    constexpr operator std::string_view() const { return view(); }
    friend constexpr bool operator==(const Text &left, const Text &right) { return left.view() == right.view(); }
    friend constexpr bool operator!=(const Text &left, const Text &right) { return !(left == right); }

private:
    std::uint32_t length_ = 0;
    char bytes_[N]{};
};

/// At most `N` items, stored in place.
template <typename T, std::size_t N>
class Sequence {
public:
    /// Largest number of items.
    static constexpr std::size_t capacity = N;

    /// Appends an item; false when no more fits.
    constexpr bool push_back(const T &item) {
        if (size() == N) {
            return false;
        }
        items_[length_++] = item;
        return true;
    }
    /// Removes all items.
    constexpr void clear() { length_ = 0; }

    [[nodiscard]] constexpr std::size_t size() const { return std::min<std::size_t>(length_, N); }
    [[nodiscard]] constexpr bool empty() const { return size() == 0; }
    [[nodiscard]] constexpr T *data() { return items_; }
    [[nodiscard]] constexpr const T *data() const { return items_; }
    [[nodiscard]] constexpr T *begin() { return items_; }
    [[nodiscard]] constexpr T *end() { return items_ + size(); }
    [[nodiscard]] constexpr const T *begin() const { return items_; }
    [[nodiscard]] constexpr const T *end() const { return items_ + size(); }
    [[nodiscard]] constexpr T &operator[](std::size_t index) { return items_[index]; }
    [[nodiscard]] constexpr const T &operator[](std::size_t index) const { return items_[index]; }

private:
    std::uint32_t length_ = 0;
    std::uint32_t reserved_ = 0;
    T items_[N]{};
};

/// Value that may be missing: a flag and the value.
template <typename T>
class Optional {
public:
    constexpr Optional() = default;
    /// Stores a present value.
    constexpr Optional(const T &value) : present_(1), value_(value) {}

    /// Returns true if the value is present.
    [[nodiscard]] constexpr bool has_value() const { return present_ != 0; }
    constexpr explicit operator bool() const { return has_value(); }
    /// Returns the value; that of an absent one means nothing.
    [[nodiscard]] constexpr const T &operator*() const { return value_; }
    [[nodiscard]] constexpr const T *operator->() const { return &value_; }
    /// Returns the value, or the other one if it is absent.
    [[nodiscard]] constexpr T value_or(T other) const { return has_value() ? value_ : other; }

private:
    std::uint32_t present_ = 0;
    std::uint32_t reserved_ = 0;
    T value_{};
};

} // namespace slate

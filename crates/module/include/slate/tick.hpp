/// @file
/// Time, random numbers and log of a step.

#pragma once

#include <charconv>
#include <chrono>
#include <cmath>
#include <cstring>
#include <initializer_list>

#include "../slate.h"
#include "values.hpp"

namespace slate {

/// Severity of a log message.
enum class Level : std::uint32_t { Error, Warn, Info, Debug, Trace };

/// Stream of pseudo-random numbers: xoshiro256++ (Blackman and Vigna, 2021).
/// It has the numbers of a module in Rust of the same name and seed.
class Random {
public:
    /// Refers to the stream of a frame.
    explicit Random(SlateRandom *random) : random_(random) {}

    /// Returns 64 random bits.
    std::uint64_t bits() {
        std::uint64_t *s = random_->state;
        const std::uint64_t result = rotate(s[0] + s[3], 23) + s[0];
        const std::uint64_t t = s[1] << 17U;
        s[2] ^= s[0];
        s[3] ^= s[1];
        s[1] ^= s[2];
        s[0] ^= s[3];
        s[2] ^= t;
        s[3] = rotate(s[3], 45);
        return result;
    }
    /// Returns a number uniform in [0, 1).
    double unit() { return static_cast<double>(bits() >> 11U) * (1.0 / 9007199254740992.0); }
    /// Returns a number uniform in [low, high).
    double uniform(double low, double high) { return low + (high - low) * unit(); }
    /// Returns a standard normal number, mean 0 and stddev 1 (Box and Muller, 1958).
    double normal() {
        const double radius = std::sqrt(-2.0 * std::log(1.0 - unit()));
        return radius * std::cos(2.0 * 3.14159265358979323846 * unit());
    }

private:
    static constexpr std::uint64_t rotate(std::uint64_t value, unsigned by) { return value << by | value >> (64U - by); }

    SlateRandom *random_;
};

/// Value that a log message carries beside its text, such as `{"distance", 0.2}`.
/// Tools read it without parsing the text, and messages of the same text count as repetitions.
class LogField {
public:
    /// Carries a number.
    template <typename T, std::enable_if_t<std::is_arithmetic_v<T> && !std::is_same_v<T, bool>, int> = 0>
    LogField(std::string_view key, T value) : key_(key) {
        const auto end = std::to_chars(digits_, digits_ + sizeof digits_, value).ptr;
        length_ = static_cast<std::size_t>(end - digits_);
    }
    /// Carries a text, which lives as long as the call.
    LogField(std::string_view key, std::string_view text) : key_(key), text_(text), is_text_(true) {}
    LogField(std::string_view key, const char *text) : LogField(key, std::string_view(text)) {}
    LogField(std::string_view key, bool value) : LogField(key, value ? "true" : "false") {}

    /// Returns the name.
    [[nodiscard]] std::string_view key() const { return key_; }
    /// Returns the value as text.
    [[nodiscard]] std::string_view text() const { return is_text_ ? text_ : std::string_view(digits_, length_); }

private:
    std::string_view key_, text_;
    char digits_[32]{};
    std::size_t length_ = 0;
    bool is_text_ = false;
};

/// Time, random numbers and log of a step.
/// It is the only source of time and chance that a module has.
class Tick {
public:
    /// Refers to a frame.
    explicit Tick(const SlateFrame *frame) : frame_(frame) {}

    /// Returns the host's time.
    [[nodiscard]] std::chrono::nanoseconds now() const {
        return std::chrono::nanoseconds(static_cast<std::int64_t>(frame_->now));
    }
    /// Returns the host's time, s.
    [[nodiscard]] double seconds() const { return static_cast<double>(frame_->now) * 1e-9; }
    /// Seconds since this module's last tick; 0 in the first.
    [[nodiscard]] double elapsed() const { return static_cast<double>(frame_->elapsed) * 1e-9; }
    /// Counts this module's ticks from 1.
    [[nodiscard]] std::uint64_t number() const { return frame_->number; }
    /// Returns the module's random stream.
    [[nodiscard]] Random random() const { return Random(frame_->random); }

    /// Writes to the agent's log; beyond 512 bytes a message is cut, and a field that does not fit is left out.
    void log(Level level, std::string_view text, std::initializer_list<LogField> fields = {}) const noexcept {
        char line[512];
        char parts[256];
        std::size_t length = 0;
        for (const LogField &field : fields) {
            const std::string_view key = field.key(), value = field.text();
            if (length + key.size() + value.size() + 2 > sizeof parts) {
                continue;
            }
            parts[length++] = separator;
            length += copy(parts + length, key, "\x1f=");
            parts[length++] = '=';
            length += copy(parts + length, value, "\x1f");
        }
        text = text.substr(0, detail::cut(text, sizeof line - length));
        const std::size_t head = copy(line, text, "\x1f");
        std::memcpy(line + head, parts, length);
        frame_->host->log(frame_->host->context, static_cast<std::uint32_t>(level),
                          reinterpret_cast<const std::uint8_t *>(line), head + length);
    }
    /// Logs information for users.
    void info(std::string_view text, std::initializer_list<LogField> fields = {}) const noexcept {
        log(Level::Info, text, fields);
    }
    /// Logs a problem with which the robot goes on.
    void warn(std::string_view text, std::initializer_list<LogField> fields = {}) const noexcept {
        log(Level::Warn, text, fields);
    }
    /// Logs a failure.
    void error(std::string_view text, std::initializer_list<LogField> fields = {}) const noexcept {
        log(Level::Error, text, fields);
    }

private:
    /// Separator before each field of a log message: ASCII's unit separator.
    static constexpr char separator = '\x1f';

    /// Copies a text with `_` in place of characters that have a meaning of their own.
    static std::size_t copy(char *to, std::string_view text, std::string_view unwanted) {
        for (const char byte : text) {
            *to++ = unwanted.find(byte) == std::string_view::npos ? byte : '_';
        }
        return text.size();
    }

    const SlateFrame *frame_;
};

} // namespace slate

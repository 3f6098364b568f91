/// @file
/// Interfaces: plain structs with the name, unit and documentation of each field.

#pragma once

#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>

#include "values.hpp"
#include "writer.hpp"

namespace slate {

namespace detail {

template <typename Member>
struct MemberOf;

template <typename C, typename T>
struct MemberOf<T C::*> {
    using Class = C;
    using Type = T;
};

} // namespace detail

/// Field of an interface; `field` makes it.
template <auto Member>
struct Field {
    using Class = typename detail::MemberOf<decltype(Member)>::Class;
    using Type = typename detail::MemberOf<decltype(Member)>::Type;
    static constexpr auto member = Member;

    const char *name;
    const char *unit;
    const char *doc;
};

/// Returns the field of a member: `field<&Pose2::x>("x", "m", "Position along x.")`.
template <auto Member>
constexpr Field<Member> field(const char *name, const char *unit = "", const char *doc = "") {
    return {name, unit, doc};
}

/// Tail of an interface; `tail` makes it.
template <typename T>
struct TailField {
    using Item = T;

    const char *name;
    const char *unit;
    const char *doc;
};

/// Returns the tail of an interface: its last field, with as many items as each value has.
/// It is not a member of the struct; ports give its items.
template <typename T>
constexpr TailField<T> tail(const char *name, const char *unit = "", const char *doc = "") {
    return {name, unit, doc};
}

/// Name and fields of an interface.
template <typename... Fields>
struct InterfaceDescription {
    const char *name;
    const char *doc;
    std::tuple<Fields...> fields;
};

/// Returns the description of an interface: its name, documentation, and fields in the order of the struct.
template <typename... Fields>
constexpr InterfaceDescription<Fields...> interface(const char *name, const char *doc, Fields... fields) {
    return {name, doc, {fields...}};
}

/// Description of an interface; specialize it for a struct of another library.
template <typename T>
struct Interface {
    /// Returns name and fields.
    static constexpr auto describe() { return T::interface(); }
};

/// Named value of an enumeration.
struct Constant {
    const char *name;
    std::int64_t value;
    const char *doc = "";
};

/// Name and named values of an `enum class`; specialize it for one that is a field.
/// Both are static members: `name`, and an array `constants` of `Constant`.
template <typename T>
struct Enumeration;

namespace detail {

constexpr std::uint64_t hash_byte(std::uint64_t hash, std::uint8_t byte) { return (hash ^ byte) * 0x00000100000001b3U; }

constexpr std::uint64_t hash_number(std::uint64_t hash, std::uint64_t number) {
    for (int i = 0; i < 8; ++i) {
        hash = hash_byte(hash, static_cast<std::uint8_t>(number >> (8 * i)));
    }
    return hash;
}

constexpr std::uint64_t hash_text(std::uint64_t hash, std::string_view text) {
    for (const char byte : text) {
        hash = hash_byte(hash, static_cast<std::uint8_t>(byte));
    }
    return hash_byte(hash, 0);
}

template <typename T>
struct Kind;

/// Number or truth value: its name and its number in schema hashes.
template <typename T>
struct PrimitiveKind {
    static constexpr std::size_t size = sizeof(T), align = sizeof(T);

    static constexpr std::pair<const char *, std::uint8_t> identity() {
        if constexpr (std::is_same_v<T, Bool>) {
            return {"bool", 1};
        } else if constexpr (std::is_floating_point_v<T>) {
            return sizeof(T) == 4 ? std::pair<const char *, std::uint8_t>{"f32", 10} : std::pair<const char *, std::uint8_t>{"f64", 11};
        } else {
            constexpr const char *names[] = {"u8", "u16", "u32", "u64", "i8", "i16", "i32", "i64"};
            constexpr int index = (sizeof(T) == 1 ? 0 : sizeof(T) == 2 ? 1 : sizeof(T) == 4 ? 2 : 3) + (std::is_signed_v<T> ? 4 : 0);
            return {names[index], static_cast<std::uint8_t>(index + 2)};
        }
    }
    static constexpr std::uint64_t hash(std::uint64_t hash) { return hash_byte(hash, identity().second); }
    template <typename Out>
    static constexpr void write(Out &out) {
        quoted(out, identity().first);
    }
};

template <typename T>
struct EnumerationKind {
    using Carrier = Kind<std::underlying_type_t<T>>;
    static constexpr std::size_t size = sizeof(T), align = sizeof(T);

    static constexpr std::uint64_t hash(std::uint64_t hash) {
        hash = Carrier::hash(hash_text(hash_byte(hash, 12), Enumeration<T>::name));
        for (const Constant &constant : Enumeration<T>::constants) {
            hash = hash_number(hash_text(hash, constant.name), static_cast<std::uint64_t>(constant.value));
        }
        return hash;
    }
    template <typename Out>
    static void write(Out &out) {
        raw(out, "{\"enumeration\":{\"name\":");
        quoted(out, Enumeration<T>::name);
        key(out, "carrier");
        Carrier::write(out);
        key(out, "constants");
        char before = '[';
        for (const Constant &constant : Enumeration<T>::constants) {
            out.put(before);
            out.put('[');
            quoted(out, constant.name);
            out.put(',');
            number(out, constant.value);
            out.put(',');
            quoted(out, constant.doc);
            out.put(']');
            before = ',';
        }
        raw(out, "]}}");
    }
};

template <typename T>
struct Schema;

template <typename T>
struct NestedKind {
    static constexpr std::size_t size = sizeof(T), align = alignof(T);

    static constexpr std::uint64_t hash(std::uint64_t hash) { return hash_number(hash_byte(hash, 17), Schema<T>::hash); }
    template <typename Out>
    static void write(Out &out) {
        raw(out, "{\"nested\":");
        Schema<T>::write(out);
        out.put('}');
    }
};

template <typename T>
constexpr auto choose_kind() {
    static_assert(!std::is_same_v<T, bool>, "a field of an interface is a slate::Bool: a bool may only hold 0 and 1");
    static_assert(!std::is_same_v<T, char>, "a field of an interface is a number such as std::uint8_t, or a slate::Text");
    static_assert(!std::is_pointer_v<T>, "an interface is plain data: it has no pointers");
    static_assert(std::is_trivially_copyable_v<T>, "an interface is plain data: its fields are trivially copyable");
    if constexpr (std::is_enum_v<T>) {
        return EnumerationKind<T>{};
    } else if constexpr (std::is_arithmetic_v<T> || std::is_same_v<T, Bool>) {
        static_assert(sizeof(T) <= 8, "numbers of an interface have at most 64 bits");
        return PrimitiveKind<T>{};
    } else {
        return NestedKind<T>{};
    }
}

/// Type of a field.
template <typename T>
struct Kind : decltype(choose_kind<T>()) {};

template <std::size_t N>
struct Kind<Text<N>> {
    static constexpr std::size_t size = 4 + N, align = 4;

    static constexpr std::uint64_t hash(std::uint64_t hash) { return hash_number(hash_byte(hash, 13), N); }
    template <typename Out>
    static constexpr void write(Out &out) {
        raw(out, "{\"text\":");
        whole(out, N);
        out.put('}');
    }
};

template <typename T>
struct Kind<Optional<T>> {
    static constexpr std::size_t size = sizeof(Optional<T>), align = alignof(Optional<T>);
    static_assert(size == 8 + sizeof(T), "an Optional has no padding");

    static constexpr std::uint64_t hash(std::uint64_t hash) { return Kind<T>::hash(hash_byte(hash, 14)); }
    template <typename Out>
    static constexpr void write(Out &out) {
        raw(out, "{\"optional\":");
        Kind<T>::write(out);
        out.put('}');
    }
};

template <typename T, std::size_t N>
struct CountedKind {
    static constexpr std::uint64_t hash(std::uint64_t hash, std::uint8_t kind) {
        return Kind<T>::hash(hash_number(hash_byte(hash, kind), N));
    }
    template <typename Out>
    static constexpr void write(Out &out, std::string_view name) {
        out.put('{');
        quoted(out, name);
        raw(out, ":[");
        Kind<T>::write(out);
        out.put(',');
        whole(out, N);
        raw(out, "]}");
    }
};

template <typename T, std::size_t N>
struct ArrayKind {
    static constexpr std::size_t size = N * sizeof(T), align = alignof(T);

    static constexpr std::uint64_t hash(std::uint64_t hash) { return CountedKind<T, N>::hash(hash, 15); }
    template <typename Out>
    static constexpr void write(Out &out) {
        CountedKind<T, N>::write(out, "array");
    }
};

template <typename T, std::size_t N>
struct Kind<std::array<T, N>> : ArrayKind<T, N> {};

template <typename T, std::size_t N>
struct Kind<T[N]> : ArrayKind<T, N> {};

template <typename T, std::size_t N>
struct Kind<Sequence<T, N>> {
    static constexpr std::size_t size = sizeof(Sequence<T, N>), align = alignof(Sequence<T, N>);
    static_assert(size == 8 + N * sizeof(T), "a Sequence has no padding");

    static constexpr std::uint64_t hash(std::uint64_t hash) { return CountedKind<T, N>::hash(hash, 16); }
    template <typename Out>
    static constexpr void write(Out &out) {
        CountedKind<T, N>::write(out, "sequence");
    }
};

/// Layout of one described field.
template <typename F>
struct FieldKind {
    using Of = Kind<typename F::Type>;
    static constexpr bool is_tail = false;
    static constexpr std::size_t size = Of::size, align = Of::align, item = 0;

    static constexpr std::uint64_t hash(std::uint64_t hash) { return Of::hash(hash); }
    template <typename Out>
    static void write(Out &out) {
        Of::write(out);
    }
};

template <typename T>
struct FieldKind<TailField<T>> {
    static constexpr bool is_tail = true;
    static constexpr std::size_t size = 0, align = alignof(T), item = sizeof(T);

    static constexpr std::uint64_t hash(std::uint64_t hash) { return Kind<T>::hash(hash_byte(hash, 18)); }
    template <typename Out>
    static void write(Out &out) {
        raw(out, "{\"tail\":");
        Kind<T>::write(out);
        out.put('}');
    }
};

constexpr std::size_t aligned(std::size_t size, std::size_t align) { return (size + align - 1) / align * align; }

/// Layout and schema hash of described fields, computed as by the agent.
struct Layout {
    std::uint64_t hash = 0xcbf29ce484222325U;
    /// Size with and without a tail, bytes.
    std::size_t size = 0, fixed = 0;
    std::size_t align = 1, fixed_align = 1;
    std::size_t item = 0;

    template <typename F>
    constexpr void add(const F &field) {
        using Of = FieldKind<F>;
        align = align < Of::align ? Of::align : align;
        size = aligned(size, Of::is_tail ? align : Of::align);
        hash = Of::hash(hash_number(hash_text(hash_text(hash, field.name), field.unit), size));
        size += Of::size;
        if (Of::is_tail) {
            item = Of::item;
        } else {
            fixed = size;
            fixed_align = align;
        }
    }

    template <typename... Fields>
    static constexpr Layout of(const char *name, const std::tuple<Fields...> &fields) {
        Layout layout;
        layout.hash = hash_text(layout.hash, name);
        std::apply([&layout](const auto &...field) { (layout.add(field), ...); }, fields);
        layout.size = aligned(layout.size, layout.align);
        layout.fixed = aligned(layout.fixed, layout.fixed_align);
        return layout;
    }
};

/// Type of a tail's items; `void` without a tail.
template <typename Tuple>
struct TailItem {
    using Type = void;
};
template <typename T>
struct TailItem<std::tuple<TailField<T>>> {
    using Type = T;
};
template <typename First, typename Second, typename... Rest>
struct TailItem<std::tuple<First, Second, Rest...>> : TailItem<std::tuple<Second, Rest...>> {
    static_assert(!FieldKind<First>::is_tail, "only the last field may be a tail");
};

/// Error of a description, in words for its author.
[[noreturn]] inline void refuse_description(const std::string &reason) { throw std::logic_error(reason); }

/// Checks that the members of `T` are described in the order of their places.
/// A compiler knows the places only at run time, so tests and the loading of a library find it.
template <typename T, typename... Fields>
[[gnu::cold, gnu::noinline]] void check_order(const char *name, const std::tuple<Fields...> &fields) {
    const T value{};
    std::size_t expected = 0;
    const auto check = [&](const auto &field) {
        using F = std::decay_t<decltype(field)>;
        if constexpr (!FieldKind<F>::is_tail) {
            expected = aligned(expected, FieldKind<F>::align);
            const auto place = static_cast<std::size_t>(reinterpret_cast<const char *>(&(value.*F::member)) - reinterpret_cast<const char *>(&value));
            if (place != expected) {
                refuse_description(std::string("field `") + field.name + "` of " + name + " is at byte " + std::to_string(place) +
                                   " of the struct, but its place in the description makes " + std::to_string(expected) +
                                   ": describe the fields in the order of the members");
            }
            expected += FieldKind<F>::size;
        }
    };
    std::apply([&check](const auto &...field) { (check(field), ...); }, fields);
}

/// Writes a described interface as the agent reads it.
template <typename Out, typename... Fields>
[[gnu::cold, gnu::noinline]] void write_interface(Out &out, const char *name, const char *doc, const std::tuple<Fields...> &fields, std::uint64_t hash) {
    raw(out, "{\"name\":");
    quoted(out, name);
    key(out, "doc");
    quoted(out, doc);
    key(out, "hash");
    whole(out, hash);
    key(out, "fields");
    char before = '[';
    const auto write = [&](const auto &field) {
        out.put(before);
        raw(out, "{\"name\":");
        quoted(out, field.name);
        key(out, "unit");
        quoted(out, field.unit);
        key(out, "doc");
        quoted(out, field.doc);
        key(out, "kind");
        FieldKind<std::decay_t<decltype(field)>>::write(out);
        out.put('}');
        before = ',';
    };
    std::apply([&write](const auto &...field) { (write(field), ...); }, fields);
    raw(out, before == '[' ? "[]}" : "]}");
}

/// Layout and schema of an interface.
template <typename T>
struct Schema {
    static constexpr auto description = Interface<T>::describe();
    using Fields = std::decay_t<decltype(description.fields)>;
    using Item = typename TailItem<Fields>::Type;
    static constexpr Layout layout = Layout::of(description.name, description.fields);
    static constexpr std::uint64_t hash = layout.hash;
    static_assert(std::is_trivially_copyable_v<T> && std::is_standard_layout_v<T>,
                  "an interface is plain data: trivially copyable, with all members in one class and of one access");
    static_assert(std::is_empty_v<T> || layout.fixed == sizeof(T), "an interface lists all of its members as fields");

    template <typename Out>
    static void write(Out &out) {
        check_order<T>(description.name, description.fields);
        write_interface(out, description.name, description.doc, description.fields, hash);
    }
};

} // namespace detail

} // namespace slate

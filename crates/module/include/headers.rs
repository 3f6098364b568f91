//! Headers for modules in C and C++, for programs that write projects.

macro_rules! headers {
    ($($file:literal)*) => { &[$(($file, include_str!($file))),*] };
}

/// Headers, each with its path below a folder of headers and its text.
///
/// `slate.h` is the C interface, `slate.hpp` the library for C++17, and `slate/testing.h` and `slate/testing.hpp` are
/// fixtures for tests.
pub const HEADERS: &[(&str, &str)] = headers! {
    "slate.h"
    "slate.hpp"
    "slate/description.hpp"
    "slate/eigen.hpp"
    "slate/interface.hpp"
    "slate/module.hpp"
    "slate/plugin.hpp"
    "slate/ports.hpp"
    "slate/state.hpp"
    "slate/testing.h"
    "slate/testing.hpp"
    "slate/tick.hpp"
    "slate/values.hpp"
    "slate/writer.hpp"
};

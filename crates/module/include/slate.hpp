/// @file
/// Modules in C++17 for Slate, header only.
///
/// A module is a struct with `name`, `stage`, `Io`, `Params`, `State` and `tick`, in the terms of a module in Rust:
///
///     struct Doubler {
///         static constexpr const char *name = "doubler";
///         static constexpr slate::Stage stage = slate::Stage::Think;
///
///         struct Io {
///             slate::Required<Number> input;
///             slate::Output<Number> doubled;
///
///             static constexpr auto ports() {
///                 return slate::ports(slate::port<&Io::input>("input", "Number to double."),
///                                     slate::port<&Io::doubled>("doubled", "Twice the number."));
///             }
///         };
///         using Params = slate::Nothing;
///         using State = slate::Nothing;
///
///         static slate::Outcome tick(State &, const Io &io, const Params &, const slate::Tick &) {
///             io.doubled.set({2.0 * io.input->value});
///             return slate::Outcome::Ok;
///         }
///     };
///
///     SLATE_MODULES(doubler, "0.1.0", Doubler);
///
/// It may also have `doc`, `trigger` (`every`, `on`), `deadline`, `unique`, and the functions `create(setup, params)`,
/// `may_unload(state)`, and `save(state)` with `restore(bytes)`. An exception of a tick is logged with its message, and
/// the module fails as after a panic of one in Rust; one of another function is the reason of a refusal.

#pragma once

#include "slate.h"
#include "slate/description.hpp"
#include "slate/interface.hpp"
#include "slate/module.hpp"
#include "slate/plugin.hpp"
#include "slate/ports.hpp"
#include "slate/state.hpp"
#include "slate/tick.hpp"
#include "slate/values.hpp"

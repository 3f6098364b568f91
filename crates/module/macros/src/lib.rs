//! Macros of slate-module, documented there, where they are exported.

use proc_macro::TokenStream;
use proc_macro_crate::{FoundCrate, crate_name};
use proc_macro2::{Ident, Span, TokenStream as Tokens};
use quote::quote;

mod attributes;
mod interface;
mod module;
mod params;
mod ports;
mod structure;

/// Makes a struct of plain fields an interface, or an enum a coded integer.
/// A struct gets a descriptor; an enum becomes an integer type with named constants.
///
/// The last field of a struct may be a slice, `data: [u8]`: the tail, whose capacity is set by configuration.
/// A field's `#[unit("m/s")]` names its unit. `#[interface(ros = "geometry_msgs/msg/Pose2D")]` names the message of
/// ROS 2 that it corresponds to.
#[proc_macro_attribute]
pub fn interface(arguments: TokenStream, item: TokenStream) -> TokenStream {
    expand(interface::expand(arguments.into(), item.into()))
}

/// Makes a struct the parameters of a module.
///
/// Each field says `#[param(default = 0.8, range = 0.0..=5.0, unit = "1/s", doc = "heading gain")]`; an omitted
/// default is zero, an omitted range unbounded, an omitted unit none. With
/// `follows = ["world.robots.{robot}.profile", "world.profile"]` it takes the value of the first of these settings that
/// exists, unless the configuration gives it one.
#[proc_macro_attribute]
pub fn params(_: TokenStream, item: TokenStream) -> TokenStream {
    expand(params::expand(item.into()))
}

/// Makes a struct the ports of a module.
///
/// Fields are ports such as `Required<T>`, `Input<T>`, `Queue<T>`, `Output<T>`, `Debug<T>`, `Command<T>`, `Inbox<T>`, `Outbox<T>`.
/// `#[stale(after = "200ms")]` on an input, `#[safe(value)]` on an output, `#[capacity(n)]` for the tail of a big
/// payload, `#[window(n)]` for the values of a tick on a queue, an inbox or an outbox, `#[role("truth")]` for the part that
/// a port plays in an architecture.
#[proc_macro_attribute]
pub fn ports(_: TokenStream, item: TokenStream) -> TokenStream {
    expand(ports::expand(item.into()))
}

/// Completes an implementation of `Module`, as in `#[module(stage = Act)]`.
/// Options: `every = "10ms"` or `on = port` (or `on = [a, b]`, `timeout = "1s"`), `deadline = "5ms"`,
/// `name = "follower"`.
#[proc_macro_attribute]
pub fn module(arguments: TokenStream, item: TokenStream) -> TokenStream {
    expand(module::expand(arguments.into(), item.into()))
}

fn expand(result: syn::Result<Tokens>) -> TokenStream {
    result.unwrap_or_else(|error| error.to_compile_error()).into()
}

/// Returns the path of slate-module in the crate that uses the macro.
/// That crate may know it only through a facade.
fn root() -> Tokens {
    let path = |name: &str| Ident::new(name, Span::call_site());
    if let Ok(found) = crate_name("slate-module") {
        let name = match &found {
            FoundCrate::Name(name) => path(name),
            FoundCrate::Itself => path("slate_module"),
        };
        return quote!(::#name);
    }
    for facade in ["slate-plugin", "slate-robotics"] {
        if let Ok(FoundCrate::Name(name)) = crate_name(facade) {
            // A dependency without a name of its own is used by the name of its library.
            let name = path(if name == "slate_robotics" { "slate" } else { &name });
            return quote!(::#name::module);
        }
    }
    quote!(::slate::module)
}

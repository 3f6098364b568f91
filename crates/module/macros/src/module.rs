use proc_macro2::TokenStream as Tokens;
use quote::quote;
use syn::meta::ParseNestedMeta;
use syn::{Error, Expr, Ident, ImplItem, ItemImpl, LitStr, Result};

use crate::attributes::{documentation, snake_case};
use crate::ports::nanoseconds;
use crate::root;

/// Arguments of the attribute `#[module]`.
#[derive(Default)]
struct ModuleArguments {
    stage: Option<Ident>,
    /// Period, ns.
    every: Option<u64>,
    on: Option<Vec<String>>,
    timeout: Option<u64>,
    deadline: Option<u64>,
    name: Option<String>,
    unique: String,
}

impl ModuleArguments {
    fn parse(tokens: Tokens) -> Result<Self> {
        let mut own = Self::default();
        let parser = syn::meta::parser(|meta| own.read(&meta));
        syn::parse::Parser::parse2(parser, tokens)?;
        Ok(own)
    }

    fn read(&mut self, meta: &ParseNestedMeta<'_>) -> Result<()> {
        if meta.path.is_ident("stage") {
            self.stage = Some(meta.value()?.parse()?);
        } else if meta.path.is_ident("every") {
            self.every = Some(nanoseconds(&meta.value()?.parse()?)?);
        } else if meta.path.is_ident("timeout") {
            self.timeout = Some(nanoseconds(&meta.value()?.parse()?)?);
        } else if meta.path.is_ident("deadline") {
            self.deadline = Some(nanoseconds(&meta.value()?.parse()?)?);
        } else if meta.path.is_ident("name") {
            self.name = Some(meta.value()?.parse::<LitStr>()?.value());
        } else if meta.path.is_ident("unique") {
            self.unique = meta.value()?.parse::<LitStr>()?.value();
        } else if meta.path.is_ident("on") {
            self.on = Some(port_names(&meta.value()?.parse()?)?);
        } else {
            return Err(
                meta.error("expected `stage`, `every`, `on`, `timeout`, `deadline`, `name` or `unique`")
            );
        }
        Ok(())
    }

    /// Returns the trigger as an expression.
    fn trigger(&self, module: &syn::Type) -> Result<Tokens> {
        let root = root();
        let timeout = option(self.timeout);
        match (self.every, &self.on) {
            (Some(_), Some(_)) => {
                Err(Error::new_spanned(module, "a module has one trigger: `every` or `on`"))
            }
            (Some(period), None) => Ok(quote!(#root::Trigger::Every(#period))),
            (None, Some(ports)) => Ok(quote!(#root::Trigger::On {
                ports: ::std::vec![#(::std::string::String::from(#ports)),*], timeout: #timeout })),
            (None, None) => Ok(quote!(#root::Trigger::Stage)),
        }
    }
}

/// Returns an optional number as an expression.
fn option(value: Option<u64>) -> Tokens {
    match value {
        Some(value) => quote!(::core::option::Option::Some(#value)),
        None => quote!(::core::option::Option::None),
    }
}

pub fn expand(arguments: Tokens, item: Tokens) -> Result<Tokens> {
    let root = root();
    let arguments = ModuleArguments::parse(arguments)?;
    let mut input: ItemImpl = syn::parse2(item)?;
    let trigger = arguments.trigger(&input.self_ty)?;
    let ModuleArguments { stage, deadline, name, unique, .. } = arguments;
    let type_name = match &*input.self_ty {
        syn::Type::Path(path) => path.path.segments.last().map(|segment| segment.ident.to_string()),
        _ => None,
    };
    let name = name.or(type_name.map(|name| snake_case(&name)));
    let name = name.ok_or_else(|| Error::new_spanned(&input.self_ty, "give it a `name`"))?;
    let stage = stage.ok_or_else(|| {
        Error::new_spanned(&input.self_ty, "set the `stage` of the main loop, such as `stage = Act`")
    })?;
    let deadline = option(deadline);
    let doc = documentation(&input.attrs);
    for item in [
        quote!(const NAME: &'static str = #name;),
        quote!(const DOC: &'static str = #doc;),
        quote!(const STAGE: #root::Stage = #root::Stage::#stage;),
        quote! {
            fn spec() -> #root::Spec {
                #root::Spec { trigger: #trigger, deadline: #deadline, unique: #unique }
            }
        },
    ] {
        input.items.push(syn::parse2::<ImplItem>(item)?);
    }
    let creates = input
        .items
        .iter()
        .any(|item| matches!(item, ImplItem::Fn(function) if function.sig.ident == "create"));
    if !creates {
        input.items.push(syn::parse2::<ImplItem>(quote! {
            fn create(
                _: &#root::Setup<'_>,
                _: &Self::Params,
            ) -> ::core::result::Result<Self::State, #root::Refusal> {
                ::core::result::Result::Ok(::core::default::Default::default())
            }
        })?);
    }
    input.items.iter_mut().for_each(inline_tick);
    Ok(quote!(#input))
}

/// Lets the compiler inline a tick where the host's call of it is made.
fn inline_tick(item: &mut ImplItem) {
    if let ImplItem::Fn(function) = item
        && function.sig.ident == "tick"
        && !function.attrs.iter().any(|attribute| attribute.path().is_ident("inline"))
    {
        function.attrs.push(syn::parse_quote!(#[inline]));
    }
}

fn port_names(on: &Expr) -> Result<Vec<String>> {
    let name = |expression: &Expr| match expression {
        Expr::Path(path) => path.path.get_ident().map(ToString::to_string).ok_or(()),
        _ => Err(()),
    };
    let wrong =
        |_| Error::new_spanned(on, "expected a port or a list of ports, such as `on = [scans, odometry]`");
    match on {
        Expr::Array(list) => {
            list.elems.iter().map(name).collect::<std::result::Result<_, _>>().map_err(wrong)
        }
        other => Ok(vec![name(other).map_err(wrong)?]),
    }
}

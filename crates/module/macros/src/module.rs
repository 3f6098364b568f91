use proc_macro2::TokenStream as Tokens;
use quote::quote;
use syn::{Error, Expr, ImplItem, ItemImpl, LitStr, Result};

use crate::attributes::{documentation, snake_case};
use crate::ports::nanoseconds;
use crate::root;

pub fn expand(arguments: Tokens, item: Tokens) -> Result<Tokens> {
    let root = root();
    let mut stage = None;
    let mut every = None;
    let mut on: Option<Vec<String>> = None;
    let mut timeout = None;
    let mut deadline = None;
    let mut name = None;
    let mut unique = String::new();
    let parser = syn::meta::parser(|meta| {
        if meta.path.is_ident("stage") {
            stage = Some(meta.value()?.parse::<syn::Ident>()?);
        } else if meta.path.is_ident("every") {
            every = Some(nanoseconds(&meta.value()?.parse()?)?);
        } else if meta.path.is_ident("timeout") {
            timeout = Some(nanoseconds(&meta.value()?.parse()?)?);
        } else if meta.path.is_ident("deadline") {
            deadline = Some(nanoseconds(&meta.value()?.parse()?)?);
        } else if meta.path.is_ident("name") {
            name = Some(meta.value()?.parse::<LitStr>()?.value());
        } else if meta.path.is_ident("unique") {
            unique = meta.value()?.parse::<LitStr>()?.value();
        } else if meta.path.is_ident("on") {
            on = Some(port_names(&meta.value()?.parse()?)?);
        } else {
            return Err(
                meta.error("expected `stage`, `every`, `on`, `timeout`, `deadline`, `name` or `unique`")
            );
        }
        Ok(())
    });
    syn::parse::Parser::parse2(parser, arguments)?;
    let mut input: ItemImpl = syn::parse2(item)?;
    if every.is_some() && on.is_some() {
        return Err(Error::new_spanned(&input.self_ty, "a module has one trigger: `every` or `on`"));
    }
    let type_name = match &*input.self_ty {
        syn::Type::Path(path) => path.path.segments.last().map(|segment| segment.ident.to_string()),
        _ => None,
    };
    let name = name.or(type_name.map(|name| snake_case(&name)));
    let name = name.ok_or_else(|| Error::new_spanned(&input.self_ty, "give it a `name`"))?;
    let stage = stage.ok_or_else(|| {
        Error::new_spanned(
            &input.self_ty,
            "say which `stage` of the main loop it belongs to, such as `stage = Act`",
        )
    })?;
    let option = |value: Option<u64>| match value {
        Some(value) => quote!(::core::option::Option::Some(#value)),
        None => quote!(::core::option::Option::None),
    };
    let timeout = option(timeout);
    let deadline = option(deadline);
    let trigger = match (every, on) {
        (Some(period), _) => quote!(#root::Trigger::Every(#period)),
        (None, Some(ports)) => quote!(#root::Trigger::On {
            ports: ::std::vec![#(::std::string::String::from(#ports)),*], timeout: #timeout }),
        (None, None) => quote!(#root::Trigger::Stage),
    };
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
    Ok(quote!(#input))
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

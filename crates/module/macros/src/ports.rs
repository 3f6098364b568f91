use proc_macro2::TokenStream as Tokens;
use quote::quote;
use syn::{
    Error, Expr, Field, Fields, GenericArgument, ItemStruct, LitInt, LitStr, PathArguments, Result, Type,
};

use crate::attributes::{documentation, take};
use crate::root;

pub fn expand(item: Tokens) -> Result<Tokens> {
    let root = root();
    let mut input: ItemStruct = syn::parse2(item)?;
    let name = input.ident.clone();
    let (implementation, generics, conditions) = input.generics.split_for_impl();
    let (implementation, generics, conditions) =
        (quote!(#implementation), quote!(#generics), quote!(#conditions));
    let Fields::Named(fields) = &mut input.fields else {
        return Err(Error::new(name.span(), "ports have names"));
    };
    let mut descriptions = Vec::new();
    let mut outlines = Vec::new();
    let mut bindings = Vec::new();
    let mut stale_inputs = Vec::new();
    let types: Vec<_> = fields.named.iter().map(|field| attachment_type(&field.ty).to_string()).collect();
    let mut has = Vec::new();
    for field in &mut fields.named {
        let Some(port) = field.ident.clone() else { continue };
        let text = port.to_string();
        let doc = documentation(&field.attrs);
        let (options, stale) = options(field)?;
        let kind = &field.ty;
        if let Some(after) = stale {
            stale_inputs.push(quote! {
                if let ::core::option::Option::Some(stamp) = #root::Port::stale_since(&self.#port) {
                    return ::core::option::Option::Some(#root::StaleInput { name: #text, stamp, after: #after });
                }
            });
        }
        outlines.push(quote!(#root::PortOutline { name: #text, carries: <#kind as #root::Port>::CARRIES }));
        descriptions.push(quote! {{
            #[allow(unused_mut)]
            let mut port = <#kind as #root::Port>::describe(#text, #doc);
            #options
            ports.push(port);
        }});
        // SAFETY in the generated code: the order of binding is the order of description.
        bindings.push(quote!(#port: unsafe { <#kind as #root::Port>::bind(cursor) }));
        let attachment_type = attachment_type(kind);
        let spelled = attachment_type.to_string();
        if types.iter().filter(|other| **other == spelled).count() == 1 {
            has.push(quote! {
                impl #implementation #root::HasPort<#attachment_type> for #name #generics #conditions {
                    const PORT: &'static str = #text;
                }
            });
        }
    }
    Ok(quote! {
        #input

        #[allow(unsafe_code)]
        impl #implementation #root::Ports for #name #generics #conditions {
            const OUTLINE: #root::PortList = #root::PortList::Ports(&[#(#outlines),*]);

            fn describe() -> ::std::vec::Vec<#root::PortDescription> {
                #[allow(unused_mut)]
                let mut ports = ::std::vec::Vec::new();
                #(#descriptions)*
                ports
            }

            #[inline]
            unsafe fn bind(cursor: &mut #root::PortCursor) -> Self {
                let _ = &cursor;
                Self { #(#bindings),* }
            }

            fn stale_input(&self) -> ::core::option::Option<#root::StaleInput> {
                #(#stale_inputs)*
                ::core::option::Option::None
            }
        }

        #(#has)*
    })
}

/// Returns the type by which blocks are attached to the port.
/// It is that of an input also for a required input, and for an input of a Sensor.
fn attachment_type(kind: &Type) -> Tokens {
    let root = root();
    match kind {
        Type::Path(path) if ["Input", "Required", "Sensed"].iter().any(|name| is_named(path, name)) => {
            match argument(kind) {
                Ok(interface) => quote!(#root::Input<#interface>),
                Err(_) => quote!(#kind),
            }
        }
        _ => quote!(#kind),
    }
}

fn is_named(path: &syn::TypePath, name: &str) -> bool {
    path.path.segments.last().is_some_and(|last| last.ident == name)
}

/// Returns the statements that apply a field's attributes to `port`.
/// Also returns the age from which its value is stale, ns.
fn options(field: &mut Field) -> Result<(Tokens, Option<u64>)> {
    let root = root();
    let mut statements = Tokens::new();
    let mut stale_after = None;
    if let Some(stale) = take(&mut field.attrs, "stale") {
        let mut after = None;
        stale.parse_nested_meta(|meta| {
            if !meta.path.is_ident("after") {
                return Err(meta.error("expected `after = \"200ms\"`"));
            }
            after = Some(meta.value()?.parse::<LitStr>()?);
            Ok(())
        })?;
        let after =
            nanoseconds(&after.ok_or_else(|| Error::new_spanned(&stale, "expected `after = \"200ms\"`"))?)?;
        statements.extend(quote!(port.stale_after = ::core::option::Option::Some(#after);));
        stale_after = Some(after);
    }
    if let Some(safe) = take(&mut field.attrs, "safe") {
        let value: Expr = safe.parse_args()?;
        let interface = argument(&field.ty)?;
        statements.extend(quote! {
            let mut safe: #interface = #value;
            port.safe = ::core::option::Option::Some(
                #root::blackboard::interface::View::of::<#interface>(&mut safe).bytes().to_vec());
        });
    }
    if let Some(role) = take(&mut field.attrs, "role") {
        let role: LitStr = role.parse_args()?;
        statements.extend(quote!(port.role = ::std::string::String::from(#role);));
    }
    for option in ["capacity", "window"] {
        if let Some(attribute) = take(&mut field.attrs, option) {
            let number: LitInt = attribute.parse_args()?;
            let name = syn::Ident::new(
                option,
                attribute.path().get_ident().map_or_else(proc_macro2::Span::call_site, syn::Ident::span),
            );
            statements.extend(quote!(port.#name = #number;));
        }
    }
    Ok((statements, stale_after))
}

/// Returns `T` of `Output<T>`.
fn argument(kind: &Type) -> Result<Type> {
    if let Type::Path(path) = kind
        && let Some(last) = path.path.segments.last()
        && let PathArguments::AngleBracketed(arguments) = &last.arguments
        && let Some(GenericArgument::Type(argument)) = arguments.args.first()
    {
        return Ok(argument.clone());
    }
    Err(Error::new_spanned(kind, "expected a port such as `Output<Twist2>`"))
}

/// Parses a duration such as `20ms`, ns.
pub fn nanoseconds(text: &LitStr) -> Result<u64> {
    let value = text.value();
    let wrong = || Error::new(text.span(), "expected a duration such as \"20ms\" (ns, us, ms, s, min)");
    let split = value.find(|c: char| c.is_ascii_alphabetic()).ok_or_else(wrong)?;
    let number: f64 = value[..split].trim().parse().map_err(|_| wrong())?;
    let unit = match &value[split..] {
        "ns" => 1.0,
        "us" => 1e3,
        "ms" => 1e6,
        "s" => 1e9,
        "min" => 60e9,
        _ => return Err(wrong()),
    };
    Ok((number * unit).round() as u64)
}

use proc_macro2::TokenStream as Tokens;
use quote::quote;
use syn::{
    Data, DeriveInput, Error, Expr, ExprArray, ExprRange, Field, LitStr, RangeLimits, Result, Type,
    Visibility,
};

use crate::attributes::take;
use crate::root;
use crate::structure::structure;

pub fn expand(item: Tokens) -> Result<Tokens> {
    let root = root();
    let mut input: DeriveInput = syn::parse2(item)?;
    let name = input.ident.clone();
    let Data::Struct(data) = &mut input.data else {
        return Err(Error::new(name.span(), "parameters are a struct"));
    };
    let mut defaults = Vec::new();
    let mut parameters = Vec::new();
    for field in &mut data.fields {
        let Some(field_name) = field.ident.clone() else {
            return Err(Error::new(name.span(), "parameters have names"));
        };
        publish(field, &input.vis);
        let ParamAttribute { default, range, follows } = ParamAttribute::take(field)?;
        let kind = &field.ty;
        let value = match default {
            Some(value) if is_number(kind) => quote!(#value),
            Some(value) => quote!(::core::convert::Into::into(#value)),
            None => quote!(::core::default::Default::default()),
        };
        defaults.push(quote!(#field_name: #value));
        let range = match range {
            Some(ExprRange { start: Some(low), end: Some(high), limits: RangeLimits::Closed(_), .. }) => {
                quote!(::core::option::Option::Some((#low as f64, #high as f64)))
            }
            Some(other) => {
                return Err(Error::new_spanned(other, "expected a closed range such as `0.0..=5.0`"));
            }
            None => quote!(::core::option::Option::None),
        };
        let text = field_name.to_string();
        parameters.push(quote! {
            #root::Parameter {
                name: ::std::string::String::from(#text),
                default: default.get(#text).cloned().unwrap_or(#root::blackboard::interface::Value::Null),
                range: #range,
                follows: ::std::vec![#(::std::string::String::from(#follows)),*],
            }
        });
    }
    let structure = structure(input, "", false)?;
    Ok(quote! {
        #structure

        impl ::core::default::Default for #name {
            fn default() -> Self {
                Self { #(#defaults),* }
            }
        }

        impl #root::Params for #name {
            fn parameters() -> ::std::vec::Vec<#root::Parameter> {
                let default = #root::blackboard::interface::View::of(&mut Self::default()).value();
                let _ = &default;
                ::std::vec![#(#parameters),*]
            }
        }
    })
}

/// Arguments of a field's attribute `#[param]`.
#[derive(Default)]
struct ParamAttribute {
    default: Option<Expr>,
    range: Option<ExprRange>,
    follows: Vec<LitStr>,
}

impl ParamAttribute {
    /// Takes the attribute from a field.
    /// The field gets unit and description as attributes of their own.
    fn take(field: &mut Field) -> Result<Self> {
        let mut read = Self::default();
        let Some(attribute) = take(&mut field.attrs, "param") else { return Ok(read) };
        attribute.parse_nested_meta(|meta| {
            if meta.path.is_ident("default") {
                read.default = Some(meta.value()?.parse()?);
            } else if meta.path.is_ident("range") {
                read.range = Some(meta.value()?.parse()?);
            } else if meta.path.is_ident("follows") {
                let list: ExprArray = meta.value()?.parse()?;
                read.follows =
                    list.elems.iter().map(|item| syn::parse2(quote!(#item))).collect::<Result<_>>()?;
            } else if meta.path.is_ident("unit") {
                let unit: LitStr = meta.value()?.parse()?;
                field.attrs.push(syn::parse_quote!(#[unit(#unit)]));
            } else if meta.path.is_ident("doc") {
                let doc: LitStr = meta.value()?.parse()?;
                field.attrs.push(syn::parse_quote!(#[doc = #doc]));
            } else {
                return Err(meta.error("expected `default`, `range`, `follows`, `unit` or `doc`"));
            }
            Ok(())
        })?;
        Ok(read)
    }
}

/// Gives a private field the visibility of its struct.
/// Configurations and programs set parameters, which are for users.
fn publish(field: &mut Field, visibility: &Visibility) {
    if matches!(field.vis, Visibility::Inherited) {
        field.vis = visibility.clone();
    }
}

fn is_number(kind: &Type) -> bool {
    const NUMBERS: [&str; 10] = ["u8", "u16", "u32", "u64", "i8", "i16", "i32", "i64", "f32", "f64"];
    matches!(kind, Type::Path(path) if NUMBERS.iter().any(|name| path.path.is_ident(name)))
}

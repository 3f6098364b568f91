use proc_macro2::TokenStream as Tokens;
use quote::{format_ident, quote};
use syn::spanned::Spanned;
use syn::{Data, DeriveInput, Error, Fields, LitStr, Result};

use crate::attributes::{documentation, snake_case, take};
use crate::root;
use crate::structure::structure;

pub fn expand(arguments: Tokens, item: Tokens) -> Result<Tokens> {
    let mut ros = String::new();
    let parser = syn::meta::parser(|meta| {
        if meta.path.is_ident("ros") {
            ros = meta.value()?.parse::<LitStr>()?.value();
            return Ok(());
        }
        Err(meta.error("expected `ros = \"package/msg/Name\"`"))
    });
    syn::parse::Parser::parse2(parser, arguments)?;
    let input: DeriveInput = syn::parse2(item)?;
    if !input.generics.params.is_empty() {
        return Err(Error::new(input.generics.span(), "an interface has no generic parameters"));
    }
    match &input.data {
        Data::Struct(_) => structure(input, &ros, true),
        Data::Enum(_) => enumeration(input),
        Data::Union(_) => Err(Error::new(input.ident.span(), "an interface is a struct or an enum")),
    }
}

fn enumeration(mut input: DeriveInput) -> Result<Tokens> {
    let root = root();
    let name = &input.ident;
    let name_text = name.to_string();
    let carrier: syn::Ident = match take(&mut input.attrs, "repr") {
        Some(repr) => repr.parse_args()?,
        None => format_ident!("u8"),
    };
    let attributes = &input.attrs;
    let visibility = &input.vis;
    let Data::Enum(data) = &input.data else {
        return Err(Error::new(name.span(), "expected an enum"));
    };
    let mut constants = Vec::new();
    let mut entries = Vec::new();
    let mut arms = Vec::new();
    for (i, variant) in data.variants.iter().enumerate() {
        if !matches!(variant.fields, Fields::Unit) {
            return Err(Error::new(variant.span(), "the constants of an interface's enum carry no fields"));
        }
        let constant = format_ident!("{}", snake_case(&variant.ident.to_string()).to_uppercase());
        let text = constant.to_string();
        let doc = documentation(&variant.attrs);
        let value = match &variant.discriminant {
            Some((_, value)) => quote!(#value),
            None => {
                let index = proc_macro2::Literal::usize_unsuffixed(i);
                quote!(#index)
            }
        };
        constants.push(quote!(#[doc = #doc] pub const #constant: Self = Self(#value);));
        entries.push(quote!(interface::Constant { name: #text, value: #value, doc: #doc }));
        arms.push(quote!(Self::#constant => #text));
    }
    Ok(quote! {
        #(#attributes)*
        #[repr(transparent)]
        #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
        #visibility struct #name(pub #carrier);

        impl #name {
            #(#constants)*

            /// Returns the constant's name; empty for a value without one.
            pub const fn name(self) -> &'static str {
                match self { #(#arms,)* _ => "" }
            }
        }

        impl ::core::fmt::Debug for #name {
            fn fmt(&self, f: &mut ::core::fmt::Formatter<'_>) -> ::core::fmt::Result {
                match self.name() {
                    "" => ::core::write!(f, "{}({})", #name_text, self.0),
                    name => f.write_str(name),
                }
            }
        }

        #[allow(unsafe_code)]
        const _: () = {
            use #root::blackboard::interface;

            // SAFETY: a transparent integer, of which every value is valid.
            unsafe impl interface::Plain for #name {
                const KIND: interface::Kind = interface::Kind::Enumeration(&interface::Enumeration {
                    name: #name_text,
                    carrier: <#carrier as interface::Plain>::KIND,
                    constants: &[#(#entries),*],
                });
            }
        };
    })
}

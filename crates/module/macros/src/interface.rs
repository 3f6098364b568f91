use proc_macro2::TokenStream as Tokens;
use quote::{format_ident, quote};
use syn::spanned::Spanned;
use syn::{Data, DeriveInput, Error, Fields, LitStr, Result, Type};

use crate::attributes::{documentation, snake_case, take, take_unit};
use crate::root;

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

/// A struct with its descriptor; `default` says whether all zero is its default.
pub fn structure(mut input: DeriveInput, ros: &str, default: bool) -> Result<Tokens> {
    let root = root();
    let name = input.ident.clone();
    let name_text = name.to_string();
    if let Some(repr) = input.attrs.iter().find(|attribute| attribute.path().is_ident("repr")) {
        return Err(Error::new_spanned(repr, "the macro lays an interface out; it has no `repr` of its own"));
    }
    let doc = documentation(&input.attrs);
    let Data::Struct(data) = &mut input.data else {
        return Err(Error::new(name.span(), "expected a struct"));
    };
    let fields = match &mut data.fields {
        Fields::Named(fields) => fields.named.iter_mut().collect::<Vec<_>>(),
        Fields::Unit | Fields::Unnamed(_) => {
            return Err(Error::new(name.span(), "the fields of an interface have names"));
        }
    };
    let last = fields.len().wrapping_sub(1);
    let mut names = Vec::new();
    let mut types = Vec::new();
    let mut entries = Vec::new();
    let mut tail = None;
    let mut tail_name = (String::new(), None);
    let head = format_ident!("Head");
    for (i, field) in fields.into_iter().enumerate() {
        let unit = take_unit(&mut field.attrs)?;
        let field_doc = documentation(&field.attrs);
        let Some(field_name) = field.ident.clone() else { continue };
        let text = field_name.to_string();
        if let Type::Slice(slice) = &field.ty {
            if i != last {
                return Err(Error::new(field.ty.span(), "only the last field may be a slice: the tail"));
            }
            let item = &*slice.elem;
            entries.push(quote! {
                interface::Field {
                    name: #text, doc: #field_doc, unit: #unit, offset: ::core::mem::size_of::<#head>(),
                    kind: interface::Kind::Tail(&<#item as interface::Plain>::KIND),
                }
            });
            tail = Some(item.clone());
            tail_name = (text, Some(field_name));
            continue;
        }
        let kind = &field.ty;
        entries.push(quote! {
            interface::Field {
                name: #text, doc: #field_doc, unit: #unit, offset: ::core::mem::offset_of!(#head, #field_name),
                kind: <#kind as interface::Plain>::KIND,
            }
        });
        names.push(field_name);
        types.push(field.ty.clone());
    }
    let derives = if tail.is_some() { quote!() } else { quote!(#[derive(Clone, Copy, Debug)]) };
    let tail_alignment = tail.as_ref().map(|item| quote!(tail: [#item; 0]));
    if let (Some(item), Fields::Named(fields)) = (&tail, &mut data.fields) {
        align_tail(fields, &types, item, &root);
    }
    let (tail_name, tail_field) = tail_name;
    let access = match &tail {
        Some(_) => quote! {
            impl ::core::fmt::Debug for #name {
                fn fmt(&self, f: &mut ::core::fmt::Formatter<'_>) -> ::core::fmt::Result {
                    f.debug_struct(#name_text)
                        #(.field(::core::stringify!(#names), &self.#names))*
                        .field(#tail_name, &&self.#tail_field)
                        .finish()
                }
            }

            // SAFETY: `repr(C)` with plain fields, and a tail that begins where the head ends.
            unsafe impl interface::Interface for #name {
                const DESCRIPTOR: &'static interface::Descriptor = DESCRIPTOR;

                unsafe fn from_raw<'a>(data: *const u8, items: usize) -> &'a Self {
                    // SAFETY: passed on to the caller.
                    unsafe { &*(::core::ptr::slice_from_raw_parts(data, items) as *const Self) }
                }

                unsafe fn from_raw_mut<'a>(data: *mut u8, items: usize) -> &'a mut Self {
                    // SAFETY: passed on to the caller.
                    unsafe { &mut *(::core::ptr::slice_from_raw_parts_mut(data, items) as *mut Self) }
                }
            }
        },
        None => quote! {
            // SAFETY: `repr(C)` with plain fields, the same as of the head.
            unsafe impl interface::Interface for #name {
                const DESCRIPTOR: &'static interface::Descriptor = DESCRIPTOR;

                unsafe fn from_raw<'a>(data: *const u8, _: usize) -> &'a Self {
                    // SAFETY: passed on to the caller.
                    unsafe { &*data.cast::<Self>() }
                }

                unsafe fn from_raw_mut<'a>(data: *mut u8, _: usize) -> &'a mut Self {
                    // SAFETY: passed on to the caller.
                    unsafe { &mut *data.cast::<Self>() }
                }
            }

            // SAFETY: as for the interface.
            unsafe impl interface::Plain for #name {
                const KIND: interface::Kind = interface::Kind::Nested(DESCRIPTOR);
            }
        },
    };
    let zero = (default && tail.is_none()).then(|| {
        quote! {
            /// All zero.
            impl ::core::default::Default for #name {
                fn default() -> Self {
                    // SAFETY: every bit pattern of an interface is valid.
                    unsafe { ::core::mem::zeroed() }
                }
            }
        }
    });
    Ok(quote! {
        #[repr(C)]
        #derives
        #input

        #[allow(unsafe_code)]
        const _: () = {
            use #root::blackboard::interface;

            #[repr(C)]
            struct #head { #(#names: #types,)* #tail_alignment }
            const FIELDS: &[interface::Field] = &[#(#entries),*];
            const DESCRIPTOR: &interface::Descriptor = &interface::Descriptor {
                name: #name_text,
                doc: #doc,
                ros: #ros,
                fields: FIELDS,
                size: ::core::mem::size_of::<#head>(),
                align: ::core::mem::align_of::<#head>(),
                hash: interface::schema_hash(#name_text, FIELDS),
            };
            #access
            #zero
        };
    })
}

/// Lets the tail begin where the head ends, its padding included: fields of a struct with a tail are written in place, so
/// that nobody names this one.
fn align_tail(fields: &mut syn::FieldsNamed, types: &[Type], item: &Type, root: &Tokens) {
    let Some(tail) = fields.named.pop() else { return };
    let gap: syn::Field = syn::parse_quote! {
        #[doc(hidden)]
        __gap: [u8; #root::blackboard::interface::gap_before_tail(
            &[#((::core::mem::size_of::<#types>(), ::core::mem::align_of::<#types>())),*],
            ::core::mem::align_of::<#item>(),
        )]
    };
    fields.named.push(gap);
    fields.named.push(tail);
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

            /// The constant's name; empty for a value without one.
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

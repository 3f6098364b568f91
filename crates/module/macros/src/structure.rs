//! Struct as an interface: its descriptor, and the access to its memory.

use proc_macro2::TokenStream as Tokens;
use quote::{format_ident, quote};
use syn::ext::IdentExt;
use syn::spanned::Spanned;
use syn::{Data, DeriveInput, Error, Field, Fields, Ident, Result, Type};

use crate::attributes::{documentation, take_unit};
use crate::root;

/// Generates a struct with its descriptor; `default` if all zero is its default.
pub fn structure(mut input: DeriveInput, ros: &str, default: bool) -> Result<Tokens> {
    let root = root();
    let name = input.ident.clone();
    let name_text = name.to_string();
    if let Some(repr) = input.attrs.iter().find(|attribute| attribute.path().is_ident("repr")) {
        return Err(Error::new_spanned(repr, "the macro lays an interface out; it has no `repr` of its own"));
    }
    let doc = documentation(&input.attrs);
    let layout = FieldLayout::take(&mut input, &root)?;
    let derives = if layout.tail.is_some() { quote!() } else { quote!(#[derive(Clone, Copy, Debug)]) };
    let access = match &layout.tail {
        Some(tail) => layout.tailed_access(&name, tail),
        None => plain_access(&name),
    };
    let zero = (default && layout.tail.is_none()).then(|| zero_default(&name));
    let FieldLayout { names, types, entries, tail } = &layout;
    let tail_alignment = tail.as_ref().map(|TailField { item, .. }| quote!(tail: [#item; 0]));
    let head = head();
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

/// Returns the name of the struct of all fields but the tail.
fn head() -> Ident {
    format_ident!("Head")
}

/// Fields of an interface.
struct FieldLayout {
    /// Names of all fields but the tail.
    names: Vec<Ident>,
    /// Their types.
    types: Vec<Type>,
    /// Entries of the descriptor, one for each field.
    entries: Vec<Tokens>,
    tail: Option<TailField>,
}

/// Tail: the last field, if it is a slice.
struct TailField {
    name: Ident,
    item: Type,
}

impl FieldLayout {
    /// Takes the fields of a struct, and removes the attributes for this macro alone.
    fn take(input: &mut DeriveInput, root: &Tokens) -> Result<Self> {
        let name = input.ident.clone();
        let Data::Struct(data) = &mut input.data else {
            return Err(Error::new(name.span(), "expected a struct"));
        };
        let Fields::Named(fields) = &mut data.fields else {
            return Err(Error::new(name.span(), "the fields of an interface have names"));
        };
        let mut layout = Self { names: Vec::new(), types: Vec::new(), entries: Vec::new(), tail: None };
        for field in &mut fields.named {
            layout.add(field)?;
        }
        if let Some(TailField { item, .. }) = &layout.tail {
            align_tail(fields, &layout.types, item, root);
        }
        Ok(layout)
    }

    fn add(&mut self, field: &mut Field) -> Result<()> {
        if let Some(TailField { item, .. }) = &self.tail {
            return Err(Error::new(item.span(), "only the last field may be a slice: the tail"));
        }
        let unit = take_unit(&mut field.attrs)?;
        let doc = documentation(&field.attrs);
        let Some(name) = field.ident.clone() else { return Ok(()) };
        let (text, head) = (name.unraw().to_string(), head());
        if let Type::Slice(slice) = &field.ty {
            let item = (*slice.elem).clone();
            self.entries.push(quote! {
                interface::Field {
                    name: #text, doc: #doc, unit: #unit, offset: ::core::mem::size_of::<#head>(),
                    kind: interface::Kind::Tail(&<#item as interface::Plain>::KIND),
                }
            });
            self.tail = Some(TailField { name, item });
            return Ok(());
        }
        let kind = &field.ty;
        self.entries.push(quote! {
            interface::Field {
                name: #text, doc: #doc, unit: #unit, offset: ::core::mem::offset_of!(#head, #name),
                kind: <#kind as interface::Plain>::KIND,
            }
        });
        self.names.push(name);
        self.types.push(field.ty.clone());
        Ok(())
    }

    /// Generates the memory access of an interface with a tail.
    fn tailed_access(&self, name: &Ident, tail: &TailField) -> Tokens {
        let (names, tail_field, name_text) = (&self.names, &tail.name, name.to_string());
        let tail_name = tail_field.unraw().to_string();
        quote! {
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

                #[inline]
                unsafe fn from_raw<'a>(data: *const u8, items: usize) -> &'a Self {
                    // SAFETY: passed on to the caller.
                    unsafe { &*(::core::ptr::slice_from_raw_parts(data, items) as *const Self) }
                }

                #[inline]
                unsafe fn from_raw_mut<'a>(data: *mut u8, items: usize) -> &'a mut Self {
                    // SAFETY: passed on to the caller.
                    unsafe { &mut *(::core::ptr::slice_from_raw_parts_mut(data, items) as *mut Self) }
                }
            }
        }
    }
}

/// Generates the memory access of an interface without a tail.
fn plain_access(name: &Ident) -> Tokens {
    quote! {
        // SAFETY: `repr(C)` with plain fields, the same as of the head.
        unsafe impl interface::Interface for #name {
            const DESCRIPTOR: &'static interface::Descriptor = DESCRIPTOR;

            #[inline]
            unsafe fn from_raw<'a>(data: *const u8, _: usize) -> &'a Self {
                // SAFETY: passed on to the caller.
                unsafe { &*data.cast::<Self>() }
            }

            #[inline]
            unsafe fn from_raw_mut<'a>(data: *mut u8, _: usize) -> &'a mut Self {
                // SAFETY: passed on to the caller.
                unsafe { &mut *data.cast::<Self>() }
            }
        }

        // SAFETY: as for the interface.
        unsafe impl interface::Plain for #name {
            const KIND: interface::Kind = interface::Kind::Nested(DESCRIPTOR);
        }
    }
}

fn zero_default(name: &Ident) -> Tokens {
    quote! {
        /// All zero.
        impl ::core::default::Default for #name {
            fn default() -> Self {
                // SAFETY: every bit pattern of an interface is valid.
                unsafe { ::core::mem::zeroed() }
            }
        }
    }
}

/// Adds a hidden field so that the tail begins at the end of the head.
/// The end includes the head's padding. Fields of a struct with a tail are written in place, so that no code names the
/// hidden one.
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

//! Attributes that the macros read.

use syn::{Attribute, Expr, ExprLit, Lit, LitStr, Meta};

/// Returns the text of the documentation comments, one line after the other.
pub fn documentation(attributes: &[Attribute]) -> String {
    let mut lines = Vec::new();
    for attribute in attributes {
        if let Meta::NameValue(pair) = &attribute.meta
            && pair.path.is_ident("doc")
            && let Expr::Lit(ExprLit { lit: Lit::Str(text), .. }) = &pair.value
        {
            lines.push(text.value().trim().to_owned());
        }
    }
    lines.join(" ").trim().to_owned()
}

/// Takes the attribute of that name out of the list.
pub fn take(attributes: &mut Vec<Attribute>, name: &str) -> Option<Attribute> {
    let index = attributes.iter().position(|attribute| attribute.path().is_ident(name))?;
    Some(attributes.remove(index))
}

/// Takes `#[unit("m")]` out of the list.
pub fn take_unit(attributes: &mut Vec<Attribute>) -> syn::Result<String> {
    take(attributes, "unit").map_or(Ok(String::new()), |unit| Ok(unit.parse_args::<LitStr>()?.value()))
}

/// Converts to snake case: `FollowPath` to `follow_path`.
pub fn snake_case(name: &str) -> String {
    let mut result = String::new();
    let mut before_lower = false;
    for letter in name.chars() {
        if letter.is_uppercase() && before_lower {
            result.push('_');
        }
        before_lower = letter.is_lowercase() || letter.is_ascii_digit();
        result.extend(letter.to_lowercase());
    }
    result
}

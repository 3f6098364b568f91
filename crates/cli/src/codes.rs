//! Error codes such as `S006`.

use serde_json::{Value, json};
use slate::runtime::ErrorCode;
use slate::runtime::configuration::{EXPLANATIONS, Explanation};

use crate::failure::Failure;
use crate::output;

/// Finds the explanation of a code; leading zeros are optional, so S7 is S007.
fn find(code: &str) -> Option<&'static Explanation> {
    let number: Option<u16> = code.strip_prefix(['S', 's']).and_then(|digits| digits.parse().ok());
    ErrorCode::from_code(code).or_else(|| ErrorCode::from_code(&format!("S{:03}", number?)))?.explanation()
}

/// Returns the explanation of a code as JSON, if the code exists.
#[cfg(feature = "mcp")]
pub fn explained(code: &str) -> Option<Value> {
    find(code).map(document)
}

fn document(explanation: &Explanation) -> Value {
    let Explanation { error_code, title, text } = explanation;
    json!({"code": error_code.code(), "title": title, "explanation": text})
}

/// Explains codes, or lists all.
pub fn explain(wanted: &[String], json: bool) -> Result<bool, Failure> {
    let find = |code: &String| find(code).ok_or_else(|| Failure::NoCode { code: code.clone() });
    let chosen: Vec<_> = match wanted {
        [] => EXPLANATIONS.iter().collect(),
        wanted => wanted.iter().map(find).collect::<Result<_, _>>()?,
    };
    if json {
        let codes: Vec<_> = chosen.into_iter().map(document).collect();
        output::json(&json!({"schema": "slate.explain/1", "codes": codes}));
    } else if wanted.is_empty() {
        output::columns(
            chosen.into_iter().map(|one| [one.error_code.code().to_owned(), one.title.to_owned()]),
        );
    } else {
        for Explanation { error_code, title, text } in chosen {
            output::line(format_args!("{}: {title}\n\n{text}\n", error_code.code()));
        }
    }
    Ok(true)
}

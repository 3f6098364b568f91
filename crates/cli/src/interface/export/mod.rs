//! Headers with interfaces for modules in C and C++.

mod c;
mod cpp;
mod reserved_word;

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use slate::blackboard::interface::{Descriptor, Enumeration, Kind};
use slate::blackboard::nearest_names;
use slate::interfaces;

use crate::failure::Failure;
use reserved_word::is_word_of_c;

/// Language of a header.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum HeaderLanguage {
    /// C11
    C,
    /// C++17
    Cpp,
}

#[derive(Debug, Args)]
pub struct ExportInterface {
    /// Interfaces, such as `Position`; those of their fields are added
    #[arg(required = true)]
    names: Vec<String>,

    /// Language of the header
    #[arg(long, short, value_enum, default_value_t = HeaderLanguage::Cpp)]
    language: HeaderLanguage,

    /// Rust source of interfaces that don't come with Slate
    #[arg(long, value_name = "FILE")]
    source: Option<PathBuf>,

    /// New file [default: stdout]
    #[arg(long, short, value_name = "FILE")]
    pub out: Option<PathBuf>,

    /// Replace an existing file
    #[arg(long, requires = "out")]
    pub force: bool,
}

/// Returns the header that the options ask for.
pub fn export(options: &ExportInterface) -> Result<String, Failure> {
    let own = options.source.as_deref().map(super::read_some).transpose()?.unwrap_or_default();
    let mut known: Vec<_> = own.iter().map(|found| found.descriptor).collect();
    known.extend(interfaces::ALL);
    let names: Vec<_> = options.names.iter().map(String::as_str).collect();
    header(options.language, &names, &known, options.source.as_deref())
}

/// Returns a header with interfaces that come with Slate.
pub fn well_known(language: HeaderLanguage, names: &[&str]) -> Result<String, Failure> {
    header(language, names, interfaces::ALL, None)
}

fn header(
    language: HeaderLanguage,
    names: &[&str],
    known: &[&'static Descriptor],
    source: Option<&Path>,
) -> Result<String, Failure> {
    let mut types = HeaderTypes::default();
    for name in names {
        let found = known.iter().find(|descriptor| descriptor.name == *name).ok_or_else(|| {
            let mut all: Vec<_> = known.iter().map(|descriptor| descriptor.name).collect();
            all.sort_unstable();
            Failure::Interface { place: (*name).to_owned(), problem: no_interface(name, &all) }
        })?;
        types.add(found);
    }
    match language {
        HeaderLanguage::C => c::header(&origin(names, "c", source), &types),
        HeaderLanguage::Cpp => Ok(cpp::header(&origin(names, "cpp", source), &types)),
    }
}

/// Types of a header, each after those that it has fields of.
#[derive(Debug, Default)]
struct HeaderTypes {
    enumerations: Vec<&'static Enumeration>,
    structs: Vec<&'static Descriptor>,
}

impl HeaderTypes {
    fn add(&mut self, descriptor: &'static Descriptor) {
        if self.structs.iter().any(|known| known.name == descriptor.name) {
            return;
        }
        for field in descriptor.fields {
            self.add_kind(&field.kind);
        }
        self.structs.push(descriptor);
    }

    fn add_kind(&mut self, kind: &'static Kind) {
        match kind {
            Kind::Primitive(_) | Kind::Text(_) => {}
            Kind::Enumeration(enumeration) => {
                if !self.enumerations.iter().any(|known| known.name == enumeration.name) {
                    self.enumerations.push(enumeration);
                }
            }
            Kind::Optional(item) | Kind::Array(item, _) | Kind::Sequence(item, _) | Kind::Tail(item) => {
                self.add_kind(item);
            }
            Kind::Nested(descriptor) => self.add(descriptor),
        }
    }
}

/// Returns the comment in the first line of a header.
fn origin(names: &[&str], language: &str, source: Option<&Path>) -> String {
    let source = source.map(|file| format!(" --source {}", file.display())).unwrap_or_default();
    format!(
        "Made by `slate interface export {}{source} --language {language}`; do not edit.",
        names.join(" ")
    )
}

fn no_interface(name: &str, known: &[&str]) -> String {
    let same =
        known.iter().find(|other| other.eq_ignore_ascii_case(name)).map(|same| vec![(*same).to_owned()]);
    match same.unwrap_or_else(|| nearest_names(name, known.iter().copied())).join("` or `") {
        near if near.is_empty() => {
            format!("no interface has this name; expected one of {}", known.join(", "))
        }
        near => format!("no interface has this name; did you mean `{near}`?"),
    }
}

/// Returns a doc comment; empty without documentation.
fn comment(indent: &str, doc: &str, unit: &str) -> String {
    let unit = if unit.is_empty() { String::new() } else { format!(" [{unit}]") };
    match doc.trim_end() {
        "" if unit.is_empty() => String::new(),
        doc => super::comment(indent, format!("{doc}{unit}").trim_start()),
    }
}

/// Returns the name of a field or constant, changed if it is a keyword.
fn identifier(name: &str) -> String {
    if is_word_of_c(name) { format!("{name}_") } else { name.to_owned() }
}

/// Returns a string literal of C and C++.
fn literal(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

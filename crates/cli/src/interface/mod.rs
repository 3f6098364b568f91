//! Making and maintaining interfaces.

pub mod export;
mod import;
mod parse;
mod syntax_error;
mod token;
mod word;

use std::fmt::Write as _;
use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use serde_json::{Value, json};
use slate::blackboard::interface::{Descriptor, Field};

use crate::failure::{ASSERTION_FALSE, Failure};
use crate::output;
use export::ExportInterface;
use import::ImportInterface;
use parse::FoundInterface;

#[derive(Debug, Subcommand)]
pub enum InterfaceVerb {
    /// Create the source of an interface
    New(NewInterface),
    /// Create the source of the interface that a `.msg` file of ROS defines
    Import(ImportInterface),
    /// Create the header of interfaces for modules in C or C++
    Export(ExportInterface),
    /// Show the layout of interfaces and their errors (exit code 7 on errors)
    Check {
        /// Source files
        #[arg(required = true)]
        files: Vec<PathBuf>,
        /// Print the layouts as JSON
        #[arg(long)]
        json: bool,
    },
    /// Compare two versions of interfaces (exit code 7 if incompatible)
    Diff {
        /// Old version
        old: PathBuf,
        /// New version
        new: PathBuf,
        /// Print the differences as JSON
        #[arg(long)]
        json: bool,
    },
}

#[derive(Debug, Args)]
pub struct NewInterface {
    /// Name, such as `BatteryState`
    name: String,

    /// Field as NAME:TYPE[:UNIT[:DOC]];
    /// types are `f64`, `Bool`, `[u8; 4]`, `Text<32>`, `Sequence<f64, 16>`, `Pose2`, ...
    #[arg(long = "field", short, value_name = "FIELD", required = true)]
    fields: Vec<String>,

    /// Documentation
    #[arg(long, default_value = "")]
    doc: String,

    /// New file [default: stdout]
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Runs the command; returns the exit code.
pub fn interface(verb: &InterfaceVerb) -> Result<u8, Failure> {
    match verb {
        InterfaceVerb::New(options) => new(options),
        InterfaceVerb::Import(options) => write(&import::import(options)?, options.out.as_deref(), false),
        InterfaceVerb::Export(options) => {
            write(&export::export(options)?, options.out.as_deref(), options.force)
        }
        InterfaceVerb::Check { files, json } => check(files, *json),
        InterfaceVerb::Diff { old, new, json } => diff(old, new, *json),
    }
}

fn new(options: &NewInterface) -> Result<u8, Failure> {
    let refuse = |problem: String| Failure::Interface { place: options.name.clone(), problem };
    if !options.name.starts_with(|c: char| c.is_ascii_uppercase())
        || !options.name.chars().all(|c| c.is_ascii_alphanumeric())
    {
        return Err(refuse("expected a name such as `BatteryState`".into()));
    }
    let mut fields = Vec::new();
    for text in &options.fields {
        let mut parts = text.splitn(4, ':').map(str::trim);
        let (Some(name), Some(kind)) = (parts.next(), parts.next()) else {
            return Err(refuse(format!(
                "`{text}` is not a field: expected NAME:TYPE, such as `x:f64:m:to the front`"
            )));
        };
        let (unit, doc) = (parts.next().unwrap_or_default(), parts.next().unwrap_or_default());
        if unit.contains(|c: char| c.is_control() || c == '"' || c == '\\') {
            return Err(refuse(format!("{unit:?} is not a unit: expected one such as `m/s`")));
        }
        fields.push((name, kind, unit, doc));
    }
    let source = source(options, &fields);
    parse::interfaces(&source).map_err(|wrong| refuse(wrong.message))?;
    write(&source, options.out.as_deref(), false)
}

/// Writes a source to a new file, or to one that it may replace, or prints it.
fn write(source: &str, out: Option<&Path>, replaces: bool) -> Result<u8, Failure> {
    match out {
        Some(path) => {
            let file =
                File::options().write(true).create(true).truncate(true).create_new(!replaces).open(path);
            let written = file.and_then(|mut file| file.write_all(source.as_bytes()));
            written.map_err(|source| match source.kind() {
                std::io::ErrorKind::AlreadyExists => Failure::Taken { path: path.into() },
                _ => Failure::File { path: path.into(), source },
            })?;
        }
        None => output::line(source.trim_end()),
    }
    Ok(0)
}

fn source(options: &NewInterface, fields: &[(&str, &str, &str, &str)]) -> String {
    let doc = match options.doc.is_empty() {
        true => format!("Values of the interface {}.", options.name),
        false => options.doc.clone(),
    };
    let mut text = "use slate_plugin::prelude::*;\n".to_owned();
    let _ = write!(
        text,
        "\n{}#[interface]\n#[derive(PartialEq)]\npub struct {} {{\n",
        comment("", &doc),
        options.name
    );
    for (name, kind, unit, doc) in fields {
        let doc = if doc.is_empty() { format!("The {}.", name.replace('_', " ")) } else { (*doc).to_owned() };
        text.push_str(&comment("    ", &doc));
        if !unit.is_empty() {
            let _ = writeln!(text, "    #[unit(\"{unit}\")]");
        }
        let _ = writeln!(text, "    pub {name}: {kind},");
    }
    text.push_str("}\n");
    text
}

/// Formats documentation as doc comments.
fn comment(indent: &str, text: &str) -> String {
    text.lines().map(|line| format!("{indent}{}\n", format!("/// {line}").trim_end())).collect()
}

/// Reads the interfaces of a file, and the number of its other enums.
fn read(path: &Path) -> Result<(Vec<FoundInterface>, usize), Failure> {
    let source =
        std::fs::read_to_string(path).map_err(|source| Failure::File { path: path.into(), source })?;
    parse::read(&source).map_err(|wrong| at(path, wrong.line, wrong.message))
}

fn at(path: &Path, line: usize, problem: String) -> Failure {
    Failure::Interface { place: format!("{}:{line}", slate::runtime::printable(path)), problem }
}

/// Reads a file with [`read`]; an error if it has no interface.
fn read_some(path: &Path) -> Result<Vec<FoundInterface>, Failure> {
    match read(path)? {
        (none, 0) if none.is_empty() => {
            let problem = "no interface is in this file: expected a struct or an enum below `#[interface]`";
            Err(at(path, 1, problem.into()))
        }
        (interfaces, _) => Ok(interfaces),
    }
}

fn check(files: &[PathBuf], json: bool) -> Result<u8, Failure> {
    let (mut layouts, mut wrong) = (Vec::new(), 0);
    for file in files {
        match read_some(file) {
            Ok(found) => {
                for FoundInterface { line, descriptor } in found {
                    layouts.push(layout(file, line, descriptor));
                    if !json {
                        show(descriptor);
                    }
                }
            }
            Err(failure @ Failure::Interface { .. }) => {
                wrong += 1;
                failure.print();
            }
            Err(other) => return Err(other),
        }
    }
    if json {
        output::json(&json!({"schema": "slate.interface/1", "ok": wrong == 0, "interfaces": layouts}));
    } else if layouts.is_empty() && wrong == 0 {
        output::line("enums alone, which are laid out as the integers that carry them");
    }
    Ok(if wrong == 0 { 0 } else { ASSERTION_FALSE })
}

fn layout(file: &Path, line: usize, descriptor: &Descriptor) -> Value {
    let field = |field: &Field| {
        json!({
            "name": field.name, "type": field.kind.describe(), "unit": field.unit, "offset": field.offset, "doc": field.doc,
        })
    };
    json!({
        "file": file, "line": line, "name": descriptor.name, "doc": descriptor.doc, "size": descriptor.size,
        "schema": format!("{:016x}", descriptor.hash), "fields": descriptor.fields.iter().map(field).collect::<Vec<_>>(),
    })
}

fn show(descriptor: &Descriptor) {
    let Descriptor { name, size, hash, .. } = descriptor;
    output::line(format_args!("{name}: {size} bytes, schema {hash:016x}"));
    let row = |field: &Field| {
        [
            format!("  {}", field.offset),
            field.name.into(),
            field.kind.describe(),
            field.unit.into(),
            field.doc.into(),
        ]
    };
    output::columns(descriptor.fields.iter().map(row));
}

/// Result of comparing an interface.
struct InterfaceDifference {
    name: &'static str,
    /// Compatibility: true if readers of the old one can read the new one.
    compatible: bool,
    changes: Vec<String>,
}

fn diff(old: &Path, new: &Path, json: bool) -> Result<u8, Failure> {
    let ((old, _), (new, _)) = (read(old)?, read(new)?);
    let of = |all: &[FoundInterface], name: &str| {
        all.iter().find(|one| one.descriptor.name == name).map(|one| one.descriptor)
    };
    let mut differences = Vec::new();
    for FoundInterface { descriptor: before, .. } in &old {
        differences.push(match of(&new, before.name) {
            Some(after) => compare(before, after),
            None => {
                InterfaceDifference { name: before.name, compatible: false, changes: vec!["removed".into()] }
            }
        });
    }
    for FoundInterface { descriptor, .. } in new.iter().filter(|one| of(&old, one.descriptor.name).is_none())
    {
        differences.push(InterfaceDifference {
            name: descriptor.name,
            compatible: true,
            changes: vec!["is new".into()],
        });
    }
    let compatible = differences.iter().all(|one| one.compatible);
    if json {
        let one = |one: &InterfaceDifference| json!({"name": one.name, "compatible": one.compatible, "changes": one.changes});
        let all: Vec<_> = differences.iter().map(one).collect();
        output::json(
            &json!({"schema": "slate.interface.diff/1", "compatible": compatible, "interfaces": all}),
        );
    } else {
        for InterfaceDifference { name, compatible, changes } in &differences {
            let verdict = match (compatible, changes.is_empty()) {
                (true, true) => "the same",
                (true, false) => "compatible",
                (false, _) => "INCOMPATIBLE",
            };
            output::line(format_args!("{name}: {verdict}"));
            changes.iter().for_each(|change| output::line(format_args!("  {change}")));
        }
        if !compatible {
            output::line("");
            output::line(
                "Links between modules of the two versions are refused, in one agent and between agents, until all",
            );
            output::line(
                "plugins are built against the new one: build them anew, and reload or restart together. Recordings",
            );
            output::line(
                "keep the old layout beside the values, and stay readable by the names of the fields.",
            );
        }
    }
    Ok(if compatible { 0 } else { ASSERTION_FALSE })
}

fn compare(before: &Descriptor, after: &Descriptor) -> InterfaceDifference {
    let mut changes = Vec::new();
    for field in before.fields {
        let Some(now) = after.field(field.name) else {
            changes.push(format!("- {} ({}) removed", field.name, field.kind.describe()));
            continue;
        };
        let (was, is) = (field.kind.describe(), now.kind.describe());
        if was != is {
            changes.push(format!("~ {}: {was} -> {is}", field.name));
        }
        if field.unit != now.unit {
            let unit = |unit: &str| if unit.is_empty() { "no unit".to_owned() } else { unit.to_owned() };
            changes.push(format!(
                "~ {}: {} -> {}; old values mean something else",
                field.name,
                unit(field.unit),
                unit(now.unit)
            ));
        }
        if field.offset != now.offset {
            changes.push(format!("~ {}: byte {} -> {}", field.name, field.offset, now.offset));
        }
        if field.doc != now.doc {
            changes.push(format!("~ {}: documentation changed", field.name));
        }
    }
    for field in after.fields.iter().filter(|field| before.field(field.name).is_none()) {
        changes.push(format!("+ {} ({}) added", field.name, field.kind.describe()));
    }
    let compatible = before.hash == after.hash;
    if !compatible {
        changes.push(format!(
            "schema {:016x} -> {:016x}, {} -> {} bytes",
            before.hash, after.hash, before.size, after.size
        ));
    }
    InterfaceDifference { name: before.name, compatible, changes }
}

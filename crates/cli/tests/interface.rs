//! Interfaces are made, looked at and compared.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use crate::common;

use common::Running;
use serde_json::Value;

#[test]
fn new_interface_is_compared_with_a_later_version() {
    let running = Running::new("interface");
    let fields = ["voltage:f32:V:At the poles.", "charge:f64::From 0 to 1.", "charging:Bool"];
    let fields = fields.iter().flat_map(|field| ["--field", field]);
    let arguments: Vec<&str> =
        ["interface", "new", "BatteryState", "--doc", "How full a battery is.", "--out", "battery.rs"]
            .into_iter()
            .chain(fields)
            .collect();
    running.done(&arguments);
    let source = std::fs::read_to_string(running.folder().join("battery.rs")).unwrap();
    for line in ["/// How full a battery is.", "#[unit(\"V\")]", "pub voltage: f32,", "pub charging: Bool,"] {
        assert!(source.contains(line), "{line}: {source}");
    }
    assert!(!source.contains("reserved"), "{source}");
    running.fails(2, &arguments, &["exists already"]);

    let said = running.done(&["interface", "check", "battery.rs", "--json"]);
    let checked: Value = serde_json::from_str(&said).unwrap();
    let interface = &checked["interfaces"][0];
    assert_eq!(
        (&interface["name"], &interface["size"], &interface["line"]),
        (&"BatteryState".into(), &24.into(), &6.into())
    );
    assert!(running.done(&["interface", "check", "battery.rs"]).contains("BatteryState: 24 bytes, schema "));

    let version = |name: &str, from: &str, to: &str| {
        let changed = source.replace(from, to);
        assert_ne!(changed, source);
        std::fs::write(running.folder().join(name), changed).unwrap();
    };
    // What it is said to be is not part of the layout.
    version("words.rs", "At the poles.", "Between the poles.");
    let said = running.done(&["interface", "diff", "battery.rs", "words.rs"]);
    assert!(said.contains("BatteryState: compatible") && said.contains("voltage"), "{said}");
    version("unit.rs", "\"V\"", "\"mV\"");
    let output = running.call(&["interface", "diff", "battery.rs", "unit.rs", "--json"]);
    assert_eq!(output.status.code(), Some(7), "{output:?}");
    let differences: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(differences["interfaces"][0]["changes"].to_string().contains("V -> mV"), "{differences}");
    version("field.rs", "pub charging: Bool,", "pub current: f32,");
    let output = running.call(&["interface", "diff", "battery.rs", "field.rs"]);
    let said = common::text(&output.stdout);
    for words in ["INCOMPATIBLE", "- charging", "+ current (f32) added", "built against the new one"] {
        assert!(said.contains(words), "{words}: {said}");
    }
}

#[test]
fn documentation_may_have_several_lines() {
    let running = Running::new("interface-lines");
    let said = running.done(&[
        "interface",
        "new",
        "Battery",
        "--doc",
        "How full it is.\n\npub what: u8, // is not a code",
        "--field",
        "charge:f64::From 0\nto 1.",
    ]);
    for line in [
        "/// How full it is.",
        "///",
        "/// pub what: u8, // is not a code",
        "    /// From 0",
        "    /// to 1.",
    ] {
        assert!(said.lines().any(|other| other == line), "{line}: {said}");
    }
    std::fs::write(running.folder().join("battery.rs"), &said).unwrap();
    assert!(running.done(&["interface", "check", "battery.rs"]).starts_with("Battery: 8 bytes"));
}

#[test]
fn invalid_field_or_type_is_refused() {
    let running = Running::new("interface-wrong");
    running.fails(2, &["interface", "new", "battery", "--field", "x:f64"], &["expected a name such as"]);
    running.fails(2, &["interface", "new", "Battery", "--field", "x"], &["NAME:TYPE"]);
    running.fails(2, &["interface", "new", "Battery", "--field", "x:bool"], &["`Bool`"]);
    running.fails(2, &["interface", "new", "Battery", "--field", "x:Pose3"], &["did you mean Pose2"]);
    running.fails(
        2,
        &["interface", "new", "Battery", "--field", "type:f64"],
        &["`type` is a keyword of Rust"],
    );
    running.fails(2, &["interface", "new", "Battery", "--field", "9a:f64"], &["`9a` begins with a digit"]);
    running.fails(
        2,
        &["interface", "new", "Battery", "--field", "x:f64", "--field", "x:f64"],
        &["there are two fields `x`"],
    );
    for unit in ["m\n", "m\"", "m\\"] {
        running.fails(
            2,
            &["interface", "new", "Battery", "--field", &format!("x:f64:{unit}s")],
            &["is not a unit", "m/s"],
        );
    }
    running.fails(2, &["interface", "new", "Self", "--field", "x:f64"], &["`Self` is a keyword of Rust"]);
    running.fails(2, &["interface", "check", "nothing.rs"], &["nothing.rs"]);
    let write = |name: &str, text: &str| std::fs::write(running.folder().join(name), text).unwrap();
    write("open.rs", "use std::fmt;\nfn main(){\n");
    running.fails(7, &["interface", "check", "open.rs"], &["open.rs:2", "expected `}`"]);
    write("twice.rs", "#[interface]\npub struct Bad {\n    pub x: f64,\n    pub x: f64,\n}\n");
    running.fails(7, &["interface", "check", "twice.rs"], &["twice.rs:4", "two fields `x`"]);
    write("none.rs", "pub struct Plain { x: f64 }\n");
    running.fails(7, &["interface", "check", "none.rs"], &["none.rs:1", "below `#[interface]`"]);
    write("enum.rs", "#[interface]\npub enum Mode { Off, On }\n");
    assert!(running.done(&["interface", "check", "enum.rs"]).contains("enums alone"));
    assert!(running.done(&["explain", "s006"]).contains("S006: the two ends of a link don't match"));
    assert!(running.done(&["explain", "S7", "s15"]).contains("S007: cyclic dependency"));
    running.fails(4, &["explain", "S999"], &["`slate explain` lists all"]);
}

#[test]
fn exported_headers_lay_values_out_as_rust_does() {
    let running = Running::new("interface-export");
    let all: Vec<&str> = slate::interfaces::ALL.iter().map(|descriptor| descriptor.name).collect();
    let export = |language: &str, file: &str| {
        let mut arguments = vec!["interface", "export", "--language", language, "--out", file];
        arguments.extend(&all);
        running.done(&arguments);
    };
    export("cpp", "interfaces.hpp");
    export("c", "interfaces.h");
    let (mut cpp, mut c) = (String::new(), String::new());
    for descriptor in slate::interfaces::ALL {
        let (name, hash, size) = (descriptor.name, descriptor.hash, descriptor.size);
        let of = format!("slate::detail::Schema<interfaces::{name}>");
        cpp += &format!("static_assert({of}::hash == {hash}U && {of}::layout.size == {size}, \"{name}\");\n");
        for field in descriptor.fields {
            // The tail is not a member.
            if descriptor.tail().is_none() || Some(field) != descriptor.fields.last() {
                let (field, offset) = (field.name, field.offset);
                c += &format!("_Static_assert(offsetof({name}, {field}) == {offset}, \"{name}.{field}\");\n");
            }
        }
    }
    let compile = |compiler: &str, file: &str, text: String| {
        std::fs::write(running.folder().join(file), text).unwrap();
        let standard = if compiler == "cc" { "-std=c11" } else { "-std=c++17" };
        let headers = concat!(env!("CARGO_MANIFEST_DIR"), "/../module/include");
        let output = std::process::Command::new(compiler)
            .args([
                standard,
                "-fsyntax-only",
                "-Wall",
                "-Wextra",
                "-Werror",
                "-Wpedantic",
                "-I",
                headers,
                file,
            ])
            .current_dir(running.folder())
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", common::text(&output.stderr));
    };
    // Rust brings a linker for C; not everybody has the other compiler.
    if std::process::Command::new("c++").arg("--version").output().is_ok() {
        compile("c++", "check.cpp", format!("#include \"interfaces.hpp\"\n{cpp}"));
    }
    compile("cc", "check.c", format!("#include \"interfaces.h\"\n{c}"));
}

#[test]
fn export_takes_own_sources_and_names_unknown_interfaces() {
    let running = Running::new("interface-export-own");
    let fields = ["--field", "class:u16:V:Of the battery.", "--field", "cells:[Bool; 4]"];
    let mut new = vec!["interface", "new", "BatteryState", "--out", "battery.rs"];
    new.extend(fields);
    running.done(&new);
    let header = running.done(&["interface", "export", "BatteryState", "--source", "battery.rs"]);
    for line in [
        "std::uint16_t class_{};",
        "std::array<slate::Bool, 4> cells{};",
        "slate::field<&BatteryState::class_>(\"class\", \"V\", \"Of the battery.\")",
    ] {
        assert!(header.contains(line), "{line}: {header}");
    }
    running.fails(
        2,
        &["interface", "export", "Battery"],
        &["Battery: no interface has this name", "Bumper, "],
    );
    running.fails(2, &["interface", "export", "position"], &["did you mean `Position`?"]);
}

#[test]
fn exported_header_is_replaced_on_request_alone() {
    let running = Running::new("interface-export-again");
    let export = ["interface", "export", "Position", "--out", "own.hpp"];
    running.done(&export);
    let header = std::fs::read_to_string(running.folder().join("own.hpp")).unwrap();
    std::fs::write(running.folder().join("own.hpp"), "other").unwrap();
    running.fails(2, &export, &["`own.hpp` exists already"]);
    running.done(&[&export[..], &["--force"]].concat());
    assert_eq!(std::fs::read_to_string(running.folder().join("own.hpp")).unwrap(), header);
}

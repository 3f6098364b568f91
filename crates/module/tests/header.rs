//! The C header is what the sources say, and C and C++ compilers agree with Rust on every size and offset.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use std::fmt::Write as _;
use std::io::Write as _;
use std::mem::{offset_of, size_of};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use slate_module::table::{Bytes, SetupTable, Sink};
use slate_module::{Entry, Frame, Host, ModuleTable, PluginTable, PortSlot, Random, Stamp};

/// Set it to write the header instead of comparing.
const UPDATE: &str = "SLATE_UPDATE_HEADER";

const SOURCES: [&str; 7] = [
    "src/table.rs",
    "src/frame.rs",
    "src/random.rs",
    "src/description.rs",
    "src/module.rs",
    "src/port/mod.rs",
    "../blackboard/src/stamp.rs",
];

fn folder() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn header() -> PathBuf {
    folder().join("include/slate.h")
}

macro_rules! layout {
    ($out:ident, $($name:ident { $($field:ident),* })*) => {$(
        let name = stringify!($name);
        writeln!($out, "SLATE_STATIC_ASSERT(sizeof(Slate{name}) == {}, \"{name}\");", size_of::<$name>()).unwrap();
        $(
            let (field, offset) = (stringify!($field), offset_of!($name, $field));
            writeln!($out, "SLATE_STATIC_ASSERT(offsetof(Slate{name}, {field}) == {offset}, \"{name}.{field}\");")
                .unwrap();
        )*
    )*};
}

/// What the compiler makes of the types.
fn asserts() -> String {
    let mut out = String::new();
    layout! { out,
        Bytes { data, length }
        Sink { context, write }
        SetupTable { name, seed, period, section, params }
        ModuleTable { name, doc, section, describe, create, tick, save, restore, may_unload, destroy }
        PluginTable { abi, module_size, modules, module_count }
        Stamp { sequence, time, generation }
        Random {}
        Host { context, log }
        Entry { data, items, stamp, answer, sender }
        PortSlot {
            schema, data, items, capacity, stamp, flags, direction, priority, entries, count, missed
        }
        Frame {
            ports, port_count, params, params_size, params_version, now, elapsed, number, random, host
        }
    }
    out.trim_end().to_owned()
}

fn generated() -> String {
    let configuration = cbindgen::Config::from_file(folder().join("cbindgen.toml")).unwrap();
    let builder = cbindgen::Builder::new().with_config(configuration);
    let builder = SOURCES.iter().fold(builder, |builder, source| builder.with_src(folder().join(source)));
    let mut text = Vec::new();
    builder.generate().unwrap().write(&mut text);
    let mut text = String::from_utf8(text).unwrap();
    let mut replace = |from: &str, to: &str| {
        assert!(text.contains(from), "`{from}` is not in the header any more");
        text = text.replace(from, to);
    };
    // Rust's cells may be written through a shared pointer; C has to know it.
    replace("const struct SlatePortSlot *ports", "struct SlatePortSlot *ports");
    replace("const struct SlateEntry *entries", "struct SlateEntry *entries");
    replace("const struct SlateRandom *random", "struct SlateRandom *random");
    replace("#define Flags_", "#define SLATE_FLAG_");
    replace("[`Flags`]", "`SLATE_FLAG_NEW` and those that follow it");
    replace("[`Direction`](crate::Direction)", "`SlateDirection`");
    replace("[`ModuleTable`]", "`SlateModuleTable`");
    replace("[`Level`]", "`SlateLevel`");
    replace("[`ABI`]", "`SLATE_ABI`");
    replace("@ASSERTS@", &asserts());
    assert!(!text.contains("[`"), "a link of rustdoc is left:\n{text}");
    let lines: Vec<_> = text.lines().map(str::trim_end).collect();
    lines.join("\n").trim_end().replace("\n\n\n", "\n\n") + "\n"
}

#[test]
fn the_header_is_what_the_sources_say() {
    let text = generated();
    #[allow(clippy::disallowed_methods, reason = "how a developer asks for the update")]
    if std::env::var_os(UPDATE).is_some() {
        std::fs::create_dir_all(folder().join("include")).unwrap();
        std::fs::write(header(), &text).unwrap();
    }
    let written = std::fs::read_to_string(header()).unwrap_or_default();
    let differs = text.lines().zip(written.lines()).find(|(new, old)| new != old);
    assert!(
        text == written,
        "include/slate.h is not what the sources say (first: {differs:?}); renew it with\n    \
         {UPDATE}=1 cargo test -p slate-module --test header"
    );
}

/// Uses every macro and helper, in the common part of C and C++.
const USE: &str = r#"
#include <slate.h>
#include <slate.h>
static int32_t describe(const SlateSetupTable *setup, const SlateSink *sink) {
    slate_write(sink, setup->name.data, slate_text("abc").length);
    return SLATE_DONE;
}
static int32_t create(const SlateSetupTable *setup, SlateBytes params, void **instance, const SlateSink *sink) {
    (void)setup, (void)params, (void)instance;
    return slate_refuse(sink, "never");
}
static int32_t tick(void *instance, const SlateFrame *frame) {
    (void)instance;
    double *output = (double *)slate_output(frame, 1);
    if (output && slate_is_new(frame, 0) && !slate_is_stale(frame, 0)) {
        *output = *(const double *)slate_input(frame, 0);
        frame->ports[0].items = 0;
        slate_log(frame, SLATE_LEVEL_INFO, "new");
    }
    return SLATE_OUTCOME_OK;
}
static int32_t save(const void *instance, const SlateSink *sink) { return (void)instance, slate_refuse(sink, "no"); }
static int32_t restore(void *instance, SlateBytes state, const SlateSink *sink) {
    return (void)instance, (void)state, slate_refuse(sink, "no");
}
static int32_t destroy(void *instance, const SlateSink *sink) { (void)instance; (void)sink; return 0; }
static const SlateModuleTable modules[] = {
    { SLATE_TEXT("a"), SLATE_TEXT("A."), { NULL, 0 }, describe, create, tick, save, restore, save, destroy },
};
SLATE_PLUGIN(a, modules);
SLATE_OUTLINE("{}");
"#;

/// Compiles a file that includes the header twice, with all warnings on.
fn compile(compiler: &str, language: &str, standard: &str) {
    let mut child = Command::new(compiler)
        .args(["-fsyntax-only", "-Wall", "-Wextra", "-Werror", "-pedantic", "-x", language, standard, "-I"])
        .arg(folder().join("include"))
        .arg("-")
        .stdin(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap_or_else(|error| panic!("{compiler} is needed for this test: {error}"));
    child.stdin.take().unwrap().write_all(USE.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{compiler} {standard}:\n{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn c_and_cplusplus_agree_on_the_layout() {
    // Rust links with `cc`, so that is everywhere. Without a C++ compiler no plugin can be written in C++.
    compile("cc", "c", "-std=c11");
    compile("cc", "c", "-std=c17");
    if Command::new("c++").arg("--version").output().is_ok() {
        compile("c++", "c++", "-std=c++17");
    }
}

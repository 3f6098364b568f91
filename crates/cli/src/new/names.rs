//! Names that a project can't have.

use super::template::Template;

/// Names that the templates' configurations use.
const TEMPLATE_NAMES: [&str; 4] = ["simulator", "referee", "wheels", "pioneer"];

/// No package can be called so.
const RESERVED_NAMES: [&str; 56] = [
    "abstract",
    "alloc",
    "as",
    "async",
    "await",
    "become",
    "box",
    "break",
    "build",
    "const",
    "continue",
    "core",
    "crate",
    "deps",
    "do",
    "dyn",
    "else",
    "enum",
    "examples",
    "extern",
    "false",
    "final",
    "fn",
    "for",
    "gen",
    "if",
    "impl",
    "in",
    "incremental",
    "let",
    "loop",
    "macro",
    "match",
    "mod",
    "move",
    "mut",
    "override",
    "priv",
    "pub",
    "ref",
    "return",
    "self",
    "std",
    "static",
    "struct",
    "super",
    "test",
    "trait",
    "true",
    "try",
    "type",
    "unsafe",
    "use",
    "where",
    "while",
    "yield",
];

/// Keywords of Python, and modules that a file of that name hides from its tests.
const PYTHON_NAMES: &str = "\
    abc and argparse array assert ast asyncio atexit base64 binascii bisect builtins bz2 calendar class \
    code codecs collections contextlib copy copyreg csv ctypes dataclasses datetime def del difflib dis \
    elif email encodings errno except finally fnmatch from functools gettext global glob hashlib heapq \
    hmac html http import importlib inspect io ipaddress is itertools json keyword lambda linecache \
    locale logging lzma marshal math nonlocal not numbers numpy opcode operator or os pass pathlib \
    pickle platform posix pprint queue raise random re reprlib secrets select selectors shutil signal \
    site socket stat statistics string subprocess sys tempfile textwrap threading time token tokenize \
    traceback types typing unittest urllib uuid warnings weakref with xml zipfile zipimport zlib";

/// Targets that CMake has by itself.
const CMAKE_TARGETS: [&str; 6] = ["all", "clean", "help", "install", "package", "rebuild_cache"];

/// Returns the reason why a plugin can't have that name, if any.
pub fn name_error(name: &str, template: Template) -> Option<&'static str> {
    let kind = name.replace('-', "_");
    let small = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-' || c == '_';
    if !(name.starts_with(|c: char| c.is_ascii_lowercase()) && name.chars().all(small)) {
        Some("expected lower-case letters, digits, - and _, with a letter first")
    } else if RESERVED_NAMES.contains(&name) {
        Some("it is reserved by Rust or Cargo")
    } else if name == "slate" || name.starts_with("slate-") {
        // The new package depends on some of them.
        Some("Slate's own packages have this name")
    } else if TEMPLATE_NAMES.contains(&name) {
        Some("the template's configuration uses this name")
    } else if template.native().is_some() && CMAKE_TARGETS.contains(&kind.as_str()) {
        Some("it is reserved by CMake")
    } else if template == Template::Python && PYTHON_NAMES.split_whitespace().any(|taken| taken == kind) {
        Some("it is a keyword or a module of Python")
    } else {
        None
    }
}

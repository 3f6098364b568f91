//! Files of IDL.

use proptest::prelude::*;
use slate_blackboard::interface::Primitive;
use slate_dds::{IdlError, IdlFile, IdlKind};

use crate::dds::interfaces::structure;

fn wrong(text: &str) -> IdlError {
    IdlFile::parse("test.idl", text).err().unwrap_or_else(|| panic!("no error: {text}"))
}

#[test]
fn a_file_is_read_with_those_it_includes() {
    let target = structure("demo::Target");
    assert!(target.has_key() && target.place.ends_with("target.idl:12"), "{}", target.place);
    let kinds: Vec<_> =
        target.members.iter().map(|own| format!("{} {}", own.kind.describe(), own.name)).collect();
    assert_eq!(
        kinds,
        [
            "long id",
            "enum demo::Mode mode",
            "boolean valid",
            "struct demo::Point position",
            "string of at most 15 bytes name",
            "sequence of at most 8 x float weights",
            "sequence of struct demo::Point path",
            "array of 2 x double corner"
        ]
    );
    let IdlKind::Enumeration(mode) = &target.members[1].kind else { panic!("{target:?}") };
    assert_eq!(mode.values.iter().map(|(_, value)| *value).collect::<Vec<_>>(), [0, 1, 7]);
    let grown = structure("demo::GrowingPoint");
    assert_eq!(grown.members.iter().map(|own| own.name.as_str()).collect::<Vec<_>>(), ["x", "y"]);
    assert_eq!((target.is_appendable, grown.is_appendable), (Some(false), Some(true)));
}

#[test]
fn every_number_of_idl_is_read() {
    let text = "struct All { boolean a; octet b; char c; int8 d; short e; unsigned short f; long g; unsigned long h; \
                long long i; unsigned long long j; float k; double l; uint8 m; int16 n; uint16 o; int32 p; uint32 q; int64 r; \
                uint64 s; };";
    let all = IdlFile::parse("all.idl", text).unwrap().structure("All").unwrap();
    use Primitive::{Bool, F32, F64, I8, I16, I32, I64, U8, U16, U32, U64};
    let expected =
        [Bool, U8, U8, I8, I16, U16, I32, U32, I64, U64, F32, F64, U8, I16, U16, I32, U32, I64, U64];
    let found: Vec<_> = all.members.iter().map(|own| own.kind.clone()).collect();
    assert_eq!(found, expected.map(IdlKind::Primitive));
}

#[test]
fn names_are_found_from_inside_out() {
    let text = "typedef long Size; module a { typedef double Size; module b { struct One { Size x; ::Size y; a::Size z; }; }; };\n\
                module a { const long N = 0x10; struct Two { long list[N][3]; b::One one; }; };";
    let file = IdlFile::parse("names.idl", text).unwrap();
    let kinds = |name: &str| {
        let own = file.structure(name).unwrap();
        own.members.iter().map(|own| own.kind.describe()).collect::<Vec<_>>()
    };
    assert_eq!(kinds("a::b::One"), ["double", "long", "double"]);
    assert_eq!(kinds("a::Two"), ["array of 48 x long", "struct a::b::One"]);
    assert_eq!(file.structures().collect::<Vec<_>>(), ["a::Two", "a::b::One"]);
}

#[test]
fn unsupported_idl_is_named_with_its_line() {
    let cases = [
        ("struct A {\n  any a;\n};", 2, "`any` is not supported"),
        ("struct A {\n  long double a;\n};", 2, "`long double` is not supported"),
        ("struct A {\n\n  @optional long a;\n};", 3, "@optional is not supported"),
        ("\n@mutable struct A { long a; };", 2, "mutable types are not supported"),
        ("@extensibility(MUTABLE) struct A { long a; };", 1, "mutable types are not supported"),
        ("union U switch (long) { case 1: long a; };", 1, "`union` is not supported"),
        ("interface I {};", 1, "`interface` is not supported"),
        ("struct A;\nstruct A { long a; };", 1, "`A` is declared without members"),
        ("struct A { sequence<A> children; };", 1, "`A` is not defined before"),
        ("struct A {};", 1, "`A` has no members"),
        ("struct A { long a;\nlong a; };", 2, "`A` has two members `a`"),
        ("struct A { long a; };\nstruct A { long a; };", 2, "`A` is defined twice"),
        ("struct A { B b; };", 1, "`B` is not defined before"),
        ("const long N = 1 + 2;", 1, "expressions are not supported"),
        ("const string N = \"a\";", 1, "a constant is an integer"),
        ("struct A { long a[0]; };", 1, "a bound is a number from 1, found 0"),
        ("struct A { long a[-3]; };", 1, "a bound is a number from 1, found -3"),
        ("enum E { @value(1) A, @value(1) B };", 1, "1 of `B` is taken"),
        ("@bit_bound(8) enum E { @value(300) A };", 1, "300 of `A` is taken, or does not fit a i8"),
        ("struct A { long a }", 1, "expected `;`, found `}`"),
        ("struct A { long a; }\n", 1, "expected `;`, found the end of the file"),
        ("/* begun", 1, "a comment has no end"),
        ("#include \"other.idl\"", 1, "`other.idl` can't be included here"),
        ("#define N 3", 1, "`#define` is not supported"),
        ("#pragma keylist A a", 1, "write @key before the members"),
        ("struct A { double a[2000][2000][2000]; };", 1, "`a` has more than 67108864 bytes"),
        ("struct A { long \u{e9}; };", 1, "'\u{e9}' does not belong to IDL"),
    ];
    for (text, line, reason) in cases {
        let error = wrong(text);
        assert!(error.reason.contains(reason) && error.line == line, "{text:?}: {error}");
    }
    let deep = format!("typedef {}long{} Deep;", "sequence<".repeat(40), ">".repeat(40));
    assert!(wrong(&deep).reason.contains("more than 32 deep"));
    let deep = format!("{}struct A {{ long a; }};{}", "module m {".repeat(40), "};".repeat(40));
    assert!(wrong(&deep).reason.contains("more than 32 deep"));
    let mut wide = "struct S0 { long a; };".to_owned();
    (1..20).for_each(|at| wide += &format!("struct S{at} {{ S{0} a, b; }};", at - 1));
    assert!(wrong(&wide).reason.contains("`S14` has more than 10000 members"));
    let mut deep = "struct S0 { long a; };".to_owned();
    (1..40).for_each(|at| deep += &format!("struct S{at} {{ S{} inner; }};", at - 1));
    assert!(wrong(&deep).reason.contains("more than 32 deep"));
}

#[test]
fn missing_or_circular_include_is_reported() {
    let folder = std::env::temp_dir().join(format!("slate-idl-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("a.idl"), "#include \"b.idl\"\nstruct A { B b; };").unwrap();
    std::fs::write(folder.join("b.idl"), "#include \"a.idl\"\n#include <c.idl>\nstruct B { long x; };")
        .unwrap();
    let error = IdlFile::read(&folder.join("a.idl")).unwrap_err();
    assert!(error.file.ends_with("b.idl") && error.line == 2, "{error}");
    assert!(error.reason.contains("`c.idl` can't be included: No such file"), "{error}");
    std::fs::write(folder.join("c.idl"), "").unwrap();
    assert!(IdlFile::read(&folder.join("a.idl")).unwrap().structure("A").is_some());
    assert!(IdlFile::read(&folder.join("none.idl")).unwrap_err().to_string().contains("none.idl:1: No such"));
    std::fs::remove_dir_all(folder).unwrap();
}

/// A type that a file could have, as IDL writes it and as it is described.
fn kind() -> impl Strategy<Value = (String, String)> {
    let plain = |idl: &'static str, shown: &'static str| Just((idl.to_owned(), shown.to_owned()));
    let leaf = prop_oneof![
        plain("boolean", "boolean"),
        plain("octet", "octet"),
        plain("unsigned  long /* long */ long", "unsigned long long"),
        plain("int64", "long long"),
        plain("double", "double"),
        plain("string", "string"),
        plain("Point", "struct demo::Point"),
        plain("::demo::Mode", "enum demo::Mode"),
        (1_u32..100)
            .prop_map(|bound| (format!("string<{bound}>"), format!("string of at most {bound} bytes"))),
    ];
    leaf.prop_recursive(4, 8, 1, |inner| {
        (inner, prop::option::of(1_u32..100)).prop_map(|((idl, shown), bound)| match bound {
            Some(bound) => {
                (format!("sequence<{idl}, {bound}>"), format!("sequence of at most {bound} x {shown}"))
            }
            None => (format!("sequence < {idl} >"), format!("sequence of {shown}")),
        })
    })
}

proptest! {
    #[test]
    fn any_struct_is_read_as_it_was_written(kinds in prop::collection::vec(kind(), 1..12), key in any::<bool>()) {
        let mut text = "module demo { struct Point { double x; }; enum Mode { A, B, }; struct Any {\n".to_owned();
        for (at, (idl, _)) in kinds.iter().enumerate() {
            text += if key && at == 0 { "@key " } else { "" };
            text += &format!("  {idl} m{at}; // a comment\n");
        }
        let any = IdlFile::parse("any.idl", &(text + "}; };")).unwrap().structure("demo::Any").unwrap();
        prop_assert_eq!(any.has_key(), key);
        let found: Vec<_> = any.members.iter().map(|own| own.kind.describe()).collect();
        prop_assert_eq!(found, kinds.into_iter().map(|(_, shown)| shown).collect::<Vec<_>>());
    }

    #[test]
    fn any_text_is_read_or_refused_with_a_line_of_it(
        words in prop::collection::vec(
            prop_oneof![
                "[a-z]{1,3}", "[0-9]{1,3}", "[@;:,<>{}()=\\[\\]\"'#/*-]",
                Just("struct A {".to_owned()), Just("module".to_owned()), Just("sequence<".to_owned()), Just("long".to_owned()),
                Just("}; ".to_owned()), Just("\n".to_owned()), Just("enum".to_owned()), Just("::".to_owned()),
                Just("typedef".to_owned()), Just("const".to_owned()), Just("@key".to_owned()), Just("any \u{fc}".to_owned()),
            ],
            0..60,
        ),
        gap in prop_oneof![Just(" "), Just("")],
    ) {
        let text = words.join(gap);
        if let Err(error) = IdlFile::parse("any.idl", &text) {
            prop_assert!((1..=text.lines().count().max(1)).contains(&error.line), "{error} in {text:?}");
        }
    }
}

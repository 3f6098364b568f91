//! Files that are no plugins, no longer whole, or not what they say: each is refused in words, and the agent continues.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use object::read::elf::{FileHeader, ProgramHeader, SectionHeader};
use object::{Object, ObjectSection, ObjectSymbol, elf};
use proptest::prelude::*;
use slate_runtime::Options;
use slate_runtime::log::MemoryTarget;
use slate_runtime::plugin::{self, LibraryOutline};

use crate::fixtures::{CHILD, Folder, find, gcc, libraries, patch};
use crate::support::*;

/// What is said when a library of those bytes is loaded by an agent, which continues.
#[track_caller]
fn refusal_of(bytes: &[u8]) -> String {
    let folder = Folder::new();
    refusal(&folder.write("libcounter.so", bytes))
}

#[track_caller]
fn refusal(file: &Path) -> String {
    let mut agent = lockstep("");
    step(&mut agent, 1);
    let refusal = agent.composer().load_library(file).unwrap_err();
    step(&mut agent, 1);
    assert_eq!(agent.modules(), ["beat"]);
    let text = complaint(&refusal);
    assert_says(&text, &[&file.display().to_string()]);
    let start = try_lockstep(&library("counter", file)).unwrap_err();
    // At the start the same is said, at the line that names the file.
    assert_says(&complaint(&start), &["test.toml:3:8", &text]);
    text
}

fn bytes() -> Vec<u8> {
    fs::read(plain()).unwrap()
}

#[track_caller]
fn refusal_of_patched(part: &str, by: &str) -> String {
    let mut bytes = bytes();
    patch(&mut bytes, part, by);
    refusal_of(&bytes)
}

#[test]
fn another_version_of_the_interface_is_refused() {
    let text = refusal_of_patched("{\"abi\":3,", "{\"abi\":1,");
    assert_says(&text, &["version 1 of the plugin interface", "this agent has version 3", "slate-plugin"]);
}

/// Where the plugin's table is in the file.
fn table(bytes: &[u8]) -> usize {
    let file = object::read::elf::ElfFile64::<object::Endianness>::parse(bytes).unwrap();
    let symbol = file.dynamic_symbols().find(|symbol| symbol.name() == Ok("slate_plugin_counter")).unwrap();
    let endian = file.endian();
    let headers = file.elf_program_headers();
    let segment = headers.iter().find(|segment| {
        let start = segment.p_vaddr(endian);
        (start..start + segment.p_filesz(endian)).contains(&symbol.address())
    });
    let segment = segment.unwrap();
    (symbol.address() - segment.p_vaddr(endian) + segment.p_offset(endian)) as usize
}

#[test]
fn a_table_of_another_version_than_its_file_is_refused() {
    for (offset, says) in [
        (0, ["table of version 77 with entries of 104 bytes", "expected version 3 with 104 bytes"]),
        (4, ["table of version 3 with entries of 77 bytes", "expected version 3 with 104 bytes"]),
    ] {
        let mut bytes = bytes();
        let at = table(&bytes) + offset;
        bytes[at..at + 4].copy_from_slice(&77_u32.to_le_bytes());
        assert_says(&refusal_of(&bytes), &says);
    }
}

#[test]
fn a_table_with_other_kinds_than_its_file_is_refused() {
    let text = refusal_of_patched("{\"name\":\"counter\",\"doc\"", "{\"name\":\"kounter\",\"doc\"");
    assert_says(&text, &["declares kounter, but contains counter", "`.slate`"]);
}

#[test]
fn a_name_that_no_url_can_have_is_refused() {
    let text = refusal_of_patched("\"name\":\"counter\",\"version\"", "\"name\":\"coun/er\",\"version\"");
    assert_says(&text, &["has `coun/er` for a name", "letters"]);
    let text = refusal_of_patched("{\"name\":\"counter\",\"doc\"", "{\"name\":\"coun er\",\"doc\"");
    assert_says(&text, &["has `coun er` for a name", "letters"]);
}

#[test]
fn a_library_that_was_built_to_abort_is_refused() {
    let text = refusal(&libraries().counter("abort"));
    assert_says(&text, &["was built with panic = \"abort\"", "unwind", "isolated = true"]);
    let text = refusal_of_patched("\"panic\":\"unwind\"", "\"panic\":\"unwine\"");
    assert_says(&text, &["panic = \"unwine\"", "unwind"]);
}

#[test]
fn a_library_that_is_no_plugin_is_refused() {
    let text = refusal(&libraries().other("bare"));
    assert_says(&text, &["no section `.slate`", "plugin!"]);
}

#[test]
fn library_of_other_machine_is_refused() {
    for bytes in [&b""[..], b"#!/bin/sh\necho hello\n", &[0; 4096], &bytes()[..40]] {
        assert_says(&refusal_of(bytes), &["is not a shared library (ELF, 64 bits)", "cdylib"]);
    }
    // 32 bits; another machine; the other byte order; an object file; a program.
    let patched = |at: usize, byte: u8| {
        let mut bytes = bytes();
        bytes[at] = byte;
        refusal_of(&bytes)
    };
    assert_says(&patched(4, 1), &["is not a shared library (ELF, 64 bits)"]);
    let machine = if cfg!(target_arch = "x86_64") { 0xb7 } else { 0x3e };
    assert_says(&patched(18, machine), &["machine", &machine.to_string(), "expected", "cdylib"]);
    assert_says(&patched(5, 2), &["is not a shared library for this machine"]);
    assert_says(&patched(16, 1), &["type 1", "expected 3"]);
    assert_says(&patched(16, 2), &["type 2", "expected 3"]);
}

#[test]
fn non_file_is_refused() {
    let folder = Folder::new();
    let directory = folder.write("file", b"").parent().unwrap().to_owned();
    let pipe = directory.join("pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for path in [directory.clone(), pipe, "/dev/zero".into()] {
        assert_says(&refusal(&path), &["is not a file"]);
    }
    assert_says(&refusal(&directory.join("missing.so")), &["can't be read", "give the path"]);
}

#[test]
fn a_section_that_says_nothing_or_nonsense_is_refused() {
    let outline = |bytes: &[u8]| {
        let start = find(bytes, b"{\"abi\":3,");
        start..start + bytes[start..].iter().position(|byte| *byte == 0).unwrap()
    };
    let mut empty = bytes();
    let range = outline(&empty);
    empty[range.clone()].fill(0);
    assert_says(&refusal_of(&empty), &["empty section `.slate`"]);
    let mut nonsense = bytes();
    nonsense[range.clone()].fill(b'x');
    assert_says(&refusal_of(&nonsense), &["section `.slate` can't be read", "line 1"]);
    let mut deep = bytes();
    deep[range].fill(b'[');
    assert_says(&refusal_of(&deep), &["section `.slate` can't be read"]);
    let text = refusal_of_patched("\"modules\":", "\"modulus\":");
    assert_says(&text, &["section `.slate` can't be read", "missing field `modules`"]);
}

#[test]
fn a_library_without_the_section_or_the_symbol_is_refused() {
    let folder = Folder::new();
    let file = folder.copy(&plain());
    let stripped = Command::new("objcopy").args(["--remove-section", ".slate"]).arg(&file).status();
    assert!(stripped.expect("objcopy is needed for this test").success());
    assert_says(&refusal(&file), &["no section `.slate`"]);
    let text = refusal_of_patched("\"slate_plugin_counter\"", "\"slate_plugin_kounter\"");
    assert_says(&text, &["exports no symbol `slate_plugin_kounter`", "export"]);
    let text = refusal_of_patched("\0slate_plugin_counter\0", "\0slate_plugin_kounter\0");
    assert_says(&text, &["exports no symbol `slate_plugin_counter`"]);
}

#[test]
fn a_library_that_misses_anothers_symbol_is_refused_by_name() {
    let folder = Folder::new();
    let file = folder.write("liblost.so", b"");
    gcc("smoother.c", &["-DWITH_LOST_SYMBOL".into()], &file);
    assert_says(&refusal(&file), &["can't be opened", "slate_test_absent"]);
}

#[test]
fn a_file_that_is_cut_off_anywhere_is_refused() {
    let whole = bytes();
    let folder = Folder::new();
    let pages = (0..whole.len()).step_by(4096);
    for length in pages.chain([1, 63, 64, 65, whole.len() - 1]) {
        let file = folder.write("libcounter.so", &whole[..length]);
        let refusal = LibraryOutline::read(&file).expect_err("a part is not a library");
        let known = ["is not a shared library", "is cut off after", "is damaged"];
        assert!(known.iter().any(|said| refusal.problem.contains(said)), "{length}: {refusal}");
    }
    let cut = format!("is cut off after {} of {} bytes", whole.len() / 2, whole.len());
    assert_says(&refusal_of(&whole[..whole.len() / 2]), &[&cut, "build or copy it again"]);
}

#[test]
fn a_whole_file_that_is_damaged_is_not_called_cut_off() {
    let whole = bytes();
    let [_, segments, sections, _] = headers(&whole).try_into().unwrap();
    // The offsets of the first segment and of the first section that is one.
    for (at, says) in [(segments.start + 8, "segment 0"), (sections.start + 64 + 24, "section 1")] {
        let mut bytes = whole.clone();
        bytes[at..at + 8].copy_from_slice(&(1_u64 << 40).to_le_bytes());
        let text = refusal_of(&bytes);
        assert_says(&text, &["is damaged: ", says, "is not in the file"]);
        assert!(!text.contains("cut off"), "{text}");
    }
}

/// Where a file says what is where: its headers, and the outline.
fn headers(bytes: &[u8]) -> Vec<std::ops::Range<usize>> {
    let header = elf::FileHeader64::<object::Endianness>::parse(bytes).unwrap();
    let endian = header.endian().unwrap();
    let segments = header.e_phoff(endian) as usize;
    let sections = header.e_shoff(endian) as usize;
    let table = header.sections(endian, bytes).unwrap();
    let (_, outline) = table.section_by_name(endian, b".slate").unwrap();
    let (start, length) = outline.file_range(endian).unwrap();
    vec![
        0..64,
        segments..segments + 56 * usize::from(header.e_phnum(endian)),
        sections..sections + 64 * usize::from(header.e_shnum(endian)),
        start as usize..(start + length) as usize,
    ]
}

fn small() -> PathBuf {
    libraries().other("smoother")
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn reading_what_a_file_says_ends_whatever_its_bytes_are(
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>(), any::<u8>()), 1..6),
        cut in prop::option::weighted(0.2, any::<prop::sample::Index>()),
    ) {
        let mut bytes = fs::read(small()).unwrap();
        let ranges = headers(&bytes);
        for (range, place, byte) in flips {
            let range = &ranges[range.index(ranges.len())];
            bytes[range.start + place.index(range.len())] = byte;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        let folder = Folder::new();
        // Only that it ends matters: what was flipped may be a letter of the documentation.
        let _ = LibraryOutline::read(&folder.write("libsmoother.so", &bytes));
    }

    #[test]
    fn reading_what_a_file_says_ends_on_noise(bytes in prop::collection::vec(any::<u8>(), 0..4096)) {
        let folder = Folder::new();
        let mut file = b"\x7fELF\x02\x01\x01".to_vec();
        file.extend(bytes);
        prop_assert!(LibraryOutline::read(&folder.write("noise.so", &file)).is_err());
    }
}

/// A small generator, as the process that it is used in may end.
fn xorshift(state: &mut u64) -> usize {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    (*state >> 16) as usize
}

#[test]
fn loading_a_file_with_damaged_headers_ends_no_process() {
    in_a_process_of_its_own("damage::loading_a_file_with_damaged_headers_ends_no_process", || {
        let (mut random, mut refused) = (0x9e37_79b9_7f4a_7c15_u64, 0);
        for (library, cases) in [(small(), 4000), (plain(), 400)] {
            let whole = fs::read(&library).unwrap();
            let ranges = headers(&whole);
            let folder = Folder::new();
            for case in 0..cases {
                let mut bytes = whole.clone();
                let range = &ranges[case % ranges.len()];
                let at = range.start + xorshift(&mut random) % range.len();
                let bit = 1 << (xorshift(&mut random) % 8);
                bytes[at] ^= bit;
                let file = folder.write("libdamaged.so", &bytes);
                eprintln!("byte {at} of {ranges:?}, bit {bit}");
                refused += usize::from(plugin::load(&file).is_err());
            }
        }
        assert!(refused > 1000, "{refused}");
    });
}

/// Runs a test's work in another process, which it may end or fill.
#[track_caller]
pub fn in_a_process_of_its_own(test: &str, work: impl FnOnce()) {
    if std::env::var_os(CHILD).is_some() {
        return work();
    }
    libraries();
    let output = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", test, "--nocapture", "--test-threads", "1"])
        .env(CHILD, "1")
        .output()
        .unwrap();
    let (said, complained) =
        (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    let last: Vec<_> = complained.lines().rev().take(20).collect();
    assert!(said.contains("1 passed"), "{}\n{said}\n{}", output.status, last.join("\n"));
}

#[test]
fn sealed_library_is_refused_when_any_byte_changes() {
    let folder = Folder::new();
    let file = folder.write("libcounter.so", &bytes());
    assert!(plugin::seal(&file).unwrap());
    assert!(!plugin::seal(&file).unwrap(), "once is enough");
    plugin::load(&file).unwrap();
    let sealed = fs::read(&file).unwrap();
    assert_eq!(&sealed[..bytes().len()], bytes(), "the library itself is as it was");
    let parsed = object::File::parse(&*sealed).unwrap();
    // In tables of the loader, where a changed byte ends the opening process, at once or later.
    for name in [".rela.dyn", ".gnu.version", ".text", ".dynsym"] {
        let Some((at, length)) = parsed.section_by_name(name).and_then(|section| section.file_range()) else {
            continue;
        };
        let mut damaged = sealed.clone();
        damaged[(at + length / 2) as usize] ^= 0x10;
        assert_says(&refusal_of(&damaged), &["is damaged: it is not as it was sealed", "copy it again"]);
    }
}

#[test]
fn changed_library_is_reported_and_damaged_one_refused() {
    let folder = Folder::new();
    let file = folder.write("libcounter.so", &bytes());
    let known = folder.write("libraries.json", b"no such file");
    let start = || {
        let log = MemoryTarget::default();
        let options = Options {
            known_libraries: Some(known.clone()),
            log: vec![Box::new(log.clone())],
            ..Options::default()
        };
        let agent = try_lockstep_with(&robot(&file), options);
        if let Ok(agent) = &agent {
            agent.composer().flush_log(Duration::from_secs(10));
        }
        let told = log.lines().iter().filter(|line| line.text.contains("built or copied anew")).count();
        (agent, told)
    };
    let is_loaded_and_told_of = |told: usize| {
        let (agent, found) = start();
        step(&mut agent.unwrap(), 1);
        assert_eq!(found, told);
    };
    is_loaded_and_told_of(0);
    is_loaded_and_told_of(0);
    // As when it was only copied.
    fs::write(&file, bytes()).unwrap();
    is_loaded_and_told_of(0);
    assert!(plugin::seal(&file).unwrap());
    is_loaded_and_told_of(1);
    is_loaded_and_told_of(0);

    // A disk that fails changes bytes and no date, which looks the same as another checksum of the same bytes.
    let text = fs::read_to_string(&known).unwrap();
    let (before, after) = text.split_once("\"checksum\":\"").unwrap();
    fs::write(&known, format!("{before}\"checksum\":\"x{}", &after[1..])).unwrap();
    for _ in 0..2 {
        assert_says(
            &complaint(&start().0.unwrap_err()),
            &["is damaged", "without a write to the file", "copy it again"],
        );
    }
    fs::write(&file, bytes()).unwrap();
    is_loaded_and_told_of(1);
}

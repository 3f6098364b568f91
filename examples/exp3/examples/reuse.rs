//! Generator of `examples/REUSE.md`: reuse between RoCS's experiments.
//! It counts from the current sources and configurations: `cargo run -p slate-exp3 --example reuse >
//! examples/REUSE.md`.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::{fs, io};

/// Experiments, in the order in which one is made from the other.
const EXPERIMENTS: [&str; 3] = ["exp1", "exp2", "exp3"];

fn main() -> io::Result<()> {
    print!("{}", table()?);
    Ok(())
}

/// Returns the page.
pub fn table() -> io::Result<String> {
    // This package is in the folder of the examples, and that in the folder of the workspace.
    let mut folders = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().skip(1);
    let (Some(examples), Some(root)) = (folders.next(), folders.next()) else {
        return Err(io::Error::other("the package is not in its workspace"));
    };
    let sources = sources(root, examples)?;
    let mut page = String::from(HEAD);
    let mut known: BTreeSet<&PathBuf> = BTreeSet::new();
    let mut known_blocks = BTreeSet::new();
    let mut before: BTreeSet<String> = BTreeSet::new();
    let mut rows = String::new();
    let mut details = String::new();
    for name in EXPERIMENTS {
        let text = configuration(&examples.join(name).join(format!("{name}.toml")))?;
        let blocks = blocks(&text);
        let files = files_of(&blocks, &sources);
        let is_new = |file: &&PathBuf| !known.contains(*file);
        let new: Vec<_> = files.iter().copied().filter(is_new).collect();
        let reused: Vec<_> = files.iter().copied().filter(|file| !is_new(file)).collect();
        let lines = |files: &[&PathBuf]| files.iter().map(|file| sources[*file].lines).sum::<usize>();
        let new_blocks: Vec<_> = blocks.difference(&known_blocks).cloned().collect();
        let own = settings(&text);
        let same = own.iter().filter(|line| before.contains(*line)).count();
        // Writing to a string can't fail.
        let _ = writeln!(
            rows,
            "| {} | {} | {} | {} ({}) | {} ({}) | {same} of {} |",
            name.to_uppercase(),
            blocks.len() - new_blocks.len(),
            new_blocks.len(),
            reused.len(),
            lines(&reused),
            new.len(),
            lines(&new),
            own.len(),
        );
        let _ = writeln!(details, "\n## New in {}\n", name.to_uppercase());
        let _ = writeln!(details, "Blocks: {}.\n", code(&new_blocks));
        let _ = writeln!(details, "| file | lines of code |\n|---|---|");
        for file in new {
            let shown = file.strip_prefix(root).unwrap_or(file).display();
            let _ = writeln!(details, "| `{shown}` | {} |", sources[file].lines);
        }
        known.extend(files);
        known_blocks.extend(blocks);
        before.extend(own);
    }
    page += &rows;
    page += AUTHORS;
    page += &details;
    Ok(page)
}

const HEAD: &str = "# What is reused

RoCS asks what it costs to change the robot (Q2) and its task (Q3), and answers in words (sections 6.2, 6.4,
6.5). These are the numbers for Slate, counted by `cargo run -p slate-exp3 --example reuse` from the sources
as they are; a test keeps this page so.

A block is a module of the robot in the experiment's configuration. A file counts for an experiment when one
of its blocks is in it, or is made with it; lines are those of code, without comments and empty ones. All
experiments are built from one and the same source, so a file that two of them have is unchanged from the
one to the other: no number is needed for that. The laws of avoidance in `crates/modules/avoidance`, a
library of its own, are not counted.

| | blocks reused | blocks new | files reused (lines) | files new (lines) | lines of configuration known from before |
|---|---|---|---|---|---|
";

const AUTHORS: &str = "
In the authors' repository, of the 42 files of the second robot 20 are byte copies of those of the first, 14
are changed copies, and 8 are new.

## Changed for EXP2 and EXP3

These numbers are of the sources as they are, where one change is a change for all. When the second robot
came, EXP1's blocks had been written for a Pioneer alone, and became the library that they are. Counted
once, with `diff`, when EXP2 and EXP3 were done: of 627 lines of code in EXP1's seven files, 484 stayed as
they were.

| file | lines in EXP1 alone | of these unchanged | lines then |
|---|---|---|---|
| `actions.rs` | 216 | 162 | 218 |
| `analyzes.rs` | 114 | 114 | 114 |
| `avoid_obstacle.rs` | 82 | 46 | 167 |
| `avoid_wall.rs` | 33 | 33 | 33 |
| `go_to_origin.rs` | 74 | 43 | 65 |
| `knowledge.rs` | 52 | 30 | 65 |
| `monitors.rs` | 56 | 56 | 56 |

The actions had to turn two sides of any body in the place of two wheels, `knowledge.rs` to tell of that
body, `avoid_obstacle.rs` to regard robots that are seen, how a heavy body moves already. EXP1 links none of
that.
";

/// Returns the text of a configuration, with those that it includes.
fn configuration(file: &Path) -> io::Result<String> {
    let mut text = fs::read_to_string(file)?;
    let included: Vec<_> = text
        .lines()
        .filter_map(|line| line.strip_prefix("include = ["))
        .flat_map(|files| files.split('"').skip(1).step_by(2))
        .map(|name| file.with_file_name("").join(name))
        .collect();
    for file in included {
        text.push_str(&fs::read_to_string(file)?);
    }
    Ok(text)
}

/// File of blocks.
struct Source {
    /// Names by which configurations find the blocks in it.
    blocks: BTreeSet<String>,
    /// Files of the same crates that it is made with.
    uses: BTreeSet<PathBuf>,
    lines: usize,
}

/// Returns the files that blocks can come from.
fn sources(root: &Path, examples: &Path) -> io::Result<BTreeMap<PathBuf, Source>> {
    let library = root.join("crates/modules/wheeled/src");
    let mut texts = BTreeMap::new();
    for folder in [library.clone(), examples.join("exp3/src")] {
        for entry in fs::read_dir(&folder)? {
            let path = entry?.path();
            if path.file_name().is_some_and(|name| name != "lib.rs") {
                texts.insert(path.clone(), fs::read_to_string(&path)?);
            }
        }
    }
    let read = |(path, text): (&PathBuf, &String)| {
        let within = |word: &str, folder: &Path| {
            text.match_indices(word)
                .filter_map(|(at, _)| {
                    let rest = &text[at + word.len()..];
                    let name: String =
                        rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
                    Some(folder.join(format!("{name}.rs"))).filter(|path| texts.contains_key(path))
                })
                .collect::<BTreeSet<_>>()
        };
        let mut uses = within("slate_wheeled::", &library);
        if let Some(folder) = path.parent() {
            uses.extend(within("crate::", folder));
        }
        let quoted = |start: &str| -> BTreeSet<String> {
            text.match_indices(start)
                .filter_map(|(at, _)| text[at + start.len()..].split('"').next().map(str::to_owned))
                .collect()
        };
        let mut blocks = quoted("const NAME: &'static str = \"");
        blocks.extend(quoted("Body as \""));
        let is_code = |line: &&str| !line.trim().is_empty() && !line.trim().starts_with("//");
        (path.clone(), Source { blocks, uses, lines: text.lines().filter(is_code).count() })
    };
    Ok(texts.iter().map(read).collect())
}

/// Returns the files of some blocks, with all that they are made with.
fn files_of<'a>(blocks: &BTreeSet<String>, sources: &'a BTreeMap<PathBuf, Source>) -> BTreeSet<&'a PathBuf> {
    let mut open: Vec<_> = sources
        .iter()
        .filter(|(_, source)| !source.blocks.is_disjoint(blocks))
        .map(|(path, _)| path)
        .collect();
    let mut files = BTreeSet::new();
    while let Some(path) = open.pop() {
        if files.insert(path) {
            open.extend(
                sources[path]
                    .uses
                    .iter()
                    .filter_map(|path| sources.get_key_value(path))
                    .map(|(path, _)| path),
            );
        }
    }
    files
}

/// Returns the kinds of blocks in a configuration's tables of modules.
fn blocks(text: &str) -> BTreeSet<String> {
    let mut blocks = BTreeSet::new();
    let mut in_modules = false;
    for line in text.lines() {
        if line.starts_with('[') {
            in_modules = line.starts_with("[robots.") && line.ends_with(".modules]");
        } else if let (true, Some((name, rest))) = (in_modules, line.split_once(" = ")) {
            // A module's kind may be a table's entry or a dotted key.
            let (name, key) = name.split_once('.').unwrap_or((name, ""));
            if key == "kind" {
                blocks.insert(rest.trim_matches('"').to_owned());
                continue;
            }
            if !key.is_empty() {
                continue;
            }
            let plugin = rest.split("kind = \"").nth(1).and_then(|rest| rest.split('"').next());
            blocks.insert(plugin.unwrap_or(name).to_owned());
        }
    }
    blocks
}

/// Returns the lines that set a value.
/// Lines of different robots count as equal.
fn settings(text: &str) -> Vec<String> {
    let lines = text.lines().map(|line| line.split(" #").next().unwrap_or(line).trim());
    lines
        .filter(|line| !line.is_empty() && !line.starts_with('#'))
        .map(|line| line.replace("r2", "R").replace("r3", "R"))
        .collect()
}

fn code(names: &[String]) -> String {
    let lines = names
        .chunks(4)
        .map(|names| names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", "));
    lines.collect::<Vec<_>>().join(",\n")
}

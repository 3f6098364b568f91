//! Slate beside its peers: the same work, in the same run, in turns.
//!
//! `cargo run --release --manifest-path bench/Cargo.toml -- all|NAME... [--quick] [--out FOLDER]`
#![allow(clippy::disallowed_methods, reason = "a bench measures real time")]

mod machine;
mod measure;
mod table;
mod work;

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use measure::Effort;
use table::Table;

#[global_allocator]
static ALLOCATOR: measure::Counting = measure::Counting;

/// Arguments of the command line.
struct Arguments {
    works: Vec<work::Work>,
    effort: Effort,
    out: PathBuf,
}

impl Arguments {
    fn read(mut words: impl Iterator<Item = String>) -> Result<Self, String> {
        let (mut works, mut quick, mut out) = (Vec::new(), false, None);
        while let Some(word) = words.next() {
            match word.as_str() {
                "--quick" => quick = true,
                "--out" => out = Some(words.next().ok_or("`--out` wants a folder")?),
                "all" => works.extend(work::ALL),
                name => match work::ALL.iter().find(|(known, _)| *known == name) {
                    Some(work) => works.push(*work),
                    None => return Err(format!("nothing is called `{name}`")),
                },
            }
        }
        if works.is_empty() {
            return Err("nothing is to be measured".into());
        }
        let out = out.map_or_else(
            || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/target/results")),
            PathBuf::from,
        );
        Ok(Self { works, effort: Effort { quick }, out })
    }
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    // The other processes of some works are this program again.
    match arguments.split_first().map(|(first, rest)| (first.as_str(), rest)) {
        Some((work::process::READER, rest)) => work::process::read(rest),
        Some((work::scale::PROCESS, rest)) => work::scale::make(rest),
        _ => return measure(&arguments),
    }
    ExitCode::SUCCESS
}

/// Runs the requested measurements.
fn measure(arguments: &[String]) -> ExitCode {
    let wanted = match Arguments::read(arguments.iter().cloned()) {
        Ok(wanted) => wanted,
        Err(error) => {
            let names: Vec<_> = work::ALL.iter().map(|(name, _)| *name).collect();
            eprintln!(
                "error: {error}\n\nusage: slate-bench all|NAME... [--quick] [--out FOLDER]\nnames: {}",
                names.join(", ")
            );
            return ExitCode::from(2);
        }
    };
    let start = Instant::now();
    let mut table = Table { run: machine::describe(), ..Table::default() };
    let command = format!("cargo run --release --manifest-path bench/Cargo.toml -- {}", arguments.join(" "));
    table.run.push(format!("Command: `{command}`"));
    table.run.iter().for_each(|line| println!("{line}"));
    machine::measure(wanted.effort, &mut table);
    let mut times = vec![("machine", start.elapsed())];
    for (name, work) in &wanted.works {
        let start = Instant::now();
        work(wanted.effort, &mut table);
        machine::unpin();
        times.push((*name, start.elapsed()));
    }
    let times: Vec<_> =
        times.iter().map(|(name, took)| format!("{name} {:.1} s", took.as_secs_f64())).collect();
    println!("took {:.1} s: {}", start.elapsed().as_secs_f64(), times.join(", "));
    match write(&wanted.out, &table) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {}: {error}", wanted.out.display());
            ExitCode::FAILURE
        }
    }
}

/// Writes the table for programs and for people.
fn write(folder: &std::path::Path, table: &Table) -> std::io::Result<()> {
    std::fs::create_dir_all(folder)?;
    std::fs::write(folder.join("results.json"), serde_json::to_vec_pretty(table)?)?;
    std::fs::write(folder.join("results.md"), table.markdown())?;
    println!("written: {}/results.json and results.md", folder.display());
    Ok(())
}

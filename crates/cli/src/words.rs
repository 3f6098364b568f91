//! Order of the words of a command.

use std::ffi::OsString;

use clap::{Arg, Command, ValueEnum};
use slate::blackboard::nearest_names;
use slate_run::output::ColorChoice;

use crate::failure::Failure;

/// Takes the word after an option as its value, even one such as `-1`.
/// The error then names the expected value, instead of an unknown option `-1`.
pub fn with_negative_values(command: Command) -> Command {
    let is_for_a_value = |arg: &Arg| !arg.is_positional() && arg.get_action().takes_values();
    let command = command.mut_args(|arg| match is_for_a_value(&arg) {
        true => arg.allow_negative_numbers(true),
        false => arg,
    });
    command.mut_subcommands(with_negative_values)
}

/// Options that may precede a verb.
const LEADING_OPTIONS: [&str; 6] = ["--agent", "--color", "--help", "-h", "--version", "-V"];

/// Returns the number of words of a leading option, if the first word is one.
fn taken(words: &[OsString]) -> Option<usize> {
    let word = words.first()?.to_str()?;
    let (name, value, taken) = match word.split_once('=') {
        Some((name, value)) => (name, value, 1),
        None => (word, words.get(1)?.to_str()?, 2),
    };
    let fits = match name {
        "--agent" => !value.is_empty() && !value.starts_with('-'),
        "--color" => ColorChoice::from_str(value, false).is_ok(),
        _ => false,
    };
    fits.then_some(taken)
}

/// Returns the index of the verb, after the options that may precede it.
fn verb(words: &[OsString]) -> usize {
    let mut place = 1;
    while let Some(taken) = words.get(place..).and_then(taken) {
        place += taken;
    }
    place
}

/// Moves an agent that is named before the verb behind the verb's arguments.
/// Only for verbs that know the option.
pub fn with_agent_behind(words: Vec<OsString>) -> Vec<OsString> {
    let verb = verb(&words).min(words.len());
    let (mut ordered, mut agent) = (Vec::new(), Vec::new());
    let mut leading = &words[..verb];
    while let Some(word) = leading.first() {
        let count = taken(leading).unwrap_or(1);
        let is_agent = word.to_str().is_some_and(|word| word.starts_with("--agent"));
        if is_agent { &mut agent } else { &mut ordered }.extend_from_slice(&leading[..count]);
        leading = &leading[count..];
    }
    let rest = &words[verb..];
    let end = rest.iter().position(|word| word == "--").unwrap_or(rest.len());
    ordered.extend_from_slice(&rest[..end]);
    ordered.extend(agent);
    ordered.extend_from_slice(&rest[end..]);
    ordered
}

/// Sorts the words of a stop: options first, all others as its reason.
/// So a stop is not refused for an unknown option.
pub fn of_stop(words: Vec<OsString>) -> Vec<OsString> {
    let verb = verb(&words);
    if words.get(verb).is_none_or(|word| word != "stop") {
        return words;
    }
    let (mut options, mut reason) = (words[..=verb].to_vec(), Vec::new());
    let mut rest = &words[verb + 1..];
    while let Some(word) = rest.first() {
        let count = taken(rest).unwrap_or(1);
        // A request for help on stop comes first.
        let is_help = reason.is_empty() && (word == "--help" || word == "-h");
        match word {
            word if word == "--" => {
                reason.extend(rest[1..].iter().map(text));
                break;
            }
            word if word == "--json" && options.contains(word) => {}
            word if word == "--json" || is_help || taken(rest).is_some() => {
                options.extend_from_slice(&rest[..count]);
            }
            word => reason.push(text(word)),
        }
        rest = &rest[count..];
    }
    options.push("--".into());
    options.extend(reason);
    options
}

/// Refuses an unknown option before the verb, and suggests the one meant.
/// It is one of those that may be there, or one of the verb.
pub fn check_leading(words: &[OsString], command: &Command) -> Result<(), Failure> {
    let Some((option, behind)) = words.get(verb(words)..).and_then(<[OsString]>::split_first) else {
        return Ok(());
    };
    let option = option.to_string_lossy();
    let option = option.split_once('=').map_or(&*option, |(name, _)| name);
    // Of those that are known the parser says what is wrong with them.
    if !option.starts_with('-') || ["-", "--"].contains(&option) || LEADING_OPTIONS.contains(&option) {
        return Ok(());
    }
    let verb = behind.iter().find_map(|word| command.find_subcommand(word));
    let of_verb = verb.into_iter().flat_map(Command::get_arguments).filter_map(|own| own.get_long());
    let of_verb: Vec<_> = of_verb.map(|name| format!("--{name}")).collect();
    let known = LEADING_OPTIONS.into_iter().filter(|name| name.starts_with("--"));
    let near = nearest_names(option, known.chain(of_verb.iter().map(String::as_str)));
    let near = near.first().map(|near| match verb.filter(|_| !LEADING_OPTIONS.contains(&near.as_str())) {
        Some(verb) => format!("slate {} {near}", verb.get_name()),
        None => near.clone(),
    });
    let verb = verb.map(|verb| verb.get_name().to_owned());
    Err(Failure::Leading { option: option.to_owned(), near, verb })
}

/// Returns a word that is safe to print.
fn text(word: &OsString) -> OsString {
    word.to_string_lossy().into_owned().into()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ordered(order: fn(Vec<OsString>) -> Vec<OsString>, line: &str) -> String {
        let words = order(line.split(' ').map(OsString::from).collect());
        words.iter().map(|word| word.to_string_lossy()).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn an_agent_before_the_verb_equals_an_agent_behind_it() {
        for (text, wanted) in [
            ("slate --agent r2 tree --values", "slate tree --values --agent r2"),
            (
                "slate --color never --agent=r2 record start /a",
                "slate --color never record start /a --agent=r2",
            ),
            ("slate --agent r2 stop -- no -x", "slate stop --agent r2 -- no -x"),
            ("slate tree --agent r2", "slate tree --agent r2"),
            ("slate --agent", "slate --agent"),
            ("slate", "slate"),
        ] {
            assert_eq!(ordered(with_agent_behind, text), wanted);
        }
    }

    #[test]
    fn a_stop_takes_options_first_and_other_words_as_its_reason() {
        for (text, wanted) in [
            (
                "slate stop --now --agent r2 quick --json --json",
                "slate stop --agent r2 --json -- --now quick",
            ),
            ("slate stop --agent", "slate stop -- --agent"),
            ("slate stop --agent --json", "slate stop --json -- --agent"),
            ("slate stop --color blue", "slate stop -- --color blue"),
            ("slate --color never stop --json=1", "slate --color never stop -- --json=1"),
            ("slate stop --help", "slate stop --help --"),
            ("slate stop it --help", "slate stop -- it --help"),
            ("slate stop -- --agent r2", "slate stop -- --agent r2"),
            ("slate reset --now", "slate reset --now"),
        ] {
            assert_eq!(ordered(of_stop, text), wanted);
        }
    }
}

//! What kinds of mistakes mean: each has a code that stays, so that it can be looked up and asked about.

use serde_json::json;
use slate::runtime::Mistake;

use crate::failure::Failure;
use crate::output;

/// What a kind of mistake is called, and what it means and what to do.
fn meaning(mistake: Mistake) -> (&'static str, &'static str) {
    match mistake {
        Mistake::Syntax => (
            "a file can't be read as a configuration",
            "A configuration is TOML (https://toml.io). The place under the caret is where reading stopped, and what is \
             missing often stands before it: a closing quote or bracket, or an `=`. An included file is found relative to the \
             file that includes it.",
        ),
        Mistake::Key => (
            "a key that means nothing",
            "Each table has the keys that the book's chapter on configuration lists; another one is a mistake, so that no setting \
             is lost by a typing error. Of two keys that exclude each other the later layer wins, and in one file only one may \
             stand.",
        ),
        Mistake::Parameter => (
            "a module has no such parameter",
            "Parameters are what a module declares with #[param]. `slate get /MODULE/params` shows those of a module that runs, and \
             `slate plugin info LIBRARY` those of a library.",
        ),
        Mistake::Name => (
            "there is nothing of that name",
            "A link joins an input, `module/input`, to a property, `module/output`, to a field of one or to an actuator's `command`. \
             Names in the tables of a robot are below it, so `planner/plan` in [robots.r2.links] is `r2/planner/plan`; a `/` in \
             front begins at the agent. `slate tree` shows what there is.",
        ),
        Mistake::Kind => (
            "no plugin brings such a module",
            "The kind of a module is said by `kind = \"...\"`, and is the module's own name unless said. Kinds come with the \
             command, or with libraries that [plugins] names. `slate plugin list` shows the kinds of an agent that runs.",
        ),
        Mistake::Ends => (
            "the two ends of a link don't fit",
            "An input takes values of one interface. Fields are linked one by one when the interfaces are others, and numbers are \
             converted when their units measure the same. `different versions` means that one plugin was built against an older \
             source of the interface: build both anew. `slate interface diff OLD NEW` shows what changed.",
        ),
        Mistake::Circle => (
            "a circle of modules that wait for each other",
            "Modules of a stage run in the order of their links, a writer before its readers. In a circle nobody is first: let one \
             link read the value of the last cycle, `previous = true`, or put a module into a later stage. Modules that wait for each \
             other's first value never run: let one of them take an `Input<T>` instead of a `Required<T>`.",
        ),
        Mistake::TwoSources => (
            "an input has two sources",
            "An input has a link or a value of the configuration. Take one away; `slate unlink` does it while the agent runs.",
        ),
        Mistake::Service => (
            "a service is missing",
            "A module says what it needs from the host or other modules: a camera, transforms, a network. The plugin that provides it \
             has to be loaded before.",
        ),
        Mistake::Second => (
            "a robot has one of these",
            "A robot has one Plan, one Execute and one Knowledge (RoCS), and a loop one owner. Put the second into another robot, or \
             switch between them by other means than `enabled`.",
        ),
        Mistake::PastGate => (
            "a command goes past the gate",
            "Whatever moves something reads `ACTUATOR/command`, which has passed the gate: it is within limits, fresh, and nobody has \
             stopped the robot. Describe the actuator in [actuators], and link the driver to its `command`.",
        ),
        Mistake::TimeSource => (
            "the time source is not there",
            "`time.source` names the module that is the clock, as a rule the simulator. Without it, an agent goes by the wall clock.",
        ),
        Mistake::OtherAgent => (
            "another agent is meant",
            "What is another agent's is read by a link to `slate://AGENT/PATH`, which the [share] table lets through, and is set \
             at that agent only: --agent NAME.",
        ),
        Mistake::Library => (
            "a library does not fit",
            "What a library offers and needs is read before it is opened. `slate plugin info LIBRARY` shows it: the version of the \
             plugin interface, the schemas of its ports, and what a panic does have to be those of this program.",
        ),
        Mistake::Value => (
            "a value does not fit",
            "Each setting has a type, and many an interval; the message has both. Durations have a unit, such as \"20ms\". Nothing is \
             rounded or cut: what can't be held exactly is refused.",
        ),
        Mistake::NoAgent => (
            "no agent is reached",
            "Commands find agents of the same user by their sockets, in XDG_RUNTIME_DIR/slate or /tmp/slate-UID. `slate ps` lists \
             them, `slate doctor` says whether that folder is as it should be.",
        ),
        Mistake::WhichAgent => (
            "it has to be said which agent",
            "Name it with --agent NAME, or by a whole URL such as slate://NAME/loop/state.",
        ),
        Mistake::Silent => (
            "the agent does not answer",
            "Its process hangs, is stopped, or has just ended. `slate ps` shows its process; the log tells what it did last.",
        ),
        Mistake::Version => (
            "the agent speaks another version",
            "The agent was started by another release of Slate. Use the command of that release, or start the agent anew.",
        ),
        Mistake::OneWriter => (
            "a property has one writer",
            "So no write ever waits, and what a property shows has one author. Parameters and inputs without a link are yours to set; \
             an output is changed by linking its readers to another one (`slate link`), or by what its module reads.",
        ),
        Mistake::Linked => (
            "a link fills it",
            "An input that is linked has the value of what it reads. `slate unlink INPUT` takes the link away; the input then keeps a \
             value that can be set, and `slate config revert` brings the link back.",
        ),
        Mistake::Messages => (
            "it takes messages, and has no value",
            "Messages are commands from one module to another, in order. They can be seen in a recording; a value can't be read or set.",
        ),
        Mistake::Held => (
            "somebody else has it",
            "One person or program at a time has the controls of an actuator. `slate api GET /leases` says who, and since when. They come \
             free when that one gives them back or is gone; a stop (`slate stop`) needs no controls.",
        ),
    }
}

/// The kind that a code is of, which may be said without its noughts: S7 is S007.
fn found(code: &str) -> Option<Mistake> {
    let number: Option<u16> = code.strip_prefix(['S', 's']).and_then(|digits| digits.parse().ok());
    Mistake::from_code(code).or_else(|| Mistake::from_code(&format!("S{:03}", number?)))
}

/// What a code means; nothing when it is none.
#[cfg(feature = "mcp")]
pub fn explained(code: &str) -> Option<serde_json::Value> {
    found(code).map(document)
}

fn document(mistake: Mistake) -> serde_json::Value {
    let (title, explanation) = meaning(mistake);
    json!({"code": mistake.code(), "title": title, "explanation": explanation})
}

/// Explains codes, or lists all.
pub fn explain(wanted: &[String], json: bool) -> Result<bool, Failure> {
    let mut chosen = Vec::new();
    for name in wanted {
        chosen.push(found(name).ok_or_else(|| Failure::NoCode { code: name.clone() })?);
    }
    let all = wanted.is_empty();
    if all {
        chosen.extend(Mistake::ALL);
    }
    if json {
        let codes: Vec<_> = chosen.into_iter().map(document).collect();
        output::json(&json!({"schema": "slate.explain/1", "codes": codes}));
    } else if all {
        output::columns(chosen.into_iter().map(|one| [one.code().to_owned(), meaning(one).0.to_owned()]));
    } else {
        for mistake in chosen {
            let (title, explanation) = meaning(mistake);
            output::line(format_args!("{}: {title}\n\n{explanation}\n", mistake.code()));
        }
    }
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_is_explained_and_found_by_its_own_code() {
        for mistake in Mistake::ALL {
            let (title, explanation) = meaning(mistake);
            assert!(!title.is_empty() && explanation.len() > 60, "{}", mistake.code());
            assert_eq!(Mistake::from_code(&mistake.code().to_lowercase()), Some(mistake));
        }
    }
}

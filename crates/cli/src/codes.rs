//! What is wrong, by kind: a code that stays, so that it can be looked up and asked about.

use serde_json::json;

use crate::failure::Failure;
use crate::output;

/// A kind of mistake.
struct Code {
    code: &'static str,
    title: &'static str,
    /// What a message of that kind has in it: one of these.
    signs: &'static [&'static str],
    /// What it means, and what to do.
    explanation: &'static str,
}

/// A message is of the first kind of which it has a sign, so the narrower ones come first. Codes are never used again.
const CODES: [Code; 22] = [
    Code {
        code: "S001",
        title: "a file can't be read as a configuration",
        signs: &[
            "can't read the configuration",
            "is not UTF-8",
            "TOML parse error",
            "invalid ",
            "expected `=`",
            "unclosed",
        ],
        explanation: "A configuration is TOML (https://toml.io). The place under the caret is where reading stopped, and what is \
                      missing often stands before it: a closing quote or bracket, or an `=`. An included file is found relative to the \
                      file that includes it.",
    },
    Code {
        code: "S002",
        title: "a key that means nothing",
        signs: &["unknown key", "is set twice", "exclude each other"],
        explanation: "Each table has the keys that the book's chapter on configuration lists; another one is a mistake, so that no setting \
                      is lost by a typing error. Of two keys that exclude each other the later layer wins, and in one file only one may \
                      stand.",
    },
    Code {
        code: "S003",
        title: "a module has no such parameter",
        signs: &["no parameter", "has no parameters"],
        explanation: "Parameters are what a module declares with #[param]. `slate get /MODULE/params` shows those of a module that runs, and \
                      `slate plugin info LIBRARY` those of a library.",
    },
    Code {
        code: "S004",
        title: "nothing of that name can be linked",
        signs: &[
            "no module owns",
            "nothing is called",
            "has no port",
            "has no output",
            "has no input",
            "names no property",
            "has no field",
            "no property at",
            "no robot or module is called",
            "there is no item",
        ],
        explanation: "A link joins an input, `module/input`, to a property, `module/output`, to a field of one or to an actuator's `command`. \
                      Names in the tables of a robot are below it, so `planner/plan` in [robots.r2.links] is `r2/planner/plan`; a `/` in \
                      front begins at the agent. `slate tree` shows what there is.",
    },
    Code {
        code: "S005",
        title: "no plugin brings such a module",
        signs: &["no plugin brings a module"],
        explanation: "The kind of a module is said by `plugin = \"kind\"`, and is the module's own name unless said. Kinds come with the \
                      command, or with libraries that [plugins] names. `slate plugin list` shows the kinds of an agent that runs.",
    },
    Code {
        code: "S006",
        title: "the two ends of a link don't fit",
        signs: &[
            "different versions of",
            "receives messages, but",
            "sends messages, but",
            "takes whole values",
            "` takes ",
            " but `/",
            "is an inbox",
            "is no queue input",
            "is an output",
            "has no meaning for messages",
            "is a service",
        ],
        explanation: "An input takes values of one interface. Fields are linked one by one when the interfaces are others, and numbers are \
                      converted when their units measure the same. `different versions` means that one plugin was built against an older \
                      source of the interface: build both anew. `slate interface diff OLD NEW` shows what changed.",
    },
    Code {
        code: "S007",
        title: "a circle of modules that wait for each other",
        signs: &["in a circle", "circle", "cycle of"],
        explanation: "Modules of a stage run in the order of their links, a writer before its readers. In a circle nobody is first: let one \
                      link read the value of the last cycle, `previous = true`, or put a module into a later stage.",
    },
    Code {
        code: "S008",
        title: "an input has two sources",
        signs: &["both a link and a value", "is linked already"],
        explanation: "An input has a link or a value of the configuration. Take one away; `slate unlink` does it while the agent runs.",
    },
    Code {
        code: "S009",
        title: "a service is missing",
        signs: &["which nothing provides", "provide"],
        explanation: "A module says what it needs from the host or other modules: a camera, transforms, a network. The plugin that provides it \
                      has to be loaded before.",
    },
    Code {
        code: "S010",
        title: "a robot has one of these",
        signs: &["a robot has one", "both want the main loop"],
        explanation: "A robot has one Plan, one Execute and one Knowledge (RoCS), and a loop one owner. Put the second into another robot, or \
                      switch between them by other means than `enabled`.",
    },
    Code {
        code: "S011",
        title: "a command goes past the gate",
        signs: &["has not passed its gate", "can't take an actuator's command"],
        explanation: "Whatever moves something reads `ACTUATOR/command`, which has passed the gate: it is within limits, fresh, and nobody has \
                      stopped the robot. Describe the actuator in [actuators], and link the driver to its `command`.",
    },
    Code {
        code: "S012",
        title: "the time source is not there",
        signs: &["time source"],
        explanation: "`time.source` names the module that is the clock, as a rule the simulator. Without it, an agent goes by the wall clock.",
    },
    Code {
        code: "S013",
        title: "another agent is meant",
        signs: &[
            "no agent is called",
            "is another agent",
            "this one shares nothing",
            "of another agent",
            "no carrier",
            "is no endpoint",
            "belongs to another agent",
        ],
        explanation: "What is another agent's is read by a link to `slate://AGENT/PATH`, which the [share] table lets through, and is set \
                      at that agent only: --agent NAME.",
    },
    Code {
        code: "S014",
        title: "a library does not fit",
        signs: &["is no shared library", "built against", "brings already", ".so: "],
        explanation: "What a library offers and needs is read before it is opened. `slate plugin info LIBRARY` shows it: the version of the \
                      plugin interface, the schemas of its ports, and what a panic does have to be those of this program.",
    },
    Code {
        code: "S015",
        title: "a value does not fit",
        signs: &[
            "outside ",
            "must be",
            " takes a",
            "can't be more than",
            "is no duration",
            "is no number",
            "is no condition",
            "is no rate",
            ", not a",
            ", found",
            "can't hold",
            "can't have",
            "is no value",
            "does not hold",
        ],
        explanation: "Each setting has a type, and many an interval; the message has both. Durations have a unit, such as \"20ms\". Nothing is \
                      rounded or cut: what can't be held exactly is refused.",
    },
    Code {
        code: "S101",
        title: "no agent is reached",
        signs: &["no agent runs here", "no agent `"],
        explanation: "Commands find agents of the same user by their sockets, in XDG_RUNTIME_DIR/slate or /tmp/slate-UID. `slate ps` lists \
                      them, `slate doctor` says whether that folder is as it should be.",
    },
    Code {
        code: "S102",
        title: "it has to be said which agent",
        signs: &["several agents run here"],
        explanation: "Name it with --agent NAME, or by a whole URL such as slate://NAME/loop/state.",
    },
    Code {
        code: "S103",
        title: "the agent does not answer",
        signs: &["does not answer", "can't be understood"],
        explanation: "Its process hangs, is stopped, or has just ended. `slate ps` shows its process; the log tells what it did last.",
    },
    Code {
        code: "S104",
        title: "the agent speaks another version",
        signs: &["of the protocol"],
        explanation: "The agent was started by another release of Slate. Use the command of that release, or start the agent anew.",
    },
    Code {
        code: "S105",
        title: "a property has one writer",
        signs: &["has one writer", "is written by its module", "the host's own"],
        explanation: "So no write ever waits, and what a property shows has one author. Parameters and inputs without a link are yours to set; \
                      an output is changed by linking its readers to another one (`slate link`), or by what its module reads.",
    },
    Code {
        code: "S106",
        title: "a link fills it",
        signs: &["is linked, from", "take the link away first"],
        explanation: "An input that is linked has the value of what it reads. `slate unlink INPUT` takes the link away; the input then keeps a \
                      value that can be set, and `slate config revert` brings the link back.",
    },
    Code {
        code: "S107",
        title: "it takes messages, and has no value",
        signs: &["takes messages"],
        explanation: "Messages are commands from one module to another, in order. They can be seen in a recording; a value can't be read or set.",
    },
];

/// The code of a message.
pub fn of(message: &str) -> Option<&'static str> {
    let is_of = |code: &&Code| code.signs.iter().any(|sign| message.contains(sign));
    CODES.iter().find(is_of).map(|code| code.code)
}

/// Explains codes, or lists all.
pub fn explain(wanted: &[String], json: bool) -> Result<bool, Failure> {
    let mut chosen: Vec<&Code> = Vec::new();
    for name in wanted {
        let code = CODES.iter().find(|code| code.code.eq_ignore_ascii_case(name));
        chosen.push(code.ok_or_else(|| Failure::NoCode { code: name.clone() })?);
    }
    let all = wanted.is_empty();
    if json {
        let codes = CODES.iter().filter(|code| all || chosen.iter().any(|one| one.code == code.code));
        let code =
            |code: &Code| json!({"code": code.code, "title": code.title, "explanation": code.explanation});
        let codes: Vec<_> = codes.map(code).collect();
        output::json(&json!({"schema": "slate.explain/1", "codes": codes}));
    } else if all {
        output::columns(CODES.iter().map(|code| [code.code.to_owned(), code.title.to_owned()]));
    } else {
        for Code { code, title, explanation, .. } in chosen {
            output::line(format_args!("{code}: {title}\n\n{explanation}\n"));
        }
    }
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_code_stands_once_and_is_explained() {
        for (index, code) in CODES.iter().enumerate() {
            assert!(CODES[..index].iter().all(|other| other.code != code.code), "{}", code.code);
            assert!(
                code.explanation.len() > 60 && !code.title.is_empty() && !code.signs.is_empty(),
                "{}",
                code.code
            );
        }
    }

    #[test]
    fn a_message_has_the_code_of_the_narrowest_kind() {
        for (message, code) in [
            ("no parameter `sped`", "S003"),
            ("`speed` is 99, outside 0 to 3", "S015"),
            ("no module owns `r2/plannr/situation`", "S004"),
            ("no plugin brings a module `planer`", "S005"),
            ("a robot has one Plan, and `r2/planner` is it already", "S010"),
            ("/simulator/r2/truth is written by module `simulator`, and a property has one writer", "S105"),
            ("`r2/planner/position` is linked, from /simulator/r2/position", "S106"),
            ("no agent runs here", "S101"),
        ] {
            assert_eq!(of(message), Some(code), "{message}");
        }
        assert_eq!(of("something else"), None);
    }
}

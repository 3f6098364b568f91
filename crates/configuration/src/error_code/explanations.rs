//! Explanations of the error codes, which stay the same from release to release.

use super::ErrorCode;

/// Explanation of an error code.
#[derive(Clone, Copy, Debug)]
pub struct Explanation {
    /// Kind.
    pub error_code: ErrorCode,
    /// Title, without a full stop.
    pub title: &'static str,
    /// Cause and remedy, in paragraphs.
    pub text: &'static str,
}

/// Explanations of the codes, in their order.
pub const EXPLANATIONS: &[Explanation] = &[
    Explanation {
        error_code: ErrorCode::Syntax,
        title: "invalid syntax",
        text: "A configuration is TOML (https://toml.io). The caret marks where reading stopped; the cause is \
               often before it: a missing closing quote or bracket, or a missing `=`. The path of an included \
               file is relative to the file that includes it.",
    },
    Explanation {
        error_code: ErrorCode::Key,
        title: "unknown key",
        text: "The book's chapter on configuration lists the keys of each table. An unknown key is an error, so \
               that no setting is lost by a typing error. Of two keys that exclude each other the later layer \
               wins; one file may contain only one of them.",
    },
    Explanation {
        error_code: ErrorCode::Parameter,
        title: "unknown parameter",
        text: "A module declares its parameters with #[param]. `slate get /MODULE/params` prints those of a \
               running module, `slate plugin info LIBRARY` those of a library.",
    },
    Explanation {
        error_code: ErrorCode::Name,
        title: "unknown name",
        text: "A link joins an input, `module/input`, to a property, `module/output`, to a field of a property, \
               or to an actuator's `command`. Names in a robot's tables are relative to the robot, so \
               `planner/plan` in [robots.r2.links] means `r2/planner/plan`; a leading `/` starts at the agent. \
               `slate tree` lists all properties.",
    },
    Explanation {
        error_code: ErrorCode::Kind,
        title: "unknown kind of module",
        text: "`kind = \"...\"` selects the kind of a module; the default is the module's own name. Kinds are \
               built into the command, some as its features, which `slate --version` lists, or come with libraries that \
               [plugins] names. `slate plugin list` lists the kinds of a running agent.",
    },
    Explanation {
        error_code: ErrorCode::Ends,
        title: "the two ends of a link don't match",
        text: "A link is written `\"destination\" = \"source\"`. What the destination takes and what the source has must fit:\n\n\
               - Interfaces: both have the same one, or one that converts exactly: whole numbers to wider ones and to \
               smaller units of the same quantity, and interfaces with such fields of the same names. Otherwise link single \
               fields, such as `\"planner/goal/x\" = \"tracker/target/x\"`.\n\
               - `different versions`: one plugin was built against an older source of the interface. Rebuild both; `slate \
               interface diff OLD NEW` shows what changed.\n\
               - Direction: the input is on the left, the output on the right. The message prints the turned line.\n\
               - Messages: an inbox takes an outbox, and inputs take values. A queue input takes queues, or values one by \
               one; `policy` and `window` are for queue inputs.\n\
               - Parts: fields of an input can be linked, but not items of a list or parts of a queue's values; of \
               parameters, only single ones.\n\
               - Several candidates: an input that is linked by its type has more than one fitting source in its robot. \
               Write one of the links that the message lists, or `\"/module/input\" = false` for none.\n\n\
               `slate get` and `slate interface` show the fields of a value, `slate graph` all links.",
    },
    Explanation {
        error_code: ErrorCode::Circle,
        title: "cyclic dependency of modules",
        text: "Modules of a stage run in the order of their links, a writer before its readers. In a cycle no \
               module can run first: mark one link `previous = true`, which reads the value of the last cycle, or \
               move a module to a later stage. Modules that wait for each other's first value never run: use \
               `Input<T>` instead of `Required<T>` in one of them.",
    },
    Explanation {
        error_code: ErrorCode::TwoSources,
        title: "an input has two sources",
        text: "An input has either a link or a value of the configuration. Remove one; `slate unlink` does it in \
               a running agent.",
    },
    Explanation {
        error_code: ErrorCode::Service,
        title: "a service is missing",
        text: "A module declares what it needs from the host or other modules, such as a camera, transforms or a \
               network. Load the plugin that provides the service first.",
    },
    Explanation {
        error_code: ErrorCode::Second,
        title: "a robot can have only one of these",
        text: "A robot has one Plan, one Execute and one Knowledge (RoCS), and a loop one owner. Put the second \
               into another robot, or switch between them without `enabled`.",
    },
    Explanation {
        error_code: ErrorCode::PastGate,
        title: "a command bypasses the gate",
        text: "A driver must read `ACTUATOR/command`, which has passed the gate: it is within limits, fresh, and \
               blocked while the robot is stopped. Describe the actuator in [actuators], and link the driver to \
               its `command`.",
    },
    Explanation {
        error_code: ErrorCode::TimeSource,
        title: "unknown time source",
        text: "`time.source` names the module that is the clock, usually the simulator. Without it, an agent runs \
               on the wall clock.",
    },
    Explanation {
        error_code: ErrorCode::OtherAgent,
        title: "the property belongs to another agent",
        text: "Read another agent's property by a link to `slate://AGENT/PATH`, which its [share] table must \
               allow. Set it at that agent only: --agent NAME.",
    },
    Explanation {
        error_code: ErrorCode::Library,
        title: "a library does not fit",
        text: "The properties of a library are read before it is opened; `slate plugin info LIBRARY` prints them. \
               The version of its plugin interface, the schemas of its ports and its panic strategy must match \
               this program.",
    },
    Explanation {
        error_code: ErrorCode::Value,
        title: "invalid value",
        text: "Each setting has a type, and many have a range; the message contains both. Durations have a unit, \
               such as \"20ms\". Values are never rounded or truncated: what can't be represented exactly is \
               refused.",
    },
    Explanation {
        error_code: ErrorCode::Attachment,
        title: "a link violates the architecture",
        text: "Sensor -> Monitor -> Analyze -> Plan -> Execute -> gate -> Actuator, and all but Sensors read \
               Knowledge: the message says what this block reads and what to put between. A reflex reads Sensors \
               and Knowledge alone. An Analyze reads another one as a fact of Knowledge, `fact: Known<T>`. A \
               block reads blocks of its own robot; a Sensor may read another robot, and Knowledge its Knowledge. Blocks \
               act through the Execute of their own robot. Ground truth of a simulator, and what a referee makes \
               of it, is for ports of referees, those with the role `truth`. A person may set any port that has no \
               link. The rules do not apply to robots of plain modules.",
    },
    Explanation {
        error_code: ErrorCode::Hardware,
        title: "a RobotModel of another robot",
        text: "The RobotModel of a robot comes from the description that its Knowledge names, such as `robot = \
               \"pioneer_p3dx\"`. Wheels, mounts and numbers of elements must be those of the simulated robot or of the \
               driver that the robot moves (a calibrated drive may differ by 5 %), an Execute commands the actuators \
               that the description has, and Monitors, ReactiveModels and Execute read sensors that it has.",
    },
    Explanation {
        error_code: ErrorCode::Feature,
        title: "a feature is not built in",
        text: "Parts of Slate that take long to build or need libraries are features of the command: `slate --version` \
               lists those that are built in, and those that are not. Build it with the one that the message names, such \
               as `cargo build --release --features missions`; `--features full` has all but the bridges to DDS and ROS.",
    },
    Explanation {
        error_code: ErrorCode::Setting,
        title: "a setting does not fit",
        text: "The message names the setting and what is expected there. The book's chapter on configuration describes \
               the tables; `slate config get PATH` prints a setting of a running agent with the layer that it is from.",
    },
    Explanation {
        error_code: ErrorCode::NoAgent,
        title: "no agent found",
        text: "Commands find agents of the same user by their sockets, in XDG_RUNTIME_DIR/slate or \
               /tmp/slate-UID. `slate ps` lists them, `slate doctor` checks the folder.",
    },
    Explanation {
        error_code: ErrorCode::WhichAgent,
        title: "several agents match",
        text: "Name one with --agent NAME, or by a full URL such as slate://NAME/loop/state.",
    },
    Explanation {
        error_code: ErrorCode::Silent,
        title: "the agent does not answer",
        text: "Its process hangs, is suspended, or has just ended. `slate ps` shows the process; the log shows \
               its last messages.",
    },
    Explanation {
        error_code: ErrorCode::Version,
        title: "the agent speaks another version",
        text: "The agent was started by another release of Slate. Use the command of that release, or restart the \
               agent.",
    },
    Explanation {
        error_code: ErrorCode::OneWriter,
        title: "a property has one writer",
        text: "No write ever waits, and the author of each value is known. You can set parameters and unlinked \
               inputs; to replace an output, link its readers to another one (`slate link`), or change what its \
               module reads.",
    },
    Explanation {
        error_code: ErrorCode::Linked,
        title: "the input is linked",
        text: "A linked input has the value of its source. `slate unlink INPUT` removes the link; the input then \
               keeps its value, which can be set, and `slate config revert` restores the link.",
    },
    Explanation {
        error_code: ErrorCode::Messages,
        title: "the property takes messages and has no value",
        text: "Messages are commands from one module to another, in order. A recording contains them; they can't \
               be read or set.",
    },
    Explanation {
        error_code: ErrorCode::Held,
        title: "the actuator is under control of another client",
        text: "One person or program at a time controls an actuator. `slate api GET /leases` shows which, and \
               since when. Control ends when that client releases it or disconnects; `slate stop` needs no \
               control.",
    },
    Explanation {
        error_code: ErrorCode::RunOver,
        title: "the run of the agent is over",
        text: "After the end of its mission an agent stays while a browser shows its console, or with --stay. Its \
               values can be read and its state be saved; its modules and its recorder have ended. Press Ctrl-C in its \
               terminal and start it again, with `--resume FILE` from a snapshot. `slate ps` shows how the run ended.",
    },
    Explanation {
        error_code: ErrorCode::Loose,
        title: "a port leads nowhere",
        text: "An input that its module needs has no source, an outbox has no receiver, or a command has no driver that \
               reads it: the agent runs, and the robot stands still. The help has the line to write in [links]. Where \
               nothing is to be linked, `\"/module/port\" = false` says so, and the warning goes.",
    },
    Explanation {
        error_code: ErrorCode::SwitchedOff,
        title: "a block that its robot needs is switched off",
        text: "The block has `enabled = false`, no link switches it on, and without it the robot commands no actuator, \
               or has no plan or no measurement. Set `enabled = true`, or remove the module.",
    },
    Explanation {
        error_code: ErrorCode::OtherRobot,
        title: "a block drives another robot",
        text: "A command of one robot's block reaches the actuator or driver of another robot. One agent may drive \
               two robots so; usually a name in [links] or [actuators] is that of the wrong robot.",
    },
    Explanation {
        error_code: ErrorCode::Unguarded,
        title: "a driver's input is not reserved for the gate",
        text: "Commands reach a driver from a gate, which keeps limits and stops. An input without the role \
               `actuation` could also be linked to anything else, past the gate: mark it with #[role(\"actuation\")] in \
               the ports of the driver.",
    },
    Explanation {
        error_code: ErrorCode::WideLimits,
        title: "limits are wider than those of the robot",
        text: "The limits of a gate come from the RobotModel unless they are written in [actuators]. The written ones \
               allow commands that the described hardware can't follow. Remove them, or make them narrower.",
    },
    Explanation {
        error_code: ErrorCode::EmptyRobot,
        title: "a robot has no modules",
        text: "The table [robots.NAME] describes a robot, and no module is in it. Add its blocks in \
               [robots.NAME.modules], or remove the table.",
    },
    Explanation {
        error_code: ErrorCode::UnusedPlugin,
        title: "no module uses a plugin",
        text: "[plugins] loads a library, and no module is of its kinds. Remove it, or set `load = false` to load it \
               later with `slate plugin load`.",
    },
    Explanation {
        error_code: ErrorCode::Unrecorded,
        title: "a recorded property does not exist",
        text: "`select` and `exclude` of [record] take paths and patterns, such as `/r2/**`. A path that no property \
               has records nothing; `slate list` shows the properties of a running agent.",
    },
    Explanation {
        error_code: ErrorCode::PartialLimits,
        title: "some numbers of a command have no limit",
        text: "A gate keeps only the numbers within limits that its table [actuators] or the RobotModel has limits for. \
               If `left` and `right` are speeds of wheels and only `right` is limited, `left` passes as it is sent. Add \
               a range for each number.",
    },
];

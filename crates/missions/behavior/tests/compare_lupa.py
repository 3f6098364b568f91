#!/usr/bin/env python3
"""Compares traces of random skills with those of the same prelude in another build of Lua 5.4, that of lupa.

Run it in an environment with lupa, from the root of the project, after
`cargo build --release -p slate-behavior --example behavior_trace`:

    python crates/missions/behavior/tests/compare_lupa.py 1000
"""

import json
import math
import os
import random
import subprocess
import sys

from lupa.lua54 import LuaRuntime

PROGRAM = "target/release/examples/behavior_trace"
PRELUDE = "crates/missions/behavior/src/prelude"
FILES = ["host", "sandbox", "pattern", "library", "state", "jump_state", "machine", "nested", "modules", "skill", "interface", "mission"]
STATUS = {1: "Succeeded", 2: "Running", 3: "Failed"}


def condition(chance, level):
    texts = ["conditions.a", "not conditions.b", "(vars.n or 0) % 3 == 0", "(vars.n or 0) > 4", "conditions.c and (vars.n or 1) % 2 == 1"]
    text = chance.choice(texts)
    if chance.random() < 0.2:
        return f"function(state) return math.random(4) == {chance.randint(1, 4)} end"
    return "true" if chance.random() < 0.1 else f'"{text}"'


def body(chance, prefix):
    parts = [f"self.fsm.vars.n = (self.fsm.vars.n or 0) + {chance.randint(1, 3)}"]
    if chance.random() < 0.3:
        parts.append(f'print("{prefix}", self.name, self.fsm.vars.n)')
    if chance.random() < 0.1:
        parts.append('for key, value in pairs(self.fsm.vars) do print(key, value) end')
    if chance.random() < 0.03:
        parts.append('if self.fsm.vars.n % 5 == 0 then error("bad") end')
    parts.extend(texts(chance) for _ in range(chance.choice([0, 0, 3])))
    return " ".join(parts)


def pattern(chance):
    items = ["a", "b", "%a", "%d", ".", "[ab]", "[^a]", "[%d-]", "%s", "()", "(a", "(.", ")", "$", "^", "%b()", "%f[%a]", "%1", "%"]
    weights = [6, 6, 3, 2, 4, 3, 3, 1, 1, 1, 2, 2, 3, 1, 1, 1, 1, 1, 0.3]
    parts = chance.choices(items, weights, k=chance.randint(1, 6))
    made = "".join(part + chance.choice(["", "", "*", "+", "-", "?"]) for part in parts)
    # Lua refuses a capture that is not closed when it needs it, and Slate at once.
    depth = 0
    for bracket in made.replace("%b()", "").replace("()", ""):
        depth = max(0, depth + (bracket == "(") - (bracket == ")"))
    return made + ")" * depth


def texts(chance):
    """A print of a function of texts with a random pattern."""
    subject = "".join(chance.choice("aabb1 ()-") for _ in range(chance.randint(0, 9)))
    call = chance.choice(
        [
            f"find, {json.dumps(subject)}, {json.dumps(pattern(chance))}, {chance.randint(-3, 4)}",
            f"match, {json.dumps(subject)}, {json.dumps(pattern(chance))}",
            f'gsub, {json.dumps(subject)}, {json.dumps(pattern(chance))}, "<%0>"',
            f"gsub, {json.dumps(subject)}, {json.dumps(pattern(chance))}, {{a = 1, b = false}}, 2",
            f'gsub, {json.dumps(subject)}, {json.dumps(pattern(chance))}, "%1"',
        ]
    )
    return f"do local is_fine, one, two, three = pcall(string.{call}) print(is_fine, is_fine and one, is_fine and two, is_fine and three) end"


def skill(chance, name, others):
    """A random skill that may run others."""
    count = chance.randint(2, 6)
    names = [f"S{index}" for index in range(count)]
    targets = names + ["FINAL", "FAILED"]
    states, inner = [], ""
    for index, state in enumerate(names):
        kind = chance.random()
        if kind < 0.45:
            states.append(f'{{"{state}", JumpState}}')
        elif kind < 0.8:
            run = chance.sample(["act", "move", *others], chance.randint(1, 2))
            skills = ", ".join(f"{{{one}, x = {chance.randint(0, 9)}}}" for one in run)
            states.append(
                f'{{"{state}", SkillJumpState, skills = {{{skills}}}, final_to = "{chance.choice(targets)}", '
                f'fail_to = "{chance.choice(targets)}"}}'
            )
        else:
            machine = f"inner{index}"
            inner += (
                f'local {machine} = HSM:new{{name = "{name}.{machine}", start = "X", exit_state = "OK", '
                f'fail_state = "BAD"}}\n{machine}:define_states{{{{"X", JumpState}}, {{"OK", JumpState}}, '
                f'{{"BAD", JumpState}}}}\n{machine}:add_transitions{{{{"X", "OK", cond = {condition(chance, 1)}}}, '
                f'{{"X", "BAD", timeout = 0.{chance.randint(1, 9)}}}}}\n'
                f'{machine}.states.X.loop = function(self) self.fsm.vars.n = (self.fsm.vars.n or 0) + 1 end\n'
            )
            states.append(
                f'{{"{state}", SubFSMJumpState, subfsm = {machine}, exit_to = "{chance.choice(targets)}", '
                f'fail_to = "{chance.choice(targets)}"}}'
            )
    transitions = []
    for state in names:
        for _ in range(chance.randint(1, 3)):
            to, kind = chance.choice(targets), chance.random()
            if kind < 0.65:
                transitions.append(f'{{"{state}", "{to}", cond = {condition(chance, 0)}}}')
            elif kind < 0.8:
                transitions.append(f'{{"{state}", "{to}", precond = {condition(chance, 0)}}}')
            else:
                transitions.append(f'{{"{state}", "{to}", timeout = 0.{chance.randint(1, 9)}}}')
    functions = "\n".join(
        f"function {state}:{phase}() {body(chance, phase)} end"
        for state in names
        for phase in chance.sample(["init", "loop", "exit"], chance.randint(1, 3))
    )
    depends = "".join(f'"{other}", ' for other in others)
    return f"""module(..., skillenv.module_init)
name = "{name}"
documentation = ""
depends_skills = {{{depends}}}
depends_actions = {{{{v = "act", arguments = {{"x"}}}}, {{v = "move", arguments = {{"x", "y"}}, defaults = {{y = 1}}}}}}
skillenv.skill_module(_M)
fsm = SkillHSM:new{{name = name, start = "S0"}}
{inner}fsm:define_states{{export_to = _M, {", ".join(states)}}}
fsm:add_transitions{{{", ".join(transitions)}}}
{functions}
"""


def case(chance):
    others = ["one", "two"][: chance.randint(0, 2)]
    files = {other: skill(chance, other, []) for other in others}
    files["main"] = skill(chance, "main", others)
    ticks = []
    for _ in range(30):
        conditions = {name: chance.random() < 0.4 for name in "abc" if chance.random() < 0.9}
        ticks.append([conditions, [chance.choice([0, 0, 0, 1, 1, 2, 3]) for _ in range(6)]])
    return {"files": files, "ticks": ticks}


class Robot:
    def __init__(self):
        self.events, self.conditions, self.progress, self.random = [], {}, [], 0

    def dispatch(self, function, one=None, two=None):
        if function == 1:
            self.events.append(two)
        elif function == 2:
            return self.conditions.get(one)
        elif function == 3:
            self.events.append(f"start {one} {len(two)}")
        elif function == 4:
            return self.progress[one] if one < len(self.progress) else 0
        elif function == 5:
            self.events.append(f"stop {one}")
        elif function == 6:
            self.random = (self.random * 6364136223846793005 + 1) % 2**64
            return self.random - 2**64 if self.random >= 2**63 else self.random
        return None


def reference(made):
    """The trace of the prelude in lupa's Lua."""
    lua = LuaRuntime(unpack_returned_tuples=True)
    robot, files = Robot(), made["files"]

    def read(name):
        return (files[name], f"{name}.lua") if name in files else (None, f"module `{name}` is not a file of the skill path")

    native = lua.table_from(
        {
            "where": lambda: None,
            "read": read,
            "exists": lambda name: name in files,
            "metered": lambda text: f"local _METER_ = ... return function(...) {text}\nend",
            "nan": math.nan,
            "math": lua.table_from({}),
        }
    )
    slate = lua.table_from({"native": native})
    for name in FILES:
        with open(os.path.join(PRELUDE, f"{name}.lua")) as file:
            lua.eval("function(text, name) return load(text, name) end")(file.read(), f"={name}")(slate)
    enter, tick, active = slate.enter, slate.tick, slate.active
    ok, reason = lua.eval("function(f, ...) return pcall(f, ...) end")(
        enter, slate.load_mission, robot.dispatch, 0, 10_000_000, "main", ""
    ), None
    if isinstance(ok, tuple) and not ok[0]:
        return [f"refused: {ok[1]}"]
    call = lua.eval("function(enter, ...) local r = {pcall(enter, ...)} return r[1], r[2] end")
    status = 2
    for number, (conditions, progress) in enumerate(made["ticks"]):
        robot.conditions, robot.progress = conditions, progress
        if status == 2:
            is_fine, status = call(enter, tick, robot.dispatch, number * 100_000_000, 1_000_000)
            if not is_fine:
                robot.events.append(f"error: {status}")
                break
        robot.events.append(f"{STATUS[status]} {active()}")
    return robot.events


def without_places(trace):
    """Places of errors are found by the host."""
    return [event.split(" failed in its ")[0].split(" transitions follow")[0] for event in trace]


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    chance = random.Random(1)
    cases = [case(chance) for _ in range(count)]
    text = "".join(json.dumps(made) + "\n" for made in cases)
    output = subprocess.run([PROGRAM], input=text, capture_output=True, text=True, check=True).stdout
    different, events = 0, 0
    for made, line in zip(cases, output.splitlines(), strict=True):
        own, other = without_places(json.loads(line)), without_places(reference(made))
        events += len(own)
        if own != other:
            different += 1
            if different == 1:
                print(made["files"], "\n", own, "\n", other)
    print(f"{count} skills, {events} events, {different} different")
    sys.exit(different > 0)


if __name__ == "__main__":
    main()

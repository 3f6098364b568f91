#!/usr/bin/env python3
"""Compares what random trees do with what they do in BehaviorTree.CPP.

Run it in an environment with behaviortreepy, from the root of the project, after
`cargo build --release -p slate-behavior-tree --example tree_trace`:

    python crates/missions/behavior_tree/tests/compare_behavior_tree_cpp.py 1000

`timers` as third argument adds timers, in real time; `statuses` compares the statuses of all nodes after each tick, as
BehaviorTree.CPP publishes them to Groot2, which needs pyzmq.
"""

import json
import random
import struct
import subprocess
import sys
import time
from xml.sax.saxutils import quoteattr

from behaviortreepy import BehaviorTreeFactory, Blackboard, Groot2Publisher, NodeStatus

PROGRAM = "target/release/examples/tree_trace"
TICKS = 20
# Real time between ticks of trees with timers, ms. No timer ends near a tick.
PERIOD = 60
TIMERS = [30, 90, 150]
# A busy machine delays timers: a tree that differs is tried again.
TRIES = 3

STATUS = {"R": NodeStatus.RUNNING, "S": NodeStatus.SUCCESS, "F": NodeStatus.FAILURE}
NAMES = {"RUNNING": "Running", "SUCCESS": "Succeeded", "FAILURE": "Failed", "SKIPPED": "Skipped", "IDLE": "Idle"}

EXPRESSIONS = ["x", "y", "1", "2.5", "x + 1", "y - x", "x * 2", "(x + y) / 4", "x > y ? 1 : 0", "-y"]
# `w` is always an integer: BehaviorTree.CPP ends the program where others have such an operator while a tree is halted.
BITS = ["w & 3", "w | 4", "w ^ 5", "~w", "(w + 1) & 0x6", "w | 8 ^ 2", "(w & 2) == 0 ? 1 : 2", "5"]
CONDITIONS = ["x > 1", "y >= x", "x == y", "x != 2 && y < 3", "x < 1 || y > 1", "!(x > 2)", "0 <= x < 3", "true", "(w | 1) > 2"]
LOOPS = {
    "LoopInt": ("y", "vi", ["1;2;3", "-4", ""]),
    "LoopDouble": ("y", "vd", ["0.5;2;-1e1", "7.25"]),
    "LoopBool": ("y", "vb", ["true;false;1", "0"]),
    "LoopString": ("z", "vs", ["1;2", "a;;2", "", "3"]),
}


class Trees:
    """Random trees, and the answers of their leaves."""

    def __init__(self, chance, has_timers):
        self.chance, self.has_timers, self.answers = chance, has_timers, {}

    def statement(self):
        if self.chance.random() < 0.15:
            return f"z := '{self.chance.randint(1, 4)}'"
        if self.chance.random() < 0.15:
            return f"w {self.chance.choice([':=', '='])} {self.chance.choice(BITS)}"
        name = self.chance.choice(["x", "y"])
        if self.chance.random() < 0.3:
            return f"{name} {self.chance.choice(['+=', '-='])} 1"
        return f"{name} {self.chance.choice([':=', '='])} {self.chance.choice(EXPRESSIONS)}"

    def script(self):
        return "; ".join(self.statement() for _ in range(self.chance.randint(1, 2)))

    def extras(self):
        found = {}
        if self.chance.random() < 0.15:
            found[self.chance.choice(["_failureIf", "_successIf", "_skipIf", "_while"])] = self.chance.choice(CONDITIONS)
        if self.chance.random() < 0.1:
            found[self.chance.choice(["_onHalted", "_onFailure", "_onSuccess", "_post"])] = self.script()
        return found

    def leaf(self):
        kind = self.chance.random()
        if self.has_timers and kind < 0.1:
            return self.element("Sleep", {"msec": self.chance.choice(TIMERS)})
        if kind < 0.08:
            return self.element("Script", {"code": self.script()})
        if kind < 0.16:
            return self.element("ScriptCondition", {"code": self.chance.choice(CONDITIONS)})
        if kind < 0.19:
            return self.element("WasEntryUpdated", {"entry": self.entry()})
        if kind < 0.22:
            return self.element(self.chance.choice(["AlwaysSuccess", "AlwaysFailure"]), {})
        if kind < 0.45:
            return self.condition()
        name = f"A{len(self.answers)}"
        self.answers[name] = "".join(self.chance.choices("RRSF", k=self.chance.randint(1, 6)))
        return self.element(name, {})

    def entry(self):
        return self.chance.choice(["{x}", "{y}", "{z}", "{w}", "x", "vi"])

    def condition(self):
        name = f"C{len(self.answers)}"
        self.answers[name] = "".join(self.chance.choices("SF", k=self.chance.randint(1, 5)))
        return self.element(name, {})

    def element(self, tag, attributes, children=()):
        attributes = {**attributes, **self.extras()}
        text = "".join(f" {name}={quoteattr(str(value))}" for name, value in attributes.items())
        return f"<{tag}{text}>{''.join(children)}</{tag}>"

    def node(self, depth):
        kind = self.chance.random()
        if depth == 0 or kind < 0.15:
            return self.leaf()
        if kind < 0.45:
            return self.decorator(depth)
        if kind < 0.52 and self.sub_trees:
            return self.sub_tree()
        return self.control(depth)

    def decorator(self, depth):
        plain = ["Inverter", "ForceSuccess", "ForceFailure", "KeepRunningUntilFailure"]
        ports = {
            "Repeat": {"num_cycles": self.chance.choice([-1, 1, 2, 3])},
            "RetryUntilSuccessful": {"num_attempts": self.chance.choice([-1, 1, 2, 3])},
            "RunOnce": {"then_skip": self.chance.choice(["true", "false"])},
            "Precondition": {
                "if": self.chance.choice(CONDITIONS),
                "else": self.chance.choice(["SUCCESS", "FAILURE", "RUNNING", "SKIPPED"]),
            },
        }
        if self.has_timers:
            ports = {"Delay": {"delay_msec": self.chance.choice(TIMERS)}, "Timeout": {"msec": self.chance.choice(TIMERS)}}
        ports |= {tag: {"entry": self.entry()} for tag in ("SkipUnlessUpdated", "WaitValueUpdate")}
        for tag, (_, entry, queues) in LOOPS.items():
            ports[tag] = {"queue": self.chance.choice(queues), "value": f"{{{entry}}}"}
            if self.chance.random() < 0.5:
                ports[tag]["if_empty"] = self.chance.choice(["SUCCESS", "FAILURE", "SKIPPED"])
        tag = self.chance.choice(plain + 2 * list(ports))
        if tag in LOOPS:
            to, entry, _ = LOOPS[tag]
            script = self.element("Script", {"code": f"{to} := {entry}"})
            return self.element(tag, ports[tag], [f"<Sequence>{script}{self.node(depth - 1)}</Sequence>"])
        # There, a precondition that was halted is not evaluated again, and the child of the others is not halted, so that
        # their children never run here.
        never_runs = ("Precondition", "SkipUnlessUpdated", "WaitValueUpdate")
        child = self.condition() if tag in never_runs else self.node(depth - 1)
        return self.element(tag, ports.get(tag, {}), [child])

    def control(self, depth):
        tag = self.chance.choice(
            ["Sequence", "SequenceWithMemory", "ReactiveSequence", "AsyncSequence", "Fallback", "AsyncFallback"]
            + ["ReactiveFallback", "Parallel", "ParallelAll", "IfThenElse", "WhileDoElse", "Switch2", "Switch3"]
        )
        count, ports = self.chance.randint(1, 4), {}
        if tag in ("IfThenElse", "WhileDoElse"):
            count = self.chance.randint(2, 3)
        if tag.startswith("Switch"):
            count = int(tag[-1]) + 1
            ports = {"variable": "{z}"}
            ports |= {f"case_{number}": number for number in range(1, count)}
        if tag == "Parallel":
            ports = {"success_count": self.chance.randint(-2, count), "failure_count": self.chance.randint(-2, count)}
        if tag == "ParallelAll":
            ports = {"max_failures": self.chance.randint(-2, count)}
        return self.element(tag, ports, [self.node(depth - 1) for _ in range(count)])

    def sub_tree(self):
        ports = self.chance.choice([{"_autoremap": "true"}, {"x": "{y}", "y": "{x}", "z": "{z}"}, {"x": "{=}", "y": "{x}", "z": "{z}"}]) | {"w": "{w}"}
        return self.element("SubTree", {"ID": self.chance.choice(self.sub_trees), **ports})

    def document(self):
        trees, self.sub_trees = [], []
        for name in ["Inner", "Outer", "Main"]:
            depth = self.chance.randint(1, 2) if name != "Main" else self.chance.randint(2, 4)
            trees.append(f'<BehaviorTree ID="{name}">{self.node(depth)}</BehaviorTree>')
            self.sub_trees.append(name)
        return f'<root BTCPP_format="4" main_tree_to_execute="Main">{"".join(trees)}</root>'


class Published:
    """The statuses of a tree, as it is published to Groot2."""

    port = 20000

    def __init__(self, tree):
        import zmq

        Published.port = 20000 + (Published.port - 20000 + 2) % 10000
        self.publisher = Groot2Publisher(tree, Published.port)
        self.context = zmq.Context()
        self.socket = self.context.socket(zmq.REQ)
        self.socket.connect(f"tcp://127.0.0.1:{Published.port}")

    def statuses(self):
        self.socket.send(struct.pack("<BBI", 2, ord("S"), 1))
        _, statuses = self.socket.recv_multipart()
        names = ["Idle", "Running", "Succeeded", "Failed", "Skipped"]
        found = dict(struct.iter_unpack("<HB", statuses))
        texts = (f" was {names[status % 10]}" if status == 0 or status >= 10 else f" {names[status]}" for _, status in sorted(found.items()))
        return "".join(texts)

    def close(self):
        self.socket.close(linger=0)
        self.context.destroy(linger=0)
        del self.publisher


def reference(line):
    """What a tree does in BehaviorTree.CPP; `None` for one with asynchronous children that only it refuses."""
    log, calls = [], {}

    def answer(event, name):
        log.append(f"{event} {name}")
        calls[name] = calls.get(name, -1) + 1
        answers = line["answers"][name]
        return STATUS[answers[calls[name] % len(answers)]]

    factory = BehaviorTreeFactory()
    for name in line["answers"]:
        if name.startswith("C"):
            factory.register_simple_condition(name, lambda *_, name=name: answer("condition", name))
        else:
            factory.register_simple_stateful_action(
                name,
                lambda *_, name=name: answer("start", name),
                lambda *_, name=name: answer("progress", name),
                lambda *_, name=name: log.append(f"halt {name}"),
            )
    board = Blackboard.create()
    for name, value in line["entries"].items():
        board.set_double(name, value)
    board.set_string("z", "1")
    try:
        factory.register_behavior_tree_from_text(line["xml"])
    except RuntimeError as error:
        if "more than one async child" in str(error):
            return None
        raise
    tree = factory.create_tree("Main", board)
    published = Published(tree) if line["statuses"] else None
    for tick in range(line["ticks"]):
        if tick:
            time.sleep(line["period"] / 1000)
        try:
            status = tree.tick_exactly_once()
        except Exception as error:
            log.append(f"error {error}")
            break
        log.append(f"= {NAMES[status.name]}")
        log += [f"{name} = {board.get_double(name)}" for name in line["entries"]]
        log.append(f"z = {board.get_string('z')}")
        if published:
            log.append(f"nodes:{published.statuses()}")
    kept = list(log)
    if published:
        published.close()
    del tree
    return kept


def same(own, other):
    """Whether two events are the same: numbers may be written in two ways, and errors have other words."""
    if own == other or own.startswith("error") and other.startswith("error"):
        return True
    if own[:4] == other[:4] and own[:4] in ("x = ", "y = ", "w = "):
        return abs(float(own[4:]) - float(other[4:])) <= 1e-6 * max(1.0, abs(float(own[4:])))
    return False


def without_last_halts(log):
    """The events without the halts before an error, as BehaviorTree.CPP leaves running what runs then."""
    end = len(log) - 1
    while end > 0 and log[end - 1].startswith("halt"):
        end -= 1
    return log[:end] + log[-1:]


def first_difference(own, other):
    if own[-1].startswith("error") and other[-1].startswith("error"):
        own, other = without_last_halts(own), without_last_halts(other)
    pairs = zip(own + ["end"], other + ["end"])
    return next((at for at, (left, right) in enumerate(pairs) if not same(left, right)), None)


def main():
    wanted = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    chance = random.Random(int(sys.argv[2]) if len(sys.argv) > 2 else 1)
    has_timers = len(sys.argv) > 3 and sys.argv[3] == "timers"
    program = subprocess.Popen([PROGRAM], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    compared = events = errors = nodes = left_out = again = 0
    while compared < wanted:
        trees = Trees(chance, has_timers)
        xml = trees.document()
        line = {
            "xml": xml,
            "answers": trees.answers,
            "entries": {name: float(chance.randint(low, high)) for name, low, high in [("w", -9, 9), ("x", 0, 3), ("y", 0, 3)]},
            "ticks": TICKS,
            "period": PERIOD if has_timers else 0,
            "statuses": len(sys.argv) > 3 and sys.argv[3] == "statuses",
        }
        program.stdin.write(json.dumps(line) + "\n")
        program.stdin.flush()
        own = json.loads(program.stdout.readline())
        for attempt in range(TRIES if has_timers else 1):
            other = reference(line)
            at = first_difference(own, other or own)
            if at is None:
                break
        if other is None:
            continue
        if at is not None:
            # A skipped condition of `IfThenElse` or `WhileDoElse`, which skips the node here.
            right = (other + ["end"])[at]
            if not right.startswith("error") or "IfThenElse" not in right and "WhileDoElse" not in right:
                print(f"{xml}\n{line['answers']} {line['entries']}", file=sys.stderr)
                sys.exit(f"not equal: {own[max(0, at - 12):at]}\nhere    {own[at:at + 3]}\nthere   {other[at:at + 3]}")
            left_out += 1
        again += attempt
        compared += 1
        events += len(own)
        nodes += xml.count("</")
        errors += own[-1].startswith("error")
    print(
        f"{compared} trees equal, {nodes} elements, {events} events, {errors} end with an error; "
        f"{left_out} up to an error only there, {again} tries again"
    )


if __name__ == "__main__":
    main()

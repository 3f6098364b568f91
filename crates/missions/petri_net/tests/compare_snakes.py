#!/usr/bin/env python3
"""Compares state spaces with those of SNAKES on random nets.

Run it in an environment with SNAKES, from the root of the project, after
`cargo build --release -p slate-petri-net --example state_space`:

    python crates/missions/petri_net/tests/compare_snakes.py 10000
"""

import json
import random
import subprocess
import sys

from snakes.nets import MultiArc, PetriNet, Place, StateGraph, Transition, Value, dot

PROGRAM = "target/release/examples/state_space"


def random_net(chance):
    places = [chance.choice([0, 0, 1, 1, 2]) for _ in range(chance.randint(2, 7))]

    # Where each transition puts as many tokens as it takes, the net is bounded, and has more markings.
    is_conservative = chance.random() < 0.7

    def arcs(count):
        some = chance.sample(range(len(places)), min(count, len(places)))
        return [[place, 1 if is_conservative else chance.choice([1, 1, 1, 2])] for place in some]

    def transition():
        taken = chance.randint(1, 2)
        return [arcs(taken), arcs(taken if is_conservative else chance.randint(1, 3))]

    return {"places": places, "transitions": [transition() for _ in range(chance.randint(2, 8))]}


def reference(net):
    """Markings, and firings between them, as SNAKES has them."""
    made = PetriNet("net")
    for place, tokens in enumerate(net["places"]):
        made.add_place(Place(f"p{place}", [dot] * tokens))
    for number, (inputs, outputs) in enumerate(net["transitions"]):
        made.add_transition(Transition(f"t{number}"))
        for place, weight in inputs:
            made.add_input(f"p{place}", f"t{number}", tokens_of(weight))
        for place, weight in outputs:
            made.add_output(f"p{place}", f"t{number}", tokens_of(weight))
    graph = StateGraph(made)
    graph.build()

    def marking(state):
        found = graph[state]
        return tuple(len(found(f"p{place}")) for place in range(len(net["places"])))

    markings = {marking(state) for state in graph}
    edges = set()
    for state in graph:
        for after, transition, _ in graph.successors(state):
            edges.add((marking(state), int(transition.name[1:]), marking(after)))
    return markings, edges


def tokens_of(weight):
    return Value(dot) if weight == 1 else MultiArc([Value(dot)] * weight)


def main():
    wanted = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000
    chance = random.Random(int(sys.argv[2]) if len(sys.argv) > 2 else 1)
    program = subprocess.Popen([PROGRAM], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    compared = left_out = states = most = 0
    while compared < wanted:
        net = random_net(chance)
        program.stdin.write(json.dumps(net) + "\n")
        program.stdin.flush()
        own = json.loads(program.stdout.readline())
        if not own["complete"]:
            # Unbounded, or too large for SNAKES in a short time.
            left_out += 1
            continue
        markings = [tuple(marking) for marking in own["markings"]]
        edges = {(markings[before], transition, markings[after]) for before, transition, after in own["edges"]}
        if (set(markings), edges) != reference(net):
            sys.exit(f"not equal: {json.dumps(net)}")
        compared += 1
        states += len(markings)
        most = max(most, len(markings))
    print(f"{compared} nets equal, {states} markings, the largest net has {most}; {left_out} unbounded or large left out")


if __name__ == "__main__":
    main()

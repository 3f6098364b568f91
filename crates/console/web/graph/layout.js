// Where modules stand in a drawing: in layers, so that links go from left to right but for those that close a loop.

/** Layers of names. `edges` are pairs of names; what closes a loop is left out of account. */
export function layers(names, edges) {
  const out = new Map(names.map((name) => [name, []]));
  const into = new Map(names.map((name) => [name, 0]));
  for (const [from, to] of edges) {
    if (from === to || !out.has(from) || !out.has(to)) continue;
    out.get(from).push(to);
    into.set(to, into.get(to) + 1);
  }
  // Depth first from what reads least and is read most; an edge back to what is being visited closes a loop.
  const order = [...names].sort((one, other) => out.get(other).length - into.get(other) - (out.get(one).length - into.get(one)) || one.localeCompare(other));
  const state = new Map();
  const back = new Set();
  const done = [];
  const visit = (name) => {
    state.set(name, "open");
    for (const next of out.get(name)) {
      if (state.get(next) === "open") back.add(`${name} ${next}`);
      else if (!state.has(next)) visit(next);
    }
    state.set(name, "done");
    done.push(name);
  };
  order.forEach((name) => state.has(name) || visit(name));
  const depth = new Map();
  for (const name of done.reverse()) {
    depth.set(name, depth.get(name) ?? 0);
    for (const next of out.get(name)) {
      if (!back.has(`${name} ${next}`)) depth.set(next, Math.max(depth.get(next) ?? 0, depth.get(name) + 1));
    }
  }
  const found = [];
  for (const name of order) (found[depth.get(name)] ??= []).push(name);
  return arrange(found.filter(Boolean), edges);
}

// Neighbours near each other: each layer in the order of the middle of what it is linked to.
function arrange(layers, edges) {
  const near = new Map();
  const add = (one, other) => near.set(one, [...(near.get(one) ?? []), other]);
  for (const [from, to] of edges) {
    add(from, to);
    add(to, from);
  }
  for (let round = 0; round < 8; round += 1) {
    const place = new Map(layers.flatMap((layer) => layer.map((name, row) => [name, (row + 0.5) / layer.length])));
    const middle = (name) => {
      const places = (near.get(name) ?? []).map((other) => place.get(other)).filter((one) => one !== undefined);
      return places.length ? places.reduce((sum, one) => sum + one, 0) / places.length : place.get(name);
    };
    layers = layers.map((layer) => [...layer].sort((one, other) => middle(one) - middle(other)));
  }
  return layers;
}

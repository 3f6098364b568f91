// Layout of a directed graph in layers, from top to bottom (Sugiyama et al., 1981): loops are cut, layers are those of the
// longest path, edges over several layers get a place in each, and the order in a layer is that of the neighbors' means.

const [SWEEPS, ALIGNMENTS] = [12, 40];
const [GAP, LANE, ROW] = [22, 12, 34];

/** Edges with those reversed that close a loop: `{from, to, back, edge}`; a depth-first search begins at `roots`. */
function acyclic(count, edges, roots) {
  const next = Array.from({ length: count }, () => []);
  edges.forEach(({ from, to }, edge) => from !== to && next[from].push({ to, edge }));
  const state = new Uint8Array(count);
  const back = new Set();
  for (const root of [...roots, ...Array(count).keys()]) {
    if (state[root]) continue;
    const stack = [{ node: root, place: 0 }];
    state[root] = 1;
    while (stack.length) {
      const top = stack.at(-1);
      const step = next[top.node][top.place++];
      if (!step) {
        state[top.node] = 2;
        stack.pop();
      } else if (state[step.to] === 1) back.add(step.edge);
      else if (state[step.to] === 0) {
        state[step.to] = 1;
        stack.push({ node: step.to, place: 0 });
      }
    }
  }
  return edges.flatMap(({ from, to }, edge) => (from === to ? [] : [back.has(edge) ? { from: to, to: from, back: true, edge } : { from, to, back: false, edge }]));
}

/** The layer of each node: the longest path from a node without inputs; nodes then move down to their successors. */
function layersOf(count, edges) {
  const [inputs, outputs] = [Array.from({ length: count }, () => []), Array.from({ length: count }, () => [])];
  for (const { from, to } of edges) {
    inputs[to].push(from);
    outputs[from].push(to);
  }
  const layer = new Array(count).fill(0);
  const waits = inputs.map(({ length }) => length);
  const order = [...Array(count).keys()].filter((node) => !waits[node]);
  for (const node of order) {
    for (const to of outputs[node]) {
      layer[to] = Math.max(layer[to], layer[node] + 1);
      if (--waits[to] === 0) order.push(to);
    }
  }
  for (const node of order.reverse()) if (outputs[node].length && !inputs[node].length) layer[node] = Math.min(...outputs[node].map((to) => layer[to])) - 1;
  return layer;
}

/** Places of the nodes in each layer, with a place for each layer that an edge crosses. */
function chained(nodes, edges, layer) {
  const places = nodes.map((node, index) => ({ ...node, layer: layer[index], up: [], down: [] }));
  const chains = edges.map(({ from, to, back, edge }) => {
    const chain = [from];
    for (let between = layer[from] + 1; between < layer[to]; between += 1) {
      chain.push(places.length);
      places.push({ left: LANE / 2, right: LANE / 2, height: 0, layer: between, up: [], down: [] });
    }
    chain.push(to);
    for (let step = 1; step < chain.length; step += 1) {
      places[chain[step - 1]].down.push(chain[step]);
      places[chain[step]].up.push(chain[step - 1]);
    }
    return { chain, back, edge };
  });
  const rows = [];
  // The order of a first walk along the edges.
  const seen = new Set();
  const walk = [...places.keys()].filter((place) => !places[place].up.length).reverse();
  while (walk.length) {
    const place = walk.pop();
    if (seen.has(place)) continue;
    seen.add(place);
    (rows[places[place].layer] ??= []).push(place);
    walk.push(...[...places[place].down].reverse());
  }
  return { places, chains, rows };
}

const mean = (values) => values.reduce((sum, value) => sum + value, 0) / values.length;

// A long edge is straight rather than short.
const STRAIGHT = 8;

function order(places, rows) {
  const rank = new Array(places.length).fill(0);
  const count = () => rows.forEach((row) => row.forEach((place, at) => (rank[place] = at)));
  count();
  for (let sweep = 0; sweep < SWEEPS; sweep += 1) {
    const isDown = sweep % 2 === 0;
    for (const row of isDown ? rows : [...rows].reverse()) {
      const wish = new Map(row.map((place, at) => {
        const near = isDown ? places[place].up : places[place].down;
        return [place, near.length ? mean(near.map((other) => rank[other])) : at];
      }));
      row.sort((one, other) => wish.get(one) - wish.get(other) || rank[one] - rank[other]);
      row.forEach((place, at) => (rank[place] = at));
    }
  }
}

/** Moves each place below and above its neighbors, as far as the order in its row and the widths allow. */
function align(places, rows) {
  const apart = (one, other) => places[one].right + (places[one].height || places[other].height ? GAP : LANE) + places[other].left;
  for (const row of rows) row.forEach((place, at) => (places[place].x = at ? places[row[at - 1]].x + apart(row[at - 1], place) : places[place].left));
  for (let sweep = 0; sweep < ALIGNMENTS; sweep += 1) {
    const isDown = sweep % 2 === 0;
    for (const row of isDown ? rows : [...rows].reverse()) {
      const wish = row.map((place) => {
        const near = sweep < ALIGNMENTS / 2 ? (isDown ? places[place].up : places[place].down) : [...places[place].up, ...places[place].down];
        let [sum, weights] = [0, 0];
        for (const other of near) {
          const weight = places[place].height || places[other].height ? 1 : STRAIGHT;
          sum += weight * places[other].x;
          weights += weight;
        }
        return weights ? sum / weights : places[place].x;
      });
      const [low, high] = [[...wish], [...wish]];
      for (let at = 1; at < row.length; at += 1) low[at] = Math.max(low[at], low[at - 1] + apart(row[at - 1], row[at]));
      for (let at = row.length - 2; at >= 0; at -= 1) high[at] = Math.min(high[at], high[at + 1] - apart(row[at], row[at + 1]));
      row.forEach((place, at) => (places[place].x = (low[at] + high[at]) / 2));
      for (let at = 1; at < row.length; at += 1) places[row[at]].x = Math.max(places[row[at]].x, places[row[at - 1]].x + apart(row[at - 1], row[at]));
    }
  }
  const least = Math.min(...places.map(({ x, left }) => x - left));
  for (const place of places) place.x -= least;
}

/** A smooth line through points, vertical at both ends: a cubic Hermite spline that swings nowhere beyond its points. */
function path(points) {
  const slope = (place) => {
    const [before, after] = [points[place - 1], points[place + 1]].map((other) => other && other.x - points[place].x);
    if (before === undefined || after === undefined || before * after >= 0) return 0;
    return Math.sign(after) * Math.min(Math.abs(before), Math.abs(after));
  };
  const text = points.slice(1).map(({ x, y }, before) => {
    const from = points[before];
    const third = (y - from.y) / 3;
    return `C${[from.x + slope(before) / 3, from.y + third, x - slope(before + 1) / 3, y - third, x, y].map((number) => number.toFixed(1)).join(" ")}`;
  });
  return `M${points[0].x.toFixed(1)} ${points[0].y.toFixed(1)}${text.join("")}`;
}

/**
 * Places and paths of a graph. A node is `{left, right, height}`, the space around its symbol's middle; `roots` are the nodes
 * at which it begins. The result has `places` with the middle of each node, `paths` of the edges, `width` and `height`.
 */
export function layered(nodes, edges, roots) {
  if (!nodes.length) return { places: [], paths: [], width: 0, height: 0 };
  const forward = acyclic(nodes.length, edges, roots);
  const { places, chains, rows } = chained(nodes, forward, layersOf(nodes.length, forward));
  const filled = rows.filter(Boolean);
  order(places, filled);
  align(places, filled);
  let top = 0;
  for (const row of filled) {
    const height = Math.max(...row.map((place) => places[place].height));
    for (const place of row) places[place].y = top + height / 2;
    top += height + ROW;
  }
  const paths = new Array(edges.length).fill("");
  for (const { chain, back, edge } of chains) {
    const points = chain.map((place) => ({ ...places[place] }));
    const [first, last] = [points[0], points.at(-1)];
    first.y += first.height / 2;
    last.y -= last.height / 2;
    // A line back stands beside the one forward.
    if (back) for (const point of points) point.x += 5;
    paths[edge] = path(back ? points.reverse() : points);
  }
  edges.forEach(({ from, to }, edge) => {
    if (from !== to) return;
    const { x, y, height } = places[from];
    paths[edge] = `M${x} ${y + height / 2}c0 16 -24 16 -24 0v${-height}c0 -16 24 -16 24 0`;
  });
  const width = Math.max(...places.map(({ x, right }) => x + right));
  return { places: places.slice(0, nodes.length), paths, width, height: top - ROW };
}

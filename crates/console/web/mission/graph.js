// Graphs of missions: their elements by group, with places and paths. A mission has one layout, as long as its file is the same.
import { layered } from "/mission/layered.js";

const NONE = 65535;
// Approximate width of a letter, and the height of a row, pixels.
const [LETTER, ROW, LEVEL] = [6.4, 26, 20];
const [SYMBOL, MARGIN, HEADER] = [11, 14, 30];

const wide = (text) => text.length * LETTER;
const short = (text, most) => (text.length > most ? `${text.slice(0, most - 1)}…` : text);

/** Half of the width of a state. */
export const halfOf = (label) => short(label, 30).length * 3.7 + 11;

/** Space of an element around the middle of its symbol. */
const space = {
  PLACE: ({ label }) => ({ left: SYMBOL + 2, right: SYMBOL + 8 + wide(short(label, 40)), height: 2 * SYMBOL }),
  TRANSITION: ({ label }) => ({ left: SYMBOL + 5, right: SYMBOL + 11 + wide(short(label, 40)), height: 8 }),
  STATE: ({ label }) => ({ left: halfOf(label), right: halfOf(label), height: 28 }),
};

/** Nets and machines: each group with its nodes in layers, one below the other. */
function grouped(elements) {
  const groups = elements.filter(({ kind }) => kind === "GROUP");
  const edges = elements.filter(({ kind }) => kind === "EDGE");
  let top = MARGIN;
  let width = 0;
  const drawn = groups.map((group) => {
    const nodes = elements.filter(({ kind, parent }) => parent === group.number && space[kind]);
    const index = new Map(nodes.map(({ number }, at) => [number, at]));
    const own = edges.filter(({ from }) => index.has(from));
    const roots = nodes.flatMap(({ mark }, at) => (mark === "START" ? [at] : []));
    const { places, paths, ...size } = layered(nodes.map((node) => space[node.kind](node)), own.map(({ from, to }) => ({ from: index.get(from), to: index.get(to) })), roots);
    const head = groups.length > 1 ? HEADER : 0;
    const shift = { x: MARGIN, y: top + head };
    top += head + size.height + 2 * MARGIN;
    width = Math.max(width, size.width + 2 * MARGIN);
    return {
      group, shift, title: head ? group.label : "",
      nodes: nodes.map((node, at) => ({ ...node, x: places[at].x, y: places[at].y })),
      edges: own.map((edge, at) => ({ ...edge, path: paths[at] })),
    };
  });
  return { groups: drawn, width, height: top };
}

/** Trees and programs: a row for each element, below its parent. */
function rows(elements) {
  const level = new Map();
  const nodes = elements.filter(({ kind }) => kind !== "GROUP" && kind !== "EDGE").map((element, row) => {
    level.set(element.number, element.parent === NONE ? 0 : (level.get(element.parent) ?? -1) + 1);
    const width = wide(short(element.label, 60)) + 34;
    return { ...element, x: level.get(element.number) * LEVEL, y: row * ROW + ROW / 2, width };
  });
  const of = new Map(nodes.map((node) => [node.number, node]));
  const edges = nodes.filter(({ parent }) => of.has(parent)).map((node) => {
    const above = of.get(node.parent);
    return { number: `to ${node.number}`, kind: "BRANCH", path: `M${above.x + LEVEL / 2} ${above.y + 11}V${node.y}H${node.x}` };
  });
  const width = Math.max(0, ...nodes.map(({ x, width }) => x + width)) + 2 * MARGIN;
  return { isOfRows: true, groups: [{ group: null, shift: { x: MARGIN, y: MARGIN }, title: "", nodes, edges }], width, height: nodes.length * ROW + 2 * MARGIN };
}

const known = new Map();

/** The drawing of a graph, by its number. */
export function drawing(graph) {
  if (!known.has(graph.id)) {
    const elements = graph.elements.map((element, number) => ({ ...element, number }));
    known.set(graph.id, { elements, ...(graph.notation === "PETRI_NET" || graph.notation === "STATE_MACHINES" ? grouped(elements) : rows(elements)) });
  }
  return known.get(graph.id);
}

/** A label, shortened to its space in a drawing. */
export const titled = ({ kind, label }) => short(label, { STATE: 30, PLACE: 40, TRANSITION: 40 }[kind] ?? 60);

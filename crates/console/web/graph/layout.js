// Where modules stand in a drawing: in columns from left to right along what flows, a lane for each robot. A line that passes a column
// has a place of its own there, so that none lies behind a module; one that closes a loop goes back below the lane that it leads to.
// What a module sends into other lanes goes along one line beside its column, and branches off where it is read.

export const [WIDTH, HEIGHT] = [150, 38];
// How far columns and modules are from each other at least and at most.
const ACROSS = [186, 270];
const GAP = [9, 50];
// How much room a line takes that passes a column, and what lies beside it.
const [PASSING, BESIDE] = [4, 10];
// About all, about the modules of a robot, above them for its name, and between two lines that go back.
const [MARGIN, ROOM, TITLE, TRACK] = [16, 30, 20, 9];

const between = ([least, most], wanted) => Math.min(most, Math.max(least, wanted));

/** The robot that a module is of, by its name; none has an empty one. */
export const groupOf = (name) => (name.includes("/") ? name.slice(0, name.indexOf("/")) : "");

/** The column of each name. `edges` are pairs of names; what closes a loop is left out of account. */
function columns(names, edges) {
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
  const column = new Map();
  for (const name of done.reverse()) {
    column.set(name, column.get(name) ?? 0);
    for (const next of out.get(name)) {
      if (!back.has(`${name} ${next}`)) column.set(next, Math.max(column.get(next) ?? 0, column.get(name) + 1));
    }
  }
  return column;
}

/** A lane's modules and lines that pass, by their columns. */
class Lane {
  constructor(name) {
    Object.assign(this, { name, columns: [], back: new Map(), top: 0, height: 0 });
  }

  add(slot) {
    (this.columns[slot.column] ??= []).push(slot);
  }

  /** How high its columns are with a gap between modules. */
  needs(gap) {
    const of = (slots) => slots.reduce((sum, slot) => sum + slot.height + room(slot, gap), 0);
    return Math.max(0, ...this.columns.filter(Boolean).map(of));
  }
}

const room = ({ name }, gap) => (name === undefined ? BESIDE : gap);
const middle = (slot) => slot.y + slot.height / 2;

/** Neighbours near each other: each column in the order of the middle of what it is linked to, there and back. */
function arrange(lanes) {
  const place = new Map();
  const see = (slots, lane) => slots.forEach((slot, row) => place.set(slot, lane + (row + 0.5) / slots.length));
  lanes.forEach(({ columns }, lane) => columns.forEach((slots) => see(slots, lane)));
  const most = Math.max(...lanes.map(({ columns }) => columns.length));
  for (let round = 0; round < 12; round += 1) {
    const side = round % 2 ? 1 : -1;
    for (let step = 0; step < most; step += 1) {
      const at = side < 0 ? step : most - 1 - step;
      lanes.forEach(({ columns }, lane) => {
        if (!columns[at]) return;
        const of = (slot) => {
          const near = slot.near.filter(({ column }) => Math.sign(column - at) === side);
          return near.length ? near.reduce((sum, other) => sum + place.get(other), 0) / near.length : place.get(slot);
        };
        columns[at].sort((one, other) => of(one) - of(other));
        see(columns[at], lane);
      });
    }
  }
}

/** Heights: each as near to what it is linked to as those beside it let it. */
function settle(lanes, gap) {
  for (const { columns, top, height } of lanes) {
    for (const slots of columns.filter(Boolean)) {
      const whole = slots.reduce((sum, slot) => sum + slot.height + room(slot, gap), 0);
      let y = top + (height - whole) / 2;
      for (const slot of slots) {
        slot.y = y + room(slot, gap) / 2;
        y += slot.height + room(slot, gap);
      }
    }
  }
  for (let round = 0; round < 8; round += 1) {
    for (const { columns, top, height } of lanes) {
      for (const slots of columns.filter(Boolean)) {
        const wanted = slots.map((slot) => (slot.near.length ? slot.near.reduce((sum, other) => sum + middle(other), 0) / slot.near.length : middle(slot)) - slot.height / 2);
        const apart = (row) => (room(slots[row], gap) + room(slots[row + 1], gap)) / 2;
        const [first, last] = [top + room(slots[0], gap) / 2, top + height - room(slots.at(-1), gap) / 2];
        // As far up as that lets them stand, and as far down; both keep the order, and so does the middle.
        const [high, low] = [[], []];
        slots.forEach((slot, row) => (low[row] = Math.max(wanted[row], row ? low[row - 1] + slots[row - 1].height + apart(row - 1) : first)));
        for (let row = slots.length - 1; row >= 0; row -= 1) {
          const end = row === slots.length - 1 ? last : low[row + 1] - apart(row);
          low[row] = Math.min(low[row], end - slots[row].height);
        }
        for (let row = slots.length - 1; row >= 0; row -= 1) {
          const end = row === slots.length - 1 ? last : high[row + 1] - apart(row);
          high[row] = Math.min(wanted[row], end - slots[row].height);
        }
        slots.forEach((slot, row) => (high[row] = Math.max(high[row], row ? high[row - 1] + slots[row - 1].height + apart(row - 1) : first)));
        slots.forEach((slot, row) => (slot.y = (low[row] + high[row]) / 2));
      }
    }
  }
}

/** A line with round corners. */
function rounded(points, radius = 7) {
  const toward = ([x, y], [otherX, otherY]) => {
    const length = Math.hypot(otherX - x, otherY - y);
    const part = Math.min(radius, length / 2) / (length || 1);
    return `${x + (otherX - x) * part} ${y + (otherY - y) * part}`;
  };
  const corner = (point, at) => `L${toward(point, points[at])}Q${point.join(" ")} ${toward(point, points[at + 2])}`;
  return `M${points[0].join(" ")}${points.slice(1, -1).map(corner).join("")}L${points.at(-1).join(" ")}`;
}

/**
 * Where all stand: `places` of names, `ways` of `edges` (`{from, to}`) with where words of each end stand, `boxes` about the modules of a robot.
 * `onward` are the edges that say who comes before whom, and `size` what there is for the drawing.
 */
export function layout(names, edges, onward, size) {
  const column = columns(names, onward.map(({ from, to }) => [from, to]));
  const lanes = [...new Set(names.map(groupOf))].sort().map((name) => new Lane(name));
  const laneOf = (name) => lanes.find((lane) => lane.name === groupOf(name));
  const nodes = new Map(names.map((name) => [name, { name, column: column.get(name), height: HEIGHT, near: [], y: 0 }]));
  nodes.forEach((slot, name) => laneOf(name).add(slot));
  const passes = new Map();
  const join = (one, other) => {
    if (one.near.includes(other)) return;
    one.near.push(other);
    other.near.push(one);
  };
  const isBack = ({ from, to }) => column.get(from) >= column.get(to);
  const drawn = edges.filter(({ from, to }) => nodes.has(from) && nodes.has(to));
  const through = new Map();
  for (const edge of drawn) {
    const [from, to] = [nodes.get(edge.from), nodes.get(edge.to)];
    const lane = laneOf(groupOf(edge.to) ? edge.to : edge.from);
    if (isBack(edge)) {
      const own = laneOf(edge.to);
      if (!own.back.has(edge.to)) own.back.set(edge.to, own.back.size);
      continue;
    }
    // What comes from one module passes together.
    const way = [];
    let before = from;
    for (let at = from.column + 1; at < to.column; at += 1) {
      const key = `${edge.from} ${lane.name} ${at}`;
      if (!passes.has(key)) {
        passes.set(key, { column: at, height: PASSING, near: [], y: 0 });
        lane.add(passes.get(key));
      }
      join(before, passes.get(key));
      before = passes.get(key);
      way.push(before);
    }
    join(before, to);
    through.set(edge, way);
  }
  arrange(lanes);
  const most = Math.max(1, ...[...nodes.values()].map(({ column }) => column + 1));
  const across = between(ACROSS, ((size?.width ?? 0) - WIDTH - 2 * (MARGIN + ROOM)) / Math.max(1, most - 1));
  const extra = lanes.reduce((sum, { name, back }) => sum + (name ? TITLE + MARGIN : 0) + (back.size ? (back.size + 1) * TRACK : 0), 2 * MARGIN);
  const needs = (gap) => lanes.reduce((sum, lane) => sum + lane.needs(gap), extra);
  let gap = GAP[1];
  while (gap > GAP[0] && needs(gap) > (size?.height ?? 0)) gap -= 1;
  let y = MARGIN;
  for (const lane of lanes) {
    lane.top = y + (lane.name ? TITLE : 0);
    lane.height = lane.needs(gap);
    lane.end = lane.top + lane.height + (lane.back.size ? (lane.back.size + 1) * TRACK : 0);
    y = lane.end + (lane.name ? MARGIN : 0);
  }
  settle(lanes, gap);
  const left = (at) => MARGIN + ROOM + at * across;
  const boxes = lanes.filter(({ name }) => name).map((lane) => {
    const own = Object.keys(lane.columns).map(Number);
    const [first, last] = [Math.min(...own), Math.max(...own)];
    return { name: lane.name, x: left(first) - ROOM + 4, y: lane.top - TITLE, width: (last - first) * across + WIDTH + 2 * ROOM - 8, height: lane.end - lane.top + TITLE };
  });
  // Who sends into other lanes, by columns.
  const trunks = new Map();
  const isAcross = (edge) => laneOf(edge.from) !== laneOf(groupOf(edge.to) ? edge.to : edge.from);
  for (const edge of drawn.filter((edge) => !isBack(edge) && isAcross(edge))) {
    const at = column.get(edge.from);
    trunks.set(at, (trunks.get(at) ?? new Set()).add(edge.from));
  }
  const gutter = across - WIDTH - ROOM + 4;
  const trunk = (name) => {
    const own = [...trunks.get(column.get(name))];
    return left(column.get(name)) + WIDTH + (gutter * (own.indexOf(name) + 1)) / (own.length + 1);
  };
  const ways = new Map(drawn.map((edge) => {
    const [from, to] = [nodes.get(edge.from), nodes.get(edge.to)];
    if (isBack(edge)) {
      const lane = laneOf(edge.to);
      const track = lane.back.get(edge.to);
      const [startX, endX, low] = [left(from.column) + WIDTH, left(to.column), lane.top + lane.height + (track + 0.6) * TRACK];
      const [right, before, start, end] = [startX + 10 + 3 * track, endX - 14 - 3 * track, from.y + 0.75 * HEIGHT, to.y + 0.75 * HEIGHT];
      const below = { x: (right + before) / 2, y: low };
      return [edge, { isBack: true, start: below, end: below, d: rounded([[startX, start], [right, start], [right, low], [before, low], [before, end], [endX - 2, end]]) }];
    }
    const bend = (x, y, endX, endY) => `C${(x + endX) / 2} ${y} ${(x + endX) / 2} ${endY} ${endX} ${endY}`;
    let [x, y] = [left(from.column) + WIDTH, middle(from)];
    const [endX, endY] = [left(to.column) - 2, middle(to)];
    const way = through.get(edge);
    let d = `M${x} ${y}`;
    const onto = (nextX, nextY) => {
      const isFirst = x === left(from.column) + WIDTH && y === middle(from);
      const at = isFirst && isAcross(edge) && Math.abs(nextY - y) > 1 ? trunk(edge.from) : null;
      d += at === null ? bend(x, y, nextX, nextY) : rounded([[x, y], [at, y], [at, nextY], [nextX, nextY]]).replace(/^M/, "L");
    };
    for (const slot of way) {
      onto(left(slot.column), middle(slot));
      d += `H${left(slot.column) + WIDTH}`;
      [x, y] = [left(slot.column) + WIDTH, middle(slot)];
    }
    onto(endX, endY);
    const ends = { start: { x: left(from.column) + WIDTH + 16, y: middle(from) }, end: { x: endX - 16, y: endY } };
    return [edge, { isBack: false, d, ...ends }];
  }));
  const places = new Map([...nodes].map(([name, { column, y }]) => [name, { x: left(column), y }]));
  return { places, ways, boxes, width: left(most - 1) + WIDTH + ROOM + MARGIN, height: y + MARGIN / 2 };
}

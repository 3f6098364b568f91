// Where robots have been, and by which route: kept as long as the page is open, whatever it shows.
import { recall } from "/history.js";
import { watch } from "/live.js";

const MOST = 20000;
const STEP = 0.01;

const trails = new Map();

/**
 * The trail of a robot: `points` of `{x, y, route, time}`, oldest first. What was before this page was open is from `table`, columns
 * of a document of the run, if that has them, else from what the agent remembers.
 */
export function trail(pose, status, table) {
  const key = `${pose} ${status}`;
  let found = trails.get(key);
  if (found) {
    if (table && !found.table) remember(found, table);
    return found;
  }
  found = { points: [], route: "IDLE", table: null };
  if (table) remember(found, table);
  trails.set(key, found);
  if (status) watch(status, ({ value }) => (found.route = value.route), { rate: 20, live: true });
  watch(pose, ({ value: { x, y }, time }) => add(found, x, y, time), { rate: 20, live: true });
  recall(pose, 4000, (places) => {
    // The run itself has told more.
    if (found.table) return undefined;
    if (!status) return prepend(found, places, []);
    return recall(status, 4000, (states) => prepend(found, places, states));
  });
  return found;
}

function remember(trail, table) {
  trail.table = table;
  const first = trail.points.find(({ time }) => time > table.time.at(-1))?.time ?? Infinity;
  trail.points = trail.points.filter(({ time }) => time >= first);
  const points = table.time.map((time, row) => ({ x: table.x[row], y: table.y[row], route: (table.route[row] ?? "idle").toUpperCase(), time }));
  trail.points.unshift(...points);
}

// Both in the order of time: each place has the route that was chosen last.
function prepend(trail, places, states) {
  const first = trail.points[0]?.time ?? Infinity;
  const before = { points: [], route: "IDLE" };
  let next = 0;
  for (const { value, time } of places) {
    if (time >= first) break;
    while (next < states.length && states[next].time <= time) before.route = states[next++].value.route;
    add(before, value.x, value.y, time);
  }
  trail.points.unshift(...before.points);
}

function add(trail, x, y, time) {
  const last = trail.points.at(-1);
  // Another run has begun, or the agent went back to a snapshot.
  if (last && time < last.time) trail.points.length = 0;
  const moved = !last || Math.hypot(x - last.x, y - last.y) >= STEP;
  if (!moved && last.route === trail.route) return;
  trail.points.push({ x, y, route: trail.route, time });
  if (trail.points.length > MOST) trail.points.splice(0, MOST / 4);
}

/** Forgets where robots have been. */
export function forget() {
  for (const trail of trails.values()) trail.points.length = 0;
}

// Trails of robots by route: kept as long as the page is open, whatever it shows.
import { isRecorded } from "/api.js";
import { recall } from "/history.js";
import { watch } from "/live.js";

const MOST = 20000;
const STEP = 0.01;

const trails = new Map();

/**
 * The trail of a robot: `points` of `{x, y, route, time}`, oldest first. Points from before the opening of the page are from `table`,
 * the columns of a document of the run, else from the agent's history.
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
  const options = { rate: 20, live: true, every: isRecorded };
  if (status) watch(status, ({ value }) => (found.route = value.route), options);
  watch(pose, ({ value, time }) => add(found, value, time), options);
  recall(pose, 4000, (places) => {
    // The document of the run has more points.
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

// Both in the order of time: each point has the latest route.
function prepend(trail, places, states) {
  const first = trail.points[0]?.time ?? Infinity;
  const before = { points: [], route: "IDLE" };
  let next = 0;
  for (const { value, time } of places) {
    if (time >= first) break;
    while (next < states.length && states[next].time <= time) before.route = states[next++].value.route;
    add(before, value, time);
  }
  trail.points.unshift(...before.points);
}

// An estimate has its pose inside.
function add(trail, value, time) {
  const { x, y } = value.pose ?? value;
  if (!Number.isFinite(x)) return;
  const last = trail.points.at(-1);
  // Another run has started, or the agent has resumed from a snapshot.
  if (last && time < last.time) trail.points.length = 0;
  const moved = !last || Math.hypot(x - last.x, y - last.y) >= STEP;
  if (!moved && last.route === trail.route) return;
  trail.points.push({ x, y, route: trail.route, time });
  if (trail.points.length > MOST) trail.points.splice(0, MOST / 4);
}

/** Clears all trails. */
export function forget() {
  for (const trail of trails.values()) trail.points.length = 0;
}

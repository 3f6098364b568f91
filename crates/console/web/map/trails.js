// Where robots have been, and by which route: kept as long as the page is open, whatever it shows.
import { watch } from "/live.js";

const MOST = 20000;
const STEP = 0.01;

const trails = new Map();

/** The trail of a robot, from now on: `points` of `{x, y, route, time}`, oldest first. */
export function trail(pose, status) {
  const key = `${pose} ${status}`;
  let found = trails.get(key);
  if (found) return found;
  found = { points: [], route: "IDLE" };
  trails.set(key, found);
  if (status) watch(status, ({ value }) => (found.route = value.route), { rate: 20 });
  watch(pose, ({ value: { x, y }, time }) => add(found, x, y, time), { rate: 20 });
  return found;
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

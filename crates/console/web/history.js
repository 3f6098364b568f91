// What values were, as far as the page has seen them: one that was plotted once is kept as long as the page is open.
import { part } from "/schema.js";
import { watch } from "/live.js";

const RATE = 20;
// Ten minutes of them.
const MOST = 10 * 60 * RATE;

const histories = new Map();

/** The values at a pointer of a property since somebody asked for them first: `times` in s, and `values`, which are numbers or names. */
export function history(path, pointer, rate = RATE) {
  const key = `${path} ${pointer}`;
  let found = histories.get(key);
  if (found) return found;
  found = { times: [], values: [], listeners: new Set() };
  histories.set(key, found);
  watch(path, ({ value, time }) => add(found, time / 1e9, part(value, pointer)), { rate });
  return found;
}

function add(history, time, value) {
  const { times, values } = history;
  // Another run has begun, or the agent went back to a snapshot.
  if (time < times.at(-1)) times.length = values.length = 0;
  if (time === times.at(-1)) return;
  times.push(time);
  values.push(typeof value === "boolean" ? Number(value) : typeof value === "object" ? null : value ?? null);
  if (times.length > MOST) {
    times.splice(0, MOST / 10);
    values.splice(0, MOST / 10);
  }
  history.listeners.forEach((listener) => listener());
}

// Histories of values since the page was opened: a plotted value is kept as long as the page is open.
import { part, selection } from "/schema.js";
import { watch } from "/live.js";
import { at, get, isRecorded, Problem } from "/api.js";

const RATE = 20;
// Ten minutes.
const MOST = 10 * 60 * RATE;

const histories = new Map();

/**
 * History of a part of a property since its first request: `times` in s, and `values`, which are numbers or names. For a
 * JSONPath it is the first match.
 */
export function history(path, pointer, rate = RATE) {
  const key = `${path} ${pointer}`;
  let found = histories.get(key);
  if (found) return found;
  found = { times: [], values: [], listeners: new Set() };
  histories.set(key, found);
  if (pointer.startsWith("$")) {
    watch(path, ({ value, time }) => add(found, time / 1e9, value[0]), { rate, live: true, part: pointer });
    recall(path, 5000, (values) => prepend(found, values.map(({ time, value }) => ({ time, value: value[0] }))), pointer);
  } else {
    // A recorded run is played at any rate and from any place: it delivers all values up to there.
    watch(path, ({ value, time }) => add(found, time / 1e9, part(value, pointer)), { rate, live: true, every: isRecorded });
    recall(path + pointer, 5000, (values) => prepend(found, values));
  }
  return found;
}

// The agent whose past can be read, and the histories to fill with it.
let rememberer = null;
const waiting = [];
// One request after the other, so that the newest one never waits.
let queue = Promise.resolve();

/** Sets the agent that provides values from before this page was opened. */
export function rememberedBy(agent) {
  if (rememberer === agent) return;
  rememberer = agent;
  waiting.forEach((later) => later(agent));
}

/** Calls a function with values from before this page was opened, if the agent keeps them. */
export function recall(path, most, take, part = "") {
  const fill = async (agent) => {
    try {
      take((await get(`${at(agent, path, "history")}?${new URLSearchParams({ limit: most, ...selection(part) })}`)).values);
    } catch (problem) {
      // The history starts at the opening; the bar shows what is kept.
      if (!(problem instanceof Problem)) throw problem;
    }
  };
  const later = (agent) => (queue = queue.then(() => fill(agent)));
  waiting.push(later);
  if (rememberer) later(rememberer);
}

/** Clears all histories, after the start of another run. */
export function forgetHistories() {
  for (const { times, values, listeners } of histories.values()) {
    times.length = values.length = 0;
    listeners.forEach((listener) => listener());
  }
}

function prepend(history, values) {
  const first = history.times[0] ?? Infinity;
  const before = values.filter(({ time }) => time / 1e9 < first);
  history.times.unshift(...before.map(({ time }) => time / 1e9));
  history.values.unshift(...before.map(({ value }) => plain(value)));
  history.listeners.forEach((listener) => listener());
}

const plain = (value) => (typeof value === "boolean" ? Number(value) : typeof value === "object" ? null : value ?? null);

function add(history, time, value) {
  const { times, values } = history;
  // Another run has started, or the agent has resumed from a snapshot.
  if (time < times.at(-1)) times.length = values.length = 0;
  if (time === times.at(-1)) return;
  times.push(time);
  values.push(plain(value));
  if (times.length > MOST) {
    times.splice(0, MOST / 10);
    values.splice(0, MOST / 10);
  }
  history.listeners.forEach((listener) => listener());
}

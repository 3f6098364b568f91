// Live values over one WebSocket. Each property is subscribed once, at the highest rate that a watcher requests.
// A hidden page requests one value a second. While the page shows a past time, watchers receive values of that time, and
// the robot continues.
import { at, get, life, openSocket, Problem, timeShown } from "/api.js";
import { selection } from "/schema.js";
import { useEffect, useRef, useState } from "/lib/preact.js";

const RETRY = [500, 1000, 2000];
const HIDDEN_RATE = 1;
// A page sends a request at least once a second. Silence after which the agent does not respond, and period of the check, ms.
const SILENCE = 2500;
const LOOK = 500;
// Delay of the next request for a missing property, ms.
const MISSING = 2000;

const subscriptions = new Map();
const byId = new Map();
const connectionListeners = new Set();
let socket = null;
let nextId = 1;
let attempts = 0;

/** State of the connection: `connecting`, `live`, `silent` or `lost`, and its start (ms of `performance.now`). */
export const connection = { state: "connecting", since: performance.now() };

/** The agent's time, ns: `live` is the newest known one, `now` the one that is shown. */
export const clock = { now: 0, live: 0 };

// The past time that is requested, and the one that is shown.
let past = null;
let shown = null;
let isAsking = false;

function tell(state, since = performance.now()) {
  if (connection.state !== state) Object.assign(connection, { state, since });
  for (const listener of connectionListeners) listener(connection);
}

/** Calls a function at each change of the connection; returns a function that ends this. */
export function onConnection(listener) {
  connectionListeners.add(listener);
  return () => connectionListeners.delete(listener);
}

/** Connects, and reconnects after each loss. */
export function connect() {
  socket = openSocket("live");
  socket.onopen = () => {
    attempts = 0;
    clock.live = 0;
    lookLive();
    tell("live");
    subscribe([...subscriptions.values()]);
  };
  socket.binaryType = "arraybuffer";
  socket.onmessage = ({ data }) => (typeof data === "string" ? hear(JSON.parse(data)) : hearBytes(data));
  socket.onclose = () => {
    tell("lost");
    setTimeout(connect, RETRY[Math.min(attempts++, RETRY.length - 1)]);
  };
}

// A frozen agent keeps its connections.
let looked = performance.now();
setInterval(() => {
  const now = performance.now();
  // A page that was frozen has received nothing, and a hidden one sends fewer requests.
  if (now - looked > 2 * LOOK || document.hidden) life.heard = now;
  looked = now;
  const isSilent = now - life.heard > SILENCE;
  if (connection.state === "live" && isSilent) tell("silent", life.heard);
  else if (connection.state === "silent" && !isSilent) tell("live");
}, LOOK);

const isOpen = () => socket?.readyState === WebSocket.OPEN;

const rateOf = (subscription) => {
  const rate = Math.max(...[...subscription.watchers.values()].map(({ rate }) => rate));
  return document.hidden ? Math.min(rate, HIDDEN_RATE) : rate;
};

function subscribe(wanted) {
  if (!isOpen() || wanted.length === 0) return;
  const wishes = wanted.map((it) => ({ id: it.id, url: `/${it.path}`, rate: rateOf(it), every: it.every, form: it.decode ? "binary" : "json", ...selection(it.part) }));
  socket.send(JSON.stringify({ subscribe: wishes }));
}

function hear(message) {
  life.heard = performance.now();
  const subscription = byId.get(message.id);
  if (subscription === undefined) return;
  if (message.problem) {
    subscription.problem = message.problem;
    for (const { fail } of subscription.watchers.values()) fail?.(new Problem(message.problem.status, message.problem.detail, message.problem.help));
    // If only the part is missing, later values may have it.
    if (message.sequence === undefined) setTimeout(() => subscription.watchers.size && subscribe([subscription]), MISSING);
    return;
  }
  if (message.value === undefined) {
    subscription.problem = null;
    subscription.interface = message.interface;
    return;
  }
  take(subscription, message);
}

// A value in the form `binary`: 1, id, time, sequence, and the bytes as they lie in memory.
function hearBytes(bytes) {
  life.heard = performance.now();
  const head = new DataView(bytes);
  const subscription = byId.get(head.getUint32(1, true));
  const value = subscription?.decode?.(bytes.slice(21));
  if (value) take(subscription, { value, time: Number(head.getBigUint64(5, true)), sequence: Number(head.getBigUint64(13, true)) });
}

function take(subscription, { value, time, sequence }) {
  clock.live = timeShown() ?? Math.max(clock.live, time);
  if (past === null) clock.now = clock.live;
  subscription.last = { value, time, sequence, received: performance.now(), isRecalled: false };
  deliver(subscription, subscription.last, past !== null);
}

/** Calls the watchers of a subscription; a current value reaches only `live` ones while a past time is shown. */
function deliver(subscription, reading, isLiveAlone = false) {
  for (const [listener, { live }] of subscription.watchers) if (!isLiveAlone || live) listener(reading);
}

/** Shows a past time, ns, of an agent that keeps its last seconds or plays a recording. */
export async function lookBack(agent, time) {
  past = { agent, time };
  clock.now = time;
  connectionListeners.forEach((listener) => listener(connection));
  if (isAsking) return;
  isAsking = true;
  // During a drag only the last position counts.
  while (past !== null && shown !== past) {
    const wanted = past;
    await Promise.all([...subscriptions.values()].map((subscription) => recall(subscription, wanted)));
    shown = wanted;
  }
  isAsking = false;
}

async function recall(subscription, { agent, time }) {
  if ([...subscription.watchers.values()].every(({ live }) => live)) return;
  try {
    const { values } = await get(`${at(agent, subscription.path, "history")}?${new URLSearchParams({ to: time, limit: 1, ...selection(subscription.part) })}`);
    if (past === null) return;
    if (values.length) deliverPast(subscription, { ...values.at(-1), received: performance.now(), isRecalled: true });
    // Nothing was written before that time.
    else for (const { live, none } of subscription.watchers.values()) if (!live) none?.();
  } catch (problem) {
    // A property without history keeps its value, which is marked as current.
    if (!(problem instanceof Problem)) throw problem;
  }
}

function deliverPast(subscription, reading) {
  for (const [listener, { live }] of subscription.watchers) if (!live) listener(reading);
}

/** Returns to the present. */
export function lookLive() {
  if (past === null) return;
  past = shown = null;
  clock.now = clock.live;
  for (const subscription of subscriptions.values()) if (subscription.last) deliver(subscription, subscription.last);
  connectionListeners.forEach((listener) => listener(connection));
}

/** Whether a past time is shown. */
export const isPast = () => past !== null;

/**
 * Whether a reading is current although a past time is shown, because the property has no history. For a time alone this is known
 * when all histories have arrived.
 */
export const isOfNow = ({ time, isRecalled = isAsking }) => shown !== null && !isRecalled && time > clock.now;

/**
 * Calls a function with each reading `{value, time, sequence, received}` of a property, at most `rate` times a second, or with
 * each kept value if `every`; with `live`, also while a past time is shown. With `part`, a JSON Pointer or JSONPath, the
 * value is that of the part, or a list of all matches; `fail` receives the reason of a missing value, and `none` is called when
 * there was no value at the past time. With `decode`, current values arrive as bytes, which it turns into a value; for large
 * ones. Returns a function that ends the subscription.
 */
export function watch(path, listener, { rate = 10, every = false, live = false, part = "", decode, fail, none } = {}) {
  const key = [path, part, every ? "every" : "", decode ? "bytes" : ""].join("|");
  let subscription = subscriptions.get(key);
  if (subscription === undefined) {
    subscription = { id: nextId++, path, part, every, decode, watchers: new Map(), last: null, problem: null, interface: null };
    subscriptions.set(key, subscription);
    byId.set(subscription.id, subscription);
  }
  const before = Math.max(0, ...[...subscription.watchers.values()].map(({ rate }) => rate));
  subscription.watchers.set(listener, { rate, live, fail, none });
  if (rate > before) subscribe([subscription]);
  if (past !== null && !live) recall(subscription, past);
  else if (subscription.last) listener(subscription.last);
  return () => {
    subscription.watchers.delete(listener);
    if (subscription.watchers.size > 0) return;
    subscriptions.delete(key);
    byId.delete(subscription.id);
    if (isOpen()) socket.send(JSON.stringify({ unsubscribe: [subscription.id] }));
  };
}

// At most one update per frame.
const due = new Set();
function refresh() {
  for (const redraw of due) redraw();
  due.clear();
}
function later(redraw) {
  if (due.size === 0) requestAnimationFrame(refresh);
  due.add(redraw);
}

/** The newest readings of properties by path, for a component. */
export function useReadings(paths, rate = 10) {
  const readings = useRef({});
  const [, redraw] = useState(0);
  const key = paths.join(" ");
  useEffect(() => {
    readings.current = {};
    const again = () => redraw((count) => count + 1);
    const ends = paths.map((path) =>
      watch(path, (reading) => {
        readings.current[path] = reading;
        later(again);
      }, {
        rate,
        none: () => {
          delete readings.current[path];
          later(again);
        },
      }),
    );
    return () => {
      due.delete(again);
      ends.forEach((end) => end());
    };
  }, [key, rate]);
  return readings.current;
}

/** The newest reading of a property, for a component; undefined before the first one. */
export function useReading(path, rate = 10) {
  return useReadings(path ? [path] : [], rate)[path];
}

document.addEventListener("visibilitychange", () => subscribe([...subscriptions.values()]));

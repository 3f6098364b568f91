// Answers to requests of the page from a recorded run, as its agent would give them at the time that is shown.
import { Problem } from "/operations.js";
import { find, newest, playback, reading, run } from "/recorded/run.js";

const LEVELS = ["error", "warn", "info", "debug", "trace"];
const LOG = "log/tail";

const status = () => ({
  file: run.file,
  begin: run.from,
  time: playback.now() - run.from,
  from: 0,
  to: run.to - run.from,
  is_paused: playback.isPaused,
  rate: playback.rate,
  section: null,
  values: 0,
  modules: [],
});

const ORDERS = {
  pause: () => ({ isPaused: true }),
  resume: () => ({ isPaused: false }),
  rate: ({ factor }) => ({ rate: factor }),
  seek: ({ time }) => ({ place: Math.min(Math.max(run.from + time, run.from), run.to) }),
  step: () => ({ isPaused: true, place: after(playback.now()) }),
};

/** The time of the next recorded value. */
function after(now) {
  const next = Object.values(run.histories).map((samples) => samples[newest(samples, now) + 1]?.[0] ?? Infinity);
  return Math.min(run.to, ...next);
}

/** The value of a property, or of a part, at the time that is shown; undefined before the first one. */
function value(path, pointer) {
  const found = find(path);
  if (found === null) throw new Problem(404, `/${path} was not exported`, "see the tree for what the page contains");
  const sample = found.samples[newest(found.samples, playback.now())];
  return sample && reading(sample, found.pointer + pointer).value;
}

function history(path, query) {
  const found = find(path);
  if (found === null) return { values: [] };
  const end = newest(found.samples, Math.min(Number(query.get("to") ?? Infinity), playback.now()));
  const limit = Number(query.get("limit") ?? 1000);
  const samples = found.samples.slice(0, end + 1);
  const step = Math.max(1, samples.length / limit);
  const kept = Array.from({ length: Math.min(limit, samples.length) }, (_, place) => samples[samples.length - 1 - Math.floor(place * step)]);
  return { values: kept.reverse().map((sample) => reading(sample, found.pointer + (query.get("pointer") ?? ""))) };
}

function log(query) {
  const [least, sequence] = [LEVELS.indexOf(query.get("level") ?? "trace"), Number(query.get("after") ?? 0)];
  const samples = run.histories[LOG] ?? [];
  return samples
    .slice(0, newest(samples, playback.now()) + 1)
    .map(([time, sequence, line]) => ({ ...line, time, sequence }))
    .filter((line) => line.sequence > sequence && LEVELS.indexOf(line.level.toLowerCase()) <= least);
}

function properties() {
  const now = playback.now();
  return run.resources["/properties"].map((property) => {
    const samples = run.histories[property.path] ?? [];
    const sample = samples[newest(samples, now)];
    return sample ? { ...property, ...reading(sample) } : property;
  });
}

const path = (names) => names.map(decodeURIComponent).join("/");

function read(text) {
  const [place, rest = ""] = text.split("?");
  const query = new URLSearchParams(rest);
  const [, kind, , ...names] = place.split("/");
  if (place === "") return { operations: [{ path: "/api/v1/playback" }, { path: "/api/v1/recordings" }] };
  if (place === "/agent") return { ...run.resources[place], role: "viewer", time: playback.now() };
  if (place === "/playback") return status();
  if (place === "/recordings") return { can_record: false, files: [], flight: null, recordings: [] };
  if (place === "/properties" && query.has("values")) return properties();
  if (place === "/log") return log(query);
  if (kind === "history" && names.length) return history(path(names), query);
  if (kind === "slate" && names.length) return value(path(names), query.get("pointer") ?? "");
  const known = run.resources[text] ?? run.resources[place];
  if (known === undefined) throw new Problem(404, `${place} was not exported`, "open the console of an agent for it");
  return known;
}

/** The answer to a request; throws a `Problem` where only an agent could answer. */
export function answer(method, text, body) {
  if (method === "GET") return read(text);
  const order = ORDERS[text.match(/^\/playback\/(\w+)$/)?.[1]];
  if (method !== "POST" || !order) throw new Problem(409, "this page shows a recorded run; nothing in it can be changed", "open the console of an agent");
  playback.change(order(body ?? {}));
  return status();
}

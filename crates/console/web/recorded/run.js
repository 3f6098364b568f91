// A recorded run, which an exported page contains: its clock, and the values of each property by time.
import { part } from "/schema.js";

/** Reads the run in the page: JSON with gzip in Base64. */
async function load() {
  const bytes = await (await fetch(`data:application/gzip;base64,${document.getElementById("recording").textContent.trim()}`)).blob();
  return new Response(bytes.stream().pipeThrough(new DecompressionStream("gzip"))).json();
}

/** The exported run: `agent`, `file`, `from` and `to` in ns, `panels`, the answers in `resources`, and `histories` of `[time, sequence, value]`. */
export const run = await load();

/** Playback position: runs with the clock of the page. */
export const playback = {
  rate: 1,
  isPaused: false,
  place: run.from,
  since: performance.now(),
  /** The time that is shown, ns. */
  now() {
    if (this.isPaused) return this.place;
    const passed = this.rate === null ? Infinity : (performance.now() - this.since) * 1e6 * this.rate;
    if (this.place + passed >= run.to) Object.assign(this, { place: run.to, isPaused: true });
    return this.isPaused ? this.place : Math.round(this.place + passed);
  },
  change(values) {
    const place = this.now();
    // Playing again from the end starts over.
    const isOver = values.isPaused === false && place >= run.to;
    Object.assign(this, { place: isOver ? run.from : place, since: performance.now() }, values);
  },
};

/** The index of the newest value of a history at a time; -1 before the first one. */
export function newest(samples, time) {
  let [low, high] = [0, samples.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (samples[middle][0] <= time) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

/** A sample as the agent sends it, of a whole value or of a part. */
export function reading([time, sequence, value], pointer = "") {
  return { time, sequence, value: pointer ? part(value, pointer) : value };
}

/** The property that a path leads to or into, and the rest of the path as a JSON Pointer. */
export function find(path) {
  const names = path.split("/");
  for (let count = names.length; count > 0; count -= 1) {
    const name = names.slice(0, count).join("/");
    if (run.histories[name]) return { samples: run.histories[name], pointer: ["", ...names.slice(count)].join("/") };
  }
  return null;
}

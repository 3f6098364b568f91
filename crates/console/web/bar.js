// The bar at the bottom: recordings, history, and the controls of a playback.
import { html, useEffect, useRef, useState } from "/lib/preact.js";
import { isRecorded, note, post, Problem } from "/api.js";
import { clock, isPast, lookBack, lookLive, onConnection } from "/live.js";
import { rememberedBy } from "/history.js";
import { reload, useOver, usePlayback, useResource } from "/store.js";
import { time } from "/format.js";
import { Trouble } from "/parts.js";

const RATES = { 0.1: "× 0.1", 0.5: "× 0.5", 1: "× 1", 2: "× 2", 5: "× 5", 10: "× 10" };
// Step of the slider, ns.
const STEP = 2e7;

const size = (bytes) => (bytes < 1e6 ? `${(bytes / 1e3).toFixed(0)} kB` : `${(bytes / 1e6).toFixed(1)} MB`);
const nameOf = (file) => file.split("/").at(-1).replace(/\.mcap$/, "");

/** A name that no recording has. */
function free(stem, files) {
  for (let number = 1; ; number += 1) if (!files.some(({ name }) => name === `${stem}-${number}`)) return `${stem}-${number}`;
}

/** A slider over time; `move` receives each position, one at a time. */
function Slider({ from, to, now, move, label }) {
  const [held, setHeld] = useState(null);
  return html`<input type="range" class="time" aria-label=${label} aria-valuetext=${time(held ?? now)} min=${from} max=${Math.max(to, from + 1)} step=${STEP} value=${held ?? now}
    onPointerDown=${() => setHeld(now)} onPointerUp=${() => setHeld(null)} onInput=${(event) => { if (held !== null) setHeld(Number(event.target.value)); move(Number(event.target.value)); }} />`;
}

function Recording({ recordings, act, isAllowed }) {
  const { recordings: going, files, flight } = recordings;
  const own = going.find(({ file }) => /^recording-\d+$/.test(nameOf(file)));
  const begin = () => act(`/recordings/${free("recording", files)}`, {});
  return html`
    <button class="record" aria-pressed=${Boolean(own)} disabled=${!isAllowed} title=${own ? "Stop the recording" : "Record all properties into a new file"} onClick=${() => (own ? act(`/recordings/${nameOf(own.file)}/stop`) : begin())}>
      ${own ? "■ Stop recording" : "● Record"}</button>
    <button id="mark" disabled=${!isAllowed} title="Write a mark into the log (b)" onClick=${() => act("/log", { text: "mark" })}>Mark</button>
    ${flight && html`<button disabled=${!isAllowed} title="Write the flight recorder to a file" onClick=${() => act(`/recordings/${free("moment", files)}/snapshot`)}>Save the last ${Math.round((flight.to - flight.from) / 1e9)} s</button>`}
    ${going.map(({ file, bytes, values, dropped, failure }) => html`<span class="going" key=${file} data-state=${failure || dropped ? "bad" : undefined} title=${file}>${nameOf(file)}: ${size(bytes)}, ${values} values${dropped ? `, ${dropped} dropped` : ""}${failure ? `, ${failure}` : ""}</span>`)}`;
}

function Playback({ playback, act, isAllowed }) {
  const { time: now, from, to, is_paused: isPaused, rate } = playback;
  const busy = useRef({ is: false, place: 0 }).current;
  // One request at a time: each takes the agent a moment.
  const seek = async (place) => {
    busy.place = place;
    if (busy.is) return;
    busy.is = true;
    for (let done = null; done !== busy.place; ) {
      done = busy.place;
      await act("/playback/seek", { time: Math.round(done) });
    }
    busy.is = false;
  };
  return html`
    <button disabled=${!isAllowed} aria-label=${isPaused ? "Play" : "Pause"} onClick=${() => act(isPaused ? "/playback/resume" : "/playback/pause")}>${isPaused ? "▶" : "❚❚"}</button>
    <button disabled=${!isAllowed} title="Step one cycle" onClick=${() => act("/playback/step", { cycles: 1 })}>Step</button>
    <select aria-label="Playback rate" value=${rate ?? ""} disabled=${!isAllowed} onChange=${(event) => act("/playback/rate", { factor: event.target.value ? Number(event.target.value) : null })}>
      ${Object.entries(RATES).map(([factor, name]) => html`<option key=${factor} value=${factor}>${name}</option>`)}<option value="">unlimited</option></select>
    <${Slider} from=${from} to=${to} now=${now} move=${seek} label="Playback position" />
    <span class="number">${time(now)} of ${time(to)}</span>`;
}

function Past({ flight, agent }) {
  const [, redraw] = useState(0);
  useEffect(() => {
    const timer = setInterval(() => redraw((count) => count + 1), 250);
    const end = onConnection(() => redraw((count) => count + 1));
    return () => {
      clearInterval(timer);
      end();
    };
  }, []);
  const to = Math.max(flight.to, clock.live);
  const ago = (clock.live - clock.now) / 1e9;
  return html`
    <${Slider} from=${flight.from} to=${to} now=${isPast() ? clock.now : to} move=${(place) => (place >= to - 1e8 ? lookLive() : lookBack(agent.name, Math.round(place)))} label="Time shown" />
    ${isPast() ? html`<span class="number past">${ago.toFixed(1)} s ago</span><button class="primary" onClick=${lookLive}>Go live</button>` : html`<span class="number muted">live</span>`}`;
}

/** The bar of an agent with a recorder. */
export function Bar({ agent }) {
  const [problem, setProblem] = useState(null);
  const operations = useResource("")?.operations ?? [];
  const has = (path) => operations.some((operation) => operation.path.endsWith(path));
  const recordings = useResource(has("/recordings") ? "/recordings" : null, 1);
  const playback = usePlayback();
  const over = useOver();
  const isRemembered = Boolean(recordings?.flight || playback);
  useEffect(() => {
    if (isRemembered && agent) rememberedBy(agent.name);
  }, [isRemembered, agent?.name]);
  // After the end of a run nothing is recorded.
  if (!recordings || over) return null;
  const act = async (path, body) => {
    try {
      setProblem(null);
      await post(path, body);
    } catch (error) {
      if (!(error instanceof Problem)) throw error;
      setProblem(error);
    }
    reload("/recordings", "/playback");
  };
  const isAllowed = isRecorded || (agent && agent.role !== "viewer");
  return html`<footer class="foot" aria-label="Record and replay" data-past=${isPast() ? "true" : undefined}>
    <${Trouble} problem=${problem} />
    ${note && html`<span class="muted">${note}</span>`}
    ${playback ? html`<${Playback} playback=${playback} act=${act} isAllowed=${isAllowed} />` : html`<${Recording} recordings=${recordings} act=${act} isAllowed=${isAllowed} />
      ${recordings.flight && agent ? html`<${Past} flight=${recordings.flight} agent=${agent} />` : html`<span class="grow"></span><span class="muted">The flight recorder is off: see <code>[record.flight]</code></span>`}`}
  </footer>`;
}

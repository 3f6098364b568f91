// Messages of the log, live. While a past time is shown, a line separates the messages up to that time from later ones.
import { at, clock, Empty, get, html, isPast, onConnection, Problem, time, Trouble, useAgent, useEffect, usePlayback, useRef, useState } from "/slate.js";
import { lookBack } from "/live.js";

const LEVELS = ["error", "warn", "info", "debug", "trace"];
const MOST = 2000;

/** Messages of a level in the last seconds, also from before the opening of the page. */
async function kept(agent, level) {
  const { values } = await get(`${at(agent, "log/tail", "history")}?limit=${MOST}`);
  const lines = values.map(({ value, ...stamp }) => ({ ...value, ...stamp, level: value.level.toLowerCase() }));
  return lines.filter((line) => LEVELS.indexOf(line.level) <= LEVELS.indexOf(level));
}

/** Messages in the order of time, each once: a repeated playback sends them again with other numbers. */
function ordered(lines, isPlayed) {
  const known = new Map(lines.map((line) => [isPlayed ? `${line.time} ${line.module} ${line.text}` : line.sequence, line]));
  return [...known.values()].sort((one, other) => one.time - other.time || one.sequence - other.sequence);
}

function Panel({ options, setOptions }) {
  const [lines, setLines] = useState(null);
  const [text, setText] = useState("");
  const [paused, setPaused] = useState(false);
  const scroll = useRef(null);
  const marked = useRef(null);
  const [problem, setProblem] = useState(null);
  const [chosen, setChosen] = useState(null);
  const agent = useAgent();
  const playback = usePlayback();
  const [, redraw] = useState(0);
  const [before, setBefore] = useState([]);
  const level = options.level ?? "info";
  // Whether a past time is shown.
  const isStill = isPast() || Boolean(playback?.is_paused);
  // In a running playback, messages arrive before its position is known.
  const lead = isStill ? 0 : 1e9 * (playback?.rate ?? Infinity);
  const moment = isPast() ? clock.now : playback ? playback.begin + playback.time + lead : null;
  useEffect(() => onConnection(() => redraw((count) => count + 1)), []);
  useEffect(() => {
    setBefore([]);
    if (isPast() && agent) kept(agent.name, level).then(setBefore, (problem) => { if (!(problem instanceof Problem)) throw problem; });
  }, [isPast(), agent?.name, level]);
  useEffect(() => {
    let [after, ended, timer] = [null, false, 0];
    setLines(null);
    // Messages come in bursts, so they are requested together.
    const more = async () => {
      try {
        const fresh = await get(`/log?level=${level}${after === null ? "" : `&after=${after}`}`);
        if (ended) return;
        if (fresh.length) after = fresh.at(-1).sequence;
        setLines((before) => (fresh.length || before === null ? [...(before ?? []), ...fresh].slice(-MOST) : before));
      } catch {
        // The banner shows the reason; requests continue.
        if (!ended) after = null;
      }
      timer = setTimeout(more, 500);
    };
    more();
    return () => {
      ended = true;
      clearTimeout(timer);
    };
  }, [level]);
  useEffect(() => scroll.current?.querySelector("[aria-selected=true]")?.scrollIntoView({ block: "nearest" }), [chosen]);
  useEffect(() => {
    if (!scroll.current) return;
    const mark = scroll.current.querySelector(".looked-at");
    if (!(mark && isStill) && !paused) scroll.current.scrollTop = scroll.current.scrollHeight;
    // The messages of the shown time are at the bottom.
    else if (mark && isStill && marked.current !== moment) mark.scrollIntoView({ block: "end" });
    marked.current = mark ? moment : null;
  });
  const wanted = text.toLowerCase();
  const all = moment === null ? (lines ?? []) : ordered([...before, ...(lines ?? [])], Boolean(playback));
  const shown = all.filter((line) => !wanted || line.module.toLowerCase().includes(wanted) || line.text.toLowerCase().includes(wanted));
  const choose = (step) => {
    const place = shown.findIndex(({ sequence }) => sequence === chosen);
    setPaused(true);
    setChosen(shown[Math.max(0, Math.min(shown.length - 1, place < 0 ? shown.length - 1 : place + step))]?.sequence ?? null);
  };
  const line = shown.find(({ sequence }) => sequence === chosen);
  const key = (event) => {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (step) choose(step);
    else if (event.key === "Enter" && line) jump(line.time);
    else return;
    event.preventDefault();
  };
  // All panels show that time, if the agent keeps it.
  const jump = async (when) => {
    try {
      setProblem(null);
      const { values } = await get(`${at(agent.name, "loop/state", "history")}?to=${when}&limit=1`);
      if (!values.length) throw new Problem(0, `${time(when)} is no longer in the flight recorder`, "the history begins at the left end of the slider below");
      setPaused(true);
      lookBack(agent.name, when);
    } catch (error) {
      if (!(error instanceof Problem)) throw error;
      setProblem(error);
    }
  };
  const later = moment === null ? -1 : shown.findIndex((line) => line.time > moment);
  const mark = html`<tr class="looked-at" key="looked-at"><td colspan="4">${isStill ? `Time shown: ${time(moment)}${later < 0 ? "" : "; later messages follow"}` : "Later messages follow"}</td></tr>`;
  // Scrolling back pauses the log.
  const scrolled = ({ target }) => setPaused(target.scrollHeight - target.scrollTop - target.clientHeight > 30);
  return html`
    <div class="bar-of-tools">
      <input type="search" placeholder="Search" aria-label="Search in the log" value=${text} onInput=${(event) => setText(event.target.value)} />
      <select aria-label="Minimum level" value=${level} onChange=${(event) => setOptions({ level: event.target.value })}>
        ${LEVELS.map((name) => html`<option key=${name} value=${name}>${name}</option>`)}</select>
      ${line && html`<button title="Show this time in all panels (Enter)" onClick=${() => jump(line.time)}>Go to ${time(line.time)}</button>`}
      ${paused && html`<button onClick=${() => { setPaused(false); setChosen(null); }}>Follow</button>`}
    </div>
    <${Trouble} problem=${problem} />
    <div class="scroll" ref=${scroll} onScroll=${scrolled} onKeyDown=${key} role="log" aria-live="off" aria-label="Log" tabindex="0">
      ${lines && !shown.length && html`<${Empty}>${all.length ? "No message matches." : "No message of this level yet."}</${Empty}>`}
      <table class="log"><tbody>
        ${shown.map((line, place) => html`${place === later && mark}<tr key=${line.sequence} data-level=${line.level.toLowerCase()} data-later=${moment !== null && line.time > moment ? "true" : undefined} aria-selected=${line.sequence === chosen ? "true" : undefined} onClick=${() => { setPaused(true); setChosen(line.sequence); }} onDblClick=${() => jump(line.time)}>
          <td class="muted">${time(line.time)}</td><td>${line.level.toLowerCase()}</td><td>${line.module}</td><td>${line.text}${line.dropped ? ` (${line.dropped} more dropped)` : ""}</td></tr>`)}${isStill && later < 0 && mark}
      </tbody></table>
    </div>`;
}

export default { id: "log", title: "Log", Panel };

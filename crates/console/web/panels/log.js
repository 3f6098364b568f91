// The lines of the log, as they come.
import { at, Empty, get, html, Problem, time, Trouble, useAgent, useEffect, useRef, useState } from "/slate.js";
import { lookBack } from "/live.js";

const LEVELS = ["error", "warn", "info", "debug", "trace"];
const MOST = 2000;

function Panel({ options, setOptions }) {
  const [lines, setLines] = useState(null);
  const [text, setText] = useState("");
  const [paused, setPaused] = useState(false);
  const scroll = useRef(null);
  const [problem, setProblem] = useState(null);
  const [chosen, setChosen] = useState(null);
  const agent = useAgent();
  const level = options.level ?? "info";
  useEffect(() => {
    let [after, ended, timer] = [null, false, 0];
    setLines(null);
    // A line seldom comes alone, so they are asked for together.
    const more = async () => {
      try {
        const fresh = await get(`/log?level=${level}${after === null ? "" : `&after=${after}`}`);
        if (ended) return;
        if (fresh.length) after = fresh.at(-1).sequence;
        setLines((before) => (fresh.length || before === null ? [...(before ?? []), ...fresh].slice(-MOST) : before));
      } catch {
        // The banner says what is wrong; it goes on when that is over.
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
    if (!paused && scroll.current) scroll.current.scrollTop = scroll.current.scrollHeight;
  });
  const wanted = text.toLowerCase();
  const shown = (lines ?? []).filter((line) => !wanted || line.module.toLowerCase().includes(wanted) || line.text.toLowerCase().includes(wanted));
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
  // Every panel shows what was then, if the agent keeps it.
  const jump = async (when) => {
    try {
      setProblem(null);
      const { values } = await get(`${at(agent.name, "loop/state", "history")}?to=${when}&limit=1`);
      if (!values.length) throw new Problem(0, `${time(when)} is not kept any more`, "what is kept begins at the left end of the bar below");
      setPaused(true);
      lookBack(agent.name, when);
    } catch (error) {
      if (!(error instanceof Problem)) throw error;
      setProblem(error);
    }
  };
  // Who scrolls back wants to read.
  const scrolled = ({ target }) => setPaused(target.scrollHeight - target.scrollTop - target.clientHeight > 30);
  return html`
    <div class="bar-of-tools">
      <input type="search" placeholder="Search" aria-label="Search in the log" value=${text} onInput=${(event) => setText(event.target.value)} />
      <select aria-label="Least level" value=${level} onChange=${(event) => setOptions({ level: event.target.value })}>
        ${LEVELS.map((name) => html`<option key=${name} value=${name}>${name}</option>`)}</select>
      ${line && html`<button title="All panels show what was then (Enter)" onClick=${() => jump(line.time)}>Look back at ${time(line.time)}</button>`}
      ${paused && html`<button onClick=${() => { setPaused(false); setChosen(null); }}>Follow</button>`}
    </div>
    <${Trouble} problem=${problem} />
    <div class="scroll" ref=${scroll} onScroll=${scrolled} onKeyDown=${key} role="log" aria-live="off" aria-label="Log" tabindex="0">
      ${lines && !shown.length && html`<${Empty}>${lines.length ? "No line has that." : "No line yet of this level."}</${Empty}>`}
      <table class="log"><tbody>
        ${shown.map((line) => html`<tr key=${line.sequence} data-level=${line.level.toLowerCase()} aria-selected=${line.sequence === chosen ? "true" : undefined} onClick=${() => { setPaused(true); setChosen(line.sequence); }} onDblClick=${() => jump(line.time)}>
          <td class="muted">${time(line.time)}</td><td>${line.level.toLowerCase()}</td><td>${line.module}</td><td>${line.text}${line.dropped ? ` (${line.dropped} more dropped)` : ""}</td></tr>`)}
      </tbody></table>
    </div>`;
}

export default { id: "log", title: "Log", Panel };

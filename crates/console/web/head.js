// The head of the page: agent, connection, layouts.
import { html, useEffect, useRef, useState } from "/lib/preact.js";
import { clock, isPast, useReading } from "/live.js";
import { time, word } from "/format.js";
import { useOver, usePlayback, useProperties } from "/store.js";
import { toggleTheme } from "/theme.js";
import { copy, nameOf, write } from "/layouts.js";
import { Problem, get, isRecorded, put } from "/api.js";
import { Dialog } from "/dialog.js";

// Only the digits change often.
function Clock() {
  const [text, setText] = useState("");
  useReading("loop/state", 2);
  useEffect(() => {
    const timer = setInterval(() => setText(time(clock.now)), 100);
    return () => clearInterval(timer);
  }, []);
  return html`<span class="clock" title="The agent's time">${text}</span>`;
}

function Verdict({ path, isNamed }) {
  const verdict = useReading(path, 5)?.value;
  if (!verdict) return null;
  const mark = { RUNNING: "▸", SUCCEEDED: "✓", FAILED: "✕" }[verdict.state] ?? "·";
  // Why a mission has failed comes first: it may have done its task.
  const outcome = verdict.state === "FAILED" && verdict.outcome !== "OTHER" ? `${word(verdict.outcome)}: ` : "";
  return html`<span class="chip" data-state=${verdict.state} title=${`/${path}`}>${mark} ${isNamed ? `${path.split("/")[0]}: ` : ""}${outcome}${verdict.reason || word(verdict.state)}</span>`;
}

function Layouts({ view, layout, layouts, built, change, saved, show }) {
  const [note, setNote] = useState("");
  // Questions use a dialog of the page, because a browser dialog would block the stop.
  const [dialog, setDialog] = useState(null);
  const close = () => setDialog(null);
  const tell = (text) => {
    setNote(text);
    setTimeout(() => setNote(""), 4000);
  };
  const share = async () => {
    const link = `${location.href.replace(/#.*/, "")}#view=${view.name}&layout=${write(layout)}`;
    try {
      await navigator.clipboard.writeText(link);
      tell("Link copied (without a token)");
    } catch {
      setDialog({ link });
    }
  };
  const save = async (event) => {
    event.preventDefault();
    const title = new FormData(event.target).get("title").trim();
    setDialog(null);
    if (!title) return;
    const own = { ...copy(layout), title };
    try {
      const name = nameOf(title, { ...built, ...(await get("/layouts")) });
      await put(`/layouts/${name}`, own);
      saved(name, own);
      tell(`Saved as console/layouts/${name}.json`);
    } catch (problem) {
      if (!(problem instanceof Problem)) throw problem;
      tell(problem.message);
    }
  };
  return html`<span class="layouts">
    ${note && html`<span role="status" class="muted">${note}</span>`}
    ${view.layout && html`<button class="quiet" onClick=${() => show(view.name)} title="Discard the changes of this layout">Reset layout</button>`}
    <button class="quiet" onClick=${share} title="Copy a link to this layout">Link</button>
    ${!isRecorded && html`<button class="quiet" onClick=${() => setDialog({ title: view.name in built ? "" : layout.title })} title="Save this layout in the project">Save</button>`}
    ${dialog && html`<${Dialog} label=${dialog.link ? "Link to this layout" : "Save layout"} kind="saving" close=${close}>
      ${dialog.link ? html`<label>A link to this layout, without a token<input readonly data-first value=${dialog.link} onFocus=${(event) => event.target.select()} /></label>`
      : html`<form class="saving" onSubmit=${save}><label>Layout name<input name="title" data-first autocomplete="off" required defaultValue=${dialog.title} /></label>
        <div><button class="primary">Save</button><button type="button" onClick=${close}>Cancel</button></div></form>`}</${Dialog}>`}
  </span>`;
}

/** The head of the page. */
export function Head(properties) {
  const { agent, state, view, layouts, show, help, find } = properties;
  const bar = useRef(null);
  // A narrow bar scrolls to the current layout.
  useEffect(() => bar.current?.querySelector("[aria-current]")?.scrollIntoView({ block: "nearest", inline: "center" }), [view.name]);
  const verdicts = useProperties().filter(({ interface: name }) => name === "Verdict");
  const names = { live: "Live", connecting: "Connecting", silent: "No answer", lost: "No connection" };
  const isPlayed = Boolean(usePlayback());
  const isOver = Boolean(useOver());
  const isBack = state === "live" && (isPast() || isPlayed);
  return html`<header class="head">
    <div class="title">
      <img src=${document.getElementById("icon").href} alt="" width="28" height="28" />
      <h1>${agent?.name ?? "Slate"}</h1>
      <span class="connection" data-state=${isBack ? "past" : isOver ? "over" : state}>${isBack ? (isPlayed ? "Playback" : "History") : isOver ? "Run ended" : names[state]}</span>
      <${Clock} />
      ${verdicts.map(({ path }) => html`<${Verdict} key=${path} path=${path} isNamed=${verdicts.length > 1} />`)}
      <span class="grow"></span>
      <${Layouts} ...${properties} />
      <button class="quiet" onClick=${find} title="Find layouts, panels, properties and commands (Ctrl K)">Find</button>
      <button class="quiet" onClick=${toggleTheme} title="Switch between dark and light" aria-label="Switch between dark and light">◐</button>
      <button class="quiet" onClick=${help} title="Keyboard shortcuts (?)" aria-label="Keyboard shortcuts">?</button>
    </div>
    <nav aria-label="Layouts" ref=${bar}>
      ${Object.entries(layouts).map(([name, { title }]) =>
        html`<a key=${name} href=${`#view=${name}`} aria-current=${view.name === name ? "page" : undefined}>${title}</a>`)}
    </nav>
  </header>`;
}

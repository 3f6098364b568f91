// The page: head, choice of the layout, tiles.
import { html, render, useEffect, useMemo, useState } from "/lib/preact.js";
import { get, giveToken, offered, panels as panelModules, Problem, token } from "/api.js";
import { connect, connection, onConnection } from "/live.js";
import { BUILT_IN, isFit, read, withPanel, write } from "/layouts.js";
import { follow, reloadAll, useAgent } from "/store.js";
import { Head } from "/head.js";
import { Help } from "/help.js";
import { Palette } from "/palette.js";
import { Banner } from "/banner.js";
import { Bar } from "/bar.js";
import { openedBy } from "/open.js";
import { Workspace } from "/workspace.js";
import { forgetHistories } from "/history.js";
import { keep } from "/keep.js";
import { forget } from "/map/trails.js";
import { isOver } from "/stop.js";
import { select } from "/selection.js";

const built = offered(BUILT_IN);
const panels = new Map();
const broken = [];

// A panel of the project replaces a built-in one with the same id.
async function loadPanels() {
  const paths = await panelModules();
  const loaded = await Promise.allSettled(paths.map((path) => import(path)));
  loaded.forEach(({ value, reason }, place) => {
    const panel = value?.default;
    if (panel?.id && panel.title && panel.Panel) panels.set(panel.id, panel);
    else broken.push(`${paths[place]}: ${reason ?? "it must export { id, title, Panel } as default"}`);
  });
  broken.forEach((text) => console.error(text));
}

const settings = () => new URLSearchParams(location.hash.slice(1));

// The layout that the link requests, by content or by name.
function wanted() {
  const given = settings();
  const layout = given.get("layout") ? read(given.get("layout")) : null;
  if (given.get("select")) select(given.get("select"));
  return { name: given.get("view") ?? "overview", layout };
}

function Asking({ problem }) {
  const [text, setText] = useState("");
  const enter = (event) => {
    event.preventDefault();
    giveToken(text);
    location.reload();
  };
  return html`<main class="asking"><form onSubmit=${enter}>
    <h1>Slate</h1>
    <p>${problem ? "The token is invalid; each run has a new one." : "The agent requires a token."} The agent prints a link with its token at the start:</p>
    <pre>console: ${location.origin}/#token=…</pre>
    <label>Link or token <input autofocus autocomplete="off" spellcheck="false" value=${text} onInput=${(event) => setText(event.target.value)} /></label>
    <button class="primary" disabled=${!text.trim()}>Open</button>
  </form></main>`;
}

function useConnection() {
  const [, redraw] = useState(0);
  useEffect(() => onConnection(() => redraw((count) => count + 1)), []);
  return connection.state;
}

function App() {
  const state = useConnection();
  const agent = useAgent();
  const [saved, setSaved] = useState({});
  const [view, setView] = useState(wanted);
  const [help, setHelp] = useState(false);
  const [finds, setFinds] = useState(false);
  const [run, setRun] = useState(null);
  const [isOther, setIsOther] = useState(false);
  const all = useMemo(() => ({ ...built, ...saved }), [saved]);
  const layout = view.layout ?? all[view.name] ?? built.overview;

  useEffect(() => follow("/layouts", ({ value }) => value && setSaved(Object.fromEntries(Object.entries(value).filter(([, it]) => isFit(it))))), []);
  useEffect(() => {
    // A link with a token belongs to another run.
    const changed = () => (settings().has("token") ? location.reload() : setView(wanted()));
    addEventListener("hashchange", changed);
    return () => removeEventListener("hashchange", changed);
  }, []);
  useEffect(() => {
    if (state === "live") reloadAll();
  }, [state]);
  useEffect(() => {
    if (!agent?.run || agent.run === run) return;
    setRun(agent.run);
    if (run === null) return;
    forget();
    forgetHistories();
    isOver(true);
    setIsOther(true);
  }, [agent?.run]);
  useEffect(() => {
    document.title = agent ? `${agent.stopped ? "■ " : ""}${agent.name} · ${layout.title}` : "Slate";
  }, [agent?.name, agent?.stopped, layout.title]);

  const show = (name) => {
    history.pushState(null, "", `#view=${name}`);
    setView({ name, layout: null });
    scrollTo(0, 0);
  };
  const change = (layout) => {
    history.replaceState(null, "", `#view=${view.name}&layout=${write(layout)}`);
    setView({ name: view.name, layout });
  };

  openedBy((panel, options) => change(withPanel(layout, panel, options)));

  useEffect(() => {
    // `g` and a letter opens a layout; keys in a text field are text.
    let goes = 0;
    const press = (event) => {
      if (event.key.toLowerCase() === "k" && (event.ctrlKey || event.metaKey) && !event.altKey && !event.shiftKey) {
        event.preventDefault();
        setFinds(true);
        return;
      }
      const inField = event.target.closest?.("input, textarea, select, [contenteditable]");
      if (inField || event.ctrlKey || event.metaKey || event.altKey) return;
      if (performance.now() - goes < 1200) {
        // Of several layouts with that letter, the next one.
        const found = Object.keys(all).filter((name) => name.startsWith(event.key));
        goes = 0;
        if (found.length) show(found[(found.indexOf(view.name) + 1) % found.length]);
      } else if (event.key === "g") goes = performance.now();
      else if (event.key === "?") setHelp((shown) => !shown);
      else if (event.key === "b") document.getElementById("mark")?.click();
      else if (event.key === "/") {
        const field = document.querySelector("input[type=search]");
        if (field) {
          event.preventDefault();
          field.focus();
        }
      }
    };
    addEventListener("keydown", press);
    return () => removeEventListener("keydown", press);
  }, [all, view.name]);

  return html`
    <a class="skip" href="#content" onClick=${(event) => { event.preventDefault(); document.getElementById("content").focus(); }}>Skip to the panels</a>
    <${Head} agent=${agent} state=${state} view=${view} layout=${layout} layouts=${all} built=${built} show=${show}
      change=${change} saved=${(name, layout) => { setSaved({ ...saved, [name]: layout }); show(name); }} help=${() => setHelp(true)} find=${() => setFinds(true)} />
    <${Banner} agent=${agent} state=${state} broken=${broken} isOther=${isOther} seen=${() => setIsOther(false)} />
    <${Workspace} key=${view.name} layout=${layout} panels=${panels} change=${change} />
    <${Bar} agent=${agent} />
    ${finds && html`<${Palette} agent=${agent} layouts=${all} panels=${panels} show=${show} help=${() => setHelp(true)} close=${() => setFinds(false)} />`}
    ${help && html`<${Help} layouts=${all} close=${() => setHelp(false)} />`}`;
}

async function begin() {
  const root = document.getElementById("app");
  let problem = null;
  if (token()) {
    try {
      await Promise.all([get("/agent"), loadPanels()]);
    } catch (error) {
      if (!(error instanceof Problem)) throw error;
      problem = error;
    }
  }
  root.replaceChildren();
  if (!token() || problem?.status === 401) return render(html`<${Asking} problem=${problem} />`, root);
  connect();
  keep();
  render(html`<${App} />`, root);
}

begin();

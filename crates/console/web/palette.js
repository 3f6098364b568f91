// Search by name: layouts, panels, properties and commands.
import { html, useEffect, useMemo, useRef, useState } from "/lib/preact.js";
import { post, Problem, put } from "/api.js";
import { Dialog } from "/dialog.js";
import { openPanel } from "/open.js";
import { select } from "/selection.js";
import { reload, useInterfaces, useProperties, useResource } from "/store.js";
import { numbers } from "/schema.js";
import { stop } from "/stop.js";
import { toggleTheme } from "/theme.js";
import { Trouble } from "/parts.js";

const MOST = 40;

/** Rank of a name of a kind for some words, the best is the least; null if a word is missing. */
function fit(words, kind, name) {
  const low = name.toLowerCase();
  let sum = 0;
  for (const word of words) {
    // A kind matches by its beginning only.
    if (kind.toLowerCase().startsWith(word)) continue;
    const place = low.indexOf(word);
    if (place < 0) return null;
    // The beginning of a word ranks above its middle.
    sum += place === 0 || /[^a-z0-9]/.test(low[place - 1]) ? 0 : 20;
  }
  return sum + name.length / 10;
}

/** A dialog that finds everything by a few letters. */
export function Palette({ agent, layouts, panels, show, help, close }) {
  const list = useRef(null);
  const properties = useProperties();
  const interfaces = useInterfaces();
  const modules = useResource("/modules", 5) ?? [];
  const [text, setText] = useState("");
  const [place, setPlace] = useState(0);
  const [problem, setProblem] = useState(null);
  // Another tool may have changed a module.
  useEffect(() => reload("/modules"), []);
  const isAllowed = agent && agent.role !== "viewer";
  const arm = async () => {
    await post("/arm", {});
    reload("/agent", "/actuators");
  };
  const enable = (name, enabled) => async () => {
    await put(`/modules/${encodeURIComponent(name).replaceAll("%2F", "/")}`, { enabled });
    reload("/modules");
  };
  const all = useMemo(() => [
    ...Object.entries(layouts).map(([name, { title }]) => ({ kind: "Layout", name: title, act: () => show(name) })),
    ...[...panels.values()].map(({ id, title }) => ({ kind: "Panel", name: title, act: () => openPanel(id) })),
    { kind: "Action", name: "Stop all actuators", act: stop },
    { kind: "Action", name: "Switch between dark and light", act: toggleTheme },
    { kind: "Action", name: "Keyboard shortcuts", act: help },
    ...(isAllowed ? [{ kind: "Action", name: "Arm all actuators", act: arm }] : []),
    ...(agent?.role === "developer" ? modules.map(({ name, condition }) => ({ kind: "Action", name: `Switch ${name} ${condition === "INACTIVE" ? "on" : "off"}`, act: enable(name, condition === "INACTIVE") })) : []),
    ...properties.map(({ path, doc }) => ({ kind: "Property", name: path, doc, act: () => (select(path), show("inspect")) })),
    ...properties.filter(({ access }) => access === "output").flatMap(({ path, interface: name }) => numbers(interfaces[name]).map(({ pointer, unit }) => ({ kind: "Plot", name: `${path}${pointer}`, doc: unit, act: () => openPanel("plot", { series: [`${path}${pointer}`] }) }))),
  ], [layouts, panels, properties, interfaces, modules, agent?.role]);
  const words = text.toLowerCase().split(/\s+/).filter(Boolean);
  const found = all
    .map((one) => ({ ...one, score: fit(words, one.kind, one.name) }))
    .filter(({ score }) => score !== null)
    .sort((one, other) => (words.length ? one.score - other.score : 0))
    .slice(0, MOST);
  const chosen = Math.min(place, found.length - 1);
  useEffect(() => list.current?.children[chosen]?.scrollIntoView({ block: "nearest" }), [chosen, text]);
  const act = async (one) => {
    try {
      await one.act();
      close();
    } catch (error) {
      if (!(error instanceof Problem)) throw error;
      setProblem(error);
    }
  };
  const key = (event) => {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (step) setPlace(Math.max(0, Math.min(found.length - 1, chosen + step)));
    else if (event.key === "Enter" && found[chosen]) act(found[chosen]);
    else return;
    event.preventDefault();
  };
  return html`<${Dialog} label="Find" kind="palette" close=${close}>
    <input type="search" data-first autocomplete="off" spellcheck="false" placeholder="Layout, panel, property or command" role="combobox" aria-expanded="true" aria-controls="found" aria-label="Find"
      aria-activedescendant=${found.length ? `found-${chosen}` : undefined} value=${text} onInput=${(event) => { setText(event.target.value); setPlace(0); }} onKeyDown=${key} />
    <${Trouble} problem=${problem} />
    <ul id="found" role="listbox" aria-label="Found" ref=${list}>${found.map((one, own) => html`<li key=${`${one.kind} ${one.name}`} id=${`found-${own}`} role="option" aria-selected=${own === chosen} onClick=${() => act(one)} title=${one.doc}>
      <span>${one.name}</span><small>${one.kind}${one.kind === "Plot" && one.doc ? `, ${one.doc}` : ""}</small></li>`)}</ul>
    ${!found.length && html`<p class="empty">No match.</p>`}
  </${Dialog}>`;
}

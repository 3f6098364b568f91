// States over time: routes, gates, missions, and all other enumerations.
import { Empty, html, leaves, useInterfaces, useMemo, useProperties, useState } from "/slate.js";
import { Strip } from "/strip.js";

const SPANS = { 30: "30 s", 60: "1 min", 300: "5 min" };
const USUAL = { ExecuteStatus: "/route", Verdict: "/state", GateState: "/priority" };

const title = ({ path, pointer }) => `${path}${pointer}`;

function Panel({ options, setOptions }) {
  const properties = useProperties();
  const interfaces = useInterfaces();
  const [text, setText] = useState("");
  const choices = useMemo(
    () => properties.filter(({ access }) => access === "output").flatMap(({ path, interface: name }) =>
      leaves(interfaces[name]).filter(({ type }) => type === "enumeration").map(({ pointer, schema }) => ({ path, pointer, usual: USUAL[name] === pointer, values: schema.anyOf[0].enum }))),
    [properties, interfaces],
  );
  const chosen = options.states ?? choices.filter(({ usual }) => usual).map(title);
  const shown = chosen.map((name) => choices.find((choice) => title(choice) === name)).filter(Boolean);
  const seconds = options.seconds ?? 60;
  const add = (event) => {
    event.preventDefault();
    if (!choices.some((choice) => title(choice) === text)) return;
    setOptions({ states: [...new Set([...chosen, text])] });
    setText("");
  };
  return html`
    <div class="bar-of-tools">
      <form class="grow" onSubmit=${add}><input list="states" placeholder="Add a state, such as r2/wheels/gate/mode" aria-label="Add a state" autocomplete="off" value=${text} onInput=${(event) => setText(event.target.value)} onChange=${add} /></form>
      <datalist id="states">${choices.map((choice) => html`<option key=${title(choice)} value=${title(choice)} />`)}</datalist>
      <select aria-label="Time span" value=${seconds} onChange=${(event) => setOptions({ seconds: Number(event.target.value) })}>
        ${Object.entries(SPANS).map(([value, name]) => html`<option key=${value} value=${value}>${name}</option>`)}</select>
    </div>
    <div class="scroll states" tabindex="0" role="group" aria-label="States">
      ${shown.map((choice) => html`<section key=${title(choice)}><header><h3>${title(choice)}</h3>
        <button class="quiet" aria-label=${`Remove ${title(choice)}`} onClick=${() => setOptions({ states: chosen.filter((name) => name !== title(choice)) })}>✕</button></header>
        <${Strip} ...${choice} seconds=${seconds} name=${choice.pointer.slice(1)} /></section>`)}
      ${!shown.length && html`<${Empty}>No state selected, or this agent has none.</${Empty}>`}
    </div>`;
}

export default { id: "states", title: "States", Panel };

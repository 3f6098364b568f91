// All properties with value, age and rate.
import { Age, brief, Empty, hertz, html, select, useInterfaces, useRates, useResource, useSelected, useState } from "/slate.js";

// Properties of every module, hidden by default.
const USUAL = /\/(enabled|histogram|state|timing)$/;

/** The visible rows of a tree of folders and properties. */
function rows(properties, isOpen) {
  const found = [];
  const seen = new Set();
  for (const property of properties) {
    const parts = property.path.split("/");
    let hidden = false;
    for (let depth = 1; depth < parts.length && !hidden; depth += 1) {
      const path = parts.slice(0, depth).join("/");
      if (!seen.has(path)) found.push({ path, name: parts[depth - 1], depth, isFolder: true });
      seen.add(path);
      hidden = !isOpen(path);
    }
    if (!hidden) found.push({ path: property.path, name: parts.at(-1), depth: parts.length, property });
  }
  return found;
}

function Row({ row, open, toggle, rate, schema, isSelected, isFirst }) {
  const { path, name, depth, property, isFolder } = row;
  const act = () => (isFolder ? toggle(path) : select(path));
  const key = (event) => {
    const rows = [...event.currentTarget.closest("[role=treegrid]").querySelectorAll("[role=row][tabindex]")];
    const place = rows.indexOf(event.currentTarget);
    const go = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (go) rows[place + go]?.focus();
    else if (event.key === "Enter" || event.key === " ") act();
    else if (isFolder && ((event.key === "ArrowRight" && !open) || (event.key === "ArrowLeft" && open))) toggle(path);
    else return;
    event.preventDefault();
  };
  return html`<tr role="row" tabindex=${isFirst || isSelected ? 0 : -1} aria-level=${depth} aria-expanded=${isFolder ? open : undefined} aria-selected=${isSelected} data-path=${path} onClick=${act} onKeyDown=${key} title=${property?.doc}>
    <th role="rowheader" scope="row" style=${{ paddingLeft: `${depth * 14 - 4}px` }}><span class="twist" aria-hidden="true">${isFolder ? (open ? "▾" : "▸") : ""}</span>${name}</th>
    <td role="gridcell" class="value">${property && (property.access === "messages" ? html`<span class="muted">inbox</span>` : property.value === undefined ? html`<span class="muted">${property.sequence ? "large" : "none yet"}</span>` : brief(property.value, schema))}</td>
    <td role="gridcell" class="number">${property?.time !== undefined && html`<${Age} time=${property.time} />`}</td>
    <td role="gridcell" class="number">${property ? hertz(rate) : ""}</td>
    <td role="gridcell" class="muted">${property?.interface}</td></tr>`;
}

function Panel({ options, setOptions }) {
  const properties = useResource("/properties?values", 1);
  const interfaces = useInterfaces();
  const selected = useSelected();
  const [text, setText] = useState("");
  const [closed, setClosed] = useState(() => new Set());
  const rates = useRates(properties ?? []);
  const wanted = text.toLowerCase().split(/\s+/).filter(Boolean);
  // Parameters are fields of a property of their module.
  const parameters = ({ path, access, interface: name }) => (access === "setting" ? Object.keys(interfaces[name]?.properties ?? {}).map((field) => `${path}/${field}`) : []);
  const fits = (property) => wanted.every((part) => [property.path, property.interface, ...parameters(property)].some((text) => text.toLowerCase().includes(part)));
  const shown = (properties ?? []).filter((property) => (options.usual || wanted.length || !USUAL.test(property.path)) && fits(property));
  const isOpen = (path) => wanted.length > 0 || !closed.has(path);
  const toggle = (path) => setClosed((before) => {
    const after = new Set(before);
    if (!after.delete(path)) after.add(path);
    return after;
  });
  if (!properties) return html`<${Empty}>Waiting for the agent.</${Empty}>`;
  return html`
    <div class="bar-of-tools">
      <input type="search" placeholder="Path, parameter or interface" aria-label="Search for properties" value=${text} onInput=${(event) => setText(event.target.value)} />
      <label><input type="checkbox" checked=${options.usual === true} onChange=${(event) => setOptions({ usual: event.target.checked })} /> Show state and timing of modules</label>
      <span class="muted">${shown.length} of ${properties.length}</span>
    </div>
    <div class="scroll"><table role="treegrid" aria-label="Properties" class="tree">
      <thead><tr role="row"><th role="columnheader">Property</th><th role="columnheader">Value</th><th role="columnheader" class="number">Age</th><th role="columnheader" class="number">Rate</th><th role="columnheader">Interface</th></tr></thead>
      <tbody>${rows(shown, isOpen).map((row, place) => html`<${Row} key=${row.path} row=${row} open=${isOpen(row.path)} toggle=${toggle} rate=${rates.get(row.path)}
        schema=${interfaces[row.property?.interface]} isSelected=${row.path === selected} isFirst=${place === 0} />`)}</tbody></table>
      ${!shown.length && html`<${Empty}>No property matches.</${Empty}>`}
    </div>`;
}

export default { id: "tree", title: "Properties", Panel };

// Modules, gates and the links between them, with how much goes over each. A link is made by dragging from a module to another
// one, or in the list of inputs; whether it fits is found out before it is made.
import { Empty, html, Problem, put, reload, remove, select, Trouble, useAgent, useEffect, useMemo, useRef, useResource, useSize, useState, word } from "/slate.js";
import { moduleOf } from "/blocks.js";
import { layers } from "/graph/layout.js";

const [WIDTH, HEIGHT] = [158, 38];
// How far nodes are from each other at least and at most.
const ACROSS = [196, 270];
const DOWN = [52, 96];

const between = ([least, most], wanted) => Math.min(most, Math.max(least, wanted));

const enc = (path) => path.split("/").map(encodeURIComponent).join("/");

/** How often each property is written, Hz. */
function useRates(properties) {
  const before = useRef({ when: 0, sequences: new Map(), rates: new Map() });
  return useMemo(() => {
    const now = performance.now();
    const last = before.current;
    const seconds = (now - last.when) / 1000;
    const rates = seconds > 0.5 ? new Map() : last.rates;
    if (seconds > 0.5) {
      for (const { path, sequence } of properties) {
        if (last.sequences.has(path)) rates.set(path, Math.max(0, sequence - last.sequences.get(path)) / seconds);
      }
      before.current = { when: now, sequences: new Map(properties.map(({ path, sequence }) => [path, sequence])), rates };
    }
    return rates;
  }, [properties]);
}

/** Nodes, and edges with all the links between the same two. */
function made(modules, properties, links, actuators, hidden) {
  const fits = (name) => !hidden.some((part) => name.includes(part));
  const gates = actuators.map(({ name }) => name);
  const names = [...modules.map(({ name }) => name), ...gates].filter(fits);
  const mailboxes = new Set(properties.filter(({ access }) => access === "messages").map(({ path }) => path));
  const found = new Map();
  const add = (from, to, link) => {
    if (!from || !to) return;
    const key = `${from} ${to}`;
    if (!found.has(key)) found.set(key, { from, to, links: [] });
    found.get(key).links.push(link);
  };
  for (const link of links) {
    const source = link.from.replace(/^\//, "");
    const [from, to] = [moduleOf(source, names), moduleOf(link.to, names)];
    // Messages go the other way: from who sends them to the mailbox.
    if (mailboxes.has(source)) add(to, from, { ...link, source, sends: true });
    else add(from, to, { ...link, source, sends: false });
  }
  for (const { name } of actuators) {
    const robot = name.split("/")[0];
    const command = properties.find(({ path, interface: kind, access }) => access === "output" && path.startsWith(`${robot}/execute`) && path.endsWith(`/${name.split("/").at(-1)}`) && kind !== "ExecuteStatus");
    if (command) add(moduleOf(command.path, names), name, { to: name, from: `/${command.path}`, source: command.path, sends: false });
  }
  return { names, gates: new Set(gates), edges: [...found.values()] };
}

/** Makes a link, after it was found out whether it fits. */
function Relink({ input, from, sources, done, isAllowed }) {
  const [source, setSource] = useState(from);
  const [checked, setChecked] = useState(null);
  useEffect(() => setSource(from), [from, input]);
  useEffect(() => {
    setChecked(null);
    if (!source || !isAllowed) return undefined;
    let ended = false;
    put(`/links/${enc(input)}?dry_run`, { from: source }).then(
      () => !ended && setChecked({ fits: true }),
      (problem) => {
        if (!(problem instanceof Problem)) throw problem;
        if (!ended) setChecked({ problem });
      },
    );
    return () => (ended = true);
  }, [input, source]);
  const act = async (work) => {
    try {
      await work();
      reload("/links", "/properties", "/settings/differences");
      done();
    } catch (problem) {
      if (!(problem instanceof Problem)) throw problem;
      setChecked({ problem });
    }
  };
  return html`<div class="relink">
    <p><b>${input}</b> <span class="muted">reads</span></p>
    <select aria-label=${`Source of ${input}`} value=${source} onChange=${(event) => setSource(event.target.value)} disabled=${!isAllowed}>
      <option value="">nothing</option>${!sources.includes(source) && source && html`<option value=${source}>${source}</option>`}
      ${sources.map((path) => html`<option key=${path} value=${path}>${path}</option>`)}</select>
    <p role="status" class="muted">${!isAllowed ? "A developer changes links." : checked?.fits ? "✓ It fits." : ""}</p>
    <${Trouble} problem=${checked?.problem} />
    ${isAllowed && html`<p><button class="primary" disabled=${!checked?.fits} onClick=${() => act(() => put(`/links/${enc(input)}`, { from: source }))}>Link</button>
      <button disabled=${!from} onClick=${() => act(() => remove(`/links/${enc(input)}`))}>Take the link away</button> <button onClick=${done}>Cancel</button></p>`}</div>`;
}

function Panel({ options, setOptions }) {
  const agent = useAgent();
  const modules = useResource("/modules", 2);
  const properties = useResource("/properties", 2) ?? [];
  const links = useResource("/links", 3) ?? [];
  const actuators = useResource("/actuators", 5) ?? [];
  const [chosen, setChosen] = useState("");
  const [editing, setEditing] = useState(null);
  const [drag, setDrag] = useState(null);
  const drawing = useRef(null);
  const [box, size] = useSize();
  const rates = useRates(properties);
  const hidden = (options.hide ?? "").split(/\s+/).filter(Boolean);
  const structure = JSON.stringify([modules?.map(({ name }) => name), links.map(({ to, from }) => [to, from]), actuators.map(({ name }) => name), hidden]);
  const graph = useMemo(() => made(modules ?? [], properties, links, actuators, hidden), [structure, properties.length]);
  const placed = useMemo(() => {
    // Who sends to a module is before it, and what it hears back closes a loop.
    const sent = new Set(graph.edges.filter(({ links }) => links.some(({ sends }) => sends)).map(({ from, to }) => `${from} ${to}`));
    const onward = graph.edges.filter(({ from, to }) => !sent.has(`${to} ${from}`) || sent.has(`${from} ${to}`));
    const rows = layers(graph.names, onward.map(({ from, to }) => [from, to]));
    const most = Math.max(1, ...rows.map((layer) => layer.length));
    const across = between(ACROSS, ((size?.width ?? 0) - WIDTH - 32) / Math.max(1, rows.length - 1));
    const down = between(DOWN, ((size?.height ?? 0) - 40) / most);
    const places = new Map(rows.flatMap((layer, column) => layer.map((name, row) => [name, { x: 16 + column * across, y: 16 + (row + (most - layer.length) / 2) * down }])));
    return { places, width: 32 + (rows.length - 1) * across + WIDTH, height: 24 + most * down };
  }, [graph, size?.width, size?.height]);
  if (!modules) return html`<${Empty}>Waiting for the agent.</${Empty}>`;
  const isAllowed = agent?.role === "developer";
  const conditions = new Map(modules.map((module) => [module.name, module]));
  const hertz = (path) => (rates.has(path) ? `${rates.get(path).toFixed(0)} Hz` : "");
  const rate = ({ links }) => (links.length > 1 ? `${links.length} links` : hertz(links[0].sends ? links[0].to : links[0].source));
  const trouble = ({ links }) => links.find(({ trouble, evicted }) => trouble || evicted);
  const settings = properties.filter(({ access, path }) => access === "setting" && !/\/(params|enabled)$/.test(path)).map(({ path }) => path);
  const inputsOf = (module) => [...new Set([...links.map(({ to }) => to), ...settings])].filter((path) => moduleOf(path, graph.names) === module).sort();
  const sources = properties.filter(({ access }) => access !== "setting").map(({ path }) => `/${path}`);
  const outputsOf = (module) => sources.filter((path) => moduleOf(path.slice(1), graph.names) === module && !/\/(histogram|state|timing)$/.test(path));
  const point = (event) => {
    const { left, top } = drawing.current.getBoundingClientRect();
    return { x: event.clientX - left, y: event.clientY - top };
  };
  const nodeAt = ({ x, y }) => [...placed.places].find(([, place]) => x >= place.x && x <= place.x + WIDTH && y >= place.y && y <= place.y + HEIGHT)?.[0];
  const begin = (event, name) => {
    setChosen(name);
    setEditing(null);
    drawing.current.setPointerCapture(event.pointerId);
    setDrag({ from: name, ...point(event), moved: false });
  };
  const move = (event) => drag && setDrag({ ...drag, ...point(event), moved: true });
  const end = (event) => {
    if (!drag) return;
    const to = nodeAt(point(event));
    if (drag.moved && to && to !== drag.from && !graph.gates.has(to)) {
      const [inputs, outputs] = [inputsOf(to), outputsOf(drag.from)];
      const already = inputs.find((input) => links.some((link) => link.to === input && outputs.includes(link.from)));
      setChosen(to);
      if (inputs.length) setEditing({ input: already ?? inputs[0], from: outputs[0] ?? "", sources: outputs });
    }
    setDrag(null);
  };
  const key = (event, name) => (event.key === "Enter" || event.key === " ") && (event.preventDefault(), setChosen(name), setEditing(null));
  const source = (input) => links.find(({ to }) => to === input)?.from ?? "";
  return html`
    <div class="bar-of-tools"><input type="search" placeholder="Hide modules, such as referee monitor" aria-label="Hide modules whose names have" value=${options.hide ?? ""} onInput=${(event) => setOptions({ hide: event.target.value })} />
      <span class="muted">${graph.names.length} modules, ${links.length} links${isAllowed ? "; drag from a module to another to link them" : ""}</span></div>
    <div class="graph">
      <div class="scroll" ref=${box} tabindex="0" role="region" aria-label="Graph"><svg ref=${drawing} width=${placed.width} height=${placed.height} role="group" aria-label="Modules and links" onPointerMove=${move} onPointerUp=${end}>
        <defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto-start-reverse"><path d="M0 0L8 4L0 8z" class="tip" /></marker></defs>
        ${graph.edges.map((edge) => {
          const [from, to] = [placed.places.get(edge.from), placed.places.get(edge.to)];
          if (!from || !to) return null;
          const [x, y, endX, endY] = [from.x + WIDTH, from.y + HEIGHT / 2, to.x - 2, to.y + HEIGHT / 2];
          const bend = Math.max(40, Math.abs(endX - x) / 2);
          const state = trouble(edge) ? "bad" : chosen === edge.from || chosen === edge.to ? "chosen" : chosen ? "dim" : undefined;
          const words = edge.links.map(({ source, to, sends }) => (sends ? `${to} sends to ${source}` : `${source} to ${to}`)).join("\n");
          return html`<g key=${`${edge.from} ${edge.to}`} class="edge" data-state=${state} data-sends=${edge.links.every(({ sends }) => sends)}><title>${words}</title>
            <path d=${`M${x} ${y}C${x + bend} ${y} ${endX - bend} ${endY} ${endX} ${endY}`} marker-end="url(#tip)" />
            ${state === "chosen" && html`<text x=${(x + endX) / 2} y=${(y + endY) / 2 - 5}>${rate(edge)}</text>`}</g>`;
        })}
        ${drag?.moved && html`<path class="dragged" d=${`M${placed.places.get(drag.from).x + WIDTH} ${placed.places.get(drag.from).y + HEIGHT / 2}L${drag.x} ${drag.y}`} />`}
        ${graph.names.map((name) => {
          const { x, y } = placed.places.get(name);
          const module = conditions.get(name);
          const state = module?.panics ? "bad" : module?.misses ? "degraded" : module?.condition === "INACTIVE" ? "off" : graph.gates.has(name) ? "gate" : undefined;
          return html`<g key=${name} class="node" data-state=${state} data-chosen=${chosen === name} transform=${`translate(${x} ${y})`} tabindex="0" role="button" data-name=${name} aria-pressed=${chosen === name}
            onPointerDown=${(event) => begin(event, name)} onKeyDown=${(event) => key(event, name)}>
            <rect width=${WIDTH} height=${HEIGHT} rx=${graph.gates.has(name) ? 2 : 7} /><text x="10" y="16">${name.split("/").at(-1)}</text><text x="10" y="30" class="small">${[name.includes("/") ? name.split("/")[0] : module?.kind === name ? "" : module?.kind, graph.gates.has(name) ? "gate" : module?.condition === "WORKING" ? "" : word(module?.condition)].filter(Boolean).join(" · ")}</text></g>`;
        })}</svg></div>
      ${chosen && html`<aside class="links" aria-label=${`Links of ${chosen}`}><header><b>${chosen}</b><button class="quiet" aria-label="Close" onClick=${() => { setChosen(""); setEditing(null); }}>✕</button></header>
        ${editing ? html`${editing.sources && html`<label class="muted">Input <select value=${editing.input} onChange=${(event) => setEditing({ ...editing, input: event.target.value })}>${inputsOf(chosen).map((input) => html`<option key=${input}>${input}</option>`)}</select></label>`}
            <${Relink} key=${editing.input} input=${editing.input} from=${editing.from} sources=${editing.sources ?? sources} isAllowed=${isAllowed} done=${() => setEditing(null)} />`
        : html`<h3>Inputs</h3><ul>${inputsOf(chosen).map((input) => html`<li key=${input}><button class="output" onClick=${() => setEditing({ input, from: source(input) })}>
            <span>${input.slice(chosen.length + 1)}</span><span class="muted number">${source(input) || "no link"}</span></button></li>`)}</ul>
          <h3>Outputs</h3><ul>${outputsOf(chosen).map((path) => html`<li key=${path}><button class="output" onClick=${() => select(path.slice(1))}><span>${path.slice(chosen.length + 2)}</span><span class="number muted">${hertz(path.slice(1))}</span></button></li>`)}</ul>`}
      </aside>`}
    </div>`;
}

export default { id: "graph", title: "Graph", Panel };

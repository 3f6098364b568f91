// Modules, gates and the links between them, with how much goes over each. A link is made by dragging from a module to another
// one, or in the list of inputs; whether it fits is found out before it is made.
import { Age, duration, Empty, Field, hertz, html, Problem, put, reload, remove, select, Trouble, useAgent, useEffect, useMemo, useRates, useReadings, useRef, useResource, useSize, useState, word } from "/slate.js";
import { moduleOf } from "/blocks.js";
import { HEIGHT, layout, WIDTH } from "/graph/layout.js";

const enc = (path) => path.split("/").map(encodeURIComponent).join("/");

/** As much of a name as there is room for in a node. */
const short = (text, most) => (text.length > most ? `${text.slice(0, most - 1)}…` : text);

const count = (number, name) => `${number} ${name}${number === 1 ? "" : "s"}`;

// A gate lets through or not: it is no box.
const GATE = `M9 0H${WIDTH - 9}L${WIDTH} ${HEIGHT / 2}L${WIDTH - 9} ${HEIGHT}H9L0 ${HEIGHT / 2}z`;

/** Nodes, and edges with all the links between the same two. */
function made(modules, properties, links, actuators, hidden) {
  const fits = (name) => !hidden.some((part) => name.includes(part));
  const gates = actuators.map(({ name }) => name);
  const names = [...modules.map(({ name }) => name), ...gates].filter(fits);
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
    add(from, to, { ...link, source });
  }
  for (const { name } of actuators) {
    const robot = name.split("/")[0];
    const command = properties.find(({ path, interface: kind, access }) => access === "output" && path.startsWith(`${robot}/execute`) && path.endsWith(`/${name.split("/").at(-1)}`) && kind !== "ExecuteStatus");
    if (command) add(moduleOf(command.path, names), name, { to: name, from: `/${command.path}`, source: command.path, sends: false });
  }
  return { names, gates: new Set(gates.filter(fits)), edges: [...found.values()] };
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
      (changed) => !ended && setChecked({ fits: true, conversion: changed.find(({ conversion }) => conversion)?.conversion }),
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
    <p role="status" class="muted">${!isAllowed ? "A developer changes links." : checked?.fits ? (checked.conversion ? `✓ It fits: ${checked.conversion}.` : "✓ It fits.") : ""}</p>
    <${Trouble} problem=${checked?.problem} />
    ${isAllowed && html`<p><button class="primary" disabled=${!checked?.fits} onClick=${() => act(() => put(`/links/${enc(input)}`, { from: source }))}>Link</button>
      <button disabled=${!from} onClick=${() => act(() => remove(`/links/${enc(input)}`))}>Take the link away</button> <button onClick=${done}>Cancel</button></p>`}</div>`;
}

/** What goes over the links of an edge. */
function Edge({ edge, rates, change, close }) {
  // Messages have no value that stays.
  const readings = useReadings(edge.links.filter(({ sends }) => !sends).map(({ source }) => source), 4);
  const told = (links) => links.map(({ source, to, from, sends, age, queue, trouble, evicted }) => html`<section key=${to}>
    <button class="output" title="Shows it in the panel Inspector" onClick=${() => select(sends ? to : source)}><span>${sends ? `${source} sends to` : "from"}</span><span class="number">/${sends ? to : source}</span></button>
    ${!sends && html`<button class="output" onClick=${() => change(to, from)} disabled=${edge.isGate}><span>to</span><span class="number">${to}</span></button>`}
    <dl>
      ${!sends && html`<${Field} name="Rate">${hertz(rates.get(source)) || "–"}</${Field}><${Field} name="Age"><${Age} time=${readings[source]?.time} /></${Field}>`}
      ${age !== undefined && html`<${Field} name="Latency" title="How old the value was when its reader had it, in the last step that was measured">${duration(age)}</${Field}>`}
      ${queue && html`<${Field} name="Queue" state=${queue[1] ? "degraded" : undefined} title="Values that the reader has not taken, and those that it never saw">${queue[0]} wait, ${queue[1]} lost</${Field}>`}
      ${(trouble || evicted) && html`<${Field} name="Trouble" state="bad">${trouble ?? "it fell behind and reads no more"}</${Field}>`}
    </dl></section>`);
  return html`<section class="links" aria-label=${`Links from ${edge.from} to ${edge.to}`}>
    <header><b>${edge.from} → ${edge.to}</b><button class="quiet" aria-label="Close" onClick=${close}>✕</button></header>${told(edge.links)}</section>`;
}

function Panel({ options, setOptions }) {
  const agent = useAgent();
  const modules = useResource("/modules", 2);
  const properties = useResource("/properties?values", 1) ?? [];
  const links = useResource("/links", 3) ?? [];
  const actuators = useResource("/actuators", 5) ?? [];
  const [chosen, setChosen] = useState("");
  const [edgeChosen, setEdgeChosen] = useState("");
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
    return layout(graph.names, graph.edges, onward, size);
  }, [graph, size?.width, size?.height]);
  if (!modules) return html`<${Empty}>Waiting for the agent.</${Empty}>`;
  const isAllowed = agent?.role === "developer";
  const conditions = new Map(modules.map((module) => [module.name, module]));
  const gates = new Map(actuators.map((actuator) => [actuator.name, actuator]));
  const rate = ({ links }) => (links.length > 1 ? `${links.length} links` : links[0].sends ? "messages" : rates.get(links[0].source) === 0 ? "0 Hz" : hertz(rates.get(links[0].source)));
  // The slowest and the fastest of what a module writes.
  const pace = (name) => {
    const paths = graph.gates.has(name) ? [`${name}/command`] : outputsOf(name).map((path) => path.slice(1));
    const own = paths.map((path) => rates.get(path)).filter((rate) => rate > 0);
    const [least, most] = [Math.min(...own), Math.max(...own)];
    // Nearly the same is the same.
    if (own.length === 0 || most < 1.15 * least) return own.length ? hertz(most) : "";
    return `${hertz(least).replace(" Hz", "")}–${hertz(most)}`;
  };
  // Thicker where more goes.
  const width = ({ links }) => {
    const most = Math.max(0, ...links.map(({ source }) => rates.get(source) ?? 0));
    return 1.1 + 0.5 * Math.log10(1 + most);
  };
  const trouble = ({ links }) => links.find(({ trouble, evicted }) => trouble || evicted);
  const isInput = ({ access }) => access === "setting" || access === "queue";
  const settings = properties.filter(isInput).filter(({ path }) => !/\/(params|enabled)$/.test(path)).map(({ path }) => path);
  const inputsOf = (module) => [...new Set([...links.filter(({ sends }) => !sends).map(({ to }) => to), ...settings])].filter((path) => moduleOf(path, graph.names) === module).sort();
  const sources = properties.filter((property) => !isInput(property)).map(({ path }) => `/${path}`);
  const outputsOf = (module) => sources.filter((path) => moduleOf(path.slice(1), graph.names) === module && !/\/(histogram|state|timing)$/.test(path));
  const point = (event) => {
    const { left, top } = drawing.current.getBoundingClientRect();
    return { x: event.clientX - left, y: event.clientY - top };
  };
  const nodeAt = ({ x, y }) => [...placed.places].find(([, place]) => x >= place.x && x <= place.x + WIDTH && y >= place.y && y <= place.y + HEIGHT)?.[0];
  const choose = (name, edge = "") => {
    setChosen(name);
    setEdgeChosen(edge);
    setEditing(null);
  };
  const begin = (event, name) => {
    choose(name);
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
      choose(to);
      if (inputs.length) setEditing({ input: already ?? inputs[0], from: outputs[0] ?? "", sources: outputs });
    }
    setDrag(null);
  };
  const key = (event, name) => (event.key === "Enter" || event.key === " ") && (event.preventDefault(), choose(name));
  const shown = graph.edges.find(({ from, to }) => `${from} ${to}` === edgeChosen);
  const isChosen = ({ from, to }) => (edgeChosen ? edgeChosen === `${from} ${to}` : chosen === from || chosen === to);
  // What stands in the box of its robot.
  const own = (name) => name.slice(name.indexOf("/") + 1);
  const more = (name) => {
    const module = conditions.get(name);
    const gate = gates.get(name);
    if (gate) return `gate, ${gate.stopped ? "stopped" : word(gate.gate?.mode).toLowerCase() || "no command yet"}`;
    return module?.condition !== "WORKING" ? word(module?.condition) : module.kind === own(name) ? "" : module.kind;
  };
  const source = (input) => links.find(({ to }) => to === input)?.from ?? "";
  return html`
    <div class="bar-of-tools"><input type="search" placeholder="Hide modules, such as referee monitor" aria-label="Hide modules whose names have" value=${options.hide ?? ""} onInput=${(event) => setOptions({ hide: event.target.value })} />
      <span class="muted" title="The rates are of what each writes; lines are thicker where more goes">${count(graph.names.length - graph.gates.size, "module")}, ${graph.gates.size ? `${count(graph.gates.size, "gate")}, ` : ""}${count(links.length, "link")}${isAllowed ? "; drag from a module to another to link them" : ""}</span></div>
    <div class="graph">
      <div class="scroll" ref=${box} tabindex="0" role="group" aria-label="Graph"><svg ref=${drawing} width=${placed.width} height=${placed.height} role="group" aria-label="Modules and links" onPointerMove=${move} onPointerUp=${end}>
        <defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerUnits="userSpaceOnUse" markerWidth="10" markerHeight="10" orient="auto-start-reverse"><path d="M0 0L8 4L0 8z" class="tip" /></marker></defs>
        ${placed.boxes.map(({ name, ...box }) => html`<g key=${name} class="box"><rect ...${box} rx="10" /><text x=${box.x + 12} y=${box.y + 16}>${name}</text></g>`)}
        ${[...graph.edges].sort((one, other) => isChosen(one) - isChosen(other)).map((edge) => {
          const way = placed.ways.get(edge);
          if (!way) return null;
          const id = `${edge.from} ${edge.to}`;
          const state = trouble(edge) ? "bad" : isChosen(edge) ? "chosen" : chosen || edgeChosen ? "dim" : undefined;
          const words = edge.links.map(({ source, to, sends }) => (sends ? `${source} sends to ${to}` : `${source} to ${to}, ${hertz(rates.get(source)) || "–"}`)).join("\n");
          return html`<g key=${id} class="edge" data-state=${state} data-edge=${id} data-back=${way.isBack} data-sends=${edge.links.every(({ sends }) => sends)} onClick=${() => choose("", id)}><title>${words}</title>
            <path class="near" d=${way.d} /><path d=${way.d} style=${{ strokeWidth: width(edge) }} marker-end="url(#tip)" /></g>`;
        })}
        ${drag?.moved && html`<path class="dragged" d=${`M${placed.places.get(drag.from).x + WIDTH} ${placed.places.get(drag.from).y + HEIGHT / 2}L${drag.x} ${drag.y}`} />`}
        ${graph.names.map((name) => {
          const { x, y } = placed.places.get(name);
          const module = conditions.get(name);
          const state = module?.panics ? "bad" : module?.misses ? "degraded" : module?.condition === "INACTIVE" ? "off" : gates.get(name)?.stopped ? "bad" : graph.gates.has(name) ? "gate" : undefined;
          return html`<g key=${name} class="node" data-state=${state} data-chosen=${chosen === name} transform=${`translate(${x} ${y})`} tabindex="0" role="button" data-name=${name} aria-pressed=${chosen === name}
            onPointerDown=${(event) => begin(event, name)} onKeyDown=${(event) => key(event, name)}>
            ${graph.gates.has(name) ? html`<path class="body" d=${GATE} />` : html`<rect class="body" width=${WIDTH} height=${HEIGHT} rx="7" />`}
            <text x="12" y=${more(name) || pace(name) ? 16 : 23}>${short(own(name), 20)}</text><text x="12" y="30" class="small">${short(more(name), pace(name) ? 19 - pace(name).length : 23)}</text>
            <text x=${WIDTH - 10} y="30" class="small pace">${pace(name)}</text></g>`;
        })}
        ${graph.edges.filter((edge) => isChosen(edge) && placed.ways.has(edge)).map((edge) => {
          // Where the lines of the chosen module are apart.
          const { start, end } = placed.ways.get(edge);
          const { x, y } = chosen === edge.to ? start : end;
          return html`<text key=${`${edge.from} ${edge.to}`} class="rate" x=${x} y=${y - 5}>${rate(edge)}</text>`;
        })}</svg></div>
      ${chosen && html`<section class="links" aria-label=${`Links of ${chosen}`}><header><b>${chosen}</b><button class="quiet" aria-label="Close" onClick=${() => choose("")}>✕</button></header>
        ${editing ? html`${editing.sources && html`<label class="muted">Input <select value=${editing.input} onChange=${(event) => setEditing({ ...editing, input: event.target.value })}>${inputsOf(chosen).map((input) => html`<option key=${input} value=${input}>${input}</option>`)}</select></label>`}
            <${Relink} key=${editing.input} input=${editing.input} from=${editing.from} sources=${editing.sources ?? sources} isAllowed=${isAllowed} done=${() => setEditing(null)} />`
        : html`<h3>Inputs</h3><ul>${inputsOf(chosen).map((input) => html`<li key=${input}><button class="output" onClick=${() => setEditing({ input, from: source(input) })}>
            <span>${input.slice(chosen.length + 1)}</span><span class="muted number">${source(input) || "no link"}</span><span class="muted number">${hertz(rates.get(source(input).slice(1)))}</span></button></li>`)}</ul>
          <h3>Outputs</h3><ul>${outputsOf(chosen).map((path) => html`<li key=${path}><button class="output" onClick=${() => select(path.slice(1))}><span>${path.slice(chosen.length + 2)}</span><span class="number muted">${hertz(rates.get(path.slice(1)))}</span></button></li>`)}</ul>`}
      </section>`}
      ${shown && html`<${Edge} key=${edgeChosen} edge=${{ ...shown, isGate: graph.gates.has(shown.to) }} rates=${rates} close=${() => choose("")} change=${(input, from) => { choose(shown.to); setEditing({ input, from }); }} />`}
    </div>`;
}

export default { id: "graph", title: "Graph", Panel };

// Modules, gates and links, with their rates. A link is made by dragging from one module to another,
// or in the list of inputs, after a dry run.
import { Age, conditionOf, duration, Empty, Field, get, hertz, html, Problem, put, reload, remove, select, Trouble, useAgent, useEffect, useMemo, useRates, useReadings, useRef, useResource, useSize, useState, word } from "/slate.js";
import { moduleOf } from "/blocks.js";

const enc = (path) => path.split("/").map(encodeURIComponent).join("/");

/** A name, shortened to the space in a node. */
const short = (text, most) => (text.length > most ? `${text.slice(0, most - 1)}…` : text);

const count = (number, name) => `${number} ${name}${number === 1 ? "" : "s"}`;

/** The outline of a gate. */
const gateOutline = (width, height) => `M9 0H${width - 9}L${width} ${height / 2}L${width - 9} ${height}H9L0 ${height / 2}z`;

// Delay of a request for the layout after a change of the size, and after a failure, ms.
const [SETTLE, RETRY] = [50, 2000];

/** The graph with its layout, which the agent computes; requested anew when the key or the size changes. */
function useGraph(key, hide, size) {
  const [graph, setGraph] = useState(null);
  const [attempt, setAttempt] = useState(0);
  const [width, height] = [Math.floor(size?.width ?? 0), Math.floor(size?.height ?? 0)];
  useEffect(() => {
    let timer = 0;
    let ended = false;
    const request = async () => {
      try {
        const found = await get(`/graph?${new URLSearchParams({ hide, width, height })}`);
        if (!ended) setGraph(found);
      } catch (problem) {
        if (!(problem instanceof Problem)) throw problem;
        if (!ended) timer = setTimeout(() => setAttempt(attempt + 1), RETRY);
      }
    };
    timer = setTimeout(request, SETTLE);
    return () => {
      ended = true;
      clearTimeout(timer);
    };
  }, [key, hide, width, height, attempt]);
  return graph;
}

/** Edges with the present state of their links. */
function joined(edges, links) {
  const known = new Map(links.map((link) => [`${link.to} ${link.from.replace(/^\//, "")}`, link]));
  return edges.map((edge) => ({
    ...edge,
    links: edge.links.map(({ output, input, flow }) => {
      const [source, to] = [`${edge.from}/${output}`, `${edge.to}/${input}`];
      return { ...known.get(`${to} ${source}`), from: source.startsWith("slate://") ? source : `/${source}`, source, to, sends: flow === "messages" };
    }),
  }));
}

/** Makes a link after a dry run. */
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
      <option value="">none</option>${!sources.includes(source) && source && html`<option value=${source}>${source}</option>`}
      ${sources.map((path) => html`<option key=${path} value=${path}>${path}</option>`)}</select>
    <p role="status" class="muted">${!isAllowed ? "Changing links requires the role developer." : checked?.fits ? (checked.conversion ? `✓ Compatible: ${checked.conversion}.` : "✓ Compatible.") : ""}</p>
    <${Trouble} problem=${checked?.problem} />
    ${isAllowed && html`<p><button class="primary" disabled=${!checked?.fits} onClick=${() => act(() => put(`/links/${enc(input)}`, { from: source }))}>Link</button>
      <button disabled=${!from} onClick=${() => act(() => remove(`/links/${enc(input)}`))}>Remove link</button> <button onClick=${done}>Cancel</button></p>`}</div>`;
}

/** Rates, ages and queues of the links of an edge. */
function Edge({ edge, rates, change, close }) {
  // A message has no value that stays.
  const readings = useReadings(edge.links.filter(({ sends }) => !sends).map(({ source }) => source), 4);
  const linkDetails = (links) => links.map(({ source, to, from, sends, age, queue, trouble, evicted }) => html`<section key=${to}>
    <button class="output" title="Show in the Inspector panel" onClick=${() => select(sends ? to : source)}><span>${sends ? `${source} sends to` : "from"}</span><span class="number">/${sends ? to : source}</span></button>
    ${!sends && html`<button class="output" onClick=${() => change(to, from)} disabled=${edge.isGate}><span>to</span><span class="number">${to}</span></button>`}
    <dl>
      ${!sends && html`<${Field} name="Rate">${hertz(rates.get(source)) || "–"}</${Field}><${Field} name="Age"><${Age} time=${readings[source]?.time} /></${Field}>`}
      ${age !== undefined && html`<${Field} name="Latency" title="Age of the value when its reader took it, in the last measured step">${duration(age)}</${Field}>`}
      ${queue && html`<${Field} name="Queue" state=${queue[1] ? "degraded" : undefined} title="Values not yet read, and values lost">${queue[0]} waiting, ${queue[1]} lost</${Field}>`}
      ${(trouble || evicted) && html`<${Field} name="Trouble" state="bad">${trouble ?? "evicted: the reader fell behind"}</${Field}>`}
    </dl></section>`);
  return html`<section class="links" aria-label=${`Links from ${edge.from} to ${edge.to}`}>
    <header><b>${edge.from} → ${edge.to}</b><button class="quiet" aria-label="Close" onClick=${close}>✕</button></header>${linkDetails(edge.links)}</section>`;
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
  const structure = JSON.stringify([modules?.map(({ name }) => name), links.map(({ to, from }) => [to, from]), actuators.map(({ name }) => name)]);
  const drawn = useGraph(structure, options.hide ?? "", size);
  const edges = useMemo(() => joined(drawn?.edges ?? [], links), [drawn, links]);
  const nodes = useMemo(() => new Map((drawn?.nodes ?? []).map((node) => [node.name, node])), [drawn]);
  if (!modules || !drawn) return html`<div class="graph"><div class="scroll" ref=${box}><${Empty}>Waiting for the agent.</${Empty}></div></div>`;
  const { node_width: WIDTH, node_height: HEIGHT } = drawn;
  const names = drawn.nodes.map(({ name }) => name);
  const countOf = (kind) => drawn.nodes.filter((node) => node.kind === kind).length;
  const isAllowed = agent?.role === "developer";
  const isGate = (name) => nodes.get(name)?.kind === "gate";
  const conditions = new Map(modules.map((module) => [module.name, module]));
  const gates = new Map(actuators.map((actuator) => [actuator.name, actuator]));
  const rate = ({ links }) => (links.length > 1 ? `${links.length} links` : links[0].sends ? "messages" : rates.get(links[0].source) === 0 ? "0 Hz" : hertz(rates.get(links[0].source)));
  // The lowest and the highest rate of a module's outputs.
  const pace = (name) => {
    const paths = isGate(name) ? [`${name}/command`] : outputsOf(name).map((path) => path.slice(1));
    const own = paths.map((path) => rates.get(path)).filter((rate) => rate > 0);
    const [least, most] = [Math.min(...own), Math.max(...own)];
    // Similar rates are shown as one.
    if (own.length === 0 || most < 1.15 * least) return own.length ? hertz(most) : "";
    return `${hertz(least).replace(" Hz", "")}–${hertz(most)}`;
  };
  // Wider at a higher rate.
  const width = ({ links }) => {
    const most = Math.max(0, ...links.map(({ source }) => rates.get(source) ?? 0));
    return 1.1 + 0.5 * Math.log10(1 + most);
  };
  const trouble = ({ links }) => links.find(({ trouble, evicted }) => trouble || evicted);
  const isInput = ({ access }) => access === "setting" || access === "queue";
  const settings = properties.filter(isInput).filter(({ path }) => !/\/(params|enabled)$/.test(path)).map(({ path }) => path);
  const inputsOf = (module) => [...new Set([...links.filter(({ sends }) => !sends).map(({ to }) => to), ...settings])].filter((path) => moduleOf(path, names) === module).sort();
  const sources = properties.filter((property) => !isInput(property)).map(({ path }) => `/${path}`);
  const outputsOf = (module) => sources.filter((path) => moduleOf(path.slice(1), names) === module && !/\/(histogram|state|timing)$/.test(path));
  const point = (event) => {
    const { left, top } = drawing.current.getBoundingClientRect();
    return { x: event.clientX - left, y: event.clientY - top };
  };
  const nodeAt = ({ x, y }) => drawn.nodes.find((node) => x >= node.x && x <= node.x + WIDTH && y >= node.y && y <= node.y + HEIGHT)?.name;
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
    if (drag.moved && to && to !== drag.from && !isGate(to)) {
      const [inputs, outputs] = [inputsOf(to), outputsOf(drag.from)];
      const already = inputs.find((input) => links.some((link) => link.to === input && outputs.includes(link.from)));
      choose(to);
      if (inputs.length) setEditing({ input: already ?? inputs[0], from: outputs[0] ?? "", sources: outputs });
    }
    setDrag(null);
  };
  const key = (event, name) => (event.key === "Enter" || event.key === " ") && (event.preventDefault(), choose(name));
  const shown = edges.find(({ from, to }) => `${from} ${to}` === edgeChosen);
  const isChosen = ({ from, to }) => (edgeChosen ? edgeChosen === `${from} ${to}` : chosen === from || chosen === to);
  // The name within the box of its robot.
  const own = (name) => (nodes.get(name).group ? name.slice(name.indexOf("/") + 1) : name);
  const more = (name) => {
    const module = conditions.get(name);
    const gate = gates.get(name);
    if (gate) return `gate, ${gate.stopped ? "stopped" : word(gate.gate?.mode).toLowerCase() || "no command yet"}`;
    if (!module) return nodes.get(name).note;
    return module.condition !== "WORKING" ? conditionOf(module) : module.kind === own(name) ? "" : module.kind;
  };
  const source = (input) => links.find(({ to }) => to === input)?.from ?? "";
  return html`
    <div class="bar-of-tools"><input type="search" placeholder="Hide modules, such as referee monitor" aria-label="Hide modules by name" value=${options.hide ?? ""} onInput=${(event) => setOptions({ hide: event.target.value })} />
      <span class="muted" title="Rates of each module's outputs; the line width grows with the rate">${count(countOf("module"), "module")}, ${countOf("gate") ? `${count(countOf("gate"), "gate")}, ` : ""}${count(links.length, "link")}${isAllowed ? "; drag from one module to another to link them" : ""}</span></div>
    <div class="graph">
      <div class="scroll" ref=${box} tabindex="0" role="group" aria-label="Graph"><svg ref=${drawing} width=${drawn.width} height=${drawn.height} role="group" aria-label="Modules and links" onPointerMove=${move} onPointerUp=${end}>
        <defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerUnits="userSpaceOnUse" markerWidth="10" markerHeight="10" orient="auto-start-reverse"><path d="M0 0L8 4L0 8z" class="tip" /></marker></defs>
        ${drawn.groups.map(({ name, ...box }) => html`<g key=${name} class="box"><rect ...${box} rx="10" /><text x=${box.x + 12} y=${box.y + 16}>${name}</text></g>`)}
        ${[...edges].sort((one, other) => isChosen(one) - isChosen(other)).map((edge) => {
          const id = `${edge.from} ${edge.to}`;
          const state = trouble(edge) ? "bad" : isChosen(edge) ? "chosen" : chosen || edgeChosen ? "dim" : undefined;
          const words = edge.links.map(({ source, to, sends }) => (sends ? `${source} sends to ${to}` : `${source} to ${to}, ${hertz(rates.get(source)) || "–"}`)).join("\n");
          return html`<g key=${id} class="edge" data-state=${state} data-edge=${id} data-back=${edge.back} data-sends=${edge.links.every(({ sends }) => sends)} onClick=${() => choose("", id)}><title>${words}</title>
            <path class="near" d=${edge.path} /><path d=${edge.path} style=${{ strokeWidth: width(edge) }} marker-end="url(#tip)" /></g>`;
        })}
        ${drag?.moved && html`<path class="dragged" d=${`M${nodes.get(drag.from).x + WIDTH} ${nodes.get(drag.from).y + HEIGHT / 2}L${drag.x} ${drag.y}`} />`}
        ${names.map((name) => {
          const { x, y } = nodes.get(name);
          const module = conditions.get(name);
          const state = module?.panics ? "bad" : module?.misses ? "degraded" : module?.condition === "INACTIVE" ? "off" : gates.get(name)?.stopped ? "bad" : isGate(name) ? "gate" : undefined;
          return html`<g key=${name} class="node" data-state=${state} data-chosen=${chosen === name} transform=${`translate(${x} ${y})`} tabindex="0" role="button" data-name=${name} aria-pressed=${chosen === name}
            onPointerDown=${(event) => begin(event, name)} onKeyDown=${(event) => key(event, name)}>
            ${isGate(name) ? html`<path class="body" d=${gateOutline(WIDTH, HEIGHT)} />` : html`<rect class="body" width=${WIDTH} height=${HEIGHT} rx="7" />`}
            <text x="12" y=${more(name) || pace(name) ? 16 : 23}>${short(own(name), 20)}</text><text x="12" y="30" class="small">${short(more(name), pace(name) ? 19 - pace(name).length : 23)}</text>
            <text x=${WIDTH - 10} y="30" class="small pace">${pace(name)}</text></g>`;
        })}
        ${edges.filter((edge) => isChosen(edge)).map((edge) => {
          // Labels stand at the far ends, where the edges of the selected module are apart.
          const [x, y] = chosen === edge.to ? edge.start : edge.end;
          return html`<text key=${`${edge.from} ${edge.to}`} class="rate" x=${x} y=${y - 5}>${rate(edge)}</text>`;
        })}</svg></div>
      ${chosen && html`<section class="links" aria-label=${`Links of ${chosen}`}><header><b>${chosen}</b><button class="quiet" aria-label="Close" onClick=${() => choose("")}>✕</button></header>
        ${editing ? html`${editing.sources && html`<label class="muted">Input <select value=${editing.input} onChange=${(event) => setEditing({ ...editing, input: event.target.value })}>${inputsOf(chosen).map((input) => html`<option key=${input} value=${input}>${input}</option>`)}</select></label>`}
            <${Relink} key=${editing.input} input=${editing.input} from=${editing.from} sources=${editing.sources ?? sources} isAllowed=${isAllowed} done=${() => setEditing(null)} />`
        : html`<h3>Inputs</h3><ul>${inputsOf(chosen).map((input) => html`<li key=${input}><button class="output" onClick=${() => setEditing({ input, from: source(input) })}>
            <span>${input.slice(chosen.length + 1)}</span><span class="muted number">${source(input) || "no link"}</span><span class="muted number">${hertz(rates.get(source(input).slice(1)))}</span></button></li>`)}</ul>
          <h3>Outputs</h3><ul>${outputsOf(chosen).map((path) => html`<li key=${path}><button class="output" onClick=${() => select(path.slice(1))}><span>${path.slice(chosen.length + 2)}</span><span class="number muted">${hertz(rates.get(path.slice(1)))}</span></button></li>`)}</ul>`}
      </section>`}
      ${shown && html`<${Edge} key=${edgeChosen} edge=${{ ...shown, isGate: isGate(shown.to) }} rates=${rates} close=${() => choose("")} change=${(input, from) => { choose(shown.to); setEditing({ input, from }); }} />`}
    </div>`;
}

export default { id: "graph", title: "Graph", Panel };

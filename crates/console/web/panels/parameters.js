// Parameters of modules: with ranges and units, taken back one by one, compared with the files, and saved into them.
import { Dialog } from "/dialog.js";
import { at, Empty, html, leaves, number, part, patch, post, Problem, reload, remove, Trouble, useAgent, useInterfaces, useMemo, useProperties, useReadings, useResource, useState } from "/slate.js";

/** The least and the greatest value of a slider: what the parameter allows; nothing where nobody has said. */
const bounds = ({ range }) => (range && range[1] - range[0] < 1e6 ? { low: range[0], high: range[1] } : null);

function Parameter({ leaf, module, value, file, set, isAllowed }) {
  const [text, setText] = useState(null);
  const { name, type, unit, doc } = leaf;
  const limits = bounds(leaf);
  const isNumber = type === "number" || type === "integer";
  const differs = file !== undefined;
  const enter = (event) => {
    event.preventDefault();
    // Whoever types and enters at once is faster than the page is drawn.
    const typed = event.type === "submit" ? event.target.querySelector("input").value : text;
    const isTouched = text !== null || (typed !== null && typed !== String(value ?? "NaN"));
    if (isTouched && typed.trim() !== "") set(isNumber ? Number(typed.replace(",", ".")) : typed);
    setText(null);
  };
  // A slider has no more digits than a hundredth of its range tells apart.
  const rounded = ({ target }) => Number(Number(target.value).toPrecision(3));
  const id = `parameter-${leaf.path}-${name}`;
  const choices = type === "enumeration" ? leaf.schema.anyOf[0].enum : null;
  return html`<div class="parameter" data-differs=${differs}>
    <label for=${id} title=${doc}>${name}<small>${doc}</small></label>
    ${isNumber && html`
      ${limits ? html`<input type="range" aria-label=${`${name} of ${module}, slider`} title=${`${limits.low} to ${limits.high} ${unit}`} min=${limits.low} max=${limits.high} step=${type === "integer" ? 1 : "any"}
        value=${text ?? value ?? 0} disabled=${!isAllowed} onChange=${(event) => { setText(null); set(rounded(event)); }} onInput=${(event) => setText(String(rounded(event)))} />` : html`<span></span>`}
      <form onSubmit=${enter}><input id=${id} inputmode="decimal" autocomplete="off" disabled=${!isAllowed} value=${text ?? (value ?? "NaN")} onInput=${(event) => setText(event.target.value)} onBlur=${enter} /></form>
      <span class="unit">${unit}</span>`}
    ${type === "boolean" && html`<span></span><input id=${id} type="checkbox" disabled=${!isAllowed} checked=${value === true} onChange=${(event) => set(event.target.checked)} /><span></span>`}
    ${choices && html`<span></span><select id=${id} disabled=${!isAllowed} value=${value} onChange=${(event) => set(event.target.value)}>${choices.map((choice) => html`<option key=${choice}>${choice}</option>`)}</select><span></span>`}
    ${!isNumber && type !== "boolean" && !choices && html`<span></span><form onSubmit=${enter}><input id=${id} autocomplete="off" disabled=${!isAllowed || type !== "string"} value=${text ?? (typeof value === "string" ? value : JSON.stringify(value))} onInput=${(event) => setText(event.target.value)} onBlur=${enter} /></form><span></span>`}
    <span class="was" title=${differs ? `The file says ${file}` : ""}>${differs ? `file: ${file}` : ""}</span></div>`;
}

/** What is going to be taken back, whoever has changed it: a goal among it moves the robot. */
function Revert({ differences, revert, close }) {
  return html`<${Dialog} label="Revert" kind="revert" close=${close}>
    <h2>Take back what no file says</h2>
    <dl>${differences.map(({ path, file, present, default: usual }) => html`<div class="field" key=${path}><dt>${path.replace(/^modules\./, "").replaceAll('"', "")}</dt>
      <dd>${present ?? "none"} → ${file ?? usual ?? "the default"}</dd></div>`)}</dl>
    <div class="choices"><button data-first onClick=${close}>Cancel</button>
      <button class="primary" onClick=${() => (close(), revert())}>Take back ${differences.length}</button></div>
  </${Dialog}>`;
}

function Panel({ options, setOptions }) {
  const agent = useAgent();
  const interfaces = useInterfaces();
  const properties = useProperties().filter(({ path, access }) => access === "setting" && path.endsWith("/params"));
  const differences = useResource("/settings/differences", 3) ?? [];
  const known = useResource("/parameters", 10) ?? [];
  const ranges = useMemo(() => new Map(known.map(({ module, name, range }) => [`${module} ${name}`, range])), [known]);
  const [text, setText] = useState("");
  const [undone, setUndone] = useState([]);
  const [problem, setProblem] = useState(null);
  const [said, setSaid] = useState("");
  const [asks, setAsks] = useState(false);
  const shown = properties
    .map(({ path, interface: name }) => ({ path, module: path.slice(0, -"/params".length), fields: leaves(interfaces[name]) }))
    .filter(({ fields, module }) => fields.length && `${module} ${fields.map(({ name }) => name).join(" ")}`.toLowerCase().includes(text.toLowerCase()));
  const readings = useReadings(shown.map(({ path }) => path), 5);
  const isAllowed = agent?.role === "developer";
  const changed = new Map(differences.map((difference) => [difference.path.replaceAll('"', ""), difference]));
  const again = () => reload("/settings/differences", "/properties");
  const attempt = async (work) => {
    setProblem(null);
    setSaid("");
    try {
      const answer = await work();
      again();
      return answer;
    } catch (error) {
      if (!(error instanceof Problem)) throw error;
      setProblem(error);
      return null;
    }
  };
  const set = (path, leaf, before, isUndo = false) => (value) => {
    const names = leaf.pointer.split("/").slice(1);
    const body = names.reduceRight((inner, name) => ({ [name]: inner }), value);
    attempt(() => patch(at(agent.name, path), body)).then((done) => {
      if (done && !isUndo) setUndone((all) => [...all, { path, leaf, before, after: value }]);
    });
  };
  const undo = () => {
    const last = undone.at(-1);
    setUndone(undone.slice(0, -1));
    set(last.path, last.leaf, undefined, true)(last.before);
  };
  const revert = () => attempt(() => remove("/settings")).then((done) => done && (setUndone([]), setSaid("As the files say again")));
  const save = () => attempt(() => post("/settings/save", {})).then((done) => done && setSaid(`Written: ${done.files.join(", ") || "nothing has changed"}`));
  // What the command line says is none of the files', and stays out of them.
  const own = differences.filter(({ path, origin }) => path.startsWith("modules.") && !origin?.startsWith("--"));
  return html`
    <div class="bar-of-tools">
      <input type="search" placeholder="Module or parameter" aria-label="Search for parameters" value=${text} onInput=${(event) => setText(event.target.value)} />
      <button disabled=${!undone.length} onClick=${undo} title="Takes the last change back">Undo</button>
      <button disabled=${!own.length || !isAllowed} onClick=${() => setAsks(true)} title="Takes back all that is not saved, and shows it first">Revert${own.length ? ` ${own.length}` : ""}</button>
      <button disabled=${!own.length || !isAllowed} onClick=${save} title="Writes the changes into the files, with their comments kept">Save${own.length ? ` ${own.length}` : ""}</button>
      <span role="status" class="muted">${said}</span>
    </div>
    <${Trouble} problem=${problem} />
    ${asks && html`<${Revert} differences=${own} revert=${revert} close=${() => setAsks(false)} />`}
    <div class="scroll parameters">
      ${!isAllowed && agent && html`<p class="doc muted">A ${agent.role} may look at parameters; a developer changes them.</p>`}
      ${shown.map(({ path, module, fields }) => html`<section key=${path}>
        <h3>${module}</h3>
        ${fields.map((leaf) => {
          const value = part(readings[path]?.value, leaf.pointer);
          const difference = changed.get(`modules.${module}.params.${leaf.name}`);
          const file = difference && (difference.file ?? difference.default ?? "not there");
          return html`<${Parameter} key=${leaf.pointer} module=${module} leaf=${{ ...leaf, path, range: ranges.get(`${module} ${leaf.name}`) }} value=${value} file=${file} isAllowed=${isAllowed} set=${set(path, leaf, value)} />`;
        })}</section>`)}
      ${!shown.length && html`<${Empty}>No module has such parameters.</${Empty}>`}
    </div>`;
}

export default { id: "parameters", title: "Parameters", Panel };

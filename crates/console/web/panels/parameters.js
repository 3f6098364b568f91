// Parameters of modules with ranges and units: undone one by one, compared with the files, saved.
import { Dialog } from "/dialog.js";
import { at, Empty, html, leaves, number, part, patch, post, Problem, reload, remove, Trouble, useAgent, useEffect, useInterfaces, useMemo, useProperties, useReadings, useRef, useResource, useState } from "/slate.js";

/** A decimal number as people write it: with comma or point, a minus sign, a unit behind it; null for other text. */
function numberOf(text, unit) {
  const bare = text.trim();
  const digits = (unit && bare.endsWith(unit) ? bare.slice(0, -unit.length) : bare).trim().replace(",", ".").replace("−", "-");
  return /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(digits) ? Number(digits) : null;
}

/** The reason why a text is not a valid value, in the words of the user; null if it is valid. */
function wrongly(text, { name, type, unit, range }, module) {
  const found = numberOf(text, unit);
  const [low, high] = range ?? [];
  const isOutside = found !== null && range && (found < low || found > high);
  if (found !== null && !isOutside && (type === "number" || Number.isInteger(found))) return null;
  const kind = type === "integer" ? "a whole number" : "a number";
  const wrong = found === null ? `“${text.trim()}” is not ${kind}` : isOutside ? `${text.trim()} is too ${found < low ? "small" : "large"}` : `${text.trim()} is not ${kind}`;
  const such = !range ? "" : high - low < 1e6 ? ` from ${low} to ${high}` : low > -1e6 ? `, at least ${low}` : high < 1e6 ? `, at most ${high}` : "";
  return new Problem(422, `${wrong}: nothing was changed`, `${name} of ${module} is ${kind}${such}${unit ? `, in ${unit}` : ""}, such as ${type === "integer" ? Math.round(low ?? 1) : Math.max(low ?? 0.5, Math.min(high ?? 0.5, 0.5))}`);
}

/** Bounds of a slider: the range of the parameter; null without one. */
const bounds = ({ range }) => (range && range[1] - range[0] < 1e6 ? { low: range[0], high: range[1] } : null);

function Parameter({ leaf, module, value, file, set, fail, isAllowed }) {
  const [text, setText] = useState(null);
  const [isWrong, setIsWrong] = useState(false);
  const { name, type, unit, doc } = leaf;
  const limits = bounds(leaf);
  const isNumber = type === "number" || type === "integer";
  const differs = file !== undefined;
  const enter = (event) => {
    event.preventDefault();
    // Typing and entering at once is faster than rendering.
    const typed = event.type === "submit" ? event.target.querySelector("input").value : text;
    const isTouched = text !== null || (typed !== null && typed !== String(value ?? "NaN"));
    const isGiven = isTouched && typed.trim() !== "";
    const problem = isGiven && isNumber ? wrongly(typed, leaf, module) : null;
    setIsWrong(problem !== null);
    // An invalid text stays for correction.
    if (problem) return fail(problem);
    if (isWrong) fail(null);
    if (isGiven) set(isNumber ? numberOf(typed, unit) : typed);
    setText(null);
    return undefined;
  };
  // Parameters of several modules may have the same name.
  const label = `${module} ${name}${unit ? `, ${unit}` : ""}`;
  // The slider rounds to a hundredth of its range.
  const rounded = ({ target }) => Number(Number(target.value).toPrecision(3));
  const id = `parameter-${leaf.path}-${name}`;
  const choices = type === "enumeration" ? leaf.schema.anyOf[0].enum : null;
  return html`<div class="parameter" data-differs=${differs}>
    <label for=${id} title=${doc}>${name}<small>${doc}</small></label>
    ${isNumber && html`
      ${limits ? html`<input type="range" aria-label=${`${label}, slider`} title=${`${limits.low} to ${limits.high} ${unit}`} min=${limits.low} max=${limits.high} step=${type === "integer" ? 1 : "any"}
        value=${numberOf(text ?? "", unit) ?? value ?? 0} disabled=${!isAllowed} onChange=${(event) => { setText(null); set(rounded(event)); }} onInput=${(event) => setText(String(rounded(event)))} />` : html`<span></span>`}
      <form onSubmit=${enter}><input id=${id} aria-label=${label} aria-invalid=${isWrong ? "true" : undefined} inputmode="decimal" autocomplete="off" disabled=${!isAllowed} value=${text ?? (value ?? "NaN")} onInput=${(event) => setText(event.target.value)} onBlur=${enter} /></form>
      <span class="unit">${unit}</span>`}
    ${type === "boolean" && html`<span></span><input id=${id} aria-label=${label} type="checkbox" disabled=${!isAllowed} checked=${value === true} onChange=${(event) => set(event.target.checked)} /><span></span>`}
    ${choices && html`<span></span><select id=${id} aria-label=${label} disabled=${!isAllowed} value=${value} onChange=${(event) => set(event.target.value)}>${choices.map((choice) => html`<option key=${choice}>${choice}</option>`)}</select><span></span>`}
    ${!isNumber && type !== "boolean" && !choices && html`<span></span><form onSubmit=${enter}><input id=${id} aria-label=${label} autocomplete="off" disabled=${!isAllowed || type !== "string"} value=${text ?? (typeof value === "string" ? value : JSON.stringify(value))} onInput=${(event) => setText(event.target.value)} onBlur=${enter} /></form><span></span>`}
    <span class="was" title=${differs ? `Value in the file: ${file}` : ""}>${differs ? `file: ${file}` : ""}</span></div>`;
}

const nameOf = (path) => path.replace(/^modules\./, "").replaceAll('"', "");

/** The changes to revert, by any client: a goal among them moves the robot. */
function Revert({ differences, revert, close }) {
  return html`<${Dialog} label="Revert" kind="revert" close=${close}>
    <h2>Revert unsaved changes</h2>
    <dl>${differences.map(({ path, file, present, default: usual }) => html`<div class="field" key=${path}><dt>${nameOf(path)}</dt>
      <dd>${present ?? "none"} → ${file ?? usual ?? "the default"}</dd></div>`)}</dl>
    <div class="choices"><button data-first onClick=${close}>Cancel</button>
      <button class="primary" onClick=${() => (close(), revert())}>Revert ${differences.length}</button></div>
  </${Dialog}>`;
}

/** The changes to save, by any client, and their files; or the reason of a refusal. */
function Save({ differences, save, close }) {
  const [files, setFiles] = useState(null);
  const [problem, setProblem] = useState(null);
  const text = differences.map(({ path, present }) => `${path} ${present}`).join();
  useEffect(() => {
    let ended = false;
    post("/settings/save?dry_run", {}).then(
      (found) => !ended && (setFiles(found.files), setProblem(null)),
      (error) => {
        if (!(error instanceof Problem)) throw error;
        if (!ended) setProblem(error);
      },
    );
    return () => (ended = true);
  }, [text]);
  return html`<${Dialog} label="Save" kind="revert" close=${close}>
    <h2>Save changes to the configuration files</h2>
    <dl>${differences.map(({ path, file, present }) => html`<div class="field" key=${path}><dt>${nameOf(path)}</dt>
      <dd>${file ?? "not set"} → ${present ?? "removed"}</dd></div>`)}</dl>
    <p role="status">${files ? html`Files: ${files.map((file, place) => html`${place ? ", " : ""}<code key=${file}>${file}</code>`)}${files.length ? ". Comments and all other content are kept." : "No file to change."}` : problem ? "" : "Determining the files to change."}</p>
    <${Trouble} problem=${problem} />
    <div class="choices"><button data-first onClick=${close}>Cancel</button>
      <button class="primary" disabled=${!files?.length} onClick=${() => (close(), save())}>Save ${differences.length}</button></div>
  </${Dialog}>`;
}

function Panel({ options, setOptions }) {
  const agent = useAgent();
  const interfaces = useInterfaces();
  const properties = useProperties().filter(({ path, access }) => access === "setting" && path.endsWith("/params"));
  const differences = useResource("/settings/differences", 3) ?? [];
  const known = useResource("/parameters", 10) ?? [];
  const byName = useMemo(() => new Map(known.map((parameter) => [`${parameter.module} ${parameter.name}`, parameter])), [known]);
  const [text, setText] = useState("");
  // Changes that can be undone, the last one at the end; the rendered count may lag.
  const undone = useRef([]);
  const [undoable, setUndoable] = useState(0);
  const turn = useRef(Promise.resolve());
  const [problem, setProblem] = useState(null);
  const [said, setSaid] = useState("");
  const [asks, setAsks] = useState(null);
  const shown = properties
    .map(({ path, interface: name }) => ({ path, module: path.slice(0, -"/params".length), fields: leaves(interfaces[name]) }))
    .filter(({ fields, module }) => fields.length && `${module} ${fields.map(({ name }) => name).join(" ")}`.toLowerCase().includes(text.toLowerCase()));
  const readings = useReadings(shown.map(({ path }) => path), 5);
  const isAllowed = agent?.role === "developer";
  const changed = new Map(differences.map((difference) => [difference.path.replaceAll('"', ""), difference]));
  const again = () => reload("/settings/differences", "/properties");
  // One after the other, because concurrent requests may arrive in another order.
  const attempt = (work) => {
    const done = turn.current.then(() => tried(work));
    turn.current = done.catch(() => {});
    return done;
  };
  const tried = async (work) => {
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
      if (done && !isUndo) setUndoable(undone.current.push({ path, leaf, before }));
    });
  };
  const undo = () => {
    const last = undone.current.pop();
    setUndoable(undone.current.length);
    if (last) set(last.path, last.leaf, undefined, true)(last.before);
  };
  const revert = () => attempt(() => remove("/settings")).then((done) => done && ((undone.current = []), setUndoable(0), setSaid("All unsaved changes were reverted")));
  const save = () => attempt(() => post("/settings/save", {})).then((done) => done && setSaid(`Saved: ${done.files.join(", ") || "no changes"}`));
  // Settings of the command line are not saved.
  const own = differences.filter(({ path, origin }) => path.startsWith("modules.") && !origin?.startsWith("--"));
  return html`
    <div class="bar-of-tools">
      <input type="search" placeholder="Module or parameter" aria-label="Search for parameters" value=${text} onInput=${(event) => setText(event.target.value)} />
      <button disabled=${!undoable} onClick=${undo} title="Undo the last change">Undo</button>
      <button disabled=${!own.length || !isAllowed} onClick=${() => setAsks("revert")} title="Revert all unsaved changes, after a confirmation">Revert${own.length ? ` ${own.length}` : ""}</button>
      <button disabled=${!own.length || !isAllowed} onClick=${() => setAsks("save")} title="Save the changes to the configuration files, after a confirmation">Save${own.length ? ` ${own.length}` : ""}</button>
      <span role="status" class="muted">${said}</span>
    </div>
    <${Trouble} problem=${problem} />
    ${asks === "revert" && html`<${Revert} differences=${own} revert=${revert} close=${() => setAsks(null)} />`}
    ${asks === "save" && html`<${Save} differences=${own} save=${save} close=${() => setAsks(null)} />`}
    <div class="scroll parameters">
      ${!isAllowed && agent && html`<p class="doc muted">Changing parameters requires the role developer${agent.role === "operator" ? "; an operator may change those listed in console.operable" : ""}.</p>`}
      ${shown.map(({ path, module, fields }) => html`<section key=${path}>
        <h3>${module}</h3>
        ${fields.map((leaf) => {
          const value = part(readings[path]?.value, leaf.pointer);
          const difference = changed.get(`modules.${module}.params.${leaf.name}`);
          const own = byName.get(`${module} ${leaf.name}`);
          const file = difference && (difference.file ?? difference.default ?? "not set");
          return html`<${Parameter} key=${leaf.pointer} module=${module} leaf=${{ ...leaf, path, range: own?.range }} value=${value} file=${file} isAllowed=${isAllowed || (agent?.role === "operator" && own?.operable === true)} set=${set(path, leaf, value)} fail=${setProblem} />`;
        })}</section>`)}
      ${!shown.length && html`<${Empty}>No parameter matches.</${Empty}>`}
    </div>`;
}

export default { id: "parameters", title: "Parameters", Panel };

// One property: its fields, its writer, its readers, its live value.
import { Age, at, brief, Empty, Field, html, leaves, number, openPanel, part, patch, post, Problem, put, reload, Trouble, unitAt, useAgent, useEffect, useInterfaces, useProperties, useReading, useResource, useSelected, useState, watch } from "/slate.js";

/** A value in one line, with the unit of its schema. */
function written(value, { type, unit, schema }) {
  if (value === undefined) return "–";
  if (type === "number" || type === "integer") return number(value, unit);
  if (Array.isArray(value)) return value.length && typeof value[0] === "object" ? `${value.length} items` : `[${value.slice(0, 8).map((item) => number(item)).join(", ")}${value.length > 8 ? ", …" : ""}]`;
  return brief(value, schema);
}

/** An editor that sets an input without a link, or sends a message. */
function Editor({ property, value }) {
  const agent = useAgent();
  const [text, setText] = useState("");
  const [problem, setProblem] = useState(null);
  const [said, setSaid] = useState("");
  const sends = property.access === "messages";
  useEffect(() => {
    setText(value === undefined ? "" : JSON.stringify(value, null, 1));
    setProblem(null);
    setSaid("");
  }, [property.path]);
  // The present value arrives a moment later.
  useEffect(() => setText((text) => text || (value === undefined ? "" : JSON.stringify(value, null, 1))), [value === undefined]);
  const apply = async (event) => {
    event.preventDefault();
    setProblem(null);
    setSaid("");
    try {
      const body = JSON.parse(text);
      const answer = await (sends ? post : typeof body === "object" ? patch : put)(at(agent.name, property.path), body);
      setSaid(sends ? answer.status : "Set");
      reload("/properties", "/properties?values", "/settings/differences");
    } catch (error) {
      if (error instanceof SyntaxError) setProblem(new Problem(0, `invalid JSON: ${error.message}`, "such as {\"x\": 1.5}"));
      else if (error instanceof Problem) setProblem(error);
      else throw error;
    }
  };
  return html`<form class="editor" onSubmit=${apply}>
    <label>${sends ? "Message" : "Value"} (JSON)<textarea rows="4" spellcheck="false" value=${text} onInput=${(event) => setText(event.target.value)}></textarea></label>
    <div><button class="primary" disabled=${!text.trim()}>${sends ? "Send" : "Set"}</button> <span role="status" class="muted">${said}</span></div>
    <${Trouble} problem=${problem} /></form>`;
}

/** A part of the value by JSON Pointer or JSONPath, live. */
function Part({ path, schema }) {
  const [text, setText] = useState("");
  const [reading, setReading] = useState(null);
  const [problem, setProblem] = useState(null);
  useEffect(() => {
    setReading(null);
    setProblem(null);
    if (!text) return undefined;
    return watch(path, (reading) => (setProblem(null), setReading(reading)), { rate: 5, part: text, fail: setProblem });
  }, [path, text]);
  const enter = (event) => {
    event.preventDefault();
    const wanted = new FormData(event.target).get("part").trim();
    setText(wanted && !/^[/$]/.test(wanted) ? `/${wanted.replaceAll(".", "/")}` : wanted);
  };
  const isPath = text.startsWith("$");
  const found = reading ? (isPath ? reading.value : [reading.value]) : [];
  const unit = isPath ? "" : unitAt(schema, text);
  return html`<form class="part" onSubmit=${enter}>
    <label>Part <input name="part" autocomplete="off" spellcheck="false" placeholder="/field/0 or $..x" title="A JSON Pointer or a JSONPath; Enter shows the values there" defaultValue=${text} /></label>
    <${Trouble} problem=${problem} />
    ${reading && html`<output>${found.slice(0, 32).map((value, at) => html`<code key=${at}>${typeof value === "number" ? number(value, unit) : JSON.stringify(value)}</code>`)}
        ${!found.length && html`<span class="muted">No value there.</span>`}${found.length > 32 && html`<span class="muted">and ${found.length - 32} more</span>`}</output>
      ${["number", "boolean"].includes(typeof found[0]) && html`<div><button type="button" title=${`${isPath ? "Plot the first value" : "Plot the value"} over time`} onClick=${() => openPanel("plot", { series: [path + text] })}>Plot this part</button></div>`}`}
  </form>`;
}

function Panel() {
  const path = useSelected();
  const property = useProperties().find((property) => property.path === path);
  const schema = useInterfaces()[property?.interface];
  const links = useResource("/links", 5) ?? [];
  const reading = useReading(property && property.access !== "messages" ? path : null, 10);
  if (!path) return html`<${Empty}>Select a property in the Properties panel.</${Empty}>`;
  if (!property) return html`<${Empty}>Property /${path} does not exist.</${Empty}>`;
  const own = `/${path}`;
  const readers = links.filter(({ from }) => from === own || from.startsWith(`${own}/`)).map(({ to }) => to);
  const isLinked = links.some(({ to }) => to === path);
  const writer = { output: "its module", queue: "its link", setting: isLinked ? "its link" : "configuration or operator", messages: "any sender" }[property.access];
  return html`<div class="scroll inspector" tabindex="0" role="group" aria-label="Inspector">
    <div class="group"><code>/${path}</code></div>
    <p class="doc">${property.doc}</p>
    <dl>
      <${Field} name="Interface" title=${schema?.description}>${property.interface}</${Field}>
      <${Field} name="Written by">${writer}</${Field}>
      <${Field} name="Read by">${readers.length ? readers.join(", ") : "no link"}</${Field}>
      ${reading && html`<${Field} name="Sequence number, age">${reading.sequence}, <${Age} time=${reading.time} /></${Field}>`}
    </dl>
    ${reading && html`<table><thead><tr><th>Field</th><th class="number">Value</th><th>Description</th><td></td></tr></thead><tbody>
      ${leaves(schema).map((leaf) => html`<tr key=${leaf.pointer}><th scope="row" title=${leaf.pointer}>${leaf.name || "value"}</th>
        <td class="number">${written(part(reading.value, leaf.pointer), leaf)}</td><td class="muted wrap">${leaf.doc}</td>
        <td>${["number", "integer", "boolean"].includes(leaf.type) && html`<button class="quiet" title="Plot over time" aria-label=${`Plot ${leaf.name || "value"}`} onClick=${() => openPanel("plot", { series: [path + leaf.pointer] })}>Plot</button>`}</td></tr>`)}</tbody></table>`}
    ${reading && html`<${Part} key=${path} path=${path} schema=${schema} />`}
    ${!reading && property.access !== "messages" && html`<p class="doc muted">No value yet.</p>`}
    ${(property.access === "messages" || (property.access === "setting" && !isLinked)) && html`<${Editor} property=${property} value=${reading?.value} />`}
    ${reading && html`<details class="raw"><summary>As JSON</summary><pre>${JSON.stringify(reading.value, null, 1)}</pre></details>`}
  </div>`;
}

export default { id: "inspector", title: "Inspector", Panel };

// The toolbar of a map: its tools with their settings, and what is shown.
import { html, Menu, word } from "/slate.js";
import { LAYERS } from "/map/paint.js";
import { BRUSHES, MARKS } from "/map/tools.js";

const NO_GOAL = {
  viewer: "Setting a goal requires the role operator; this token has the role viewer",
  operator: "No input or inbox of this agent accepts a goal; "
    + "parameters require the role developer, or an entry in console.operable",
  developer: "No input, parameter or inbox of this agent accepts a goal",
};

const TITLES = {
  move: "Drag to pan; wheel to zoom",
  goal: "Click to set the goal; drag to set its heading; with Shift, it follows the other goals of a mission",
  pose: "Drag the estimate to the robot's true position, "
    + "or click beside it to set a new pose and drag to set its heading",
  paint: "Drag to paint cells of the occupancy grid",
  measure: "Drag to measure a distance",
};

/** The buttons of the tools; those for poses and cells only with a target. */
function Tools({ targetsByTool, role, tool, setTool }) {
  const isMissing = (name) => name === "goal" && !targetsByTool.goal.length;
  const button = (name) =>
    html`<button class="tool" aria-pressed=${tool === name} disabled=${isMissing(name)}
      title=${isMissing(name) ? NO_GOAL[role] : TITLES[name]} onClick=${() => setTool(name)}>${word(name)}</button>`;
  return html`
    ${button("move")}
    ${button("goal")}
    ${targetsByTool.pose.length > 0 && button("pose")}
    ${targetsByTool.paint.length > 0 && button("paint")}
    ${button("measure")}`;
}

/** The target of a tool that has several. */
const Target = ({ choices, target, setPath }) =>
  html`<select aria-label="Target" value=${target?.path} onChange=${(event) => setPath(event.target.value)}>
    ${choices.map(({ path }) => html`<option key=${path} value=${path}>${path}</option>`)}</select>`;

/** The state and the width that a stroke paints. */
const Brush = ({ mark, setMark, brush, setBrush }) => html`
  <select aria-label="Cell state" value=${mark} onChange=${(event) => setMark(event.target.value)}>
    ${Object.entries(MARKS).map(([name, title]) => html`<option key=${name} value=${name}>${title}</option>`)}</select>
  <select aria-label="Brush width" value=${brush} onChange=${(event) => setBrush(Number(event.target.value))}>
    ${BRUSHES.map((width) => html`<option key=${width} value=${width}>${width} m</option>`)}</select>`;

/** Commands for a mission with goals. */
function Mission({ mission, command }) {
  const [name, title] = mission.is_paused ? ["RESUME", "Resume"] : ["PAUSE", "Pause"];
  return html`<button class="tool" onClick=${() => command(name)}>${title}</button>
    <button class="tool" onClick=${() => command("CANCEL")}>Cancel goals</button>`;
}

function Undo({ last, undo }) {
  const title = last ? `Undo: ${last.words}` : "Nothing to undo";
  return html`<button class="tool" disabled=${!last} title=${title} onClick=${undo}>Undo</button>`;
}

/** The robot that stays in the middle of the view. */
const Follow = ({ robots, follow, setOptions }) =>
  html`<select aria-label="Follow" value=${follow} onChange=${(event) => setOptions({ follow: event.target.value })}>
    <option value="">Follow none</option>
    ${robots.map(({ name }) => html`<option key=${name} value=${name}>Follow ${name}</option>`)}</select>`;

const Layers = ({ isShown, setOptions, clearTrails }) => html`<${Menu} title="Layers">
  ${Object.entries(LAYERS).map(([name, title]) => html`<label key=${name}><input type="checkbox"
    checked=${isShown(name)} onChange=${(event) => setOptions({ [name]: event.target.checked })} /> ${title}</label>`)}
  <button onClick=${clearTrails}>Clear trails</button>
</${Menu}>`;

/** The bar above a map. */
export function Toolbar({ content, tools, changes, command, isShown, fitBounds, clearTrails, options, setOptions }) {
  const { agent, scene, targetsByTool } = content;
  const { tool, setTool, choices, mission } = tools;
  return html`<div class="bar-of-tools">
    <${Tools} targetsByTool=${targetsByTool} role=${agent?.role} tool=${tool} setTool=${setTool} />
    ${choices.length > 1 && html`<${Target} ...${tools} />`}
    ${tool === "paint" && html`<${Brush} ...${tools} />`}
    ${mission?.goals.length > 0 && html`<${Mission} mission=${mission} command=${command} />`}
    ${tool in targetsByTool && html`<${Undo} last=${changes.last} undo=${changes.undo} />`}
    <button class="tool" onClick=${fitBounds} title="Fit the world into the view (f)">Fit</button>
    ${scene.robots.length > 0
      && html`<${Follow} robots=${scene.robots} follow=${options.follow ?? ""} setOptions=${setOptions} />`}
    <span class="grow"></span>
    <${Layers} isShown=${isShown} setOptions=${setOptions} clearTrails=${clearTrails} />
  </div>`;
}

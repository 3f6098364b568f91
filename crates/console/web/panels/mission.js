// The mission of a robot: its net, state machines, tree or program, as it is or was at the time shown; and a developer's orders.
import { at, Empty, html, isPast, post, Problem, Trouble, useAgent, useEffect, useMemo, usePlayback, useProperties, useReadings, useRef, useSize, useState, word } from "/slate.js";
import { Drawing } from "/mission/drawing.js";
import { drawing } from "/mission/graph.js";
import { Program } from "/mission/program.js";

const NOTATIONS = { PETRI_NET: "Petri net", BEHAVIOR_TREE: "behavior tree", STATE_MACHINES: "state machines", GOLOG_PROGRAM: "Golog program" };
const CONDITIONS = { HOLDS: "true", DOES_NOT_HOLD: "false", UNKNOWN: "unknown" };
const NONE = 65535;

/** What an element can be forced to: the words of buttons, and the outcomes that they order. */
function forces(element, item) {
  const runs = ["RUNNING", "SUSPENDED"].includes(item?.status);
  switch (element.kind) {
    case "TRANSITION":
      return [["Force", "SUCCESS"]];
    case "STATE":
      return [["Force", "SUCCESS"]];
    case "EVENT":
      return [["Force", "SUCCESS"]];
    case "CONDITION":
      return [["Force true", "SUCCESS"], ["Force false", "FAILURE"]];
    case "ACTION":
      return runs ? [["Force success", "SUCCESS"], ["Force failure", "FAILURE"]] : [];
    case "PLACE":
      return item && item.text ? [["Force success", "SUCCESS"], ["Force failure", "FAILURE"]] : [];
    default:
      return [];
  }
}

/** The selected element: what it does or why it waits, its transitions, and what can be forced. */
function Selected({ element, items, edges, refused, force, close }) {
  const item = items.get(element.number);
  const own = edges.filter(({ from, label }) => from === element.number && label);
  return html`<section aria-label=${element.label}>
    <header><b>${element.label}</b><button class="quiet" aria-label="Close" onClick=${close}>✕</button></header>
    <p class="muted">${word(element.kind)}${element.mark !== "PLAIN" ? `, ${word(element.mark).toLowerCase()}` : ""}</p>
    <p class="why" data-status=${item?.status ?? "IDLE"}>${item ? html`<b>${item.status === "MARKED" ? `${item.count} ${item.count === 1 ? "token" : "tokens"}` : word(item.status)}</b>${item.text ? `: ${item.text}` : ""}` : "At rest"}</p>
    ${own.length > 0 && html`<h3>Transitions</h3><ul class="rows">${own.map((edge) => html`<li key=${edge.number}>${edge.label}${items.get(edge.number) ? html` <span class="muted">${items.get(edge.number).text}</span>` : ""}</li>`)}</ul>`}
    <p class="orders">${forces(element, item).map(([text, outcome]) => html`<button key=${text} disabled=${Boolean(refused)} title=${refused} onClick=${() => force(element, outcome)}>${text}</button>`)}</p>
    ${refused && forces(element, item).length > 0 && html`<p class="muted">${refused}</p>`}
  </section>`;
}

function Conditions({ items }) {
  const own = items.filter(({ status }) => CONDITIONS[status]);
  if (!own.length) return html`<section aria-label="Conditions"><h3>Conditions</h3><p class="muted">none reported</p></section>`;
  return html`<section aria-label="Conditions"><h3>Conditions</h3><dl>${own.map(({ status, text }) => html`<div class="field" key=${text}><dt>${text}</dt><dd>${CONDITIONS[status]}</dd></div>`)}</dl></section>`;
}

// Distance from the border of the view at which an element is followed, pixels.
const NEAR = 30;

/** Keeps what the mission does in view, as long as nothing is selected; a part that runs above all. */
function useFollowing(box, items, isFree) {
  const active = [...items.values()].filter(({ status }) => ["MARKED", "CURRENT", "RUNNING"].includes(status));
  const key = active.map(({ element }) => element).join(" ");
  useEffect(() => {
    const view = box.current?.getBoundingClientRect();
    if (!view || !isFree) return;
    const shown = active.filter(({ text, status }) => text || status === "CURRENT");
    const wanted = (shown.length ? shown : active).map(({ element }) => box.current.querySelector(`[data-element="${element}"]`)).filter(Boolean);
    const target = wanted.at(-1)?.getBoundingClientRect();
    if (!target) return;
    const off = (from, to, low, high) => (from < low + NEAR ? from - low - NEAR : to > high - NEAR ? Math.min(to - high + NEAR, from - low - NEAR) : 0);
    box.current.scrollBy(off(target.left, target.right, view.left, view.right), off(target.top, target.bottom, view.top, view.bottom));
  }, [key, isFree]);
}

/** Why the mission can't be changed; empty if it can. */
function refusal(agent, activity, isPlayed) {
  if (isPlayed) return "A recording is played, and can't be changed.";
  if (isPast()) return "The past can't be changed: go live.";
  if (agent?.role !== "developer") return "Requires the role developer.";
  return activity.state === "RUNNING" ? "" : "The mission has ended.";
}

function Mission({ module, name, graph, activity }) {
  const agent = useAgent();
  const isPlayed = Boolean(usePlayback());
  const [selected, setSelected] = useState({ graph: 0, number: null });
  const [problem, setProblem] = useState(null);
  const drawn = drawing(graph);
  const items = useMemo(() => new Map(activity.items.filter(({ element }) => element !== NONE).map((item) => [item.element, item])), [activity]);
  const chosen = selected.graph === graph.id ? selected.number : null;
  const choose = (number) => setSelected({ graph: graph.id, number });
  const refused = refusal(agent, activity, isPlayed);
  const order = async (command, element = 0, outcome = "SUCCESS") => {
    try {
      await post(at(agent.name, `${module}/orders`), { command, outcome, element, graph: graph.id });
      setProblem(null);
    } catch (error) {
      if (!(error instanceof Problem)) throw error;
      setProblem(error);
    }
  };
  const box = useRef(null);
  const [measured, size] = useSize();
  const hold = useMemo(() => (element) => {
    box.current = element;
    measured(element);
  }, []);
  useFollowing(box, items, chosen === null);
  const isGolog = graph.notation === "GOLOG_PROGRAM";
  const offered = drawn.elements.filter(({ kind, number }) => kind === "EVENT" || (kind === "ACTION" && graph.notation === "STATE_MACHINES" && items.has(number)));
  const { is_paused: isPaused } = activity;
  const state = isPaused && activity.state === "RUNNING" ? "PAUSED" : activity.state;
  return html`
    <div class="bar-of-tools" role="toolbar" aria-label="Mission of ${name}">
      <b>${graph.name}</b><span class="muted">${NOTATIONS[graph.notation]}</span><span class="chip mission-state" data-state=${state}>${word(state)}</span>
      <span class="grow"></span>
      <button disabled=${Boolean(refused)} title=${refused || (isPaused ? "The mission continues" : "The mission makes no more steps; an action that runs goes on to its end")} onClick=${() => order(isPaused ? "RESUME" : "PAUSE")}>${isPaused ? "Resume" : "Pause"}</button>
      <button disabled=${Boolean(refused) || !isPaused} title=${refused || (isPaused ? "One step" : "Pause the mission first")} onClick=${() => order("STEP")}>Step</button>
    </div>
    ${activity.reason && html`<p class="mission-reason muted">${activity.reason}</p>`}
    ${(graph.is_cut || activity.is_cut) && html`<p class="mission-reason stale">The mission has more elements than are shown.</p>`}
    <${Trouble} problem=${problem} />
    <div class="mission-tile"><div class="graph mission">
      <div class="scroll" ref=${hold} tabindex="0" role="group" aria-label="Mission">${isGolog
        ? html`<${Program} items=${activity.items} chosen=${chosen} choose=${choose} />`
        : html`<${Drawing} drawn=${drawn} items=${items} chosen=${chosen} choose=${choose} room=${size?.width ?? drawn.width} name=${`${NOTATIONS[graph.notation]} ${graph.name}`} />`}</div>
      <div class="links" role="group" aria-label="Details of the mission">
        ${chosen !== null && drawn.elements[chosen]
          ? html`<${Selected} element=${isGolog && items.has(chosen) ? { ...drawn.elements[chosen], label: items.get(chosen).text } : drawn.elements[chosen]} items=${items} edges=${drawn.elements.filter(({ kind }) => kind === "EDGE")} refused=${refused} force=${(element, outcome) => order("FORCE", element.number, outcome)} close=${() => setSelected({ graph: 0, number: null })} />`
          : html`<p class="muted">Select an element to see why it waits.</p>`}
        ${offered.length > 0 && html`<section aria-label="Actions and events"><h3>${isGolog ? "Exogenous actions" : "Actions"}</h3><ul class="rows">${offered.map(({ number, label }) => html`<li key=${number}><button class="quiet" data-element=${number} aria-pressed=${chosen === number} onClick=${() => choose(number)}>${items.get(number)?.text || label}</button></li>`)}</ul></section>`}
        <${Conditions} items=${activity.items} />
      </div>
    </div></div>`;
}

/** The missions of an agent: the module of each, and the robot's name. */
const missionsOf = (properties) => properties.filter((property) => property.interface === "MissionGraph" && property.access === "output").map(({ path }) => {
  const module = path.replace(/\/[^/]*$/, "");
  return { module, name: module.includes("/") ? module.split("/")[0] : module };
});

function Panel({ options, setOptions }) {
  const missions = missionsOf(useProperties());
  const agent = useAgent();
  const graphs = useRef(new Map());
  const shown = missions.find(({ module }) => module === options.module) ?? missions[0];
  const paths = shown ? [`${shown.module}/graph`, `${shown.module}/activity`] : [];
  const readings = useReadings(paths);
  const [graph, activity] = paths.map((path) => readings[path]?.value);
  if (graph) graphs.current.set(graph.id, graph);
  if (!agent) return html`<${Empty}>Waiting for the agent.</${Empty}>`;
  if (!shown) {
    return html`<${Empty}>No robot of this agent has a mission. A Plan of the kind <code>petri_net_plan</code>, <code>behavior_tree_plan</code>, <code>behavior_plan</code> or <code>golog_plan</code> follows one; <code>slate run patrol</code> is an example.</${Empty}>`;
  }
  const known = activity && graphs.current.get(activity.graph);
  const choice = missions.length > 1 && html`<div class="bar-of-tools">${missions.map(({ module, name }) => html`<button class="tool" key=${module} aria-pressed=${module === shown.module} onClick=${() => setOptions({ module })}>${name}</button>`)}</div>`;
  if (!activity) return html`${choice}<${Empty}>${isPast() ? "The mission had not begun at this time, or is not in the last seconds." : "The mission has not begun yet."}</${Empty}>`;
  if (!known) return html`${choice}<${Empty}>${activity.reason ? `The mission can't run: ${activity.reason}` : "Its file was not read yet."}</${Empty}>`;
  return html`${choice}<${Mission} key=${shown.module} ...${shown} graph=${known} activity=${activity} />`;
}

export default { id: "mission", title: "Mission", Panel };

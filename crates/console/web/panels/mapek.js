// A robot as MAPE-K: outputs of its blocks, the current route, the actions of Execute.
import { Age, brief, conditionOf, Empty, html, Problem, put, reload, select, Trouble, useAgent, useInterfaces, useMemo, useProperties, useReadings, useResource, useState, word } from "/slate.js";
import { robots } from "/blocks.js";
import { useRoute } from "/route.js";
import { Strip } from "/strip.js";

const ROUTES = ["IDLE", "DELIBERATIVE", "REACTIVE"];

function Block({ module, interfaces, readings, active }) {
  const short = module.name.slice(module.name.lastIndexOf("/") + 1);
  const state = module.panics ? "bad" : module.condition === "INACTIVE" ? "off" : module.misses ? "degraded" : undefined;
  return html`<article class="block" data-active=${active ?? ""} data-state=${state}>
    <header><b>${short}</b> <span class="muted">${module.condition === "WORKING" ? "" : conditionOf(module)}</span></header>
    ${module.outputs.map(({ path, interface: name, doc }) => {
      const reading = readings[path];
      return html`<button class="output" key=${path} title=${`${doc} /${path}`} onClick=${() => select(path)}>
        <span class="muted">${path.slice(module.name.length + 1)}</span><span class="number">${reading ? brief(reading.value, interfaces[name]) : "none yet"}</span>
        ${reading && html`<${Age} time=${reading.time} limit=${path.endsWith("/percept") ? 1 : Infinity} />`}</button>`;
    })}
  </article>`;
}

/** A switch of a module, for a role that may use it. */
function Switch({ module, isAllowed, fail }) {
  const isOn = module.condition !== "INACTIVE";
  // The shown state may be a second old; a press sets what the user sees.
  const turn = async ({ target }) => {
    try {
      await put(`/modules/${encodeURIComponent(module.name).replaceAll("%2F", "/")}`, { enabled: target.checked });
      reload("/modules");
    } catch (problem) {
      if (!(problem instanceof Problem)) throw problem;
      fail(problem);
    }
  };
  return html`<label class="switch"><input type="checkbox" role="switch" checked=${isOn} disabled=${!isAllowed} onChange=${turn} /> Enable ${module.name.slice(module.name.lastIndexOf("/") + 1)}</label>`;
}

/** An argument as a person reads it. */
const argument = (value) => (Number.isInteger(value) ? value : value.toFixed(2));

/** The actions that wait in the Pipeline, in the order of their turns. */
function Waiting({ actions }) {
  return html`<h3>Waiting</h3>
    <ol class="waiting" aria-label="Waiting actions">${actions.map(({ action, route, ticket, rank, queued }, turn) => html`<li key=${turn}>
      <span class="route" data-route=${route}>${action.kind}</span>(${action.arguments.map(argument).join(", ")})
      <span class="muted"> ${route === "REACTIVE" ? `reflex, rank ${rank}` : `plan, action ${ticket}`} </span><${Age} time=${queued} /></li>`)}
      ${!actions.length && html`<li class="muted">none</li>`}</ol>`;
}

function Execute({ status, waiting }) {
  if (!status) return html`<p class="muted">none yet</p>`;
  const depths = (status.tree || status.running || "").split(" > ").filter(Boolean);
  const ended = [...status.ended].reverse().slice(0, 5);
  return html`
    <ol class="actions" aria-label="Running actions">${depths.length ? depths.map((name, depth) => html`<li key=${depth} style=${{ paddingLeft: `${depth * 14}px` }}>${depth ? "└ " : ""}${name}</li>`) : html`<li class="muted">none</li>`}</ol>
    <table class="pipeline"><caption class="hidden">Pipeline</caption><tbody>
      <tr><th scope="row">Reflexes pending</th><td class="number">${status.high}</td><th scope="row">accepted</th><td class="number">${status.reflexes}</td></tr>
      <tr><th scope="row">Actions pending</th><td class="number">${status.normal}</td><th scope="row">completed</th><td class="number">${status.completed}</td></tr>
      <tr><th scope="row">Cancelled</th><td class="number">${status.cancelled}</td><th scope="row" title="Actions planned before a reflex or a failure">discarded</th><td class="number">${status.dropped}</td></tr></tbody></table>
    <${Waiting} actions=${waiting} />
    <h3>Last ended</h3>
    <ul class="ended">${ended.map(({ number, kind, ending, route }) => html`<li key=${number}><span class="route" data-route=${route}>${kind}</span> <span class="muted">${word(ending)}</span></li>`)}
      ${!ended.length && html`<li class="muted">none</li>`}</ul>`;
}

function Robot({ robot, isAllowed, fail }) {
  const interfaces = useInterfaces();
  const paths = useMemo(() => Object.values(robot.blocks).flat().flatMap(({ outputs }) => outputs.map(({ path }) => path)), [robot]);
  const readings = useReadings(paths, 5);
  const status = readings[robot.status]?.value;
  const { Monitor, Analyze, Plan, Execute: executes, Knowledge, ReactiveModel } = robot.blocks;
  const route = useRoute(robot.name, status?.route);
  const cards = (modules, active) => modules.map((module) => html`<${Block} key=${module.name} module=${module} interfaces=${interfaces} readings=${readings} active=${active} />`);
  const deliberative = route === "DELIBERATIVE" ? "DELIBERATIVE" : undefined;
  const reactive = route === "REACTIVE" ? "REACTIVE" : undefined;
  return html`<section class="robot" aria-label=${`MAPE-K of ${robot.name}`}>
    <header><h2>${robot.name}</h2><span class="route" data-route=${route}>${word(route)}</span></header>
    <${Strip} path=${robot.status} pointer="/route" values=${ROUTES} name="Route over the last minute" />
    <div class="mapek">
      <div class="stage monitor"><h3>Monitor</h3>${cards(Monitor, deliberative)}</div>
      <div class="stage analyze"><h3>Analyze</h3>${cards(Analyze, deliberative)}</div>
      <div class="stage plan"><h3>Plan</h3>${cards(Plan, deliberative)}
        <p class="muted" title="Actions planned before the last reflex or failure are discarded">${status ? `${status.ticket} actions planned, ${status.epoch} reflexes and failures${status.replan ? "; replanning requested" : ""}` : ""}</p></div>
      <div class="stage execute"><h3>Execute</h3>
        ${executes.map(({ name, outputs }) => html`<article class="block" key=${name} data-active=${route ?? ""}><header><b>${name.slice(name.lastIndexOf("/") + 1)}</b> ${readings[robot.status] && html`<${Age} time=${readings[robot.status].time} />`}</header>
          <${Execute} status=${status} waiting=${readings[`${name}/waiting`]?.value.actions ?? []} />
          ${outputs.filter(({ path }) => path !== robot.status && path !== `${name}/waiting`).map(({ path, interface: name }) => html`<button class="output" key=${path} onClick=${() => select(path)}><span class="muted">${path.split("/").at(-1)}</span><span class="number">${readings[path] ? brief(readings[path].value, interfaces[name]) : "none yet"}</span>
            ${readings[path] && html`<${Age} time=${readings[path].time} />`}</button>`)}</article>`)}</div>
      <div class="stage reactive-stage"><h3>ReactiveModel: sensors to Execute directly</h3><div class="row">${ReactiveModel.map((module) => html`<div key=${module.name}>
        ${cards([module], module.condition === "WORKING" ? reactive : undefined)}<${Switch} module=${module} isAllowed=${isAllowed} fail=${fail} /></div>`)}</div></div>
      <div class="stage knowledge"><h3>Knowledge</h3><div class="row">${cards(Knowledge)}</div></div>
    </div></section>`;
}

function Panel({ options, setOptions }) {
  const modules = useResource("/modules", 1);
  const properties = useProperties();
  const links = useResource("/links", 5);
  const agent = useAgent();
  const [problem, setProblem] = useState(null);
  const found = useMemo(() => (modules && links ? robots(modules, properties, links) : null), [modules, properties, links]);
  if (!found) return html`<${Empty}>Waiting for the agent.</${Empty}>`;
  if (!found.length) return html`<${Empty}>This agent has no Execute module, hence no MAPE-K robot.</${Empty}>`;
  const robot = found.find(({ name }) => name === options.robot) ?? found[0];
  return html`
    ${found.length > 1 && html`<div class="bar-of-tools">${found.map(({ name }) => html`<button class="tool" key=${name} aria-pressed=${name === robot.name} onClick=${() => setOptions({ robot: name })}>${name}</button>`)}</div>`}
    <${Trouble} problem=${problem} />
    <div class="scroll" tabindex="0" role="group" aria-label="Architecture"><${Robot} key=${robot.name} robot=${robot} isAllowed=${agent?.role === "developer"} fail=${setProblem} /></div>`;
}

export default { id: "mapek", title: "MAPE-K", Panel };

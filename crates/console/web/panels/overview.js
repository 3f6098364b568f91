// The state of the agent at a glance, exceptional conditions first.
import { conditionOf, duration, Empty, Field, html, number, useInterfaces, useProperties, useReadings, useResource, word } from "/slate.js";
import { useRoute } from "/route.js";

const HEALTHY = ["WORKING", "INACTIVE"];

function Robot({ status, name }) {
  const route = useRoute(name, status?.route);
  return html`<section>
    <div class="group"><h3>${name}</h3></div><dl>
    <${Field} name="Route"><span class="route" data-route=${route}>${route ? word(route) : "–"}</span></${Field}>
    <${Field} name="Action">${status?.tree || status?.running || "none"}</${Field}>
    <${Field} name="Pending">${status ? `${status.normal} planned, ${status.high} reflexes` : "–"}</${Field}>
    <${Field} name="Route switches">${status?.route_switches ?? "–"}</${Field}>
  </dl></section>`;
}

const Gate = ({ name, state }) => html`<${Field} name=${name} state=${state && state.mode !== "ARMED" ? "degraded" : undefined}
  title="State of the gate, and priority of the current command">
  ${state ? `${word(state.mode)}, ${state.age === null ? "safe command" : word(state.priority)}` : "–"}</${Field}>`;

function Panel() {
  const properties = useProperties();
  const interfaces = useInterfaces();
  const modules = useResource("/modules", 2);
  const actuators = useResource("/actuators", 5) ?? [];
  const of = (name) => properties.filter((property) => property.interface === name && property.access === "output").map(({ path }) => path);
  const [statuses, metrics] = [of("ExecuteStatus"), of("Metrics")];
  const clearances = of("Clearance");
  const gates = actuators.map(({ name }) => `${name}/gate`);
  const readings = useReadings([...statuses, ...gates, ...metrics, ...clearances, "loop/state", "loop/histogram"], 4);
  const value = (path) => readings[path]?.value;
  if (modules === undefined) return html`<${Empty}>Waiting for the agent.</${Empty}>`;
  const ill = modules.filter(({ condition, misses, panics }) => !HEALTHY.includes(condition) || misses || panics);
  const [loop, cycle] = [value("loop/state"), value("loop/histogram")];
  return html`<div class="overview scroll" tabindex="0" role="group" aria-label="Overview">
    ${ill.length > 0 && html`<section><div class="group"><h3>Needs attention</h3></div><dl>
      ${ill.map(({ name, misses, panics, ...module }) => html`<${Field} key=${name} name=${name} state=${HEALTHY.includes(module.condition) ? "degraded" : "bad"}>
        ${conditionOf(module)}${misses ? `, ${misses} misses` : ""}${panics ? `, ${panics} panics` : ""}</${Field}>`)}</dl></section>`}
    ${statuses.map((path) => html`<${Robot} key=${path} name=${path.split("/")[0]} status=${value(path)} />`)}
    ${clearances.length > 0 && html`<section><div class="group"><h3>Clearance</h3></div><dl>
      ${clearances.map((path) => html`<${Field} key=${path} name=${path.replace(/^simulator\//, "").replace(/\/clearance$/, "")}>
        ${value(path) ? number(value(path).distance, "m") : "–"}</${Field}>`)}</dl></section>`}
    ${gates.length > 0 && html`<section><div class="group"><h3>Actuators</h3></div><dl>
      ${gates.map((path) => html`<${Gate} key=${path} name=${path.replace(/\/gate$/, "")} state=${value(path)} />`)}</dl></section>`}
    ${metrics.map((path) => html`<section key=${path}><div class="group"><h3>${path.replace(/\/metrics$/, "")}</h3></div><dl>
      ${Object.entries(interfaces.Metrics?.properties ?? {}).filter(([name]) => name !== "reserved").map(([name, schema]) =>
        html`<${Field} key=${name} name=${word(name)} title=${schema.description}>${Number.isFinite(value(path)?.[name]) ? number(value(path)[name], schema["x-unit"]) : "–"}</${Field}>`)}</dl></section>`)}
    <section><div class="group"><h3>Agent</h3></div><dl>
      ${modules.length > 0 && html`<${Field} name="Modules">${modules.filter(({ condition }) => condition === "WORKING").length} of ${modules.length} working</${Field}>`}
      <${Field} name="Cycles">${loop?.cycles ?? "–"}</${Field}>
      <${Field} name="Cycle duration" title="Median and 99th percentile">${cycle ? `${duration(cycle.p50)}, p99 ${duration(cycle.p99)}` : "–"}</${Field}>
      <${Field} name="Overruns" state=${loop?.overruns ? "degraded" : undefined}>${loop?.overruns ?? "–"}</${Field}>
    </dl></section>
  </div>`;
}

export default { id: "overview", title: "Overview", Panel };

// How long everything takes: cycles, stages, modules.
import { Bar, duration, Empty, html, useReadings, useResource, useState, word } from "/slate.js";

const STAGES = ["PreLoop", "SensorAcquire", "SensorPrepare", "SensorProcess", "WorldState", "Think", "Skill", "Act", "ActExec", "PostLoop"];

const share = (part, whole) => (whole ? part / whole : 0);

function Row({ name, condition, histogram, timing, most, misses, panics }) {
  const state = panics || condition === "ILL" ? "bad" : misses ? "degraded" : condition === "INACTIVE" ? "off" : undefined;
  const cell = (value) => html`<td class="number">${value === undefined ? "–" : duration(value)}</td>`;
  return html`<tr data-state=${state}>
    <th scope="row">${name}</th><td>${condition === undefined ? "" : word(condition)}</td>
    <td class="number">${timing?.period ? `${(1e9 / timing.period).toFixed(1)} Hz` : "–"}</td>
    ${cell(timing?.jitter)}${cell(histogram?.p50)}${cell(histogram?.p90)}${cell(histogram?.p99)}${cell(histogram?.max)}
    <td><${Bar} share=${share(histogram?.p99 ?? 0, most)} label=${histogram ? `99 of 100 within ${duration(histogram.p99)}` : "nothing yet"} /></td>
    <td class="number">${misses ?? "–"}</td><td class="number">${panics ?? "–"}</td></tr>`;
}

function Head({ first, sort, setSort }) {
  const column = (name, id, title) => html`<th class="number" aria-sort=${sort === id && id ? "descending" : undefined} title=${title}>
    ${id && setSort ? html`<button class="quiet" onClick=${() => setSort(id)}>${name}${sort === id ? " ▾" : ""}</button>` : name}</th>`;
  return html`<thead><tr><th>${first}</th><th>Condition</th>${column("Rate")}${column("Jitter", "", "The greatest difference of neighbouring periods")}
    ${column("Median", "p50")}${column("90 %", "p90")}${column("99 %", "p99")}${column("Longest", "max")}
    <th>99 % of the period</th>${column("Misses", "", "Ticks that took longer than their deadline")}${column("Panics")}</tr></thead>`;
}

function Panel() {
  const [sort, setSort] = useState("p99");
  const modules = useResource("/modules", 2);
  const properties = useResource("/properties", 5) ?? [];
  const found = properties.map(({ path }) => path).filter((path) => /^loop\/[^/]+\/histogram$/.test(path));
  // In the order in which they run; those of another loop behind them.
  const rank = (path) => (STAGES.indexOf(path.split("/")[1]) + STAGES.length + 1) % (STAGES.length + 1);
  const stages = found.sort((one, other) => rank(one) - rank(other));
  const names = (modules ?? []).map(({ name }) => name);
  const readings = useReadings(["loop/state", "loop/histogram", ...stages, ...names.flatMap((name) => [`${name}/histogram`, `${name}/timing`])], 2);
  const value = (path) => readings[path]?.value;
  if (!modules) return html`<${Empty}>Waiting for the agent.</${Empty}>`;
  const cycle = value("loop/histogram");
  const period = Math.min(...names.map((name) => value(`${name}/timing`)?.period).filter(Boolean), Infinity);
  const whole = Number.isFinite(period) ? period : (cycle?.max ?? 0);
  const sorted = [...modules].sort((one, other) => (value(`${other.name}/histogram`)?.[sort] ?? -1) - (value(`${one.name}/histogram`)?.[sort] ?? -1));
  return html`<div class="scroll timing" tabindex="0" role="region" aria-label="Timing"><table>
    <${Head} first="Loop" />
    <tbody><${Row} name="A cycle" histogram=${cycle} most=${whole} misses=${value("loop/state")?.overruns} />
      ${stages.filter(value).map((path) => html`<${Row} key=${path} name=${path.split("/")[1]} histogram=${value(path)} most=${whole} />`)}</tbody></table>
    <table><${Head} first="Module" sort=${sort} setSort=${setSort} />
    <tbody>${sorted.map((module) => html`<${Row} key=${module.name} ...${module} histogram=${value(`${module.name}/histogram`)} timing=${value(`${module.name}/timing`)} most=${whole} />`)}</tbody>
  </table></div>`;
}

export default { id: "timing", title: "Timing", Panel };

// Durations of cycles, stages, modules and threads.
import { Bar, conditionOf, duration, Empty, html, useMemo, useReadings, useRef, useResource, useState } from "/slate.js";

const STAGES = ["PreLoop", "SensorAcquire", "SensorPrepare", "SensorProcess", "WorldState", "Think", "Skill", "Act", "ActExec", "PostLoop"];

const share = (part, whole) => (whole ? part / whole : 0);

function Row({ name, condition, waiting_for, histogram, timing, most, misses, panics }) {
  const state = panics || condition === "ILL" ? "bad" : misses ? "degraded" : condition === "INACTIVE" ? "off" : undefined;
  const cell = (value) => html`<td class="number">${value === undefined ? "–" : duration(value)}</td>`;
  return html`<tr data-state=${state}>
    <th scope="row">${name}</th><td>${condition === undefined ? "" : conditionOf({ condition, waiting_for })}</td>
    <td class="number">${timing?.period ? `${(1e9 / timing.period).toFixed(1)} Hz` : "–"}</td>
    ${cell(timing?.jitter)}${cell(histogram?.p50)}${cell(histogram?.p90)}${cell(histogram?.p99)}${cell(histogram?.max)}
    <td><${Bar} share=${share(histogram?.p99 ?? 0, most)} label=${histogram ? `99th percentile ${duration(histogram.p99)}` : "no samples yet"} /></td>
    <td class="number">${misses ?? "–"}</td><td class="number">${panics ?? "–"}</td></tr>`;
}

function Head({ first, sort, setSort }) {
  const column = (name, id, title) => html`<th class="number" aria-sort=${sort === id && id ? "descending" : undefined} title=${title}>
    ${id && setSort ? html`<button class="quiet" onClick=${() => setSort(id)}>${name}${sort === id ? " ▾" : ""}</button>` : name}</th>`;
  return html`<thead><tr><th>${first}</th><th>Condition</th>${column("Rate")}${column("Jitter", "", "Largest difference between successive periods")}
    ${column("p50", "p50")}${column("p90", "p90")}${column("p99", "p99")}${column("Maximum", "max")}
    <th>p99 / period</th>${column("Misses", "", "Ticks that missed their deadline")}${column("Panics")}</tr></thead>`;
}

/** Load of each thread since the last look, and its mean scheduling latency. */
function useLoads() {
  const threads = useResource("/threads", 2) ?? [];
  // Values of an earlier visit have no known interval.
  const begun = useRef(threads).current;
  const before = useRef({ when: 0, threads: new Map() });
  return useMemo(() => {
    if (threads === begun) return threads.map((thread) => ({ ...thread }));
    const now = performance.now();
    const last = before.current;
    const passed = (now - last.when) * 1e6;
    const loads = threads.map((thread) => {
      const earlier = last.threads.get(thread.id);
      const turns = earlier && thread.turns - earlier.turns;
      return { ...thread, load: earlier && (thread.busy - earlier.busy) / passed, wait: turns ? (thread.waited - earlier.waited) / turns : undefined };
    });
    before.current = { when: now, threads: new Map(threads.map((thread) => [thread.id, thread])) };
    return loads.sort((one, other) => (other.load ?? 0) - (one.load ?? 0));
  }, [threads]);
}

function Threads() {
  const loads = useLoads();
  const percent = (load) => (load === undefined ? "–" : `${(100 * load).toFixed(1)} %`);
  return loads.length > 0 && html`<table class="threads"><thead><tr><th>Thread</th><th class="number">Processor</th><th class="number" title="Share of one processor over the last seconds">Load</th>
    <th class="number" title="Mean scheduling latency over the last seconds">Latency</th><th>Processor share</th></tr></thead>
    <tbody>${loads.map(({ id, name, processor, load, wait }) => html`<tr key=${id}><th scope="row">${name}</th><td class="number">${processor}</td><td class="number">${percent(load)}</td>
      <td class="number">${wait === undefined ? "–" : duration(wait)}</td><td><${Bar} share=${load ?? 0} label=${`${name}: ${percent(load)} of a processor`} /></td></tr>`)}</tbody></table>`;
}

function Panel() {
  const [sort, setSort] = useState("p99");
  const modules = useResource("/modules", 2);
  const properties = useResource("/properties", 5) ?? [];
  const found = properties.map(({ path }) => path).filter((path) => /^loop\/[^/]+\/histogram$/.test(path));
  // In the order of execution; stages of another loop at the end.
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
  return html`<div class="scroll timing" tabindex="0" role="group" aria-label="Timing"><table>
    <${Head} first="Loop" />
    <tbody><${Row} name="Cycle" histogram=${cycle} most=${whole} misses=${value("loop/state")?.overruns} />
      ${stages.filter(value).map((path) => html`<${Row} key=${path} name=${path.split("/")[1]} histogram=${value(path)} most=${whole} />`)}</tbody></table>
    <table><${Head} first="Module" sort=${sort} setSort=${setSort} />
    <tbody>${sorted.map((module) => html`<${Row} key=${module.name} ...${module} histogram=${value(`${module.name}/histogram`)} timing=${value(`${module.name}/timing`)} most=${whole} />`)}</tbody>
  </table><${Threads} /></div>`;
}

export default { id: "timing", title: "Timing", Panel };

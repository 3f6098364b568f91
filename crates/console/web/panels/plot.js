// Plots of numbers over time.
import { at, clock, colors, Empty, get, html, number, numbers, onTheme, selection, Trouble, unitAt, useAgent, useEffect, useInterfaces, useMemo, useProperties, useRef, useSize, useState } from "/slate.js";
import { functions, parse } from "/expression.js";
import { history } from "/history.js";
import uPlot from "/lib/uplot.js";

const WINDOWS = { 10: "10 s", 30: "30 s", 60: "1 min", 300: "5 min", 600: "10 min" };

const title = ({ name, path, pointer }) => name ?? `${path}${pointer}`;

/** The histories that a line consists of. */
const sources = ({ path, pointer, inputs }) => (inputs ?? [{ path, pointer }]).map((input) => history(input.path, input.pointer));

/** Times and values of a history from a time on, with the value before it. */
function since({ times, values }, begin) {
  let last = times.length;
  while (last > 0 && times[last - 1] > clock.now / 1e9 + 0.1) last -= 1;
  let place = last;
  while (place > 0 && times[place - 1] >= begin) place -= 1;
  return [times.slice(Math.max(0, place - 1), last), values.slice(Math.max(0, place - 1), last)];
}

/** The same of a line; an expression has a value at each time of one of its inputs, and the others hold. */
function table(line, begin) {
  const parts = sources(line).map((source) => since(source, begin));
  if (!line.compute) return parts[0];
  const [times, values, next] = [[], [], parts.map(() => 0)];
  const now = parts.map(() => undefined);
  for (;;) {
    const time = Math.min(...parts.map(([times], part) => times[next[part]] ?? Infinity));
    if (time === Infinity) return [times, values];
    parts.forEach(([times, values], part) => {
      if (times[next[part]] === time) now[part] = values[next[part]++];
    });
    if (now.includes(undefined)) continue;
    const value = line.compute(now);
    times.push(time);
    values.push(Number.isFinite(value) ? value : null);
  }
}

/** The JSON Pointer of a JSONPath of names and indices alone; null for any other. */
const plain = (path) => (/\.\.|[*?:,]/.test(path) ? "/" : path.replace(/^\$/, "").replace(/\[["']?([^\]"']+)["']?\]/g, "/$1").replaceAll(".", "/"));

/** A part of a property, by a JSON Pointer or a JSONPath behind its path; undefined if there is no such property. */
function partOf(name, properties, interfaces) {
  const place = name.indexOf("$");
  const fits = ({ path }) => (place < 0 ? name.startsWith(`${path}/`) : name.slice(0, place).replace(/\/$/, "") === path);
  const property = properties.filter(fits).sort((one, other) => other.path.length - one.path.length)[0];
  if (!property || property.access === "messages") return undefined;
  const pointer = name.slice(place < 0 ? property.path.length : place);
  return { name, path: property.path, pointer, unit: unitAt(interfaces[property.interface], place < 0 ? pointer : plain(pointer)), isPart: true };
}

/** The line of a name: a number, or an expression after “=”; throws an error. */
function lineOf(name, find) {
  if (!name.startsWith("=")) return find(name);
  const { inputs, compute, unit } = parse(name.slice(1));
  const found = inputs.map(find);
  const missing = inputs.filter((_, place) => !found[place]);
  if (missing.length) throw new Error(`no numeric property is called ${missing.join(", ")}`);
  if (!inputs.length) throw new Error("the expression has no property; write names in braces");
  return { name, inputs: found, compute, unit: unit(found.map((input) => input.unit)) };
}

/** The initial plot: the command of the first actuator. */
const usual = (choices) => choices.filter(({ path }) => path.endsWith("/command")).slice(0, 2);

/** The range of an axis: a tenth more than the data, and a margin around a constant. */
function vertical(chart, least, most) {
  if (least === null || most === null) return [0, 1];
  const room = most - least || Math.abs(most) || 1;
  return [least - room / 10, most + room / 10];
}

const DASHES = [[], [6, 3], [2, 2], [8, 3, 2, 3]];

/** The values of the lines at the pointer: `{time, values}`, each the last one before it; null without a pointer. */
function pointed({ cursor, data }) {
  if (cursor.idx === null || cursor.idx === undefined || !(cursor.left >= 0)) return null;
  const last = (values) => {
    for (let place = cursor.idx; place >= 0; place -= 1) if (values[place] !== null && values[place] !== undefined) return values[place];
    return undefined;
  };
  return { time: data[0][cursor.idx], values: data.slice(1).map(last) };
}

function Chart({ series, seconds, paused, size, point }) {
  const box = useRef(null);
  const newest = useRef({ paused });
  newest.current.paused = paused;
  const key = series.map(title).join(" ");
  useEffect(() => {
    const scheme = colors();
    const units = [...new Set(series.map(({ unit }) => unit))];
    const axis = { stroke: scheme.muted, grid: { stroke: scheme.line, width: 1 }, ticks: { stroke: scheme.line, width: 1 }, font: "12px system-ui, sans-serif" };
    const tail = histories();
    const options = {
      ...size,
      pxAlign: 1,
      legend: { show: false },
      cursor: { sync: { key: "slate" }, drag: { x: false, y: false } },
      hooks: { setCursor: [(chart) => point(pointed(chart))] },
      scales: { x: { time: false, range: () => range() }, ...Object.fromEntries(units.map((unit) => [unit || "1", { range: vertical }])) },
      series: [
        {},
        ...series.map(({ unit }, place) => ({
          scale: unit || "1",
          stroke: scheme.series[place % scheme.series.length],
          dash: DASHES[Math.floor(place / scheme.series.length) % DASHES.length],
          width: 2,
          spanGaps: true,
          points: { show: false },
        })),
      ],
      axes: [
        { ...axis, label: "time, s", labelSize: 18, labelFont: axis.font, size: 34 },
        ...units.slice(0, 2).map((unit, place) => ({ ...axis, scale: unit || "1", side: place ? 1 : 3, label: unit, labelSize: 16, labelFont: axis.font, size: 54, grid: place ? { show: false } : axis.grid })),
      ],
    };
    let end = clock.now / 1e9;
    const range = () => [Math.max(0, end - seconds), Math.max(end, 1)];
    const chart = new uPlot(options, tail.data(end - seconds), box.current);
    let dirty = true;
    let drawn = 0;
    const frame = setInterval(() => {
      if (newest.current.paused || (!dirty && drawn === clock.now)) return;
      dirty = false;
      drawn = clock.now;
      end = clock.now / 1e9;
      chart.setData(tail.data(end - seconds));
    }, 50);
    const listener = () => (dirty = true);
    tail.all.forEach(({ listeners }) => listeners.add(listener));
    return () => {
      clearInterval(frame);
      tail.all.forEach(({ listeners }) => listeners.delete(listener));
      chart.destroy();
    };
  }, [key, seconds, size.width, size.height, document.documentElement.dataset.theme]);

  // The newest part of each line, on a common time axis.
  function histories() {
    const all = series.flatMap(sources);
    return { all, data: (begin) => (all.length ? uPlot.join(series.map((line) => table(line, begin))) : [[]]) };
  }
  return html`<div class="chart" ref=${box} role="img" aria-label=${`Plot of ${series.map(title).join(", ")}`}></div>`;
}

/** The value of each line at the pointer, else the newest one. */
function Legend({ series, at, remove }) {
  const [, redraw] = useState(0);
  useEffect(() => {
    const timer = setInterval(() => redraw((count) => count + 1), 250);
    return () => clearInterval(timer);
  }, []);
  const scheme = colors();
  const newest = (line) => table(line, clock.now / 1e9 - 1)[1].at(-1);
  const written = (line, place) => {
    const value = at ? at.values[place] : newest(line);
    return value === undefined ? "–" : number(value, line.unit);
  };
  return html`<ul class="series">${series.map((line, place) => html`<li key=${title(line)}>
    <span class="swatch" style=${{ background: scheme.series[place % scheme.series.length] }}></span>
    <span>${title(line)}</span><b class="number">${written(line, place)}</b>
    <button class="quiet" aria-label=${`Remove ${title(line)}`} onClick=${() => remove(line)}>✕</button></li>`)}${at && html`<li class="muted number">${number(at.time, "s")}</li>`}</ul>`;
}

function Panel({ options, setOptions }) {
  const agent = useAgent();
  const properties = useProperties();
  const interfaces = useInterfaces();
  const [box, size] = useSize();
  const [paused, setPaused] = useState(false);
  const [cursor, setCursor] = useState(null);
  const [, redraw] = useState(0);
  const [text, setText] = useState("");
  const [problem, setProblem] = useState(null);
  useEffect(() => onTheme(() => redraw((count) => count + 1)), []);
  const choices = useMemo(
    () => properties.filter(({ access }) => access !== "messages").flatMap(({ path, interface: name }) => numbers(interfaces[name]).map(({ pointer, unit }) => ({ path, pointer, unit }))),
    [properties, interfaces],
  );
  const byTitle = useMemo(() => new Map(choices.map((choice) => [title(choice), choice])), [choices]);
  const find = (name) => byTitle.get(name) ?? partOf(name, properties, interfaces);
  const chosen = options.series ?? usual(choices).map(title);
  const series = useMemo(() => chosen.map((name) => {
    try {
      return lineOf(name, find);
    } catch {
      // A line of another run, or of an edited link.
      return undefined;
    }
  }).filter(Boolean), [chosen.join(" "), byTitle]);
  const seconds = options.seconds ?? 30;
  /** Checks that a part is a number. */
  const check = async ({ inputs, isPart, path, pointer }) => {
    for (const input of inputs ?? [{ isPart, path, pointer }]) {
      if (!input.isPart) continue;
      const value = await get(`${at(agent.name, input.path)}?bare&${new URLSearchParams(selection(input.pointer))}`);
      const first = input.pointer.startsWith("$") ? value[0] : value;
      if (!["number", "boolean"].includes(typeof first) && first !== null) throw new Error(`the value at ${input.pointer} of /${input.path} is not a number`);
    }
  };
  const add = async (event) => {
    event.preventDefault();
    // Each letter of a name is a change; an expression is entered as a whole.
    const isEntered = event.type === "submit";
    try {
      const found = isEntered ? lineOf(text, find) : byTitle.get(text);
      if (!found && isEntered && text) throw new Error(`no numeric property is called ${text}`);
      if (!found) return;
      await check(found);
      setProblem(null);
      setOptions({ series: [...new Set([...chosen, text])] });
      setText("");
    } catch (error) {
      setProblem({ message: error.message, help: error.help ?? "such as r2/wheels/command/left, r2/planner/goal$..x, or ={r2/wheels/command/left} - {r2/wheels/command/right}" });
    }
  };
  const remove = (line) => setOptions({ series: chosen.filter((name) => name !== title(line)) });
  return html`
    <div class="bar-of-tools">
      <form class="grow" onSubmit=${add}><input list="numbers" placeholder="Add a number, or ={a} - {b}" title=${`A numeric property, a path followed by a JSON Pointer or JSONPath, or an expression after = with names in braces; functions: ${functions}`} aria-label="Add a number" autocomplete="off" value=${text}
        onInput=${(event) => setText(event.target.value)} onChange=${add} /></form>
      <datalist id="numbers">${choices.map((choice) => html`<option key=${title(choice)} value=${title(choice)}>${choice.unit}</option>`)}</datalist>
      <select aria-label="Time span" value=${seconds} onChange=${(event) => setOptions({ seconds: Number(event.target.value) })}>
        ${Object.entries(WINDOWS).map(([value, name]) => html`<option key=${value} value=${value}>${name}</option>`)}</select>
      <button class="tool" aria-pressed=${paused} onClick=${() => setPaused(!paused)}>${paused ? "Resume" : "Pause"}</button>
    </div>
    <${Trouble} problem=${problem} />
    <${Legend} series=${series} at=${cursor} remove=${remove} />
    <div class="canvas-box" ref=${box}>
      ${!series.length ? html`<${Empty}>Add a number to plot it over time.</${Empty}>` : size && size.height > 60 && html`<${Chart} series=${series} seconds=${seconds} paused=${paused} size=${size} point=${setCursor} />`}
    </div>`;
}

export default { id: "plot", title: "Plot", Panel };

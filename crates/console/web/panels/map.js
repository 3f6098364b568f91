// The world from above: bodies, robots, scans, trails by route, goals.
import { colors, degrees, Empty, fixed, html, isOfNow, isPast, Menu, onTheme, Problem, Trouble, useAgent, useEffect, useInterfaces, useMemo, useProperties, useReading, useRef, useResource, useSize, useState, watch, word } from "/slate.js";
import * as draw from "/map/draw.js";
import { navigate, paint as paintStroke, sendTo, setPlace, targets } from "/map/edit.js";
import { boundsOf, brushStroke, estimate } from "/map/layers.js";
import { remaining } from "/map/navigation.js";
import { isCrowd, knownPose, LAYERS, leavingTrails, needs, paintScene } from "/map/paint.js";
import { find, measured } from "/map/scene.js";
import { forget, trail } from "/map/trails.js";
import { gatesOf, routeOf } from "/route.js";
import { fit, toPixel, toWorld, zoom } from "/map/view.js";

const NO_GOAL = {
  viewer: "Setting a goal requires the role operator; this token has the role viewer",
  operator: "No input or inbox of this agent accepts a goal; parameters require the role developer, or an entry in console.operable",
  developer: "No input, parameter or inbox of this agent accepts a goal",
};

const MARKS = { OCCUPIED: "Occupied", FREE: "Free", MEASURED: "As measured" };
const BRUSHES = [0.1, 0.2, 0.4, 0.8];

// Distance from a pose within which it is dragged, pixels.
const GRASP = 24;

// The size of the world is unknown without a simulator.
const SOMEWHERE = { minimum: [-3, -3], maximum: [3, 3] };

function Panel({ options, setOptions }) {
  const agent = useAgent();
  const properties = useProperties();
  const interfaces = useInterfaces();
  const links = useResource("/links", 5) ?? [];
  const documents = useResource("/documents") ?? [];
  const world = useResource(documents.includes("world") ? "/documents/world" : null);
  const before = useResource(documents.includes("trails") ? "/documents/trails" : null)?.robots;
  const scene = useMemo(() => find(properties, world, interfaces), [properties, world, interfaces]);
  const shownScans = useMemo(() => measured(scene.scans, links), [scene, links]);
  const parameters = useResource("/parameters", 10);
  const actuators = useResource("/actuators", 5) ?? [];
  const gates = Object.fromEntries(scene.robots.map(({ name }) => [name, gatesOf(actuators, name)]));
  const able = useMemo(() => targets(properties, links, interfaces, agent?.role, parameters), [properties, links, interfaces, agent?.role, parameters]);
  const [box, size] = useSize();
  const canvas = useRef(null);
  const state = useRef({ view: null, readings: new Map(), ends: new Map(), pointers: new Map(), ruler: null, aim: null, stroke: null, dirty: true }).current;
  const [tool, setTool] = useState("move");
  const [target, setTarget] = useState("");
  const [mark, setMark] = useState("OCCUPIED");
  const [brush, setBrush] = useState(BRUSHES[1]);
  const [undone, setUndone] = useState([]);
  const [hover, setHover] = useState(null);
  const [problem, setProblem] = useState(null);
  const [said, setSaid] = useState("");
  const [summary, setSummary] = useState([]);
  const [ofNow, setOfNow] = useState("");
  const isShown = (layer) => options[layer] !== false;
  const [gridBounds, setGridBounds] = useState(null);
  // The world of a robot without a simulator has no size.
  const worldBounds = world?.bounds?.maximum?.some((end, axis) => end > world.bounds.minimum[axis]) ? world.bounds : null;
  const bounds = worldBounds ?? gridBounds ?? SOMEWHERE;
  const choices = able[tool] ?? [];
  const chosen = choices.find(({ path }) => path === target) ?? choices[0];

  const mission = useReading(chosen?.how === "navigate" && tool === "goal" ? chosen.shows : undefined, 4)?.value;

  // Drawn properties are watched at the frame rate, large ones more slowly.
  const watched = useMemo(() => {
    const { robots, poses } = scene;
    const all = [...robots.flatMap(({ name, pose, status }) => [pose, status, ...gates[name]]), ...poses.map(({ path }) => path)].map((path) => ({ path }));
    all.push(...needs(scene, shownScans, isShown));
    // A dragged object is always drawn.
    if (tool === "pose" || tool === "goal") all.push(...able[tool].map(({ shows, path, how }) => ({ path: shows ?? (how === "send" ? null : path) })));
    return new Map(all.filter(({ path }) => path).map((wish) => [wish.path, wish]));
  }, [scene, shownScans, actuators, able, tool, ...Object.keys(LAYERS).map(isShown)]);
  const take = (path) => (reading) => {
    state.readings.set(path, reading);
    state.dirty = true;
    // Without a world, the first occupancy grid defines the bounds, also as it grows.
    if (reading.value.resolution > 0 && (state.bound ?? path) === path) {
      state.bound = path;
      const found = boundsOf(reading.value);
      setGridBounds((bounds) => (JSON.stringify(bounds) === JSON.stringify(found) ? bounds : found));
    }
  };
  const drop = (path) => () => {
    state.readings.delete(path);
    state.dirty = true;
  };
  useEffect(() => {
    // Earlier subscriptions continue.
    for (const [path, end] of state.ends) {
      if (watched.has(path)) continue;
      end();
      state.ends.delete(path);
      drop(path)();
    }
    for (const [path, { rate = 20, decode }] of watched) {
      if (!state.ends.has(path)) state.ends.set(path, watch(path, take(path), { rate, decode, none: drop(path) }));
    }
  }, [watched]);
  useEffect(() => () => state.ends.forEach((end) => end()), []);
  const trails = useMemo(() => leavingTrails(scene.robots).map(({ name, pose, status }) => trail(pose, status, before?.[name])), [scene, before]);

  useEffect(() => {
    if (size && size.width > 0 && !state.moved) state.view = fit(bounds, size);
    state.dirty = true;
  }, [size?.width, size?.height, bounds]);

  useEffect(() => {
    if (!size) return undefined;
    const redraw = () => (state.dirty = true);
    let frame = 0;
    const loop = () => {
      frame = requestAnimationFrame(loop);
      if (!state.dirty || !canvas.current || !state.view) return;
      state.dirty = false;
      paint();
    };
    state.dirty = true;
    loop();
    const end = onTheme(redraw);
    return () => {
      end();
      cancelAnimationFrame(frame);
    };
  });

  // The same as text, for users of screen readers and for copying.
  useEffect(() => {
    const timer = setInterval(() => {
      setSummary(scene.robots.map(({ name, pose, status, isScripted }) => {
        const place = knownPose(state.readings.get(pose));
        const route = routeNow(name, status);
        return { name, place, route: route ?? (isScripted ? "scripted" : "") };
      }));
      setOfNow([...state.readings].filter(([, reading]) => isOfNow(reading)).map(([path]) => path).join(", "));
    }, 250);
    return () => clearInterval(timer);
  }, [scene]);

  const value = (path) => state.readings.get(path)?.value;
  const routeNow = (robot, status) => routeOf(value(status)?.route, (gates[robot] ?? []).map(value));

  function paint() {
    const element = canvas.current;
    const ratio = devicePixelRatio || 1;
    if (element.width !== size.width * ratio || element.height !== size.height * ratio) {
      element.width = size.width * ratio;
      element.height = size.height * ratio;
    }
    const context = element.getContext("2d");
    const scheme = colors();
    const followed = scene.robots.find(({ name }) => name === options.follow);
    const leader = followed && knownPose(state.readings.get(followed.pose));
    if (leader) Object.assign(state.view, { x: leader.x, y: leader.y });
    const { view } = state;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, size.width, size.height);
    const held = state.aim && chosen?.shows;
    paintScene(context, scheme, view, size, { scene, scans: shownScans, world, readings: state.readings, isShown, trails, gates, held });
    if (state.ruler) draw.ruler(context, scheme, view, size, state.ruler);
    if (state.aim) {
      if (tool === "pose") estimate(context, scheme, view, size, { pose: state.aim }, "", true);
      else if (chosen?.turned && (state.aim.isTurned || chosen.how !== "navigate")) draw.arrow(context, scheme, view, size, state.aim, "", scheme.text);
      else draw.goal(context, scheme, view, size, state.aim.x, state.aim.y, "", scheme.text);
    }
    if (state.stroke) brushStroke(context, scheme, view, size, state.stroke, brush, mark);
    draw.scaleBar(context, scheme, view, size);
  }

  // Every change can be undone, the last one first.
  async function change(words, work) {
    try {
      setProblem(null);
      if (isPast()) throw new Problem(409, "the page shows a past time, and a change applies to the present", "press “Go live” below first");
      const undo = await work();
      if (undo) setUndone((all) => [...all, { words, undo }]);
      setSaid(words);
    } catch (error) {
      if (!(error instanceof Problem)) throw error;
      setProblem(error);
    }
  }
  const send = (place, isLast = false) => {
    const { minimum, maximum } = worldBounds ?? {};
    const isInside = !maximum || [place.x, place.y].every((at, axis) => at >= minimum[axis] && at <= maximum[axis]);
    if (!isInside) {
      const ends = (axis) => `${fixed(minimum[axis], "m")} to ${fixed(maximum[axis], "m")}`;
      return change("", () => {
        throw new Problem(422, `the position is outside of the world: x from ${ends(0)}, y from ${ends(1)}`, "choose a position in the world");
      });
    }
    const shown = chosen.shows ?? (chosen.how === "send" ? null : chosen.path);
    const before = shown && (value(shown)?.pose ?? value(shown));
    const isTurned = chosen.turned && (place.isTurned || chosen.how !== "navigate");
    const words = `${tool === "pose" ? "Pose" : "Goal"}: x ${fixed(place.x, "m")}, y ${fixed(place.y, "m")}${isTurned ? `, ${degrees(place.theta)}` : ""}`;
    if (chosen.how === "navigate") {
      const status = value(scene.missions.find(({ path }) => path === shown)?.status);
      // That a mission is a loop can't be restored.
      const goals = before && !before.is_loop ? remaining(before, status) : null;
      return change(words, () => sendTo(agent.name, chosen, place, goals, isLast));
    }
    return change(words, () => setPlace(agent.name, chosen, place, before));
  };
  const order = (command) => change(`Goals: ${word(command).toLowerCase()}`, async () => void (await navigate(agent.name, chosen, command)));
  const undo = async () => {
    const last = undone.at(-1);
    setUndone(undone.slice(0, -1));
    await change(`Undone: ${last.words}`, async () => {
      await last.undo();
    });
  };
  // The pose under the pointer that can be dragged.
  const grasped = (left, top) => {
    const shown = chosen?.shows && value(chosen.shows);
    const pose = shown?.pose ?? shown;
    if (!pose) return null;
    const [x, y] = toPixel(state.view, size, pose.x, pose.y);
    return Math.hypot(x - left, y - top) < GRASP ? pose : null;
  };

  const local = (event) => {
    const { left, top } = canvas.current.getBoundingClientRect();
    return [event.clientX - left, event.clientY - top];
  };
  const world2 = (event) => toWorld(state.view, size, ...local(event));
  const round = (number) => Math.round(number * 1000) / 1000;

  const down = (event) => {
    canvas.current.setPointerCapture(event.pointerId);
    state.pointers.set(event.pointerId, local(event));
    const [x, y] = world2(event).map(round);
    if (tool === "goal" && chosen) state.aim = { x, y, theta: 0 };
    if (tool === "pose" && chosen) {
      const held = grasped(...local(event));
      state.aim = held ? { ...held, from: [x, y], start: held } : { x, y, theta: 0 };
    }
    if (tool === "paint" && chosen) state.stroke = [{ x, y }];
    if (tool === "measure") state.ruler = [[x, y], [x, y]];
    state.dirty = true;
  };
  const move = (event) => {
    setHover(world2(event));
    const before = state.pointers.get(event.pointerId);
    if (!before) return;
    const now = local(event);
    const pointers = [...state.pointers.entries()];
    if (pointers.length === 2) {
      const [, other] = pointers.find(([id]) => id !== event.pointerId);
      const distance = (one) => Math.hypot(one[0] - other[0], one[1] - other[1]);
      state.view = zoom(state.view, size, other[0], other[1], distance(now) / (distance(before) || 1));
      state.moved = true;
      state.aim = state.stroke = null;
    } else if (tool === "move") {
      state.view = { ...state.view, x: state.view.x - (now[0] - before[0]) / state.view.scale, y: state.view.y + (now[1] - before[1]) / state.view.scale };
      state.moved = true;
      if (options.follow) setOptions({ follow: "" });
    } else if (state.aim?.from) {
      // A dragged pose keeps its heading.
      const [x, y] = world2(event);
      const { from, start } = state.aim;
      Object.assign(state.aim, { x: round(start.x + x - from[0]), y: round(start.y + y - from[1]) });
    } else if (state.stroke) {
      const [x, y] = world2(event).map(round);
      if (Math.hypot(x - state.stroke.at(-1).x, y - state.stroke.at(-1).y) * state.view.scale > 2) state.stroke.push({ x, y });
    } else if (state.aim) {
      const [x, y] = world2(event);
      if (Math.hypot(x - state.aim.x, y - state.aim.y) * state.view.scale > 6) Object.assign(state.aim, { isTurned: true, theta: round(Math.atan2(y - state.aim.y, x - state.aim.x)) });
    } else if (state.ruler) state.ruler[1] = world2(event);
    state.pointers.set(event.pointerId, now);
    state.dirty = true;
  };
  const up = (event) => {
    state.pointers.delete(event.pointerId);
    const { aim, stroke } = state;
    if (aim) send({ x: aim.x, y: aim.y, theta: round(aim.theta), isTurned: Boolean(aim.isTurned) }, event.shiftKey);
    if (stroke) change(`Painted: ${MARKS[mark].toLowerCase()}`, () => paintStroke(agent.name, chosen, stroke, brush, mark));
    state.aim = state.stroke = null;
    state.dirty = true;
  };
  const wheel = (event) => {
    event.preventDefault();
    state.view = zoom(state.view, size, ...local(event), Math.exp(-event.deltaY / 500));
    state.moved = true;
    state.dirty = true;
  };
  useEffect(() => {
    const element = canvas.current;
    element?.addEventListener("wheel", wheel, { passive: false });
    return () => element?.removeEventListener("wheel", wheel);
  });
  const whole = () => {
    state.view = fit(bounds, size);
    state.moved = false;
    state.dirty = true;
    if (options.follow) setOptions({ follow: "" });
  };
  const press = (event) => {
    const [across, upwards] = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key] ?? [0, 0];
    const factor = { "+": 1.25, "=": 1.25, "-": 0.8 }[event.key];
    if (factor) state.view = zoom(state.view, size, size.width / 2, size.height / 2, factor);
    else if (across || upwards) state.view = { ...state.view, x: state.view.x + (across * 40) / state.view.scale, y: state.view.y + (upwards * 40) / state.view.scale };
    else if (event.key === "f") whole();
    else if (event.key === "Enter" && ["goal", "pose"].includes(tool) && chosen) send({ x: round(state.view.x), y: round(state.view.y), theta: 0, isTurned: false }, event.shiftKey);
    else if (event.key === "Enter" && tool === "paint" && chosen) {
      const here = [{ x: round(state.view.x), y: round(state.view.y) }];
      change(`Painted: ${MARKS[mark].toLowerCase()}`, () => paintStroke(agent.name, chosen, here, brush, mark));
    }
    else return;
    event.preventDefault();
    state.moved = event.key !== "f";
    state.dirty = true;
  };

  if (world === undefined && !documents.length && !scene.poses.length && !properties.length) return html`<${Empty}>Waiting for the agent.</${Empty}>`;
  const rows = isCrowd(summary) ? summary.filter(({ route }) => route !== "scripted") : summary;
  const button = (name, title, disabled = false) =>
    html`<button class="tool" aria-pressed=${tool === name} disabled=${disabled} title=${title} onClick=${() => setTool(name)}>${word(name)}</button>`;
  return html`<div class="map">
    <div class="bar-of-tools">
      ${button("move", "Drag to pan; wheel to zoom")}
      ${button("goal", able.goal.length ? "Click to set the goal; drag to set its heading; with Shift, it follows the other goals of a mission" : NO_GOAL[agent?.role], !able.goal.length)}
      ${able.pose.length > 0 && button("pose", "Drag the estimate to the robot's true position, or click beside it to set a new pose and drag to set its heading")}
      ${able.paint.length > 0 && button("paint", "Drag to paint cells of the occupancy grid")}
      ${button("measure", "Drag to measure a distance")}
      ${choices.length > 1 && html`<select aria-label="Target" value=${chosen?.path} onChange=${(event) => setTarget(event.target.value)}>
        ${choices.map(({ path }) => html`<option key=${path} value=${path}>${path}</option>`)}</select>`}
      ${tool === "paint" && html`<select aria-label="Cell state" value=${mark} onChange=${(event) => setMark(event.target.value)}>
          ${Object.entries(MARKS).map(([name, title]) => html`<option key=${name} value=${name}>${title}</option>`)}</select>
        <select aria-label="Brush width" value=${brush} onChange=${(event) => setBrush(Number(event.target.value))}>
          ${BRUSHES.map((width) => html`<option key=${width} value=${width}>${width} m</option>`)}</select>`}
      ${mission?.goals.length > 0 && html`<button class="tool" onClick=${() => order(mission.is_paused ? "RESUME" : "PAUSE")}>${mission.is_paused ? "Resume" : "Pause"}</button>
        <button class="tool" onClick=${() => order("CANCEL")}>Cancel goals</button>`}
      ${tool in able && html`<button class="tool" disabled=${!undone.length} title=${undone.length ? `Undo: ${undone.at(-1).words}` : "Nothing to undo"} onClick=${undo}>Undo</button>`}
      <button class="tool" onClick=${whole} title="Fit the world into the view (f)">Fit</button>
      ${scene.robots.length > 0 && html`<select aria-label="Follow" value=${options.follow ?? ""} onChange=${(event) => setOptions({ follow: event.target.value })}>
        <option value="">Follow none</option>${scene.robots.map(({ name }) => html`<option key=${name} value=${name}>Follow ${name}</option>`)}</select>`}
      <span class="grow"></span>
      <${Menu} title="Layers">
        ${Object.entries(LAYERS).map(([name, title]) => html`<label key=${name}><input type="checkbox" checked=${isShown(name)} onChange=${(event) => setOptions({ [name]: event.target.checked })} /> ${title}</label>`)}
        <button onClick=${() => { forget(); state.dirty = true; }}>Clear trails</button>
      </${Menu}>
    </div>
    <div class="canvas-box" ref=${box}>
      <canvas ref=${canvas} tabindex="0" role="img" data-tool=${tool} aria-label=${`Map. ${summary.map(({ name, place, route }) => place ? `${name} at ${place.x.toFixed(1)}, ${place.y.toFixed(1)} ${word(route)}` : name).join("; ")}`}
        onPointerDown=${down} onPointerMove=${move} onPointerUp=${up} onPointerCancel=${() => { state.pointers.clear(); state.aim = state.stroke = null; }} onPointerLeave=${() => setHover(null)} onKeyDown=${press}></canvas>
      <table class="readout">
        <caption class="hidden">Robots</caption>
        <tbody>${rows.map(({ name, place, route }, row) => html`<tr key=${name} data-route=${route}>
          <th scope="row">${summary.length > 1 && html`<span class="own" style=${{ background: `var(--series-${(row % 6) + 1})` }}></span>`}${name}</th>
          <td class="number">${place ? fixed(place.x, "m") : "–"}</td><td class="number">${place ? fixed(place.y, "m") : "–"}</td>
          <td class="number" title=${place ? fixed(place.theta, "rad") : ""}>${place ? degrees(place.theta) : "–"}</td><td>${word(route)}</td></tr>`)}
          ${summary.length > rows.length && html`<tr><td colspan="5">and ${summary.length - rows.length} that follow a script</td></tr>`}</tbody>
      </table>
      <p class="pointer number">${hover ? `${fixed(hover[0], "m")}  ${fixed(hover[1], "m")}` : ""}</p>
      <p class="legend" aria-hidden="true"><span class="deliberative">● Deliberative</span><span class="reactive">■ Reactive</span></p>
      <p class="said" role="status">${said}</p>
      ${ofNow && html`<p class="of-now" role="status" title="The flight recorder excludes values larger than record.flight.largest and properties that are not selected"><b>Current values:</b> ${ofNow}, not in the flight recorder</p>`}
      <${Trouble} problem=${problem} />
    </div>
  </div>`;
}

export default { id: "map", title: "Map", Panel };

// The world from above: bodies, robots, scans, trails by route, goals.
import { clock, colors, degrees, Empty, fixed, html, isOfNow, isPast, Menu, onTheme, Problem, Trouble, useAgent, useEffect, useInterfaces, useMemo, useProperties, useRef, useResource, useSize, useState, watch, word } from "/slate.js";
import * as draw from "/map/draw.js";
import { paint as paintStroke, setPlace, targets } from "/map/edit.js";
import * as layers from "/map/layers.js";
import { find, measured, mounted } from "/map/scene.js";
import { forget, trail } from "/map/trails.js";
import { gatesOf, routeOf } from "/route.js";
import { fit, toPixel, toWorld, zoom } from "/map/view.js";

const NO_GOAL = {
  viewer: "Setting a goal requires the role operator; this token has the role viewer",
  operator: "No input or inbox of this agent accepts a goal; parameters require the role developer, or an entry in console.operable",
  developer: "No input, parameter or inbox of this agent accepts a goal",
};
const LAYERS = { world: "World", grids: "Occupancy grids", graphs: "Pose graphs", frontiers: "Frontiers", paths: "Planned paths", estimates: "Estimates", scans: "Scans", trails: "Trails", goals: "Goals", sightings: "Sightings", poses: "Poses" };

const MARKS = { OCCUPIED: "Occupied", FREE: "Free", MEASURED: "As measured" };
const BRUSHES = [0.1, 0.2, 0.4, 0.8];

// Distance from a pose within which it is dragged, pixels.
const GRASP = 24;

// Each of several robots has a colour of its own.
const own = (scheme, place) => scheme.series[place % scheme.series.length];

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
  const scene = useMemo(() => find(properties, world), [properties, world]);
  const shownScans = useMemo(() => measured(scene.scans, links), [scene, links]);
  const parameters = useResource("/parameters", 10);
  const actuators = useResource("/actuators", 5) ?? [];
  const gates = Object.fromEntries(scene.robots.map(({ name }) => [name, gatesOf(actuators, name)]));
  const able = useMemo(() => targets(properties, links, interfaces, agent?.role, parameters), [properties, links, interfaces, agent?.role, parameters]);
  const [box, size] = useSize();
  const canvas = useRef(null);
  const state = useRef({ view: null, readings: new Map(), pointers: new Map(), ruler: null, aim: null, stroke: null, dirty: true }).current;
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
  const bounds = world?.bounds?.maximum ? world.bounds : (gridBounds ?? SOMEWHERE);
  const choices = able[tool] ?? [];
  const chosen = choices.find(({ path }) => path === target) ?? choices[0];

  // Drawn properties are watched at the frame rate.
  const watched = useMemo(() => {
    const { robots, poses, sightings, goals, grids, graphs, frontiers, paths: ways, estimates } = scene;
    const paths = [...robots.flatMap(({ name, pose, status }) => [pose, status, ...gates[name]]), ...poses.map(({ path }) => path)];
    if (isShown("scans")) paths.push(...shownScans.flatMap(({ path, mount }) => [path, mount]));
    if (isShown("sightings")) paths.push(...sightings.map(({ path }) => path));
    if (isShown("goals")) paths.push(...goals.map(({ path }) => path));
    if (isShown("grids")) paths.push(...grids.map(({ path }) => path));
    if (isShown("graphs")) paths.push(...graphs.map(({ path }) => path));
    if (isShown("frontiers")) paths.push(...frontiers.map(({ path }) => path));
    if (isShown("paths")) paths.push(...ways.map(({ path }) => path));
    if (isShown("estimates")) paths.push(...estimates.map(({ path }) => path));
    // A dragged object is always drawn.
    if (tool === "pose" || tool === "goal") paths.push(...able[tool].map(({ shows, path, how }) => shows ?? (how === "send" ? null : path)));
    return [...new Set(paths.filter(Boolean))];
  }, [scene, shownScans, actuators, able, tool, options.scans, options.sightings, options.goals, options.grids, options.graphs, options.frontiers, options.paths, options.estimates]);
  useEffect(() => {
    state.readings.clear();
    const ends = watched.map((path) =>
      watch(path, (reading) => {
        state.readings.set(path, reading);
        state.dirty = true;
        // Without a world, the first occupancy grid defines the bounds, also as it grows.
        if (reading.value.resolution > 0 && (state.bound ?? path) === path) {
          state.bound = path;
          const found = layers.boundsOf(reading.value);
          setGridBounds((bounds) => (JSON.stringify(bounds) === JSON.stringify(found) ? bounds : found));
        }
      }, {
        rate: [...scene.grids, ...scene.graphs, ...scene.frontiers].some((large) => large.path === path) ? 5 : 20,
        none: () => {
          state.readings.delete(path);
          state.dirty = true;
        },
      }),
    );
    return () => ends.forEach((end) => end());
  }, [watched.join(" ")]);
  const trails = useMemo(() => scene.robots.filter(({ pose }) => pose).map(({ name, pose, status }) => trail(pose, status, before?.[name])), [scene, before]);

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
        const place = state.readings.get(pose)?.value;
        const route = routeNow(name, status);
        return { name, place, route: route ?? (isScripted ? "scripted" : "") };
      }));
      setOfNow([...state.readings].filter(([, reading]) => isOfNow(reading)).map(([path]) => path).join(", "));
    }, 250);
    return () => clearInterval(timer);
  }, [scene]);

  const value = (path) => state.readings.get(path)?.value;
  // One that is unknown has no numbers.
  const knownPose = (path) => [value(path)].find((pose) => [pose?.x, pose?.y, pose?.theta].every(Number.isFinite));
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
    const leader = followed && knownPose(followed.pose);
    if (leader) Object.assign(state.view, { x: leader.x, y: leader.y });
    const { view } = state;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, size.width, size.height);
    draw.grid(context, scheme, view, size);
    if (isShown("grids")) {
      for (const { path } of scene.grids) if (value(path)) layers.gridMap(context, scheme, view, size, path, state.readings.get(path), isOfNow(state.readings.get(path)));
    }
    if (isShown("graphs")) {
      for (const { path } of scene.graphs) if (value(path)) layers.poseGraph(context, scheme, view, size, value(path).edges);
    }
    if (isShown("frontiers")) {
      for (const { path } of scene.frontiers) if (value(path)) layers.frontierCells(context, scheme, view, size, value(path).points);
    }
    if (isShown("world") && world) draw.world(context, scheme, view, size, world);
    const drawGoals = () => {
      const live = scene.goals.filter(({ path }) => value(path));
      if (!live.length) (world?.goals ?? []).forEach(({ x, y, label }) => draw.goal(context, scheme, view, size, x, y, label, scheme.muted));
      const several = live.length > 1;
      live.forEach(({ path, robot }) => draw.goal(context, scheme, view, size, value(path).x, value(path).y, several ? `goal of ${robot ?? path}` : "goal"));
    };
    if (isShown("trails")) trails.forEach((trail, place) => draw.trail(context, scheme, view, size, trail, clock.now, trails.length > 1 ? own(scheme, place) : null));
    if (isShown("scans")) {
      for (const { path, interface: name, robot, mount } of shownScans) {
        const [pose, scan] = [knownPose(robot.pose), value(path)];
        if (pose && scan) (name === "SonarScan" ? draw.sonar : draw.laser)(context, scheme, view, size, mounted(pose, mount && value(mount)), scan);
      }
    }
    if (isShown("sightings")) {
      for (const { path, robot } of scene.sightings) {
        if (knownPose(robot.pose) && value(path)) draw.sightings(context, scheme, view, size, knownPose(robot.pose), value(path));
      }
    }
    for (const body of scene.robots) {
      const color = scheme[{ REACTIVE: "reactive", DELIBERATIVE: "deliberative", TELEOPERATION: "amber" }[routeNow(body.name, body.status)] ?? "idle"];
      draw.robot(context, scheme, view, size, body, knownPose(body.pose) ?? body, color);
    }
    if (isShown("paths")) {
      for (const { path } of scene.paths) if (value(path)) layers.plannedPath(context, scheme, view, size, value(path).points);
    }
    if (isShown("estimates")) {
      for (const { path, robot } of scene.estimates) {
        const isHeld = state.aim && chosen?.shows === path;
        if (value(path) && !isHeld) layers.estimate(context, scheme, view, size, value(path), `${robot ?? path} estimate`);
      }
    }
    if (isShown("poses")) {
      for (const { path } of scene.poses) {
        const pose = value(path)?.pose ?? value(path);
        if (pose) draw.arrow(context, scheme, view, size, pose, path);
      }
    }
    // Above the robot that has arrived.
    if (isShown("goals")) drawGoals();
    if (state.ruler) draw.ruler(context, scheme, view, size, state.ruler);
    if (state.aim) {
      if (tool === "pose") layers.estimate(context, scheme, view, size, { pose: state.aim }, "", true);
      else if (chosen?.turned) draw.arrow(context, scheme, view, size, state.aim, "", scheme.text);
      else draw.goal(context, scheme, view, size, state.aim.x, state.aim.y, "", scheme.text);
    }
    if (state.stroke) layers.brushStroke(context, scheme, view, size, state.stroke, brush, mark);
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
  const send = (place) => {
    const { minimum, maximum } = world?.bounds?.maximum ? world.bounds : {};
    const isInside = !maximum || [place.x, place.y].every((at, axis) => at >= minimum[axis] && at <= maximum[axis]);
    if (!isInside) {
      const ends = (axis) => `${fixed(minimum[axis], "m")} to ${fixed(maximum[axis], "m")}`;
      return change("", () => {
        throw new Problem(422, `the position is outside of the world: x from ${ends(0)}, y from ${ends(1)}`, "choose a position in the world");
      });
    }
    const shown = chosen.shows ?? (chosen.how === "send" ? null : chosen.path);
    const before = shown && (value(shown)?.pose ?? value(shown));
    const words = `${tool === "pose" ? "Pose" : "Goal"}: x ${fixed(place.x, "m")}, y ${fixed(place.y, "m")}${chosen.turned ? `, ${degrees(place.theta)}` : ""}`;
    return change(words, () => setPlace(agent.name, chosen, place, before));
  };
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
      if (Math.hypot(x - state.aim.x, y - state.aim.y) * state.view.scale > 6) state.aim.theta = round(Math.atan2(y - state.aim.y, x - state.aim.x));
    } else if (state.ruler) state.ruler[1] = world2(event);
    state.pointers.set(event.pointerId, now);
    state.dirty = true;
  };
  const up = (event) => {
    state.pointers.delete(event.pointerId);
    const { aim, stroke } = state;
    if (aim) send({ x: aim.x, y: aim.y, theta: round(aim.theta) });
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
    else if (event.key === "Enter" && ["goal", "pose"].includes(tool) && chosen) send({ x: round(state.view.x), y: round(state.view.y), theta: 0 });
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
  const button = (name, title, disabled = false) =>
    html`<button class="tool" aria-pressed=${tool === name} disabled=${disabled} title=${title} onClick=${() => setTool(name)}>${word(name)}</button>`;
  return html`<div class="map">
    <div class="bar-of-tools">
      ${button("move", "Drag to pan; wheel to zoom")}
      ${button("goal", able.goal.length ? "Click to set the goal; drag to set its heading" : NO_GOAL[agent?.role], !able.goal.length)}
      ${able.pose.length > 0 && button("pose", "Drag the estimate to the robot's true position, or click beside it to set a new pose and drag to set its heading")}
      ${able.paint.length > 0 && button("paint", "Drag to paint cells of the occupancy grid")}
      ${button("measure", "Drag to measure a distance")}
      ${choices.length > 1 && html`<select aria-label="Target" value=${chosen?.path} onChange=${(event) => setTarget(event.target.value)}>
        ${choices.map(({ path }) => html`<option key=${path} value=${path}>${path}</option>`)}</select>`}
      ${tool === "paint" && html`<select aria-label="Cell state" value=${mark} onChange=${(event) => setMark(event.target.value)}>
          ${Object.entries(MARKS).map(([name, title]) => html`<option key=${name} value=${name}>${title}</option>`)}</select>
        <select aria-label="Brush width" value=${brush} onChange=${(event) => setBrush(Number(event.target.value))}>
          ${BRUSHES.map((width) => html`<option key=${width} value=${width}>${width} m</option>`)}</select>`}
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
        <tbody>${summary.map(({ name, place, route }, row) => html`<tr key=${name} data-route=${route}>
          <th scope="row">${summary.length > 1 && html`<span class="own" style=${{ background: `var(--series-${(row % 6) + 1})` }}></span>`}${name}</th>
          <td class="number">${place ? fixed(place.x, "m") : "–"}</td><td class="number">${place ? fixed(place.y, "m") : "–"}</td>
          <td class="number" title=${place ? fixed(place.theta, "rad") : ""}>${place ? degrees(place.theta) : "–"}</td><td>${word(route)}</td></tr>`)}</tbody>
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

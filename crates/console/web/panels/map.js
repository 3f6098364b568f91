// The world from above: bodies, robots, scans, trails by route, goals.
import { Empty, fixed, html, Trouble, useMemo, useRef, useSize, useState } from "/slate.js";
import { useChanges } from "/map/changes.js";
import { useContent } from "/map/content.js";
import { paintFrame, useFrames } from "/map/frame.js";
import { keyHandler, pointerHandlers, useWheel } from "/map/gestures.js";
import { useMotion } from "/map/motion.js";
import { useDrawn, useSubscriptions } from "/map/readings.js";
import { Readout, spokenMap, useSummary } from "/map/readout.js";
import { requestsOf } from "/map/requests.js";
import { Toolbar } from "/map/toolbar.js";
import { useTools } from "/map/tools.js";
import { forget } from "/map/trails.js";

// The size of the world is unknown without a simulator.
const SOMEWHERE = { minimum: [-3, -3], maximum: [3, 3] };

const OF_NOW = "The flight recorder excludes values larger than record.flight.largest "
  + "and properties that are not selected";

/** State that frames and gestures share, which changes without a render. */
const initialState = () => ({
  view: null, isMoved: false, isDirty: true, readings: new Map(), pointers: new Map(),
  aim: null, stroke: null, ruler: null,
});

function Panel({ options, setOptions }) {
  const content = useContent();
  const [box, size] = useSize();
  const canvas = useRef(null);
  const state = useMemo(initialState, []);
  const tools = useTools(content.targetsByTool);
  const changes = useChanges();
  const [hover, setHover] = useState(null);
  const isShown = (layer) => options[layer] !== false;
  const gridBounds = useSubscriptions(useDrawn(content, tools.tool, isShown), state);
  const bounds = content.worldBounds ?? gridBounds ?? SOMEWHERE;
  // The view fits before the first frame is drawn.
  const motion = useMotion(state, size, bounds, options, setOptions);
  const paint = () => paintFrame(canvas.current, state, size, { content, tools, isShown, follow: options.follow });
  useFrames(canvas, state, size, paint);
  const { robots, ofNow } = useSummary(content, state.readings);
  const requests = requestsOf(content, tools, state.readings, changes.change);
  const pointer = pointerHandlers({ canvas, state, size, tools, motion, requests, setHover });
  const press = keyHandler({ state, size, tools, motion, requests });
  useWheel(canvas, state, motion);
  const clearTrails = () => {
    forget();
    state.isDirty = true;
  };

  if (content.isEmpty) return html`<${Empty}>Waiting for the agent.</${Empty}>`;
  return html`<div class="map">
    <${Toolbar} content=${content} tools=${tools} changes=${changes} command=${requests.command} isShown=${isShown}
      fitBounds=${motion.fitBounds} clearTrails=${clearTrails} options=${options} setOptions=${setOptions} />
    <div class="canvas-box" ref=${box}>
      <canvas ref=${canvas} tabindex="0" role="img" data-tool=${tools.tool} aria-label=${spokenMap(robots)}
        onPointerDown=${pointer.down} onPointerMove=${pointer.move} onPointerUp=${pointer.up}
        onPointerCancel=${pointer.cancel} onPointerLeave=${() => setHover(null)} onKeyDown=${press}></canvas>
      <${Readout} robots=${robots} />
      <p class="pointer number">${hover ? `${fixed(hover[0], "m")}  ${fixed(hover[1], "m")}` : ""}</p>
      <p class="legend" aria-hidden="true">
        <span class="deliberative">● Deliberative</span>
        <span class="reactive">■ Reactive</span></p>
      <p class="said" role="status">${changes.said}</p>
      ${ofNow && html`<p class="of-now" role="status" title=${OF_NOW}>
        <b>Current values:</b> ${ofNow}, not in the flight recorder</p>`}
      <${Trouble} problem=${changes.problem} />
    </div>
  </div>`;
}

export default { id: "map", title: "Map", Panel };

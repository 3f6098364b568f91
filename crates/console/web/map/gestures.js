// Gestures on a map, by pointers, wheel and keys: they move the view, and use the selected tool.
import { useEffect } from "/slate.js";
import { beginDrag, continueDrag, round } from "/map/drag.js";
import { pan, toWorld } from "/map/view.js";

// Motion of the view by an arrow key, pixels.
const STEP = 40;
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
const FACTORS = { "+": 1.25, "=": 1.25, "-": 0.8 };

/** The position of an event on a canvas, pixels. */
function pixel(canvas, event) {
  const { left, top } = canvas.current.getBoundingClientRect();
  return [event.clientX - left, event.clientY - top];
}

/** Handlers of pointers: one pointer uses the tool, two zoom. */
export function pointerHandlers({ canvas, state, size, tools, motion, requests, setHover }) {
  const position = (event) => toWorld(state.view, size, ...pixel(canvas, event));
  const endDrag = () => (state.aim = state.stroke = null);
  const pinch = (pointer, before, now) => {
    const [, other] = [...state.pointers.entries()].find(([id]) => id !== pointer);
    const distance = (one) => Math.hypot(one[0] - other[0], one[1] - other[1]);
    motion.zoomAt(other[0], other[1], distance(now) / (distance(before) || 1));
    endDrag();
  };
  const down = (event) => {
    canvas.current.setPointerCapture(event.pointerId);
    state.pointers.set(event.pointerId, pixel(canvas, event));
    beginDrag(state, size, tools, ...pixel(canvas, event));
    state.isDirty = true;
  };
  const move = (event) => {
    setHover(position(event));
    const before = state.pointers.get(event.pointerId);
    if (!before) return;
    const now = pixel(canvas, event);
    if (state.pointers.size === 2) pinch(event.pointerId, before, now);
    else if (tools.tool === "move") motion.drag(before, now);
    else continueDrag(state, position(event));
    state.pointers.set(event.pointerId, now);
    state.isDirty = true;
  };
  const up = (event) => {
    state.pointers.delete(event.pointerId);
    const { aim, stroke } = state;
    if (aim) {
      const place = { x: aim.x, y: aim.y, theta: round(aim.theta), isTurned: Boolean(aim.isTurned) };
      requests.place(place, event.shiftKey);
    }
    if (stroke) requests.stroke(stroke);
    endDrag();
    state.isDirty = true;
  };
  const cancel = () => {
    state.pointers.clear();
    endDrag();
  };
  return { down, move, up, cancel };
}

/** Zooms with the wheel, at the pointer. */
export function useWheel(canvas, state, motion) {
  const wheel = (event) => {
    event.preventDefault();
    motion.zoomAt(...pixel(canvas, event), Math.exp(-event.deltaY / 500));
    state.isDirty = true;
  };
  useEffect(() => {
    const element = canvas.current;
    // A passive listener could not keep the page from scrolling.
    element?.addEventListener("wheel", wheel, { passive: false });
    return () => element?.removeEventListener("wheel", wheel);
  });
}

/** The handler of keys, which use the tool in the middle of the view. */
export function keyHandler({ state, size, tools: { tool, target }, motion, requests }) {
  return (event) => {
    const [across, upwards] = ARROWS[event.key] ?? [0, 0];
    const factor = FACTORS[event.key];
    const middle = () => ({ x: round(state.view.x), y: round(state.view.y) });
    if (factor) motion.zoomAt(size.width / 2, size.height / 2, factor);
    else if (across || upwards) state.view = pan(state.view, -across * STEP, upwards * STEP);
    else if (event.key === "f") motion.fitBounds();
    else if (event.key === "Enter" && ["goal", "pose"].includes(tool) && target) {
      requests.place({ ...middle(), theta: 0, isTurned: false }, event.shiftKey);
    } else if (event.key === "Enter" && tool === "paint" && target) requests.stroke([middle()]);
    else return;
    event.preventDefault();
    state.isMoved = event.key !== "f";
    state.isDirty = true;
  };
}

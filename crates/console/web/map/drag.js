// What a person sets on a map by dragging: a goal or a pose, a stroke, a ruler.
import { toPixel, toWorld } from "/map/view.js";

// Distance from a pose within which it is dragged, pixels.
const GRASP = 24;
// Distance between points of a stroke, pixels.
const STROKE_STEP = 2;
// Distance from a place from which a drag sets its heading, pixels.
const TURN = 6;

/** A length or an angle to a thousandth. */
export const round = (number) => Math.round(number * 1000) / 1000;

/** Whether a target receives the heading of a place. */
export const isTurned = (target, place) => target?.turned && (place.isTurned || target.how !== "navigate");

/** The pose of a target that can be dragged, if it is near a pixel. */
function grasped({ readings, view }, size, target, left, top) {
  const shown = target.shows && readings.get(target.shows)?.value;
  const pose = shown?.pose ?? shown;
  if (!pose) return null;
  const [x, y] = toPixel(view, size, pose.x, pose.y);
  return Math.hypot(x - left, y - top) < GRASP ? pose : null;
}

/** Begins to set in `state` what the selected tool sets, at a pixel. */
export function beginDrag(state, size, { tool, target }, left, top) {
  const [x, y] = toWorld(state.view, size, left, top).map(round);
  if (tool === "goal" && target) state.aim = { x, y, theta: 0 };
  if (tool === "pose" && target) {
    const held = grasped(state, size, target, left, top);
    state.aim = held ? { ...held, from: [x, y], start: held } : { x, y, theta: 0 };
  }
  if (tool === "paint" && target) state.stroke = [{ x, y }];
  if (tool === "measure") state.ruler = [[x, y], [x, y]];
}

/** Continues to set it, at a position in the world. */
export function continueDrag({ view, aim, stroke, ruler }, [x, y]) {
  const isBeyond = (pixels, from, to) => Math.hypot(to.x - from.x, to.y - from.y) * view.scale > pixels;
  if (aim?.from) {
    // A dragged pose keeps its heading.
    const { from, start } = aim;
    Object.assign(aim, { x: round(start.x + x - from[0]), y: round(start.y + y - from[1]) });
  } else if (stroke) {
    const point = { x: round(x), y: round(y) };
    if (isBeyond(STROKE_STEP, stroke.at(-1), point)) stroke.push(point);
  } else if (aim) {
    if (!isBeyond(TURN, aim, { x, y })) return;
    Object.assign(aim, { isTurned: true, theta: round(Math.atan2(y - aim.y, x - aim.x)) });
  } else if (ruler) ruler[1] = [x, y];
}

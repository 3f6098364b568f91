// Frames of a map: when one is drawn, and what is on it.
import { colors, onTheme, useEffect } from "/slate.js";
import * as draw from "/map/draw.js";
import { isTurned } from "/map/drag.js";
import { brushStroke, estimate } from "/map/layers.js";
import { knownPose, paintScene } from "/map/paint.js";

/** Calls `paint` after each render, and in a frame after a change of `state`. */
export function useFrames(canvas, state, size, paint) {
  useEffect(() => {
    if (!size) return undefined;
    const redraw = () => (state.isDirty = true);
    let frame = 0;
    const loop = () => {
      frame = requestAnimationFrame(loop);
      if (!state.isDirty || !canvas.current || !state.view) return;
      state.isDirty = false;
      paint();
    };
    state.isDirty = true;
    loop();
    const end = onTheme(redraw);
    return () => {
      end();
      cancelAnimationFrame(frame);
    };
  });
}

/** The context of a canvas that has a pixel of its own for each of the screen. */
function cleared(element, size) {
  const ratio = devicePixelRatio || 1;
  if (element.width !== size.width * ratio || element.height !== size.height * ratio) {
    element.width = size.width * ratio;
    element.height = size.height * ratio;
  }
  const context = element.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, size.width, size.height);
  return context;
}

/** Draws the scene, and above it what a person sets or measures. */
export function paintFrame(element, state, size, { content, tools, isShown, follow }) {
  const { scene, scans, world, trails, gates } = content;
  const { tool, target, brush, mark } = tools;
  const followed = scene.robots.find(({ name }) => name === follow);
  const leader = followed && knownPose(state.readings.get(followed.pose));
  if (leader) Object.assign(state.view, { x: leader.x, y: leader.y });
  const { view, readings, ruler, aim, stroke } = state;
  const scheme = colors();
  const context = cleared(element, size);
  const canvas = [context, scheme, view, size];
  const held = aim && target?.shows;
  paintScene(...canvas, { scene, scans, world, readings, isShown, trails, gates, held });
  if (ruler) draw.ruler(...canvas, ruler);
  if (aim) {
    if (tool === "pose") estimate(...canvas, { pose: aim }, "", true);
    else if (isTurned(target, aim)) draw.arrow(...canvas, aim, "", scheme.text);
    else draw.goal(...canvas, aim.x, aim.y, "", scheme.text);
  }
  if (stroke) brushStroke(...canvas, stroke, brush, mark);
  draw.scaleBar(...canvas);
}

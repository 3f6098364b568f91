// Readings of the properties that a map draws.
import { useEffect, useMemo, useRef, useState, watch } from "/slate.js";
import { shownPath } from "/map/edit.js";
import { boundsOf } from "/map/layers.js";
import { LAYERS, needs } from "/map/paint.js";

/** Properties that a map draws, by path; large ones with their rate and form. */
export function useDrawn({ scene, scans, actuators, gates, targetsByTool }, tool, isShown) {
  return useMemo(() => {
    const { robots, poses } = scene;
    const paths = [
      ...robots.flatMap(({ name, pose, status }) => [pose, status, ...gates[name]]),
      ...poses.map(({ path }) => path),
    ];
    const all = paths.map((path) => ({ path }));
    all.push(...needs(scene, scans, isShown));
    // A dragged object is always drawn.
    if (tool === "pose" || tool === "goal") {
      all.push(...targetsByTool[tool].map((target) => ({ path: shownPath(target) })));
    }
    return new Map(all.filter(({ path }) => path).map((wish) => [wish.path, wish]));
  }, [scene, scans, actuators, targetsByTool, tool, ...Object.keys(LAYERS).map(isShown)]);
}

/** Keeps readings of drawn properties in `state`; returns the bounds of a grid. */
export function useSubscriptions(drawn, state) {
  const [gridBounds, setGridBounds] = useState(null);
  const ends = useRef(new Map()).current;
  const bounding = useRef(null);
  const take = (path) => (reading) => {
    state.readings.set(path, reading);
    state.isDirty = true;
    // Without a world, the first occupancy grid defines the bounds, also as it grows.
    if (reading.value.resolution > 0 && (bounding.current ?? path) === path) {
      bounding.current = path;
      const found = boundsOf(reading.value);
      setGridBounds((bounds) => (JSON.stringify(bounds) === JSON.stringify(found) ? bounds : found));
    }
  };
  const drop = (path) => () => {
    state.readings.delete(path);
    state.isDirty = true;
  };
  useEffect(() => {
    // Earlier subscriptions continue.
    for (const [path, end] of ends) {
      if (drawn.has(path)) continue;
      end();
      ends.delete(path);
      drop(path)();
    }
    // Drawn properties are watched at the frame rate, large ones more slowly.
    for (const [path, { rate = 20, decode }] of drawn) {
      if (!ends.has(path)) ends.set(path, watch(path, take(path), { rate, decode, none: drop(path) }));
    }
  }, [drawn]);
  useEffect(() => () => ends.forEach((end) => end()), []);
  return gridBounds;
}

// Conversion between meters and pixels. The center of the view is a point of the world; `scale` is pixels per meter.

// Margin around the world, pixels; the readout of the robots is above it.
const [ABOVE, AROUND] = [66, 26];

/** A view that shows the whole bounds. */
export function fit({ minimum, maximum }, { width, height }) {
  const room = [maximum[0] - minimum[0], maximum[1] - minimum[1]];
  const scale = Math.max(2, Math.min((width - 2 * AROUND) / (room[0] || 1), (height - ABOVE - AROUND) / (room[1] || 1)));
  return { x: (minimum[0] + maximum[0]) / 2, y: (minimum[1] + maximum[1]) / 2 + (ABOVE - AROUND) / 2 / scale, scale };
}

export const toPixel = (view, { width, height }, x, y) => [width / 2 + (x - view.x) * view.scale, height / 2 - (y - view.y) * view.scale];

export const toWorld = (view, { width, height }, left, top) => [view.x + (left - width / 2) / view.scale, view.y - (top - height / 2) / view.scale];

/** Pans by a motion of the pointer, pixels. */
export const pan = (view, across, down) =>
  ({ ...view, x: view.x - across / view.scale, y: view.y + down / view.scale });

/** Zooms with one pixel fixed. */
export function zoom(view, size, left, top, factor) {
  const [x, y] = toWorld(view, size, left, top);
  const scale = Math.min(4000, Math.max(2, view.scale * factor));
  const kept = { ...view, scale };
  const [otherX, otherY] = toWorld(kept, size, left, top);
  return { ...kept, x: view.x + x - otherX, y: view.y + y - otherY };
}

/** A step of 1, 2 or 5 times a power of ten with at least this width in pixels. */
export function step(scale, pixels) {
  const least = pixels / scale;
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((factor) => factor * power).find((size) => size >= least);
}

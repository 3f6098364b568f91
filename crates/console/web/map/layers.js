// Beliefs of robots: occupancy grids, costmaps, planned paths, pose graphs, pose estimates with covariance.
import { toPixel } from "/map/view.js";

// Standard deviations of the 95 % region of a normal distribution in two dimensions.
const SURE = 2.4477;

// Images of grids, one for each value and theme.
const pictures = new Map();

const rgb = (color) => {
  const digits = color.replace("#", "");
  return [0, 2, 4].map((place) => Number.parseInt(digits.slice(place, place + 2), 16));
};

// The pixel of each percentage by its lowest byte; what is unknown is transparent.
function palette(pixel) {
  const pixels = new Uint32Array(256);
  for (let percent = 0; percent <= 100; percent += 1) {
    const [[red, green, blue], alpha] = pixel(percent);
    pixels[percent] = ((Math.round(255 * alpha) << 24) | (Math.round(blue) << 16) | (Math.round(green) << 8) | Math.round(red)) >>> 0;
  }
  return pixels;
}

// Uncertain cells are faint.
const occupancy = ({ free, occupied }) => palette((percent) => [rgb(percent < 50 ? free : occupied), Math.min(1, 0.15 + 1.7 * Math.abs(percent / 100 - 0.5))]);

// As RViz shows a costmap: 1 to 98 inflated, 99 too near to an obstacle, 100 an obstacle.
const costs = () => palette((percent) => {
  if (percent === 0) return [[0, 0, 0], 0];
  if (percent === 100) return [[255, 0, 255], 0.85];
  if (percent === 99) return [[0, 200, 230], 0.6];
  return [[40 + 2 * percent, 60 - 0.5 * percent, 255 - 0.3 * percent], 0.2 + 0.0035 * percent];
});

/** An occupancy grid of the form `binary`. */
export function decodeGrid(bytes) {
  if (bytes.byteLength < 40) return null;
  const view = new DataView(bytes);
  const [x, y, theta, resolution] = [0, 8, 16, 24].map((place) => view.getFloat64(place, true));
  const [width, height] = [32, 36].map((place) => view.getUint32(place, true));
  if (bytes.byteLength < 40 + width * height) return null;
  return { origin: { x, y, theta }, resolution, width, height, data: new Int8Array(bytes, 40, width * height) };
}

/** A grid as an image, a pixel for each cell, its first row at the top; nothing if its size is inconsistent. */
function picture(path, { value, sequence }, colors, paletteOf) {
  const key = `${sequence} ${colors.free} ${colors.occupied}`;
  const known = pictures.get(path);
  if (known?.key === key) return known.canvas;
  const { width, height, data } = value;
  if (!(width > 0 && height > 0) || data.length !== width * height) return null;
  const canvas = new OffscreenCanvas(width, height);
  const context = canvas.getContext("2d");
  const image = context.createImageData(width, height);
  const [pixels, drawn] = [paletteOf(colors), new Uint32Array(image.data.buffer)];
  for (let row = 0; row < height; row += 1) {
    const [from, to] = [row * width, (height - 1 - row) * width];
    for (let column = 0; column < width; column += 1) drawn[to + column] = pixels[data[from + column] & 255];
  }
  context.putImageData(image, 0, 0);
  pictures.set(path, { key, canvas });
  return canvas;
}

/** An occupancy grid: free cells tinted, occupied ones dark on light or light on dark, unknown ones transparent; faint if it is of another
 *  time than the rest. */
export function gridMap(context, colors, view, size, path, reading, isOfNow = false, paletteOf = occupancy) {
  const drawn = picture(path, reading, colors, paletteOf);
  if (!drawn) return;
  const { origin, resolution, width, height } = reading.value;
  const [left, bottom] = toPixel(view, size, origin.x, origin.y);
  const cell = resolution * view.scale;
  context.save();
  context.imageSmoothingEnabled = false;
  context.translate(left, bottom);
  context.rotate(-origin.theta);
  context.globalAlpha = isOfNow ? 0.35 : 1;
  context.drawImage(drawn, 0, -height * cell, width * cell, height * cell);
  context.globalAlpha = 1;
  context.strokeStyle = colors.muted;
  context.setLineDash([2, 4]);
  context.lineWidth = 1;
  context.strokeRect(0, -height * cell, width * cell, height * cell);
  context.restore();
}

/** A costmap: free and unknown cells transparent, inflated ones from blue to magenta, those too near to an obstacle cyan, obstacles magenta. */
export const costmap = (context, colors, view, size, path, reading, isOfNow) => gridMap(context, colors, view, size, path, reading, isOfNow, costs);

/** Bounds of the occupied cells of a grid. */
export function boundsOf({ origin, resolution, width, height }) {
  const [sine, cosine] = [Math.sin(origin.theta), Math.cos(origin.theta)];
  const corners = [[0, 0], [width, 0], [0, height], [width, height]].map(([across, up]) => [
    origin.x + resolution * (across * cosine - up * sine),
    origin.y + resolution * (across * sine + up * cosine),
  ]);
  const axis = (place, choose) => choose(...corners.map((corner) => corner[place]));
  return { minimum: [axis(0, Math.min), axis(1, Math.min)], maximum: [axis(0, Math.max), axis(1, Math.max)] };
}

/** A planned path: a line with a bead at each turn. */
export function plannedPath(context, colors, view, size, points) {
  if (points.length < 2) return;
  const pixels = points.map(({ x, y }) => toPixel(view, size, x, y));
  const trace = () => {
    context.beginPath();
    pixels.forEach(([x, y], place) => (place ? context.lineTo(x, y) : context.moveTo(x, y)));
    context.stroke();
  };
  context.lineJoin = context.lineCap = "round";
  context.strokeStyle = colors.surface;
  context.lineWidth = 5;
  trace();
  context.strokeStyle = context.fillStyle = colors.path;
  context.lineWidth = 2.5;
  trace();
  context.lineCap = "butt";
  for (const [x, y] of pixels.slice(1)) {
    context.beginPath();
    context.arc(x, y, 3.5, 0, 2 * Math.PI);
    context.fill();
  }
}

/** A pose graph: the way from scan to scan, and thin lines where loops are closed. */
export function poseGraph(context, colors, view, size, edges) {
  const stroke = (kind, color, width, alpha) => {
    context.beginPath();
    for (const { from, to } of edges.filter((edge) => edge.kind === kind)) {
      context.moveTo(...toPixel(view, size, from.x, from.y));
      context.lineTo(...toPixel(view, size, to.x, to.y));
    }
    context.strokeStyle = color;
    context.lineWidth = width;
    context.globalAlpha = alpha;
    context.stroke();
    context.globalAlpha = 1;
  };
  stroke("LOOP_CLOSURE", colors.reactive, 1, 0.25);
  stroke("ODOMETRY", colors.estimate, 1.5, 0.8);
}

/** Frontiers: their cells as dots. */
export function frontierCells(context, colors, view, size, points) {
  const side = Math.max(3, 0.05 * view.scale);
  context.fillStyle = colors.amber;
  for (const { x, y } of points) {
    const [left, top] = toPixel(view, size, x, y);
    context.fillRect(left - side / 2, top - side / 2, side, side);
  }
}

/** Half axes, m, and angle of the 95 % ellipse of a covariance with rows of x, y, theta or of ROS's six. */
export function ellipse(covariance) {
  const row = covariance.length === 36 ? 6 : 3;
  const [a, b, d] = [covariance[0], covariance[1], covariance[row + 1]];
  const middle = (a + d) / 2;
  const apart = Math.hypot((a - d) / 2, b);
  return {
    long: SURE * Math.sqrt(Math.max(0, middle + apart)),
    short: SURE * Math.sqrt(Math.max(0, middle - apart)),
    turn: 0.5 * Math.atan2(2 * b, a - d),
    heading: 1.96 * Math.sqrt(Math.max(0, covariance[covariance.length - 1])),
  };
}

/** A pose estimate: an arrow, the 95 % ellipse of its position, and the opening of its heading. */
export function estimate(context, colors, view, size, { pose, covariance }, words, isHeld = false) {
  const [left, top] = toPixel(view, size, pose.x, pose.y);
  if (covariance) {
    const { long, short, turn, heading } = ellipse(covariance);
    context.beginPath();
    context.ellipse(left, top, Math.max(2, long * view.scale), Math.max(2, short * view.scale), -turn, 0, 2 * Math.PI);
    context.fillStyle = context.strokeStyle = colors.estimate;
    context.globalAlpha = 0.18;
    context.fill();
    context.globalAlpha = 1;
    context.lineWidth = 1.5;
    context.stroke();
    const reach = Math.max(30, 0.45 * view.scale);
    context.beginPath();
    context.moveTo(left, top);
    context.arc(left, top, reach, -pose.theta - Math.min(Math.PI, heading), -pose.theta + Math.min(Math.PI, heading));
    context.closePath();
    context.globalAlpha = 0.16;
    context.fill();
    context.globalAlpha = 1;
  }
  context.save();
  context.translate(left, top);
  context.rotate(-pose.theta);
  context.beginPath();
  for (const [x, y] of [[16, 0], [-8, 7], [-4, 0], [-8, -7]]) context.lineTo(x, y);
  context.closePath();
  context.fillStyle = colors.estimate;
  context.fill();
  context.strokeStyle = isHeld ? colors.text : colors.surface;
  context.lineWidth = 1.5;
  context.stroke();
  context.restore();
  context.font = "12px system-ui, sans-serif";
  context.lineWidth = 3;
  context.strokeStyle = colors.surface;
  context.strokeText(words, left + 14, top + 18);
  context.fillStyle = colors.estimate;
  context.fillText(words, left + 14, top + 18);
}

/** A stroke before it is painted. */
export function brushStroke(context, colors, view, size, points, width, mark) {
  context.strokeStyle = { OCCUPIED: colors.occupied, FREE: colors.free, MEASURED: colors.muted }[mark];
  context.lineWidth = Math.max(2, width * view.scale);
  context.lineCap = context.lineJoin = "round";
  context.globalAlpha = 0.8;
  context.beginPath();
  points.forEach(({ x, y }, place) => {
    const [left, top] = toPixel(view, size, x, y);
    if (place) context.lineTo(left, top);
    else context.moveTo(left, top);
  });
  if (points.length === 1) context.lineTo(...toPixel(view, size, points[0].x, points[0].y));
  context.stroke();
  context.lineCap = "butt";
  context.globalAlpha = 1;
}

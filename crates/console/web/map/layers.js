// Beliefs of robots: occupancy grids, planned paths, pose estimates with covariance.
import { toPixel } from "/map/view.js";

// Standard deviations of the 95 % region of a normal distribution in two dimensions.
const SURE = 2.4477;

// Images of grids, one for each value and theme.
const pictures = new Map();

const rgb = (color) => {
  const digits = color.replace("#", "");
  return [0, 2, 4].map((place) => Number.parseInt(digits.slice(place, place + 2), 16));
};

/** A grid as an image, a pixel for each cell, its first row at the top; nothing if its size is inconsistent. */
function picture(path, { value, sequence }, colors) {
  const key = `${sequence} ${colors.free} ${colors.occupied}`;
  const known = pictures.get(path);
  if (known?.key === key) return known.canvas;
  const { width, height, data } = value;
  if (!(width > 0 && height > 0) || data.length !== width * height) return null;
  const canvas = new OffscreenCanvas(width, height);
  const context = canvas.getContext("2d");
  const image = context.createImageData(width, height);
  const [free, occupied] = [rgb(colors.free), rgb(colors.occupied)];
  for (let cell = 0; cell < data.length; cell += 1) {
    const percent = data[cell];
    if (percent < 0) continue;
    const color = percent < 50 ? free : occupied;
    const row = height - 1 - Math.floor(cell / width);
    const place = 4 * (row * width + (cell % width));
    image.data.set(color, place);
    // Uncertain cells are faint.
    image.data[place + 3] = Math.round(255 * Math.min(1, 0.15 + 1.7 * Math.abs(percent / 100 - 0.5)));
  }
  context.putImageData(image, 0, 0);
  pictures.set(path, { key, canvas });
  return canvas;
}

/** An occupancy grid: free cells tinted, occupied ones dark on light or light on dark, unknown ones transparent; faint if it is of another
 *  time than the rest. */
export function gridMap(context, colors, view, size, path, reading, isOfNow = false) {
  const drawn = picture(path, reading, colors);
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

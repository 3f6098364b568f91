// Drawing of the map.
import { step, toPixel, toWorld } from "/map/view.js";

const STYLE = {
  DELIBERATIVE: { color: "deliberative", dash: [] },
  REACTIVE: { color: "reactive", dash: [6, 4] },
  IDLE: { color: "idle", dash: [2, 3] },
};

function outline(context, points, close = true) {
  context.beginPath();
  points.forEach(([x, y], place) => (place ? context.lineTo(x, y) : context.moveTo(x, y)));
  if (close) context.closePath();
}

function text(context, colors, words, x, y, color = colors.text) {
  context.font = "12px system-ui, sans-serif";
  context.lineWidth = 3;
  context.strokeStyle = colors.surface;
  context.lineJoin = "round";
  context.strokeText(words, x, y);
  context.fillStyle = color;
  context.fillText(words, x, y);
}

/** A grid of lines, about one per meter. */
export function grid(context, colors, view, size) {
  const distance = step(view.scale, 48);
  const [left, top] = toWorld(view, size, 0, 0);
  const [right, bottom] = toWorld(view, size, size.width, size.height);
  context.strokeStyle = colors.line;
  context.lineWidth = 1;
  context.globalAlpha = 0.55;
  context.beginPath();
  for (let x = Math.ceil(left / distance) * distance; x <= right; x += distance) {
    const [pixel] = toPixel(view, size, x, 0);
    context.moveTo(Math.round(pixel) + 0.5, 0);
    context.lineTo(Math.round(pixel) + 0.5, size.height);
  }
  for (let y = Math.ceil(bottom / distance) * distance; y <= top; y += distance) {
    const [, pixel] = toPixel(view, size, 0, y);
    context.moveTo(0, Math.round(pixel) + 0.5);
    context.lineTo(size.width, Math.round(pixel) + 0.5);
  }
  context.stroke();
  context.globalAlpha = 1;
}

/** A scale bar. */
export function scaleBar(context, colors, view, size) {
  const distance = step(view.scale, 60);
  const length = distance * view.scale;
  const [x, y] = [size.width - length - 14, size.height - 14];
  context.strokeStyle = colors.muted;
  context.lineWidth = 1.5;
  outline(context, [[x, y - 5], [x, y], [x + length, y], [x + length, y - 5]], false);
  context.stroke();
  const words = distance < 1 ? `${Math.round(distance * 100)} cm` : `${distance} m`;
  context.textAlign = "center";
  text(context, colors, words, x + length / 2, y - 6, colors.muted);
  context.textAlign = "start";
}

/** Walls and other bodies. */
export function world(context, colors, view, size, { polygons = [], circles = [] }) {
  context.fillStyle = colors.wall;
  for (const { points } of polygons) {
    outline(context, points.map(([x, y]) => toPixel(view, size, x, y)));
    context.fill();
  }
  for (const { x, y, radius } of circles) {
    context.beginPath();
    context.arc(...toPixel(view, size, x, y), radius * view.scale, 0, 2 * Math.PI);
    context.fill();
  }
}

/** The trail of a robot: a line with a dash and a color for each route, and squares at changes. Each of several robots
 *  has a band of its `own` color below, which is also the color of a trail without routes. */
export function trail(context, colors, view, size, { points: all }, now, own = null) {
  const points = all.at(-1)?.time > now ? all.filter(({ time }) => time <= now) : all;
  let begin = 0;
  if (own && points.length > 1) {
    context.setLineDash([]);
    context.globalAlpha = 0.3;
    context.lineWidth = 8;
    context.strokeStyle = own;
    outline(context, points.map(({ x, y }) => toPixel(view, size, x, y)), false);
    context.stroke();
    context.globalAlpha = 1;
  }
  context.lineWidth = 2.5;
  context.lineJoin = "round";
  while (begin < points.length) {
    const { route } = points[begin];
    let end = begin;
    while (end + 1 < points.length && points[end].route === route) end += 1;
    const { color, dash } = STYLE[route] ?? STYLE.IDLE;
    const ink = own && color === "idle" ? own : colors[color];
    context.strokeStyle = ink;
    context.setLineDash(dash);
    outline(context, points.slice(begin, end + 1).map(({ x, y }) => toPixel(view, size, x, y)), false);
    context.stroke();
    if (begin > 0) {
      const [x, y] = toPixel(view, size, points[begin].x, points[begin].y);
      context.fillStyle = ink;
      context.fillRect(x - 3, y - 3, 6, 6);
    }
    if (end === begin) break;
    begin = end;
    if (end === points.length - 1) break;
  }
  context.setLineDash([]);
}

/** A robot: its body, its wheels, and its front. */
export function robot(context, colors, view, size, body, { x, y, theta }, color) {
  const [sine, cosine] = [Math.sin(theta), Math.cos(theta)];
  const place = ([ahead, left]) => toPixel(view, size, x + ahead * cosine - left * sine, y + ahead * sine + left * cosine);
  outline(context, body.outline.map(place));
  context.fillStyle = colors.raised;
  context.fill();
  context.lineWidth = 2;
  context.strokeStyle = color;
  context.stroke();
  context.fillStyle = color;
  for (const [[back, right], [front, left]] of body.wheels ?? []) {
    outline(context, [[back, right], [front, right], [front, left], [back, left]].map(place));
    context.fill();
  }
  const front = Math.max(...body.outline.map(([ahead]) => ahead));
  outline(context, [[front * 0.85, 0], [front * 0.25, front * 0.35], [front * 0.25, -front * 0.35]].map(place));
  context.fill();
  const [left, top] = toPixel(view, size, x, y);
  text(context, colors, body.name, left + 0.3 * view.scale + 4, top - 0.22 * view.scale);
}

/** A pose without a body. */
export function arrow(context, colors, view, size, { x, y, theta }, words, color = colors.accent) {
  const [left, top] = toPixel(view, size, x, y);
  context.save();
  context.translate(left, top);
  context.rotate(-theta);
  outline(context, [[16, 0], [-8, 7], [-4, 0], [-8, -7]]);
  context.fillStyle = color;
  context.fill();
  context.restore();
  text(context, colors, words, left + 12, top - 8);
}

/** Echoes of sonars: an arc at the range, fainter without an echo. */
export function sonar(context, colors, view, size, pose, { echoes, placements, field_of_view: opening }) {
  const [sine, cosine] = [Math.sin(pose.theta), Math.cos(pose.theta)];
  echoes.forEach(({ heard, range }, place) => {
    const at = placements[place];
    if (!at || !heard || range === null) return;
    const [x, y] = toPixel(view, size, pose.x + at.x * cosine - at.y * sine, pose.y + at.x * sine + at.y * cosine);
    const direction = -(pose.theta + at.theta);
    context.beginPath();
    context.moveTo(x, y);
    context.arc(x, y, range * view.scale, direction - opening / 2, direction + opening / 2);
    context.closePath();
    context.fillStyle = colors.accent;
    context.globalAlpha = 0.1;
    context.fill();
    context.globalAlpha = 0.9;
    context.beginPath();
    context.arc(x, y, range * view.scale, direction - opening / 2, direction + opening / 2);
    context.strokeStyle = colors.accent;
    context.lineWidth = 2;
    context.stroke();
    context.globalAlpha = 1;
  });
}

/** Points of a laser scan. */
export function laser(context, colors, view, size, pose, { angle_min: first, angle_increment: between, ranges, range_max: most }) {
  context.fillStyle = colors.accent;
  ranges.forEach((range, place) => {
    if (range === null || range >= most) return;
    const direction = pose.theta + first + place * between;
    const [x, y] = toPixel(view, size, pose.x + range * Math.cos(direction), pose.y + range * Math.sin(direction));
    context.fillRect(x - 1.5, y - 1.5, 3, 3);
  });
}

/** Sightings of other robots. */
export function sightings(context, colors, view, size, pose, { list }) {
  context.setLineDash([3, 4]);
  context.strokeStyle = colors.muted;
  context.lineWidth = 1.5;
  for (const { range, bearing } of list) {
    const direction = pose.theta + bearing;
    const end = toPixel(view, size, pose.x + range * Math.cos(direction), pose.y + range * Math.sin(direction));
    outline(context, [toPixel(view, size, pose.x, pose.y), end], false);
    context.stroke();
  }
  context.setLineDash([]);
}

/** A goal: a ring with a cross. */
export function goal(context, colors, view, size, x, y, words, color = colors.accent) {
  const [left, top] = toPixel(view, size, x, y);
  context.strokeStyle = color;
  context.lineWidth = 2;
  context.beginPath();
  context.arc(left, top, 7, 0, 2 * Math.PI);
  for (const [across, down] of [[-11, 0], [4, 0], [0, -11], [0, 4]]) {
    context.moveTo(left + across, top + down);
    context.lineTo(left + across + (down ? 0 : 7), top + down + (across ? 0 : 7));
  }
  context.stroke();
  text(context, colors, words, left + 13, top + 4, color);
}

/** A distance between two points. */
export function ruler(context, colors, view, size, [from, to]) {
  const [one, other] = [toPixel(view, size, ...from), toPixel(view, size, ...to)];
  context.strokeStyle = colors.text;
  context.lineWidth = 1.5;
  outline(context, [one, other], false);
  context.stroke();
  const length = Math.hypot(to[0] - from[0], to[1] - from[1]);
  text(context, colors, `${length.toFixed(3)} m`, (one[0] + other[0]) / 2 + 8, (one[1] + other[1]) / 2 - 8);
}

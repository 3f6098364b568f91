// What a robot that localizes and navigates works with: particles, obstacles, local plans, zones, goals of its mission.
import { arrow, goal } from "/map/draw.js";
import { toPixel } from "/map/view.js";

// Most particles that are drawn.
const MOST_PARTICLES = 2000;
// Age from which a local plan is not drawn, ns.
const OLD = 1e9;

/** Particles: a dash in the heading of each, from its position on. */
export function particles(context, colors, view, size, { particles: all }) {
  const stride = Math.ceil(all.length / MOST_PARTICLES);
  const length = Math.max(5, 0.12 * view.scale);
  context.beginPath();
  for (let place = 0; place < all.length; place += stride) {
    const { x, y, theta } = all[place].pose;
    const [left, top] = toPixel(view, size, x, y);
    context.moveTo(left, top);
    context.lineTo(left + length * Math.cos(theta), top - length * Math.sin(theta));
    context.rect(left - 1, top - 1, 2, 2);
  }
  context.strokeStyle = colors.estimate;
  context.lineWidth = 1;
  context.globalAlpha = 0.7;
  context.stroke();
  context.globalAlpha = 1;
}

/** Obstacles around a robot, which it remembers in the frame of its odometry: moved there from its pose in the map. */
export function obstacles(context, colors, view, size, pose, { pose: odometry, points }) {
  const turn = pose.theta - odometry.theta;
  const [sine, cosine] = [Math.sin(turn), Math.cos(turn)];
  context.fillStyle = colors.amber;
  for (const { x, y } of points) {
    const [across, up] = [x - odometry.x, y - odometry.y];
    const [left, top] = toPixel(view, size, pose.x + across * cosine - up * sine, pose.y + across * sine + up * cosine);
    context.fillRect(left - 1, top - 1, 2, 2);
  }
}

/** A local plan: the trajectory that the robot follows, and thin ones that were compared, fainter with less weight; those that collide are gray. */
export function localPlan(context, colors, view, size, { value: { steps, points }, time }, now) {
  if (!(steps > 1) || now - time > OLD) return;
  const trace = (from) => {
    context.beginPath();
    for (const { x, y } of points.slice(from, from + steps)) context.lineTo(...toPixel(view, size, x, y));
    context.stroke();
  };
  context.lineJoin = context.lineCap = "round";
  context.lineWidth = 1;
  for (let from = steps; from + steps <= points.length; from += steps) {
    const { weight } = points[from];
    context.strokeStyle = weight > 0 ? colors.reactive : colors.muted;
    context.globalAlpha = weight > 0 ? 0.3 + 0.6 * Math.sqrt(weight) : 0.25;
    trace(from);
  }
  context.globalAlpha = 1;
  for (const [color, width] of [[colors.surface, 6], [colors.text, 3]]) {
    Object.assign(context, { strokeStyle: color, lineWidth: width });
    trace(0);
  }
  context.lineCap = "butt";
}

/** Rectangles that a robot keeps out of: hatched. */
export function keepOutZones(context, colors, view, size, zones) {
  context.strokeStyle = context.fillStyle = colors.red;
  context.lineWidth = 1.5;
  for (const { min_x: minX, min_y: minY, max_x: maxX, max_y: maxY } of zones) {
    const [left, top] = toPixel(view, size, minX, maxY);
    const [right, bottom] = toPixel(view, size, maxX, minY);
    const [width, height] = [right - left, bottom - top];
    context.save();
    context.beginPath();
    context.rect(left, top, width, height);
    context.globalAlpha = 0.12;
    context.fill();
    context.globalAlpha = 1;
    context.stroke();
    context.clip();
    context.beginPath();
    for (let across = -height; across < width; across += 10) {
      context.moveTo(left + across, bottom);
      context.lineTo(left + across + height, top);
    }
    context.globalAlpha = 0.5;
    context.stroke();
    context.restore();
  }
}

/** Goals of a mission that are not reached yet, in their order. */
export function remaining(mission, status) {
  const all = mission?.goals ?? [];
  if (!status || status.mission !== mission?.number || !all.length) return all;
  const next = mission.is_loop ? status.goal % all.length : status.goal;
  return mission.is_loop ? [...all.slice(next), ...all.slice(0, next)] : all.slice(next);
}

/** Goals of a mission: the present one, which is at the end of the path if it is a place, and the poses of further ones. */
export function mission(context, colors, view, size, goals, path) {
  goals.forEach(({ x, y, theta, has_heading: isTurned, place }, order) => {
    const end = place && order === 0 ? path?.points.at(-1) : null;
    if (place && !end) return;
    const [at, color] = [end ?? { x, y }, order ? colors.muted : colors.accent];
    if (isTurned && !place) arrow(context, colors, view, size, { x, y, theta }, "", color);
    goal(context, colors, view, size, at.x, at.y, place || (goals.length > 1 ? `goal ${order + 1}` : "goal"), color);
  });
}

// Changes that a person makes on a map: goals, poses, cells of the occupancy grid. Each can be undone.
import { at, patch, post, put } from "/api.js";

// Maximum number of points of a stroke.
const POINTS = 32;

/** Whether a property accepts goals, by its name: some poses are estimates. */
const isGoal = (path) => /goal|target|order|waypoint|destination/i.test(path.split("/").at(-1));

/** Targets that a role can change on the map, by tool: `{path, how, turned, shows}`.
 *  `parameters` names those of an operator. */
export function targets(properties, links, interfaces, role, parameters = []) {
  if (role === "viewer") return { goal: [], pose: [], paint: [] };
  const linked = new Set(links.map(({ to }) => to));
  const open = properties.filter(({ path, access }) => access === "messages" || (access === "setting" && !linked.has(path)));
  const how = ({ access }) => (access === "messages" ? "send" : "set");
  const of = (...names) => open.filter(({ interface: name }) => names.includes(name));
  const place = (property) => ({ path: property.path, how: how(property), turned: property.interface === "Pose2" });
  // The pose that the module itself publishes.
  const shows = ({ path, access }) => {
    const module = path.slice(0, path.lastIndexOf("/") + 1);
    const own = properties.find((other) => other.access === "output" && other.path.startsWith(module) && ["PoseEstimate", "Pose2"].includes(other.interface));
    return own?.path ?? (access === "setting" ? path : undefined);
  };
  const goals = [...of("Point2"), ...of("Pose2").filter(({ path }) => isGoal(path))].map(place);
  const poses = of("Pose2").filter(({ path }) => !isGoal(path)).map((property) => ({ ...place(property), shows: shows(property) }));
  // A goal without a reader would have no effect.
  const isRead = ({ path }) => {
    const goal = path.replace(/params$/, "goal");
    return !properties.some(({ path }) => path === goal) || links.some(({ from }) => from === `/${goal}` || from.startsWith(`/${goal}/`));
  };
  const operable = new Set(parameters.filter(({ operable }) => operable).map(({ module, name }) => `${module}/params/${name}`));
  const goalParameters = properties
    .filter(({ access, interface: name }) => access === "setting" && interfaces[name]?.properties?.goal_x && interfaces[name].properties.goal_y)
    .filter(isRead)
    // An operator changes only the parameters in the configuration.
    .filter(({ path }) => role === "developer" || ["goal_x", "goal_y"].every((name) => operable.has(`${path}/${name}`)))
    .map(({ path }) => ({ path, how: "parameters", turned: false }));
  // A robot with a mission is sent by it alone, as by `slate goal`.
  const missions = of("NavigationRequest").filter(({ access }) => access === "messages").map(({ path }) => ({ path, how: "navigate", turned: true, shows: path.replace(/[^/]*$/, "mission") }));
  const isFree = ({ path }) => !missions.some((mission) => path.startsWith(mission.path.split("/").slice(0, -2).map((part) => `${part}/`).join("")));
  const canvases = of("MapStroke").filter(({ access }) => access === "messages").map(({ path }) => ({ path, how: "send" }));
  return { goal: [...missions, ...[...goalParameters, ...goals].filter(isFree)], pose: poses, paint: canvases };
}

/** Path of the property that shows the value of a target; null if none does. */
export const shownPath = ({ path, how, shows }) => shows ?? (how === "send" ? null : path);

const give = (agent, { path, how }, value) => (how === "send" ? post : put)(at(agent, path), value);

/** Changes the mission of a robot that navigates: GO_TO, APPEND, PAUSE, RESUME, CANCEL. */
export const navigate = (agent, { path }, command, goal = {}) =>
  post(at(agent, path), { command, goal: { x: 0, y: 0, theta: 0, has_heading: false, dock: false, place: "", ...goal } });

/** Sends a robot to a pose, behind its goals if `isLast`; returns a function that restores `goals`, those before, if they are known. */
export async function sendTo(agent, target, { x, y, theta, isTurned }, goals, isLast) {
  await navigate(agent, target, isLast ? "APPEND" : "GO_TO", { x, y, theta: isTurned ? theta : 0, has_heading: isTurned });
  if (!goals) return undefined;
  return async () => {
    if (!goals.length) await navigate(agent, target, "CANCEL");
    for (const [order, goal] of goals.entries()) await navigate(agent, target, order ? "APPEND" : "GO_TO", goal);
  };
}

/** Sets a goal or a pose; returns a function that undoes this, if the previous value `before` is known. */
export async function setPlace(agent, target, { x, y, theta }, before) {
  if (target.how === "parameters") {
    await patch(at(agent, target.path), { goal_x: x, goal_y: y });
    return before && (() => patch(at(agent, target.path), { goal_x: before.goal_x, goal_y: before.goal_y }));
  }
  await give(agent, target, target.turned ? { x, y, theta } : { x, y });
  return before && (() => give(agent, target, before));
}

/** Paints a stroke; returns a function that undoes it. */
export async function paint(agent, target, points, width, mark) {
  await post(at(agent, target.path), { width, mark, points: simplified(points) });
  return () => post(at(agent, target.path), { width: 0, mark: "UNDO", points: [] });
}

/** A stroke with at most the permitted number of points (Douglas and Peucker, 1973). */
export function simplified(points) {
  for (let most = 0.005; ; most *= 2) {
    const kept = thin(points, most);
    if (kept.length <= POINTS) return kept;
  }
}

function thin(points, most) {
  if (points.length < 3) return points;
  const [first, last] = [points[0], points.at(-1)];
  const [dx, dy] = [last.x - first.x, last.y - first.y];
  const length = Math.hypot(dx, dy);
  let [farthest, place] = [0, 0];
  for (let middle = 1; middle < points.length - 1; middle += 1) {
    const { x, y } = points[middle];
    const off = length > 0 ? Math.abs((x - first.x) * dy - (y - first.y) * dx) / length : Math.hypot(x - first.x, y - first.y);
    if (off > farthest) [farthest, place] = [off, middle];
  }
  if (farthest <= most) return [first, last];
  return [...thin(points.slice(0, place + 1), most).slice(0, -1), ...thin(points.slice(place), most)];
}

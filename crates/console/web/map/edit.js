// What a person changes on a map: goals, where a robot is, what is where. Each knows how it is taken back.
import { at, patch, post, put } from "/api.js";

// As many points as a stroke has.
const POINTS = 32;

/** Whether a property takes places to go to, after its name: of poses some say where a robot is. */
const isGoal = (path) => /goal|target|order|waypoint|destination/i.test(path.split("/").at(-1));

/** What somebody of a role can change on the map, by the tool that does it: `{path, how, turned, shows}`.
 *  `parameters` say which of them are an operator's, too. */
export function targets(properties, links, interfaces, role, parameters = []) {
  if (role === "viewer") return { goal: [], pose: [], paint: [] };
  const linked = new Set(links.map(({ to }) => to));
  const open = properties.filter(({ path, access }) => access === "messages" || (access === "setting" && !linked.has(path)));
  const how = ({ access }) => (access === "messages" ? "send" : "set");
  const of = (...names) => open.filter(({ interface: name }) => names.includes(name));
  const place = (property) => ({ path: property.path, how: how(property), turned: property.interface === "Pose2" });
  // Of a module that tells where its robot is, the pose that it tells.
  const shows = ({ path, access }) => {
    const module = path.slice(0, path.lastIndexOf("/") + 1);
    const own = properties.find((other) => other.access === "output" && other.path.startsWith(module) && ["PoseEstimate", "Pose2"].includes(other.interface));
    return own?.path ?? (access === "setting" ? path : undefined);
  };
  const goals = [...of("Point2"), ...of("Pose2").filter(({ path }) => isGoal(path))].map(place);
  const poses = of("Pose2").filter(({ path }) => !isGoal(path)).map((property) => ({ ...place(property), shows: shows(property) }));
  // A goal that a module tells and nobody reads would lead nowhere.
  const isRead = ({ path }) => {
    const goal = path.replace(/params$/, "goal");
    return !properties.some(({ path }) => path === goal) || links.some(({ from }) => from === `/${goal}` || from.startsWith(`/${goal}/`));
  };
  const operable = new Set(parameters.filter(({ operable }) => operable).map(({ module, name }) => `${module}/params/${name}`));
  const goalParameters = properties
    .filter(({ access, interface: name }) => access === "setting" && interfaces[name]?.properties?.goal_x && interfaces[name].properties.goal_y)
    .filter(isRead)
    // An operator changes no parameters but those that the configuration names.
    .filter(({ path }) => role === "developer" || ["goal_x", "goal_y"].every((name) => operable.has(`${path}/${name}`)))
    .map(({ path }) => ({ path, how: "parameters", turned: false }));
  const canvases = of("MapStroke").filter(({ access }) => access === "messages").map(({ path }) => ({ path, how: "send" }));
  return { goal: [...goalParameters, ...goals], pose: poses, paint: canvases };
}

const give = (agent, { path, how }, value) => (how === "send" ? post : put)(at(agent, path), value);

/** Sets a goal, or where a robot is; returns what takes that back, if `before`, what it was, is known. */
export async function setPlace(agent, target, { x, y, theta }, before) {
  if (target.how === "parameters") {
    await patch(at(agent, target.path), { goal_x: x, goal_y: y });
    return before && (() => patch(at(agent, target.path), { goal_x: before.goal_x, goal_y: before.goal_y }));
  }
  await give(agent, target, target.turned ? { x, y, theta } : { x, y });
  return before && (() => give(agent, target, before));
}

/** Paints a stroke; returns what takes it back. */
export async function paint(agent, target, points, width, mark) {
  await post(at(agent, target.path), { width, mark, points: simplified(points) });
  return () => post(at(agent, target.path), { width: 0, mark: "UNDO", points: [] });
}

/** The same line with as many points as a stroke has at most: those that are least off are left out (Douglas and Peucker). */
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

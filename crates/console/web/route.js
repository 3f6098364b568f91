// The commander of a robot: one of its routes, or a person.
import { useReadings } from "/live.js";
import { useResource } from "/store.js";

const PERSON = "TELEOPERATION";

/** The gates of a robot's actuators: those whose paths contain its name, or all of an agent with a single robot. */
export function gatesOf(actuators, robot) {
  const gates = actuators.map(({ name }) => `${name}/gate`);
  const own = gates.filter((path) => path.split("/").includes(robot));
  return own.length || gates.some((path) => path.split("/").length > 2) ? own : gates;
}

/** The route of a robot: that of its Execute, unless a person commands one of its actuators. */
export function routeOf(route, gates) {
  const isDriven = gates.some((gate) => gate && gate.priority === PERSON && gate.age !== null);
  return isDriven ? PERSON : route;
}

/** The route of a robot, for a component; `route` is that of its Execute. */
export function useRoute(robot, route) {
  const gates = gatesOf(useResource("/actuators", 5) ?? [], robot);
  const readings = useReadings(gates, 5);
  return routeOf(route, gates.map((path) => readings[path]?.value));
}

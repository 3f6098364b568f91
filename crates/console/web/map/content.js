// What an agent has for a map, from its resources: the scene, and what a person can change in it.
import { useAgent, useInterfaces, useMemo, useProperties, useResource } from "/slate.js";
import { targets } from "/map/edit.js";
import { leavingTrails } from "/map/paint.js";
import { find, measured } from "/map/scene.js";
import { trail } from "/map/trails.js";
import { gatesOf } from "/route.js";

/** The bounds of a world; null without a simulator, as it then has no size. */
function boundsOfWorld(world) {
  const isSized = world?.bounds?.maximum?.some((end, axis) => end > world.bounds.minimum[axis]);
  return isSized ? world.bounds : null;
}

/** The content of a map: scene, scans, trails, gates by robot, and targets by tool. */
export function useContent() {
  const agent = useAgent();
  const properties = useProperties();
  const interfaces = useInterfaces();
  const links = useResource("/links", 5) ?? [];
  const documents = useResource("/documents") ?? [];
  const world = useResource(documents.includes("world") ? "/documents/world" : null);
  const before = useResource(documents.includes("trails") ? "/documents/trails" : null)?.robots;
  const scene = useMemo(() => find(properties, world, interfaces), [properties, world, interfaces]);
  const scans = useMemo(() => measured(scene.scans, links), [scene, links]);
  const parameters = useResource("/parameters", 10);
  const actuators = useResource("/actuators", 5) ?? [];
  const gates = Object.fromEntries(scene.robots.map(({ name }) => [name, gatesOf(actuators, name)]));
  const targetsByTool = useMemo(
    () => targets(properties, links, interfaces, agent?.role, parameters),
    [properties, links, interfaces, agent?.role, parameters],
  );
  const trails = useMemo(
    () => leavingTrails(scene.robots).map(({ name, pose, status }) => trail(pose, status, before?.[name])),
    [scene, before],
  );
  const isEmpty = world === undefined && !documents.length && !scene.poses.length && !properties.length;
  const worldBounds = boundsOfWorld(world);
  return { agent, world, worldBounds, scene, scans, trails, actuators, gates, targetsByTool, isEmpty };
}

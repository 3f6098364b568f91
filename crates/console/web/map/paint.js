// The scene of a map: its layers, from the lowest to the highest.
import { clock, isOfNow } from "/slate.js";
import * as draw from "/map/draw.js";
import * as layers from "/map/layers.js";
import * as navigation from "/map/navigation.js";
import { mounted } from "/map/scene.js";
import { routeOf } from "/route.js";

/** Layers that can be switched, with their titles. */
export const LAYERS = {
  world: "World", grids: "Occupancy grids", costmaps: "Costmaps", zones: "Keep-out zones", obstacles: "Obstacles", graphs: "Pose graphs", frontiers: "Frontiers",
  paths: "Planned paths", plans: "Local plans", particles: "Particles", estimates: "Estimates", scans: "Scans", trails: "Trails", goals: "Goals", sightings: "Sightings", poses: "Poses",
};

/** Whether a scene has more robots than a person can tell apart: those that follow a script, such as people, then have neither trail nor name. */
export const isCrowd = (robots) => robots.length > 12;

// Each of several robots has a color of its own.
const own = (scheme, place) => scheme.series[place % scheme.series.length];

/** Robots that leave a trail. */
export const leavingTrails = (robots) => robots.filter(({ pose, isScripted }) => pose && !(isScripted && isCrowd(robots)));

/** Properties that the shown layers need, with the rate of large ones and their form. */
export function needs(scene, scans, isShown) {
  const all = [];
  const need = (layer, items, how = {}) => isShown(layer) && all.push(...items.map((path) => ({ path, ...how })));
  const paths = (items) => items.map(({ path }) => path);
  need("scans", scans.flatMap(({ path, mount }) => [path, mount]));
  for (const layer of ["sightings", "goals", "paths", "estimates"]) need(layer, paths(scene[layer]));
  need("goals", scene.missions.flatMap(({ path, robot, status }) => [path, status, scene.paths.find((own) => own.robot === robot)?.path]));
  for (const layer of ["grids", "costmaps"]) need(layer, paths(scene[layer]), { rate: 10, decode: layers.decodeGrid });
  for (const layer of ["graphs", "frontiers", "particles"]) need(layer, paths(scene[layer]), { rate: 5 });
  for (const layer of ["plans", "obstacles", "zones"]) need(layer, paths(scene[layer]), { rate: 10 });
  // Obstacles are around the estimated pose.
  need("obstacles", scene.obstacles.map(({ robot }) => scene.estimates.find((own) => own.robot === robot)?.path));
  return all.filter(({ path }) => path);
}

/** The pose in a reading; one that is unknown has no numbers. */
export function knownPose(reading) {
  const pose = reading?.value?.pose ?? reading?.value;
  return [pose?.x, pose?.y, pose?.theta].every(Number.isFinite) ? pose : undefined;
}

/** Draws the scene: `readings` by path, `held` the estimate that is dragged. */
export function paintScene(context, scheme, view, size, { scene, scans, world, readings, isShown, trails, gates, held }) {
  const value = (path) => readings.get(path)?.value;
  const pose = (path) => knownPose(readings.get(path));
  const canvas = [context, scheme, view, size];
  // Calls a function with the value of each property of a layer that has one.
  const each = (layer, paint, of = layer) => {
    if (!isShown(layer)) return;
    for (const item of scene[of]) if (value(item.path)) paint(value(item.path), item, readings.get(item.path));
  };
  draw.grid(...canvas);
  each("grids", (_, { path }, reading) => layers.gridMap(...canvas, path, reading, isOfNow(reading)));
  each("costmaps", (_, { path }, reading) => layers.costmap(...canvas, path, reading, isOfNow(reading)));
  each("graphs", ({ edges }) => layers.poseGraph(...canvas, edges));
  each("frontiers", ({ points }) => layers.frontierCells(...canvas, points));
  if (isShown("world") && world) draw.world(...canvas, world);
  each("zones", ({ keep_out_zones: zones }) => navigation.keepOutZones(...canvas, zones));
  each("obstacles", (obstacles, { robot }) => {
    const estimate = scene.estimates.find((own) => own.robot === robot);
    const at = pose(estimate?.path) ?? pose(scene.robots.find(({ name }) => name === robot)?.pose);
    if (at) navigation.obstacles(...canvas, at, obstacles);
  });
  if (isShown("trails")) trails.forEach((trail, place) => draw.trail(...canvas, trail, clock.now, trails.length > 1 ? own(scheme, place) : null));
  if (isShown("scans")) {
    for (const { path, interface: name, robot, mount } of scans) {
      const [at, scan] = [pose(robot.pose), value(path)];
      if (at && scan) (name === "SonarScan" ? draw.sonar : draw.laser)(...canvas, mounted(at, mount && value(mount)), scan);
    }
  }
  each("sightings", (sightings, { robot }) => pose(robot.pose) && draw.sightings(...canvas, pose(robot.pose), sightings));
  each("paths", ({ points }) => layers.plannedPath(...canvas, points));
  each("plans", (_, __, reading) => navigation.localPlan(...canvas, reading, clock.now));
  for (const body of scene.robots.filter(({ outline }) => outline)) {
    const route = routeOf(value(body.status)?.route, (gates[body.name] ?? []).map(value));
    const color = scheme[{ REACTIVE: "reactive", DELIBERATIVE: "deliberative", TELEOPERATION: "amber" }[route] ?? "idle"];
    const name = body.isScripted && isCrowd(scene.robots) ? "" : body.name;
    draw.robot(...canvas, { ...body, name }, pose(body.pose) ?? body, color);
  }
  each("particles", (cloud) => navigation.particles(...canvas, cloud));
  each("estimates", (estimate, { path, robot }) => path !== held && layers.estimate(...canvas, estimate, `${robot ?? path} estimate`));
  each("poses", (_, { path }) => pose(path) && draw.arrow(...canvas, pose(path), path));
  // Above the robot that has arrived.
  if (isShown("goals")) paintGoals(canvas, scene, world, value);
}

function paintGoals(canvas, scene, world, value) {
  const live = scene.goals.filter(({ path }) => value(path));
  if (!live.length && !scene.missions.length) (world?.goals ?? []).forEach(({ x, y, label }) => draw.goal(...canvas, x, y, label, canvas[1].muted));
  const several = live.length > 1;
  live.forEach(({ path, robot }) => draw.goal(...canvas, value(path).x, value(path).y, several ? `goal of ${robot ?? path}` : "goal"));
  for (const { path, status, robot } of scene.missions.filter(({ path }) => value(path))) {
    const way = value(scene.paths.find((own) => own.robot === robot)?.path);
    navigation.mission(...canvas, navigation.remaining(value(path), value(status)), way);
  }
}

// Content of a map, found by the interfaces of properties, so that it needs no configuration.

const DRIVEN = ["Pose2"];

/** The robot of a property: the one whose name is a part of its path. */
const robotOf = (path, names) => path.split("/").find((part) => names.includes(part));

// Of several goals of a robot, the one that its Plan computed.
const where = (goals) => goals.filter(({ path, robot }) => !path.includes("knowledge") || !goals.some((other) => other.robot === robot && !other.path.includes("knowledge")));

const isWithin = (path, whole) => path === whole || path.startsWith(`${whole}/`);

/** Scans of sensors, without scans that blocks compute. Without links, the first of each kind. */
export function measured(scans, links) {
  const moduleOf = (path) => path.slice(0, path.lastIndexOf("/"));
  const plain = links.map(({ to, from }) => ({ to: to.replace(/^\//, ""), from: String(from).replace(/^(slate:\/\/[^/]*)?\//, "") }));
  const isMade = (scan) => scans.some((other) => other !== scan && other.robot === scan.robot && plain.some(({ to, from }) => isWithin(to, moduleOf(scan.path)) && isWithin(from, other.path)));
  const isFirst = (scan, place) => scans.findIndex((other) => other.robot === scan.robot && other.interface === scan.interface) === place;
  return scans.filter((scan, place) => (links.length ? !isMade(scan) : isFirst(scan, place)));
}

/** The pose of a sensor on a robot at a pose: `mount` is a Transform. */
export function mounted(pose, mount) {
  if (!mount) return pose;
  const { translation: at, rotation: turn } = mount;
  const [sine, cosine] = [Math.sin(pose.theta), Math.cos(pose.theta)];
  return { x: pose.x + at.x * cosine - at.y * sine, y: pose.y + at.x * sine + at.y * cosine, theta: pose.theta + 2 * Math.atan2(turn.z, turn.w) };
}

/** Poses, scans, goals and the rest, each with its robot; `interfaces` has the schemas. */
export function find(properties, world, interfaces = {}) {
  const outputs = properties.filter(({ access }) => access === "output");
  const of = (...interfaces) => outputs.filter((property) => interfaces.includes(property.interface));
  const bodies = world?.robots ?? [];
  // A real robot has a name alone, and an estimate of its pose: `r2/amcl/change`.
  const real = of("PoseEstimate").map(({ path }) => ({ path, name: path.split("/").slice(0, -2).at(-1) })).filter(({ name }) => name && !bodies.some((body) => body.name === name));
  const names = [...bodies, ...real].map(({ name }) => name);
  const owned = (...interfaces) => of(...interfaces).map(({ path }) => ({ path, robot: robotOf(path, names) }));
  const status = (name) => owned("ExecuteStatus").find(({ robot }) => robot === name)?.path;
  const poses = owned(...DRIVEN);
  const robots = bodies.map((body) => ({
    ...body,
    isScripted: world.scripted.includes(body.name),
    pose: poses.find(({ path, robot }) => robot === body.name && path.endsWith("/truth"))?.path ?? poses.find(({ robot }) => robot === body.name)?.path,
    status: status(body.name),
  }));
  for (const { path, name } of real) if (!robots.some((robot) => robot.name === name)) robots.push({ name, isScripted: false, pose: path, status: status(name) });
  const anchored = (...interfaces) =>
    of(...interfaces)
      .map(({ path, interface: name }) => ({ path, interface: name, robot: robots.find((robot) => robot.name === robotOf(path, names)) }))
      .filter(({ robot }) => robot?.pose);
  const grids = owned("OccupancyGrid");
  const isCosts = ({ path }) => /costmap/i.test(path);
  return {
    robots,
    // A pose of no robot of the scene: an arrow.
    poses: [...poses, ...owned("Odometry")].filter(({ robot }) => !robot),
    scans: anchored("SonarScan", "LaserScan").map((scan) => ({ ...scan, mount: of("Transform").find(({ path }) => path === `${scan.path}_mount`)?.path })),
    sightings: anchored("Sightings"),
    grids: grids.filter((grid) => !isCosts(grid)),
    costmaps: grids.filter(isCosts),
    zones: properties.filter(({ interface: name }) => interfaces[name]?.properties?.keep_out_zones).map(({ path }) => ({ path })),
    obstacles: owned("ObstaclePoints"),
    particles: owned("ParticleCloud"),
    paths: owned("Path"),
    plans: owned("LocalPlan"),
    graphs: owned("SlamGraph"),
    frontiers: owned("FrontierPoints"),
    estimates: owned("PoseEstimate"),
    goals: where(owned("Point2").filter(({ path }) => path.endsWith("/goal"))),
    missions: owned("NavigationMission").map((mission) => ({ ...mission, status: owned("NavigationStatus").find(({ robot }) => robot === mission.robot)?.path })),
  };
}

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

/** Poses, scans, goals and the rest, each with its robot. */
export function find(properties, world) {
  const names = (world?.robots ?? []).map(({ name }) => name);
  const outputs = properties.filter(({ access }) => access === "output");
  const of = (...interfaces) => outputs.filter((property) => interfaces.includes(property.interface));
  const poses = of(...DRIVEN).map(({ path }) => ({ path, robot: robotOf(path, names) }));
  const robots = (world?.robots ?? []).map((body) => ({
    ...body,
    isScripted: world.scripted.includes(body.name),
    pose: poses.find(({ path, robot }) => robot === body.name && path.endsWith("/truth"))?.path ?? poses.find(({ robot }) => robot === body.name)?.path,
    status: of("ExecuteStatus").find(({ path }) => robotOf(path, names) === body.name)?.path,
  }));
  const anchored = (...interfaces) =>
    of(...interfaces)
      .map(({ path, interface: name }) => ({ path, interface: name, robot: robots.find((robot) => robot.name === robotOf(path, names)) }))
      .filter(({ robot }) => robot?.pose);
  return {
    robots,
    // A pose of no robot of the scene: an arrow.
    poses: [...poses.filter(({ robot }) => !robot), ...of("Odometry").filter(({ path }) => !robotOf(path, names))].map(({ path }) => ({ path })),
    scans: anchored("SonarScan", "LaserScan").map((scan) => ({ ...scan, mount: of("Transform").find(({ path }) => path === `${scan.path}_mount`)?.path })),
    sightings: anchored("Sightings"),
    grids: of("OccupancyGrid").map(({ path }) => ({ path })),
    paths: of("Path").map(({ path }) => ({ path })),
    graphs: of("SlamGraph").map(({ path }) => ({ path })),
    frontiers: of("FrontierPoints").map(({ path }) => ({ path })),
    estimates: of("PoseEstimate").map(({ path }) => ({ path, robot: robotOf(path, names) })),
    goals: where(of("Point2").filter(({ path }) => path.endsWith("/goal")).map(({ path }) => ({ path, robot: robotOf(path, names) }))),
  };
}

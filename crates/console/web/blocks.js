// The MAPE-K block of each module, by its ports: a Monitor has a percept, an Analyze a change, the Plan
// sends to the plan of an Execute, and a ReactiveModel to its reflexes.

export const BLOCKS = ["Monitor", "Analyze", "Plan", "Execute", "Knowledge", "ReactiveModel"];

/** The module of a property or an input: the longest name that is a prefix of the path. */
export function moduleOf(path, names) {
  let own = "";
  for (const name of names) if (name.length > own.length && path.startsWith(`${name}/`)) own = name;
  return own;
}

/** The robots, each with its modules by their blocks: `{name, execute, blocks: {Monitor: [module]}}`. */
export function robots(modules, properties, links) {
  const names = modules.map(({ name }) => name);
  const outputs = new Map(names.map((name) => [name, []]));
  for (const property of properties) outputs.get(moduleOf(property.path, names))?.push(property);
  const executes = properties.filter(({ interface: name, access }) => name === "ExecuteStatus" && access === "output");
  return executes.map(({ path: status }) => {
    const execute = moduleOf(status, names);
    const robot = execute.includes("/") ? execute.slice(0, execute.lastIndexOf("/") + 1) : "";
    const own = modules.filter(({ name }) => name.startsWith(robot) && (robot || !name.includes("/")));
    const sendsTo = (module, mailbox) => links.some(({ to, from }) => to === `${execute}/${mailbox}` && moduleOf(from.replace(/^\//, ""), names) === module);
    const has = (module, port) => outputs.get(module).some(({ path }) => path === `${module}/${port}`);
    const block = ({ name }) =>
      name === execute ? "Execute"
      : sendsTo(name, "reflexes") ? "ReactiveModel"
      : sendsTo(name, "plan") ? "Plan"
      : has(name, "percept") ? "Monitor"
      : has(name, "change") ? "Analyze"
      : name.includes("knowledge") ? "Knowledge" : "";
    const blocks = Object.fromEntries(BLOCKS.map((name) => [name, []]));
    for (const module of own) {
      // Ports of every module do not identify a block.
      const written = outputs.get(module.name).filter(({ path, access }) => access === "output" && !/\/(histogram|state|timing)$/.test(path));
      blocks[block(module)]?.push({ ...module, outputs: written });
    }
    return { name: robot.replace(/\/$/, "") || execute, execute, status, blocks };
  });
}

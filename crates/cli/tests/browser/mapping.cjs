// What a robot believes of the world, on the map: its grid map, its planned way, how sure it is of its pose; and what a person
// changes of them.
const { Visit, assert, colored, link, pixels, until, value, visit } = require("./page.cjs");

const AGENT = process.argv[5];
const grid = () => value(`${AGENT}/r2/occupancy_mapper/change`);
const estimate = () => value(`${AGENT}/r2/pose_estimator/change`);

/** What a grid map says of a place. */
const at = ({ origin, resolution, width, data }, x, y) => data[Math.floor((y - origin.y) / resolution) * width + Math.floor((x - origin.x) / resolution)];

visit(async () => {
  const browser = await Visit.begin();
  const page = await browser.tab();
  await page.goto(link);
  await until("the robot", async () => /\d m/.test(await page.locator(".readout tr", { hasText: "r2" }).innerText()));
  await until("the map grows", async () => (await grid())?.data.filter((cell) => cell >= 0).length > 2000);

  let pixel;
  const tool = async (name) => {
    await page.click(`button.tool:has-text('${name}')`);
    // What a tool can be told may need a line of its own, which makes the map smaller.
    await page.waitForTimeout(300);
    pixel = await pixels(page);
  };
  for (const theme of ["light", "dark"]) {
    await browser.theme(page, theme);
    await until(`free and occupied cells, a way and an estimate are seen (${theme})`, async () =>
      (await colored(page, ["free"], 24)) > 2000 && (await colored(page, ["occupied"], 40)) > 100 && (await colored(page, ["path"], 12)) > 30 && (await colored(page, ["estimate"], 12)) > 30);
    await browser.picture(page, `mapping-${theme}`);
  }
  await browser.accessible(page, "a map with all that a robot believes");

  // What the laser hits lies where the occupied cells are: the scanner is ahead of the robot's middle.
  const mount = await value(`${AGENT}/simulator/r2/laser_mount`);
  assert(Math.abs(mount.translation.x - 0.12) < 1e-9 && mount.child === "laser", JSON.stringify(mount));
  await until("the laser's points are seen", async () => (await colored(page, ["accent"], 12)) > 100);
  const withScans = await colored(page, ["accent"], 12);

  // The menu closes at Escape, and at a press elsewhere.
  const isOpen = () => page.evaluate(() => document.querySelector(".map details.menu").open);
  await page.click(".map summary:has-text('Layers')");
  assert(await isOpen(), "the menu does not open");
  await page.click("label:has-text('Scans')");
  await until("the scans are not seen", async () => (await colored(page, ["accent"], 12)) < withScans / 2);
  await page.click("label:has-text('Scans')");
  await page.keyboard.press("Escape");
  assert(!(await isOpen()), "the menu ignores Escape");
  await page.click(".map summary:has-text('Layers')");
  await page.click(".head h1");
  assert(!(await isOpen()), "the menu ignores a press elsewhere");

  // A layer is left out.
  await page.click(".map summary:has-text('Layers')");
  await page.click("label:has-text('Planned paths')");
  await until("the way is not seen", async () => (await colored(page, ["path"], 12)) < 10);
  await page.click("label:has-text('Planned paths')");
  await page.click(".map summary:has-text('Layers')");

  // What is painted is in the map, and in the way of the plan; and it is taken back.
  await tool("Paint");
  // The tools need several lines in a narrow tile, and all of the menu is seen.
  await page.setViewportSize({ width: 900, height: 900 });
  await page.click(".map summary:has-text('Layers')");
  const [menu, tile] = await page.evaluate(() => [".map details.menu > div", ".map"].map((one) => document.querySelector(one).getBoundingClientRect().left));
  assert(menu >= tile, `the menu is cut off: it begins at ${menu}, the map at ${tile}`);
  await page.keyboard.press("Escape");
  await page.setViewportSize({ width: 1440, height: 900 });
  await tool("Paint");
  const here = (await estimate()).pose;
  const goal = await value(`${AGENT}/r2/knowledge/goal`);
  // Beside the robot, not on it.
  const [x, y] = here.x > 0 ? [here.x - 0.9, here.y - 0.2] : [here.x + 0.9, here.y - 0.2];
  const before = at(await grid(), x, y);
  await page.mouse.move(...pixel(x, y - 0.4));
  await page.mouse.down();
  for (let step = -4; step <= 4; step += 1) await page.mouse.move(...pixel(x, y + step / 10));
  await page.mouse.up();
  await until("what is painted is in the map", async () => at(await grid(), x, y) === 100);
  await until("it is said", async () => (await page.innerText(".said")).includes("Painted"));
  await browser.picture(page, "mapping-painted");
  await page.selectOption("select[aria-label='Cell state']", "FREE");
  await page.mouse.click(...pixel(x, y));
  await until("it is painted free", async () => at(await grid(), x, y) === 0);
  await page.click("button:has-text('Undo')");
  await until("the last stroke is taken back", async () => at(await grid(), x, y) === 100);
  await page.click("button:has-text('Undo')");
  await until("all is taken back", async () => at(await grid(), x, y) !== 100 || before === 100);

  // The pose is dragged elsewhere, and taken back.
  await tool("Pose");
  const start = (await estimate()).pose;
  await page.mouse.move(...pixel(start.x, start.y));
  await page.mouse.down();
  await page.mouse.move(...pixel(start.x + 0.2, start.y + 0.2), { steps: 3 });
  await page.mouse.move(...pixel(start.x + 0.5, start.y + 0.4), { steps: 3 });
  await page.mouse.up();
  const off = ({ pose }, dx, dy) => Math.hypot(pose.x - start.x - dx, pose.y - start.y - dy);
  await until("the pose is where it was dragged", async () => off(await estimate(), 0.5, 0.4) < 0.35);
  await until("it is said where the pose is", async () => (await page.innerText(".said")).startsWith("Pose:"));
  await page.click("button:has-text('Undo')");
  await until("the pose is back", async () => off(await estimate(), 0, 0) < 0.45);

  // A goal is set, and taken back.
  await tool("Goal");
  await page.mouse.click(...pixel(1.5, 1.5));
  await until("the goal is set", async () => Math.abs((await value(`${AGENT}/r2/knowledge/goal`)).x - 1.5) < 0.05);
  await page.click("button:has-text('Undo')");
  await until("the goal is as before", async () => (await value(`${AGENT}/r2/knowledge/goal`)).x === goal.x);
  await browser.end();
});

// A robot that localizes and navigates, on the map: what it works with in layers, and where a person sends it.
const { Visit, api, assert, colored, link, pixels, until, value, visit } = require("./page.cjs");

const AGENT = process.argv[5];
const mission = () => value(`${AGENT}/r2/knowledge/mission`);
const estimate = async () => (await value(`${AGENT}/r2/amcl/change`)).pose;

// Colours of cells too near to an obstacle over free ones, of zones and of particles, in the dark theme.
const NEAR = [[12, 143, 161]];
const ZONE = [[255, 123, 114]];
const PARTICLES = [[137, 131, 189], [160, 147, 217]];

visit(async () => {
  const browser = await Visit.begin();
  const page = await browser.tab();
  await page.goto(link);
  await page.locator(".map canvas").waitFor();
  const layer = async (title, isShown) => {
    await page.click(".map summary:has-text('Layers')");
    await page.setChecked(`label:has-text('${title}') input`, isShown);
    await page.keyboard.press("Escape");
  };

  await until("the costmap and its zone are seen", async () => (await colored(page, NEAR, 14)) > 2000 && (await colored(page, ZONE, 14)) > 100);
  const plans = async () => (await value(`${AGENT}/r2/execute/local_plan`)).points.length;
  await until("the local plan is published, because it is read", async () => (await plans()) > 500);
  const pixel = await pixels(page);
  const closer = async ({ x, y }, turn) => {
    await page.mouse.move(...pixel(x, y));
    await page.mouse.wheel(0, -turn);
    await page.waitForTimeout(300);
  };
  const fit = () => page.click(".map button:has-text('Fit')");
  await closer({ x: 1, y: 9 }, 250);
  await browser.picture(page, "office-dark");
  await fit();
  await browser.accessible(page, "the map of a robot that navigates");
  for (const [title, colors] of [["Costmaps", NEAR], ["Keep-out zones", ZONE]]) {
    await layer(title, false);
    await until(`${title} are not seen`, async () => (await colored(page, colors, 14)) < 50);
    await layer(title, true);
  }

  // The pose is set elsewhere, and the particles with it.
  for (const title of ["Estimates", "Local plans", "Costmaps", "Trails"]) await layer(title, false);
  await until("the local plan is no longer computed, because nobody reads it", async () => {
    const sequence = async () => (await api("GET", `/slate/${AGENT}/r2/execute/local_plan`)).sequence;
    const before = await sequence();
    await page.waitForTimeout(200);
    return before > 0 && (await sequence()) === before;
  });
  const drag = async ([x, y], theta) => {
    await page.mouse.move(...pixel(x, y));
    await page.mouse.down();
    await page.mouse.move(...pixel(x + Math.cos(theta), y + Math.sin(theta)), { steps: 3 });
    await page.mouse.up();
  };
  const click = (name) => page.click(`.map button.tool:has-text('${name}')`);
  await click("Goal");
  await click("Cancel goals");
  await until("the robot has no goals", async () => (await mission()).goals.length === 0);
  await click("Pose");
  const start = await estimate();
  await drag([19, 3], 0);
  await until("the pose is where it was set", async () => Math.hypot((await estimate()).x - 19, (await estimate()).y - 3) < 2);
  // The robot is elsewhere, so what its laser sees drives the particles away from where they were set.
  await until("particles are seen", async () => {
    await fit();
    await closer(await estimate(), 800);
    return (await colored(page, PARTICLES, 20)) > 20;
  });
  await layer("Particles", false);
  await until("particles are not seen", async () => (await colored(page, PARTICLES, 20)) < 5);
  await fit();
  await click("Undo");
  await until("the pose is back", async () => Math.hypot((await estimate()).x - start.x, (await estimate()).y - start.y) < 1);

  // Goals: with a heading, behind the others, paused, cancelled, and as before.
  await click("Goal");
  await drag([12, 7], 1.57);
  const [goal] = await until("a goal is sent", async () => (await mission()).goals.length === 1 && (await mission()).goals);
  assert(Math.hypot(goal.x - 12, goal.y - 7) < 0.1 && goal.has_heading && Math.abs(goal.theta - 1.57) < 0.1, JSON.stringify(goal));
  await until("it is said", async () => (await page.innerText(".said")).startsWith("Goal: x 1"));
  await page.keyboard.down("Shift");
  await page.mouse.click(...pixel(3, 7));
  await page.keyboard.up("Shift");
  const [, last] = await until("another goal is behind it", async () => (await mission()).goals.length === 2 && (await mission()).goals);
  assert(Math.abs(last.x - 3) < 0.1 && !last.has_heading, JSON.stringify(last));
  await click("Undo");
  await until("the last goal is taken back", async () => (await mission()).goals.length === 1);
  await click("Pause");
  await until("the mission is paused", async () => (await mission()).is_paused);
  await click("Resume");
  await until("the mission goes on", async () => !(await mission()).is_paused);
  await click("Undo");
  await until("the robot has no goals, as before", async () => (await mission()).goals.length === 0);
  await browser.end();
});

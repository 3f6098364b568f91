// EXP3: two robots that think, and one that does not.
const { Visit, assert, link, until, value, visit } = require("./page.cjs");

const AGENT = process.argv[5];

visit(async () => {
  const browser = await Visit.begin();
  const page = await browser.tab();
  await page.goto(link);
  await until("three robots", async () => (await page.locator(".readout tr").count()) === 3);
  const places = () => page.locator(".readout tr").allInnerTexts();
  const before = await places();
  await until("all three drive", async () => (await places()).every((text, row) => text !== before[row]), 20);
  await until("the chase is judged", async () => (await page.locator(".head .chip").count()) === 2);
  await page.waitForTimeout(4000);
  await browser.picture(page, "exp3");
  await browser.accessible(page, "EXP3");
  await page.click("nav a[href='#view=mapek']");
  for (const name of ["r2", "r3"]) {
    await page.click(`.bar-of-tools button:has-text('${name}')`);
    await until(`the route of ${name}`, async () => {
      const route = (await value(`${AGENT}/${name}/execute/status`)).route.toLowerCase();
      return (await page.innerText(".robot > header")).toLowerCase().includes(route);
    });
    assert((await page.locator(".stage.execute .block").count()) === 1, "one Execute");
  }
  await page.waitForTimeout(500);
  await browser.picture(page, "exp3-mapek");

  // Each robot's modules are in its box, no line lies behind a module, and those that close a loop come from behind.
  await browser.view(page, "graph");
  // It is drawn anew as modules, links, gates and properties arrive.
  for (const edge of ["r2/execute r2/planner", "r2/motors simulator"]) await page.waitForSelector(`.edge[data-edge='${edge}'][data-back=true]`);
  const drawing = await page.evaluate(() => {
    const within = (point, { x, y, width, height }) => point.x > x && point.x < x + width && point.y > y && point.y < y + height;
    const box = (element) => element.querySelector(".body, rect").getBoundingClientRect();
    const nodes = [...document.querySelectorAll(".node")].map((element) => ({ name: element.dataset.name, box: box(element) }));
    const boxes = [...document.querySelectorAll(".box")].map((element) => ({ name: element.textContent, box: box(element) }));
    const middle = ({ x, y, width, height }) => ({ x: x + width / 2, y: y + height / 2 });
    const astray = nodes.filter(({ name, box: own }) => {
      const robot = name.includes("/") ? [name.split("/")[0]] : [];
      return boxes.filter(({ box }) => within(middle(own), box)).map(({ name }) => name).join() !== robot.join();
    });
    const hidden = [...document.querySelectorAll(".edge")].flatMap((edge) => {
      const path = edge.querySelector("path:not(.near)");
      const matrix = path.getScreenCTM();
      const length = path.getTotalLength();
      const points = Array.from({ length: 200 }, (_, at) => path.getPointAtLength((length * (at + 0.5)) / 200).matrixTransform(matrix));
      return nodes.filter(({ box }) => points.some((point) => within(point, box))).map(({ name }) => `${edge.dataset.edge} behind ${name}`);
    });
    return { boxes: boxes.map(({ name }) => name), astray, hidden, back: [...document.querySelectorAll(".edge[data-back=true]")].map((edge) => edge.dataset.edge) };
  });
  assert(drawing.boxes.join() === "r2,r3", `boxes are ${drawing.boxes}`);
  assert(drawing.astray.length === 0, `not in the box of their robot: ${drawing.astray.map(({ name }) => name)}`);
  assert(drawing.hidden.length === 0, `lines lie behind modules: ${drawing.hidden}`);
  for (const edge of ["r2/execute r2/planner", "r2/motors simulator"]) assert(drawing.back.includes(edge), `${edge} is not drawn as a line that goes back`);
  // Gates are drawn as such and are no modules, and it is seen at once how often each writes.
  const counted = page.locator(".bar-of-tools .muted");
  assert((await counted.innerText()).startsWith("45 modules, 2 gates, "), `it says: ${await counted.innerText()}`);
  const gates = page.locator(".node:has(path.body)");
  assert((await gates.evaluateAll((all) => all.map((one) => one.dataset.name))).join() === "r2/wheels,r3/wheels", "gates are no gates");
  const pace = (name) => page.locator(`.node[data-name='${name}'] .pace`).textContent();
  for (const name of ["simulator", "r2/range_monitor", "r3/wheels"]) await until(`the rate of ${name}`, async () => /^\d+ Hz$/.test(await pace(name)));
  assert((await page.locator(".node[data-name='r2/wheels']").textContent()).includes("gate, armed"), "the gate does not say that it is armed");
  // No words lie upon others.
  const overlaid = await page.evaluate(() => [...document.querySelectorAll(".node")].flatMap((node) => {
    const [kind, pace] = [...node.querySelectorAll(".small")].map((text) => text.getBoundingClientRect());
    return kind.width && pace.width && kind.right > pace.left ? [node.dataset.name] : [];
  }));
  assert(overlaid.length === 0, `words lie upon others in ${overlaid}`);
  await browser.accessible(page, "the graph of EXP3");
  await browser.picture(page, "exp3-graph");
  await browser.end();
});

// The last seconds of an agent in a file: with its blocks, graph and times, which a recording alone has not.
const { Visit, assert, link, until, visit } = require("./page.cjs");

visit(async () => {
  const browser = await Visit.begin();
  const page = await browser.tab();
  await page.goto(link);
  const row = page.locator(".readout tr", { hasText: "r2" });
  await until("the robot", async () => (await row.count()) === 1);
  await page.click("button[aria-label=Pause]");
  const layouts = await page.locator("nav[aria-label=Layouts] a").allInnerTexts();
  assert(["MAPE-K", "Graph", "Timing"].every((name) => layouts.includes(name)), layouts.join());
  assert(!layouts.includes("Drive"), "nobody drives a run that is over");
  for (const [name, content] of [["mapek", /planner/], ["graph", /planner/], ["timing", /planner/]]) {
    await browser.view(page, name);
    await until(`${name} shows the run`, async () => content.test(await page.innerText("main")));
  }
  await browser.accessible(page, "an exported agent");
  await browser.end();
});

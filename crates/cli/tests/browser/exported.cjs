// A run in a file, without an agent: it plays, pauses, is searched and shows every layout.
const { Visit, assert, link, until, visit } = require("./page.cjs");

visit(async () => {
  const browser = await Visit.begin();
  const page = await browser.tab();
  await page.goto(link);
  const row = page.locator(".readout tr", { hasText: "r2" });
  await until("the robot", async () => (await row.count()) === 1);
  assert(!(await page.locator("#stop").isVisible()), "a recorded run has no stop");
  const before = await row.innerText();
  await until("the robot moves", async () => (await row.innerText()) !== before);
  await page.click("button[aria-label=Pause]");
  await page.waitForSelector("button[aria-label=Play]");
  const seek = (share) => page.locator(".foot .time").evaluate((element, share) => {
    element.value = Number(element.min) + (Number(element.max) - Number(element.min)) * share;
    element.dispatchEvent(new Event("input", { bubbles: true }));
  }, share);
  const shown = () => page.locator(".foot .time").evaluate(({ value }) => Number(value) / 1e9);
  await seek(0.6);
  await until("it is there", async () => (await shown()) > 10);
  const there = await row.innerText();
  await seek(0.1);
  await until("it is back", async () => (await shown()) < 5 && (await row.innerText()) !== there);
  await until("the log goes up to there", async () => /Time shown/.test(await page.innerText(".log .looked-at")));
  await browser.accessible(page, "an exported run");
  await browser.picture(page, "exported");
  const at = await shown();
  await page.click("button:has-text('Step')");
  await until("a step further", async () => (await shown()) >= at);
  await page.click("button[aria-label=Play]");
  await until("it plays again", async () => (await shown()) > at + 0.5);
  await browser.view(page, "inspect");
  await until("the tree has values", async () => /planner/.test(await page.innerText("main")));
  for (const name of ["plots", "mapek", "graph", "timing", "log"]) await browser.view(page, name);
  await browser.end();
});

// A run in a file, without an agent: it plays, pauses, is searched, and shows what it went through.
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
  const seconds = (text) => text.split(":").reduce((minutes, rest) => 60 * Number(minutes) + Number(rest));
  await until("the head has that time", async () => Math.abs(seconds(await page.innerText(".head .clock")) - (await shown())) < 0.1);
  await browser.accessible(page, "an exported run");
  await browser.picture(page, "exported");
  const at = await shown();
  await page.click("button:has-text('Step')");
  await until("a step further", async () => (await shown()) >= at);
  await page.click("button[aria-label=Play]");
  await until("it plays again", async () => (await shown()) > at + 0.5);
  await browser.view(page, "inspect");
  await until("the tree has values", async () => /planner/.test(await page.innerText("main")));
  const layouts = await page.locator("nav[aria-label=Layouts] a").allInnerTexts();
  assert(layouts.includes("Plots") && !["MAPE-K", "Graph", "Timing", "Drive"].some((name) => layouts.includes(name)), layouts.join());
  // What was jumped over is there, too.
  await page.click("button[aria-label=Pause]");
  await seek(0.05);
  await browser.view(page, "plots");
  await seek(0.9);
  const routes = async () => page.locator(".strip-words", { hasText: "Reactive" }).allInnerTexts();
  await until("both routes", async () => (await routes()).some((text) => /Deliberative [1-9].*Reactive [1-9]|Reactive [1-9].*Deliberative [1-9]/.test(text)));
  await browser.end();
});

// A recording that is played: paused, gone through, played on.
const { Visit, api, assert, link, until, visit } = require("./page.cjs");

visit(async () => {
  const browser = await Visit.begin();
  const page = await browser.tab();
  await page.goto(link);
  const row = page.locator(".readout tr", { hasText: "r2" });
  // Nothing is played yet, and the world is there.
  await until("the robot", async () => (await row.count()) === 1);
  await until("the bar", async () => (await page.locator("button[aria-label=Play], button[aria-label=Pause]").count()) === 1);
  if (await page.locator("button[aria-label=Pause]").count()) await page.click("button[aria-label=Pause]");
  await until("it stands", async () => (await api("GET", "/playback")).is_paused);
  const { from, to } = await api("GET", "/playback");
  const before = await row.innerText();
  await page.locator(".foot .time").evaluate((element, place) => {
    element.value = place;
    element.dispatchEvent(new Event("input", { bubbles: true }));
  }, from + (to - from) * 0.6);
  await until("it goes there", async () => Math.abs((await api("GET", "/playback")).time - (from + (to - from) * 0.6)) < (to - from) * 0.05);
  await until("the robot is elsewhere", async () => (await row.innerText()) !== before);
  await until("the log goes up to there", async () => /Time shown/.test(await page.innerText(".log .looked-at")));
  await browser.accessible(page, "a playback");
  await browser.picture(page, "replay");
  const { time } = await api("GET", "/playback");
  // The first cycle is the one that was gone to.
  await page.click("button:has-text('Step')");
  await page.click("button:has-text('Step')");
  await until("a step further", async () => (await api("GET", "/playback")).time > time);
  await page.selectOption("select[aria-label='Playback rate']", "2");
  await until("twice as fast", async () => (await api("GET", "/playback")).rate === 2);
  await page.click("button[aria-label=Play]");
  await until("it goes on", async () => !(await api("GET", "/playback")).is_paused);
  await browser.end();
});

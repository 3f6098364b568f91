// A run that ends while its page is open: the page says so, and the agent stays until it is closed.
const { Visit, api, assert, link, until, value, visit } = require("./page.cjs");

visit(async () => {
  const browser = await Visit.begin();
  const page = await browser.tab();
  await page.goto(link);
  await until("the connection", async () => (await page.innerText(".connection")) === "Live");
  assert((await page.locator(".banner.over").count()) === 0, "the run is over before its end");
  await api("PATCH", "/slate/exp1/referee/params", { goal_tolerance: 9.0 });
  await until("the page says that the run is over", async () => (await page.locator(".banner.over").count()) === 1);
  const words = await page.innerText(".banner.over");
  assert(words.includes("The run is over") && words.includes("goal reached"), words);
  await until("the head says so", async () => (await page.innerText(".connection")) === "Run ended");
  // Longer than a page is away that is loaded anew.
  await page.waitForTimeout(4000);
  assert((await page.locator(".banner.lost").count()) === 0, "the page has lost the agent");
  assert((await value("exp1/referee/verdict")).state === "SUCCEEDED", "the values are gone");
  await browser.accessible(page, "a run that is over");
  await browser.picture(page, "over");
  await browser.end();
});

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
  await browser.end();
});

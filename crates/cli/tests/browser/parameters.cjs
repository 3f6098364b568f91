// Parameters that are written into a file: what and where is shown first.
const { Visit, api, assert, link, until, value, visit } = require("./page.cjs");

const AGENT = process.argv[5];

visit(async () => {
  const browser = await Visit.begin();
  const page = await browser.tab();
  await page.goto(link);
  await browser.view(page, "parameters");
  await page.fill("input[aria-label='Search for parameters']", "planner");
  const speed = page.getByRole("textbox", { name: "r2/planner max_linear_velocity, m/s", exact: true });
  await until("the file's speed", async () => (await speed.inputValue()) === "0.3");
  await speed.fill("0.2");
  await speed.press("Enter");
  await until("the speed is set", async () => (await value(`${AGENT}/r2/planner/params`)).max_linear_velocity === 0.2);
  const save = page.locator(".tile button:has-text('Save')");
  await until("there is one to be saved", async () => (await save.innerText()) === "Save 1");
  const dialog = page.locator("[role=dialog][aria-label=Save]");
  for (const answer of ["Cancel", "Save 1"]) {
    await save.click();
    await until("what would be written, and where", async () => {
      const said = (await dialog.innerText()).replaceAll(/\s+/g, " ");
      return said.includes("r2/planner.params.max_linear_velocity 0.3 → 0.2") && said.includes("robot.toml. Comments and all other content are kept.");
    });
    assert((await api("GET", "/settings/differences")).some(({ path }) => path.endsWith("params.max_linear_velocity")), "looking writes");
    await browser.accessible(page, "what would be written");
    await browser.picture(page, "save");
    await dialog.locator(`button:has-text('${answer}')`).click();
    await until("the question is gone", async () => (await dialog.count()) === 0);
  }
  await until("it is said what was written", async () => (await page.innerText(".tile .bar-of-tools [role=status]")).includes("robot.toml"));
  await until("nothing is left to be saved", async () => (await save.innerText()) === "Save" && (await save.isDisabled()));
  await browser.end();
});

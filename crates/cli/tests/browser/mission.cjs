// The mission of a robot: tokens move, also of the past; a developer pauses, steps and forces, and others are told why they can't.
const { Visit, api, assert, link, origin, until, visit } = require("./page.cjs");

const AGENT = process.argv[5];
const ORDERS = `/api/v1/slate/${AGENT}/r2/planner/orders`;

visit(async () => {
  const browser = await Visit.begin();
  const page = await browser.tab();
  await page.goto(link);
  await browser.view(page, "mission");
  const { elements, id } = (await api("GET", `/slate/${AGENT}/r2/planner/graph`)).value;
  const number = (label) => elements.findIndex((own) => own.label === label);
  const at = (label) => page.locator(`[data-element="${number(label)}"]`);
  const tokens = (label) => at(label).getAttribute("data-tokens");
  const [going, second] = ["GoToOrigin_1.4_1.4_0.4_0.1.exec", "GoToOrigin_-1.4_1.4_0.4_0.1.exec"];

  // The token has moved from the start, and what comes next waits for the action.
  await until("the action's place has the token", async () => (await tokens(going)) === "1" && (await tokens("start")) === "0");
  await page.click("button:has-text('Pause')");
  await until("the mission is paused", async () => (await page.innerText(".mission-state")) === "Paused");
  await at("*.end").focus();
  await page.keyboard.press("Enter");
  const why = page.locator(".mission .why");
  await until("it is said why it waits", async () => (await why.innerText()).includes("has not succeeded yet"));
  await page.keyboard.press("ArrowDown");
  await until("an arrow selects the next one", async () => (await page.innerText(".mission .links header")).includes("*.fail"));
  for (const theme of ["light", "dark"]) {
    await browser.theme(page, theme);
    await browser.picture(page, `mission-${theme}`);
  }
  await browser.accessible(page, "a mission");
  const paused = (await api("GET", `/history/${AGENT}/r2/planner/activity?limit=1`)).values.at(-1).time;

  // A click forces the transition, and a step fires the next one.
  await at("*.end").click();
  await page.click(".mission .orders button:has-text('Force')");
  await until("the forced token has moved", async () => (await tokens("at place 1")) === "1" && (await tokens(going)) === "0");
  await page.click(".mission .orders button:has-text('Force')");
  await until("a transition without a token is refused with the reason", async () => (await page.innerText(".trouble")).includes("has 0 of 1 tokens"));
  await page.click("button:has-text('Step')");
  await until("a step moves it on", async () => (await tokens(second)) === "1");

  // Before, the token was elsewhere; the past can't be changed.
  await page.locator(".foot .time").evaluate((element, time) => {
    element.value = time;
    element.dispatchEvent(new Event("input", { bubbles: true }));
  }, paused + 5e7);
  await until("the marking of then", async () => (await tokens(going)) === "1" && (await tokens(second)) === "0", 20);
  assert(await page.locator(".mission-state ~ button:has-text('Resume')").isDisabled(), "the past can be changed");
  await browser.picture(page, "mission-past");
  await page.click("button:has-text('Go live')");
  await until("the marking of now", async () => (await tokens(second)) === "1");

  // Others look at it, and are told what they lack; the agent refuses them, too.
  const other = await browser.tab({ viewport: { width: 820, height: 1180 }, colorScheme: "light", hasTouch: true });
  await other.goto(`${origin}/#token=${process.env.VIEWER}&view=mission`);
  const pause = other.locator("button:has-text('Resume')");
  await until("a viewer sees the mission", async () => (await pause.count()) === 1 && (await pause.isDisabled()));
  assert((await pause.getAttribute("title")).includes("role developer"), "a viewer isn't told why");
  // A link that is scrolled out of view counts as one that skips to a target.
  await other.evaluate(() => document.querySelector("nav").scrollTo(0, 0));
  await browser.accessible(other, "a mission on a tablet");
  await browser.picture(other, "mission-tablet");
  const body = JSON.stringify({ command: "RESUME", outcome: "SUCCESS", element: 0, graph: id });
  for (const token of [process.env.VIEWER, process.env.OPERATOR]) {
    const answer = await fetch(`${origin}${ORDERS}`, { method: "POST", headers: { Authorization: `Bearer ${token}`, "Content-Type": "application/json" }, body });
    assert(answer.status === 403, `an order of another role: ${answer.status}`);
  }
  await page.click("button:has-text('Resume')");
  await until("the mission goes on", async () => (await page.innerText(".mission-state")) === "Running");
  await browser.end();
});

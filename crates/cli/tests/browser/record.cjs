// The past: looked back at while the robot goes on, and written into files.
const { Visit, api, assert, link, until, value, visit } = require("./page.cjs");

const AGENT = process.argv[5];
const clock = (text) => text.split(":").reduce((sum, part) => 60 * sum + Number(part), 0);

visit(async () => {
  const browser = await Visit.begin();
  const page = await browser.tab();
  await page.goto(link);
  const row = page.locator(".readout tr", { hasText: "r2" });
  await until("the robot", async () => /\d m/.test(await row.innerText()));
  const now = async () => clock(await page.innerText(".clock"));
  await until("a while", async () => (await now()) > 6, 20);

  // Back to the beginning, where the robot was elsewhere; the agent goes on.
  const start = (await api("GET", `/history/${AGENT}/simulator/r2/truth?limit=1&to=0`)).values[0].value;
  await page.focus(".foot .time");
  await page.keyboard.press("Home");
  await until("the past is marked", async () => (await page.locator(".foot[data-past=true]").count()) === 1);
  await until("the robot is where it was", async () => (await row.innerText()).replaceAll("−", "-").includes(`${start.x.toFixed(2)} m`), 20);
  assert((await page.innerText(".connection")) === "History", "the head says that it is live");
  assert((await now()) < 1, "the clock does not show the past");
  const going = (await value(`${AGENT}/loop/state`)).cycles;
  await until("the agent goes on", async () => (await value(`${AGENT}/loop/state`)).cycles > going);
  await browser.accessible(page, "the past");
  await browser.picture(page, "past");
  // What is set would hold now, and the map shows the past.
  await page.click(".map button:has-text('Goal')");
  const map = await page.locator(".map canvas").boundingBox();
  const before = await value(`${AGENT}/r2/knowledge/params`);
  await page.mouse.click(map.x + map.width / 2, map.y + map.height / 2);
  await until("it is said why no goal is set", async () => (await page.innerText(".map .trouble, .trouble")).includes("the page shows a past time"));
  assert(JSON.stringify(await value(`${AGENT}/r2/knowledge/params`)) === JSON.stringify(before), "a goal is set in the past");
  await page.click("button:has-text('Go live')");
  await until("the present again", async () => (await now()) > 6);

  // The time of a line of the log is looked back at.
  await api("PATCH", `/slate/${AGENT}/r2/knowledge/params`, { goal_x: 0.5 });
  await page.locator(".log tr", { hasText: "knowledge/params" }).first().click({ timeout: 5000 });
  await page.click("button:has-text('Go to')");
  await until("the past of the line", async () => (await page.locator(".foot[data-past=true]").count()) === 1);
  // Lines that came later stand behind a mark, also those that come while one looks back.
  await api("POST", "/log", { text: "much later" });
  const rows = async () => (await page.locator(".log tr").allInnerTexts()).map((text) => text.replaceAll(/\s+/g, " "));
  const place = async (words) => (await rows()).findIndex((text) => text.includes(words));
  await until("the line that is later", async () => (await place("much later")) > 0);
  assert((await place("knowledge/params")) < (await place("Time shown")), "the line that is looked at counts as later");
  assert((await place("later messages follow")) < (await place("much later")), `a later line is not behind the mark: ${(await rows()).join("; ")}`);
  const later = page.locator(".log tr[data-later=true]");
  assert((await later.allInnerTexts()).every((text) => !text.includes("knowledge/params")), "the line that is looked at is marked as later");
  assert((await later.filter({ hasText: "much later" }).count()) === 1, "the later line is not marked");
  await browser.accessible(page, "the log of the past");
  await browser.picture(page, "past-log");
  // Further back nothing had been said.
  await page.focus(".foot .time");
  await page.keyboard.press("Home");
  await until("all lines are later", async () => (await place("Time shown")) === 0 && (await place("knowledge/params")) > 0);
  await page.click("button:has-text('Go live')");
  await until("no line is later", async () => (await place("Time shown")) < 0 && (await later.count()) === 0);

  // A moment is marked by a key, and is in the log.
  await page.keyboard.press("b");
  await until("the mark is in the log", async () => /developer at .*: mark/.test(await page.innerText("[role=log]")));

  // A recording, begun and ended, and the last seconds.
  await page.click(".record");
  await until("it records", async () => /recording-1: .* values/.test(await page.innerText(".foot")));
  await page.click(".record");
  await until("the file is there", async () => (await api("GET", "/recordings")).files.some(({ name, bytes }) => name === "recording-1" && bytes > 0));
  await page.click("button:has-text('Save the last')");
  await until("the last seconds are there", async () => (await api("GET", "/recordings")).files.some(({ name }) => name === "moment-1"));
  await browser.end();
});

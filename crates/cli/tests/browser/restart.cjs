// A page that stays open while its agent is frozen, killed and started again: with the same token, and with another one. What shall be done
// with the agent is said on stdout.
const { Visit, assert, link, until, visit } = require("./page.cjs");

visit(async () => {
  const browser = await Visit.begin();
  const page = await browser.tab();
  await page.goto(link);
  const row = page.locator(".readout tr", { hasText: "r2" });
  await until("the robot", async () => /\d m/.test(await row.innerText()));
  const clock = async () => (await page.innerText(".clock")).split(":").reduce((sum, part) => 60 * sum + Number(part), 0);
  await until("a while", async () => (await clock()) > 60, 60);
  const late = await clock();

  // One that is frozen keeps its connections, and is not live.
  console.log("freeze");
  await until("the page says that nobody answers", async () => /No answer for \d+ s/.test(await page.locator(".banner").first().innerText()), 30);
  assert((await page.innerText(".connection")) === "No answer", "the head says that it is live");
  console.log("thaw");
  await until("it is live again", async () => (await page.innerText(".connection")) === "Live", 30);

  // What the browser itself says of an agent that does not answer is what is asked for.
  const complained = browser.complaints.length;
  console.log("kill");
  await until("the page says that nobody is there", async () => /No connection for \d+ s/.test(await page.locator(".banner.lost").innerText()), 30);
  assert((await page.innerText(".connection")) === "No connection", "the head says that it is live");
  await page.click("#stop");
  await until("nobody believes that it has stopped", async () => /NOT STOPPED|NOT CONFIRMED/.test(await page.innerText("#stop")), 30);
  await browser.accessible(page, "an agent that is gone");
  console.log("again");
  await until("the page goes on by itself", async () => (await page.innerText(".connection")) === "Live", 30);
  await until("it says that it is another run", async () => /A new run has started/.test(await page.innerText(".banner.other")));
  await until("the clock is the new one's", async () => (await clock()) < late, 30);
  const before = await row.innerText();
  await until("the robot drives", async () => (await row.innerText()) !== before);
  await browser.accessible(page, "another run");
  await page.click(".banner.other button");
  await until("the banner is gone", async () => (await page.locator(".banner").count()) === 0);

  console.log("kill");
  await until("nobody is there", async () => (await page.locator(".banner.lost").count()) === 1);
  console.log("other");
  await until("it says that it needs another token", async () => /The agent was restarted/.test(await page.innerText(".banner.lost")), 30);
  await browser.accessible(page, "a run with another token");
  browser.complaints = browser.complaints.filter((text, place) => place < complained || !/ERR_CONNECTION|WebSocket|401|Failed to load resource/.test(text));
  await browser.end();
});

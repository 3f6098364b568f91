// A browser with the console in it, and what is the same in each visit.
const { chromium } = require("playwright-core");
const fs = require("node:fs");
const path = require("node:path");
const axe = fs.readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");

const [link, pictures, executable] = process.argv.slice(2);
// A page from the disk has no origin.
const origin = link.startsWith("file:") ? link : new URL(link).origin;

function fail(text) {
  console.error(text);
  process.exit(1);
}

const assert = (holds, text) => holds || fail(text);

/** Asks until something is so; says what it was if it never is. */
async function until(what, holds, seconds = 10) {
  let last;
  for (const end = Date.now() + seconds * 1000; Date.now() < end; ) {
    last = await holds();
    if (last) return last;
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
  return fail(`${what}: not within ${seconds} s (${JSON.stringify(last)})${await shown()}`);
}

const tabs = [];

/** What the tabs say where something went wrong: dialogs, troubles, and the focus. */
async function shown() {
  const texts = await Promise.all(tabs.filter((tab) => !tab.isClosed()).map((tab) => tab.evaluate(() => {
    const texts = [...document.querySelectorAll("[role=dialog], .trouble, .banner")].map((node) => `${node.className}: ${node.innerText.slice(0, 600)}`);
    return [location.hash, `focus: ${document.activeElement?.outerHTML.slice(0, 200)}`, ...texts].join("\n");
  }).catch(String)));
  return texts.map((text) => `\n--- ${text}`).join("");
}

class Visit {
  static async begin() {
    const visit = new Visit();
    visit.browser = await chromium.launch({ executablePath: executable, args: ["--no-sandbox", "--disable-gpu", "--force-color-profile=srgb"] });
    visit.complaints = [];
    visit.foreign = [];
    return visit;
  }

  /** A tab of a size, with nothing in it. */
  async tab(settings = {}) {
    const context = await this.browser.newContext({ viewport: { width: 1440, height: 900 }, colorScheme: "dark", ...settings });
    const page = await context.newPage();
    tabs.push(page);
    page.on("console", (message) => ["error", "warning"].includes(message.type()) && this.complaints.push(`${message.text()} (${message.location().url})`));
    page.on("pageerror", (error) => this.complaints.push(String(error)));
    page.on("request", (request) => /^(data|blob):/.test(request.url()) || request.url().startsWith(origin) || this.foreign.push(request.url()));
    return page;
  }

  /** Another layout, by its name behind the #. */
  async view(page, name) {
    await page.click(`nav a[href="#view=${name}"]`);
    await page.waitForSelector(`nav a[href="#view=${name}"][aria-current=page]`);
  }

  async picture(page, name) {
    await page.screenshot({ path: path.join(pictures, `${name}.png`) });
  }

  /** What axe finds wrong, of what matters to people. */
  async accessible(page, where) {
    if (!(await page.evaluate(() => "axe" in window))) await page.evaluate(axe);
    // What is as it should be is much, and nobody reads it; and there is no frame and nothing to be loaded.
    const violations = await page.evaluate(async () => {
      const rules = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"];
      return (await window.axe.run(document, { runOnly: rules, resultTypes: ["violations"], iframes: false, preload: false })).violations;
    });
    const words = violations.map(({ id, help, nodes }) => `${id}: ${help}: ${nodes.slice(0, 3).map(({ html, failureSummary }) => `${html.slice(0, 200)} ${failureSummary}`).join("; ")}`);
    assert(words.length === 0, `${where} has what is not accessible:\n${words.join("\n")}`);
  }

  async theme(page, name) {
    if ((await page.evaluate(() => document.documentElement.dataset.theme)) !== name) await page.click("button[aria-label='Switch between dark and light']");
  }

  async end() {
    assert(this.complaints.length === 0, `the page complains:\n${this.complaints.join("\n")}`);
    assert(this.foreign.length === 0, `the page asks others: ${this.foreign.join(", ")}`);
    await this.browser.close();
  }
}

/** Asks the agent, beside the page. */
async function api(method, at, body) {
  const token = new URLSearchParams(new URL(link).hash.slice(1)).get("token");
  const headers = { Authorization: `Bearer ${token}`, "Content-Type": "application/json" };
  const answer = await fetch(`${origin}/api/v1${at}`, { method, headers, body: body === undefined ? undefined : JSON.stringify(body) });
  assert(answer.ok, `${method} ${at}: ${answer.status}`);
  return answer.json();
}

/** How many pixels of the map have one of the colours, or one near to it, as they lie over others: [r, g, b], or a name of the theme. */
const colored = (page, colors, off) => page.evaluate(([colors, off]) => {
  const style = getComputedStyle(document.documentElement);
  const parts = (name) => [1, 3, 5].map((place) => Number.parseInt(style.getPropertyValue(`--${name}`).trim().slice(place, place + 2), 16));
  const wanted = colors.map((color) => (typeof color === "string" ? parts(color) : color));
  const shown = document.querySelector(".map canvas");
  const { width, height } = shown;
  const context = Object.assign(document.createElement("canvas"), { width, height }).getContext("2d", { willReadFrequently: true });
  context.drawImage(shown, 0, 0);
  const { data } = context.getImageData(0, 0, width, height);
  let count = 0;
  for (let place = 0; place < data.length; place += 4) if (wanted.some((color) => color.every((part, own) => Math.abs(part - data[place + own]) <= off))) count += 1;
  return count;
}, [colors, off]);

/** Where a place of the world is on the page now, as a function of x and y, by what the page says of two pixels of the map. */
async function pixels(page) {
  const told = async (left, top) => {
    await page.mouse.move(left, top);
    return (await page.innerText(".pointer")).replaceAll("−", "-").match(/-?\d+\.\d+/g)?.map(Number);
  };
  const box = await page.locator(".map canvas").boundingBox();
  const [one, other] = [[box.x + 80, box.y + 160], [box.x + box.width - 80, box.y + box.height - 120]];
  const first = await until("the place under the pointer", () => told(...one));
  const second = await until("another place", async () => {
    const place = await told(...other);
    return place[0] !== first[0] && place;
  });
  return (x, y) => [[x, 0], [y, 1]].map(([at, axis]) => one[axis] + ((at - first[axis]) / (second[axis] - first[axis])) * (other[axis] - one[axis]));
}

const value = async (at) => (await api("GET", `/slate/${at}`)).value;

function visit(steps) {
  steps().catch((error) => fail(error.stack));
}

module.exports = { Visit, api, assert, colored, link, origin, pixels, until, value, visit };

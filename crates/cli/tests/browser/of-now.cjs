// Who looks back sees the grid map of then, or is told that it is of now, as nothing is kept of it.
const { Visit, api, assert, link, until, value, visit } = require("./page.cjs");

const AGENT = process.argv[5];
const isKept = process.env.KEPT === "true";

visit(async () => {
  const browser = await Visit.begin();
  const page = await browser.tab();
  await page.goto(link);
  await page.waitForSelector(".map canvas");
  const occupied = async () => (await value(`${AGENT}/r2/occupancy_mapper/change`)).data.filter((cell) => cell === 100).length;
  await until("a map", async () => (await value(`${AGENT}/r2/occupancy_mapper/change`))?.width > 0);
  // How many pixels are as those of occupied cells.
  const dark = () => page.evaluate(() => {
    const text = getComputedStyle(document.documentElement).getPropertyValue("--occupied").trim();
    const color = [1, 3, 5].map((place) => Number.parseInt(text.slice(place, place + 2), 16));
    const shown = document.querySelector(".map canvas");
    const context = Object.assign(document.createElement("canvas"), { width: shown.width, height: shown.height }).getContext("2d");
    context.drawImage(shown, 0, 0);
    const { data } = context.getImageData(0, 0, shown.width, shown.height);
    let count = 0;
    for (let place = 0; place < data.length; place += 4) if (color.every((part, own) => Math.abs(part - data[place + own]) <= 40)) count += 1;
    return count;
  });
  // Somebody paints a wall.
  const before = await occupied();
  await api("POST", `/slate/${AGENT}/r2/occupancy_mapper/strokes`, { mark: "OCCUPIED", points: [{ x: -2, y: 2 }, { x: 2, y: 2 }], width: 0.6 });
  await until("the wall is in the map", async () => (await occupied()) > before + 500);
  const now = await until("the wall is seen", async () => {
    const count = await dark();
    return count > 3000 && count;
  });
  const note = page.locator(".map .of-now");
  assert((await note.count()) === 0, "the present is said to be of now");
  await page.focus(".foot .time");
  await page.keyboard.press("Home");
  await until("the past is looked at", async () => (await page.locator(".foot[data-past=true]").count()) === 1);
  if (isKept) {
    await until("the map is that of then", async () => (await dark()) < now / 2);
    await page.waitForTimeout(600);
    assert((await note.count()) === 0, `of now is ${await note.allInnerTexts()}`);
  } else {
    await until("it is said that the map is of now", async () => (await note.count()) === 1 && (await note.innerText()).startsWith("Current values: r2/occupancy_mapper/change"));
  }
  await browser.accessible(page, "a map that is looked back at");
  await browser.picture(page, isKept ? "past-map" : "past-map-of-now");
  await page.click("button:has-text('Go live')");
  await until("the present again", async () => (await note.count()) === 0 && (await dark()) > now / 1.2);
  await browser.end();
});

// Images as the robot sees them, and upon them what its modules have found.
const { Visit, api, assert, link, origin, until, value, visit } = require("./page.cjs");

const AGENT = process.argv[5];

visit(async () => {
  const browser = await Visit.begin();
  const page = await browser.tab();
  await page.goto(`${link}&view=images`);
  const image = page.locator(".picture img");
  await until("a picture", () => image.evaluate(({ naturalWidth, naturalHeight }) => naturalWidth === 320 && naturalHeight === 240));
  // What a picture shows, as its sum of brightness left of each quarter.
  const shows = () => image.evaluate((element) => {
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [32, 24];
    const context = canvas.getContext("2d");
    context.drawImage(element, 0, 0, 32, 24);
    return Array.from(context.getImageData(0, 0, 32, 24).data).join(" ");
  });
  const before = await shows();
  await until("the picture goes on", async () => (await shows()) !== before);

  // The circle lies on the bright disc that the picture shows.
  const circle = page.locator(".overlay circle");
  await until("what was found is marked", async () => (await circle.count()) === 1);
  const place = () => circle.evaluate((element) => ["cx", "cy", "r"].map((name) => Number(element.getAttribute(name))));
  const found = await value(`${AGENT}/blob_finder/blob`);
  const [, , radius] = await place();
  assert(Math.abs(radius - Math.sqrt(found.pixels / Math.PI)) < 2, `the circle has the radius ${radius}`);
  await until("it lies on what the picture shows", async () => {
    const [x, y] = await place();
    return image.evaluate((element, [x, y]) => {
      const canvas = document.createElement("canvas");
      [canvas.width, canvas.height] = [element.naturalWidth, element.naturalHeight];
      const context = canvas.getContext("2d");
      context.drawImage(element, 0, 0);
      return context.getImageData(Math.round(x), Math.round(y), 1, 1).data[0] > 128;
    }, [x, y]);
  });
  const seen = await place();
  await until("it moves with it", async () => (await place())[0] !== seen[0]);
  await browser.accessible(page, "an image");
  await browser.picture(page, "image");
  await page.click("summary:has-text('Overlays')");
  await page.click("label:has-text('blob_finder/blob')");
  await until("it is left out", async () => (await page.locator(".overlay").count()) === 0);
  await page.click("summary:has-text('Overlays')");
  await page.click("button:has-text('Hold')");
  await until("the picture is held", async () => (await image.getAttribute("src")).startsWith("data:"));
  const held = await shows();
  await page.waitForTimeout(300);
  assert((await shows()) === held, "a picture that is held goes on");
  await page.click("button:has-text('Go on')");
  await until("it goes on", async () => (await shows()) !== held);

  // By what a browser says that it takes for an <img>, it is a JPEG.
  const token = new URLSearchParams(new URL(link).hash.slice(1)).get("token");
  const jpeg = await page.evaluate(async (address) => {
    const element = new Image();
    element.src = address;
    await element.decode();
    return [element.naturalWidth, performance.getEntriesByName(element.src).length];
  }, `${origin}/api/v1/slate/${AGENT}/vision_master/image?token=${token}`);
  assert(jpeg[0] === 320, "an <img> does not get a picture");
  const answer = await fetch(`${origin}/api/v1/slate/${AGENT}/vision_master/image`, { headers: { Authorization: `Bearer ${token}`, Accept: "image/avif,image/webp,image/*,*/*;q=0.8" } });
  assert(answer.headers.get("content-type") === "image/jpeg", "it is no JPEG");
  await browser.end();
});

// EXP1, as a person sees it who opens the link and tries everything.
const { Visit, api, assert, link, origin, until, value, visit } = require("./page.cjs");

const AGENT = process.argv[5];
const robot = () => value(`${AGENT}/simulator/r2/truth`);
const distance = (one, other) => Math.hypot(one.x - other.x, one.y - other.y);

visit(async () => {
  const browser = await Visit.begin();
  const page = await browser.tab();

  // The link alone shows the robot, at once, and leaves the token in no address.
  await page.goto(link);
  await page.waitForSelector(".readout tr[data-route] td");
  assert(!page.url().includes("token"), "the token stays in the address");
  const paint = await page.evaluate(() => performance.getEntriesByName("first-contentful-paint")[0].startTime);
  assert(paint < 1000, `the first paint takes ${paint} ms`);
  await until("the tab is called like the agent", async () => (await page.title()).startsWith(AGENT));
  const row = page.locator(".readout tr", { hasText: "r2" });
  await until("a route", async () => /reactive|deliberative/i.test(await row.innerText()));
  const before = await row.innerText();
  await until("the robot drives on the page", async () => (await row.innerText()) !== before);
  await until("the map is drawn", () => page.evaluate(() => {
    const canvas = document.querySelector(".map canvas");
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    return new Set(data.filter((_, place) => place % 4 === 0)).size > 20;
  }));
  await until("what Execute does", async () => /deliberative|reactive/i.test(await page.innerText(".overview")));

  // A goal is set by a click, and the robot goes there.
  await page.click("button.tool:has-text('Goal')");
  const box = await page.locator(".map canvas").boundingBox();
  await page.mouse.click(box.x + box.width * 0.4, box.y + box.height * 0.6);
  const goal = await until("the goal is set", async () => {
    const goal = await value(`${AGENT}/r2/knowledge/goal`);
    return (goal.x !== 0 || goal.y !== 0) && goal;
  });
  await until("the goal is in the log", async () => (await page.innerText("[role=log]")).includes("knowledge/params"));
  const far = distance(await robot(), goal);
  await page.keyboard.press("Escape");

  // Properties, their values as they come, and one alone.
  await browser.view(page, "inspect");
  await page.fill("input[aria-label='Search for properties']", "truth");
  await page.click("[data-path='simulator/r1/truth']");
  const inspected = page.locator(".inspector td.number").first();
  await until("a value", async () => / (m|rad( \(.*°\))?)$/.test(await inspected.innerText()));
  const seen = await inspected.innerText();
  await until("the value changes", async () => (await inspected.innerText()) !== seen);
  assert((await page.locator(".inspector tbody th").allInnerTexts()).join(" ") === "x y theta", "fields are not as their interface has them");
  await page.click("button[aria-label='Plot theta']");
  await until("it is plotted", async () => /rad \(.*°\)$/.test(await page.innerText(".tile[data-panel=plot] .series b")));
  // A parameter is found by its name.
  await page.fill("input[aria-label='Search for properties']", "careful_linear_velocity");
  await page.waitForSelector("[data-path='r2/planner/params']");
  // A part of one, by JSONPath and by JSON Pointer.
  await page.fill("input[aria-label='Search for properties']", "sonar");
  await page.click("[data-path='simulator/r2/sonar']");
  const wanted = page.locator(".part input");
  const part = async (text) => {
    await wanted.fill(text);
    await wanted.press("Enter");
  };
  await part("$.echoes[*].range");
  await until("all that the path leads to", async () => (await page.locator(".part code").count()) === 16);
  await part("$.echoes[");
  await until("it is said what is wrong with it", async () => (await page.innerText(".part")).includes("is no JSONPath"));
  await part("/echoes/3/range");
  await until("the one with its unit", async () => /^\d\.\d+ m$/.test(await page.innerText(".part output")));
  await browser.accessible(page, "a part of a property");
  await page.click("button:has-text('Plot this part')");
  await until("the part is plotted", async () => /sonar\/echoes\/3\/range\s+\d\.\d+ m/.test(await page.innerText(".tile[data-panel=plot] .series")));
  await page.fill("input[aria-label='Search for properties']", "r2");
  await page.focus("[role=row][tabindex='0']");
  await page.keyboard.press("ArrowDown");
  assert(await page.evaluate(() => document.activeElement.matches("[role=row]")), "arrows do not move in the tree");
  await browser.accessible(page, "the properties");
  await browser.picture(page, "inspect");

  // Parameters: by a slider, which the robot feels, and taken back.
  await until("the robot goes to the goal", async () => distance(await robot(), goal) < Math.max(0.3, far / 2), 25);
  await browser.view(page, "parameters");
  await page.fill("input[aria-label='Search for parameters']", "planner");
  const parameters = `${AGENT}/r2/planner/params`;
  const old = await value(parameters);
  for (const name of ["careful_linear_velocity", "max_linear_velocity"]) {
    const parameter = page.locator(`.parameter:has([id="parameter-r2/planner/params-${name}"])`);
    // By a hand on the slider: down on what it is, and on to where a twentieth of its range is left.
    const slider = await parameter.locator("input[type=range]").boundingBox();
    const most = Number(await parameter.locator("input[type=range]").getAttribute("max"));
    const x = (speed) => slider.x + 8 + (slider.width - 16) * (speed / most);
    await page.mouse.move(x(old[name]), slider.y + slider.height / 2);
    await page.mouse.down();
    await page.mouse.move(x(0.3), slider.y + slider.height / 2);
    await page.waitForTimeout(100);
    await page.mouse.move(x(0.1), slider.y + slider.height / 2);
    await page.waitForTimeout(100);
    await page.mouse.up();
    await until(`the slider sets ${name}`, async () => Math.abs((await value(parameters))[name] - 0.1) < 0.04);
    const set = (await value(parameters))[name];
    await parameter.locator("input[type=range]").press("ArrowRight");
    await until(`a key on the slider sets ${name}`, async () => (await value(parameters))[name] > set);
    const field = parameter.locator("form input");
    // An update between the selection of the old text and the new one would leave both.
    await until(`the field shows ${name}`, async () => Math.abs(parseFloat(await field.inputValue()) - (await value(parameters))[name]) < 0.006);
    await field.fill("0.1");
    await field.press("Enter");
    await until(`${name} is entered`, async () => (await value(parameters))[name] === 0.1);
    await until("what is not as in the file is marked", async () => (await parameter.getAttribute("data-differs")) === "true");
  }
  // Who does not see the page hears whose number it is; what is none is answered in words of who has typed it, and stays to be mended.
  const speed = page.getByRole("textbox", { name: "r2/planner max_linear_velocity, m/s", exact: true });
  assert((await page.getByRole("slider", { name: "r2/planner max_linear_velocity, m/s, slider", exact: true }).count()) === 1, "the slider has no such name");
  const refused = async (text, ...words) => {
    await speed.fill(text);
    await speed.press("Enter");
    await until(`${text} is refused`, async () => {
      const said = (await page.locator(".tile .trouble").allInnerTexts()).join();
      return words.every((word) => said.includes(word));
    });
    assert((await speed.inputValue()) === text && (await speed.getAttribute("aria-invalid")) === "true", "what is wrong does not stay");
    assert((await value(parameters)).max_linear_velocity === 0.1, `${text} changes the speed`);
  };
  await refused("fast", "“fast” is not a number", "max_linear_velocity of r2/planner is a number from 0 to 3, in m/s");
  await browser.accessible(page, "a text that is no number");
  await refused("1,2,3", "“1,2,3” is not a number");
  await refused("9999", "9999 is too large", "from 0 to 3");
  await refused("-1 m/s", "-1 m/s is too small");
  await speed.fill("0,1 m/s");
  await speed.press("Enter");
  await until("it is mended", async () => (await page.locator(".tile .trouble").count()) === 0 && (await speed.getAttribute("aria-invalid")) === null);
  const away = async (x, y) => api("PATCH", `/slate/${AGENT}/r2/knowledge/params`, { goal_x: x, goal_y: y });
  const fast = async () => ({ ...(await value(`${AGENT}/simulator/r2/odometry`)).twist, route: (await value(`${AGENT}/r2/execute/status`)).route });
  await away(1.6, -1.6);
  await until("the robot goes slowly", async () => {
    const { linear, route } = await fast();
    return route === "DELIBERATIVE" && linear > 0.04 && linear < 0.14;
  });
  await browser.accessible(page, "the parameters");
  await browser.picture(page, "parameters");
  // What would be taken back is shown first, also what others have changed.
  await page.click("button:has-text('Revert')");
  const question = page.locator("[role=dialog][aria-label=Revert]");
  await until("the goal is among it", async () => /goal_x\s+1.6 → /.test(await question.innerText()));
  await browser.accessible(page, "the question");
  await browser.picture(page, "revert");
  await question.locator("button:has-text('Cancel')").click();
  assert((await value(`${AGENT}/r2/knowledge/params`)).goal_x === 1.6, "the goal is taken back without a yes");
  // A configuration that is built in has no file; that is said before anything is written.
  await page.click(".tile button:has-text('Save')");
  const writes = page.locator("[role=dialog][aria-label=Save]");
  await until("it is said that there is no file", async () => (await writes.innerText()).includes("built in"));
  assert(await writes.locator("button.primary").isDisabled(), "what has no file can be written");
  await writes.locator("button:has-text('Cancel')").click();
  for (const name of ["max_linear_velocity", "careful_linear_velocity"]) {
    // What was entered, the key, and the slider; the speed was entered twice.
    for (let change = 0; change < (name === "max_linear_velocity" ? 4 : 3); change += 1) await page.click("button:has-text('Undo')");
    await until(`${name} is taken back`, async () => (await value(parameters))[name] === old[name]);
    await until(`${name} is as in the file`, async () => (await page.locator(`.parameter:has([id="parameter-r2/planner/params-${name}"])`).getAttribute("data-differs")) !== "true");
  }
  await until("the robot goes as before", async () => (await fast()).linear > 0.2);

  // The overview in both themes, with the way so far.
  await browser.view(page, "overview");
  for (const theme of ["light", "dark"]) {
    await browser.theme(page, theme);
    await page.waitForTimeout(150);
    await browser.picture(page, `overview-${theme}`);
    await browser.accessible(page, `the overview (${theme})`);
  }

  // Plots, timing, log.
  await browser.view(page, "plots");
  await until("numbers of the plot", async () => /rad\/s/.test(await page.locator(".series b").first().innerText()));
  const add = page.locator("input[aria-label='Add a number']").nth(1);
  await add.fill("simulator/r2/clearance/distance");
  await add.press("Enter");
  await until("another line", async () => /\d m$/.test(await page.locator(".tile").nth(1).locator(".series b").first().innerText()));
  // What is computed of others, and what is wrong with it.
  await add.fill("=2 * {simulator/r2/clearance/distance");
  await add.press("Enter");
  await until("it is said what is wrong", async () => (await page.locator(".tile .trouble").count()) === 1);
  await add.fill("=2 * {simulator/r2/clearance/distance}");
  await add.press("Enter");
  await until("it is computed, in its unit", async () => {
    const texts = await page.locator(".tile").nth(1).locator(".series b").allInnerTexts();
    const [single, twice] = texts.map((text) => Number.parseFloat(text));
    return Math.abs(twice - 2 * single) < 0.1 && texts[1].endsWith(" m");
  });
  await add.fill("simulator/r2/sonar$.echoes[3].range");
  await add.press("Enter");
  await until("a part by JSONPath is a line, too, with its unit", async () => / m$/.test((await page.locator(".tile").nth(1).locator(".series b").allInnerTexts())[2]));
  await add.fill("simulator/r2/sonar$.echoes");
  await add.press("Enter");
  await until("what is no number is said to be none", async () => (await page.innerText(".tile .trouble")).includes("the value at $.echoes"));
  await add.fill("");
  // What it was where the pointer is; the chart moves when the line about the part goes.
  await until("the time at the pointer", async () => {
    const chart = await page.locator(".tile").nth(1).locator(".chart").boundingBox();
    await page.mouse.move(chart.x + chart.width * 0.6, chart.y + chart.height / 2);
    return /\d s$/.test(await page.locator(".tile").nth(1).locator(".series").innerText());
  });
  await page.mouse.move(5, 5);
  await until("the present again", async () => !/\d s$/.test(await page.locator(".tile").nth(1).locator(".series").innerText()));
  await until("strips of states", async () => /Route: .*(Deliberative|Reactive) \d+ %/i.test(await page.innerText(".states")));
  await browser.accessible(page, "the plots");
  await browser.picture(page, "plots");
  await browser.view(page, "timing");
  await until("rows", async () => (await page.locator("tr", { hasText: "r2/planner" }).innerText()).includes("µs"));
  const loop = page.locator(".threads tr", { hasText: "main loop" });
  await until("the load of a thread, and how long it waits", async () => /main loop\s+\d+\s+[\d.]+ %\s+[\d.]+ (ns|µs|ms)/.test(await loop.innerText()));
  const load = Number.parseFloat(await loop.locator("td").nth(1).innerText());
  assert(load > 0 && load <= 100, `the loop takes ${load} % of a processor`);
  await browser.accessible(page, "the timing");
  await browser.picture(page, "timing");
  await browser.view(page, "log");
  await page.fill("input[aria-label='Search in the log']", "planner/params");
  await until("the change is in the log", async () => /developer at .* PATCH .*planner\/params/.test(await page.innerText("[role=log]")));
  await browser.accessible(page, "the log");

  // The architecture, and a block switched on.
  await browser.view(page, "mapek");
  await away(-1.6, -1.6);
  await until("the route", async () => /reactive|deliberative/i.test(await page.innerText(".robot > header")));
  assert((await page.locator(".stage.monitor .block").count()) === 4, "four Monitors");
  assert((await page.locator(".stage.analyze .block").count()) === 5, "five Analyzes");
  const execute = page.locator(".stage.execute .block");
  await until("how old what Execute says is", async () => /\d (ms|s)$/.test((await execute.locator("header").innerText()).trim()));
  for (const text of await execute.locator("button.output").allInnerTexts()) assert(/\d (ms|s)$|none yet$/.test(text.trim()), `no age: ${text}`);
  // Towards a wall that is near, the plan waits for the reflex again and again.
  const rules = (distance) => api("PATCH", `/slate/${AGENT}/r2/knowledge/params`, { sensor_rules: [{ sensor: "sonar", distance }] });
  await away(2.2, -2.2);
  await rules(1.0);
  const waiting = execute.getByRole("list", { name: "Waiting actions" });
  await until("what waits", async () => /GoToOrigin\s*\(2\.20, -2\.20, [^)]*\)\s+plan, action \d+\s+\d/.test(await waiting.innerText()), 60);
  await rules(0.1);
  await away(-1.6, -1.6);
  const wall = page.getByRole("switch", { name: "avoid_wall" });
  assert(!(await wall.isChecked()), "avoid_wall is on");
  await browser.accessible(page, "MAPE-K");
  await browser.picture(page, "mapek");
  await wall.click();
  await until("avoid_wall works", async () => (await api("GET", "/modules")).some(({ name, condition }) => name === "r2/avoid_wall" && condition === "WORKING"));
  await until("its switch is on", () => wall.isChecked());
  await wall.click();
  await until("it is off again", async () => (await api("GET", "/modules")).some(({ name, condition }) => name === "r2/avoid_wall" && condition === "INACTIVE"));

  // Links: what does not fit is said before, what fits is made.
  await browser.view(page, "graph");
  await page.focus(".node[data-name='r2/pass_range']");
  await page.keyboard.press("Enter");
  await page.click(".links button:has-text('range')");
  await until("it is found out that it fits", async () => (await page.innerText(".relink")).includes("Compatible"));
  await page.selectOption(".relink select", "/simulator/r2/truth");
  await until("it is found out that it does not", async () => (await page.locator(".relink .trouble").count()) === 1);
  assert(await page.locator(".relink button.primary").isDisabled(), "what does not fit can be linked");
  await browser.accessible(page, "the graph");
  await browser.picture(page, "graph");
  // Dragging from a module to another asks for a link; nothing is made of one that does not fit.
  await page.click(".links button:has-text('Cancel')");
  const place = async (name) => {
    const { x, y, width, height } = await page.locator(`.node[data-name='${name}'] rect`).boundingBox();
    return [x + width / 2, y + height / 2];
  };
  await page.mouse.move(...(await place("r2/pass_position")));
  await page.mouse.down();
  await page.mouse.move(...(await place("referee")), { steps: 4 });
  await page.mouse.up();
  await until("the input is chosen", async () => (await page.locator(".links label select").inputValue()) === "referee/clearance");
  await until("it is said why it does not fit", async () => (await page.innerText(".relink .trouble")).includes("/r2/pass_position/change"));
  // What goes over a link.
  const line = page.locator(".edge[data-edge='simulator r2/sonar']");
  await line.locator(".near").dispatchEvent("click");
  await until("how often and how old", async () => /Rate\s+\d+ Hz\s+Age\s+\d+ ms\s+Latency\s+0 ns/.test(await page.innerText(".links")));
  // What comes back from behind is of the cycle before.
  const back = page.locator(".edge[data-edge='r2/motors simulator']");
  await back.locator(".near").dispatchEvent("click");
  await until("the latency of a loop", async () => /Latency\s+20\.0 ms/.test(await page.innerText(".links")));
  await line.locator(".near").dispatchEvent("click");
  await until("the line is chosen again", async () => (await line.getAttribute("data-state")) === "chosen");
  assert((await back.getAttribute("data-state")) === "dim", "the other line stands out, too");
  await browser.accessible(page, "a link of the graph");

  // The stop is one press; what ends it takes two steps, of which one is held.
  await page.click("#stop");
  await until("all is stopped", async () => (await api("GET", "/agent")).stopped !== null);
  await page.waitForSelector(".banner.stopped");
  assert(/stopped in \d+ ms/.test(await page.innerText("#stop")), "the stop is not confirmed");
  const wheels = await value(`${AGENT}/r2/wheels/command`);
  assert(wheels.left === 0 && wheels.right === 0, "the wheels turn");
  await browser.accessible(page, "a stop");
  const hold = page.locator(".hold");
  await hold.click();
  await page.waitForTimeout(200);
  assert((await api("GET", "/agent")).stopped !== null, "a short press ends the stop");
  await hold.hover();
  await page.mouse.down();
  await until("the stop is over", async () => (await api("GET", "/agent")).stopped === null);
  await page.mouse.up();
  await page.click("button:has-text('Arm')");
  await until("it is armed", async () => (await value(`${AGENT}/r2/wheels/gate`)).mode === "ARMED");
  await until("the banner is gone", async () => (await page.locator(".banner").count()) === 0);
  await page.keyboard.press("Control+.");
  await until("the key stops too", async () => (await api("GET", "/agent")).stopped !== null);
  await api("POST", "/reset");
  await api("POST", "/arm", {});

  // Driving by hand, as long as a key is held and not longer.
  await browser.view(page, "drive");
  // A reflex has precedence over a person.
  await api("PUT", "/modules/r2/avoid_obstacle", { enabled: false });
  await until("it is armed again", async () => (await value(`${AGENT}/r2/wheels/gate`)).mode === "ARMED");
  const turns = async () => {
    const { left, right } = await value(`${AGENT}/r2/wheels/command`);
    return left < 0 && right > 0 && Math.abs(left + right) < 1e-9 && (await value(`${AGENT}/r2/wheels/gate`)).priority === "TELEOPERATION";
  };
  // On a machine that stands still for half a second the page lets go, says so, and wants the key anew.
  const press = async (key, what, holds) => {
    await page.keyboard.down(key);
    await until(what, async () => {
      if (await holds()) return true;
      if (await page.locator(".lapsed").count()) {
        await page.keyboard.up(key);
        await page.keyboard.down(key);
      }
      return false;
    });
  };
  // A key counts from the moment on in which the page says that one has the controls.
  await page.evaluate(() => {
    window.keys = 0;
    const key = () => dispatchEvent(new KeyboardEvent("keydown", { key: "a" }));
    const eager = new MutationObserver(() => {
      if (!document.querySelector(".drive[data-held=true]")) return;
      eager.disconnect();
      window.keys += 1;
      key();
    });
    eager.observe(document.body, { subtree: true, childList: true, attributes: true });
  });
  await page.click("button:has-text('Take control')");
  await page.waitForSelector(".drive[data-held=true]");
  await until("the key of the first moment counts", async () => (await turns()) || (await page.locator(".lapsed").count()) > 0);
  assert((await page.evaluate(() => window.keys)) === 1, "no key came with the controls");
  await page.evaluate(() => dispatchEvent(new KeyboardEvent("keyup", { key: "a" })));
  await press("a", "the wheels turn as the key says", turns);
  await until("the map says who drives", async () => (await page.locator(".readout tr[data-route=TELEOPERATION]").count()) === 1);
  await until("the overview says who drives", async () => (await page.innerText(".overview .route")).includes("Teleoperation"));
  await page.waitForTimeout(400);
  await browser.accessible(page, "the controls");
  await browser.picture(page, "drive");
  await page.keyboard.up("a");
  // Without a person the plan would drive on.
  const stands = async () => {
    const { left, right } = await value(`${AGENT}/r2/wheels/command`);
    return left === 0 && right === 0 && (await value(`${AGENT}/r2/wheels/gate`)).priority === "TELEOPERATION";
  };
  // A page that gets no processor for 150 ms lets the plan drive until it is back.
  const stays = async (what) => {
    let moves = 0;
    for (let look = 0; look < 12; look++) {
      if (!(await stands())) moves++;
      await page.waitForTimeout(50);
    }
    assert(moves <= 3, what);
  };
  await until("it stands while nothing is held", stands);
  await stays("it drives by itself while a person has the controls");
  // Leaving the window lets go; what is still held then counts anew.
  await press("d", "it turns again", async () => !(await stands()));
  await page.evaluate(() => dispatchEvent(new Event("blur")));
  await until("it stands without the window", stands);
  await stays("it drives without the window");
  await page.keyboard.up("d");

  // A gamepad drives while its left shoulder button is held: the stick alone does nothing, and letting go of the button ends it.
  const pad = (held, axes) => page.evaluate(([held, axes]) => {
    const buttons = Array.from({ length: 17 }, (_, place) => ({ pressed: place === 4 && held, touched: false, value: 0 }));
    navigator.getGamepads = () => [null, { id: "Pad", index: 1, connected: true, mapping: "standard", axes, buttons }];
  }, [held, axes]);
  await pad(false, [0, -1, 0, 0]);
  await until("the gamepad is known", async () => (await page.innerText(".drive")).includes("Gamepad"));
  await page.waitForTimeout(300);
  assert(await stands(), "a stick alone drives");
  await pad(true, [0, -0.5, 0, 0]);
  await until("half of the stick is half of the speed", async () => {
    const { left, right } = await value(`${AGENT}/r2/wheels/command`);
    return Math.abs(left - right) < 1e-9 && Math.abs(left * 0.0975 - 0.15) < 0.03;
  });
  await pad(false, [0, -0.5, 0, 0]);
  await until("the button is let go", stands);
  // One that is pulled out is let go, too.
  await pad(true, [0, 0, 0, 0]);
  await pad(true, [-0.6, 0, 0, 0]);
  await until("it turns", async () => !(await stands()));
  await page.evaluate(() => (navigator.getGamepads = () => []));
  await until("it stands without the gamepad", stands);
  await page.click("button:has-text('Release control')");
  await until("nobody drives any more", async () => (await value(`${AGENT}/r2/wheels/gate`)).priority !== "TELEOPERATION");

  // Everything is found by a few letters: a number to plot, a module to be switched on; and the stop stays in reach.
  await page.keyboard.press("Control+k");
  const find = page.locator(".palette input");
  await find.fill("plot clear r2 dist");
  await until("it is found", async () => (await page.locator("[role=option]").first().innerText()).includes("simulator/r2/clearance/distance"));
  await browser.accessible(page, "what is found");
  await browser.picture(page, "find");
  const covers = await page.evaluate(() => {
    const { left, top, width, height } = document.getElementById("stop").getBoundingClientRect();
    return document.elementFromPoint(left + width / 2, top + height / 2).closest("button")?.id;
  });
  assert(covers === "stop", "a dialog is over the stop");
  await page.keyboard.press("Enter");
  await until("its plot is there", async () => (await page.innerText(".tile[data-panel=plot] .series")).includes("simulator/r2/clearance/distance"));
  await until("the palette leaves", async () => (await page.locator("[role=dialog]").count()) === 0);
  await page.keyboard.press("Control+k");
  await find.fill("switch avoid_obs on");
  // What the modules are is asked for when the palette opens.
  await until("the switch is found", async () => (await page.locator("[role=option]").first().innerText()).includes("Switch r2/avoid_obstacle on"));
  await page.keyboard.press("Enter");
  await until("it is switched on", async () => (await api("GET", "/modules")).some(({ name, condition }) => name === "r2/avoid_obstacle" && condition === "WORKING"));
  await until("the palette is closed", async () => (await page.locator("[role=dialog]").count()) === 0);
  await page.keyboard.press("?");
  await page.waitForSelector("[role=dialog][aria-label='Keyboard shortcuts']");
  await page.keyboard.press("Escape");
  await until("the keys are closed", async () => (await page.locator("[role=dialog]").count()) === 0);

  // Layouts: changed, shared by a link, saved in the project. A panel of the project is there like any other.
  await browser.view(page, "timing");
  await page.click("button[aria-label='Add a panel beside this one']");
  await page.selectOption(".tile:nth-of-type(1) >> nth=1 >> select[aria-label=Panel]", "clearance");
  await until("the project's panel shows a value", async () => /^\d\.\d+ m$/.test(await page.innerText(".own-clearance")));
  const shared = page.url();
  await page.click(".layouts button:has-text('Save')");
  await page.fill("[role=dialog] input", "Times and clearance");
  await browser.accessible(page, "the question for a name");
  // The page goes on meanwhile, with the stop.
  await page.keyboard.press("Control+.");
  await until("a question is not in the way of the stop", async () => (await api("GET", "/agent")).stopped !== null);
  await api("POST", "/reset");
  await api("POST", "/arm", {});
  await page.click("[role=dialog] button.primary");
  await page.waitForSelector("nav a:has-text('Times and clearance')");
  await until("the layout is in the project", async () => (await api("GET", "/layouts"))["times-and-clearance"].columns.length === 2);
  // One is never written over another, whatever letters their titles have; the same title is the same layout.
  const long = "A layout with a title that is longer than the name of any file may be here";
  for (const title of ["地図", "Ωmega", "地図", "Ärger", "Ωδός", long]) {
    await page.click(".layouts button:has-text('Save')");
    await page.fill("[role=dialog] input", title);
    await page.click("[role=dialog] button.primary");
    await page.waitForSelector(`nav a:has-text('${title}')`);
  }
  const kept = Object.entries(await api("GET", "/layouts")).map(([name, { title }]) => `${name}: ${title}`);
  for (const one of ["layout: 地図", "mega: Ωmega", "arger: Ärger", "layout-2: Ωδός", `a-layout-with-a-title-that-is-longer-than-the-name-of-an: ${long}`])
    assert(kept.includes(one), `${one}: ${kept.join("; ")}`);
  for (const line of kept.filter((line) => !line.startsWith("times-"))) await api("DELETE", `/layouts/${line.split(":")[0]}`);
  await until("they are gone", async () => Object.keys(await api("GET", "/layouts")).length === 1);
  await page.goto(`${origin}/#view=times-and-clearance`);

  // A tablet, in the light, with the layout of the link.
  const tablet = await browser.tab({ viewport: { width: 820, height: 1180 }, colorScheme: "light", hasTouch: true });
  await tablet.goto(link);
  await tablet.waitForSelector(".readout tr td");
  await tablet.goto(shared);
  await tablet.waitForSelector(".own-clearance");
  await tablet.goto(`${origin}/#view=overview`);
  await tablet.waitForSelector(".overview");
  await tablet.waitForTimeout(800);
  assert(await tablet.evaluate(() => document.documentElement.scrollWidth <= innerWidth), "a tablet has to be scrolled sideways");
  const small = await tablet.evaluate(() => [...document.querySelectorAll("button, select, nav a")].filter((one) => one.offsetParent && one.getBoundingClientRect().height < 43.5).map((one) => one.outerHTML.slice(0, 100)));
  assert(small.length === 0, `too small for a finger: ${small.join(", ")}`);
  const stop = await tablet.locator("#stop").boundingBox();
  assert(stop.width >= 64 && stop.height >= 64, "the stop is small");
  await browser.accessible(tablet, "a tablet");
  await browser.picture(tablet, "tablet");

  // Without a token there is a question and nothing else.
  const stranger = await browser.tab();
  await stranger.goto(origin);
  await stranger.waitForSelector(".asking");
  await browser.accessible(stranger, "the question for a token");
  await browser.end();
});

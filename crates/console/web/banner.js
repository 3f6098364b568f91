// Conditions that must not be overlooked: a stop, disarmed actuators, a lost connection.
import { html, useEffect, useRef, useState } from "/lib/preact.js";
import { post, Problem } from "/api.js";
import { connection, useReadings } from "/live.js";
import { problemOf, reload, useOver, useResource } from "/store.js";
import { Trouble } from "/parts.js";
import { isOver } from "/stop.js";

// How long the reset button must be held, so that no accident ends a stop, ms.
const HOLD = 1000;

function Hold({ children, done }) {
  const [held, setHeld] = useState(false);
  const timer = useRef(0);
  const begin = () => {
    if (held) return;
    setHeld(true);
    timer.current = setTimeout(() => {
      setHeld(false);
      done();
    }, HOLD);
  };
  const end = () => {
    clearTimeout(timer.current);
    setHeld(false);
  };
  const isKey = (event) => event.key === " " || event.key === "Enter";
  return html`<button class="hold" data-held=${held} onPointerDown=${begin} onPointerUp=${end} onPointerLeave=${end} onBlur=${end}
    onKeyDown=${(event) => isKey(event) && (event.preventDefault(), begin())} onKeyUp=${(event) => isKey(event) && end()}>${children}</button>`;
}

function Over({ how, isGone }) {
  return html`<div class="banner over" role="status"><b>The run is over.</b> ${how}. ${isGone ? "The agent has ended; the page shows its last values." : "The agent stays as long as this page is open."}</div>`;
}

function Gone({ state }) {
  const [, redraw] = useState(0);
  useEffect(() => {
    const timer = setInterval(() => redraw((count) => count + 1), 1000);
    return () => clearInterval(timer);
  }, []);
  if (problemOf("/agent")?.status === 401) {
    return html`<div class="banner lost" role="alert"><b>The agent was restarted.</b> Each run has new tokens: open the link that the new run printed.</div>`;
  }
  const seconds = Math.round((performance.now() - connection.since) / 1000);
  if (state === "silent") {
    return html`<div class="banner disarmed" role="alert"><b>No answer for ${seconds} s.</b> The values shown are that old. The agent is connected but does not respond.</div>`;
  }
  return html`<div class="banner lost" role="alert">
    <b>No connection for ${seconds} s.</b> The values shown are that old. The agent has ended or is unreachable; the page reconnects by itself.
  </div>`;
}

/** The banners. */
export function Banner({ agent, state, broken, isOther, seen }) {
  const [problem, setProblem] = useState(null);
  const actuators = useResource("/actuators", 5) ?? [];
  const gates = useReadings(actuators.map(({ name }) => `${name}/gate`), 4);
  const stopped = agent?.stopped ?? null;
  const over = useOver();
  const disarmed = actuators.filter(({ name }) => gates[`${name}/gate`]?.value.mode === "DISARMED").map(({ name }) => name);
  const act = (path) => async () => {
    try {
      setProblem(null);
      await post(path, path === "/arm" ? {} : undefined);
    } catch (error) {
      if (!(error instanceof Problem)) throw error;
      setProblem(error);
    }
    reload("/agent", "/actuators");
  };
  useEffect(() => {
    const again = () => reload("/agent", "/actuators");
    document.addEventListener("stopped", again);
    return () => document.removeEventListener("stopped", again);
  }, []);
  useEffect(() => {
    document.documentElement.dataset.stopped = stopped !== null;
    if (stopped === null) isOver();
  }, [stopped]);
  return html`<div class="banners">
    ${over && html`<${Over} how=${over} isGone=${state === "lost"} />`}
    ${!over && ["lost", "silent"].includes(state) && html`<${Gone} state=${state} />`}
    ${isOther && html`<div class="banner other" role="status"><b>A new run has started.</b> Trails and plots were cleared. <span class="grow"></span> <button onClick=${seen}>OK</button></div>`}
    ${stopped !== null && html`<div class="banner stopped" role="alert">
      <b>Stopped</b> ${stopped} <span class="grow"></span> <${Hold} done=${act("/reset")}>Hold to reset</${Hold}>
    </div>`}
    ${stopped === null && disarmed.length > 0 && html`<div class="banner disarmed" role="alert">
      <b>Not armed</b> ${disarmed.join(", ")} <span class="grow"></span> <button onClick=${act("/arm")}>Arm</button>
    </div>`}
    ${broken.map((text) => html`<div class="banner lost" role="alert" key=${text}><b>A panel failed to load.</b> ${text}</div>`)}
    <${Trouble} problem=${problem} />
  </div>`;
}

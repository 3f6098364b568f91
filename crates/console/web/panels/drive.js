// Teleoperation by keys, a stick on the screen, or a gamepad, only while an input is held.
import { Empty, Field, html, number, Trouble, useAgent, useEffect, useLayoutEffect, useReading, useRef, useResource, useState, word } from "/slate.js";
import { lookLive } from "/live.js";
import { Controls, LAPSE } from "/teleoperation.js";
import { stop } from "/stop.js";

// Initial speeds at full deflection; the user can raise them.
const SPEED = 0.3;
const TURN = 0.8;
// Round-trip time above which the speed is halved, ms.
const LATE = 300;
const KEYS = { w: [1, 0], arrowup: [1, 0], s: [-1, 0], arrowdown: [-1, 0], a: [0, 1], arrowleft: [0, 1], d: [0, -1], arrowright: [0, -1] };
const DEAD = 0.12;

/** A command of an actuator for a deflection of the stick ahead and to the left, each from -1 to 1; null for an unknown interface. */
function command(kind, [ahead, left], { speed, turn }, chassis) {
  const [linear, angular] = [ahead * speed, left * turn];
  if (kind === "Twist2") return { linear, angular };
  const radius = chassis?.wheel_radius ?? 0.0975;
  const track = chassis?.track ?? 0.331;
  const [slow, fast] = [(linear - (angular * track) / 2) / radius, (linear + (angular * track) / 2) / radius];
  if (kind === "WheelSpeeds") return { left: slow, right: fast };
  if (kind === "FourWheelSpeeds") return { front_left: slow, front_right: fast, back_left: slow, back_right: fast };
  return null;
}

/** A stick: the position of the finger, as shares of its radius. */
function Stick({ position, move, release }) {
  const base = useRef(null);
  const at = (event) => {
    const { left, top, width, height } = base.current.getBoundingClientRect();
    const [x, y] = [(2 * (event.clientX - left)) / width - 1, 1 - (2 * (event.clientY - top)) / height];
    const length = Math.max(1, Math.hypot(x, y));
    move([y / length, -x / length]);
  };
  const down = (event) => {
    base.current.setPointerCapture(event.pointerId);
    at(event);
  };
  const drag = (event) => base.current.hasPointerCapture(event.pointerId) && at(event);
  return html`<div class="stick" ref=${base} aria-hidden="true" onPointerDown=${down} onPointerMove=${drag} onPointerUp=${release} onPointerCancel=${release} onLostPointerCapture=${release}>
    <span style=${{ left: `${50 - position[1] * 38}%`, top: `${50 - position[0] * 38}%` }}></span></div>`;
}

function Panel({ options, setOptions }) {
  const agent = useAgent();
  const actuators = useResource("/actuators", 5);
  const properties = useResource("/properties", 5) ?? [];
  const [controls, setControls] = useState(null);
  const [status, setStatus] = useState(null);
  const [position, setPosition] = useState([0, 0]);
  const [pad, setPad] = useState("");
  const [grips, setGrips] = useState(0);
  const [isLapsed, setLapsed] = useState(false);
  const held = useRef(new Set());
  const actuator = actuators?.find(({ name }) => name === options.actuator) ?? actuators?.[0];
  const robot = actuator?.name.split("/")[0];
  const chassisPath = properties.find(({ path, interface: name }) => name === "Chassis" && path.split("/").includes(robot))?.path;
  const chassis = useReading(chassisPath, 1)?.value;
  const got = useReading(actuator && `${actuator.name}/command`, 10)?.value;
  const gate = useReading(actuator && `${actuator.name}/gate`, 10)?.value;
  const speed = options.speed ?? SPEED;
  const turn = options.turn ?? TURN;
  const isLate = (status?.delay ?? 0) > LATE;
  const current = useRef({});
  current.current = { controls, actuator, chassis, limits: { speed: isLate ? speed / 2 : speed, turn: isLate ? turn / 2 : turn } };

  const go = (place) => {
    const { controls, actuator, chassis, limits } = current.current;
    setPosition(place);
    if (!controls || controls.status.state !== "holds") return;
    const wanted = command(actuator.interface, place, limits, chassis);
    // Driving shows the present.
    if (place[0] || place[1]) {
      lookLive();
      setLapsed(false);
    }
    if (wanted) controls.drive(wanted);
  };
  // Without a command another commander would drive, such as the plan, so control without an input commands a standstill.
  const letGo = () => {
    held.current.clear();
    go([0, 0]);
  };
  const take = () => {
    controls?.leave();
    lookLive();
    setControls(new Controls(actuator.name, setStatus));
  };
  const leave = () => {
    controls?.leave();
    setControls(null);
    setStatus(null);
    setPosition([0, 0]);
  };
  useEffect(() => () => controls?.leave(), [controls]);

  const isHeld = status?.state === "holds";
  // Keys count from the moment in which the page shows that control is taken.
  useLayoutEffect(() => {
    if (!isHeld) return undefined;
    const sum = () => go([...held.current].reduce(([ahead, left], key) => [ahead + KEYS[key][0], left + KEYS[key][1]], [0, 0]));
    const down = (event) => {
      if (event.target.closest?.("input, textarea, select") || event.ctrlKey || event.metaKey || event.altKey) return;
      const key = event.key.toLowerCase();
      if (key === " ") {
        event.preventDefault();
        letGo();
        stop();
      } else if (key in KEYS) {
        event.preventDefault();
        if (event.repeat) return;
        held.current.add(key);
        sum();
      }
    };
    const up = (event) => held.current.delete(event.key.toLowerCase()) && sum();
    // A hidden page is too slow for commands.
    const hidden = () => document.hidden && leave();
    // A held stick must be held again, too.
    const blur = () => (letGo(), setGrips((count) => count + 1));
    letGo();
    addEventListener("keydown", down);
    addEventListener("keyup", up);
    addEventListener("blur", blur);
    addEventListener("pagehide", leave);
    document.addEventListener("visibilitychange", hidden);
    return () => {
      removeEventListener("keydown", down);
      removeEventListener("keyup", up);
      removeEventListener("blur", blur);
      removeEventListener("pagehide", leave);
      document.removeEventListener("visibilitychange", hidden);
    };
  }, [isHeld]);

  // Inputs held while the page was frozen are released.
  const lapses = status?.lapses ?? 0;
  useEffect(() => (letGo(), setLapsed(lapses > 0)), [lapses]);

  // A gamepad must be polled. It drives only while its lower left shoulder button is held.
  useEffect(() => {
    if (!isHeld) return undefined;
    let [was, isLapsed, looked] = [false, false, performance.now()];
    const timer = setInterval(() => {
      isLapsed ||= performance.now() - looked > LAPSE;
      looked = performance.now();
      const found = [...(navigator.getGamepads?.() ?? [])].find((one) => one?.connected);
      setPad(found?.id ?? "");
      const isPressed = found?.buttons[4]?.pressed === true;
      isLapsed &&= isPressed;
      const holds = isPressed && !isLapsed;
      const axis = (place) => (Math.abs(found?.axes[place] ?? 0) < DEAD ? 0 : -found.axes[place]);
      if (holds) go([axis(1), axis(0)]);
      else if (was) letGo();
      was = holds;
    }, 50);
    return () => clearInterval(timer);
  }, [isHeld]);

  if (!actuators) return html`<${Empty}>Waiting for the agent.</${Empty}>`;
  if (!actuators.length) return html`<${Empty}>This agent has no actuator.</${Empty}>`;
  if (agent?.role === "viewer") return html`<${Empty}>Driving requires the role operator or developer; this token has the role viewer.</${Empty}>`;
  const isKnown = command(actuator.interface, [1, 0], current.current.limits, chassis) !== null;
  const cap = (name, value, most, unit) => html`<label class="cap">${word(name)} <input type="range" min="0.05" max=${most} step="0.05" value=${value} onInput=${(event) => setOptions({ [name]: Number(event.target.value) })} /><span class="number">${number(value, unit)}</span></label>`;
  return html`
    <div class="bar-of-tools">
      <select aria-label="Actuator" value=${actuator.name} disabled=${isHeld} onChange=${(event) => setOptions({ actuator: event.target.value })}>${actuators.map(({ name }) => html`<option key=${name} value=${name}>${name}</option>`)}</select>
      ${isHeld ? html`<button class="primary" onClick=${leave}>Release control</button>` : html`<button class="primary" disabled=${!isKnown} onClick=${take}>Take control</button>`}
    </div>
    ${status?.problem && html`<${Trouble} problem=${{ message: status.problem.detail, help: status.problem.help }} />`}
    ${status?.state === "gone" && html`<p class="trouble" role="alert">Control was lost with the connection; take control again.</p>`}
    ${isHeld && isLapsed && html`<p class="trouble lapsed" role="alert">The command was released: the page or the agent did not respond for 0.5 s. Release and hold again.</p>`}
    ${!isKnown && html`<p class="trouble">The page cannot create commands of the type ${actuator.interface}; use the HTTP API.</p>`}
    <div class="scroll drive" data-held=${isHeld}>
      <div class="drive-part"><${Stick} key=${lapses + grips} position=${position} move=${go} release=${letGo} />
        <p class="muted">${isHeld ? "Hold the stick, W A S D or the arrow keys to drive; Space stops all actuators." : "Take control to drive."}${pad && ` Gamepad: drive while holding the left shoulder button.`}</p></div>
      <div class="drive-part">
        ${cap("speed", speed, 1.5, "m/s")}${cap("turn", turn, 3, "rad/s")}
        <dl>
          <${Field} name="Commander"><span>${gate ? (gate.age === null ? "none" : word(gate.priority)) : "–"}</span></${Field}>
          <${Field} name="Gate" state=${gate && gate.mode !== "ARMED" ? "degraded" : undefined}>${gate ? word(gate.mode) : "–"}</${Field}>
          <${Field} name="Round-trip time" state=${isLate ? "degraded" : undefined}>${status?.delay ? `${status.delay.toFixed(1)} ms${isLate ? ", half speed" : ""}` : "–"}</${Field}>
          ${got && Object.entries(got).map(([name, value]) => html`<${Field} key=${name} name=${word(name)}><span class="number">${number(value, actuator.interface === "Twist2" ? (name === "linear" ? "m/s" : "rad/s") : "rad/s")}</span></${Field}>`)}
        </dl></div>
    </div>`;
}

export default { id: "drive", title: "Drive", Panel };

// A person who drives: on a socket of its own, so that no picture is ever in the way of what he says.
import { openSocket } from "/api.js";
import { alsoStop } from "/stop.js";

// A command holds for 150 ms, so one that is lost is no jerk.
const PERIOD = 50;
// A page that says nothing for so long was frozen: what a person held then has to be taken anew, ms.
export const LAPSE = 500;

/** The controls of one actuator, until `leave` is called. `told` gets `{state, gate, delay, problem, hold, lapses}` whenever that changes. */
export class Controls {
  constructor(actuator, told) {
    Object.assign(this, { actuator, told, command: null, sent: new Map(), sequence: 0, timer: 0 });
    this.status = { state: "asks", gate: null, delay: null, problem: null, hold: 150, lapses: 0 };
    this.socket = openSocket("teleoperation");
    this.socket.onopen = () => this.say({ take: actuator });
    this.socket.onmessage = ({ data }) => this.hear(JSON.parse(data));
    this.socket.onclose = () => this.tell({ state: "gone" });
    this.endStop = alsoStop(() => this.say({ stop: "in the console" }));
  }

  say(message) {
    if (this.socket.readyState !== WebSocket.OPEN) return;
    const sequence = ++this.sequence;
    this.sent.set(sequence, performance.now());
    this.socket.send(JSON.stringify({ ...message, sequence }));
  }

  hear(message) {
    const since = this.sent.get(message.sequence);
    this.sent.delete(message.sequence);
    const news = since === undefined ? {} : { delay: performance.now() - since };
    if (news.delay > LAPSE) this.lapse();
    if (message.taken) Object.assign(news, { state: "holds", hold: message.hold_ms, problem: null });
    if (message.problem) Object.assign(news, { problem: message.problem, state: this.status.state === "asks" ? "refused" : this.status.state });
    if (message.gate) news.gate = message.gate;
    this.tell(news);
  }

  tell(news) {
    this.status = { ...this.status, ...news };
    this.told(this.status);
  }

  /** Commands from now on, 20 times a second, until `release`. Whoever has the controls and holds nothing commands to stand. */
  drive(command) {
    this.command = command;
    if (this.timer) return;
    this.say({ command });
    let said = performance.now();
    this.timer = setInterval(() => {
      const now = performance.now();
      const isLate = now - said > LAPSE;
      said = now;
      const [oldest] = this.sent.values();
      if (isLate || now - oldest > LAPSE) this.lapse();
      this.say({ command: this.command });
    }, PERIOD);
  }

  /** The page was frozen, or nothing is heard of the agent: what is held then is let go, and has to be held anew. */
  lapse() {
    if (!this.command || Object.values(this.command).every((speed) => speed === 0)) return;
    this.command = Object.fromEntries(Object.keys(this.command).map((name) => [name, 0]));
    this.tell({ lapses: this.status.lapses + 1 });
  }

  /** Ends the command: said once, and then silence. */
  release() {
    if (!this.timer) return;
    clearInterval(this.timer);
    this.timer = 0;
    this.say({ release: true });
  }

  /** Gives the controls to whoever wants them next. */
  leave() {
    this.release();
    this.endStop();
    this.say({ leave: true });
    this.socket.onclose = null;
    this.socket.close();
  }
}

// Teleoperation over a socket of its own, so that no image delays a command.
import { openSocket } from "/api.js";
import { alsoStop } from "/stop.js";

// A command holds for 150 ms, so a lost one causes no jerk.
const PERIOD = 50;
// Silence after which the page counts as frozen, and held inputs must be released and held again, ms.
export const LAPSE = 500;

/** Control of one actuator, until `leave`. `onChange` receives `{state, gate, delay, problem, hold, lapses}` at each change. */
export class Controls {
  constructor(actuator, onChange) {
    Object.assign(this, { actuator, onChange, command: null, sent: new Map(), sequence: 0, timer: 0 });
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
    this.onChange(this.status);
  }

  /** Sends a command 20 times a second, until `release`. Without an input the command is a standstill. */
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

  /** Releases held inputs after a freeze of the page or silence of the agent; they must be held again. */
  lapse() {
    if (!this.command || Object.values(this.command).every((speed) => speed === 0)) return;
    this.command = Object.fromEntries(Object.keys(this.command).map((name) => [name, 0]));
    this.tell({ lapses: this.status.lapses + 1 });
  }

  /** Ends the command: sent once, then silence. */
  release() {
    if (!this.timer) return;
    clearInterval(this.timer);
    this.timer = 0;
    this.say({ release: true });
  }

  /** Releases control for the next client. */
  leave() {
    this.release();
    this.endStop();
    this.say({ leave: true });
    this.socket.onclose = null;
    this.socket.close();
  }
}

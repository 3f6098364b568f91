// The live socket of a recorded run: values at their recorded times, as the agent sends them.
import { find, newest, playback, reading } from "/recorded/run.js";

// ms.
const PERIOD = 20;

/** A socket with the interface of a `WebSocket`. */
export class RecordedSocket {
  readyState = WebSocket.CONNECTING;
  subscriptions = new Map();

  constructor() {
    setTimeout(() => {
      this.readyState = WebSocket.OPEN;
      this.onopen?.();
      setInterval(() => this.deliver(), PERIOD);
    });
  }

  send(text) {
    const { subscribe = [], unsubscribe = [] } = JSON.parse(text);
    for (const id of unsubscribe) this.subscriptions.delete(id);
    for (const { id, url, rate = 10, every = false, pointer = "", select } of subscribe) {
      const found = find(url.replace(/^\//, ""));
      if (found === null || select) this.say({ id, problem: { status: 404, detail: `${url} was not exported`, help: "" } });
      else this.subscriptions.set(id, { samples: found.samples, pointer: found.pointer + pointer, every, period: 1000 / rate, due: 0, last: -1 });
    }
  }

  say(message) {
    setTimeout(() => this.onmessage?.({ data: JSON.stringify(message) }));
  }

  /** Sends what is new at the time that is shown, in the order of time; after a step back, subscriptions to every value start over. */
  deliver() {
    const [now, time] = [performance.now(), playback.now()];
    const messages = [];
    for (const [id, subscription] of this.subscriptions) {
      const { samples, pointer, every, period, due, last } = subscription;
      const place = newest(samples, time);
      if (place < 0 || place === last || now < due) continue;
      Object.assign(subscription, { last: place, due: every ? 0 : now + period });
      const first = !every ? place : place > last ? last + 1 : 0;
      for (const sample of samples.slice(first, place + 1)) messages.push({ id, ...reading(sample, pointer) });
    }
    messages.sort((one, other) => one.time - other.time);
    for (const message of messages) this.onmessage?.({ data: JSON.stringify(message) });
  }
}

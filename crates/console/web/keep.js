// Histories that are kept from the opening of the page, whatever it shows: routes, gates, missions,
// clearances and commands, so that a plot opened after an event contains it.
import { follow } from "/store.js";
import { history } from "/history.js";
import { numbers } from "/schema.js";

const STATES = { ExecuteStatus: "/route", GateState: "/priority", Verdict: "/state" };
const STATE_RATE = 50;
// A limit for agents with many robots.
const MOST = 48;

/** Starts to keep these histories. */
export function keep() {
  let [properties, interfaces, count] = [[], {}, 0];
  const kept = new Set();
  const one = (path, pointer, rate) => {
    if (kept.has(path + pointer) || count >= MOST) return;
    kept.add(path + pointer);
    count += 1;
    history(path, pointer, rate);
  };
  const look = () => {
    for (const { path, interface: name, access } of properties) {
      if (access !== "output") continue;
      if (STATES[name]) one(path, STATES[name], STATE_RATE);
      else if (name === "Clearance" || path.endsWith("/command")) numbers(interfaces[name]).forEach(({ pointer }) => one(path, pointer));
    }
  };
  follow("/interfaces", ({ value }) => value && ((interfaces = value), look()), 30);
  follow("/properties", ({ value }) => value && ((properties = value), look()), 5);
}

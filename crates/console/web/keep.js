// What most people want to look back at is kept from the moment the page is open, whatever it shows: routes, gates, missions,
// clearances, and what actuators get. So a plot that is opened after something happened has it.
import { follow } from "/store.js";
import { history } from "/history.js";
import { numbers } from "/schema.js";

const STATES = { ExecuteStatus: "/route", GateState: "/priority", Verdict: "/state" };
const STATE_RATE = 50;
// An agent of many robots has more than anybody looks at.
const MOST = 48;

/** Begins to keep. */
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

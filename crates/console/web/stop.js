// The stop. It loads before the rest of the page, depends on nothing of it, and needs one press without a question.
import { post } from "/api.js";

const button = document.getElementById("stop");
const answer = document.getElementById("stop-answer");
// Time after which a missing confirmation is shown, ms.
const CONFIRMED = 300;

const others = new Set();

/** Registers a function for each stop, such as one with a socket of its own; returns a function that removes it. */
export function alsoStop(send) {
  others.add(send);
  return () => others.delete(send);
}

/** Stops all actuators. */
export async function stop() {
  const begin = performance.now();
  const late = setTimeout(() => say("NOT CONFIRMED: use the robot's emergency stop", "failed"), CONFIRMED);
  for (const send of others) send();
  try {
    const { stopped } = await post("/stop", { reason: "in the console" });
    clearTimeout(late);
    say(`${stopped.length} stopped in ${Math.max(1, Math.round(performance.now() - begin))} ms`, "done");
    document.dispatchEvent(new Event("stopped"));
  } catch (problem) {
    clearTimeout(late);
    say(`NOT STOPPED: ${problem.message}`, "failed");
  }
}

function say(text, state) {
  answer.textContent = text;
  button.dataset.state = state;
}

/** Clears the confirmation when a stop has ended; the report of a failed stop stays until another run starts. */
export function isOver(isOtherRun = false) {
  if (button.dataset.state === "done" || isOtherRun) say("Ctrl .", "");
}

button.addEventListener("click", stop);
addEventListener("keydown", (event) => {
  if (event.key === "." && (event.ctrlKey || event.metaKey)) {
    event.preventDefault();
    stop();
  }
});

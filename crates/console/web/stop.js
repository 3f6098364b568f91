// The stop. It is there before anything else is, needs nothing else of the page, and is one press without a question.
import { post } from "/api.js";

const button = document.getElementById("stop");
const answer = document.getElementById("stop-answer");
// After so long the person has to know that he can't rely on it, ms.
const CONFIRMED = 300;

const others = new Set();

/** Has a function called with each stop, such as one that says it on a socket of its own; returns what ends that. */
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

/** Takes back what was said of the last stop, when that is over; one that has failed is said until another run begins. */
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

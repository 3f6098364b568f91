// Changes of a map that can be undone, the last one first.
import { isPast, Problem, useState } from "/slate.js";

/** The last change, why one was refused, what was done, and functions that do more. */
export function useChanges() {
  const [done, setDone] = useState([]);
  const [problem, setProblem] = useState(null);
  const [said, setSaid] = useState("");
  async function change(words, work) {
    try {
      setProblem(null);
      if (isPast()) {
        const reason = "the page shows a past time, and a change applies to the present";
        throw new Problem(409, reason, "press “Go live” below first");
      }
      const undo = await work();
      if (undo) setDone((all) => [...all, { words, undo }]);
      setSaid(words);
    } catch (error) {
      if (!(error instanceof Problem)) throw error;
      setProblem(error);
    }
  }
  const last = done.at(-1);
  const undo = async () => {
    setDone(done.slice(0, -1));
    await change(`Undone: ${last.words}`, async () => {
      await last.undo();
    });
  };
  return { last, problem, said, change, undo };
}

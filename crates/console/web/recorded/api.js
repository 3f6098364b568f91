// The client of a recorded run in an exported page, in the place of `/api.js`.
import { at, methods, Problem } from "/operations.js";
import { answer } from "/recorded/answers.js";
import { run } from "/recorded/run.js";
import { RecordedSocket } from "/recorded/socket.js";

export { at, Problem };

export const isRecorded = true;

/** A page without an agent needs no token. */
export const token = () => "recorded";
export const giveToken = () => {};

/** As that of an agent, which answers as long as the page is open. */
export const life = {
  get heard() {
    return performance.now();
  },
  set heard(_) {},
};

export async function request() {
  throw new Problem(404, "images are not part of an exported page", "replay the recording: `slate replay FILE`");
}

// A copy, as over a connection.
export const { get, put, patch, post, remove } = methods(async (method, path, body) => structuredClone(answer(method, path, body)));

export const source = () => "";

export const openSocket = () => new RecordedSocket();

export const panels = async () => run.panels;

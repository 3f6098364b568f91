// The client of a recorded run in an exported page, in the place of `/api.js`.
import { at, methods, Problem } from "/operations.js";
import { answer } from "/recorded/answers.js";
import { playback, run } from "/recorded/run.js";
import { RecordedSocket } from "/recorded/socket.js";

export { at, Problem };

export const isRecorded = true;

export const timeShown = () => playback.now();

// Panels without content in a recording: blocks, modules and their times are known only of an agent that was running.
const hasModules = run.resources["/modules"]?.length > 0;
const hasLog = run.histories["log/tail"]?.length > 0;
const ABSENT = ["parameters", "images", "drive", ...(hasModules ? [] : ["mapek", "graph", "timing"]), ...(hasLog ? [] : ["log"])];

/** A layout without the tiles of absent panels; nothing if no tile is left. */
function reduced(layout) {
  const columns = layout.columns.map((column) => ({ ...column, tiles: column.tiles.filter(({ panel }) => !ABSENT.includes(panel)) }));
  const kept = columns.filter(({ tiles }) => tiles.length);
  return kept.length ? { ...layout, columns: kept } : null;
}

export function offered(layouts) {
  const kept = Object.entries(layouts).filter(([name]) => !ABSENT.includes(name));
  return Object.fromEntries(kept.map(([name, layout]) => [name, reduced(layout)]).filter(([, layout]) => layout));
}

export const note = hasModules ? "Conditions, timing and graph of the modules are those of the end" : "";

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

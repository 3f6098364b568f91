// HTTP client of the agent. The token is in the fragment of the printed link, which no log contains.
// An exported page has `recorded/api.js` in its place, with the same exports.
import { at, methods, Problem } from "/operations.js";

export { at, Problem };

/** Whether the page shows a recorded run without an agent. */
export const isRecorded = false;

/** The agent's time, ns, where the client knows it; else that of the newest value counts. */
export const timeShown = () => null;

/** The built-in layouts that this agent has content for. */
export const offered = (layouts) => layouts;

/** What the bar says about the origin of what is shown. */
export const note = "";

const BASE = "/api/v1";
const KEY = "slate.token";

// A new link in an open tab belongs to another run.
function take() {
  const given = new URLSearchParams(location.hash.slice(1));
  const token = given.get("token");
  if (token === null) return;
  sessionStorage.setItem(KEY, token);
  given.delete("token");
  history.replaceState(null, "", given.size ? `#${given}` : location.pathname);
}
take();

/** The token of this tab; empty without one. */
export const token = () => sessionStorage.getItem(KEY) ?? "";

/** Stores a token, or the token of a link. */
export function giveToken(text) {
  const found = text.trim().match(/token=([^&\s]+)/)?.[1] ?? text.trim();
  sessionStorage.setItem(KEY, found);
}

/** Time of the last message from the agent, ms of `performance.now`. */
export const life = { heard: performance.now() };

/** A streamed response. Refusals have status 200, because browsers log each other status as an error. */
export async function request(method, path, { body, signal } = {}) {
  const options = { method, signal, headers: { Authorization: `Bearer ${token()}`, Prefer: "refusal=200" } };
  if (body !== undefined) {
    options.body = JSON.stringify(body);
    options.headers["Content-Type"] = "application/json";
  }
  let response;
  try {
    response = await fetch(BASE + path, options);
  } catch {
    throw new Problem(0, "the agent does not respond", "check that it is still running: `slate ps`");
  }
  life.heard = performance.now();
  const isRefused = (response.headers.get("content-type") ?? "").startsWith("application/problem+json");
  if (response.ok && !isRefused) return response;
  const value = await read(response);
  throw new Problem(value.status ?? response.status, value.detail ?? String(value), value.help, value.report);
}

async function read(response) {
  const text = await response.text();
  return (response.headers.get("content-type") ?? "").includes("json") ? JSON.parse(text) : text;
}

export const { get, put, patch, post, remove } = methods(async (method, path, body) => read(await request(method, path, { body })));

/** Modules of the panels, as specifiers of an import. */
export const panels = async () => (await fetch("/panels.json")).json();

/** The address of an image, for elements that cannot set a header. */
export const source = (agent, path, query) =>
  `${BASE}${at(agent, path)}?${new URLSearchParams({ ...query, token: token() })}`;

/** Opens a WebSocket with the token among its subprotocols. */
export function openSocket(name) {
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  return new WebSocket(`${scheme}://${location.host}${BASE}/${name}`, ["slate.v1", `slate.token.${token()}`]);
}

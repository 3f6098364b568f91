// HTTP client of the agent. The token is in the fragment of the printed link, which no log contains.

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

/** A refusal of the agent, with its remedy. */
export class Problem extends Error {
  constructor(status, detail, help = "", report = "") {
    super(detail);
    Object.assign(this, { status, help, report });
  }
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

const ask = async (method, path, body) => read(await request(method, path, { body }));

export const get = (path) => ask("GET", path);
export const put = (path, body) => ask("PUT", path, body);
export const patch = (path, body) => ask("PATCH", path, body);
export const post = (path, body) => ask("POST", path, body);
export const remove = (path) => ask("DELETE", path);

/** The path of an operation on a property, such as `/slate/exp1/r2/planner/params`. */
export const at = (agent, path, kind = "slate") =>
  `/${kind}/${encodeURIComponent(agent)}/${path.split("/").map(encodeURIComponent).join("/")}`;

/** The address of an image, for elements that cannot set a header. */
export const source = (agent, path, query) =>
  `${BASE}${at(agent, path)}?${new URLSearchParams({ ...query, token: token() })}`;

/** Opens a WebSocket with the token among its subprotocols. */
export function openSocket(name) {
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  return new WebSocket(`${scheme}://${location.host}${BASE}/${name}`, ["slate.v1", `slate.token.${token()}`]);
}

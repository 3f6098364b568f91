// What the agent is made of, asked for now and then as long as somebody shows it.
import { get, Problem } from "/api.js";
import { useEffect, useState } from "/lib/preact.js";

const resources = new Map();

function resource(path) {
  let found = resources.get(path);
  if (found === undefined) {
    found = { path, value: undefined, problem: null, text: "", watchers: new Map(), timer: 0 };
    resources.set(path, found);
  }
  return found;
}

async function refresh(resource) {
  clearTimeout(resource.timer);
  try {
    const value = await get(resource.path);
    const text = JSON.stringify(value);
    const isNew = text !== resource.text || resource.problem;
    if (isNew) Object.assign(resource, { value, text, problem: null });
    if (isNew) notify(resource);
  } catch (error) {
    if (!(error instanceof Problem)) throw error;
    resource.problem = error;
    notify(resource);
  }
  clearTimeout(resource.timer);
  const period = Math.min(...resource.watchers.values());
  if (resource.watchers.size && Number.isFinite(period)) {
    resource.timer = setTimeout(() => refresh(resource), document.hidden ? 5 * period : period);
  }
}

const notify = (resource) => [...resource.watchers.keys()].forEach((watcher) => watcher(resource));

/** Calls a function whenever what is at a path of the API is another one, looking every `seconds`; returns what ends that. */
export function follow(path, watcher, seconds = Infinity) {
  const found = resource(path);
  const before = Math.min(...found.watchers.values());
  found.watchers.set(watcher, seconds * 1000);
  if (found.value !== undefined) watcher(found);
  if (found.value === undefined ? found.watchers.size === 1 : seconds * 1000 < before) refresh(found);
  return () => {
    found.watchers.delete(watcher);
    if (found.watchers.size === 0) clearTimeout(found.timer);
  };
}

/** Looks again at once, as after a change. */
export function reload(...paths) {
  for (const path of paths) if (resources.has(path)) refresh(resource(path));
}

/** Looks again at everything, as after another run has begun at the same address. */
export function reloadAll() {
  for (const resource of resources.values()) if (resource.watchers.size) refresh(resource);
}

/** What is at a path of the API, for a component; nothing before it is known. */
export function useResource(path, seconds = Infinity) {
  const [, redraw] = useState(0);
  useEffect(() => (path !== null ? follow(path, () => redraw((count) => count + 1), seconds) : undefined), [path, seconds]);
  return path !== null ? resource(path).value : undefined;
}

/** Why the agent does not say what is at a path, for a component that already shows it. */
export const problemOf = (path) => resource(path).problem;

/** How the recording is played that the agent plays; nothing of one that plays none. */
export function usePlayback() {
  const operations = useResource("")?.operations ?? [];
  return useResource(operations.some(({ path }) => path.endsWith("/playback")) ? "/playback" : null, 0.5);
}

/** The agent: name, role of who looks, why it is stopped. */
export const useAgent = () => useResource("/agent", 1);

/** The properties, without values. */
export const useProperties = () => useResource("/properties", 5) ?? [];

/** What values are made of, by the names of interfaces. */
export const useInterfaces = () => useResource("/interfaces", 30) ?? {};

/** How the run ended, if it is over: the agent may stay as long as somebody looks. */
export function useOver() {
  const documents = useResource("/documents") ?? [];
  return useResource(documents.includes("run") ? "/documents/run" : null, 1)?.over ?? null;
}

// Polled resources of the agent, as long as a component shows them.
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

/** Calls a function at each change of a resource, polled every `seconds`; returns a function that ends this. */
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

/** Reloads resources at once, as after a change. */
export function reload(...paths) {
  for (const path of paths) if (resources.has(path)) refresh(resource(path));
}

/** Reloads all resources, as after the start of another run at the same address. */
export function reloadAll() {
  for (const resource of resources.values()) if (resource.watchers.size) refresh(resource);
}

/** A resource, for a component; undefined before its first answer. */
export function useResource(path, seconds = Infinity) {
  const [, redraw] = useState(0);
  useEffect(() => (path !== null ? follow(path, () => redraw((count) => count + 1), seconds) : undefined), [path, seconds]);
  return path !== null ? resource(path).value : undefined;
}

/** The reason why a resource is not available, for a component that already shows it. */
export const problemOf = (path) => resource(path).problem;

/** The state of the playback; nothing in an agent that plays no recording. */
export function usePlayback() {
  const operations = useResource("")?.operations ?? [];
  return useResource(operations.some(({ path }) => path.endsWith("/playback")) ? "/playback" : null, 0.5);
}

/** The agent: its name, the role of the user, the reason of a stop. */
export const useAgent = () => useResource("/agent", 1);

/** The properties without values. */
export const useProperties = () => useResource("/properties", 5) ?? [];

/** The schemas of interfaces, by name. */
export const useInterfaces = () => useResource("/interfaces", 30) ?? {};

/** The result of a run that has ended; the agent may stay while a page is open. */
export function useOver() {
  const documents = useResource("/documents") ?? [];
  return useResource(documents.includes("run") ? "/documents/run" : null, 1)?.over ?? null;
}

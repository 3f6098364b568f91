// Dark or light: as the system says, until somebody says otherwise.

const KEY = "slate.theme";
const listeners = new Set();
const system = matchMedia("(prefers-color-scheme: dark)");

const stored = () => localStorage.getItem(KEY);

function apply() {
  document.documentElement.dataset.theme = stored() ?? (system.matches ? "dark" : "light");
  cache = null;
  listeners.forEach((listener) => listener());
}

/** Dark becomes light, and light dark. */
export function toggleTheme() {
  localStorage.setItem(KEY, document.documentElement.dataset.theme === "dark" ? "light" : "dark");
  apply();
}

let cache = null;

/** The colours of the theme by their names, for what is drawn on a canvas. */
export function colors() {
  if (cache) return cache;
  const style = getComputedStyle(document.documentElement);
  const names = ["surface", "raised", "line", "text", "muted", "accent", "deliberative", "reactive", "idle", "amber", "red", "wall", "free", "occupied", "path", "estimate"];
  cache = Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
  cache.series = [1, 2, 3, 4, 5, 6].map((place) => style.getPropertyValue(`--series-${place}`).trim());
  return cache;
}

/** Calls a function when the colours are other ones; returns what ends that. */
export function onTheme(listener) {
  listeners.add(listener);
  return () => listeners.delete(listener);
}

system.addEventListener("change", apply);
apply();

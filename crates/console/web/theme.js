// Dark or light: by the system's setting, or the user's choice.

const KEY = "slate.theme";
const listeners = new Set();
const system = matchMedia("(prefers-color-scheme: dark)");

const stored = () => localStorage.getItem(KEY);

function apply() {
  document.documentElement.dataset.theme = stored() ?? (system.matches ? "dark" : "light");
  cache = null;
  listeners.forEach((listener) => listener());
}

/** Switches between dark and light. */
export function toggleTheme() {
  localStorage.setItem(KEY, document.documentElement.dataset.theme === "dark" ? "light" : "dark");
  apply();
}

let cache = null;

/** The colors of the theme by name, for canvases. */
export function colors() {
  if (cache) return cache;
  const style = getComputedStyle(document.documentElement);
  const names = ["surface", "raised", "line", "text", "muted", "accent", "deliberative", "reactive", "idle", "amber", "red", "wall", "free", "occupied", "path", "estimate"];
  cache = Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
  cache.series = [1, 2, 3, 4, 5, 6].map((place) => style.getPropertyValue(`--series-${place}`).trim());
  return cache;
}

/** Calls a function when the colors change; returns a function that ends this. */
export function onTheme(listener) {
  listeners.add(listener);
  return () => listeners.delete(listener);
}

system.addEventListener("change", apply);
apply();

// Format of numbers, times and values: with units, and with a constant number of digits.

/** Significant decimal places by unit. */
const PLACES = { m: 3, rad: 3, "m/s": 3, "rad/s": 3, s: 2, "m/s²": 2, "rad/s²": 2, "1/s": 2 };

// The minus sign is as wide as a digit.
const signed = (text, unit) => (text.startsWith("-") ? `−${text.slice(1)}` : text) + (unit ? ` ${unit}` : "");

/** A number with two decimal places, for the map. */
export const fixed = (value, unit = "") => signed(value.toFixed(2), unit);

/** An angle in degrees, from radians. */
export const degrees = (radians) => `${signed(((radians * 180) / Math.PI).toFixed(1))}°`;

/** A number with its unit; an angle also in degrees. */
export function number(value, unit = "") {
  if (value === null || value === undefined) return "NaN";
  if (unit === "ns") return duration(value);
  const text = Number.isInteger(value) && !(unit in PLACES) ? String(value) : value.toFixed(PLACES[unit] ?? 3);
  return unit === "rad" ? `${signed(text, unit)} (${degrees(value)})` : signed(text, unit);
}

/** A duration with three digits, from nanoseconds. */
export function duration(nanoseconds) {
  if (nanoseconds === 0) return "0 ns";
  const steps = [[1e9, "s"], [1e6, "ms"], [1e3, "µs"], [1, "ns"]];
  const [size, unit] = steps.find(([size]) => Math.abs(nanoseconds) >= size) ?? [1e9, "s"];
  const scaled = nanoseconds / size;
  const places = unit === "ns" ? 0 : scaled >= 100 ? 0 : scaled >= 10 ? 1 : 2;
  return `${scaled.toFixed(places)} ${unit}`;
}

/** The agent's time, such as `1:07.42`. */
export function time(nanoseconds) {
  const seconds = nanoseconds / 1e9;
  const minutes = Math.floor(seconds / 60);
  return `${minutes}:${(seconds - 60 * minutes).toFixed(2).padStart(5, "0")}`;
}

/** An age, from seconds. */
export const age = (seconds) => (seconds < 0.995 ? `${Math.max(0, seconds * 1000).toFixed(0)} ms` : `${seconds.toFixed(1)} s`);

/** A constant as a word: `DELIBERATIVE` is Deliberative. */
export const word = (name) => {
  const text = String(name ?? "").replaceAll("_", " ").toLowerCase();
  return text.charAt(0).toUpperCase() + text.slice(1);
};

/** The condition of a module, with the input that it waits for. */
export const conditionOf = ({ condition, waiting_for: input }) => word(condition) + (condition === "WAITING" && input ? ` for ${input}` : "");

const NAMES = { theta: "θ" };

/** A value in one line, by the schema of its interface. */
export function brief(value, schema) {
  if (value === null || value === undefined) return schema?.type?.includes?.("number") ? "NaN" : "none";
  if (typeof value === "number") return number(value, schema?.["x-unit"]);
  if (typeof value !== "object") return String(value);
  if (Array.isArray(value)) return `${value.length} ${value.length === 1 ? "item" : "items"}`;
  const names = (schema?.["x-order"] ?? Object.keys(schema?.properties ?? value)).filter((name) => name in value && name !== "reserved");
  // A single field needs no name.
  if (names.length === 1) return brief(value[names[0]], schema?.properties?.[names[0]]);
  const parts = names.map((name) => `${NAMES[name] ?? name} ${brief(value[name], schema?.properties?.[name])}`);
  return parts.join("  ");
}

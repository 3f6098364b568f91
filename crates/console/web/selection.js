// The property that is selected in one panel and shown in others.
import { useEffect, useState } from "/lib/preact.js";

let selected = "";
const listeners = new Set();

/** Selects a property for all panels. */
export function select(path) {
  selected = path;
  listeners.forEach((listener) => listener(path));
}

/** The selected property, for a component. */
export function useSelected() {
  const [path, setPath] = useState(selected);
  useEffect(() => {
    listeners.add(setPath);
    setPath(selected);
    return () => listeners.delete(setPath);
  }, []);
  return path;
}

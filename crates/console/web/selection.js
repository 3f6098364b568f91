// The property that one panel shows because it was chosen in another.
import { useEffect, useState } from "/lib/preact.js";

let selected = "";
const listeners = new Set();

/** Chooses a property for all panels. */
export function select(path) {
  selected = path;
  listeners.forEach((listener) => listener(path));
}

/** The property that is chosen, for a component. */
export function useSelected() {
  const [path, setPath] = useState(selected);
  useEffect(() => {
    listeners.add(setPath);
    setPath(selected);
    return () => listeners.delete(setPath);
  }, []);
  return path;
}

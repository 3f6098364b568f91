// How often properties are written.
import { useMemo, useRef } from "/lib/preact.js";

/** The rates of properties by their paths, Hz, after two looks. */
export function useRates(properties) {
  const before = useRef(new Map());
  return useMemo(() => {
    const now = performance.now();
    const rates = new Map();
    for (const { path, sequence } of properties) {
      const last = before.current.get(path);
      const seconds = last ? (now - last.when) / 1000 : 0;
      if (last && seconds > 0.2) rates.set(path, Math.max(0, sequence - last.sequence) / seconds);
      before.current.set(path, { when: now, sequence });
    }
    return rates;
  }, [properties]);
}

/** A rate in words; nothing while it is not known. */
export const hertz = (rate) => (rate === undefined ? "" : rate ? `${rate.toFixed(rate < 10 ? 1 : 0)} Hz` : "–");

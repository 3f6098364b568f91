// Rates of properties.
import { useMemo, useRef } from "/lib/preact.js";

// Silence after which a rate is zero, ms.
const SILENCE = 2500;

/** Rates of properties with values, by path: Hz of the agent's time, from the second look on. */
export function useRates(properties) {
  const before = useRef(new Map());
  return useMemo(() => {
    const now = performance.now();
    const rates = new Map();
    for (const { path, sequence, time } of properties) {
      const last = before.current.get(path);
      const isNews = sequence !== last?.sequence;
      // Another run starts from the beginning.
      const rate = !last || sequence < last.sequence ? undefined
        : isNews ? (time > last.time ? ((sequence - last.sequence) * 1e9) / (time - last.time) : undefined)
        : now - last.when > SILENCE ? 0 : last.rate;
      before.current.set(path, { sequence, time, rate, when: isNews ? now : last.when });
      if (rate !== undefined) rates.set(path, rate);
    }
    return rates;
  }, [properties]);
}

/** A rate as text; empty while it is unknown. */
export const hertz = (rate) => (rate === undefined ? "" : rate ? `${rate.toFixed(rate < 10 ? 1 : 0)} Hz` : "–");

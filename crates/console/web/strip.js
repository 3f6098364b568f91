// The history of a state as a strip: a segment for each value, with its name if it fits.
import { html, useEffect, useState } from "/lib/preact.js";
import { clock } from "/live.js";
import { history } from "/history.js";
import { colors } from "/theme.js";
import { time, word } from "/format.js";
import { useSize } from "/parts.js";

// High enough for the shortest reflex, Hz.
const RATE = 50;

/** The segments of a state's history in an interval: `{from, to, value}` in s. */
export function parts({ times, values }, begin, end) {
  const found = [];
  let newest = times.length - 1;
  while (newest >= 0 && times[newest] > end) newest -= 1;
  for (let place = newest; place >= 0; place -= 1) {
    const to = found.length ? found[0].from : end;
    if (found.length && found[0].value === values[place]) found[0].from = times[place];
    else found.unshift({ from: times[place], to, value: values[place] });
    if (times[place] <= begin) break;
  }
  return found.filter(({ to }) => to > begin);
}

/** The share of the time of each value. */
export function shares(found, begin) {
  const sums = {};
  let whole = 0;
  for (const { from, to, value } of found) {
    const length = to - Math.max(from, begin);
    sums[value] = (sums[value] ?? 0) + length;
    whole += length;
  }
  return Object.fromEntries(Object.entries(sums).map(([value, sum]) => [value, whole ? sum / whole : 0]));
}

// Routes have their own colors and rows, so that they differ without colors, too.
const ROUTES = { DELIBERATIVE: { color: "deliberative", row: 0 }, REACTIVE: { color: "reactive", row: 1 }, IDLE: { color: "idle", row: 2 } };

function look(value, values) {
  const scheme = colors();
  const route = ROUTES[value];
  if (route) return { fill: scheme[route.color], y: 8 * route.row, height: 8 };
  const place = values.indexOf(value);
  return { fill: scheme.series[place % scheme.series.length], y: 0, height: 24 };
}

/** A state over the last seconds. */
export function Strip({ path, pointer, values, seconds = 60, name = path }) {
  const [box, size] = useSize();
  const [, redraw] = useState(0);
  useEffect(() => {
    const timer = setInterval(() => redraw((count) => count + 1), 200);
    return () => clearInterval(timer);
  }, []);
  const [end, width] = [clock.now / 1e9, size?.width ?? 0];
  const begin = Math.max(0, end - seconds);
  const found = parts(history(path, pointer, RATE), begin, end);
  const x = (at) => ((Math.max(at, begin) - begin) / seconds) * width;
  const texts = Object.entries(shares(found, begin)).map(([value, share]) => `${word(value)} ${Math.round(100 * share)} %`);
  const words = `${name}: ${texts.join(", ") || "none yet"}`;
  return html`<div class="strip-box" ref=${box}>
    <svg class="strip" width=${width} height="40" role="img" aria-label=${words}>
      <rect width=${width} height="24" class="bar-back" />
      ${found.map(({ from, to, value }) => {
        const { fill, y, height } = look(value, values);
        const [left, room] = [x(from), x(to) - x(from)];
        const text = word(value);
        return html`<g key=${from}><title>${`${text}, ${(to - from).toFixed(2)} s`}</title><rect x=${left} y=${y} width=${Math.max(0.7, room)} height=${height} fill=${fill} />
          ${room > 7 * text.length + 8 && height > 20 && html`<text x=${left + 5} y="16" class="strip-text">${text}</text>`}</g>`;
      })}
      ${[0, 0.25, 0.5, 0.75, 1].map((share) => html`<text key=${share} x=${share * width} y="37" class="strip-tick" text-anchor=${share === 0 ? "start" : share === 1 ? "end" : "middle"}>${time((begin + share * seconds) * 1e9).slice(0, -3)}</text>`)}
    </svg>
    <p class="muted strip-words">${words}</p></div>`;
}

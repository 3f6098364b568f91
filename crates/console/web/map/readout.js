// The robots of a map as text, for users of screen readers and for copying.
import { degrees, fixed, html, isOfNow, useEffect, useState, word } from "/slate.js";
import { isCrowd, knownPose } from "/map/paint.js";
import { routeOf } from "/route.js";

// Time between updates, ms.
const PERIOD = 250;

/** Poses and routes of robots; paths of current values among those of the past. */
export function useSummary({ scene, gates }, readings) {
  const [robots, setRobots] = useState([]);
  const [ofNow, setOfNow] = useState("");
  const value = (path) => readings.get(path)?.value;
  useEffect(() => {
    const timer = setInterval(() => {
      setRobots(scene.robots.map(({ name, pose, status, isScripted }) => {
        const place = knownPose(readings.get(pose));
        const route = routeOf(value(status)?.route, (gates[name] ?? []).map(value));
        return { name, place, route: route ?? (isScripted ? "scripted" : "") };
      }));
      setOfNow([...readings].filter(([, reading]) => isOfNow(reading)).map(([path]) => path).join(", "));
    }, PERIOD);
    return () => clearInterval(timer);
  }, [scene]);
  return { robots, ofNow };
}

/** Text alternative of the drawing. */
export function spokenMap(robots) {
  const spoken = ({ name, place, route }) =>
    place ? `${name} at ${place.x.toFixed(1)}, ${place.y.toFixed(1)} ${word(route)}` : name;
  return `Map. ${robots.map(spoken).join("; ")}`;
}

const Mark = ({ row }) =>
  html`<span class="own" style=${{ background: `var(--series-${(row % 6) + 1})` }}></span>`;

/** A table of the robots; of a crowd, without those that follow a script. */
export function Readout({ robots }) {
  const rows = isCrowd(robots) ? robots.filter(({ route }) => route !== "scripted") : robots;
  const length = (number) => (number === undefined ? "–" : fixed(number, "m"));
  return html`<table class="readout">
    <caption class="hidden">Robots</caption>
    <tbody>${rows.map(({ name, place, route }, row) => html`<tr key=${name} data-route=${route}>
      <th scope="row">${robots.length > 1 && html`<${Mark} row=${row} />`}${name}</th>
      <td class="number">${length(place?.x)}</td><td class="number">${length(place?.y)}</td>
      <td class="number" title=${place ? fixed(place.theta, "rad") : ""}>${place ? degrees(place.theta) : "–"}</td>
      <td>${word(route)}</td></tr>`)}
      ${robots.length > rows.length
        && html`<tr><td colspan="5">and ${robots.length - rows.length} that follow a script</td></tr>`}</tbody>
  </table>`;
}

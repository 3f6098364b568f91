// A panel of a project: one file, and nothing to build.
import { html, number, useReading } from "/slate.js";

function Panel() {
  const reading = useReading("simulator/r2/clearance");
  return html`<p class="own-clearance">${reading ? number(reading.value.distance, "m") : "none yet"}</p>`;
}

export default { id: "clearance", title: "Clearance", Panel };

// The API of panels. A panel is a file that exports `{ id, title, Panel }`; `Panel` receives its `options` and `setOptions`, and
// renders itself with `html`. Panels of a project are in the folder `console/panels` and need no build:
//
//   import { html, useReading } from "/slate.js";
//   const Panel = () => html`<p>${useReading("simulator/r2/clearance")?.value.distance} m</p>`;
//   export default { id: "clearance", title: "Clearance", Panel };
export * from "/lib/preact.js";
export * from "/api.js";
export * from "/format.js";
export * from "/rates.js";
export * from "/schema.js";
export * from "/store.js";
export { clock, connection, isOfNow, isPast, onConnection, useReading, useReadings, watch } from "/live.js";
export { openPanel } from "/open.js";
export { useSelected, select } from "/selection.js";
export { Age, Bar, Empty, Field, Menu, Trouble, useSize } from "/parts.js";
export { colors, onTheme } from "/theme.js";

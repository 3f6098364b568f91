// The keys.
import { html } from "/lib/preact.js";
import { Dialog } from "/dialog.js";

const KEYS = [
  ["Ctrl .", "stop all actuators, from anywhere"],
  ["Ctrl K", "find layouts, panels, properties, and what can be done"],
  ["g and the first letter", "go to a layout: g o is the overview, g t is timing; again for the next one with that letter"],
  ["b", "mark this moment in the log"],
  ["/", "search in the panel"],
  ["Tab, arrows", "move among panels, rows and borders"],
  ["W A S D or arrows", "drive, in the panel Drive, as long as they are held"],
  ["Space", "stop all actuators, while you have the controls"],
  ["?", "these keys"],
];

/** A dialog with the keys. */
export const Help = ({ close }) => html`<${Dialog} label="Keys" kind="help" close=${close}>
  <h2>Keys</h2>
  <dl>${KEYS.map(([key, does]) => html`<div class="field" key=${key}><dt><kbd>${key}</kbd></dt><dd>${does}</dd></div>`)}</dl>
  <button class="primary" data-first onClick=${close}>Close</button>
</${Dialog}>`;

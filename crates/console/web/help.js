// Keyboard shortcuts.
import { html } from "/lib/preact.js";
import { isRecorded } from "/api.js";
import { Dialog } from "/dialog.js";

const KEYS = [
  ["Ctrl K", "find layouts, panels, properties and commands"],
  ["g and the first letter", "open a layout: g o for Overview, g t for Timing; repeat for the next layout with that letter"],
  ["/", "search in the panel"],
  ["Tab, arrows", "move among panels, rows and borders"],
  ["?", "show these shortcuts"],
];

// Those that change the agent.
const ORDERS = [
  ["Ctrl .", "stop all actuators, from anywhere"],
  ["b", "write a mark into the log"],
  ["W A S D or arrows", "drive while held, in the Drive panel"],
  ["Space", "stop all actuators while you drive"],
];

/** A dialog with the keyboard shortcuts. */
export const Help = ({ close }) => html`<${Dialog} label="Keyboard shortcuts" kind="help" close=${close}>
  <h2>Keyboard shortcuts</h2>
  <dl>${[...(isRecorded ? [] : ORDERS), ...KEYS].map(([key, does]) => html`<div class="field" key=${key}><dt><kbd>${key}</kbd></dt><dd>${does}</dd></div>`)}</dl>
  <button class="primary" data-first onClick=${close}>Close</button>
</${Dialog}>`;

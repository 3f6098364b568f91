// The keys.
import { html, useEffect, useRef } from "/lib/preact.js";

const KEYS = [
  ["Ctrl .", "stop all actuators, from anywhere"],
  ["g and the first letter", "go to a layout: g o is the overview, g t is timing"],
  ["/", "search in the panel"],
  ["Tab, arrows", "move among panels, rows and borders"],
  ["W A S D or arrows", "drive, in the panel Drive, as long as they are held"],
  ["Space", "stop all actuators, while you have the controls"],
  ["?", "these keys"],
];

/** A dialog with the keys. */
export function Help({ close }) {
  const dialog = useRef(null);
  useEffect(() => dialog.current.showModal(), []);
  return html`<dialog ref=${dialog} class="help" onClose=${close} onClick=${(event) => event.target === dialog.current && dialog.current.close()} aria-label="Keys">
    <h2>Keys</h2>
    <dl>${KEYS.map(([key, does]) => html`<div class="field" key=${key}><dt><kbd>${key}</kbd></dt><dd>${does}</dd></div>`)}</dl>
    <form method="dialog"><button class="primary">Close</button></form>
  </dialog>`;
}

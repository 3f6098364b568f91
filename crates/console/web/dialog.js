// A dialog that is not modal, because the stop must stay reachable.
import { html, useLayoutEffect, useRef } from "/lib/preact.js";

/** A dialog over the panels; `Esc`, a press outside, or moving the focus out closes it. */
export function Dialog({ label, kind, close, children }) {
  const box = useRef(null);
  // Before the first frame, so that it receives the next key.
  useLayoutEffect(() => {
    const before = document.activeElement;
    (box.current.querySelector("[data-first]") ?? box.current).focus();
    return () => before?.focus?.();
  }, []);
  const key = (event) => {
    if (event.key !== "Escape") return;
    event.stopPropagation();
    close();
  };
  const left = ({ relatedTarget }) => relatedTarget && !box.current.contains(relatedTarget) && relatedTarget.id !== "stop" && close();
  return html`<div class="veil" onPointerDown=${(event) => event.target === event.currentTarget && close()}>
    <div ref=${box} class=${`dialog ${kind}`} role="dialog" aria-label=${label} tabindex="-1" onKeyDown=${key} onFocusOut=${left}>${children}</div>
  </div>`;
}

// A dialog over the page that leaves the stop where it is: nothing may stand between a hand and that, so none is modal.
import { html, useLayoutEffect, useRef } from "/lib/preact.js";

/** Over the panels until it is closed: by `Esc`, by a press beside it, or when the keyboard leaves it. */
export function Dialog({ label, kind, close, children }) {
  const box = useRef(null);
  // Before anybody sees it: the next key is meant for it.
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

// Small components that panels share.
import { html, useEffect, useRef, useState } from "/lib/preact.js";
import { age } from "/format.js";
import { clock, isOfNow } from "/live.js";

/** The text of a panel without content, with the reason. */
export const Empty = ({ children }) => html`<p class="empty">${children}</p>`;

/** A refusal of the agent, with its remedy and, on demand, its place in a file. */
export const Trouble = ({ problem }) => {
  if (!problem) return null;
  const { message, help, report } = problem;
  return html`<div class="trouble" role="alert">
    <b>${message}</b>${help && html`<span>${help}</span>`}
    ${report && html`<details><summary>Where</summary><pre>${report}</pre></details>`}
  </div>`;
};

/** A name and a value, as a row of a list. */
export const Field = ({ name, children, state, title }) =>
  html`<div class="field" title=${title}><dt>${name}</dt><dd data-state=${state}>${children}</dd></div>`;

/** The age of a reading by the agent's clock; ages above `limit` seconds are highlighted, and so are current
 *  values while a past time is shown. */
export const Age = ({ time, limit = Infinity }) => {
  if (time === undefined || time === null) return html`<span class="muted">never</span>`;
  if (isOfNow({ time })) return html`<span class="stale" title="No history of this property at the selected time">current value</span>`;
  const seconds = (clock.now - time) / 1e9;
  return html`<span class=${seconds > limit ? "stale" : "muted"}>${age(Math.max(0, seconds))}</span>`;
};

/** A share as a bar. */
export const Bar = ({ share, label }) =>
  html`<svg class="bar" role="img" aria-label=${label} viewBox="0 0 100 6" preserveAspectRatio="none">
    <rect width="100" height="6" class="bar-back" /><rect width=${100 * Math.min(1, Math.max(0, share))} height="6" class="bar-front" />
  </svg>`;

/** The size of an element in CSS pixels, and the reference to set on it. */
export function useSize() {
  const [element, setElement] = useState(null);
  const [size, setSize] = useState(null);
  useEffect(() => {
    if (!element) return undefined;
    const observer = new ResizeObserver(([{ contentRect: { width, height } }]) =>
      setSize({ width: Math.floor(width), height: Math.floor(height) }),
    );
    observer.observe(element);
    return () => observer.disconnect();
  }, [element]);
  return [setElement, size];
}

/** A menu that a press on its title opens, and Escape or a press elsewhere closes. */
export function Menu({ title, children }) {
  const menu = useRef(null);
  useEffect(() => {
    const close = (isKey) => {
      if (!menu.current?.open) return;
      menu.current.open = false;
      if (isKey) menu.current.querySelector("summary").focus();
    };
    const press = (event) => event.key === "Escape" && close(true);
    const point = (event) => menu.current?.contains(event.target) || close(false);
    document.addEventListener("keydown", press);
    document.addEventListener("pointerdown", point);
    return () => {
      document.removeEventListener("keydown", press);
      document.removeEventListener("pointerdown", point);
    };
  }, []);
  return html`<details class="menu" ref=${menu}><summary>${title}</summary><div>${children}</div></details>`;
}

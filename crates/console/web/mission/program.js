// A Golog program: what it has done, what the robot performs, and what remains.
import { html, useEffect, useRef } from "/lib/preact.js";

const WORDS = { SUCCEEDED: "has succeeded", FAILED: "has failed", OCCURRED: "has occurred", RUNNING: "runs", SUSPENDED: "waits for one of higher priority" };
const SIGNS = { SUCCEEDED: "✓", FAILED: "✕", OCCURRED: "⚡", PERFORMED: "▸" };

/** Trace and remaining program; an action that runs can be chosen. */
export function Program({ items, chosen, choose }) {
  const end = useRef(null);
  const trace = items.filter(({ status, element }) => element === 65535 && SIGNS[status]);
  const running = items.filter(({ element, status }) => element !== 65535 && WORDS[status]);
  const rest = items.filter(({ status }) => status === "REMAINING");
  useEffect(() => {
    if (end.current) end.current.scrollTop = end.current.scrollHeight;
  }, [trace.length, trace.at(-1)?.text]);
  return html`<div class="program">
    <section><h3>Trace</h3><ol class="rows" ref=${end} tabindex="0" aria-label="Trace">${trace.map(({ status, count, text }, at) => html`<li key=${at} data-status=${status}>
      <span class="sign" aria-hidden="true">${SIGNS[status]}</span>${text} <span class="muted">${WORDS[status] ?? (count ? "has begun" : "done")}</span></li>`)}
      ${!trace.length && html`<li class="muted">nothing yet</li>`}</ol></section>
    <section><h3>Performs</h3><ul class="rows" aria-label="Actions that run">${running.map(({ element, status, text }) => html`<li key=${element}>
      <button class="quiet" data-element=${element} data-status=${status} aria-pressed=${element === chosen} onClick=${() => choose(element)}>▶ ${text}</button> <span class="muted">${WORDS[status]}</span></li>`)}
      ${!running.length && html`<li class="muted">nothing</li>`}</ul></section>
    <section><h3>Remaining program</h3><ol class="rows" aria-label="Remaining program">${rest.map(({ count, text }, at) => html`<li key=${at} style=${{ paddingLeft: `${count * 16}px` }}>${text}</li>`)}
      ${!rest.length && html`<li class="muted">nothing</li>`}</ol></section>
  </div>`;
}

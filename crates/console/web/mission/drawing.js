// A mission as a drawing: nets, state machines, trees. Each element is a button, which shows why it waits.
import { html } from "/lib/preact.js";
import { word } from "/format.js";
import { halfOf, titled } from "/mission/graph.js";

// A drawing that would be smaller is scrolled.
const LEAST = 0.7;
const SIGNS = { RUNNING: "▶", SUCCEEDED: "✓", FAILED: "✕", SKIPPED: "–", WAITING: "…" };

const place = (node, item) => html`<circle class="body" r="11" />
  ${(node.mark === "GOAL" || node.mark === "FAILURE") && html`<circle class="ring" r="8" />`}
  ${item?.count === 1 && html`<circle class="token" r="4.5" />`}
  ${item?.count > 1 && html`<text class="count" y="4">${item.count}</text>`}
  <text x="17" y="4">${titled(node)}</text>`;

const transition = (node) => html`<rect class="body" x="-14" y="-4" width="28" height="8" rx="2" /><text x="20" y="4">${titled(node)}</text>`;

function state(node) {
  const half = halfOf(node.label);
  return html`<rect class="body" x=${-half} y="-14" width=${2 * half} height="28" rx=${node.mark === "START" ? 3 : 13} />
    ${(node.mark === "GOAL" || node.mark === "FAILURE") && html`<rect class="ring" x=${3 - half} y="-11" width=${2 * half - 6} height="22" rx="10" />`}
    <text class="count" y="4">${titled(node)}</text>`;
}

const row = (node, item) => html`<rect class="body" y="-10" width=${node.width} height="20" rx="4" />
  <text class="sign" x="8" y="4">${SIGNS[item?.status] ?? ""}</text><text x="24" y="4">${titled(node)}</text>`;

const SHAPES = { PLACE: place, TRANSITION: transition, STATE: state };

/** Text alternative of an element, for screen readers. */
const spoken = (node, item) => [node.kind === "PLACE" && item ? `${item.count} ${item.count === 1 ? "token" : "tokens"}` : item && word(item.status), item?.text].filter(Boolean).join(", ");

/** The drawing with the items of an activity, by their elements. */
export function Drawing({ drawn, items, chosen, choose, name, room }) {
  const { groups, width, height } = drawn;
  const scale = Math.min(1, Math.max(LEAST, (room - 4) / width));
  const all = groups.flatMap(({ nodes }) => nodes);
  const first = all.some(({ number }) => number === chosen) ? chosen : all[0]?.number;
  const key = (event, node) => {
    const step = { ArrowDown: 1, ArrowRight: 1, ArrowUp: -1, ArrowLeft: -1 }[event.key];
    if (step) {
      const next = all[all.indexOf(node) + step];
      const element = next && event.currentTarget.closest("svg").querySelector(`[data-element="${next.number}"]`);
      element?.focus();
      if (next) choose(next.number);
    } else if (event.key === "Enter" || event.key === " ") choose(node.number);
    else return;
    event.preventDefault();
  };
  return html`<svg class="mission-drawing" data-rows=${Boolean(drawn.isOfRows)} width=${width * scale} height=${height * scale} viewBox=${`0 0 ${width} ${height}`} role="group" aria-label=${name}>
    <defs><marker id="mission-tip" viewBox="0 0 8 8" refX="7" refY="4" markerUnits="userSpaceOnUse" markerWidth="9" markerHeight="9" orient="auto"><path d="M0 0L8 4L0 8z" class="tip" /></marker></defs>
    ${groups.map(({ group, shift, title, nodes, edges }) => html`<g key=${group?.number ?? "all"} class="part" data-runs=${!group || items.has(group.number)} transform=${`translate(${shift.x} ${shift.y})`}>
      ${title && html`<text class="heading" y="-12">${title}</text>`}
      ${edges.map((edge) => html`<path key=${edge.number} class="line" data-mark=${edge.mark} data-near=${chosen !== null && (edge.from === chosen || edge.to === chosen)} d=${edge.path} marker-end=${edge.kind === "EDGE" ? "url(#mission-tip)" : undefined}>
        ${edge.label && html`<title>${edge.label}</title>`}</path>`)}
      ${nodes.map((node) => {
        const item = items.get(node.number);
        return html`<g key=${node.number} class="element" role="button" tabindex=${node.number === first ? 0 : -1} transform=${`translate(${node.x} ${node.y})`}
          data-element=${node.number} data-kind=${node.kind} data-mark=${node.mark} data-status=${item?.status ?? "IDLE"} data-tokens=${node.kind === "PLACE" ? item?.count ?? 0 : undefined}
          aria-pressed=${node.number === chosen} aria-label=${`${node.label}${item ? `: ${spoken(node, item)}` : ""}`} onClick=${() => choose(node.number)} onKeyDown=${(event) => key(event, node)}>
          <title>${`${node.label}${item?.text ? `\n${item.text}` : ""}`}</title>${(SHAPES[node.kind] ?? row)(node, item)}</g>`;
      })}</g>`)}
  </svg>`;
}

// The tiles of a layout; their borders move by dragging or by arrow keys.
import { Component, html, useRef } from "/lib/preact.js";

const LEAST = 0.15;

// A failing panel does not affect the others.
class Shield extends Component {
  componentDidCatch(error) {
    console.error(error);
    this.setState({ error });
  }

  render({ children, title }, { error }) {
    if (!error) return children;
    const again = () => this.setState({ error: null });
    return html`<div class="trouble" role="alert"><b>Panel ${title} failed: ${error.message}</b><button onClick=${again}>Try again</button></div>`;
  }
}

function Tile({ tile, number, panels, change, close, split }) {
  const panel = panels.get(tile.panel);
  const title = `${panel?.title ?? tile.panel}${number > 1 ? ` ${number}` : ""}`;
  const choose = (event) => change({ ...tile, panel: event.target.value, options: {} });
  const setOptions = (options) => change({ ...tile, options: { ...tile.options, ...options } });
  return html`<section class="tile" data-panel=${tile.panel} aria-label=${title}>
    <header>
      <h2 class="hidden">${title}</h2>
      <select aria-label="Panel" value=${tile.panel} onChange=${choose}>
        ${!panel && html`<option value=${tile.panel}>${tile.panel}</option>`}
        ${[...panels.values()].map(({ id, title }) => html`<option key=${id} value=${id}>${title}</option>`)}
      </select>
      <span class="grow"></span>
      <button class="quiet" title="Add a panel below" aria-label="Add a panel below" onClick=${() => split("below")}>⬓</button>
      <button class="quiet" title="Add a panel beside this one" aria-label="Add a panel beside this one" onClick=${() => split("beside")}>◨</button>
      <button class="quiet" title="Close" aria-label="Close the panel" disabled=${!close} onClick=${close}>✕</button>
    </header>
    <div class="tile-body">
      ${panel
        ? html`<${Shield} key=${tile.panel} title=${title}><${panel.Panel} options=${tile.options ?? {}} setOptions=${setOptions} /></${Shield}>`
        : html`<p class="empty">Unknown panel “${tile.panel}”. Panels of a project belong in <code>console/panels</code>.</p>`}
    </div>
  </section>`;
}

/** A border between two neighbors; `move` receives its displacement as a share of both. */
function Border({ direction, move }) {
  const start = useRef(null);
  const at = (event) => (direction === "column" ? event.clientX : event.clientY);
  const begin = (event) => {
    const [before, after] = [event.target.previousElementSibling, event.target.nextElementSibling];
    const extent = (element) => (direction === "column" ? element.offsetWidth : element.offsetHeight);
    start.current = { from: at(event), room: extent(before) + extent(after) };
    event.target.setPointerCapture(event.pointerId);
  };
  const drag = (event) => {
    if (!start.current) return;
    move((at(event) - start.current.from) / start.current.room);
    start.current.from = at(event);
  };
  const key = (event) => {
    const step = { ArrowLeft: -0.05, ArrowUp: -0.05, ArrowRight: 0.05, ArrowDown: 0.05 }[event.key];
    if (step === undefined) return;
    event.preventDefault();
    move(step);
  };
  return html`<div class="border ${direction}" role="separator" tabindex="0" aria-label="Border" aria-valuenow="50"
    aria-orientation=${direction === "column" ? "vertical" : "horizontal"}
    onPointerDown=${begin} onPointerMove=${drag} onPointerUp=${() => (start.current = null)} onKeyDown=${key}></div>`;
}

function moved(parts, place, share) {
  const both = parts[place].share + parts[place + 1].share;
  const first = Math.min(both * (1 - LEAST), Math.max(both * LEAST, parts[place].share + share * both));
  return parts.map((part, own) => (own === place ? { ...part, share: first } : own === place + 1 ? { ...part, share: both - first } : part));
}

/** All tiles; `change` receives the changed layout. */
export function Workspace({ layout, panels, change }) {
  const columns = layout.columns;
  const setColumns = (columns) => change({ ...layout, columns });
  const setTiles = (place, tiles) =>
    setColumns(tiles.length ? columns.map((column, own) => (own === place ? { ...column, tiles } : column)) : columns.filter((_, own) => own !== place));
  const all = columns.flatMap(({ tiles }) => tiles);
  const only = columns.length === 1 && columns[0].tiles.length === 1;
  return html`<main class="workspace" id="content" tabindex="-1">
    ${columns.map((column, place) => html`
      ${place > 0 && html`<${Border} key=${`border${place}`} direction="column" move=${(share) => setColumns(moved(columns, place - 1, share))} />`}
      <div class="column" key=${place} style=${{ flex: `${column.share} 1 0` }}>
        ${column.tiles.map((tile, row) => html`
          ${row > 0 && html`<${Border} key=${`border${row}`} direction="row" move=${(share) => setTiles(place, moved(column.tiles, row - 1, share))} />`}
          <div class="cell" key=${row} style=${{ flex: `${tile.share} 1 0` }}>
            <${Tile} tile=${tile} number=${all.slice(0, all.indexOf(tile) + 1).filter(({ panel }) => panel === tile.panel).length} panels=${panels}
              change=${(tile) => setTiles(place, column.tiles.map((other, own) => (own === row ? tile : other)))}
              close=${only ? undefined : () => setTiles(place, column.tiles.filter((_, own) => own !== row))}
              split=${(where) => {
                const fresh = { panel: "plot", share: 1, options: {} };
                if (where === "below") setTiles(place, column.tiles.toSpliced(row + 1, 0, fresh));
                else setColumns(columns.toSpliced(place + 1, 0, { share: 1, tiles: [fresh] }));
              }} />
          </div>`)}
      </div>`)}
  </main>`;
}

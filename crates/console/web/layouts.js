// Layouts of panels. A layout is columns of tiles, each with a share of the available space:
// `{ title, columns: [{ share, tiles: [{ panel, share, options }] }] }`.

const tile = (panel, share = 1, options = {}) => ({ panel, share, options });
const column = (share, ...tiles) => ({ share, tiles });

/** The built-in layouts. */
export const BUILT_IN = {
  overview: { title: "Overview", columns: [column(3, tile("map")), column(2, tile("overview", 3), tile("log", 2))] },
  inspect: { title: "Inspect", columns: [column(3, tile("tree")), column(2, tile("inspector"))] },
  parameters: { title: "Parameters", columns: [column(3, tile("parameters")), column(2, tile("map", 3), tile("plot", 2))] },
  plots: { title: "Plots", columns: [column(3, tile("plot"), tile("plot", 1, { series: [] })), column(2, tile("states"))] },
  mapek: { title: "MAPE-K", columns: [column(1, tile("mapek"))] },
  mission: { title: "Mission", columns: [column(5, tile("mission")), column(3, tile("map", 3), tile("log", 2))] },
  graph: { title: "Graph", columns: [column(1, tile("graph"))] },
  timing: { title: "Timing", columns: [column(1, tile("timing"))] },
  log: { title: "Log", columns: [column(1, tile("log"))] },
  images: { title: "Images", columns: [column(1, tile("image"))] },
  drive: { title: "Drive", columns: [column(3, tile("map")), column(2, tile("drive", 3), tile("overview", 2))] },
};

/** A copy that may be changed. */
export const copy = (layout) => structuredClone(layout);

/** A layout with one more panel: below the last one, or beside a single one. Numbers are added to an existing plot. */
export function withPanel(layout, panel, options) {
  const { columns } = layout;
  const plot = panel === "plot" && options.series && columns.flatMap(({ tiles }) => tiles).find((tile) => tile.panel === panel && tile.options?.series);
  const map = (change) => ({ ...layout, columns: columns.map(change) });
  if (plot) {
    const joined = { ...plot, options: { ...plot.options, series: [...new Set([...plot.options.series, ...options.series])] } };
    return map((column) => ({ ...column, tiles: column.tiles.map((tile) => (tile === plot ? joined : tile)) }));
  }
  const fresh = tile(panel, 1, options);
  if (columns.length === 1) return { ...layout, columns: [...columns, column(columns[0].share, fresh)] };
  return map((own, place) => (place === columns.length - 1 ? { ...own, tiles: [...own.tiles, fresh] } : own));
}

/** The file name of a layout by its title, which no layout of another title has. */
export function nameOf(title, known) {
  const plain = title.normalize("NFD").replace(/\p{M}/gu, "").toLowerCase();
  const stem = plain.replace(/[^a-z0-9]+/g, "-").slice(0, 56).replace(/^-|-$/g, "") || "layout";
  const isFree = (name) => !Object.hasOwn(known, name) || String(known[name]?.title).toLowerCase() === title.toLowerCase();
  for (let number = 1; ; number += 1) {
    const name = number === 1 ? stem : `${stem}-${number}`;
    if (isFree(name)) return name;
  }
}

/** A layout as text for the fragment of a link. */
export const write = (layout) => btoa(unescape(encodeURIComponent(JSON.stringify(layout)))).replaceAll("+", "-").replaceAll("/", "_");

/** The layout of such a text; nothing if it is invalid. */
export function read(text) {
  try {
    const layout = JSON.parse(decodeURIComponent(escape(atob(text.replaceAll("-", "+").replaceAll("_", "/")))));
    return isFit(layout) ? layout : null;
  } catch {
    return null;
  }
}

/** Whether a value from outside is a valid layout. */
export const isFit = (layout) =>
  typeof layout?.title === "string" &&
  Array.isArray(layout.columns) &&
  layout.columns.length > 0 &&
  layout.columns.every(
    ({ share, tiles }) => share > 0 && Array.isArray(tiles) && tiles.length > 0 && tiles.every((tile) => typeof tile?.panel === "string" && tile.share > 0),
  );

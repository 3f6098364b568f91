// Images as the robot sees them, and upon them what its modules have found.
import { Empty, html, leaves, part, source, useAgent, useEffect, useInterfaces, useMemo, useProperties, useReadings, useRef, useSize, useState } from "/slate.js";

// What an item that was found is called, if it says so.
const NAMES = ["name", "label", "class", "id"];

const isPixel = (schema) => schema?.["x-unit"] === "px";

/** How things that were found lie in a value: a list of them behind a pointer, or the value itself; nothing when it has no place in pixels. */
function places(schema) {
  const of = (item) => isPixel(item?.properties?.x) && isPixel(item.properties.y);
  if (of(schema)) return { pointer: null };
  const list = leaves(schema).find(({ type, schema: part }) => type === "array" && of(part.items));
  return list ? { pointer: list.pointer } : null;
}

/** One thing, drawn by what it says: a box of its width and height, a circle of its radius or its pixels, else a cross. */
function Found({ item, words, place, scale }) {
  const { x, y, width, height, radius, pixels } = item;
  if (![x, y].every(Number.isFinite) || pixels === 0) return null;
  const round = radius ?? (pixels > 0 ? Math.sqrt(pixels / Math.PI) : undefined);
  const shape = width > 0 && height > 0
    ? html`<rect x=${x - width / 2} y=${y - height / 2} width=${width} height=${height} />`
    : round > 0 ? html`<circle cx=${x} cy=${y} r=${round} />` : html`<path d=${`M${x - 8 / scale} ${y}h${16 / scale}M${x} ${y - 8 / scale}v${16 / scale}`} />`;
  const top = y - (height > 0 ? height / 2 : (round ?? 8 / scale));
  return html`<g class="found" data-place=${place}>${shape}${shape && html`<text x=${x} y=${Math.max(14 / scale, top - 5 / scale)} style=${{ fontSize: `${13 / scale}px`, strokeWidth: `${3 / scale}px` }}>${words}</text>`}</g>`;
}

function Overlay({ paths, kinds, size, room, rate }) {
  // As often as pictures come, so that neither runs ahead.
  const readings = useReadings(paths, rate);
  const scale = room ? Math.min(room.width / size.width, room.height / size.height) || 1 : 1;
  const items = paths.flatMap((path, place) => {
    const value = readings[path]?.value;
    const pointer = kinds.get(path).pointer;
    const list = value === undefined ? [] : pointer === null ? [value] : part(value, pointer);
    return list.map((item) => {
      const name = NAMES.map((field) => item[field]).find((text) => text !== undefined && text !== "");
      return { item, place, words: name ?? path.split("/").slice(-2)[0] };
    });
  });
  return html`<svg class="overlay" viewBox=${`0 0 ${size.width} ${size.height}`} preserveAspectRatio="xMidYMid meet" role="img"
    aria-label=${items.map(({ words, item }) => `${words} at ${Math.round(item.x)}, ${Math.round(item.y)}`).join("; ") || "Nothing found"}>
    ${items.map(({ item, place, words }, number) => html`<${Found} key=${number} item=${item} place=${place % 6} words=${words} scale=${scale} />`)}</svg>`;
}

/** What an image shows now, and goes on showing. */
function frozen(image) {
  if (!image?.naturalWidth) return null;
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [image.naturalWidth, image.naturalHeight];
  canvas.getContext("2d").drawImage(image, 0, 0);
  return canvas.toDataURL();
}

function Panel({ options, setOptions }) {
  const agent = useAgent();
  const properties = useProperties();
  const interfaces = useInterfaces();
  const images = properties.filter(({ interface: name }) => name === "Image").map(({ path }) => path);
  const kinds = useMemo(() => new Map(properties.filter(({ access }) => access === "output").map(({ path, interface: name }) => [path, places(interfaces[name])]).filter(([, kind]) => kind)), [properties, interfaces]);
  const [still, setStill] = useState(null);
  const [size, setSize] = useState(null);
  const [pixel, setPixel] = useState(null);
  const [failed, setFailed] = useState(false);
  const picture = useRef(null);
  const [frame, room] = useSize();
  const path = images.includes(options.path) ? options.path : images[0];
  const hidden = options.hidden ?? [];
  const shown = [...kinds.keys()].filter((path) => !hidden.includes(path));
  const rate = options.rate ?? 10;
  // A stream of pictures tells once that it has begun, and not of what size; and it ends with the agent.
  useEffect(() => {
    const timer = setInterval(() => {
      const { naturalWidth: width, naturalHeight: height } = picture.current ?? {};
      if (width > 0) setSize((before) => (before?.width === width && before.height === height ? before : { width, height }));
    }, 200);
    return () => clearInterval(timer);
  }, []);
  useEffect(() => {
    if (!failed) return undefined;
    const timer = setTimeout(() => setFailed(false), 1000);
    return () => clearTimeout(timer);
  }, [failed]);
  if (!images.length) return html`<${Empty}>No module of this agent writes an image.</${Empty}>`;
  // Where a pointer is in the picture, which stands in the middle of its box.
  const point = (event) => {
    const { left, top, width, height } = picture.current.getBoundingClientRect();
    const scale = Math.min(width / size.width, height / size.height);
    const [x, y] = [(event.clientX - left - width / 2) / scale + size.width / 2, (event.clientY - top - height / 2) / scale + size.height / 2];
    setPixel(x >= 0 && y >= 0 && x < size.width && y < size.height ? [Math.floor(x), Math.floor(y)] : null);
  };
  const toggle = (path) => setOptions({ hidden: hidden.includes(path) ? hidden.filter((other) => other !== path) : [...hidden, path] });
  return html`
    <div class="bar-of-tools">
      <select aria-label="Which image" value=${path} onChange=${(event) => setOptions({ path: event.target.value })}>${images.map((path) => html`<option key=${path} value=${path}>${path}</option>`)}</select>
      <select aria-label="Rate" value=${rate} onChange=${(event) => setOptions({ rate: Number(event.target.value) })}>${[1, 5, 10, 20].map((rate) => html`<option key=${rate} value=${rate}>${rate} Hz</option>`)}</select>
      <button class="tool" aria-pressed=${still !== null} onClick=${() => setStill(still ? null : frozen(picture.current))}>${still ? "Go on" : "Hold"}</button>
      <a download=${`${path.replaceAll("/", "-")}.png`} href=${source(agent?.name ?? "", path, { format: "png" })}>Save as PNG</a>
      <span class="grow"></span>
      <span class="muted number">${pixel ? `${pixel[0]}, ${pixel[1]} px` : size ? `${size.width} × ${size.height}` : ""}</span>
      ${kinds.size > 0 && html`<details class="menu"><summary>Overlays</summary><div>
        ${[...kinds.keys()].map((path) => html`<label key=${path}><input type="checkbox" checked=${!hidden.includes(path)} onChange=${() => toggle(path)} /> ${path}</label>`)}</div></details>`}
    </div>
    <div class="picture">${agent && !failed && html`<div class="frame" ref=${frame} onPointerMove=${(event) => size && point(event)} onPointerLeave=${() => setPixel(null)}>
      <img ref=${picture} alt=${`What is at ${path}`} src=${still ?? source(agent.name, path, { format: "mjpeg", rate })} onError=${() => setFailed(true)} />
      ${size && shown.length > 0 && !still && html`<${Overlay} paths=${shown} kinds=${kinds} size=${size} room=${room} rate=${rate} />`}</div>`}
      ${failed && html`<${Empty}>No picture yet.</${Empty}>`}</div>`;
}

export default { id: "image", title: "Image", Panel };

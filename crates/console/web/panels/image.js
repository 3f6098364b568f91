// Images, with detections of modules as overlays.
import { Empty, html, leaves, Menu, part, source, useAgent, useEffect, useInterfaces, useMemo, useProperties, useRef, useSize, useState, watch } from "/slate.js";
import { video } from "/video.js";

// Fields that name a detection.
const NAMES = ["name", "label", "class", "id"];

// Number of readings kept to find the one of an image.
const KEPT = 50;

const isPixel = (schema) => schema?.["x-unit"] === "px";

/** Where detections are in a value: a list behind a pointer, or the value itself; null without coordinates in pixels. */
function places(schema) {
  const of = (item) => isPixel(item?.properties?.x) && isPixel(item.properties.y);
  if (of(schema)) return { pointer: null };
  const list = leaves(schema).find(({ type, schema: part }) => type === "array" && of(part.items));
  return list ? { pointer: list.pointer } : null;
}

/** A detection: a box by width and height, a circle by radius or area, else a cross. */
function Found({ item, words, place, scale }) {
  const { x, y, width, height, radius, pixels } = item;
  if (![x, y].every(Number.isFinite) || pixels === 0) return null;
  const round = radius ?? (pixels > 0 ? Math.sqrt(pixels / Math.PI) : undefined);
  const shape = width > 0 && height > 0
    ? html`<rect x=${x - width / 2} y=${y - height / 2} width=${width} height=${height} />`
    : round > 0 ? html`<circle cx=${x} cy=${y} r=${round} />` : html`<path d=${`M${x - 8 / scale} ${y}h${16 / scale}M${x} ${y - 8 / scale}v${16 / scale}`} />`;
  const top = y - (height > 0 ? height / 2 : (round ?? 8 / scale));
  return html`<g class="found" data-place=${place}>${shape}<text x=${x} y=${Math.max(14 / scale, top - 5 / scale)} style=${{ fontSize: `${13 / scale}px`, strokeWidth: `${3 / scale}px` }}>${words}</text></g>`;
}

/** Detections of an image: of each property the value at the time of the image. */
function Overlay({ paths, kinds, size, room, time, readings }) {
  const scale = room ? Math.min(room.width / size.width, room.height / size.height) || 1 : 1;
  const items = paths.flatMap((path, place) => {
    const kept = readings.get(path) ?? [];
    const nearest = kept.reduce((best, one) => (!best || Math.abs(one.time - time) <= Math.abs(best.time - time) ? one : best), null);
    const pointer = kinds.get(path).pointer;
    const list = nearest === null ? [] : pointer === null ? [nearest.value] : part(nearest.value, pointer);
    return list.map((item) => {
      const name = NAMES.map((field) => item[field]).find((text) => text !== undefined && text !== "");
      return { item, place, words: name ?? path.split("/").slice(-2)[0] };
    });
  });
  return html`<svg class="overlay" viewBox=${`0 0 ${size.width} ${size.height}`} preserveAspectRatio="xMidYMid meet" role="img"
    aria-label=${items.map(({ words, item }) => `${words} at ${Math.round(item.x)}, ${Math.round(item.y)}`).join("; ") || "No detections"}>
    ${items.map(({ item, place, words }, number) => html`<${Found} key=${number} item=${item} place=${place % 6} words=${words} scale=${scale} />`)}</svg>`;
}

function Panel({ options, setOptions }) {
  const agent = useAgent();
  const properties = useProperties();
  const interfaces = useInterfaces();
  const images = properties.filter(({ interface: name }) => name === "Image").map(({ path }) => path);
  const kinds = useMemo(() => new Map(properties.filter(({ access }) => access === "output").map(({ path, interface: name }) => [path, places(interfaces[name])]).filter(([, kind]) => kind)), [properties, interfaces]);
  const [shown, setShown] = useState(null);
  const [held, setHeld] = useState(false);
  const [pixel, setPixel] = useState(null);
  const [, redraw] = useState(0);
  const canvas = useRef(null);
  const readings = useRef(new Map()).current;
  const isHeld = useRef(false);
  isHeld.current = held;
  const [frame, room] = useSize();
  const path = images.includes(options.path) ? options.path : images[0];
  const rate = options.rate ?? 10;
  const overlays = [...kinds.keys()].filter((path) => !(options.hidden ?? []).includes(path));

  useEffect(() => {
    if (!agent?.name || !path) return undefined;
    const show = ({ bitmap, time }) => {
      if (isHeld.current || !canvas.current) return bitmap.close();
      const { width, height } = bitmap;
      if (canvas.current.width !== width || canvas.current.height !== height) Object.assign(canvas.current, { width, height });
      canvas.current.getContext("2d").drawImage(bitmap, 0, 0);
      bitmap.close();
      return setShown({ width, height, time });
    };
    return video(agent.name, path, rate, show, () => isHeld.current || setShown(null));
  }, [agent?.name, path, rate]);
  useEffect(() => {
    readings.clear();
    const ends = overlays.map((path) => watch(path, (reading) => {
      if (isHeld.current) return;
      readings.set(path, [...(readings.get(path) ?? []), reading].slice(-KEPT));
      redraw((count) => count + 1);
    }, { rate: 50 }));
    return () => ends.forEach((end) => end());
  }, [overlays.join(" ")]);

  if (!images.length) return html`<${Empty}>No module of this agent publishes an image.</${Empty}>`;
  // The pixel under the pointer; the image is centered in its box.
  const point = (event) => {
    const { left, top, width, height } = canvas.current.getBoundingClientRect();
    const scale = Math.min(width / shown.width, height / shown.height);
    const [x, y] = [(event.clientX - left - width / 2) / scale + shown.width / 2, (event.clientY - top - height / 2) / scale + shown.height / 2];
    setPixel(x >= 0 && y >= 0 && x < shown.width && y < shown.height ? [Math.floor(x), Math.floor(y)] : null);
  };
  const toggle = (path) => setOptions({ hidden: overlays.includes(path) ? [...(options.hidden ?? []), path] : options.hidden.filter((other) => other !== path) });
  return html`
    <div class="bar-of-tools">
      <select aria-label="Image" value=${path} onChange=${(event) => setOptions({ path: event.target.value })}>${images.map((path) => html`<option key=${path} value=${path}>${path}</option>`)}</select>
      <select aria-label="Rate" value=${rate} onChange=${(event) => setOptions({ rate: Number(event.target.value) })}>${[1, 5, 10, 20].map((rate) => html`<option key=${rate} value=${rate}>${rate} Hz</option>`)}</select>
      <button class="tool" aria-pressed=${held} disabled=${!shown} onClick=${() => setHeld(!held)}>${held ? "Resume" : "Hold"}</button>
      <a download=${`${path.replaceAll("/", "-")}.png`} href=${source(agent?.name ?? "", path, { format: "png" })}>Save as PNG</a>
      <span class="grow"></span>
      <span class="muted number">${pixel ? `${pixel[0]}, ${pixel[1]} px` : shown ? `${shown.width} × ${shown.height}` : ""}</span>
      ${kinds.size > 0 && html`<${Menu} title="Overlays">
        ${[...kinds.keys()].map((path) => html`<label key=${path}><input type="checkbox" checked=${overlays.includes(path)} onChange=${() => toggle(path)} /> ${path}</label>`)}</${Menu}>`}
    </div>
    <div class="picture"><div class="frame" ref=${frame} onPointerMove=${(event) => shown && point(event)} onPointerLeave=${() => setPixel(null)}>
      <canvas ref=${canvas} role="img" aria-label=${`Image ${path}`} hidden=${!shown}></canvas>
      ${shown && overlays.length > 0 && html`<${Overlay} paths=${overlays} kinds=${kinds} size=${shown} time=${shown.time} readings=${readings} room=${room} />`}
      ${!shown && html`<${Empty}>No image yet.</${Empty}>`}</div></div>`;
}

export default { id: "image", title: "Image", Panel };

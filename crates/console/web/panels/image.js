// Images as the robot sees them.
import { Empty, html, source, useAgent, useProperties, useState } from "/slate.js";

function Panel({ options, setOptions }) {
  const agent = useAgent();
  const images = useProperties().filter(({ interface: name }) => name === "Image").map(({ path }) => path);
  const [still, setStill] = useState(null);
  const path = images.includes(options.path) ? options.path : images[0];
  if (!images.length) return html`<${Empty}>No module of this agent writes an image.</${Empty}>`;
  const rate = options.rate ?? 10;
  return html`
    <div class="bar-of-tools">
      <select aria-label="Which image" value=${path} onChange=${(event) => setOptions({ path: event.target.value })}>${images.map((path) => html`<option key=${path}>${path}</option>`)}</select>
      <select aria-label="Rate" value=${rate} onChange=${(event) => setOptions({ rate: Number(event.target.value) })}>${[1, 5, 10, 20].map((rate) => html`<option key=${rate} value=${rate}>${rate} Hz</option>`)}</select>
      <button class="tool" aria-pressed=${still !== null} onClick=${() => setStill(still ? null : source(agent.name, path, { format: "png" }))}>${still ? "Go on" : "Hold"}</button>
      <a download=${`${path.replaceAll("/", "-")}.png`} href=${source(agent?.name ?? "", path, { format: "png" })}>Save as PNG</a>
    </div>
    <div class="picture">${agent && html`<img alt=${`What is at ${path}`} src=${still ?? source(agent.name, path, { format: "mjpeg", rate })} />`}</div>`;
}

export default { id: "image", title: "Image", Panel };

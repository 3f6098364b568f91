// Streams of images, each with its time, so that detections are drawn on their own image.
import { at, Problem, request } from "/api.js";

const AGAIN = 1000;
const LONGEST_HEAD = 1024;

const find = (bytes, text) => {
  const wanted = [...text].map((letter) => letter.charCodeAt(0));
  for (let place = bytes.indexOf(wanted[0]); place >= 0; place = bytes.indexOf(wanted[0], place + 1)) {
    if (wanted.every((byte, own) => bytes[place + own] === byte)) return place;
  }
  return -1;
};

/** Splits a multipart stream: calls `take` with the `time`, ns, and the bytes of each part. */
async function parts(body, take) {
  const reader = body.getReader();
  let bytes = new Uint8Array(0);
  for (;;) {
    const end = find(bytes.subarray(0, LONGEST_HEAD), "\r\n\r\n");
    const head = end < 0 ? "" : new TextDecoder().decode(bytes.subarray(0, end));
    const length = Number(/^content-length: *(\d+)/im.exec(head)?.[1] ?? NaN);
    if (end >= 0 && !(length >= 0)) throw new Error(`a picture without a length: ${head}`);
    if (end >= 0 && bytes.length >= end + 4 + length + 2) {
      const time = Number(/^slate-time: *(\d+)/im.exec(head)?.[1] ?? NaN);
      await take(time, bytes.subarray(end + 4, end + 4 + length));
      bytes = bytes.slice(end + 4 + length + 2);
      continue;
    }
    const { value, done } = await reader.read();
    if (done) return;
    const joined = new Uint8Array(bytes.length + value.length);
    joined.set(bytes);
    joined.set(value, bytes.length);
    bytes = joined;
  }
}

/** Calls a function with each image `{ bitmap, time }` of a property, and another one without an image; returns a function that ends this. */
export function video(agent, path, rate, show, fail) {
  const ended = new AbortController();
  const run = async () => {
    while (!ended.signal.aborted) {
      try {
        const response = await request("GET", `${at(agent, path)}?format=mjpeg&rate=${rate}`, { signal: ended.signal });
        await parts(response.body, async (time, jpeg) => {
          const bitmap = await createImageBitmap(new Blob([jpeg], { type: "image/jpeg" }));
          if (!ended.signal.aborted) show({ bitmap, time });
        });
      } catch (error) {
        if (ended.signal.aborted) return;
        if (!(error instanceof Problem)) console.warn(error);
      }
      if (!ended.signal.aborted) fail();
      await new Promise((resolve) => setTimeout(resolve, AGAIN));
    }
  };
  run();
  return () => ended.abort();
}

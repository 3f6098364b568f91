// In which frames a client is told values, and where these are. Arguments: address, token, the topics whose frames are wanted. Prints
// one line of JSON: the frames of these topics, and all transforms.
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader } = require("@foxglove/rosmsg2-serialization");
const WebSocket = require("ws");

const [address, token, ...topics] = process.argv.slice(2);
const client = new FoxgloveClient({ ws: new WebSocket(`ws://${address}/?token=${token}`, ["foxglove.websocket.v1"]) });
const channels = new Map();
const subscribed = new Map();
const result = { frames: {}, "/tf": [], "/tf_static": [] };

client.on("error", (error) => { console.error(error); process.exit(3); });
client.on("advertise", (all) => all.forEach((channel) => channels.set(channel.topic, channel)));
client.on("message", ({ subscriptionId, data, timestamp }) => {
  const { topic, reader } = subscribed.get(subscriptionId);
  const value = reader.readMessage(data);
  if (value.transforms === undefined) result.frames[topic] = [value.header.frame_id, value.child_frame_id ?? ""];
  else {
    result[topic].push(...value.transforms.map(({ header, child_frame_id: child, transform }) => ({
      time: Number(header.stamp.sec) + header.stamp.nanosec * 1e-9, told: Number(timestamp) * 1e-9,
      parent: header.frame_id, child, x: transform.translation.x, y: transform.translation.y,
    })));
  }
});

async function main() {
  const until = async (what, holds) => {
    for (let i = 0; i < 500; i++) {
      if (holds()) return;
      await new Promise((resolve) => setTimeout(resolve, 20));
    }
    console.error(`${what}: not within 10 s; there are ${[...channels.keys()]}, and came ${JSON.stringify(result).slice(0, 2000)}`);
    process.exit(4);
  };
  const wanted = ["/tf", "/tf_static", ...topics];
  await until("the channels", () => wanted.every((topic) => channels.has(topic)));
  for (const topic of wanted) {
    const channel = channels.get(topic);
    const reader = new MessageReader(parse(channel.schema, { ros2: true }));
    subscribed.set(client.subscribe(channel.id), { topic, reader });
  }
  await until("values", () => result["/tf"].length > 60 && result["/tf_static"].length > 0 && Object.keys(result.frames).length === topics.length);
  console.log(JSON.stringify(result));
  client.close();
}

main().catch((error) => { console.error(error); process.exit(2); });

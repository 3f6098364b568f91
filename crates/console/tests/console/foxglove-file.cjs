// Reads a recording as Foxglove does: by its index, in the order of time, each message by its schema. Prints what there is.
const fs = require("fs");
const { McapIndexedReader } = require("@mcap/core");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader } = require("@foxglove/rosmsg2-serialization");

async function main() {
  const file = fs.readFileSync(process.argv[2]);
  const readable = {
    size: async () => BigInt(file.length),
    read: async (offset, length) => new Uint8Array(file.subarray(Number(offset), Number(offset + length))),
  };
  const reader = await McapIndexedReader.Initialize({ readable });
  const readers = new Map();
  const topics = {};
  let last = 0n;
  let isOrdered = true;
  for await (const message of reader.readMessages()) {
    isOrdered &&= message.logTime >= last;
    last = message.logTime;
    const channel = reader.channelsById.get(message.channelId);
    const schema = reader.schemasById.get(channel.schemaId);
    if (!readers.has(schema.id)) {
      readers.set(schema.id, new MessageReader(parse(Buffer.from(schema.data).toString(), { ros2: true })));
    }
    const value = readers.get(schema.id).readMessage(message.data);
    const topic = (topics[channel.topic] ??= { schema: schema.name, count: 0, value: null });
    topic.count += 1;
    topic.value = value;
  }
  const metadata = [];
  for await (const record of reader.readMetadata()) {
    metadata.push(record.name);
  }
  const attachments = [];
  for await (const attachment of reader.readAttachments()) {
    attachments.push(attachment.name);
  }
  const text = (_, value) => (typeof value === "bigint" ? Number(value) : value);
  console.log(JSON.stringify({ isOrdered, topics, metadata, attachments }, text));
}

main().catch((error) => {
  console.error(error);
  process.exit(1);
});

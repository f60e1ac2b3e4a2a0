// Reads an MCAP file with @mcap/core in both of its ways and prints what it found as JSON.
// usage: node read.mjs FILE
import { createHash } from "node:crypto";
import { open, readFile } from "node:fs/promises";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { decompress } from "fzstd";

const decompressHandlers = { zstd: (data, size) => decompress(data, new Uint8Array(Number(size))) };

async function indexed(path) {
  const file = await open(path);
  const readable = {
    size: async () => BigInt((await file.stat()).size),
    read: async (offset, length) => {
      const data = new Uint8Array(Number(length));
      await file.read(data, 0, data.length, Number(offset));
      return data;
    },
  };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  const topics = {};
  let order = 0n;
  for await (const message of reader.readMessages()) {
    if (message.logTime < order) throw new Error("messages are not in the order of their times");
    order = message.logTime;
    const { topic } = reader.channelsById.get(message.channelId);
    topics[topic] ??= { messages: 0, first: String(message.logTime), sha256: createHash("sha256") };
    topics[topic].messages += 1;
    topics[topic].last = String(message.logTime);
    topics[topic].sha256.update(message.data);
  }
  for (const each of Object.values(topics)) each.sha256 = each.sha256.digest("hex");
  const metadata = [];
  for await (const each of reader.readMetadata()) {
    metadata.push({ name: each.name, entries: Object.fromEntries(each.metadata) });
  }
  await file.close();
  const channels = [...reader.channelsById.values()].map((channel) => ({
    topic: channel.topic,
    encoding: channel.messageEncoding,
    metadata: Object.fromEntries(channel.metadata),
    schema: reader.schemasById.get(channel.schemaId).name,
    schemaEncoding: reader.schemasById.get(channel.schemaId).encoding,
  }));
  const { profile } = reader.header;
  const { messageCount, chunkCount } = reader.statistics;
  return { profile, messageCount: String(messageCount), chunkCount, channels, topics, metadata };
}

async function streamed(path) {
  const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  reader.append(await readFile(path));
  let messages = 0;
  for (let record; (record = reader.nextRecord()); ) messages += record.type === "Message";
  if (!reader.done()) throw new Error("the file does not end where it should");
  return messages;
}

const path = process.argv[2];
console.log(JSON.stringify({ ...(await indexed(path)), streamed: await streamed(path) }));

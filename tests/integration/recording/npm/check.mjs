// Reads a recording with the official readers of MCAP and OMG IDL and compares every message with what
// `fulcrum log cat --full` says.
//
//   node check.mjs FULCRUM RECORDING
import { spawn } from "node:child_process";
import { open } from "node:fs/promises";
import { createInterface } from "node:readline";
import { parseIDL } from "@foxglove/omgidl-parser";
import { MessageReader } from "@foxglove/omgidl-serialization";
import zstd from "@foxglove/wasm-zstd";
import { McapIndexedReader } from "@mcap/core";

const [fulcrum, recording] = process.argv.slice(2);

/** Names that IDL forbids or that differ for another reason: theirs to ours. */
const kOurName = { number: "sequence" };

/** What our tool says, by channel and sequence. */
async function ourMessages() {
  const messages = new Map();
  const cat = spawn(fulcrum, ["log", "cat", "--full", recording], { stdio: ["ignore", "pipe", "inherit"] });
  for await (const line of createInterface({ input: cat.stdout })) {
    // A number of 64 bits is more than JSON.parse keeps.
    const { channel, sequence, ...rest } = JSON.parse(line.replace(/([:,[])(-?\d{16,})(?=[,}\]])/g, '$1"$2"'));
    messages.set(`${channel}/${sequence}`, rest);
  }
  return messages;
}

/** Path of the first difference; undefined when there is none. */
function difference(ours, theirs, path) {
  if (typeof theirs === "bigint") {
    return BigInt(ours) === theirs ? undefined : path;
  }
  if (typeof theirs === "number") {
    const same = Number.isFinite(theirs) ? ours === theirs || Math.fround(ours) === theirs : ours === null;
    return same ? undefined : path;
  }
  if (Array.isArray(theirs) || ArrayBuffer.isView(theirs)) {
    if (ours.length !== theirs.length) {
      return `${path}.length`;
    }
    for (let i = 0; i < ours.length; ++i) {
      const found = difference(ours[i], theirs[i], `${path}[${i}]`);
      if (found) {
        return found;
      }
    }
    return undefined;
  }
  if (typeof theirs === "object") {
    // The session's number, a secret of the bus, is printed nowhere.
    const names = Object.keys(theirs).filter((name) => !(name === "session" && path.endsWith(".stamp")));
    if (names.length !== Object.keys(ours).length) {
      return `${path}: number of fields`;
    }
    for (const name of names) {
      const ourName = kOurName[name] ?? name;
      if (!(ourName in ours)) {
        return `${path}.${ourName}: missing`;
      }
      const found = difference(ours[ourName], theirs[name], `${path}.${ourName}`);
      if (found) {
        return found;
      }
    }
    return undefined;
  }
  return ours === theirs ? undefined : path;
}

/** Words of the frame before, by channel. */
const lastWords = new Map();

/** The TissueFrame in a RecordedTissueFrame, decoded as services/records/recording/point_coding.h says. */
function frameOf({ header, kind, block_count: blocks, residuals }, channel) {
  const count = 192 * blocks;
  const last = kind === 0 ? new Int32Array(count) : lastWords.get(channel);
  const words = new Int32Array(count);
  for (let i = 0; i < count; ++i) {
    let zigzag = 0;
    for (let plane = 0; plane * count < residuals.length; ++plane) {
      zigzag |= residuals[plane * count + i] << (8 * plane);
    }
    const neighbour = kind !== 1 && i >= 3 ? words[i - 3] - last[i - 3] : 0;
    words[i] = ((zigzag >>> 1) ^ -(zigzag & 1)) + neighbour + last[i];
  }
  lastWords.set(channel, words);
  if (kind > 2) {
    throw new Error(`a frame of kind ${kind}`);
  }
  const xyz = Float32Array.from(words.subarray(0, 3 * header.vertex_count), (word) => 5e-6 * word);
  return { header, xyz };
}

const ours = await ourMessages();
await zstd.isLoaded;
const file = await open(recording);
const reader = await McapIndexedReader.Initialize({
  readable: {
    size: async () => BigInt((await file.stat()).size),
    read: async (offset, size) => {
      const bytes = new Uint8Array(Number(size));
      await file.read(bytes, 0, bytes.length, Number(offset));
      return bytes;
    },
  },
  decompressHandlers: { zstd: (bytes, size) => zstd.decompress(bytes, Number(size)) },
});
const decoders = new Map();
for (const [id, schema] of reader.schemasById) {
  if (schema.encoding !== "omgidl") {
    throw new Error(`${schema.name}: schema encoding ${schema.encoding}`);
  }
  decoders.set(id, new MessageReader(schema.name, parseIDL(new TextDecoder().decode(schema.data))));
}

const counts = new Map();
for await (const message of reader.readMessages({ validateCrcs: true })) {
  const channel = reader.channelsById.get(message.channelId);
  const read = decoders.get(channel.schemaId).readMessage(message.data);
  const theirs = channel.topic === "fulcrum/TissueFrame" ? frameOf(read, message.channelId) : read;
  const our = ours.get(`${message.channelId}/${message.sequence}`);
  const found =
    our === undefined ? "missing in fulcrum log cat" : difference(our.message, theirs, channel.topic.replace("fulcrum/", ""));
  if (found || BigInt(our.log_time_ns) !== message.logTime || BigInt(our.publish_time_ns) !== message.publishTime) {
    throw new Error(`${channel.topic} ${message.sequence}: ${found ?? "times"}`);
  }
  counts.set(channel.topic, (counts.get(channel.topic) ?? 0) + 1);
}
await file.close();

const all = [...counts.values()].reduce((sum, count) => sum + count, 0);
for (const [topic, count] of [...counts].sort()) {
  console.log(`${topic}: ${count}`);
}
if (all !== ours.size || all === 0) {
  throw new Error(`${all} messages read here, ${ours.size} by fulcrum log cat`);
}
console.log(`${all} messages are the same for both`);

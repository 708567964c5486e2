import { isTcp, type Frame } from "./frame";

/**
 * Frames as a capture file: pcapng (IETF draft-ietf-opsawg-pcapng), little endian, time in ns.
 *
 * Modbus TCP is put into IPv4 and TCP packets at port 502 (link type 101), so that it is decoded at once. What went over a serial line is kept
 * as it was, checksum included, as RTAC serial captures (link type 250).
 */
const RAW_IP = 101;
const RTAC_SERIAL = 250;
const PORT = 502;
const FIRST_CLIENT_PORT = 50_000;
const SERVER = [127, 0, 0, 1];
const CLIENT = [127, 0, 0, 2];
const TCP_HEADERS = 40;
const RTAC_HEADER = 12;
/** Of an RTAC capture: data from the master, and from the slave. */
const TRANSMITTED = 0x01;
const RECEIVED = 0x02;

export function pcapngOf(frames: readonly Frame[]): Uint8Array {
  const streams = new Map<string, Stream>();
  const blocks = [sectionHeader(), description(RAW_IP, "Modbus TCP"), description(RTAC_SERIAL, "serial lines")];
  for (const frame of frames) {
    if (!frame.data.length) continue;
    if (!isTcp(frame.data)) {
      blocks.push(packet(1, frame.time_ns, rtac(frame)));
      continue;
    }
    const client = `${frame.line}/${frame.client}`;
    let stream = streams.get(client);
    if (stream === undefined) streams.set(client, (stream = { port: FIRST_CLIENT_PORT + streams.size, in: 1, out: 1 }));
    blocks.push(packet(0, frame.time_ns, tcp(frame, stream)));
  }
  return joined(blocks);
}

interface Stream {
  port: number;
  /** Sequence numbers of both directions. */
  in: number;
  out: number;
}

function joined(parts: readonly Uint8Array[]): Uint8Array {
  const whole = new Uint8Array(parts.reduce((sum, { length }) => sum + length, 0));
  let at = 0;
  for (const part of parts) {
    whole.set(part, at);
    at += part.length;
  }
  return whole;
}

/** A block: its type and its length around a body that is filled up to whole words. */
function block(type: number, body: Uint8Array): Uint8Array {
  const length = 12 + Math.ceil(body.length / 4) * 4;
  const bytes = new Uint8Array(length);
  const view = new DataView(bytes.buffer);
  view.setUint32(0, type, true);
  view.setUint32(4, length, true);
  bytes.set(body, 8);
  view.setUint32(length - 4, length, true);
  return bytes;
}

function sectionHeader(): Uint8Array {
  const body = new DataView(new ArrayBuffer(16));
  body.setUint32(0, 0x1a2b3c4d, true);
  body.setUint16(4, 1, true);
  body.setBigInt64(8, -1n, true);
  return block(0x0a0d0d0a, new Uint8Array(body.buffer));
}

function description(linkType: number, name: string): Uint8Array {
  const text = new TextEncoder().encode(name);
  const padded = Math.ceil(text.length / 4) * 4;
  const body = new DataView(new ArrayBuffer(8 + 4 + padded + 8 + 4));
  body.setUint16(0, linkType, true);
  body.setUint16(8, 2, true); // if_name
  body.setUint16(10, text.length, true);
  new Uint8Array(body.buffer).set(text, 12);
  body.setUint16(12 + padded, 9, true); // if_tsresol: 10⁻⁹ s
  body.setUint16(14 + padded, 1, true);
  body.setUint8(16 + padded, 9);
  return block(1, new Uint8Array(body.buffer));
}

function packet(interfaceNumber: number, time_ns: bigint, data: Uint8Array): Uint8Array {
  const body = new DataView(new ArrayBuffer(20 + Math.ceil(data.length / 4) * 4));
  body.setUint32(0, interfaceNumber, true);
  body.setUint32(4, Number(time_ns >> 32n), true);
  body.setUint32(8, Number(time_ns & 0xffff_ffffn), true);
  body.setUint32(12, data.length, true);
  body.setUint32(16, data.length, true);
  new Uint8Array(body.buffer).set(data, 20);
  return block(6, new Uint8Array(body.buffer));
}

function rtac({ time_ns, direction, data }: Frame): Uint8Array {
  const header = new DataView(new ArrayBuffer(RTAC_HEADER));
  header.setUint32(0, Number(time_ns / 1_000_000_000n));
  header.setUint32(4, Number((time_ns % 1_000_000_000n) / 1000n));
  header.setUint8(8, direction === "in" ? TRANSMITTED : RECEIVED);
  return joined([new Uint8Array(header.buffer), data]);
}

function tcp({ direction, data }: Frame, stream: Stream): Uint8Array {
  const header = new DataView(new ArrayBuffer(TCP_HEADERS));
  const isIn = direction === "in";
  header.setUint8(0, 0x45);
  header.setUint16(2, TCP_HEADERS + data.length);
  header.setUint8(8, 64);
  header.setUint8(9, 6);
  (isIn ? [...CLIENT, ...SERVER] : [...SERVER, ...CLIENT]).forEach((byte, index) => header.setUint8(12 + index, byte));
  header.setUint16(10, ipChecksum(header));
  header.setUint16(20, isIn ? stream.port : PORT);
  header.setUint16(22, isIn ? PORT : stream.port);
  header.setUint32(24, isIn ? stream.in : stream.out);
  header.setUint32(28, isIn ? stream.out : stream.in);
  header.setUint8(32, 0x50);
  header.setUint8(33, 0x18); // PSH, ACK
  header.setUint16(34, 0xffff);
  if (isIn) stream.in += data.length;
  else stream.out += data.length;
  return joined([new Uint8Array(header.buffer), data]);
}

function ipChecksum(header: DataView): number {
  let sum = 0;
  for (let at = 0; at < 20; at += 2) sum += header.getUint16(at);
  while (sum > 0xffff) sum = (sum & 0xffff) + (sum >> 16);
  return ~sum & 0xffff;
}

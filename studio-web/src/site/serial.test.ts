import { expect, test, vi } from "vitest";
import type { ToPort } from "./messages";

const written: number[] = [];
const port = {
  readable: null as unknown,
  writable: null as unknown,
  getInfo: () => ({ usbVendorId: 0x403, usbProductId: 0x6001 }),
  open: async () => {
    port.readable = new ReadableStream();
    port.writable = new WritableStream({ write: (bytes: Uint8Array) => void written.push(...bytes) });
  },
  close: async () => undefined,
};

test("what a page did not send in time is not sent any more, and the line is lost", async () => {
  vi.stubGlobal("navigator", { serial: { requestPort: async () => port } });
  vi.stubGlobal("isSecureContext", true);
  const { SerialPorts } = await import("./serial");
  const told: ToPort[] = [];
  const ports = new SerialPorts((message) => told.push(message));
  expect(SerialPorts.problem).toBeNull();
  expect(await ports.choose()).toEqual({ number: 1, what: "USB 0403:6001" });

  ports.take({ port: 1, open: 9600 });
  await vi.waitFor(() => expect(told).toEqual([{ port: 1, opened: true }]));
  ports.take({ port: 1, write: Uint8Array.of(1), at: Date.now() });
  await vi.waitFor(() => expect(written).toEqual([1]));
  ports.take({ port: 1, write: Uint8Array.of(2), at: Date.now() - 5000 });
  ports.take({ port: 1, write: Uint8Array.of(3), at: Date.now() });
  await vi.waitFor(() => expect(told[1]).toMatchObject({ port: 1, lost: expect.stringContaining("stood still") }));
  expect(written).toEqual([1]);
  vi.unstubAllGlobals();
});

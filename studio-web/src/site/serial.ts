import { t } from "../text";
import type { FromPort, ToPort } from "./messages";

/** What is used of Web Serial, which TypeScript does not know. */
interface Port {
  open(options: { baudRate: number }): Promise<void>;
  close(): Promise<void>;
  getInfo(): { usbVendorId?: number; usbProductId?: number };
  readable: ReadableStream<Uint8Array>;
  writable: WritableStream<Uint8Array>;
}

const serial = (navigator as { serial?: { requestPort(): Promise<Port> } }).serial;

/** What the page did not send in time after the worker has decided it: it was suspended meanwhile (ADR 12). [ms] */
const LATE_MS = 1000;

interface Opened {
  reader: ReadableStreamDefaultReader<Uint8Array>;
  writer: WritableStreamDefaultWriter<Uint8Array>;
}

/** Serial ports that the user has let the page use, each by its number. A worker cannot have them. */
export class SerialPorts {
  private readonly ports: Port[] = [];
  private readonly opened = new Map<number, Opened>();

  constructor(private readonly tell: (message: ToPort) => void) {}

  /** Why there can be none here; null where there can. */
  static get problem(): string | null {
    if (!isSecureContext) return t("serialInsecure");
    return serial === undefined ? t("serialUnknown") : null;
  }

  /** The browser asks the user, on a click only. Gives null where that was cancelled. */
  async choose(): Promise<{ number: number; what: string } | null> {
    let port: Port;
    try {
      port = await (serial as NonNullable<typeof serial>).requestPort();
    } catch (error) {
      if (error instanceof DOMException && error.name === "NotFoundError") return null;
      throw error;
    }
    if (!this.ports.includes(port)) this.ports.push(port);
    const { usbVendorId, usbProductId } = port.getInfo();
    const ids = [usbVendorId, usbProductId].map((id) => id?.toString(16).padStart(4, "0"));
    return { number: this.ports.indexOf(port) + 1, what: usbVendorId === undefined ? "" : `USB ${ids.join(":")}` };
  }

  take(message: FromPort): void {
    const number = message.port;
    if ("open" in message) void this.open(number, message.open);
    else if ("close" in message) void this.close(number, "");
    else if (Date.now() - message.at > LATE_MS) void this.close(number, t("serialLate"));
    else
      this.opened
        .get(number)
        ?.writer.write(message.write)
        .catch((error: unknown) => this.close(number, wordsOf(error)));
  }

  /** All of them; nothing is said. */
  end(): void {
    for (const number of [...this.opened.keys()]) void this.close(number, "");
  }

  private async open(number: number, baudRate: number): Promise<void> {
    const port = this.ports[number - 1] as Port;
    try {
      await port.open({ baudRate });
    } catch (error) {
      this.tell({ port: number, failed: wordsOf(error) });
      return;
    }
    const reader = port.readable.getReader();
    this.opened.set(number, { reader, writer: port.writable.getWriter() });
    this.tell({ port: number, opened: true });
    try {
      for (;;) {
        const { value, done } = await reader.read();
        if (done) break;
        this.tell({ port: number, received: value });
      }
      void this.close(number, t("serialClosed"));
    } catch (error) {
      void this.close(number, wordsOf(error));
    }
  }

  /** `why`: empty where it is wanted. */
  private async close(number: number, why: string): Promise<void> {
    const opened = this.opened.get(number);
    if (opened === undefined) return;
    this.opened.delete(number);
    await opened.reader.cancel().catch(() => undefined); // what fails here is gone already
    opened.reader.releaseLock();
    await opened.writer.close().catch(() => undefined);
    opened.writer.releaseLock();
    await this.ports[number - 1]?.close().catch(() => undefined);
    this.tell({ port: number, lost: why });
  }
}

const wordsOf = (error: unknown): string => (error instanceof Error ? error.message : String(error));

"""Web Serial in a page whose browser has none: its bytes go to a pseudo terminal of this computer."""

from __future__ import annotations

import base64
import os
import termios
import tty

from playwright.sync_api import BrowserContext

SHIM = """
class SteptwinPort {
  getInfo() { return { usbVendorId: 0x0403, usbProductId: 0x6001 }; }
  async open({ baudRate }) {
    await window.serialOpen(baudRate);
    let timer = 0;
    this.readable = new ReadableStream({
      start(into) {
        timer = setInterval(async () => {
          const text = await window.serialRead();
          if (timer === 0) return;
          if (text === null) {
            clearInterval(timer);
            timer = 0;
            into.error(new DOMException("The device has been lost.", "NetworkError"));
          } else if (text) into.enqueue(Uint8Array.from(atob(text), (one) => one.charCodeAt(0)));
        }, 5);
      },
      cancel: () => { clearInterval(timer); timer = 0; },
    });
    this.writable = new WritableStream({ write: (bytes) => window.serialWrite(btoa(String.fromCharCode(...bytes))) });
  }
  close() { return window.serialClose(); }
}
const port = new SteptwinPort();
Object.defineProperty(navigator, "serial", { value: { requestPort: async () => port } });
"""


class WebSerial:
    """A page of ``context`` can open the terminal at ``path``. Nothing passes while its test waits for anything but the page."""

    def __init__(self, context: BrowserContext) -> None:
        self.path: str | None = None
        self.bauds: list[int] = []
        self._node: int | None = None
        context.add_init_script(SHIM)
        context.expose_function("serialOpen", self._open)
        context.expose_function("serialRead", self._read)
        context.expose_function("serialWrite", self._write)
        context.expose_function("serialClose", self.close)

    def _open(self, baud: int) -> None:
        assert self.path is not None
        self._node = os.open(self.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        tty.setraw(self._node, termios.TCSANOW)
        self.bauds.append(baud)

    def _read(self) -> str | None:
        try:
            return "" if self._node is None else base64.b64encode(os.read(self._node, 4096)).decode()
        except BlockingIOError:
            return ""
        except OSError:
            return None

    def _write(self, text: str) -> None:
        if self._node is not None:
            os.write(self._node, base64.b64decode(text))

    def close(self) -> None:
        if self._node is not None:
            os.close(self._node)
        self._node = None

// navigator.serial with one port, whose bytes a websocket carries to the simulated bus of a test: what WebSerial's
// specification says of the parts that a page uses. ADDRESS is that of the websocket.
{
  const lost = () => new DOMException("The device has been lost.", "NetworkError");
  const serial = new EventTarget();
  const port = {
    readable: null,
    writable: null,
    async open({ baudRate }) {
      if (this.writable) throw new DOMException("The port is already open.", "InvalidStateError");
      this.baudRate = baudRate;
      this.socket = new WebSocket(ADDRESS);
      this.socket.binaryType = "arraybuffer";
      await new Promise((done, failed) => {
        this.socket.onopen = done;
        this.socket.onerror = () => failed(new DOMException("Failed to open serial port.", "NetworkError"));
      });
      this.socket.onmessage = ({ data }) => this.incoming.enqueue(new Uint8Array(data));
      this.socket.onclose = () => this.unplugged();
      this.begin();
      this.writable = new WritableStream({
        write: (chunk) => {
          if (this.socket.readyState !== WebSocket.OPEN) throw lost();
          this.socket.send(chunk);
        },
      });
    },
    begin() {
      this.readable = new ReadableStream({
        start: (controller) => { this.incoming = controller; },
        cancel: () => { this.readable = null; },
      });
    },
    // A byte that is broken on the line: the stream ends, and the port has another one.
    disturb() {
      const before = this.incoming;
      this.begin();
      before.error(new DOMException("A framing error.", "FramingError"));
    },
    unplugged() {
      if (!this.readable) return; // it was closed
      this.readable = null;
      this.writable = null;
      this.incoming.error(lost());
      const event = new Event("disconnect");
      Object.defineProperty(event, "target", { value: this });
      serial.dispatchEvent(event);
    },
    async close() {
      if (this.readable?.locked || this.writable.locked) throw new DOMException("A stream is locked.", "InvalidStateError");
      this.readable = null;
      this.writable = null;
      this.socket.close();
    },
  };
  serial.requestPort = async () => port;
  Object.defineProperty(navigator, "serial", { configurable: true, value: serial });
  window.testPort = port;
}

"use strict";
// Runs in viser's page: files for the tab Robot (app/viewer/tabs/robot). Several files, or a folder, become a zip here. A
// text is sent as it is, a zip in base64; both in parts, because a message has a limit.
(() => {
  const PART = 16000; // bytes of a text in one message
  const PART_OF_ZIP = 32000; // bytes of a zip in one message, which base64 makes a third longer
  const AT_ONCE = 6; // parts on their way
  const MOST_FILES = 500;
  const WANTED = /\.(urdf|xacro|xml|toml|stl|obj|mtl|dae|glb)$/i; // what is worth sending of a folder
  const HIDDEN = /(^|\/)(\.|__MACOSX)/;

  const block = () => document.querySelector('[data-arm="files"]');
  const limit = (name) => Number(block().querySelector("[data-arm-file]").dataset[name]);
  const send = (value, done, direct = false, key = "upload") => viserPage.send("feature", ["robot", [key], value], done, direct);

  // Choosing and dropping

  addEventListener("click", (event) => {
    const button = event.target.closest?.("[data-arm-upload]");
    if (button) block().querySelector(button.dataset.armUpload === "folder" ? "[data-arm-folder]" : "[data-arm-file]").click();
    if (event.target.closest?.('[data-arm-do="cancel"]')) uploading++;
  });
  addEventListener("change", (event) => {
    const input = event.target.closest?.("[data-arm-file], [data-arm-folder]");
    if (!input?.files.length) return;
    const files = [...input.files].map((file) => [file.webkitRelativePath || file.name, file]);
    input.value = "";
    open(files);
  });

  const holdsFiles = (event) => [...(event.dataTransfer?.types ?? [])].includes("Files");
  addEventListener("dragover", (event) => {
    if (!holdsFiles(event) || !viserPage.tab("Robot")) return;
    event.preventDefault(); // the browser would open the file instead of the page
    event.dataTransfer.dropEffect = "copy";
    document.documentElement.setAttribute("data-arm-drop", "");
  });
  for (const name of ["dragleave", "drop"]) addEventListener(name, () => document.documentElement.removeAttribute("data-arm-drop"));
  addEventListener("drop", async (event) => {
    if (!holdsFiles(event) || !viserPage.openTab("Robot")) return; // it says how far the file is, and asks where it must
    event.preventDefault();
    const entries = [...event.dataTransfer.items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
    const found = entries.length ? [] : [...event.dataTransfer.files].map((file) => [file.name, file]);
    for (const entry of entries) await collect(entry, found);
    for (let looks = 0; !block() && looks < 100; looks++) await new Promise((done) => { setTimeout(done, 50); }); // until the tab is drawn
    if (found.length && block()) open(found);
  });

  /** The files of a dropped file or folder, with their paths. */
  async function collect(entry, found) {
    if (found.length > 4 * MOST_FILES) return;
    if (entry.isFile) {
      found.push([entry.fullPath.slice(1), await new Promise((done, failed) => { entry.file(done, failed); })]);
      return;
    }
    const reader = entry.createReader();
    for (;;) {
      const some = await new Promise((done, failed) => { reader.readEntries(done, failed); });
      if (!some.length) return;
      for (const one of some) await collect(one, found);
    }
  }

  async function open(files) {
    const mine = ++uploading;
    if (files.length > 1) {
      const wanted = files.filter(([path]) => WANTED.test(path) && !HIDDEN.test(path));
      const roots = new Set(files.map(([path]) => path.split("/")[0]));
      const name = roots.size === 1 ? [...roots][0] : (wanted.find(([path]) => /\.urdf$/i.test(path)) ?? files[0])[0].split("/").pop();
      const bytes = await zip(wanted);
      if (mine === uploading) sendZip(name.slice(0, 100), bytes, mine);
      return;
    }
    const [[path, file]] = files;
    const name = path.split("/").pop().slice(0, 100);
    const head = new Uint8Array(await file.slice(0, 2).arrayBuffer());
    if (head[0] === 0x50 && head[1] === 0x4b) { // PK
      sendZip(name, new Uint8Array(await file.slice(0, limit("mostZip") + 1).arrayBuffer()), mine);
    } else sendText(name, await file.slice(0, limit("most") + 1).text(), 0, mine);
  }

  // The arm to compare with: its text is shown in the field, and sent

  addEventListener("click", (event) => {
    const button = event.target.closest?.("[data-compare-do]");
    if (button?.dataset.compareDo === "open") document.querySelector("[data-compare-file]").click();
    if (button?.dataset.compareDo === "send") sendText("your text", document.querySelector("[data-compare-text]").value, 0, ++uploading, "other-text");
  });
  addEventListener("change", async (event) => {
    const input = event.target.closest?.("[data-compare-file]");
    const [file] = input?.files ?? [];
    if (!file) return;
    input.value = "";
    const text = await file.slice(0, limit("most") + 1).text();
    document.querySelector("[data-compare-text]").value = text;
    sendText(file.name.slice(0, 100), text, 0, ++uploading, "other-text");
  });

  // Zipping

  const TABLE = Uint32Array.from({ length: 256 }, (_, n) => {
    for (let k = 0; k < 8; k++) n = n & 1 ? 0xedb88320 ^ (n >>> 1) : n >>> 1;
    return n;
  });
  function checksum(bytes) {
    let sum = 0xffffffff;
    for (const byte of bytes) sum = TABLE[(sum ^ byte) & 255] ^ (sum >>> 8);
    return (sum ^ 0xffffffff) >>> 0;
  }
  const deflated = async (bytes) =>
    new Uint8Array(await new Response(new Blob([bytes]).stream().pipeThrough(new CompressionStream("deflate-raw"))).arrayBuffer());
  /** A record of a zip: numbers of two bytes, or of four if they are in an array. */
  function record(...numbers) {
    const bytes = numbers.flatMap((n) => (Array.isArray(n) ? [n[0], n[0] >>> 8, n[0] >>> 16, n[0] >>> 24] : [n, n >>> 8]));
    return Uint8Array.from(bytes, (byte) => byte & 255);
  }
  /** A zip of files, which ends where it is larger than it may be: the service says so. */
  async function zip(files) {
    const parts = [];
    const list = [];
    let at = 0;
    for (const [path, file] of files.slice(0, MOST_FILES + 1)) {
      const content = new Uint8Array(await file.arrayBuffer());
      const packed = await deflated(content);
      const name = new TextEncoder().encode(path);
      const about = [0x800, 8, 0, 0, [checksum(content)], [packed.length], [content.length], name.length];
      parts.push(record([0x04034b50], 20, ...about, 0), name, packed);
      list.push(record([0x02014b50], 20, 20, ...about, 0, 0, 0, 0, [0], [at]), name);
      at += 30 + name.length + packed.length;
      if (at > limit("mostZip")) break;
    }
    const length = list.reduce((sum, one) => sum + one.length, 0);
    const end = record([0x06054b50], 0, 0, list.length / 2, list.length / 2, [length], [at], 0);
    return new Uint8Array(await new Blob([...parts, ...list, end]).arrayBuffer());
  }

  // Sending

  let uploading = 0; // the upload that goes on: a newer one ends it
  addEventListener("kinboard-connect", () => { uploading++; });
  function sendZip(name, bytes, mine) {
    let from = 0;
    let direct = false;
    const next = () => {
      if (mine !== uploading || from >= bytes.length) return;
      const start = from;
      const to = from = Math.min(start + PART_OF_ZIP, bytes.length);
      const part = btoa(String.fromCharCode(...bytes.subarray(start, to)));
      const first = start === 0;
      direct = send([name, first, to >= bytes.length, part, "base64", start, bytes.length], first ? begin : next, true);
    };
    const begin = () => { for (let k = 0; k < (direct ? AT_ONCE : 1); k++) next(); };
    next();
  }
  /** The end of the part that begins at `from`: a short enough message, and no character is cut in two. */
  function endOfPart(text, from) {
    let length = PART;
    while (new TextEncoder().encode(JSON.stringify(text.slice(from, from + length))).length > PART + 2) length >>= 1;
    const inside = text.codePointAt(from + length - 1) > 0xffff; // the second half of that character comes next
    return from + length - inside;
  }
  function sendText(name, text, from, mine, key) {
    if (mine !== uploading) return;
    const to = endOfPart(text, from);
    const next = () => { if (to < text.length) sendText(name, text, to, mine, key); };
    send([name, from === 0, to >= text.length, text.slice(from, to)], next, false, key);
  }
})();

"use strict";
// Runs in viser's page: files that are opened or dropped, on whatever tab. `kindOf` says which file goes where. Several
// files, or a folder, become a zip here. Small texts go as messages, other files by a request of their own.
(() => {
  // Where files go: feature, tab, and the most bytes of one. The service refuses larger ones itself.
  const KINDS = {
    arm: { feature: "robot", tab: "Robot", most: 300_000 },
    zip: { feature: "robot", tab: "Robot", most: 20_000_000 },
    calibration: { feature: "motors", tab: "Robot", most: 15_000 },
    program: { feature: "program", tab: "Program", most: 30_000 },
    recording: { feature: "connect", tab: "Program", most: 16_777_216 },
  };
  const MOST_FILES = 500;
  const WANTED = /\.(urdf|xacro|xml|toml|stl|obj|mtl|dae|glb)$/i; // what is worth sending of a folder
  const HIDDEN = /(^|\/)(\.|__MACOSX)/;

  const send = (kind, value, key = "upload") => channel.send("feature", [kind.feature, [key], value]);

  /** Which kind of file this is, as it begins, and what its name says where that tells nothing. */
  async function kindOf(name, file, usual) {
    const head = await file.slice(0, 20_000).text();
    const text = head.replace(/^\ufeff/, "");
    if (head.startsWith("PK")) return "zip";
    if (head.slice(1, 6) === "MCAP0" || text.startsWith("t (s),") || /\.(mcap|csv)$/i.test(name)) return "recording";
    if (text.trimStart().startsWith("{")) return /"segments"\s*:/.test(text) ? "program" : "calibration";
    return /^\s*(\[\[\s*segments\s*\]\]|segments\s*=)/m.test(text) ? "program" : usual;
  }

  // Choosing and dropping

  const press = (selector) => document.querySelector(selector).click();
  dom.on("click", "[data-arm-upload]", (button) => press(button.dataset.armUpload === "folder" ? "[data-arm-folder]" : "[data-arm-file]"));
  dom.on("click", "[data-program-upload]", () => press("[data-program-file]"));
  dom.on("click", "[data-arm-do=cancel]", end);
  dom.on("change", "[data-arm-file], [data-arm-folder], [data-program-file]", (input) => {
    if (!input.files.length) return;
    const files = [...input.files].map((file) => [file.webkitRelativePath || file.name, file]);
    const usual = input.matches("[data-program-file]") ? "program" : "arm";
    input.value = "";
    open(files, usual);
  });

  const holdsFiles = (event) => [...(event.dataTransfer?.types ?? [])].includes("Files");
  addEventListener("dragover", (event) => {
    if (!holdsFiles(event) || !viserPage.tab("Robot")) return;
    event.preventDefault(); // the browser would open the file instead of the page
    event.dataTransfer.dropEffect = channel.mayAct() ? "copy" : "none";
    document.documentElement.toggleAttribute("data-arm-drop", channel.mayAct());
  });
  for (const name of ["dragleave", "drop"]) addEventListener(name, () => document.documentElement.removeAttribute("data-arm-drop"));
  addEventListener("drop", async (event) => {
    if (!holdsFiles(event) || !viserPage.tab("Robot")) return;
    event.preventDefault();
    if (!channel.mayAct()) return;
    const entries = [...event.dataTransfer.items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
    const found = entries.length ? [] : [...event.dataTransfer.files].map((file) => [file.name, file]);
    for (const entry of entries) await collect(entry, found);
    if (found.length) open(found, "arm");
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

  /** Open the tab of a kind of file: it is that of the page after a reload, too. */
  function openTabOf({ tab }) {
    if (viserPage.openTab(tab)) dispatchEvent(new CustomEvent("kinboard-tab", { detail: tab }));
  }

  /** Send files to where they belong, and open that tab: it says how far they are, and asks where it must. */
  async function open(files, usual) {
    const signal = begin();
    if (files.length > 1) {
      openTabOf(KINDS.zip);
      const wanted = files.filter(([path]) => WANTED.test(path) && !HIDDEN.test(path));
      const roots = new Set(files.map(([path]) => path.split("/")[0]));
      const name = roots.size === 1 ? [...roots][0] : (wanted.find(([path]) => /\.urdf$/i.test(path)) ?? files[0])[0].split("/").pop();
      sendFile(KINDS.zip, name.slice(0, 100), await zip(wanted), signal);
      return;
    }
    const [[path, file]] = files;
    const name = path.split("/").pop().slice(0, 100);
    const kind = await kindOf(name, file, usual);
    const { most } = KINDS[kind];
    openTabOf(KINDS[kind]);
    if (kind === "recording") shown = null;
    if (["zip", "recording", "arm"].includes(kind)) sendFile(KINDS[kind], name, file, signal);
    else send(KINDS[kind], [name, file.size > most ? null : await file.text()]);
  }

  // A recording that was opened is shown below the program, which may be long.
  let shown = ""; // the one that has been shown; null: it is still to come
  viserPage.watch(() => {
    const table = document.querySelector('[data-live-recording="opened"]');
    if (shown !== null || !table) return;
    shown = "";
    requestAnimationFrame(() => table.scrollIntoView({ block: "center" }));
  });

  // The arm to compare with: its text is shown in the field, and sent

  dom.on("click", "[data-compare-do=open]", () => press("[data-compare-file]"));
  dom.on("click", "[data-compare-do=send]", () => {
    sendFile(KINDS.arm, "your text", new Blob([document.querySelector("[data-compare-text]").value]), begin(), "other-text");
  });
  dom.on("change", "[data-compare-file]", async (input) => {
    const [file] = input.files;
    if (!file) return;
    input.value = "";
    const text = await file.slice(0, KINDS.arm.most + 1).text();
    document.querySelector("[data-compare-text]").value = text;
    sendFile(KINDS.arm, file.name.slice(0, 100), file, begin(), "other-text");
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
      if (at > KINDS.zip.most) break;
    }
    const length = list.reduce((sum, one) => sum + one.length, 0);
    const tail = record([0x06054b50], 0, 0, list.length / 2, list.length / 2, [length], [at], 0);
    return new Blob([...parts, ...list, tail]);
  }

  // Sending

  let ending = null; // ends the file that is on its way
  /** End the file that is on its way; the service drops what it has of it. */
  function end() {
    ending?.abort();
    ending = null;
  }
  /** Begin another one in its place; returns what tells whether it has been ended. */
  function begin() {
    end();
    ending = new AbortController();
    return ending.signal;
  }
  addEventListener("kinboard-connect", end); // a new session knows nothing of it
  async function sendFile(kind, name, body, signal, key = "upload") {
    if (signal.aborted) return;
    const status = await channel.sendFile(kind.feature, key, name, body, signal);
    if (!signal.aborted && status !== 200) send(kind, [name, status], key); // the page says so
  }
})();

// The picture: where it comes from, what is cut from it, and the light that it will be.

import { h, paint } from "./dom";
import type { Engine } from "./engine";
import type { Fault, PictureFacts, Reply, Settings } from "./protocol";
import { sample, samples } from "./samples";
import type { State } from "./state";
import { say } from "./strings";

/** Pixels of the longer side of what is shown. */
const SHOWN = 400;
/** Pixels of the longer side of what an SVG or a large photograph becomes: more than the nodes of any block here can draw. */
const DRAWN = 2048;
/** A photograph of more pixels takes seconds and gigabytes for every draft. */
const MOST_PIXELS = 12e6;
/** A file of more bytes is not read: its light would not fit into a page anyway. */
const MOST_MB = 256;

/** What is done to a picture, and all that its light depends on. */
const EDITS = ["crop", "rotate", "flip", "levels", "invert", "margin", "vignette"];
const OF_LIGHT = [...EDITS, "offset", "background", "transfer", "layer"];
const ASPECTS = ["free", "1:1", "4:3", "3:2", "16:9", "3:4", "2:3"];

export class PicturePanel {
  readonly element: HTMLElement;
  private readonly original = h("canvas", { tabindex: 0, role: "img", class: "original" });
  private readonly light = h("canvas", { role: "img" });
  private readonly frame = h("div", { class: "crop-frame", hidden: true });
  private readonly note = h("p", { class: "note", "aria-live": "polite" });
  private readonly fault = h("p", { class: "fault", role: "alert", hidden: true });
  private readonly fields = new Map<string, HTMLInputElement>();
  private readonly aspect: HTMLSelectElement;
  /** Of the upright picture without edits, pixels. */
  private whole: [number, number] = [1, 1];
  private readonly offer = h("div", { class: "row", id: "picture-offer", role: "alert", hidden: true });
  private asked = 0;
  private shown = { original: "", light: "", picture: null as unknown };

  constructor(
    private readonly state: State,
    /** Its own, so that it waits for no draft. */
    private readonly engine: Engine,
  ) {
    const input = h("input", { type: "file", accept: "image/*,.svg,.exr,.pnm,.ppm,.pgm,.tif,.tiff", id: "picture-file", class: "visually-hidden", onchange: () => this.take(input.files) });
    const photo = h("input", { type: "file", accept: "image/*", capture: "environment", id: "picture-photo", class: "visually-hidden", onchange: () => this.take(photo.files) });
    const drop = h(
      "div",
      { class: "drop", id: "drop" },
      `${say("drop")} `,
      h("label", { for: "picture-file", class: "link" }, say("choose")),
      input,
      " · ",
      h("label", { for: "picture-photo", class: "link" }, say("camera")),
      photo,
      h("div", { class: "row" }, say("samples"), ...samples.map(({ name, label }) => h("button", { type: "button", "data-sample": name, onclick: () => this.takeSample(name) }, say(label)))),
    );
    this.aspect = h("select", { id: "crop-aspect" }, ...ASPECTS.map((name) => h("option", { value: name }, name === "free" ? say("free") : name)));
    const box = h("div", { class: "original-box" }, this.original, this.frame);
    this.element = h(
      "section",
      { class: "panel", "aria-labelledby": "picture-title" },
      h("h2", { id: "picture-title" }, say("picture")),
      drop,
      this.fault,
      this.offer,
      this.note,
      h("div", { class: "pair" }, h("figure", {}, box, h("figcaption", {}, say("original"))), h("figure", {}, this.light, h("figcaption", {}, say("lightToBe")))),
      this.edits(),
    );
    this.original.setAttribute("aria-label", say("original"));
    this.light.setAttribute("aria-label", say("lightToBe"));
    this.listenToFiles();
    this.listenToDrags();
  }

  private edits(): HTMLElement {
    const button = (label: string, sign: string, change: () => void, id: string) => h("button", { type: "button", id, title: label, "aria-label": label, onclick: change }, sign);
    const turn = () => {
      const before = Number(String(this.state.settings.rotate ?? "0").replace("deg", ""));
      const after = (before + 90) % 360;
      this.state.set({ rotate: after === 0 ? null : `${after}deg` });
    };
    const flip = (how: string) => () => this.state.set({ flip: this.state.settings.flip === how ? null : how });
    const level = (name: "black" | "white" | "gamma", min: number, max: number) => {
      const input = h("input", { type: "range", min, max, step: 0.01, id: `level-${name}`, oninput: () => this.setLevels(true), onchange: () => this.setLevels(false) });
      this.fields.set(name, input);
      return h("label", {}, h("span", {}, say(name)), input);
    };
    const offset = h("input", { type: "range", min: 0, max: 1, step: 0.01, id: "edit-offset", oninput: () => this.state.set({ offset: Number(offset.value) }, true), onchange: () => this.state.set({ offset: Number(offset.value) }) });
    const background = h("input", { type: "color", id: "edit-background", onchange: () => this.state.set({ background: background.value }) });
    const crop = h("input", { type: "text", id: "edit-crop", placeholder: "10%,0%,80%,100%", onchange: () => this.state.set({ crop: crop.value.trim() || null }) });
    this.fields.set("offset", offset).set("background", background).set("crop", crop);
    return h(
      "div",
      { class: "edits" },
      h(
        "div",
        { class: "row" },
        h("label", { class: "inline" }, h("span", {}, say("cropAspect")), this.aspect),
        button(say("wholePicture"), say("wholePicture"), () => this.state.set({ crop: null }), "crop-none"),
        button(say("rotate"), "↻", turn, "edit-rotate"),
        button(say("flipH"), "⇄", flip("horizontal"), "edit-flip-h"),
        button(say("flipV"), "⇅", flip("vertical"), "edit-flip-v"),
        button(say("invert"), say("invert"), () => this.state.set({ invert: this.state.settings.invert ? null : true }), "edit-invert"),
      ),
      h("label", {}, h("span", {}, say("cropField")), crop),
      h("div", { class: "sliders" }, level("black", 0, 0.95), level("white", 0.05, 1), level("gamma", 0.2, 3), h("label", {}, h("span", {}, say("offset")), offset)),
      h("label", { class: "inline" }, h("span", {}, say("background")), background),
    );
  }

  private setLevels(dragging: boolean): void {
    const [black, white, gamma] = ["black", "white", "gamma"].map((name) => Number(this.fields.get(name)?.value));
    const plain = black === 0 && white === 1 && gamma === 1;
    this.state.set({ levels: plain ? null : `${black},${Math.max(white, black + 0.02).toFixed(2)},${gamma}` }, dragging);
  }

  private listenToFiles(): void {
    const page = document;
    page.addEventListener("dragover", (event) => event.preventDefault());
    page.addEventListener("drop", (event) => {
      event.preventDefault();
      void this.take(event.dataTransfer?.files ?? null);
    });
    page.addEventListener("paste", (event) => {
      if (event.clipboardData?.files.length) void this.take(event.clipboardData.files);
    });
  }

  /** A rectangle drawn on the picture is a crop, in parts of its width and height. */
  private listenToDrags(): void {
    let begin: [number, number] | null = null;
    const at = (event: PointerEvent): [number, number] => {
      const box = this.original.getBoundingClientRect();
      const within = (value: number) => Math.min(1, Math.max(0, value));
      return [within((event.clientX - box.left) / box.width), within((event.clientY - box.top) / box.height)];
    };
    const rectangle = (event: PointerEvent): [number, number, number, number] => {
      const [x0, y0] = begin ?? [0, 0];
      let [x1, y1] = at(event);
      const [wide, high] = this.aspect.value.split(":").map(Number);
      if (wide && high) {
        const width = Math.abs(x1 - x0);
        const height = Math.min((width * this.whole[0] * high) / wide / this.whole[1], y1 >= y0 ? 1 - y0 : y0);
        const fitted = (height * this.whole[1] * wide) / high / this.whole[0];
        x1 = x0 + Math.sign(x1 - x0) * fitted;
        y1 = y0 + (y1 >= y0 ? height : -height);
      }
      return [Math.min(x0, x1), Math.min(y0, y1), Math.abs(x1 - x0), Math.abs(y1 - y0)];
    };
    this.original.addEventListener("pointerdown", (event) => {
      if (!this.state.picture) return;
      begin = at(event);
      this.original.setPointerCapture(event.pointerId);
    });
    this.original.addEventListener("pointermove", (event) => {
      if (begin) this.showFrame(rectangle(event));
    });
    this.original.addEventListener("pointerup", (event) => {
      if (!begin) return;
      const [x, y, width, height] = rectangle(event).map((part) => Math.round(1000 * part) / 10);
      begin = null;
      // A click is no crop.
      if (width < 2 || height < 2) return this.showFrame(null);
      this.state.set({ crop: `${x}%,${y}%,${Math.min(width, 100 - x).toFixed(1)}%,${Math.min(height, 100 - y).toFixed(1)}%` });
    });
  }

  private showFrame(rectangle: [number, number, number, number] | null): void {
    this.frame.hidden = rectangle === null;
    if (!rectangle) return;
    const [left, top, width, height] = rectangle.map((part) => `${100 * part}%`);
    Object.assign(this.frame.style, { left, top, width, height });
  }

  private async takeSample(name: string): Promise<void> {
    await this.use(name, await sample(name));
  }

  private async take(files: FileList | null): Promise<void> {
    const file = files?.[0];
    if (!file) return this.tell(say("noFile"));
    const mb = file.size / 1e6;
    if (mb > MOST_MB) return this.tell(say("tooLarge", { name: file.name, mb: mb.toFixed(0), most: MOST_MB }));
    this.offer.hidden = true;
    try {
      if (/\.svg$/i.test(file.name) || file.type === "image/svg+xml") {
        // What the library would draw with the fonts of the system, the browser draws with them here.
        return await this.use(file.name.replace(/\.svg$/i, ".png"), await drawn(file));
      }
      const bytes = new Uint8Array(await file.arrayBuffer());
      const pixels = await pixelsOf(file);
      if (pixels > MOST_PIXELS) this.offerLess(file.name, bytes, pixels);
      else await this.use(file.name, bytes);
    } catch (error) {
      this.tell(say("unreadableFile", { why: String(error) }));
    }
  }

  /** A large photograph: less of it, or all. */
  private offerLess(name: string, bytes: Uint8Array, pixels: number): void {
    const answer = (label: string, id: string, act: () => Promise<void>) => {
      const take = () => {
        this.offer.hidden = true;
        void act();
      };
      return h("button", { type: "button", id, onclick: take }, label);
    };
    this.offer.hidden = false;
    this.offer.replaceChildren(
      h("p", {}, say("large", { name, mp: (pixels / 1e6).toFixed(0) })),
      answer(say("largeReduce", { px: DRAWN }), "picture-reduce", () => this.reduce(name, bytes)),
      answer(say("largeKeep"), "picture-keep", () => this.use(name, bytes)),
    );
  }

  /** Takes means of its light, where what reads a picture may have changed. */
  private async reduce(name: string, bytes: Uint8Array): Promise<void> {
    const { transfer, background, layer } = this.state.settings;
    const reading = Object.fromEntries(Object.entries({ transfer, background, layer }).filter(([, value]) => value !== undefined));
    this.note.textContent = say("working");
    try {
      await this.engine.put(name, bytes);
      const less = await this.engine.call<Uint8Array>({ method: "reduced", args: [JSON.stringify({ ...reading, picture: name }), DRAWN] });
      await this.engine.forget(name);
      // How the picture is read is in its light now.
      this.state.set({ transfer: null, background: null, layer: null });
      await this.use(`${name.replace(/\.[^.]*$/, "")}.${DRAWN}px.png`, less);
    } catch (fault) {
      this.tell((fault as Fault).message);
    }
  }

  /** Looks at a picture before the page takes it: what cannot be read leaves everything as it is. */
  async use(name: string, bytes: Uint8Array): Promise<void> {
    try {
      await this.engine.put(name, bytes);
      await this.engine.call({ method: "picture", args: [JSON.stringify({ picture: name }), 64] });
    } catch (fault) {
      return this.tell((fault as Fault).message);
    }
    this.tell(null);
    // What was cut from another picture means nothing in this one.
    if (this.state.picture && this.state.picture.name !== name) this.state.set({ crop: null, rotate: null, flip: null, levels: null });
    this.state.setPicture({ name, bytes });
  }

  tell(fault: string | null): void {
    this.fault.hidden = fault === null;
    this.fault.textContent = fault ?? "";
  }

  /** Draws the picture and its light anew. */
  async update(): Promise<void> {
    const { settings, picture } = this.state;
    const set = (name: string, value: string) => {
      const field = this.fields.get(name);
      if (field && document.activeElement !== field) field.value = value;
    };
    const [black = "0", white = "1", gamma = "1"] = String(settings.levels ?? "0,1,1").split(",");
    set("black", black);
    set("white", white);
    set("gamma", gamma);
    set("offset", String(settings.offset ?? 0.1));
    set("background", /^#[0-9a-f]{6}$/i.test(String(settings.background)) ? String(settings.background) : settings.background === "white" ? "#ffffff" : "#000000");
    set("crop", String(settings.crop ?? ""));
    if (!picture) return;
    const of = (names: string[]) => JSON.stringify(names.map((name) => settings[name]));
    const keys = { original: of(OF_LIGHT.filter((name) => !EDITS.includes(name))), light: of(OF_LIGHT), picture };
    const isSame = (name: "original" | "light") => this.shown.picture === picture && this.shown[name] === keys[name];
    const asked = ++this.asked;
    const look = (asked: string) => this.engine.call<Reply<PictureFacts>>({ method: "picture", args: [asked, SHOWN] });
    const plain: Settings = { ...settings, picture: picture.name };
    for (const edit of EDITS) delete plain[edit];
    try {
      if (!isSame("original")) {
        const { facts, arrays } = await look(JSON.stringify(plain));
        if (asked !== this.asked) return;
        this.whole = facts.size;
        paint(this.original, arrays.light as Uint8Array, facts.shown);
      }
      if (!isSame("light")) {
        const { facts, arrays } = await look(this.state.asked());
        if (asked !== this.asked) return;
        paint(this.light, arrays.light as Uint8Array, facts.shown);
        this.note.textContent = [say("picked", { name: picture.name, nx: facts.size[0], ny: facts.size[1] }), facts.line, ...facts.warnings].filter(Boolean).join(" · ");
      }
      this.shown = keys;
      this.tell(null);
    } catch (fault) {
      if (asked === this.asked && (fault as Fault).kind !== "cancelled") this.tell((fault as Fault).message);
    }
    this.showFrame(cropped(settings.crop, this.whole));
  }
}

/** How many pixels a picture has, as far as the browser can read it; 0 where it cannot. */
async function pixelsOf(file: Blob): Promise<number> {
  try {
    const bitmap = await createImageBitmap(file);
    const pixels = bitmap.width * bitmap.height;
    bitmap.close();
    return pixels;
  } catch {
    return 0;
  }
}

/** An SVG as a PNG, transparent where nothing is drawn. */
async function drawn(file: Blob): Promise<Uint8Array> {
  const url = URL.createObjectURL(new Blob([file], { type: "image/svg+xml" }));
  try {
    const image = new Image();
    image.src = url;
    await image.decode();
    const [width, height] = [image.naturalWidth || 1, image.naturalHeight || 1];
    const scale = DRAWN / Math.max(width, height);
    const canvas = h("canvas", { width: Math.max(1, Math.round(width * scale)), height: Math.max(1, Math.round(height * scale)) });
    canvas.getContext("2d")?.drawImage(image, 0, 0, canvas.width, canvas.height);
    const png = await new Promise<Blob | null>((resolve) => canvas.toBlob(resolve, "image/png"));
    if (!png) throw new Error(say("noCanvas"));
    return new Uint8Array(await png.arrayBuffer());
  } finally {
    URL.revokeObjectURL(url);
  }
}

/** A crop in parts of the picture's width and height. */
function cropped(crop: unknown, [nx, ny]: [number, number]): [number, number, number, number] | null {
  const parts = String(crop ?? "").split(",");
  if (parts.length !== 4) return null;
  const share = (text: string, side: number) => (text.trim().endsWith("%") ? Number.parseFloat(text) / 100 : Number.parseFloat(text) / side);
  return [share(parts[0], nx), share(parts[1], ny), share(parts[2], nx), share(parts[3], ny)];
}

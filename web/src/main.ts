// The page: picture and bench on one side, the answer on the other. Every change is answered by a draft.

import "./style.css";
import { Answer, inWords } from "./answer";
import { BenchView } from "./benchview";
import { byId, download, h, paint } from "./dom";
import { Engine } from "./engine";
import { Form } from "./form";
import { LightPanel } from "./light";
import { Maker, NODES } from "./make";
import { PicturePanel } from "./picture";
import type { Catalogue, Facts, Fault, Reply, Settings } from "./protocol";
import { fromHash, type Picture, State } from "./state";
import { keepFiles, keepPicture, keptDesigns, keptFiles, keptPicture } from "./store";
import { language, number, say, setLanguage } from "./strings";

const DRAFT_NODES = [129, 193, 257];
const DRAFT_PIXELS = 256;
/** Places of the face along a side that the moving light is drawn with. */
const MESH = 257;

const state = new State();
/** Pictures, drafts, and the block that is made have a worker each: none waits for another, nor loses its block. */
const pictures = new Engine(1);
const drafts = new Engine();
const maker = new Engine();

async function begin(): Promise<void> {
  document.documentElement.lang = language;
  document.title = `${say("title")}: ${say("tagline")}`;
  const root = byId("app");
  if (typeof WebAssembly !== "object") return root.replaceChildren(h("p", { class: "fault" }, say("noWasm")));
  let catalogue: Catalogue;
  try {
    catalogue = await drafts.call<Catalogue>({ method: "catalogue", args: [] });
  } catch (fault) {
    // What has started and ended says why; else this browser could not even compile the module.
    const why = fault instanceof Error ? [`${say("noWasm")} (${fault.message})`] : inWords(fault as Fault);
    return root.replaceChildren(h("p", { class: "fault", role: "alert" }, ...why));
  }
  build(root, catalogue);
}

function build(root: HTMLElement, catalogue: Catalogue): void {
  const nodes = h("select", { id: "draft-nodes", onchange: () => ask() }, ...DRAFT_NODES.map((n) => h("option", { value: n }, String(n))));
  const picture = new PicturePanel(state, pictures);
  const form = new Form(state, drafts, catalogue);
  const view = new BenchView(state);
  const answer = new Answer(h("label", { class: "inline" }, h("span", {}, say("draftNodes")), nodes));
  const light = new LightPanel();
  const designs = h("div", { id: "designs" });
  const notice = h("p", { class: "fault", role: "alert", id: "notice", hidden: true });
  const make = new Maker(state, maker, ({ facts, arrays }) => light.take(arrays.mesh as Float32Array, facts.stand, facts.white, maker), () => void showDesigns());
  const undo = h("button", { type: "button", id: "undo", onclick: () => state.undo() }, say("undo"));
  const redo = h("button", { type: "button", id: "redo", onclick: () => state.redo() }, say("redo"));
  const open = h("input", { type: "file", accept: ".toml", id: "design-file", class: "visually-hidden", onchange: () => void openDesign() });
  let last: Facts | null = null;

  root.replaceChildren(
    h("a", { class: "skip", href: "#answer", onclick: (event) => { event.preventDefault(); byId("answer").focus(); } }, say("skip")),
    h(
      "header",
      {},
      h("div", {}, h("h1", {}, say("title")), h("p", { class: "tagline" }, say("tagline"))),
      h(
        "div",
        { class: "row tools" },
        undo,
        redo,
        h("label", { for: "design-file", class: "button" }, say("openDesign")),
        open,
        h("button", { type: "button", id: "save-design", onclick: () => last && download("design.toml", last.design_toml, "application/toml") }, say("saveDesign")),
        h("button", { type: "button", id: "language", onclick: () => changeLanguage() }, say("language")),
      ),
    ),
    notice,
    h(
      "main",
      {},
      h("div", { class: "column inputs" }, picture.element, form.element),
      h("div", { class: "column outputs" }, h("section", { class: "panel wide" }, view.element), answer.element, light.element, make.element, h("section", { class: "panel", "aria-labelledby": "designs-title" }, h("h2", { id: "designs-title" }, say("designs")), designs)),
    ),
    h("footer", {}, h("p", {}, say("footer")), h("p", { class: "note" }, `glasswarp ${catalogue.version}`)),
  );

  function warn(text: string): void {
    notice.hidden = false;
    notice.textContent = text;
  }

  async function openDesign(): Promise<void> {
    const file = open.files?.[0];
    if (!file) return;
    try {
      const read = await drafts.call<Settings>({ method: "read_design", args: [await file.text(), file.name] });
      const { picture: _, ...settings } = Object.fromEntries(Object.entries(read).filter(([, value]) => value !== null));
      state.replace(settings as Settings);
      notice.hidden = true;
    } catch (fault) {
      warn((fault as Fault).message);
    }
    open.value = "";
  }

  function changeLanguage(): void {
    setLanguage(language === "en" ? "de" : "en");
    // Settings and picture are kept; everything else is drawn anew.
    location.reload();
  }

  async function showDesigns(): Promise<void> {
    const kept = await keptDesigns();
    designs.replaceChildren(
      ...(kept.length ? kept : []).map((design) => {
        const canvas = h("canvas", { role: "img", "aria-label": design.picture.name, class: "thumbnail" });
        paint(canvas, design.light, design.pixels);
        const restore = () => {
          state.replace(design.settings);
          void picture.use(design.picture.name, design.picture.bytes);
        };
        const error = design.rel_rms === null ? "" : `, ${say("relRms")} ${number(design.rel_rms, 4)}`;
        return h("div", { class: "kept" }, canvas, h("p", {}, `${design.picture.name}, ${design.nodes.join(" × ")}${error}, ${new Date(design.when).toLocaleString(language)}`), h("button", { type: "button", onclick: restore }, say("restore")));
      }),
      kept.length ? "" : h("p", { class: "note" }, say("noDesigns")),
    );
  }

  let asked = 0;
  let timer = 0;
  let running = false;
  let again = false;
  let given: Picture | null = null;

  /** A draft soon: of many changes only the last. */
  function ask(): void {
    clearTimeout(timer);
    asked += 1;
    // What runs is no longer wanted. Where only ending the worker would end it, it is quicker to let it come.
    if (running && drafts.cooperates) drafts.cancel();
    timer = window.setTimeout(() => void draft(), 60);
  }

  /** What the workers have of the files that settings name. */
  const handed = new Map<string, Uint8Array>();
  function handOverFiles(): void {
    let changed = false;
    for (const name of [...handed.keys()]) {
      if (state.files.has(name)) continue;
      handed.delete(name);
      for (const engine of [drafts, maker]) void engine.forget(name);
      changed = true;
    }
    for (const [name, bytes] of state.files) {
      if (handed.get(name) === bytes) continue;
      handed.set(name, bytes);
      for (const engine of [drafts, maker]) void engine.put(name, bytes);
      changed = true;
    }
    if (changed) keepFiles(state.files).catch(() => warn(say("storageFull")));
  }

  /** Gives the picture to whoever designs with it. */
  async function handOver(): Promise<void> {
    if (state.picture === given || !state.picture) return;
    given = state.picture;
    await drafts.put(given.name, given.bytes);
  }

  async function draft(): Promise<void> {
    if (!state.picture) return;
    if (running) {
      again = true;
      return;
    }
    running = true;
    again = false;
    await handOver();
    const mine = asked;
    answer.working();
    const begun = performance.now();
    try {
      const reply = await drafts.call<Reply<Facts>>({ method: "draft", args: [state.asked({ nodes: state.settings.nodes ?? NODES }), Number(nodes.value), DRAFT_PIXELS, MESH] });
      if (mine === asked) {
        last = reply.facts;
        answer.show(reply, performance.now() - begun);
        view.show(reply.facts.stand, reply.arrays.mesh as Float32Array);
        light.take(reply.arrays.mesh as Float32Array, reply.facts.stand, reply.facts.white, drafts);
        make.update(reply.facts.command);
        performance.measure("draft", { start: begun, end: performance.now() });
      }
    } catch (error) {
      const fault = error as Fault;
      if (fault.kind !== "cancelled") answer.failed(fault);
    } finally {
      running = false;
      if (again || mine !== asked) void draft();
    }
  }

  let shown: unknown = null;
  state.listen(() => {
    undo.disabled = !state.canUndo;
    redo.disabled = !state.canRedo;
    form.update();
    view.draw();
    make.update(null);
    handOverFiles();
    void picture.update();
    ask();
    if (state.picture !== shown) {
      shown = state.picture;
      keepPicture(state.picture).catch(() => warn(say("storageFull")));
    }
  });
  window.addEventListener("hashchange", () => state.replace(fromHash(location.hash)));
  document.addEventListener("keydown", (event) => {
    if (!(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== "z" || event.target instanceof HTMLInputElement) return;
    event.preventDefault();
    if (event.shiftKey) state.redo();
    else state.undo();
  });
  undo.disabled = redo.disabled = true;
  form.update();
  view.draw();
  make.update("");
  void showDesigns();
  void keptFiles().then((files) => state.addFiles(files));
  void keptPicture().then(async (kept) => {
    if (!kept || state.picture) return;
    shown = kept;
    await pictures.put(kept.name, kept.bytes);
    state.setPicture(kept);
  });
}

if ("serviceWorker" in navigator && location.protocol.startsWith("http")) {
  navigator.serviceWorker.register("sw.js").catch(() => undefined);
}

void begin();

// Make it: the block at its full number of nodes, its verification, and its files.

import { figures, withCode } from "./answer";
import { download, h, paint } from "./dom";
import type { Engine } from "./engine";
import type { Facts, Fault, Reply, Verified } from "./protocol";
import { Run } from "./run";
import { Shop } from "./shop";
import type { Picture, State } from "./state";
import { keepDesign } from "./store";
import { number, say, type Words } from "./strings";

/** Nodes across, where nobody asks for others, and what there is to choose from. */
export const NODES = 641;
const CHOICES = [257, 385, 513, NODES, 769, 1025, 1281, 1537];
const PIXELS = 512;
const MESH = 257;
const FORMATS: [string, keyof Words, string][] = [
  ["stl", "fileStl", "model/stl"],
  ["step", "fileStep", "model/step"],
  ["3mf", "file3mf", "model/3mf"],
  ["glb", "fileGlb", "model/gltf-binary"],
  ["obj", "fileObj", "model/obj"],
  ["ply", "filePly", "application/octet-stream"],
  ["png", "filePng", "image/png"],
  ["exr", "fileExr", "image/x-exr"],
];

export class Maker {
  readonly element: HTMLElement;
  private readonly nodes = h("select", { id: "make-nodes" }, ...CHOICES.map((n) => h("option", { value: n, selected: n === NODES }, String(n))));
  private readonly verify = h("input", { type: "checkbox", id: "make-verify", checked: true });
  private readonly button = h("button", { type: "button", class: "primary", id: "make", onclick: () => void this.make() }, say("makeButton"));
  private readonly run: Run;
  private readonly shop: Shop;
  private readonly found = h("div", { id: "make-found" });
  private readonly command = h("code", { id: "command" });
  private facts: Facts | null = null;
  /** Settings and picture of the block that was made, which may have changed since. */
  private of: { stem: string; picture: Picture; files: Map<string, Uint8Array> } | null = null;

  constructor(
    private readonly state: State,
    private readonly engine: Engine,
    private readonly onMade: (reply: Reply<Facts>) => void,
    private readonly onKept: () => void,
  ) {
    this.run = new Run("make", engine, this.button);
    this.shop = new Shop(engine);
    const copied = h("span", { class: "note", role: "status" });
    const copy = async () => {
      await navigator.clipboard.writeText(this.command.textContent ?? "");
      copied.textContent = say("copied");
    };
    this.element = h(
      "section",
      { class: "panel", "aria-labelledby": "make-title" },
      h("h2", { id: "make-title" }, say("make")),
      h(
        "div",
        { class: "row" },
        h("label", { class: "inline" }, h("span", {}, say("makeNodes")), this.nodes),
        h("label", { class: "inline" }, this.verify, h("span", {}, say("verifyBox"))),
        this.button,
        this.run.stop,
        h("button", { type: "button", onclick: () => window.print() }, say("print")),
      ),
      this.run.bar,
      this.run.status,
      this.run.fault,
      this.found,
      this.shop.element,
      h("h3", {}, say("command")),
      h("div", { class: "command" }, this.command, h("button", { type: "button", onclick: () => void copy() }, say("copy")), copied),
    );
    this.nodes.addEventListener("change", () => this.state.set({ nodes: Number(this.nodes.value) }));
  }

  /** Shows the settings as they are. */
  update(command: string | null): void {
    const asked = String(this.state.settings.nodes ?? NODES);
    if (![...this.nodes.options].some((option) => option.value === asked)) this.nodes.append(h("option", { value: asked }, asked));
    this.nodes.value = asked;
    this.button.disabled = !this.state.picture;
    if (command !== null) this.command.textContent = command;
  }

  async make(): Promise<void> {
    const { picture } = this.state;
    if (!picture) return;
    const settings = { ...this.state.settings, nodes: Number(this.nodes.value) };
    const stem = picture.name.replace(/\.[^.]*$/, "") || "block";
    const fault = await this.run.of(async (tell) => {
      this.found.replaceChildren();
      this.shop.take(null);
      await this.engine.put(picture.name, picture.bytes);
      const made = await this.engine.call<Reply<Facts>>({ method: "make", args: [this.state.asked(settings), PIXELS, MESH] }, tell);
      this.facts = made.facts;
      this.of = { stem, picture, files: new Map(this.state.files) };
      const seconds = this.run.seconds;
      const [nx, ny] = made.facts.block.nodes;
      this.showMade(made);
      this.onMade(made);
      if (this.verify.checked) {
        const verified = await this.engine.call<Reply<Verified>>({ method: "verify", args: [`${stem}.stl`] }, tell);
        this.showVerified(verified);
      }
      this.shop.take(`${stem}.stl`);
      const memory = await this.engine.call<number>({ method: "memory", args: [] });
      await keepDesign(this.state.settings, picture, made.facts, made.arrays.light as Uint8Array).then(this.onKept, () => this.run.failed(say("storageFull")));
      const said = [say("made", { nx, ny, s: seconds.toFixed(1), mb: Math.round(memory / 1e6) })];
      if (this.verify.checked) said.push(say("verified", { file: `${stem}.stl` }));
      return said.join(" ");
    });
    // A worker that was ended has taken the block with it.
    if (fault && (fault.kind === "internal" || !this.engine.cooperates)) this.facts = null;
  }

  private showMade({ facts, arrays }: Reply<Facts>): void {
    const light = h("canvas", { role: "img", "aria-label": say("light") });
    paint(light, arrays.light as Uint8Array, facts.pixels);
    this.found.replaceChildren(
      h("ul", { class: "warnings" }, ...facts.warnings.map((warning) => h("li", {}, ...withCode(warning)))),
      h("dl", { class: "figures", id: "made-figures" }, ...figures(facts)),
      h("p", { class: "order" }, `${say("order")}: ${facts.order}`),
      h("p", { class: "note" }, facts.receiver),
      h("div", { id: "verified" }),
      h("h3", {}, say("files")),
      this.files(),
    );
  }

  private showVerified({ facts, arrays }: Reply<Verified>): void {
    const canvas = (name: "light" | "target" | "difference") => {
      const picture = h("canvas", { role: "img", "aria-label": say(name) });
      paint(picture, arrays[name] as Uint8Array, facts.pixels);
      return h("figure", {}, picture, h("figcaption", {}, say(name)));
    };
    const figure = (value: number | null, digits: number) => (value === null ? "–" : number(value, digits));
    const { picture } = facts.judgement;
    const names: Record<string, keyof Words> = { "an index 0.01 higher": "faultIndex", "a receiver 2 % further away": "faultDistance" };
    document.getElementById("verified")?.replaceChildren(
      h("p", { class: "verdict", id: "verdict" }, h("strong", {}, ...withCode(facts.verdict.says))),
      h(
        "dl",
        { class: "figures" },
        h("div", {}, h("dt", {}, say("relRms")), h("dd", { "data-verified": "rel_rms", "data-value": picture?.rel_rms ?? "" }, figure(picture?.rel_rms ?? null, 4))),
        h("div", {}, h("dt", {}, say("ssim")), h("dd", { "data-verified": "ssim", "data-value": picture?.ssim ?? "" }, figure(picture?.ssim ?? null, 4))),
        h("div", {}, h("dt", {}, say("photons")), h("dd", {}, facts.agreement)),
        ...facts.faults.map(([name, value]) => h("div", {}, h("dt", {}, say(names[name] ?? "faults")), h("dd", {}, figure(value, 3)))),
      ),
      h("div", { class: "triple" }, canvas("light"), canvas("target"), canvas("difference")),
      h(
        "details",
        {},
        h("summary", {}, say("budget")),
        h("table", {}, h("tbody", {}, ...facts.budget.map((step) => h("tr", {}, h("th", { scope: "row" }, step.name), h("td", {}, figure(step.rel_rms, 4)))))),
      ),
    );
  }

  private files(): HTMLElement {
    const button = (extension: string, label: string, give: () => Promise<void>) => h("button", { type: "button", "data-file": extension, onclick: () => void this.giving(give) }, label);
    return h(
      "div",
      { class: "row files" },
      ...FORMATS.map(([extension, label, type]) => button(extension, say(label), async () => download(this.name(extension), await this.bytes(extension), type))),
      button("report", say("fileReport"), async () => download(this.name("report.html"), await this.engine.call<string>({ method: "report", args: [this.of?.stem ?? "block"] }), "text/html")),
      button("side", say("fileSide"), async () => download(this.name("toml"), await this.side(), "application/toml")),
      button("design", say("fileDesign"), async () => download("design.toml", this.facts?.design_toml ?? "", "application/toml")),
      button("zip", say("zip"), () => this.zip()),
    );
  }

  private name(extension: string): string {
    const stem = this.of?.stem ?? "block";
    // The picture beside it may be a PNG of that name.
    return extension === "png" ? `${stem}.heights.png` : `${stem}.${extension}`;
  }

  private bytes(extension: string): Promise<Uint8Array> {
    return this.engine.call<Uint8Array>({ method: "file", args: [this.name(extension)] });
  }

  private side(): Promise<string> {
    return this.engine.call<string>({ method: "side_file", args: [this.name("toml")] });
  }

  private async giving(give: () => Promise<void>): Promise<void> {
    this.run.failed(null);
    try {
      await give();
    } catch (error) {
      this.run.failed(error as Fault);
    }
  }

  /** Everything that belongs together, with the picture, so that `glasswarp verify` works in the folder as it is unpacked. */
  private async zip(): Promise<void> {
    this.run.status.textContent = say("zipped");
    const { of, facts } = this;
    if (!of || !facts) return;
    const others = { ...Object.fromEntries(of.files), [of.picture.name]: of.picture.bytes, "design.toml": new TextEncoder().encode(facts.design_toml) };
    const names = FORMATS.map(([extension]) => this.name(extension));
    const packed = await this.engine.call<Uint8Array>({ method: "zip", args: [names, this.name("toml"), others] });
    download(this.name("zip"), packed, "application/zip");
    this.run.status.textContent = "";
  }
}

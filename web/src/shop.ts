// Whether the block is ready to be made: checked, milled, polished, seen in the light that there is, on a bench that is a little off.

import { withCode } from "./answer";
import { download, h, paint } from "./dom";
import type { Engine } from "./engine";
import type { Ready, Reply } from "./protocol";
import { Run } from "./run";
import { number, say, type Words } from "./strings";

/** What is asked for: names and defaults of `glasswarp ready`, and examples. */
const FIELDS: [string, keyof Words, string][] = [
  ["cutter", "shopCutter", "ball:d6mm"],
  ["step-over", "shopStepOver", "0.1mm"],
  ["direction", "shopDirection", "x"],
  ["polish", "shopPolish", "0mm"],
  ["source-size", "shopLight", ""],
  ["feed", "shopFeed", "2000mm/min"],
];
/** Faults of the bench that are shown, the worst. */
const MOST_FAULTS = 8;

export class Shop {
  readonly element: HTMLElement;
  private readonly fields: Map<string, HTMLInputElement>;
  private readonly button = h("button", { type: "button", class: "primary", id: "ready", onclick: () => void this.ask() }, say("shopAsk"));
  private readonly run: Run;
  private readonly found = h("div", { id: "ready-found" });
  private name = "";

  constructor(private readonly engine: Engine) {
    this.run = new Run("ready", engine, this.button);
    this.fields = new Map(FIELDS.map(([name, , usual]) => [name, h("input", { type: "text", id: `shop-${name}`, value: usual, placeholder: usual || say("byDefault"), autocomplete: "off", spellcheck: "false" })]));
    this.element = h(
      "div",
      { id: "shop", hidden: true },
      h("h3", {}, say("shop")),
      h("p", { class: "hint" }, say("shopHelp")),
      h("div", { class: "settings" }, ...FIELDS.map(([name, label]) => h("div", { class: "setting" }, h("label", { for: `shop-${name}` }, say(label)), this.fields.get(name)))),
      h("div", { class: "row" }, this.button, this.run.stop),
      this.run.bar,
      this.run.status,
      this.run.fault,
      this.found,
    );
  }

  /** Takes another block, the STL of which has this name; none, if there is none. */
  take(name: string | null): void {
    this.name = name ?? "";
    this.element.hidden = name === null;
    this.found.replaceChildren();
    this.run.status.textContent = "";
    this.run.failed(null);
  }

  private async ask(): Promise<void> {
    const asked = Object.fromEntries([...this.fields].map(([name, { value }]) => [name, value.trim()] as const).map(([name, value]) => [name, name === "source-size" && value === "" ? null : value]));
    const fault = await this.run.of(async (tell) => {
      this.found.replaceChildren();
      this.show(await this.engine.call<Reply<Ready>>({ method: "ready", args: [this.name, JSON.stringify(asked)] }, tell));
      return "";
    });
    // A worker that was ended has taken the block with it.
    if (fault && (fault.kind === "internal" || (fault.kind === "cancelled" && !this.engine.cooperates))) this.element.hidden = true;
  }

  private show({ facts, arrays }: Reply<Ready>): void {
    const figure = (name: string, caption: string) => {
      const canvas = h("canvas", { role: "img", "aria-label": caption });
      paint(canvas, arrays[name] as Uint8Array, facts.pixels);
      return h("figure", {}, canvas, h("figcaption", {}, caption));
    };
    const ssim = (value: number | null) => (value === null ? "–" : `SSIM ${number(value, 3)}`);
    const rms = (value: number | null) => (value === null ? "–" : number(value, 4));
    const row = (name: string, ...cells: (string | Node)[]) => h("tr", {}, h("th", { scope: "row" }, name), ...cells.map((cell) => h("td", {}, cell)));
    const said = (says: string) => h("span", {}, ...withCode(says));
    this.found.replaceChildren(
      h("p", { class: "verdict", id: "ready-verdict", "data-answer": facts.verdict.answer }, h("strong", {}, ...withCode(facts.verdict.says))),
      h("table", { id: "ready-concerns" }, h("tbody", {}, ...facts.verdict.concerns.map(({ question, answer, says }) => row(question, answer, said(says))))),
      h("div", { class: "triple" }, figure("light", `${say("shopSeen")}, ${facts.light}`), figure("target", say("target")), figure("difference", say("difference"))),
      h("h4", {}, say("shopSteps")),
      h("div", { class: "triple", id: "ready-steps" }, ...facts.steps.map((step, k) => figure(`step${k}`, `${step.name}: ${rms(step.rel_rms)}, ${ssim(step.ssim)}`))),
      h("h4", {}, say("shopChecks")),
      h("table", { id: "ready-checks" }, h("tbody", {}, ...facts.lines.map(({ what, passed, says }) => row(what, say(passed ? "shopPassed" : "shopFailed"), said(says))))),
      h("h4", {}, say("shopFaults")),
      h("table", {}, h("tbody", {}, ...facts.faults.slice(0, MOST_FAULTS).map(([name, value]) => row(name, ssim(value))))),
      h("p", { class: "order" }, `${say("order")}: ${facts.order}`),
      h("p", { class: "note" }, say("shopTime", { rows: facts.rows, minutes: number(facts.minutes, 0) })),
      h("div", { class: "row" }, h("button", { type: "button", "data-file": "sheet", onclick: () => void this.sheet() }, say("shopSheet"))),
    );
  }

  private async sheet(): Promise<void> {
    const name = this.name.replace(/\.[^.]*$/, ".ready.html");
    download(name, await this.engine.call<string>({ method: "sheet", args: [] }), "text/html");
  }
}

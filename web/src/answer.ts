// The answer while one drags: warnings first, then figures, then the light.

import { h, paint } from "./dom";
import type { Facts, Fault, Reply } from "./protocol";
import { number, say, type Words } from "./strings";

export class Answer {
  readonly element: HTMLElement;
  private readonly status = h("p", { id: "draft-status", class: "note", role: "status", "aria-live": "polite" }, say("waiting"));
  private readonly fault = h("p", { class: "fault", role: "alert", id: "draft-fault", hidden: true });
  private readonly warnings = h("ul", { class: "warnings", id: "draft-warnings" });
  private readonly figures = h("dl", { class: "figures", id: "draft-figures" });
  private readonly order = h("p", { class: "order" });
  private readonly pictures: Record<"light" | "target" | "difference", HTMLCanvasElement>;

  constructor(nodes: HTMLElement) {
    const canvas = (name: keyof Words) => h("canvas", { role: "img", "aria-label": say(name), id: `draft-${name}` });
    this.pictures = { light: canvas("light"), target: canvas("target"), difference: canvas("difference") };
    const figure = (name: "light" | "target" | "difference") => h("figure", {}, this.pictures[name], h("figcaption", {}, say(name)));
    this.element = h(
      "section",
      { class: "panel", id: "answer", tabindex: -1, "aria-labelledby": "answer-title" },
      h("div", { class: "row between" }, h("h2", { id: "answer-title" }, say("answer")), nodes),
      this.status,
      this.fault,
      this.warnings,
      this.figures,
      h("div", { class: "triple" }, figure("light"), figure("target"), figure("difference")),
      this.order,
    );
  }

  working(): void {
    this.element.setAttribute("aria-busy", "true");
    this.status.textContent = say("working");
  }

  failed(fault: Fault): void {
    this.element.setAttribute("aria-busy", "false");
    this.status.textContent = "";
    this.fault.hidden = false;
    this.fault.replaceChildren(...inWords(fault));
  }

  show({ facts, arrays }: Reply<Facts>, ms: number): void {
    this.element.setAttribute("aria-busy", "false");
    this.fault.hidden = true;
    this.status.textContent = say("draftOf", { nx: facts.block.nodes[0], ny: facts.block.nodes[1], ms: Math.round(ms) });
    this.warnings.replaceChildren(...(facts.warnings.length ? facts.warnings.map((warning) => h("li", {}, ...withCode(warning))) : [h("li", { class: "none" }, say("noWarnings"))]));
    this.figures.replaceChildren(...figures(facts));
    this.order.textContent = `${say("order")}: ${facts.order}`;
    for (const [name, canvas] of Object.entries(this.pictures)) paint(canvas, arrays[name] as Uint8Array, facts.pixels);
  }
}

/** The figures of a block, as a list of terms. */
export function figures(facts: Facts): HTMLElement[] {
  const mm = (value: number, digits = 2) => `${number(value, digits)} mm`;
  const share = (value: number) => `${number(100 * value, 2)} %`;
  const rows: [keyof Words, string][] = [
    ["relRms", facts.rel_rms === null ? "–" : number(facts.rel_rms, 4)],
    ["ssim", facts.ssim === null ? "–" : `${number(facts.ssim, 3)} (${facts.seen})`],
    ["relief", mm(facts.block.relief_mm)],
    ["thickness", mm(facts.block.thickness_mm)],
    ["thinnest", mm(facts.block.thinnest_mm)],
    ["radius", facts.least_radius_mm === null ? say("convex") : mm(facts.least_radius_mm, 1)],
    ["steepest", `${number(facts.steepest_degrees, 1)}°`],
    ["totalReflection", share(facts.light.totally_reflected)],
    ["missed", share(facts.light.missed)],
  ];
  return rows.map(([name, value]) => h("div", {}, h("dt", {}, say(name)), h("dd", { "data-figure": name }, value)));
}

/** A message whose settings stand in backticks: those lead to their fields. */
export function withCode(text: string): (Node | string)[] {
  return text.split("`").map((part, k) => {
    if (k % 2 === 0) return part;
    const field = document.getElementById(`setting-${part.split(" ")[0]}`);
    return field ? h("a", { href: `#${field.id}`, onclick: (event) => follow(event, field) }, part) : h("code", {}, part);
  });
}

/** The address holds the settings, and not a place in the page. */
function follow(event: Event, field: HTMLElement): void {
  event.preventDefault();
  field.closest("details")?.setAttribute("open", "");
  field.focus();
}

export function inWords(fault: Fault): (Node | string)[] {
  const said = [fault.message, ...fault.causes].join(": ");
  if (fault.kind !== "internal") return withCode(said);
  const isMemory = /memory|allocation|unreachable executed/i.test(said);
  return [isMemory ? `${say("memory")} (${said})` : say("internal", { why: said })];
}

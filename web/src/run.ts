// Work that takes a while: its stage, the time that is left, and a way to end it.

import { inWords } from "./answer";
import { h } from "./dom";
import type { Engine } from "./engine";
import type { Fault, Progress } from "./protocol";
import { say } from "./strings";

export type Tell = (progress: Progress) => void;

export class Run {
  readonly bar: HTMLProgressElement;
  readonly status: HTMLElement;
  readonly fault: HTMLElement;
  readonly stop: HTMLButtonElement;
  private began = 0;
  private stage = { name: "", began: 0 };

  /** `name` is that of its elements; `button` begins it. */
  constructor(
    name: string,
    private readonly engine: Engine,
    private readonly button: HTMLButtonElement,
  ) {
    this.bar = h("progress", { id: `${name}-bar`, hidden: true, "aria-label": button.textContent ?? name });
    this.status = h("p", { id: `${name}-status`, role: "status", "aria-live": "polite" });
    this.fault = h("p", { class: "fault", role: "alert", id: `${name}-fault`, hidden: true });
    this.stop = h("button", { type: "button", id: `${name}-cancel`, hidden: true, onclick: () => this.engine.cancel() }, say("cancel"));
  }

  /** Since it began, s. */
  get seconds(): number {
    return (performance.now() - this.began) / 1000;
  }

  private readonly tell: Tell = ({ stage, steps, done }) => {
    if (steps > 0) {
      this.bar.max = steps;
      this.bar.value = done;
    } else this.bar.removeAttribute("value");
    if (this.stage.name !== stage) this.stage = { name: stage, began: performance.now() };
    const inStage = (performance.now() - this.stage.began) / 1000;
    const left = steps > 0 && done > 0 ? `, ${say("left", { s: Math.max(1, Math.round((inStage * (steps - done)) / done)) })}` : "";
    this.status.textContent = `${stage}${steps > 0 ? ` ${done}/${steps}` : ""}, ${say("elapsed", { s: this.seconds.toFixed(1) })}${left}`;
  };

  private busy(is: boolean): void {
    this.button.disabled = is;
    this.stop.hidden = this.bar.hidden = !is;
    this.bar.removeAttribute("value");
  }

  /** Does the work, and says what came of it; what went wrong is returned. */
  async of(work: (tell: Tell) => Promise<string>): Promise<Fault | null> {
    this.began = performance.now();
    this.busy(true);
    this.failed(null);
    try {
      this.status.textContent = await work(this.tell);
      return null;
    } catch (error) {
      const fault = error as Fault;
      this.status.textContent = fault.kind === "cancelled" ? say("cancelled") : "";
      if (fault.kind !== "cancelled") this.failed(fault);
      return fault;
    } finally {
      this.busy(false);
    }
  }

  failed(fault: Fault | string | null): void {
    this.fault.hidden = fault === null;
    if (fault !== null) this.fault.replaceChildren(...(typeof fault === "string" ? [fault] : inWords(fault)));
  }
}

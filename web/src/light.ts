// The panel of the light that moves: sliders for everything that a tolerance is about.

import { h } from "./dom";
import type { Engine } from "./engine";
import { LiveLight, poseOf, slidersOf, type Pose, type Slider, type SliderName } from "../../src/report/html/photons.js";
import type { Reply, Stand } from "./protocol";
import { number, say, type Words } from "./strings";

/** Pixels across, of the picture and of the comparison. */
const ACROSS = 384;
const COMPARED = 128;
const LABELS: Record<SliderName, keyof Words> = {
  distance: "poseDistance",
  wallTilt: "poseWallTilt",
  blockTilt: "poseBlockTilt",
  lightX: "poseLightX",
  lightY: "poseLightY",
  source: "poseSource",
  index: "poseIndex",
  wavelength: "poseWavelength",
};

export class LightPanel {
  readonly element: HTMLElement;
  private readonly canvas = h("canvas", { role: "img", "aria-label": say("moving"), class: "moving", width: ACROSS, height: ACROSS });
  private readonly sliders = new Map<SliderName, { input: HTMLInputElement; output: HTMLOutputElement; row: HTMLElement; slider: Slider | null }>();
  private readonly note = h("p", { class: "note", "aria-live": "polite", id: "moving-note" });
  private readonly rate = h("span", { class: "note", id: "moving-rate" });
  private live: LiveLight | null = null;
  private stand: Stand | null = null;
  private engine: Engine | null = null;

  constructor() {
    this.element = h(
      "section",
      { class: "panel", "aria-labelledby": "moving-title" },
      h("h2", { id: "moving-title" }, say("moving")),
      h("p", { class: "hint" }, say("movingHelp")),
      this.canvas,
      h("div", { class: "sliders" }, ...this.rows()),
      h(
        "div",
        { class: "row" },
        h("button", { type: "button", id: "pose-reset", onclick: () => this.reset() }, say("resetPose")),
        h("button", { type: "button", id: "pose-check", onclick: () => void this.check() }, say("selfCheck")),
        this.rate,
      ),
      this.note,
    );
    try {
      this.live = new LiveLight(this.canvas);
    } catch {
      this.canvas.hidden = true;
      this.note.textContent = say("noWebgl");
    }
  }

  private rows(): HTMLElement[] {
    return Object.entries(LABELS).map(([name, label]) => {
      const output = h("output", {});
      const input = h("input", { type: "range", id: `pose-${name}`, oninput: () => this.moved() });
      const row = h("label", {}, h("span", {}, say(label), " ", output), input);
      this.sliders.set(name as SliderName, { input, output, row, slider: null });
      return row;
    });
  }

  /** Takes a block, and the engine whose verifier knows it. */
  take(mesh: Float32Array, stand: Stand, white: number, engine: Engine): void {
    const isNew = JSON.stringify(this.stand) !== JSON.stringify(stand);
    Object.assign(this, { stand, engine });
    if (!this.live) return;
    const nodes = Math.round(Math.sqrt(mesh.length / 5));
    try {
      this.live.take(mesh, nodes, nodes, stand, ACROSS, white);
    } catch {
      this.live = null;
      this.canvas.hidden = true;
      this.note.textContent = say("noWebgl");
      return;
    }
    const known = new Map(slidersOf(stand).map((slider) => [slider.name, slider]));
    for (const [name, row] of this.sliders) {
      row.slider = known.get(name) ?? null;
      row.row.hidden = row.slider === null;
      if (row.slider) Object.assign(row.input, { min: String(row.slider.min), max: String(row.slider.max), step: String(row.slider.step) });
    }
    this.note.textContent = stand.unsaid === null ? "" : say("lightMissing");
    if (isNew) this.reset();
    else this.moved();
  }

  /** Puts every slider where the design has it. */
  private reset(): void {
    for (const { input, slider } of this.sliders.values()) if (slider) input.value = String(slider.value);
    this.moved();
  }

  /** The pose that the sliders show. */
  private pose(): Pose | null {
    const values = Object.fromEntries([...this.sliders].map(([name, { input }]) => [name, Number(input.value)]));
    return this.stand && poseOf(this.stand, values as Record<SliderName, number>);
  }

  private moved(): void {
    for (const { input, output, slider } of this.sliders.values()) if (slider) output.value = `${number(Number(input.value), slider.digits)} ${slider.unit}`;
    const pose = this.pose();
    if (pose) this.live?.show(pose);
  }

  /** Draws frames as fast as they come, and tells how fast that is. */
  async measure(frames: number): Promise<number> {
    const pose = this.pose();
    if (!pose || !this.live) return 0;
    const begin = performance.now();
    for (let k = 0; k < frames; k++) {
      this.live.draw({ ...pose, distance_mm: pose.distance_mm * (1 + 0.001 * k) });
      this.live.photons.finish();
      if (k % 4 === 3) await new Promise(requestAnimationFrame);
    }
    const rate = (1000 * frames) / (performance.now() - begin);
    this.rate.textContent = say("fps", { fps: rate.toFixed(0) });
    return rate;
  }

  /** The light of this pose against the verifier's beams: what each says of the same pixels. */
  async check(): Promise<number | null> {
    const { stand, engine, live } = this;
    const pose = this.pose();
    if (!stand || !engine || !live || !pose) return null;
    const asked = {
      ior: pose.ior,
      "distance-mm": pose.distance_mm,
      "receiver-turned": pose.receiver_turned,
      "block-turned": pose.block_turned,
      direction: pose.direction,
      "position-mm": pose.position_mm,
    };
    try {
      const found = await engine.call<Reply<{ pixels: [number, number] }>>({ method: "pose", args: [JSON.stringify(asked), COMPARED] });
      const truth = found.arrays.light as Float32Array;
      const own = live.photons.light(pose, COMPARED);
      const error = relativeRms(own, truth);
      this.note.textContent = say("selfCheckResult", { error: number(100 * error, 2), n: found.facts.pixels[0] });
      await this.measure(12);
      return error;
    } catch (fault) {
      this.note.textContent = (fault as { message?: string }).message ?? String(fault);
      return null;
    } finally {
      live.show(pose);
    }
  }
}

/** Root mean square of the difference of two lights of mean 1. */
export function relativeRms(a: Float32Array, b: Float32Array): number {
  const mean = (values: Float32Array) => values.reduce((sum, value) => sum + value, 0) / values.length;
  const [ma, mb] = [mean(a), mean(b)];
  let sum = 0;
  for (let k = 0; k < a.length; k++) sum += (a[k] / ma - b[k] / mb) ** 2;
  return Math.sqrt(sum / a.length);
}

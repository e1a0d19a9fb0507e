// The panel of the light that moves: sliders for everything that a tolerance is about.

import { h } from "./dom";
import type { Engine } from "./engine";
import { designPose, MOVING, Photons, RESTING, type Pose } from "./photons";
import type { Reply, Stand, Vec3 } from "./protocol";
import { number, say, type Words } from "./strings";

/** Pixels across, of the picture and of the comparison. */
const ACROSS = 384;
const COMPARED = 128;
/** Points of a source that are drawn for a frame: as many as a frame of so many ms has time for. */
const POINTS = 6;
const FRAME = 45;

type Slider = "distance" | "wallTilt" | "blockTilt" | "lightX" | "lightY" | "source" | "index";

interface Range {
  label: keyof Words;
  min: number;
  max: number;
  step: number;
  digits: number;
  unit: string;
}

const DEG = Math.PI / 180;

export class LightPanel {
  readonly element: HTMLElement;
  private readonly canvas = h("canvas", { role: "img", "aria-label": say("moving"), class: "moving", width: ACROSS, height: ACROSS });
  private readonly sliders = new Map<Slider, { input: HTMLInputElement; output: HTMLOutputElement; row: HTMLElement; range: Range }>();
  private readonly note = h("p", { class: "note", "aria-live": "polite", id: "moving-note" });
  private readonly rate = h("span", { class: "note", id: "moving-rate" });
  private photons: Photons | null = null;
  private stand: Stand | null = null;
  private engine: Engine | null = null;
  private white = 1;
  private frame = 0;
  private rest = 0;
  private points = 1;

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
      this.photons = new Photons(this.canvas);
    } catch {
      this.canvas.hidden = true;
      this.note.textContent = say("noWebgl");
    }
  }

  private rows(): HTMLElement[] {
    const ranges: Record<Slider, Range> = {
      distance: { label: "poseDistance", min: 50, max: 500, step: 1, digits: 0, unit: "mm" },
      wallTilt: { label: "poseWallTilt", min: -45, max: 45, step: 0.5, digits: 1, unit: "°" },
      blockTilt: { label: "poseBlockTilt", min: -20, max: 20, step: 0.1, digits: 1, unit: "°" },
      lightX: { label: "poseLightX", min: -30, max: 30, step: 0.1, digits: 1, unit: "°" },
      lightY: { label: "poseLightY", min: -30, max: 30, step: 0.1, digits: 1, unit: "°" },
      source: { label: "poseSource", min: 0, max: 2, step: 0.01, digits: 2, unit: "°" },
      index: { label: "poseIndex", min: 1.3, max: 1.8, step: 0.001, digits: 3, unit: "" },
    };
    return Object.entries(ranges).map(([name, range]) => {
      const output = h("output", {});
      const input = h("input", { type: "range", id: `pose-${name}`, min: range.min, max: range.max, step: range.step, oninput: () => this.moved() });
      const row = h("label", {}, h("span", {}, say(range.label), " ", output), input);
      this.sliders.set(name as Slider, { input, output, row, range });
      return row;
    });
  }

  /** Takes a block, and the engine whose verifier knows it. */
  take(mesh: Float32Array, stand: Stand, white: number, engine: Engine): void {
    const isNew = this.stand === null || this.stand.light.kind !== stand.light.kind;
    const before = this.stand;
    Object.assign(this, { stand, white, engine });
    if (!this.photons) return;
    try {
      this.photons.take(mesh, stand, ACROSS);
    } catch {
      this.photons = null;
      this.canvas.hidden = true;
      this.note.textContent = say("noWebgl");
      return;
    }
    this.points = this.paced();
    this.set("distance", { min: Math.max(1, Math.round(0.4 * stand.distance_mm)), max: Math.round(1.8 * stand.distance_mm) });
    this.set("source", stand.light.kind === "point" ? { max: 40, step: 0.1, unit: "mm" } : { max: 2, step: 0.01, unit: "°" });
    const index = this.sliders.get("index");
    if (index) index.row.hidden = stand.ior === null;
    this.note.textContent = stand.light.kind === "point" && stand.light.emission === "table" ? say("lightMissing") : "";
    if (isNew || JSON.stringify(before) !== JSON.stringify(stand)) this.reset();
    else this.moved();
  }

  /** How many points of a source there is time for. */
  private paced(): number {
    const { photons, stand } = this;
    if (!photons || !stand) return 1;
    const begin = performance.now();
    photons.begin(designPose(stand), MOVING);
    photons.add(1);
    photons.finish();
    return Math.min(POINTS, Math.max(1, Math.floor(FRAME / (performance.now() - begin))));
  }

  private set(name: Slider, changes: Partial<Range>): void {
    const slider = this.sliders.get(name);
    if (!slider) return;
    Object.assign(slider.range, changes);
    Object.assign(slider.input, { min: String(slider.range.min), max: String(slider.range.max), step: String(slider.range.step) });
  }

  private value(name: Slider): number {
    return Number(this.sliders.get(name)?.input.value ?? 0);
  }

  /** Puts every slider where the design has it. Angles are counted from the design's own. */
  private reset(): void {
    const { stand } = this;
    if (!stand) return;
    const radius = stand.source_radius?.[0] ?? 0;
    const source = stand.light.kind === "point" ? 2 * radius : (2 * radius) / DEG;
    const values: Record<Slider, number> = { distance: stand.distance_mm, wallTilt: 0, blockTilt: 0, lightX: 0, lightY: 0, source, index: stand.ior ?? 1 };
    for (const [name, value] of Object.entries(values)) {
      const slider = this.sliders.get(name as Slider);
      if (slider) slider.input.value = String(value);
    }
    this.moved();
  }

  /** The pose that the sliders show. */
  private pose(): Pose | null {
    const { stand } = this;
    if (!stand) return null;
    const pose = designPose(stand);
    const near = (value: number, design: number, step: number) => (Math.abs(value - design) <= 0.51 * step ? design : value);
    pose.distance_mm = near(this.value("distance"), stand.distance_mm, 1);
    if (stand.ior !== null) pose.ior = near(this.value("index"), stand.ior, 0.001);
    pose.receiver_turned = [stand.receiver_turned[0] - this.value("wallTilt") * DEG, stand.receiver_turned[1], stand.receiver_turned[2]];
    pose.block_turned = [this.value("blockTilt") * DEG, 0, 0];
    const [aside, above] = [this.value("lightX") * DEG, this.value("lightY") * DEG];
    if (pose.direction) {
      const [x, y, z] = pose.direction;
      pose.direction = turned([x, y, z], above, aside);
    } else if (pose.position_mm) {
      pose.position_mm = turned(pose.position_mm, above, aside);
    }
    const size = this.value("source");
    const radius = stand.light.kind === "point" ? 0.5 * size : 0.5 * size * DEG;
    const design = stand.source_radius ?? [0, 0];
    const ratio = design[0] > 0 ? design[1] / design[0] : 1;
    pose.source_radius = [radius, radius * ratio];
    return pose;
  }

  private moved(): void {
    for (const { input, output, range } of this.sliders.values()) output.value = `${number(Number(input.value), range.digits)} ${range.unit}`;
    cancelAnimationFrame(this.frame);
    clearTimeout(this.rest);
    this.frame = requestAnimationFrame(() => this.draw());
    this.rest = window.setTimeout(() => this.refine(true), 200);
  }

  /** At once, and roughly. */
  private draw(): void {
    const pose = this.pose();
    if (!pose || !this.photons) return;
    this.photons.begin(pose, MOVING);
    this.photons.add(this.points);
    this.photons.display(this.white);
  }

  /** Finely, a few points of the source in every frame. */
  private refine(isFirst: boolean): void {
    const pose = this.pose();
    if (!pose || !this.photons) return;
    if (isFirst) this.photons.begin(pose, RESTING);
    const isMore = this.photons.add(this.points);
    this.photons.display(this.white);
    if (isMore) this.frame = requestAnimationFrame(() => this.refine(false));
  }

  /** Draws frames as fast as they come, and tells how fast that is. */
  async measure(frames: number): Promise<number> {
    const pose = this.pose();
    if (!pose || !this.photons) return 0;
    const begin = performance.now();
    for (let k = 0; k < frames; k++) {
      this.photons.begin({ ...pose, distance_mm: pose.distance_mm * (1 + 0.001 * k) }, MOVING);
      this.photons.add(this.points);
      this.photons.display(this.white);
      this.photons.finish();
      if (k % 4 === 3) await new Promise(requestAnimationFrame);
    }
    const rate = (1000 * frames) / (performance.now() - begin);
    this.rate.textContent = say("fps", { fps: rate.toFixed(0) });
    return rate;
  }

  /** The light of this pose against the verifier's beams: what each says of the same pixels. */
  async check(): Promise<number | null> {
    const { stand, engine, photons } = this;
    const pose = this.pose();
    if (!stand || !engine || !photons || !pose) return null;
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
      const own = photons.light(pose, COMPARED);
      const error = relativeRms(own, truth);
      this.note.textContent = say("selfCheckResult", { error: number(100 * error, 2), n: found.facts.pixels[0] });
      await this.measure(12);
      return error;
    } catch (fault) {
      this.note.textContent = (fault as { message?: string }).message ?? String(fault);
      return null;
    } finally {
      this.refine(true);
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

/** A vector turned: so that it comes more from above, then more from the side (the picture's right, -x). */
function turned([x, y, z]: Vec3, above: number, aside: number): Vec3 {
  const [c, s] = [Math.cos(above), Math.sin(above)];
  const [y1, z1] = [c * y - s * z, s * y + c * z];
  const [d, t] = [Math.cos(aside), Math.sin(aside)];
  return [d * x + t * z1, y1, d * z1 - t * x];
}

// The bench from the side, to scale: the light from the left, the block, the wall. Wall, light and block can be taken and pulled.
// Horizontal is the axis (z), vertical is up (y).

import { h, svg } from "./dom";
import { rotation } from "../../src/report/html/photons.js";
import { path } from "./optics";
import type { Stand, Vec3 } from "./protocol";
import { inMm, type State } from "./state";
import { number, say } from "./strings";

const WIDTH = 900;
const HEIGHT = 340;
const RAYS = 9;

interface Scale {
  x(z: number): number;
  y(y: number): number;
  mm: number;
}

type Drag = "wall" | "light" | "size";

export class BenchView {
  readonly element: HTMLElement;
  private readonly drawing = svg("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "group", class: "bench-view", "aria-labelledby": "drawing-title" });
  private stand: Stand | null = null;
  private mesh: Float32Array | null = null;
  /** The scale stays while something is pulled. */
  private scale: Scale | null = null;
  private dragging: Drag | null = null;
  private handles = new Map<Drag, SVGGElement>();

  constructor(private readonly state: State) {
    this.element = h(
      "figure",
      { class: "bench-figure" },
      this.drawing,
      h("figcaption", {}, h("strong", { id: "drawing-title" }, say("drawingTitle")), ` ${say("drawingHelp")}`),
    );
    for (const drag of ["wall", "light", "size"] as Drag[]) this.handles.set(drag, this.handle(drag));
  }

  private get distance(): number {
    return inMm(this.state.settings.distance) ?? this.stand?.distance_mm ?? 250;
  }
  private get size(): number {
    return inMm(this.state.settings.size) ?? 100;
  }
  private get tilt(): { deg: number; side: number } {
    const [deg, side] = String(this.state.settings.tilt ?? "0deg").split(",").map((text) => Number.parseFloat(text));
    return { deg: Number.isFinite(deg) ? deg : 0, side: Number.isFinite(side) ? side : 0 };
  }
  private get isMirror(): boolean {
    return this.state.settings.mirror === true;
  }

  private handle(drag: Drag): SVGGElement {
    const label = { wall: "wall", light: "lightHandle", size: "sizeHandle" } as const;
    const handle = svg("g", { class: `handle ${drag}`, tabindex: 0, role: "slider", id: `handle-${drag}`, "aria-label": say(label[drag]) });
    handle.addEventListener("pointerdown", (event) => {
      this.dragging = drag;
      // Where it is taken does not make it jump.
      this.offset = this.valueAt(drag, event) - this.value(drag);
      handle.setPointerCapture(event.pointerId);
      event.preventDefault();
      handle.focus();
    });
    handle.addEventListener("pointermove", (event) => {
      if (this.dragging === drag) this.pull(drag, this.valueAt(drag, event) - this.offset, true);
    });
    const end = () => {
      if (this.dragging !== drag) return;
      this.dragging = null;
      this.pull(drag, this.value(drag), false);
      this.scale = null;
      this.draw();
    };
    handle.addEventListener("pointerup", end);
    handle.addEventListener("pointercancel", end);
    handle.addEventListener("keydown", (event) => {
      const step = { wall: 10, light: 1, size: 5 }[drag] * (event.shiftKey ? 5 : 1);
      const sign = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
      if (sign === undefined) return;
      event.preventDefault();
      this.pull(drag, this.value(drag) + sign * step, false);
    });
    return handle;
  }

  private offset = 0;

  private value(drag: Drag): number {
    return { wall: this.distance, light: this.signedTilt, size: this.size }[drag];
  }

  /** Degrees from above; negative from below. */
  private get signedTilt(): number {
    const { deg, side } = this.tilt;
    return Math.round(side) === 180 ? -deg : deg;
  }

  private valueAt(drag: Drag, event: PointerEvent): number {
    const box = this.drawing.getBoundingClientRect();
    const scale = this.scale ?? this.fitted();
    const [px, py] = [((event.clientX - box.left) / box.width) * WIDTH, ((event.clientY - box.top) / box.height) * HEIGHT];
    const z = (px - scale.x(0)) / scale.mm;
    const y = (scale.y(0) - py) / scale.mm;
    if (drag === "wall") return z;
    if (drag === "size") return (2 * y) / this.aspect;
    return (Math.atan2(y, this.isMirror ? z : -z) * 180) / Math.PI;
  }

  private get aspect(): number {
    return this.stand ? this.stand.face_mm[1] / this.stand.face_mm[0] : 1;
  }

  private pull(drag: Drag, value: number, dragging: boolean): void {
    if (drag === "wall") this.state.set({ distance: `${Math.max(5, Math.round(value))}mm` }, dragging);
    else if (drag === "size") this.state.set({ size: `${Math.max(5, Math.round(value))}mm` }, dragging);
    else {
      const deg = Math.round(Math.min(75, Math.abs(value)));
      const side = this.tilt.side % 180 === 0 ? (value < 0 ? ",180deg" : "") : `,${this.tilt.side}deg`;
      this.state.set({ tilt: deg === 0 ? null : `${deg}deg${side}` }, dragging);
    }
  }

  /** Takes what the library found of the bench. */
  show(stand: Stand, mesh: Float32Array): void {
    this.stand = stand;
    this.mesh = mesh;
    this.draw();
  }

  private fitted(): Scale {
    const far = this.distance;
    const before = this.isMirror ? 0.06 * far : Math.max(0.35 * far, 1.1 * this.size * 0.5);
    const { window_mm = [0, 0], window_centre_mm = [0, 0] } = this.stand ?? {};
    const high = Math.max(this.size * this.aspect, this.size, window_mm[1] * 1.2 + 2 * Math.abs(window_centre_mm[1])) * 1.25;
    const mm = Math.min((WIDTH - 80) / (far + before), (HEIGHT - 60) / high);
    const left = (WIDTH - mm * (far + before)) / 2 + mm * before;
    return { mm, x: (z) => left + mm * z, y: (y) => HEIGHT / 2 - 8 - mm * y };
  }

  draw(): void {
    if (!this.dragging || !this.scale) this.scale = this.fitted();
    const scale = this.scale;
    const { x, y, mm } = scale;
    const half = 0.5 * this.size * this.aspect;
    const stand = this.stand;
    const parts: SVGElement[] = [svg("line", { class: "axis", x1: 0, y1: y(0), x2: WIDTH, y2: y(0) })];
    // Rays are those of the last draft, on the bench as it is now.
    if (stand && this.mesh) parts.push(...this.rays({ ...stand, distance_mm: this.distance }, scale));
    const thick = stand ? -stand.entry_z_mm : 8;
    const profile = this.profile();
    const top = profile.map(([py, pz]) => `${x(pz * 1)},${y(py)}`);
    parts.push(svg("polygon", { class: this.isMirror ? "mirror" : "glass", points: [`${x(-thick)},${y(-half)}`, ...top, `${x(-thick)},${y(half)}`].join(" ") }));
    // The scale bar: a round number of mm.
    const bar = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000].findLast((length) => length * mm < 160) ?? 1;
    parts.push(
      svg("path", { class: "bar", d: `M20,${HEIGHT - 14} v-6 h${bar * mm} v6` }),
      svg("text", { x: 20 + (bar * mm) / 2, y: HEIGHT - 26, "text-anchor": "middle" }, `${bar} mm`),
    );
    this.drawHandles(scale, half);
    // Handles stay in the document: what is pulled must not vanish under the pointer.
    for (const old of [...this.drawing.children]) if (!(old as SVGElement).classList.contains("handle")) old.remove();
    this.drawing.prepend(...parts);
    for (const handle of this.handles.values()) if (!handle.parentNode) this.drawing.append(handle);
  }

  /** The middle column of the face, from below up: y and z, mm. */
  private profile(): [number, number][] {
    const half = 0.5 * this.size * this.aspect;
    if (!this.mesh || !this.stand) return [[-half, 0], [half, 0]];
    const across = Math.round(Math.sqrt(this.mesh.length / 5));
    const middle = (across - 1) / 2;
    const shrunk = (2 * half) / this.stand.face_mm[1];
    return Array.from({ length: across }, (_, j) => {
      const k = 5 * (j * across + middle);
      return [(this.mesh as Float32Array)[k + 1] * shrunk, (this.mesh as Float32Array)[k + 2]];
    });
  }

  private rays(stand: Stand, { x, y }: Scale): SVGElement[] {
    const mesh = this.mesh as Float32Array;
    const across = Math.round(Math.sqrt(mesh.length / 5));
    return Array.from({ length: RAYS }, (_, k) => {
      const j = Math.round(((k + 0.5) / RAYS) * (across - 1));
      const at = 5 * (j * across + (across - 1) / 2);
      const way = path(stand, [mesh[at], mesh[at + 1], mesh[at + 2]], [mesh[at + 3], mesh[at + 4]]);
      return way && svg("polyline", { class: "ray", points: way.map((p) => `${x(p[2])},${y(p[1])}`).join(" ") });
    }).filter((ray): ray is SVGPolylineElement => ray !== null);
  }

  private drawHandles({ x, y, mm }: Scale, half: number): void {
    const far = this.distance;
    const up: Vec3 = rotation(this.stand?.receiver_turned ?? [0, 0, 0])[1];
    const reach = 0.5 * (this.stand?.window_mm[1] ?? 2 * half);
    const middle = this.stand?.window_centre_mm[1] ?? 0;
    const wallAt = (along: number): [number, number] => [x(far + up[2] * along), y(up[1] * along)];
    const [a, b] = [wallAt(middle - reach * 1.2), wallAt(middle + reach * 1.2)];
    const [c, d] = [wallAt(middle - reach), wallAt(middle + reach)];
    this.fill("wall", `${number(far, 0)} mm`, far, 5, 10000, [
      svg("line", { class: "grip", x1: a[0], y1: a[1], x2: b[0], y2: b[1] }),
      svg("line", { class: "wall-line", x1: a[0], y1: a[1], x2: b[0], y2: b[1] }),
      svg("line", { class: "picture-line", x1: c[0], y1: c[1], x2: d[0], y2: d[1] }),
      svg("text", { x: Math.min(b[0], WIDTH - 40), y: Math.max(14, b[1] - 6), "text-anchor": "middle" }, `${number(far, 0)} mm`),
    ]);
    const sun = this.lightAt({ x, y, mm });
    const angle = this.signedTilt;
    this.fill("light", `${angle}°`, angle, -75, 75, [
      svg("circle", { class: "grip", cx: sun[0], cy: sun[1], r: 22 }),
      svg("circle", { class: "sun", cx: sun[0], cy: sun[1], r: 9 }),
      svg("text", { x: sun[0], y: sun[1] + 36, "text-anchor": "middle" }, `${angle}°`),
    ]);
    const edge: [number, number] = [x(this.stand ? 0.5 * this.stand.entry_z_mm : -4), y(half)];
    this.fill("size", `${number(this.size, 0)} mm`, this.size, 5, 2000, [
      svg("circle", { class: "grip", cx: edge[0], cy: edge[1], r: 18 }),
      svg("circle", { class: "knob", cx: edge[0], cy: edge[1], r: 6 }),
      svg("text", { x: edge[0], y: Math.max(14, edge[1] - 12), "text-anchor": "middle" }, `${number(this.size, 0)} mm`),
    ]);
  }

  private lightAt({ x, y, mm }: Scale): [number, number] {
    const angle = (this.signedTilt * Math.PI) / 180;
    const away = Math.min(this.isMirror ? x(this.distance) - x(0) - 30 : x(0) - 30, (HEIGHT / 2 - 30) / Math.max(0.3, Math.abs(Math.sin(angle))));
    const sense = this.isMirror ? 1 : -1;
    return [x(0) + sense * away * Math.cos(angle), y((away * Math.sin(angle)) / mm)];
  }

  private fill(drag: Drag, text: string, value: number, min: number, max: number, parts: SVGElement[]): void {
    const handle = this.handles.get(drag);
    if (!handle) return;
    handle.setAttribute("aria-valuenow", String(Math.round(value)));
    handle.setAttribute("aria-valuetext", text);
    handle.setAttribute("aria-valuemin", String(min));
    handle.setAttribute("aria-valuemax", String(max));
    handle.replaceChildren(...parts);
  }
}

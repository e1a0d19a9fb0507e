// Where the module and the worker come from is the one difference between the hosted page and the file on a disk (vite.config.ts).
declare module "virtual:glasswarp" {
  export function compiledModule(): Promise<WebAssembly.Module>;
  export function newWorker(): Worker;
}

// What the report draws its light with, too.
declare module "*/photons.js" {
  type Vec3 = import("./protocol").Vec3;
  type Stand = import("./protocol").Stand;

  export interface Pose {
    ior: number | null;
    distance_mm: number;
    receiver_turned: Vec3;
    block_turned: Vec3;
    direction: Vec3 | null;
    position_mm: Vec3 | null;
    /** Radians of parallel light, mm of a source. */
    source_radius: [number, number];
  }

  export type SliderName = "distance" | "wallTilt" | "blockTilt" | "lightX" | "lightY" | "source" | "index" | "wavelength";

  export interface Slider {
    name: SliderName;
    min: number;
    max: number;
    step: number;
    digits: number;
    unit: string;
    value: number;
  }

  export class LiveLight {
    constructor(canvas: HTMLCanvasElement);
    readonly photons: { light(pose: Pose, across: number): Float32Array; finish(): void };
    take(mesh: Float32Array, nx: number, ny: number, stand: Stand, across: number, white: number, isLinear?: boolean): void;
    show(pose: Pose): void;
    draw(pose?: Pose): void;
  }

  export const normalised: (v: Vec3) => Vec3;
  export function rotation(vector: Vec3): [Vec3, Vec3, Vec3];
  export function slidersOf(stand: Stand): Slider[];
  export function poseOf(stand: Stand, values: Record<SliderName, number>): Pose;
}

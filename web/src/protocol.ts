// What the page and its worker say to each other, and what the library answers. Lengths are mm, angles radians unless a name says otherwise.

export type Settings = Record<string, string | number | boolean | null>;

export interface Setting {
  name: string;
  group: string;
  value: string;
  help: string;
  more: string;
  choices: { name: string; help: string }[];
  is_switch: boolean;
  rare: boolean;
}

export interface Catalogue {
  version: string;
  settings: Setting[];
  materials: { name: string; description: string; ior: number }[];
  presets: { name: string; help: string; settings: Settings }[];
}

export interface PictureFacts {
  size: [number, number];
  shown: [number, number];
  line: string | null;
  rows: [string, string][];
  warnings: string[];
}

export type StandingLight =
  | { kind: "parallel"; direction: Vec3 }
  | { kind: "point"; position_mm: Vec3; axis: Vec3; emission: string; half_angle: number };

export type Vec3 = [number, number, number];

export interface Stand {
  ior: number | null;
  face_mm: [number, number];
  /** Semi-axes of the face's corners; 0 of a rectangle. */
  corner_mm: [number, number];
  stock_mm: [number, number];
  entry_z_mm: number;
  top_z_mm: number;
  distance_mm: number;
  receiver_turned: Vec3;
  window_mm: [number, number];
  window_centre_mm: [number, number];
  light: StandingLight;
  source_radius: [number, number] | null;
  /** The index at wavelengths, where it is known how the material's follows them. */
  spectrum: { design_nm: number; first_nm: number; step_nm: number; ior: number[] } | null;
  /** What of the light these numbers do not say. */
  unsaid: string | null;
}

export interface Flux {
  window: number;
  missed: number;
  totally_reflected: number;
  side: number;
}

export interface Facts {
  picture: string | null;
  warnings: string[];
  block: { width_mm: number; height_mm: number; thickness_mm: number; relief_mm: number; thinnest_mm: number; nodes: [number, number] };
  bench: { ior: number | null; light: string };
  receiver: string;
  light: Flux;
  rel_rms: number | null;
  ssim: number | null;
  seen: string;
  least_radius_mm: number | null;
  steepest_degrees: number;
  order: string;
  pixels: [number, number];
  solver_notes: string[];
  iterations: number;
  levels_at_limit: number;
  settings: Settings;
  command: string;
  design_toml: string;
  /** Irradiance that becomes white in the pictures; the mean is 1. */
  white: number;
  stand: Stand;
}

export interface Verified {
  verdict: { answer: string; says: string; concerns: { question: string; answer: string; says: string }[] };
  judgement: {
    pixels: [number, number];
    picture: { rel_rms: number | null; ssim: number | null; psnr_db: number | null; photons_rel_rms: number | null } | null;
    photons: number;
    light: Flux;
  };
  agreement: string;
  budget: { name: string; rel_rms: number | null; ssim: number | null; moved: number | null }[];
  faults: [string, number | null][];
  seen: [string, number | null, number | null] | null;
  pixels: [number, number];
  file: string;
}

export interface Ready {
  verdict: Verified["verdict"];
  lines: { what: string; passed: boolean; says: string }[];
  steps: { name: string; rel_rms: number | null; ssim: number | null }[];
  /** What is off, and the SSIM that it leaves. */
  faults: [string, number | null][];
  light: string;
  order: string;
  rows: number;
  minutes: number;
  pixels: [number, number];
}

export interface Reply<F> {
  facts: F;
  arrays: Record<string, Uint8Array | Float32Array>;
}

export interface Fault {
  kind: "cancelled" | "file" | "refused" | "fell-short" | "invalid-mesh" | "internal";
  message: string;
  causes: string[];
}

export interface Progress {
  stage: string;
  steps: number;
  done: number;
  iterations: number;
}

/** What the worker can be asked: names and arguments of the module's functions. */
export type Call =
  | { method: "catalogue"; args: [] }
  | { method: "fault_of"; args: [settings: string] }
  | { method: "read_design"; args: [text: string, name: string] }
  | { method: "put"; args: [name: string, bytes: Uint8Array] }
  | { method: "forget"; args: [name: string] }
  | { method: "picture"; args: [settings: string, across: number] }
  | { method: "reduced"; args: [settings: string, across: number] }
  | { method: "draft"; args: [settings: string, nodes: number, pixels: number, mesh: number] }
  | { method: "make"; args: [settings: string, pixels: number, mesh: number] }
  | { method: "heights"; args: [] }
  | { method: "pose"; args: [pose: string, pixels: number] }
  | { method: "file"; args: [name: string] }
  | { method: "side_file"; args: [name: string] }
  | { method: "verify"; args: [name: string] }
  | { method: "report"; args: [title: string] }
  | { method: "ready"; args: [name: string, asked: string] }
  | { method: "sheet"; args: [] }
  /** Files of the block and their side file, with others, packed. */
  | { method: "zip"; args: [names: string[], side: string, others: Record<string, Uint8Array>] }
  | { method: "memory"; args: [] }
  /** Before anything that computes. */
  | { method: "start_threads"; args: [count: number] };

/** From the page: first the module, in how many threads it may compute; then calls. With a memory it is a helper's, which hears no calls. */
export type ToWorker = Start | Help | ({ id: number } & Call);
export interface Start {
  module: WebAssembly.Module;
  stop: Int32Array | null;
}
export interface Help {
  module: WebAssembly.Module;
  memory: WebAssembly.Memory;
}

export type FromWorker =
  /** Started; helpers share this memory. */
  | { memory: WebAssembly.Memory | null }
  | { id: number; answer: unknown }
  | { id: number; fault: Fault }
  | { id: number; progress: Progress };

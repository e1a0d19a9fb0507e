// What is kept in the browser: the picture, and the last designs. A page from a disk, or a private window, may have no place for it.

import { get, set } from "idb-keyval";
import type { Facts, Settings } from "./protocol";
import type { Picture } from "./state";

export interface KeptDesign {
  when: number;
  settings: Settings;
  picture: Picture;
  nodes: [number, number];
  rel_rms: number | null;
  light: Uint8Array;
  pixels: [number, number];
}

const MOST_DESIGNS = 5;

export async function keepPicture(picture: Picture | null): Promise<void> {
  await set("picture", picture);
}

export const keptPicture = (): Promise<Picture | null> => get<Picture>("picture").then((found) => found ?? null).catch(() => null);

export async function keepFiles(files: Map<string, Uint8Array>): Promise<void> {
  await set("files", [...files]);
}

export const keptFiles = (): Promise<[string, Uint8Array][]> => get<[string, Uint8Array][]>("files").then((found) => found ?? []).catch(() => []);

export const keptDesigns = (): Promise<KeptDesign[]> => get<KeptDesign[]>("designs").then((found) => found ?? []).catch(() => []);

export async function keepDesign(settings: Settings, picture: Picture, facts: Facts, light: Uint8Array): Promise<void> {
  const design = { when: Date.now(), settings, picture, nodes: facts.block.nodes, rel_rms: facts.rel_rms, light, pixels: facts.pixels };
  await set("designs", [design, ...(await keptDesigns())].slice(0, MOST_DESIGNS));
}

// What the page designs: settings with undo and redo, also in the address, and the picture.

import type { Settings } from "./protocol";

export interface Picture {
  name: string;
  bytes: Uint8Array;
}

type Listener = () => void;

export class State {
  private past: Settings[] = [];
  private future: Settings[] = [];
  private listeners: Listener[] = [];
  /** Steps of one drag are one step to undo. */
  private held = false;
  settings: Settings = {};
  picture: Picture | null = null;
  /** What settings name besides: a lamp, a beam, a speck of light, a mesh. */
  readonly files = new Map<string, Uint8Array>();

  constructor() {
    this.settings = fromHash(location.hash);
  }

  listen(listener: Listener): void {
    this.listeners.push(listener);
  }

  private tell(): void {
    history.replaceState(null, "", toHash(this.settings));
    for (const listener of this.listeners) listener();
  }

  /** Changes settings; null takes one away. `dragging`: more of the same is to come. */
  set(changes: Settings, dragging = false): void {
    const next = { ...this.settings, ...changes };
    for (const name of Object.keys(next)) if (next[name] === null || next[name] === "") delete next[name];
    if (JSON.stringify(next) === JSON.stringify(this.settings)) {
      this.held = dragging;
      return;
    }
    if (!this.held) this.past.push(this.settings);
    this.held = dragging;
    this.future = [];
    this.settings = next;
    this.tell();
  }

  /** Takes other settings instead of all. */
  replace(settings: Settings): void {
    this.past.push(this.settings);
    this.future = [];
    this.settings = { ...settings };
    this.tell();
  }

  addFiles(files: [string, Uint8Array][]): void {
    if (files.length === 0) return;
    for (const [name, bytes] of files) this.files.set(name, bytes);
    this.tell();
  }

  removeFile(name: string): void {
    this.files.delete(name);
    this.tell();
  }

  setPicture(picture: Picture | null): void {
    this.picture = picture;
    this.tell();
  }

  get canUndo(): boolean {
    return this.past.length > 0;
  }
  get canRedo(): boolean {
    return this.future.length > 0;
  }

  undo(): void {
    this.step(this.past, this.future);
  }

  redo(): void {
    this.step(this.future, this.past);
  }

  /** Takes the settings that lie on top of one pile, and puts those that there are on the other. */
  private step(from: Settings[], to: Settings[]): void {
    const settings = from.pop();
    if (!settings) return;
    to.push(this.settings);
    this.settings = settings;
    this.held = false;
    this.tell();
  }

  /** The settings as the library takes them. */
  asked(changes: Settings = {}): string {
    return JSON.stringify({ ...this.settings, picture: this.picture?.name, ...changes });
  }
}

export function toHash(settings: Settings): string {
  const written = new URLSearchParams(Object.entries(settings).map(([name, value]) => [name, String(value)]));
  return `#${written}`;
}

export function fromHash(hash: string): Settings {
  const settings: Settings = {};
  for (const [name, text] of new URLSearchParams(hash.replace(/^#/, ""))) settings[name] = valueOf(text);
  return settings;
}

/** Numbers and switches are written as such; all else is text. */
export function valueOf(text: string): string | number | boolean {
  if (text === "true" || text === "false") return text === "true";
  return /^-?\d+(\.\d+)?$/.test(text) ? Number(text) : text;
}

/** A length as people write it, mm; null for what is none. */
export function inMm(value: Settings[string] | undefined): number | null {
  if (typeof value === "number") return value;
  const parts = /^\s*(-?[\d.,]+)\s*(um|mm|cm|m|in|")?\s*$/.exec(String(value ?? ""));
  if (!parts) return null;
  const scale = { um: 1e-3, mm: 1, cm: 10, m: 1000, in: 25.4, '"': 25.4 }[parts[2] ?? "mm"] ?? 1;
  return Number(parts[1].replace(",", ".")) * scale;
}

// The library in its worker, as promises.
//
// A run is cancelled in one of two ways. Where the page is cross-origin isolated, the worker looks at a flag in shared memory at every
// iteration. Elsewhere, as in a page from a disk, the worker is ended and another one takes the module, already compiled, and the files.

import { compiledModule, newWorker } from "virtual:glasswarp";
import type { Call, Fault, FromWorker, Progress } from "./protocol";

interface Waiting {
  call: Call;
  resolve: (answer: never) => void;
  reject: (fault: Fault) => void;
  listener?: (progress: Progress) => void;
}

const CANCELLED: Fault = { kind: "cancelled", message: "cancelled", causes: [] };

let compiled: Promise<WebAssembly.Module> | undefined;

export class Engine {
  private worker: Worker | undefined;
  private starting: Promise<Worker> | undefined;
  private readonly stop = globalThis.crossOriginIsolated ? new Int32Array(new SharedArrayBuffer(4)).fill(-1) : null;
  private readonly files = new Map<string, Uint8Array>();
  private readonly waiting = new Map<number, Waiting>();
  private next = 0;

  /** Whether a run ends by a flag, and not with its worker. */
  get cooperates(): boolean {
    return this.stop !== null;
  }

  private start(): Promise<Worker> {
    compiled ??= compiledModule();
    this.starting ??= compiled.then((module) => {
      const worker = newWorker();
      worker.onmessage = ({ data }: MessageEvent<FromWorker>) => this.hear(data);
      worker.onerror = (event) => this.restart({ kind: "internal", message: event.message, causes: [] });
      worker.postMessage({ module, stop: this.stop });
      for (const [name, bytes] of this.files) worker.postMessage({ id: this.next++, method: "put", args: [name, bytes] });
      this.worker = worker;
      return worker;
    });
    return this.starting;
  }

  private hear(message: FromWorker): void {
    const waiting = this.waiting.get(message.id);
    if (!waiting) return;
    if ("progress" in message) return waiting.listener?.(message.progress);
    this.waiting.delete(message.id);
    if ("answer" in message) return waiting.resolve(message.answer as never);
    if (message.fault.kind === "internal") this.restart(message.fault);
    // Whatever it was that ended early, nobody wanted it any more.
    const isUnwanted = this.stop !== null && message.id <= Atomics.load(this.stop, 0);
    waiting.reject(isUnwanted ? CANCELLED : message.fault);
  }

  /** Ends the worker; whoever waits is told why. */
  private restart(why: Fault): void {
    this.worker?.terminate();
    this.worker = this.starting = undefined;
    const waiting = [...this.waiting.values()];
    this.waiting.clear();
    for (const { reject } of waiting) reject(why);
  }

  /** Gives the library a file that settings may name. */
  async put(name: string, bytes: Uint8Array): Promise<void> {
    this.files.set(name, bytes);
    if (this.starting) (await this.starting).postMessage({ id: this.next++, method: "put", args: [name, bytes] });
  }

  /** Asks the library. A rejection is a Fault. */
  async call<A>(call: Call, listener?: (progress: Progress) => void): Promise<A> {
    const worker = await this.start();
    const id = this.next++;
    return new Promise<A>((resolve, reject) => {
      this.waiting.set(id, { call, resolve: resolve as (answer: never) => void, reject, listener });
      worker.postMessage({ id, ...call });
    });
  }

  get isBusy(): boolean {
    return this.waiting.size > 0;
  }

  /** Ends what runs. What cannot be asked to end, such as the verification, ends with its worker after `patience` ms. */
  cancel(patience = 1500): void {
    if (!this.isBusy) return;
    if (!this.stop) return this.restart(CANCELLED);
    // All that was asked for so far; what is asked for from now on is not meant.
    Atomics.store(this.stop, 0, this.next - 1);
    const meant = new Set(this.waiting.keys());
    setTimeout(() => {
      if ([...this.waiting.keys()].some((id) => meant.has(id))) this.restart(CANCELLED);
    }, patience);
  }
}

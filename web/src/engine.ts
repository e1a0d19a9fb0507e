// The library in its worker, as promises.
//
// A run is cancelled in one of two ways. Where the page is cross-origin isolated, the worker looks at a flag in shared memory at every
// iteration. Elsewhere, as in a page from a disk, the worker is ended and another one takes the module, already compiled, and the files.
// Where it is isolated, a worker may also have helpers, with which it computes on several threads.

import { compiledModule, newWorker } from "virtual:glasswarp";
import type { Call, Fault, FromWorker, Progress } from "./protocol";

interface Waiting {
  call: Call;
  resolve: (answer: never) => void;
  reject: (fault: Fault) => void;
  listener?: (progress: Progress) => void;
}

const CANCELLED: Fault = { kind: "cancelled", message: "cancelled", causes: [] };

/** More do not make it faster, and each takes memory. */
const MOST_THREADS = 16;

let compiled: Promise<WebAssembly.Module> | undefined;

export class Engine {
  private worker: Worker | undefined;
  private starting: Promise<Worker> | undefined;
  private helpers: Worker[] = [];
  private onMemory: (memory: WebAssembly.Memory | null) => void = () => {};
  private readonly stop = globalThis.crossOriginIsolated ? new Int32Array(new SharedArrayBuffer(4)).fill(-1) : null;
  private readonly files = new Map<string, Uint8Array>();
  private readonly waiting = new Map<number, Waiting>();
  private next = 0;

  /** Whether a run ends by a flag, and not with its worker. */
  get cooperates(): boolean {
    return this.stop !== null;
  }

  /** `threads`: on how many it computes where it can; as many as the machine has, if none are named. */
  constructor(private readonly threads = Math.min(navigator.hardwareConcurrency || 1, MOST_THREADS)) {}

  private start(): Promise<Worker> {
    compiled ??= compiledModule();
    this.starting ??= compiled.then((module) => this.started(module));
    return this.starting;
  }

  private async started(module: WebAssembly.Module): Promise<Worker> {
    const worker = this.worker = this.newWorker();
    const memory = new Promise<WebAssembly.Memory | null>((resolve) => (this.onMemory = resolve));
    worker.postMessage({ module, stop: this.stop });
    const count = this.stop ? this.threads : 1;
    if (count > 1) {
      const shared = await memory;
      for (let helper = 1; helper < count; helper++) {
        const made = this.newWorker();
        this.helpers.push(made);
        made.postMessage({ module, memory: shared });
      }
      worker.postMessage({ id: this.next++, method: "start_threads", args: [count] });
    }
    for (const [name, bytes] of this.files) worker.postMessage({ id: this.next++, method: "put", args: [name, bytes] });
    return worker;
  }

  private newWorker(): Worker {
    const worker = newWorker();
    worker.onmessage = ({ data }: MessageEvent<FromWorker>) => this.hear(data);
    worker.onerror = (event) => this.restart({ kind: "internal", message: event.message, causes: [] });
    return worker;
  }

  private hear(message: FromWorker): void {
    if ("memory" in message) return this.onMemory(message.memory);
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
    for (const worker of [this.worker, ...this.helpers]) worker?.terminate();
    this.helpers = [];
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

  /** Takes a file away again. */
  async forget(name: string): Promise<void> {
    if (this.files.delete(name) && this.starting) (await this.starting).postMessage({ id: this.next++, method: "forget", args: [name] });
  }

  /** Asks the library. A rejection is a Fault. */
  call<A>(call: Call, listener?: (progress: Progress) => void): Promise<A> {
    const id = this.next++;
    return new Promise<A>((resolve, reject) => {
      this.waiting.set(id, { call, resolve: resolve as (answer: never) => void, reject, listener });
      // It may have been cancelled meanwhile.
      const post = (worker: Worker) => this.waiting.has(id) && worker.postMessage({ id, ...call });
      this.start().then(post, (why) => this.waiting.delete(id) && reject(why));
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

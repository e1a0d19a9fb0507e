// The library in its own thread. One call at a time, in their order.

import { zipSync } from "fflate";
import init, { Studio, catalogue, fault_of, read_design, start_threads, work_as_thread } from "../wasm/pkg/glasswarp_web.js";
import type { Call, Fault, FromWorker, Progress, ToWorker } from "./protocol";

/** Progress is told at most so often, ms. */
const TELL_EVERY = 50;

let studio: Studio;
let memory: WebAssembly.Memory;
/** Of a helper, bytes: what native threads have. */
const STACK = 2 << 20;
/** Memory, in pages of 64 kB: at most, at least, and at first (4 MB, more than the module's own data). */
const MOST_PAGES = 1 << 16;
const LEAST_PAGES = 1 << 13;
const FIRST_PAGES = 64;
/** The last call that is no longer wanted, with all before it. */
let stop: Int32Array | null = null;
/** What came before the module was ready waits. */
let ready: Promise<void> = Promise.resolve();

const tell = (message: FromWorker, transfer: Transferable[] = []) => self.postMessage(message, { transfer });

/** Memory that can be shared is promised as a whole: as much of what 32 bits address as the machine can. */
function promised(): WebAssembly.Memory {
  for (let maximum = MOST_PAGES; ; maximum /= 2) {
    try {
      return new WebAssembly.Memory({ initial: FIRST_PAGES, maximum, shared: true });
    } catch (error) {
      if (maximum <= LEAST_PAGES) throw error;
    }
  }
}

/** Hears of progress; true ends the work. */
function listener(id: number) {
  const progress: Progress = { stage: "", steps: 0, done: 0, iterations: 0 };
  let told = 0;
  return (kind: number, name: string, number: number): boolean => {
    if (kind === 0) Object.assign(progress, { stage: name, steps: number, done: 0 });
    else if (kind === 1) progress.done = number;
    else progress.iterations += 1;
    const now = performance.now();
    if (kind === 0 || now - told > TELL_EVERY) {
      told = now;
      tell({ id, progress: { ...progress } });
    }
    return stop !== null && Atomics.load(stop, 0) >= id;
  };
}

function answer(id: number, call: Call): unknown {
  switch (call.method) {
    case "catalogue":
      return catalogue();
    case "fault_of":
      return fault_of(...call.args) ?? null;
    case "read_design":
      return read_design(...call.args);
    case "put":
      return studio.put(...call.args);
    case "forget":
      return studio.forget(...call.args);
    case "picture":
      return studio.picture(...call.args);
    case "reduced":
      return studio.reduced(...call.args);
    case "draft":
      return studio.draft(...call.args, listener(id));
    case "make":
      return studio.make(...call.args, listener(id));
    case "heights":
      return studio.heights();
    case "pose":
      return studio.pose(...call.args);
    case "file":
      return studio.file(...call.args);
    case "side_file":
      return studio.side_file(...call.args);
    case "verify":
      return studio.verify(...call.args, listener(id));
    case "report":
      return studio.report(...call.args);
    case "ready":
      return studio.ready(...call.args, listener(id));
    case "sheet":
      return studio.sheet();
    case "zip":
      return zipped(...call.args);
    case "memory":
      return memory.buffer.byteLength;
    case "start_threads":
      return start_threads(...call.args);
  }
}

/** Without a time: the same block is the same file. */
function zipped(names: string[], side: string, others: Record<string, Uint8Array>): Uint8Array {
  const files = { ...others };
  for (const name of names) files[name] = studio.file(name);
  files[side] = new TextEncoder().encode(studio.side_file(side));
  return zipSync(files, { level: 1, mtime: "1980-01-01T00:00:00" });
}

/** Buffers that need not be copied: of typed arrays that the module has made for us. */
function owned(answer: unknown): Transferable[] {
  if (ArrayBuffer.isView(answer)) return [answer.buffer as ArrayBuffer];
  const arrays = (answer as { arrays?: Record<string, ArrayBufferView> } | null | undefined)?.arrays;
  return arrays ? Object.values(arrays).map((array) => array.buffer as ArrayBuffer) : [];
}

function fault(error: unknown): Fault {
  if (error && typeof error === "object" && "kind" in error && "causes" in error) return error as Fault;
  // The module has stopped for good: the page starts another worker.
  return { kind: "internal", message: String(error), causes: [] };
}

self.onmessage = async ({ data }: MessageEvent<ToWorker>) => {
  if ("memory" in data) {
    await init({ module_or_path: data.module, memory: data.memory, thread_stack_size: STACK });
    // For as long as the page lives, or until it is ended.
    return work_as_thread();
  }
  if ("module" in data) {
    stop = data.stop;
    ready = (async () => {
      memory = promised();
      await init({ module_or_path: data.module, memory });
      studio = new Studio();
      tell({ memory: stop && memory });
    })();
    // What waits for the module hears of it as of every error that ends a worker.
    ready.catch((error) => setTimeout(() => { throw error; }));
    return;
  }
  await ready;
  try {
    const found = answer(data.id, data);
    tell({ id: data.id, answer: found }, owned(found));
  } catch (error) {
    tell({ id: data.id, fault: fault(error) });
  }
};

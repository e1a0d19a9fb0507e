// Where the module and the worker come from is the one difference between the hosted page and the file on a disk (vite.config.ts).
declare module "virtual:glasswarp" {
  export function compiledModule(): Promise<WebAssembly.Module>;
  export function newWorker(): Worker;
}

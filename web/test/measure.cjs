// Measures the page in Chromium: the figures of docs/browser.md. `node test/measure.cjs BROWSER PICTURE [THREADS]`, prints JSON.

const puppeteer = require("puppeteer-core");
const { execFileSync } = require("node:child_process");
const { readFileSync } = require("node:fs");
const { join } = require("node:path");
const { pathToFileURL } = require("node:url");

const [browserName, picturePath, threads] = process.argv.slice(2);
const browserPath = execFileSync("sh", ["-c", 'command -v "$1"', "sh", browserName]).toString().trim();

async function main() {
  const { serve } = await import(pathToFileURL(join(__dirname, "server.mjs")).href);
  const server = await serve(join(__dirname, "..", "dist", "hosted"));
  const browser = await puppeteer.launch({
    executablePath: browserPath,
    protocolTimeout: 600_000,
    args: [...(process.getuid?.() === 0 ? ["--no-sandbox"] : []), "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--lang=en"],
  });
  const page = await browser.newPage();
  page.setDefaultTimeout(600_000);
  await page.setViewport({ width: 1280, height: 900 });
  if (threads) await (await page.createCDPSession()).send("Emulation.setHardwareConcurrencyOverride", { hardwareConcurrency: Number(threads) });
  await page.goto(server.url);
  await page.waitForSelector("#drop");
  const drafted = (n) => page.waitForFunction((n) => performance.getEntriesByName("draft").length > n && document.getElementById("answer").getAttribute("aria-busy") === "false", { polling: 10 }, n);
  const found = {};
  const timed = async (act, done) => {
    const begin = performance.now();
    await act();
    await done();
    return Math.round(performance.now() - begin);
  };
  found.first_draft_ms = await timed(
    () =>
      page.evaluate((base64) => {
        const data = new DataTransfer();
        data.items.add(new File([Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0))], "camera.png", { type: "image/png" }));
        document.getElementById("drop").dispatchEvent(new DragEvent("drop", { dataTransfer: data, bubbles: true, cancelable: true }));
      }, readFileSync(picturePath).toString("base64")),
    () => drafted(0),
  );
  found.slider_ms = [];
  for (let k = 0; k < 5; k++) {
    await new Promise((resolve) => setTimeout(resolve, 1500));
    const before = await page.evaluate(() => performance.getEntriesByName("draft").length);
    const move = (value) => page.$eval("#edit-offset", (input, value) => { input.value = value; input.dispatchEvent(new Event("input", { bubbles: true })); }, String(value));
    found.slider_ms.push(await timed(() => move(0.12 + 0.02 * k), () => drafted(before)));
  }
  await page.$eval("#edit-offset", (input) => { input.value = "0.1"; input.dispatchEvent(new Event("input", { bubbles: true })); });
  await new Promise((resolve) => setTimeout(resolve, 3000));
  await page.click("#pose-check");
  await page.waitForFunction(() => document.getElementById("moving-rate").textContent !== "");
  found.moving = await page.$eval("#moving-rate", (element) => element.textContent);
  for (const nodes of [641, 1025]) {
    await page.select("#make-nodes", String(nodes));
    await page.click("#make");
    await page.waitForSelector("#make-cancel:not([hidden])");
    await page.waitForFunction(() => document.getElementById("make-cancel").hidden);
    found[`make_${nodes}`] = await page.$eval("#make-status", (element) => element.textContent);
  }
  console.log(JSON.stringify(found, null, 1));
  await browser.close();
  await server.close();
}

main().catch((error) => {
  console.error(error);
  process.exit(1);
});

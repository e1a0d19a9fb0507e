// Arguments: the browser, a page of HTML, a folder for screenshots. Prints what it found as JSON.
"use strict";
const puppeteer = require("puppeteer-core");
const { execFileSync } = require("node:child_process");
const { pathToFileURL } = require("node:url");
const path = require("node:path");

const [browserName, pageFile, shots] = process.argv.slice(1);
const address = pathToFileURL(pageFile).href;
const pause = (ms) => new Promise((done) => setTimeout(done, ms));

async function main() {
  const executablePath = execFileSync("sh", ["-c", 'command -v "$1"', "sh", browserName]).toString().trim();
  const root = process.getuid && process.getuid() === 0;
  const browser = await puppeteer.launch({
    executablePath,
    headless: true,
    args: ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--hide-scrollbars", ...(root ? ["--no-sandbox"] : [])],
  });
  const found = { console: [], requests: [], sideways: [] };
  const watch = (page) => {
    page.on("console", (message) => {
      if (["error", "warn", "warning"].includes(message.type())) found.console.push(message.text());
    });
    page.on("pageerror", (error) => found.console.push(String(error)));
    page.on("request", (request) => {
      if (request.url() !== address && !request.url().startsWith("data:")) found.requests.push(request.url());
    });
  };
  try {
    const page = await browser.newPage();
    watch(page);
    await page.setViewport({ width: 1200, height: 900 });
    await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: "light" }, { name: "prefers-reduced-motion", value: "reduce" }]);
    await page.goto(address);
    await page.waitForSelector(".stage.live", { timeout: 30000 }).catch(() => {});
    found.live = (await page.$(".stage.live")) !== null;
    Object.assign(found, await page.evaluate(async () => {
      const images = [...document.images];
      images.forEach((image) => { image.loading = "eager"; });
      await Promise.all(images.map((image) => image.decode().catch(() => {})));
      const levels = [...document.querySelectorAll("h1,h2,h3,h4")].map((heading) => Number(heading.tagName[1]));
      const stepped = levels.every((level, k) => level - (k ? levels[k - 1] : 0) <= 1);
      const words = (element) => (element.getAttribute("alt") ?? element.getAttribute("aria-label") ?? "").trim();
      const vectors = [...document.querySelectorAll('svg[role="img"], canvas')];
      return {
        images: images.length,
        unnamed: [...images, ...vectors].filter((element) => words(element).length < 10).map((element) => element.outerHTML.slice(0, 80)),
        broken: images.filter((image) => !image.naturalWidth).map((image) => image.alt),
        headings: stepped && levels.filter((level) => level === 1).length === 1 ? "fine" : levels.join(),
        command: document.getElementById("command").textContent,
      };
    }));

    // What the keyboard reaches, in order, until it comes round.
    const reached = [];
    for (let k = 0; k < 80; k++) {
      await page.keyboard.press("Tab");
      const what = await page.evaluate(() => {
        const element = document.activeElement;
        return element === document.body ? "" : `${element.tagName} ${element.textContent.trim().slice(0, 20)}${element.getAttribute("aria-label") ?? ""}`;
      });
      if (!what) break;
      reached.push(what);
    }
    const wanted = ["CANVAS", "BUTTON Reset", "BUTTON Bench", "BUTTON Rays", "BUTTON Receiver", "BUTTON Matte", "INPUT", "BUTTON Copy"];
    const missed = wanted.filter((name) => !reached.some((what) => what.startsWith(name)));
    found.focus = missed.length ? `missed ${missed} among ${reached}` : "fine";
    // What is for the engineer is folded until a link asks for it.
    const folded = () => page.evaluate(() => !document.getElementById("engineer").open);
    const before = await folded();
    await page.click('nav a[href="#engineer"]');
    await pause(200);
    found.folded = before && !(await folded()) ? "fine" : "not unfolded by its link";
    await page.evaluate(() => { document.activeElement.blur(); document.querySelector("#viewer").scrollIntoView({ block: "center", behavior: "instant" }); });

    const canvas = await page.$("#viewer canvas");
    const box = await canvas.boundingBox();
    const middle = [box.x + box.width / 2, box.y + box.height / 2];
    const settle = async () => {
      await page.mouse.move(2, 2);
      await page.evaluate(() => { document.activeElement.blur(); });
      await pause(250);
    };
    const shoot = async (name) => {
      await settle();
      await canvas.screenshot({ path: path.join(shots, `${name}.png`) });
    };
    const click = (selector) => page.click(`#viewer ${selector}`);
    const reset = async (name) => {
      await click('[data-do="reset"]');
      if (name) await shoot(`${name}-reset`);
    };
    const drag = async () => {
      await page.mouse.move(...middle);
      await page.mouse.down();
      await page.mouse.move(middle[0] + 140, middle[1] + 50, { steps: 5 });
      await page.mouse.up();
    };
    await shoot("start");
    await drag();
    await shoot("dragged");
    await page.mouse.move(...middle);
    await page.mouse.wheel({ deltaY: -300 });
    await shoot("zoomed");
    await reset("dragged");
    await page.focus("#viewer canvas");
    for (const key of ["ArrowLeft", "ArrowLeft", "ArrowDown", "+"]) await page.keyboard.press(key);
    await shoot("keyed");
    await reset("keyed");
    await page.keyboard.down("Shift");
    await drag();
    await page.keyboard.up("Shift");
    await shoot("panned");
    await reset();
    for (const [name, button] of [["no-rays", "rays"], ["no-receiver", "receiver"], ["matte", "matte"]]) {
      await click(`[data-toggle="${button}"]`);
      await shoot(name);
      await click(`[data-toggle="${button}"]`);
    }
    for (const button of ["rays", "receiver"]) await click(`[data-toggle="${button}"]`);
    await shoot("bare");
    for (const button of ["rays", "receiver"]) await click(`[data-toggle="${button}"]`);
    await page.evaluate(() => {
      const slider = document.querySelector("#viewer input");
      slider.value = 6;
      slider.dispatchEvent(new Event("input"));
    });
    await shoot("stretched");
    await reset("stretched");
    await click('[data-view="block"]');
    await shoot("block");
    await click('[data-view="picture"]');
    await shoot("picture");
    await reset("picture");
    // Two fingers that move apart.
    const session = await page.createCDPSession();
    const touch = (type, ...points) => session.send("Input.dispatchTouchEvent", {
      type, touchPoints: points.map(([x, y], id) => ({ x, y, id })),
    });
    await touch("touchStart", [middle[0] - 40, middle[1]], [middle[0] + 40, middle[1]]);
    for (let k = 1; k <= 4; k++) await touch("touchMove", [middle[0] - 40 - 20 * k, middle[1]], [middle[0] + 40 + 20 * k, middle[1]]);
    await touch("touchEnd");
    await shoot("pinched");
    await reset("pinched");

    // The light that moves: as the verifier found it, other light when something is moved, and back.
    found.moving = await page.evaluate(async () => {
      const panel = document.getElementById("moving"), moving = panel.querySelector("canvas"), caustic = document.getElementById("caustic");
      const [width, height] = [caustic.naturalWidth, caustic.naturalHeight];
      const greys = (source, w, h) => {
        const copy = Object.assign(document.createElement("canvas"), { width: w, height: h }).getContext("2d");
        copy.drawImage(source, 0, 0);
        return copy.getImageData(0, 0, w, h).data;
      };
      // Means over whole pixels of the picture.
      const seen = () => {
        const [w, h] = [moving.width, moving.height], all = greys(moving, w, h), sums = new Float64Array(width * height);
        for (let j = 0; j < h; j++) {
          for (let i = 0; i < w; i++) sums[Math.floor((j * height) / h) * width + Math.floor((i * width) / w)] += (all[4 * (j * w + i)] * width * height) / (w * h);
        }
        return sums;
      };
      const still = greys(caustic, width, height), wanted = Float64Array.from({ length: width * height }, (_, k) => still[4 * k]);
      const apart = (a, b) => Math.sqrt(a.reduce((sum, v, k) => sum + (v - b[k]) ** 2, 0) / b.reduce((sum, v) => sum + v * v, 0));
      const rest = () => new Promise((done) => setTimeout(done, 1500));
      await rest();
      const designed = seen(), errors = { shown: !panel.hidden, designed: apart(designed, wanted) };
      for (const [k, input] of [...panel.querySelectorAll("input")].entries()) {
        input.value = Number(input.value) + 0.2 * (input.max - input.value);
        input.dispatchEvent(new Event("input"));
        await rest();
        errors[`slider ${k}`] = apart(seen(), designed);
        panel.querySelector("button").click();
        await rest();
        errors.back = Math.max(errors.back ?? 0, apart(seen(), designed));
      }
      return errors;
    });

    // On a telephone and on a table: words in the model stay off the buttons, the drawing is whole, hashes wrap.
    found.narrow = [];
    for (const width of [360, 390, 820]) {
      await page.setViewport({ width, height: 844 });
      for (const view of ["bench", "block", "picture"]) {
        await click(`[data-view="${view}"]`);
        await pause(200);
        found.narrow.push(...await page.evaluate((where) => {
          const box = (element) => element.getBoundingClientRect();
          const shown = [...document.querySelectorAll("#viewer .tags span")].filter((tag) => tag.style.visibility !== "hidden");
          const over = (a, b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
          const tools = [...document.querySelectorAll("#viewer button, #viewer .relief")];
          const hidden = shown.filter((tag) => tools.some((tool) => over(box(tag), box(tool)))).map((tag) => `${tag.textContent} over a button`);
          const within = (element) => box(element).left >= 0 && box(element).right <= innerWidth && box(element).width > 0;
          const cut = [...document.querySelectorAll(".workshop img, .workshop .notes, .contours img, .maps img, .drawing svg, .hash code, .files th[scope=row]")].filter((element) => !within(element));
          const scrolled = [...document.querySelectorAll("main *")].filter((element) => element.scrollWidth > element.clientWidth + 1 && getComputedStyle(element).overflowX === "auto" && !element.closest("details details"));
          return [...hidden, ...cut.concat(scrolled).map((element) => `${element.tagName} ${element.className} is cut`)].map((what) => `${what} at ${where}`);
        }, `${width}, ${view}`));
      }
      await click('[data-do="reset"]');
    }
    for (const width of [360, 390, 820, 1440]) {
      await page.setViewport({ width, height: 900 });
      await pause(100);
      const wide = await page.evaluate(() => document.documentElement.scrollWidth);
      if (wide > width) found.sideways.push(`${wide} at ${width}`);
    }
    await page.setViewport({ width: 1200, height: 900 });
    await page.evaluate(() => scrollTo({ top: 0, behavior: "instant" }));
    for (const scheme of ["light", "dark"]) {
      await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: scheme }]);
      await pause(200);
      await page.screenshot({ path: path.join(shots, `page-${scheme}.png`), clip: { x: 0, y: 0, width: 1200, height: 420 } });
    }
    // A tint means height, by day and by night.
    for (const [name, selector] of [["contours", ".contours img"], ["slope", ".maps img"], ["light", "#caustic"]]) {
      for (const scheme of ["light", "dark"]) {
        await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: scheme }]);
        await pause(100);
        await (await page.$(selector)).screenshot({ path: path.join(shots, `${name}-${scheme}.png`) });
      }
    }
    const pdf = Buffer.from(await page.pdf({ format: "A4", printBackground: true })).toString("latin1");
    found["pdf-pages"] = (pdf.match(/\/Type\s*\/Page[^s]/g) ?? []).length;
    await page.close();

    // The same page where there is no WebGL 2, and where scripts do not run.
    const visible = () => {
      const shown = (selector) => getComputedStyle(document.querySelector(selector)).display !== "none";
      const right = shown(".still") && shown(".no-model") && !shown(".stage canvas") && !shown(".tools");
      return right ? "fine" : "not as it should be";
    };
    const plain = await browser.newPage();
    watch(plain);
    await plain.evaluateOnNewDocument(() => { HTMLCanvasElement.prototype.getContext = () => null; });
    await plain.goto(address);
    found.still = await plain.evaluate(visible);
    await plain.close();
    const unscripted = await browser.newPage();
    await unscripted.setJavaScriptEnabled(false);
    await unscripted.goto(address);
    found.unscripted = await unscripted.evaluate(visible);
  } finally {
    await browser.close();
  }
  console.log(JSON.stringify(found));
}

main().catch((error) => {
  console.error(error);
  process.exit(1);
});

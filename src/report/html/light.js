// The panel of the light that moves; photons.js stands before this in the same script.
{
  const panel = document.getElementById("moving");
  const canvas = panel.querySelector("canvas");
  const { stand, white, linear } = JSON.parse(document.getElementById("moving-light").textContent);
  const scene = JSON.parse(document.getElementById("scene").textContent);
  const ACROSS = 384;

  const bytes = (text) => new DataView(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
  // The face: x, y, height, slopes along both.
  const mesh = () => {
    const [nx, ny] = scene.nodes, [low, high] = scene.range, [width, depth] = scene.size;
    const heights = bytes(scene.heights), slopes = bytes(scene.slopes);
    const values = new Float32Array(5 * nx * ny);
    for (let j = 0, k = 0; j < ny; j++) {
      for (let i = 0; i < nx; i++, k++) {
        const slope = (along) => (scene.steepest * slopes.getInt16(4 * k + 2 * along, true)) / 32767;
        values.set([
          width * (i / (nx - 1) - 0.5), depth * (j / (ny - 1) - 0.5),
          low + ((high - low) * heights.getUint16(2 * k, true)) / 65535, slope(0), slope(1),
        ], 5 * k);
      }
    }
    return values;
  };

  const names = {
    distance: "Receiver at", wallTilt: "Receiver turned", blockTilt: "Block turned", lightX: "Light from the right", lightY: "Light from above",
    source: "Size of the light", index: "Refractive index", wavelength: "Wavelength",
  };
  const sliders = slidersOf(stand);
  const inputs = new Map();
  let live = null;
  const moved = () => {
    for (const { input, output, slider } of inputs.values()) output.value = `${Number(input.value).toFixed(slider.digits)} ${slider.unit}`;
    live.show(poseOf(stand, Object.fromEntries([...inputs].map(([name, { input }]) => [name, Number(input.value)]))));
  };
  const reset = () => {
    for (const { input, slider } of inputs.values()) input.value = slider.value;
    moved();
  };
  try {
    live = new LiveLight(canvas);
    const [nx, ny] = scene.nodes;
    live.take(mesh(), nx, ny, stand, ACROSS, white, linear);
    for (const slider of sliders) {
      const [label, text, output, input] = ["label", "span", "output", "input"].map((name) => document.createElement(name));
      text.append(`${names[slider.name]} `, output);
      Object.assign(input, { type: "range", min: slider.min, max: slider.max, step: slider.step });
      input.addEventListener("input", moved);
      label.append(text, input);
      panel.querySelector(".sliders").append(label);
      inputs.set(slider.name, { input, output, slider });
    }
    panel.querySelector("button").addEventListener("click", reset);
    panel.hidden = false;
    reset();
  } catch (error) {
    // Without WebGL 2 that adds up floats the still picture is what there is.
    console.info(error.message);
  }
}

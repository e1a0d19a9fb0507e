// Pictures to try, drawn by code.

import type { Words } from "./strings";

const SIDE = 512;

type Draw = (pen: CanvasRenderingContext2D) => void;

const draws: Record<string, { label: keyof Words; draw: Draw }> = {
  "ring.png": {
    label: "sampleFace",
    draw(pen) {
      pen.lineWidth = 46;
      pen.strokeStyle = "#fff";
      pen.filter = "blur(3px)";
      pen.beginPath();
      pen.arc(SIDE / 2, SIDE / 2, 150, 0, 2 * Math.PI);
      pen.stroke();
    },
  },
  "letter-f.png": {
    label: "sampleLetter",
    draw(pen) {
      pen.fillStyle = "#fff";
      pen.filter = "blur(2px)";
      pen.fillRect(150, 90, 64, 332);
      pen.fillRect(150, 90, 230, 60);
      pen.fillRect(150, 230, 160, 56);
    },
  },
  "waves.png": {
    label: "sampleWaves",
    draw(pen) {
      const image = pen.createImageData(SIDE, SIDE);
      for (let k = 0; k < SIDE * SIDE; k++) {
        const [x, y] = [(k % SIDE) / SIDE - 0.5, Math.floor(k / SIDE) / SIDE - 0.5];
        const from = Math.hypot(x + 0.18, y + 0.1);
        const and = Math.hypot(x - 0.2, y - 0.16);
        const grey = 255 * (0.5 + 0.25 * (Math.cos(70 * from) + Math.cos(70 * and)));
        image.data.set([grey, grey, grey, 255], 4 * k);
      }
      pen.putImageData(image, 0, 0);
    },
  },
};

export const samples = Object.entries(draws).map(([name, { label }]) => ({ name, label }));

/** A sample as the bytes of a PNG. */
export async function sample(name: string): Promise<Uint8Array> {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = SIDE;
  const pen = canvas.getContext("2d");
  if (!pen) throw new Error("no canvas");
  pen.fillStyle = "#000";
  pen.fillRect(0, 0, SIDE, SIDE);
  draws[name].draw(pen);
  const blob = await new Promise<Blob | null>((resolve) => canvas.toBlob(resolve, "image/png"));
  return new Uint8Array(await (blob ?? new Blob()).arrayBuffer());
}

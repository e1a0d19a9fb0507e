// Refraction for drawings: of one ray, in the frame of the bench. The light that moves has the same in its shader, the solver its own.

import { normalised, rotation } from "../../src/report/html/photons.js";
import type { Stand, Vec3 } from "./protocol";

export const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** A ray's way: from the light, through the entry face and a point of the exit face, to the receiver. Null where it does not get there. */
export function path(stand: Stand, at: Vec3, slope: [number, number]): Vec3[] | null {
  const { ior, entry_z_mm, light } = stand;
  const source: Vec3 | null = light.kind === "point" ? light.position_mm : null;
  let inside: Vec3;
  let entry: Vec3 = at;
  let before: Vec3;
  if (ior === null) {
    inside = source ? normalised([at[0] - source[0], at[1] - source[1], at[2] - source[2]]) : (light as { direction: Vec3 }).direction;
    before = source ?? [at[0] - inside[0] * stand.distance_mm, at[1] - inside[1] * stand.distance_mm, at[2] - inside[2] * stand.distance_mm];
  } else {
    const [entryXy, across] = source ? enteredFrom(stand, source, at) : enteredParallel(stand, (light as { direction: Vec3 }).direction, at);
    entry = [entryXy[0], entryXy[1], entry_z_mm];
    inside = across;
    const outside: Vec3 = source ? normalised([entry[0] - source[0], entry[1] - source[1], entry[2] - source[2]]) : (light as { direction: Vec3 }).direction;
    const back = 0.3 * stand.distance_mm;
    before = source ?? [entry[0] - outside[0] * back, entry[1] - outside[1] * back, entry[2] - outside[2] * back];
  }
  const normal = normalised([-slope[0], -slope[1], 1]);
  const cos = dot(inside, normal);
  let out: Vec3;
  if (ior === null) {
    out = [inside[0] - 2 * cos * normal[0], inside[1] - 2 * cos * normal[1], inside[2] - 2 * cos * normal[2]];
  } else {
    const rest = 1 - ior * ior * (1 - cos * cos);
    if (rest < 0) return null;
    const along = Math.sqrt(rest) - ior * cos;
    out = [ior * inside[0] + along * normal[0], ior * inside[1] + along * normal[1], ior * inside[2] + along * normal[2]];
  }
  const wall = rotation(stand.receiver_turned)[2];
  const steep = dot(wall, out);
  const far = dot(wall, [-at[0], -at[1], stand.distance_mm - at[2]]) / steep;
  if (!(far > 0)) return null;
  const landing: Vec3 = [at[0] + far * out[0], at[1] + far * out[1], at[2] + far * out[2]];
  return ior === null ? [before, at, landing] : [before, entry, at, landing];
}

function enteredParallel(stand: Stand, direction: Vec3, at: Vec3): [[number, number], Vec3] {
  const n = stand.ior ?? 1;
  const [x, y] = [direction[0] / n, direction[1] / n];
  const z = Math.sqrt(1 - x * x - y * y);
  const high = at[2] - stand.entry_z_mm;
  return [[at[0] - (x / z) * high, at[1] - (y / z) * high], [x, y, z]];
}

/** Snell's law at a plane between two points: the place of entry by Newton's method. */
function enteredFrom(stand: Stand, source: Vec3, at: Vec3): [[number, number], Vec3] {
  const n = stand.ior ?? 1;
  const [dx, dy] = [at[0] - source[0], at[1] - source[1]];
  const across = Math.hypot(dx, dy);
  const [below, above] = [stand.entry_z_mm - source[2], at[2] - stand.entry_z_mm];
  let r = (across * below) / (below + above / n);
  for (let k = 0; k < 6; k++) {
    const [p, q] = [Math.hypot(r, below), Math.hypot(across - r, above)];
    r -= (r / p - (n * (across - r)) / q) / (below ** 2 / p ** 3 + (n * above ** 2) / q ** 3);
  }
  const share = across > 0 ? r / across : 0;
  const entry: [number, number] = [source[0] + share * dx, source[1] + share * dy];
  return [entry, normalised([at[0] - entry[0], at[1] - entry[1], above])];
}

// The light of a block in real time: a mesh of photons on the receiver, drawn additively.
//
// Every vertex is a point of the exit face. It is lit from its entry point, refracts (or reflects) the light by the face's own slope,
// and lands on the receiver. Between vertices the place of entry is linear, so that within a triangle its derivative by the place on the
// receiver, det d(entry)/d(receiver), is the ratio of areas: the density of light. Folds of the mesh add up.
//
// The target holds floats, with `oversampling` samples per pixel along each side; a second pass takes means and makes greys of them.
//
// The report holds this file as it is, and the browser app imports it: a module without imports, in the language of browsers.

const normalised = (v) => {
  const length = Math.hypot(...v) || 1;
  return [v[0] / length, v[1] / length, v[2] / length];
};

/** Rodrigues' rotation: the matrix, by columns, of a rotation vector. */
function rotation([x, y, z]) {
  const angle = Math.hypot(x, y, z);
  if (angle === 0) return [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
  const [u, v, w] = [x / angle, y / angle, z / angle];
  const [s, c] = [Math.sin(angle), Math.cos(angle)];
  const t = 1 - c;
  return [
    [t * u * u + c, t * u * v + s * w, t * u * w - s * v],
    [t * u * v - s * w, t * v * v + c, t * v * w + s * u],
    [t * u * w + s * v, t * v * w - s * u, t * w * w + c],
  ];
}

const designPose = (stand) => ({
  ior: stand.ior,
  distance_mm: stand.distance_mm,
  receiver_turned: stand.receiver_turned,
  block_turned: [0, 0, 0],
  direction: stand.light.kind === "parallel" ? stand.light.direction : null,
  position_mm: stand.light.kind === "point" ? stand.light.position_mm : null,
  source_radius: stand.source_radius ?? [0, 0],
});

const DEGREE = Math.PI / 180;

/** What can be moved: name, limits, step, digits shown, unit, and where the design has it. Angles are counted from the design's own. */
function slidersOf(stand) {
  const isPoint = stand.light.kind === "point";
  const radius = stand.source_radius?.[0] ?? 0;
  const slider = (name, min, max, step, digits, unit, value) => ({ name, min, max, step, digits, unit, value });
  const { distance_mm, ior } = stand;
  return [
    slider("distance", Math.max(1, Math.round(0.4 * distance_mm)), Math.round(1.8 * distance_mm), 1, 0, "mm", distance_mm),
    slider("wallTilt", -45, 45, 0.5, 1, "°", 0),
    slider("blockTilt", -20, 20, 0.1, 1, "°", 0),
    slider("lightX", -30, 30, 0.1, 1, "°", 0),
    slider("lightY", -30, 30, 0.1, 1, "°", 0),
    isPoint ? slider("source", 0, 40, 0.1, 1, "mm", 2 * radius) : slider("source", 0, 2, 0.01, 2, "°", (2 * radius) / DEGREE),
    ...(ior === null ? [] : [slider("index", 1.3, 1.8, 0.001, 3, "", ior)]),
    ...(stand.spectrum === null ? [] : [wavelengthSlider(stand.spectrum)]),
  ];
}

function wavelengthSlider({ design_nm, first_nm, step_nm, ior }) {
  return { name: "wavelength", min: first_nm, max: first_nm + step_nm * (ior.length - 1), step: 1, digits: 0, unit: "nm", value: design_nm };
}

/** The index of the material at a wavelength. */
function indexAt({ first_nm, step_nm, ior }, nm) {
  const at = Math.min(ior.length - 1.000001, Math.max(0, (nm - first_nm) / step_nm));
  const k = Math.floor(at);
  return ior[k] + (at - k) * (ior[k + 1] - ior[k]);
}

/** The pose of these values, by the names of sliders. */
function poseOf(stand, values) {
  const pose = designPose(stand);
  // A slider rests beside a value that is between its steps.
  const near = (value, design, step) => (Math.abs(value - design) <= 0.51 * step ? design : value);
  pose.distance_mm = near(values.distance, stand.distance_mm, 1);
  if (stand.ior !== null) pose.ior = near(values.index, stand.ior, 0.001);
  if (stand.spectrum !== null) {
    const { design_nm } = stand.spectrum;
    const nm = near(values.wavelength, design_nm, 1);
    if (nm !== design_nm) pose.ior += indexAt(stand.spectrum, nm) - indexAt(stand.spectrum, design_nm);
  }
  pose.receiver_turned = [stand.receiver_turned[0] - values.wallTilt * DEGREE, stand.receiver_turned[1], stand.receiver_turned[2]];
  pose.block_turned = [values.blockTilt * DEGREE, 0, 0];
  const [aside, above] = [values.lightX * DEGREE, values.lightY * DEGREE];
  if (pose.direction) pose.direction = comingFrom(pose.direction, above, aside);
  else if (pose.position_mm) pose.position_mm = comingFrom(pose.position_mm, above, aside);
  const radius = 0.5 * values.source * (stand.light.kind === "point" ? 1 : DEGREE);
  const design = stand.source_radius ?? [0, 0];
  pose.source_radius = [radius, radius * (design[0] > 0 ? design[1] / design[0] : 1)];
  return pose;
}

/** A vector turned: so that it comes more from above, then more from the side (the picture's right, -x). */
function comingFrom([x, y, z], above, aside) {
  const [c, s] = [Math.cos(above), Math.sin(above)];
  const [y1, z1] = [c * y - s * z, s * y + c * z];
  const [d, t] = [Math.cos(aside), Math.sin(aside)];
  return [d * x + t * z1, y1, d * z1 - t * x];
}

/** Samples per pixel along each side: while something moves, once it rests, and of what is compared. */
const MOVING = 1;
const RESTING = 2;
const COMPARED = 4;
/** Points of a source that has a size, and the step in which they take turns, so that any few of them are spread over all of it. */
const POINTS = 48;
const TURN = 29;

const VERTEX = `#version 300 es
precision highp float;
layout(location = 0) in vec3 place;   // of the exit face, mm
layout(location = 1) in vec2 slope;
uniform float ior;                    // 0: a mirror
uniform float entryZ, receiverZ;
uniform mat3 block, receiver;         // axes as columns
uniform bool isPoint;
uniform vec3 light;                   // direction, or place of the source
uniform vec3 aim;                     // axis of the source
uniform int emission;                 // 0 isotropic, 1 Lambertian, 2 Gaussian
uniform float halfAngle;
uniform vec2 windowSize, windowCentre;
out vec2 entry, leaves;
out float irradiance;
out float lost;

void main() {
  vec3 from = transpose(block) * light;
  vec3 inside;
  float n = ior > 0.0 ? ior : 1.0;
  leaves = place.xy;
  float high = ior > 0.0 ? place.z - entryZ : place.z;
  lost = 0.0;
  if (isPoint) {
    vec2 apart = place.xy - from.xy;
    if (ior > 0.0) {
      // Snell's law at the entry plane between source and face, by Newton's method.
      float across = length(apart), below = entryZ - from.z;
      float r = across * below / (below + high / n);
      for (int k = 0; k < 5; k++) {
        float p = length(vec2(r, below)), q = length(vec2(across - r, high));
        r -= (r / p - n * (across - r) / q) / (below * below / (p * p * p) + n * high * high / (q * q * q));
      }
      entry = from.xy + (across > 0.0 ? r / across : 0.0) * apart;
      inside = normalize(vec3(place.xy - entry, high));
    } else {
      inside = normalize(place - from);
      entry = place.xy - inside.xy / inside.z * high;
    }
    vec3 outside = vec3(entry, ior > 0.0 ? entryZ : 0.0) - from;
    float away = length(outside);
    vec3 ray = outside / away;
    float cosAim = dot(block * ray, aim);
    float intensity = emission == 1 ? max(cosAim, 0.0) : emission == 2 ? exp2(-pow(acos(clamp(cosAim, -1.0, 1.0)) / halfAngle, 2.0)) : 1.0;
    irradiance = intensity * abs(ray.z) / (away * away);
  } else {
    vec3 outside = normalize(from);
    inside = ior > 0.0 ? vec3(outside.xy / n, sqrt(1.0 - dot(outside.xy, outside.xy) / (n * n))) : outside;
    entry = place.xy - inside.xy / inside.z * high;
    irradiance = abs(outside.z);
  }
  vec3 normal = normalize(vec3(-slope, 1.0));
  float cosIn = dot(inside, normal);
  vec3 leaving;
  if (ior > 0.0) {
    float rest = 1.0 - n * n * (1.0 - cosIn * cosIn);
    if (rest < 0.0) lost = 1.0;
    leaving = n * inside + (sqrt(max(rest, 0.0)) - n * cosIn) * normal;
  } else {
    leaving = inside - 2.0 * cosIn * normal;
  }
  vec3 here = block * place, way = block * leaving;
  vec3 to = vec3(0.0, 0.0, receiverZ);
  float steep = dot(receiver[2], way);
  if (steep <= 1e-4) lost = 1.0;
  vec3 landing = here + way * (dot(receiver[2], to - here) / max(steep, 1e-4)) - to;
  vec2 seen = vec2(dot(receiver[0], landing), dot(receiver[1], landing));
  // On the wall as seen from the block: left is +x.
  vec2 off = 2.0 * (seen - windowCentre) / windowSize;
  gl_Position = vec4(-off.x, off.y, 0.0, 1.0);
}`;

const DENSITY = `#version 300 es
precision highp float;
in vec2 entry, leaves;
in float irradiance;
in float lost;
uniform float scale;
uniform vec2 face, corner, stock;     // half sizes, and semi-axes of the face's corners
uniform bool enters;
out vec4 power;

bool within(vec2 at, vec2 size, vec2 round) {
  vec2 beyond = abs(at) - (size - round);
  if (any(greaterThan(abs(at), size))) return false;
  return any(lessThanEqual(beyond, vec2(0.0))) || length(beyond / round) <= 1.0;
}

void main() {
  // Beside the face, or through a side wall, no light of the picture comes.
  if (!within(leaves, face, corner)) discard;
  if (enters && !within(entry, stock, corner + stock - face)) discard;
  // Where a corner of the triangle keeps its light, all of it does.
  if (lost > 0.0) discard;
  vec2 across = dFdx(entry), up = dFdy(entry);
  power = vec4(scale * irradiance * abs(across.x * up.y - across.y * up.x), 0.0, 0.0, 1.0);
}`;

const SCREEN = `#version 300 es
void main() {
  vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(corner, 0.0, 1.0);
}`;

const SHOW = `#version 300 es
precision highp float;
uniform sampler2D sums;
uniform int oversampling;
uniform float white;
uniform bool isLinear;
out vec4 colour;
void main() {
  ivec2 first = ivec2(gl_FragCoord.xy) * oversampling;
  float sum = 0.0;
  for (int j = 0; j < oversampling; j++)
    for (int i = 0; i < oversampling; i++) sum += texelFetch(sums, first + ivec2(i, j), 0).r;
  float light = clamp(sum / float(oversampling * oversampling) / white, 0.0, 1.0);
  float grey = isLinear ? light : light <= 0.0031308 ? 12.92 * light : 1.055 * pow(light, 1.0 / 2.4) - 0.055;
  colour = vec4(vec3(grey), 1.0);
}`;

function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader) ?? "shader");
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made) ?? "program");
  const places = new Map();
  for (let k = 0; k < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); k++) {
    const { name } = gl.getActiveUniform(made, k);
    places.set(name, gl.getUniformLocation(made, name));
  }
  return { made, at: (name) => places.get(name) ?? null };
}

/** Draws the light of one block. Throws where there is no WebGL2 that adds up floats. */
class Photons {
  /** Of the film as it is now. */
  oversampling = 1;
  /** Of the light that is being drawn, how many points of its source are, and all of them. */
  sampling = 1;
  drawn = 0;
  points = [];
  size = [0, 0];
  count = 0;
  stand = null;
  /** Makes the mean in the window of the design 1. */
  scale = 1;

  constructor(canvas) {
    this.canvas = canvas;
    const gl = canvas.getContext("webgl2", { antialias: false, preserveDrawingBuffer: true });
    if (!gl?.getExtension("EXT_color_buffer_float")) throw new Error("no WebGL2 with float targets");
    this.gl = gl;
    this.floats = gl.getExtension("EXT_float_blend") !== null;
    this.density = program(gl, VERTEX, DENSITY);
    this.show = program(gl, SCREEN, SHOW);
    this.sums = gl.createTexture();
    this.film = gl.createFramebuffer();
    this.vertices = gl.createBuffer();
    this.indices = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, this.vertices);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 20, 0);
    gl.enableVertexAttribArray(1);
    gl.vertexAttribPointer(1, 2, gl.FLOAT, false, 20, 12);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.indices);
  }

  /** Takes a block: its face at nx x ny places, each x, y, height and two slopes. */
  take(mesh, nx, ny, stand, across) {
    const { gl } = this;
    this.stand = stand;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.vertices);
    gl.bufferData(gl.ARRAY_BUFFER, mesh, gl.STATIC_DRAW);
    const corners = new Uint32Array(6 * (nx - 1) * (ny - 1));
    for (let j = 0, k = 0; j < ny - 1; j++) {
      for (let i = 0; i < nx - 1; i++, k += 6) {
        const v = j * nx + i;
        // Diagonals take turns, so that none is preferred.
        corners.set((i + j) % 2 ? [v, v + 1, v + nx, v + 1, v + nx + 1, v + nx] : [v, v + 1, v + nx + 1, v, v + nx + 1, v + nx], k);
      }
    }
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, corners, gl.STATIC_DRAW);
    this.count = corners.length;
    const [width, height] = stand.window_mm;
    this.resize(across, Math.max(1, Math.round((across * height) / width)), RESTING);
    this.scale = 1;
    const design = designPose(stand);
    this.begin({ ...design, source_radius: [0, 0] });
    this.add(1);
    const light = this.read();
    this.scale = light.length / (light.reduce((sum, value) => sum + value, 0) || 1);
  }

  resize(width, height, oversampling) {
    const { gl } = this;
    if (this.size[0] === width && this.size[1] === height && this.oversampling === oversampling) return;
    this.size = [width, height];
    this.oversampling = oversampling;
    this.canvas.width = width;
    this.canvas.height = height;
    gl.bindTexture(gl.TEXTURE_2D, this.sums);
    gl.texImage2D(gl.TEXTURE_2D, 0, this.floats ? gl.R32F : gl.R16F, width * oversampling, height * oversampling, 0, gl.RED, this.floats ? gl.FLOAT : gl.HALF_FLOAT, null);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.film);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.sums, 0);
    if (gl.checkFramebufferStatus(gl.FRAMEBUFFER) !== gl.FRAMEBUFFER_COMPLETE) throw new Error("no target of floats");
  }

  /** Begins the light of a pose, with `oversampling` samples per pixel along each side. */
  begin(pose, oversampling = this.oversampling) {
    const { gl, stand, size, density } = this;
    if (!stand) return;
    const { at } = density;
    this.sampling = oversampling;
    this.drawn = 0;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.film);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.viewport(0, 0, size[0] * oversampling, size[1] * oversampling);
    gl.useProgram(density.made);
    gl.uniform1f(at("ior"), pose.ior ?? 0);
    const half = ([x, y]) => [x / 2, y / 2];
    gl.uniform2fv(at("face"), half(stand.face_mm));
    gl.uniform2fv(at("stock"), half(stand.stock_mm));
    gl.uniform2fv(at("corner"), stand.corner_mm);
    gl.uniform1i(at("enters"), pose.ior === null ? 0 : 1);
    gl.uniform1f(at("entryZ"), stand.entry_z_mm);
    gl.uniform1f(at("receiverZ"), pose.distance_mm);
    gl.uniformMatrix3fv(at("block"), false, rotation(pose.block_turned).flat());
    gl.uniformMatrix3fv(at("receiver"), false, rotation(pose.receiver_turned).flat());
    gl.uniform2fv(at("windowSize"), stand.window_mm);
    gl.uniform2fv(at("windowCentre"), stand.window_centre_mm);
    const isPoint = stand.light.kind === "point";
    gl.uniform1i(at("isPoint"), isPoint ? 1 : 0);
    const axis = stand.light.kind === "point" ? stand.light.axis : normalised(pose.direction ?? [0, 0, 1]);
    if (stand.light.kind === "point") {
      gl.uniform3fv(at("aim"), axis);
      gl.uniform1i(at("emission"), { lambertian: 1, gaussian: 2 }[stand.light.emission] ?? 0);
      gl.uniform1f(at("halfAngle"), stand.light.half_angle || 1);
    }
    // Power by area in samples becomes irradiance.
    gl.uniform1f(at("scale"), this.scale * oversampling ** 2);
    const u = normalised(Math.abs(axis[0]) < 0.9 ? [1 - axis[0] * axis[0], -axis[0] * axis[1], -axis[0] * axis[2]] : [-axis[1] * axis[0], 1 - axis[1] * axis[1], -axis[1] * axis[2]]);
    const v = [axis[1] * u[2] - axis[2] * u[1], axis[2] * u[0] - axis[0] * u[2], axis[0] * u[1] - axis[1] * u[0]];
    const centre = isPoint ? (pose.position_mm ?? [0, 0, -1]) : axis;
    const hasSize = pose.source_radius[0] > 0 || pose.source_radius[1] > 0;
    this.points = Array.from({ length: hasSize ? POINTS : 1 }, (_, k) => {
      // Vogel's spiral: even over the disc.
      const spot = (k * TURN) % POINTS;
      const [r, phi] = hasSize ? [Math.sqrt((spot + 0.5) / POINTS), spot * Math.PI * (3 - Math.sqrt(5))] : [0, 0];
      const [a, b] = [pose.source_radius[0] * r * Math.cos(phi), pose.source_radius[1] * r * Math.sin(phi)];
      return [centre[0] + a * u[0] + b * v[0], centre[1] + a * u[1] + b * v[1], centre[2] + a * u[2] + b * v[2]];
    });
  }

  /** Adds the light of so many points of the source; says whether there are more. */
  add(points) {
    const { gl, size, sampling } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.film);
    gl.viewport(0, 0, size[0] * sampling, size[1] * sampling);
    gl.useProgram(this.density.made);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE);
    const light = this.density.at("light");
    for (const point of this.points.slice(this.drawn, this.drawn + points)) {
      gl.uniform3fv(light, point);
      gl.drawElements(gl.TRIANGLES, this.count, gl.UNSIGNED_INT, 0);
      this.drawn += 1;
    }
    gl.disable(gl.BLEND);
    return this.drawn < this.points.length;
  }

  /** Shows what there is; `white` is the irradiance that becomes white. Greys are encoded for a screen unless they are to be linear. */
  display(white, isLinear = false) {
    const { gl, size, show } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, size[0], size[1]);
    gl.useProgram(show.made);
    gl.bindTexture(gl.TEXTURE_2D, this.sums);
    gl.uniform1i(show.at("oversampling"), this.sampling);
    gl.uniform1f(show.at("white"), white * Math.max(1, this.drawn));
    gl.uniform1i(show.at("isLinear"), isLinear ? 1 : 0);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /** Waits until everything is drawn. */
  finish() {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.film);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.FLOAT, new Float32Array(4));
  }

  /** Irradiance in the window, row by row from the top; 1 is the mean of the design. */
  read() {
    const { gl, oversampling } = this;
    const [width, height] = this.size;
    const [nx, ny] = [width * oversampling, height * oversampling];
    const samples = new Float32Array(4 * nx * ny);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.film);
    gl.readPixels(0, 0, nx, ny, gl.RGBA, gl.FLOAT, samples);
    const light = new Float32Array(width * height);
    for (let j = 0; j < ny; j++) {
      const row = (height - 1 - Math.floor(j / oversampling)) * width;
      for (let i = 0; i < nx; i++) light[row + Math.floor(i / oversampling)] += samples[4 * (j * nx + i)] / oversampling ** 2;
    }
    return light;
  }

  /** The light of a pose and a point for a source at so many pixels across, for comparison. */
  light(pose, across) {
    const [width, height] = this.size;
    this.resize(across, Math.max(1, Math.round((across * height) / width)), COMPARED);
    this.begin({ ...pose, source_radius: [0, 0] });
    this.add(1);
    const light = this.read();
    this.resize(width, height, RESTING);
    return light;
  }
}

/** Points of a source that are drawn for a frame: as many as a frame of so many ms has time for. */
const MOST_POINTS = 6;
const FRAME_MS = 45;
/** When a pose is taken to rest, ms. */
const REST_MS = 200;

/** Shows poses as they come: at once and roughly, finely once they rest. Throws where `Photons` does. */
class LiveLight {
  pose = null;
  frame = 0;
  rest = 0;
  points = 1;

  constructor(canvas) {
    this.photons = new Photons(canvas);
  }

  /** Takes a block, as `Photons` does, and how its light is shown. */
  take(mesh, nx, ny, stand, across, white, isLinear = false) {
    this.photons.take(mesh, nx, ny, stand, across);
    Object.assign(this, { white, isLinear });
    const begin = performance.now();
    this.photons.begin(designPose(stand), MOVING);
    this.photons.add(1);
    this.photons.finish();
    this.points = Math.min(MOST_POINTS, Math.max(1, Math.floor(FRAME_MS / (performance.now() - begin))));
  }

  show(pose) {
    this.pose = pose;
    cancelAnimationFrame(this.frame);
    clearTimeout(this.rest);
    this.frame = requestAnimationFrame(() => this.draw());
    this.rest = setTimeout(() => this.refine(true), REST_MS);
  }

  /** At once, and roughly. */
  draw(pose = this.pose) {
    this.photons.begin(pose, MOVING);
    this.photons.add(this.points);
    this.photons.display(this.white, this.isLinear);
  }

  /** Finely, a few points of the source in every frame. */
  refine(isFirst) {
    if (isFirst) this.photons.begin(this.pose, RESTING);
    const isMore = this.photons.add(this.points);
    this.photons.display(this.white, this.isLinear);
    if (isMore) this.frame = requestAnimationFrame(() => this.refine(false));
  }
}

export { LiveLight, designPose, normalised, poseOf, rotation, slidersOf };

"use strict";
// The block, the light through it and its picture on the receiver, in WebGL 2. Millimetres, in the frame of the bench: light
// travels along +z, +y is up. Matrices are stored column by column.
(() => {
  const stage = document.getElementById("viewer");
  const canvas = stage.querySelector("canvas");
  const gl = canvas.getContext("webgl2", { antialias: true, alpha: true, premultipliedAlpha: true });
  if (!gl) return;
  const scene = JSON.parse(document.getElementById("scene").textContent);

  // ---- vectors and matrices ----
  const add = (a, b, s = 1) => a.map((v, k) => v + s * b[k]);
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = (a) => { const l = Math.hypot(...a) || 1; return a.map((v) => v / l); };
  const clamp = (v, low, high) => Math.min(Math.max(v, low), high);
  const product = (a, b) => {
    const c = new Float32Array(16);
    for (let j = 0; j < 4; j++) for (let i = 0; i < 4; i++) for (let k = 0; k < 4; k++) c[4 * j + i] += a[4 * k + i] * b[4 * j + k];
    return c;
  };
  const perspective = (angle, aspect, near, far) => {
    const f = 1 / Math.tan(angle / 2), m = new Float32Array(16);
    m[0] = f / aspect; m[5] = f; m[10] = (far + near) / (near - far); m[11] = -1; m[14] = (2 * far * near) / (near - far);
    return m;
  };
  const looking = (eye, at) => {
    const back = unit(add(eye, at, -1)), right = unit(cross([0, 1, 0], back)), up = cross(back, right);
    return new Float32Array([
      right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0,
      -dot(right, eye), -dot(up, eye), -dot(back, eye), 1,
    ]);
  };

  // ---- what there is ----
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
  const [nx, ny] = scene.nodes, [low, high] = scene.range;
  const steps = new DataView(bytes(scene.heights));
  const height = (i, j) => low + ((high - low) * steps.getUint16(2 * (j * nx + i), true)) / 65535;
  const [width, depth] = scene.size;
  const node = (i, j) => [width * (i / (nx - 1) - 0.5), depth * (j / (ny - 1) - 0.5)];
  const rim = scene.rim ?? 0;
  const rays = new Float32Array(bytes(scene.rays));
  const [topLeft, topRight, bottomRight, bottomLeft] = scene.receiver;
  const window0 = scene.receiver.reduce((sum, p) => add(sum, p, 0.25), [0, 0, 0]);

  // A vertex: place, height above it that can be stretched (above the lowest place of the face, which stays), slopes of the face, normal (none: that of the face).
  const STRIDE = 9;
  const vertices = [], indices = [];
  const vertex = (place, lift, slope, normal) => {
    vertices.push(...place, lift, ...slope, ...normal);
    return vertices.length / STRIDE - 1;
  };
  const quad = (a, b, c, d) => indices.push(a, b, c, a, c, d);
  const flat = (points, normal, lifts = []) => {
    const first = points.map((p, k) => vertex(p, lifts[k] ?? 0, [0, 0], normal))[0];
    for (let k = 1; k + 1 < points.length; k++) indices.push(first, first + k, first + k + 1);
  };
  let squares = 0;
  const buildFace = () => {
    const difference = (f, k, n, step) => {
      const a = Math.max(k - 1, 0), b = Math.min(k + 1, n - 1);
      return (f(b) - f(a)) / ((b - a) * step);
    };
    for (let j = 0; j < ny; j++) {
      for (let i = 0; i < nx; i++) {
        const slope = [
          difference((k) => height(k, j), i, nx, width / (nx - 1)),
          difference((k) => height(i, k), j, ny, depth / (ny - 1)),
        ];
        squares += slope[0] ** 2 + slope[1] ** 2;
        vertex([...node(i, j), low], height(i, j) - low, slope, [0, 0, 0]);
      }
    }
    for (let j = 0; j + 1 < ny; j++) {
      for (let i = 0; i + 1 < nx; i++) quad(j * nx + i, j * nx + i + 1, (j + 1) * nx + i + 1, (j + 1) * nx + i);
    }
  };
  const buildRest = () => {
    const outline = scene.outline, entry = scene.entry, n = outline.length;
    flat([...outline].reverse().map((p) => [...p, entry]), [0, 0, -1]);
    // Walls along the border of the face: down to the entry face, or to the plane of the rim.
    const foot = scene.rim === null ? entry : rim;
    const wall = (i, j, k, l, normal) => {
      const [a, b] = [node(i, j), node(k, l)], turned = scene.rim !== null && rim > height(i, j) ? normal.map((v) => -v) : normal;
      flat([[...a, foot], [...b, foot], [...b, low], [...a, low]], turned, [0, 0, height(k, l) - low, height(i, j) - low]);
    };
    for (let i = 0; i + 1 < nx; i++) {
      wall(i, 0, i + 1, 0, [0, -1, 0]);
      wall(i + 1, ny - 1, i, ny - 1, [0, 1, 0]);
    }
    for (let j = 0; j + 1 < ny; j++) {
      wall(nx - 1, j, nx - 1, j + 1, [1, 0, 0]);
      wall(0, j + 1, 0, j, [-1, 0, 0]);
    }
    if (scene.rim === null) return;
    for (let k = 0; k < n; k++) {
      const a = outline[k], b = outline[(k + 1) % n], normal = unit([b[1] - a[1], a[0] - b[0], 0]);
      flat([[...a, entry], [...b, entry], [...b, rim], [...a, rim]], normal);
    }
    // The frame between the face and the outline: every corner of the face sees its neighbours of the outline.
    const corners = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]].map(([u, v]) => [u * width, v * depth]);
    const nearest = outline.map((p) => (p[0] > 0 ? (p[1] > 0 ? 2 : 1) : p[1] > 0 ? 3 : 0));
    for (let k = 0; k < n; k++) {
      const l = (k + 1) % n, a = corners[nearest[k]], b = corners[nearest[l]];
      const points = nearest[k] === nearest[l] ? [outline[k], outline[l], a] : [outline[k], outline[l], b, a];
      flat(points.map((p) => [...p, rim]), [0, 0, 1]);
    }
  };
  buildFace();
  buildRest();
  // Slopes of a few degrees are hardly seen: they are shaded as steep as this, whatever they are.
  const steep = Math.max(1, 0.4 / Math.sqrt(squares / (nx * ny) || 1));

  // Edges as pairs of points, the last number of each the height above it that can be stretched.
  const edges = [];
  const edge = (a, b) => edges.push(...a, ...b);
  const round = (points) => points.forEach((p, k) => edge(p, points[(k + 1) % points.length]));
  const onBorder = (i, j) => [...node(i, j), low, height(i, j) - low];
  for (let i = 0; i + 1 < nx; i++) for (const j of [0, ny - 1]) edge(onBorder(i, j), onBorder(i + 1, j));
  for (let j = 0; j + 1 < ny; j++) for (const i of [0, nx - 1]) edge(onBorder(i, j), onBorder(i, j + 1));
  round(scene.outline.map((p) => [...p, scene.entry, 0]));
  if (scene.rim === null) {
    for (const i of [0, nx - 1]) for (const j of [0, ny - 1]) edge([...node(i, j), scene.entry, 0], onBorder(i, j));
  } else {
    round(scene.outline.map((p) => [...p, rim, 0]));
    scene.outline.forEach((p) => edge([...p, scene.entry, 0], [...p, rim, 0]));
  }

  // ---- programs ----
  const compile = (vertexSource, fragmentSource) => {
    const program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, vertexSource], [gl.FRAGMENT_SHADER, fragmentSource]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, `#version 300 es\nprecision highp float;\n${source}`);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(gl.getProgramInfoLog(program));
    const places = {};
    for (let k = 0; k < (gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS) || 0); k++) {
      const { name } = gl.getActiveUniform(program, k);
      places[name] = gl.getUniformLocation(program, name);
    }
    return { program, places };
  };
  const GLASS = [`
    layout(location = 0) in vec3 place; layout(location = 1) in float lift;
    layout(location = 2) in vec2 slope; layout(location = 3) in vec3 side;
    uniform mat4 view; uniform float stretch, steep;
    out vec3 at; out vec3 normal;
    void main() {
      at = place + vec3(0.0, 0.0, stretch * lift);
      normal = dot(side, side) > 0.0 ? side : vec3(-stretch * steep * slope, 1.0);
      gl_Position = view * vec4(at, 1.0);
    }`, `
    in vec3 at; in vec3 normal; uniform vec3 eye; uniform float matte; out vec4 colour;
    // A studio: a dim room, two soft boxes, and a row of lamps, whose bent images show every slope.
    vec3 room(vec3 d) {
      vec3 base = mix(vec3(0.05, 0.08, 0.12), vec3(0.36, 0.46, 0.58), smoothstep(-0.7, 0.8, d.y));
      float key = smoothstep(0.55, 0.95, dot(d, normalize(vec3(-0.40, 0.62, 0.68))));
      float fill = smoothstep(0.60, 0.97, dot(d, normalize(vec3(0.75, 0.25, -0.60))));
      float lamps = smoothstep(0.35, 0.95, sin(11.0 * d.y + 4.0 * d.x));
      return base + vec3(1.0, 0.98, 0.95) * (1.1 * key + 0.16 * lamps) + vec3(0.60, 0.78, 1.0) * 0.6 * fill;
    }
    void main() {
      vec3 v = normalize(eye - at), n = normalize(normal);
      n = dot(n, v) > 0.0 ? n : -n;
      float c = max(dot(n, v), 0.0);
      float mirror = 0.06 + 0.94 * pow(1.0 - c, 4.0);
      vec3 through = vec3(0.52, 0.76, 0.95) * (0.12 + 0.9 * room(refract(-v, n, 0.67)));
      vec3 glass = mix(through, room(reflect(-v, n)), clamp(mirror + 0.2, 0.0, 1.0));
      float tone = 0.16 + 0.74 * max(dot(n, normalize(vec3(-0.55, 0.65, 0.52))), 0.0) + 0.16 * max(dot(n, normalize(vec3(0.7, 0.2, -0.6))), 0.0);
      vec3 shade = vec3(0.95, 0.955, 0.97) * tone;
      float alpha = mix(clamp(0.40 + 0.6 * mirror, 0.0, 1.0), 1.0, matte);
      colour = vec4(mix(glass, shade, matte) * alpha, alpha);
    }`];
  const EDGES = [`
    layout(location = 0) in vec3 place; layout(location = 1) in float lift;
    uniform mat4 view; uniform float stretch;
    void main() {
      gl_Position = view * vec4(place + vec3(0.0, 0.0, stretch * lift), 1.0);
      // In front of the faces that meet there.
      gl_Position.z -= 0.0006 * gl_Position.w;
    }`, `
    uniform float strength; out vec4 colour;
    void main() { colour = vec4(0.80, 0.91, 1.0, 1.0) * strength; }`];
  const RAYS = [`
    layout(location = 0) in vec3 place; layout(location = 1) in float weight;
    uniform mat4 view; out float shown;
    void main() { shown = weight; gl_Position = view * vec4(place, 1.0); }`, `
    in float shown; uniform float strength; out vec4 colour;
    void main() { colour = vec4(vec3(1.0, 0.76, 0.40) * shown * strength, 0.0); }`];
  const PICTURE = [`
    layout(location = 0) in vec3 place; layout(location = 1) in vec2 corner;
    uniform mat4 view; out vec2 uv;
    void main() { uv = corner; gl_Position = view * vec4(place, 1.0); }`, `
    in vec2 uv; uniform sampler2D light; uniform float line; out vec4 colour;
    void main() {
      vec3 seen = texture(light, uv).rgb * vec3(1.0, 0.955, 0.87);
      seen *= gl_FrontFacing ? 1.0 : 0.55;
      colour = mix(vec4(seen, 1.0), vec4(0.55, 0.60, 0.67, 1.0), line);
    }`];

  let parts;
  const upload = () => {
    const buffer = (target, data) => {
      gl.bindBuffer(target, gl.createBuffer());
      gl.bufferData(target, data, gl.STATIC_DRAW);
    };
    const layout = (stride, ...sizes) => {
      let offset = 0;
      sizes.forEach((size, k) => {
        gl.enableVertexAttribArray(k);
        gl.vertexAttribPointer(k, size, gl.FLOAT, false, 4 * stride, 4 * offset);
        offset += size;
      });
    };
    const array = (fill) => {
      const vao = gl.createVertexArray();
      gl.bindVertexArray(vao);
      fill();
      gl.bindVertexArray(null);
      return vao;
    };
    const block = array(() => {
      buffer(gl.ARRAY_BUFFER, new Float32Array(vertices));
      buffer(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(indices));
      layout(STRIDE, 3, 1, 2, 3);
    });
    const lines = [];
    for (let k = 0; k + 11 < rays.length; k += 12) {
      // Start, entry, exit, landing; parallel light fades in.
      for (const [a, b, from, to] of [[0, 1, 0.0, 0.34], [1, 2, 0.3, 0.3], [2, 3, 0.42, 0.1]]) {
        lines.push(...rays.subarray(k + 3 * a, k + 3 * a + 3), from, ...rays.subarray(k + 3 * b, k + 3 * b + 3), to);
      }
    }
    const light = array(() => { buffer(gl.ARRAY_BUFFER, new Float32Array(lines)); layout(4, 3, 1); });
    const border = array(() => { buffer(gl.ARRAY_BUFFER, new Float32Array(edges)); layout(4, 3, 1); });
    const corners = [...topLeft, 0, 0, ...topRight, 1, 0, ...bottomRight, 1, 1, ...bottomLeft, 0, 1];
    const picture = array(() => { buffer(gl.ARRAY_BUFFER, new Float32Array(corners)); layout(5, 3, 2); });
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, document.getElementById("caustic"));
    gl.generateMipmap(gl.TEXTURE_2D);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
    const sharp = gl.getExtension("EXT_texture_filter_anisotropic");
    if (sharp) gl.texParameterf(gl.TEXTURE_2D, sharp.TEXTURE_MAX_ANISOTROPY_EXT, 8);
    parts = { glass: compile(...GLASS), ray: compile(...RAYS), wall: compile(...PICTURE), edge: compile(...EDGES), block, border, light, picture, texture, count: lines.length / 4 };
  };

  // ---- the camera ----
  const ANGLE = 0.6;
  const reach = (points, centre) => points.reduce((most, p) => Math.max(most, Math.hypot(...add(p, centre, -1))), 0);
  const blockPoints = scene.outline.flatMap((p) => [[...p, scene.entry], [...p, Math.max(high, rim)]]);
  const everything = [...blockPoints, ...scene.receiver];
  // Rays that all begin in one point come from a source, which is part of the bench.
  const begin = (k) => [...rays.subarray(12 * k, 12 * k + 3)];
  const lamp = rays.length >= 24 && `${begin(0)}` === `${begin(rays.length / 12 - 1)}` ? begin(0) : null;
  if (lamp) everything.push(lamp);
  const middle = (points) => [0, 1, 2].map((k) => {
    const values = points.map((p) => p[k]);
    return (Math.min(...values) + Math.max(...values)) / 2;
  });
  const away = (direction) => ({ yaw: Math.atan2(direction[0], direction[2]), pitch: Math.asin(unit(direction)[1]) });
  const frameOf = ({ yaw, pitch }) => {
    const back = [Math.cos(pitch) * Math.sin(yaw), Math.sin(pitch), Math.cos(pitch) * Math.cos(yaw)];
    const right = unit(cross([0, 1, 0], back));
    return [right, cross(back, right), back];
  };
  const aspect = () => clamp(canvas.clientWidth / Math.max(canvas.clientHeight, 1), 0.2, 5);
  // Where a camera that looks this way has to be for all points to be in sight and in the middle.
  const fit = (points, direction, margin) => {
    const way = away(direction), [right, up, back] = frameOf(way);
    const tall = Math.tan(ANGLE / 2) * margin, wide = tall * aspect();
    let at = middle(points), distance = 1;
    for (let round = 0; round < 6; round++) {
      const seen = points.map((p) => add(p, at, -1)).map((q) => [dot(q, right), dot(q, up), dot(q, back)]);
      distance = seen.reduce((most, [x, y, z]) => Math.max(most, z + Math.abs(x) / wide, z + Math.abs(y) / tall), 1);
      const shown = (k) => seen.map((q) => q[k] / (distance - q[2]));
      const centre = (values) => (0.5 * (Math.min(...values) + Math.max(...values))) * distance;
      at = add(add(at, right, centre(shown(0))), up, centre(shown(1)));
    }
    return { ...way, at, distance };
  };
  const facing = unit(cross(add(topRight, topLeft, -1), add(bottomLeft, topLeft, -1)));
  const inward = dot(facing, window0) > 0 ? facing.map((v) => -v) : facing;
  const views = {
    // The face not edge-on, and neither block nor picture before the other.
    bench: () => fit(everything, scene.look, 0.84),
    block: () => fit(blockPoints, [0.5, 0.42, 0.95], 0.8),
    picture: () => fit(scene.receiver, inward, 0.86),
  };
  const size = reach(everything, middle(everything));
  let camera = views.bench(), moved = false, focus = "bench", animation = 0, pending = false;
  const shown = { rays: true, receiver: true, matte: false };
  let stretch = 1;

  const eyeOf = (view) => add(view.at, frameOf(view)[2], view.distance);
  const redraw = () => {
    if (pending) return;
    pending = true;
    requestAnimationFrame(() => { pending = false; draw(); });
  };
  const draw = () => {
    if (gl.isContextLost() || !parts) return;
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const [w, h] = [canvas.clientWidth, canvas.clientHeight].map((n) => Math.max(1, Math.round(n * ratio)));
    if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
    const eye = eyeOf(camera);
    const far = camera.distance + 3 * size;
    const view = product(perspective(ANGLE, w / h, Math.max(camera.distance / 200, far / 20000), far), looking(eye, camera.at));
    gl.viewport(0, 0, w, h);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    gl.disable(gl.CULL_FACE);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    const drawRays = () => {
      if (!shown.rays) return;
      gl.depthMask(false);
      gl.useProgram(parts.ray.program);
      gl.uniformMatrix4fv(parts.ray.places.view, false, view);
      gl.uniform1f(parts.ray.places.strength, focus === "block" ? 0.4 : 1);
      gl.bindVertexArray(parts.light);
      gl.drawArrays(gl.LINES, 0, parts.count);
      gl.depthMask(true);
    };
    // After the rays, which end on the picture and do not run across it.
    const drawPicture = () => {
      if (!shown.receiver) return;
      const { program, places } = parts.wall;
      gl.useProgram(program);
      gl.uniformMatrix4fv(places.view, false, view);
      gl.bindTexture(gl.TEXTURE_2D, parts.texture);
      gl.bindVertexArray(parts.picture);
      // Seen from the block, top left to top right to bottom right runs clockwise.
      gl.frontFace(gl.CW);
      gl.uniform1f(places.line, 0);
      gl.drawArrays(gl.TRIANGLE_FAN, 0, 4);
      gl.uniform1f(places.line, 1);
      gl.drawArrays(gl.LINE_LOOP, 0, 4);
      gl.frontFace(gl.CCW);
    };
    if (!shown.matte) {
      drawRays();
      drawPicture();
    }
    const { program, places } = parts.glass;
    gl.useProgram(program);
    gl.uniformMatrix4fv(places.view, false, view);
    gl.uniform3fv(places.eye, eye);
    gl.uniform1f(places.stretch, stretch);
    gl.uniform1f(places.steep, Math.max(1, steep / stretch));
    gl.uniform1f(places.matte, shown.matte ? 1 : 0);
    gl.bindVertexArray(parts.block);
    // Whoever looks at the picture from behind the block wants to see the picture.
    if (focus === "picture") {
      // Its edges are enough.
    } else if (shown.matte) {
      gl.drawElements(gl.TRIANGLES, indices.length, gl.UNSIGNED_INT, 0);
    } else {
      // Far sides first: every triangle of a convex body is either behind or in front.
      gl.enable(gl.CULL_FACE);
      for (const side of [gl.FRONT, gl.BACK]) {
        gl.cullFace(side);
        gl.drawElements(gl.TRIANGLES, indices.length, gl.UNSIGNED_INT, 0);
      }
      gl.disable(gl.CULL_FACE);
    }
    if (shown.matte) {
      drawRays();
      drawPicture();
    }
    gl.useProgram(parts.edge.program);
    gl.uniformMatrix4fv(parts.edge.places.view, false, view);
    gl.uniform1f(parts.edge.places.stretch, stretch);
    gl.bindVertexArray(parts.border);
    if (!shown.matte || focus === "picture") {
      // Hidden edges shine through glass.
      gl.disable(gl.DEPTH_TEST);
      gl.uniform1f(parts.edge.places.strength, 0.22);
      gl.drawArrays(gl.LINES, 0, edges.length / 4);
      gl.enable(gl.DEPTH_TEST);
    }
    if (focus !== "picture") {
      gl.uniform1f(parts.edge.places.strength, shown.matte ? 0.35 : 0.6);
      gl.drawArrays(gl.LINES, 0, edges.length / 4);
    }
    gl.bindVertexArray(null);
    placeTags(view, w / ratio, h / ratio);
  };

  // ---- words in the picture ----
  const tags = stage.querySelector(".tags");
  const tag = (text, place) => {
    const span = document.createElement("span");
    span.textContent = text;
    tags.append(span);
    return { span, place };
  };
  const half = [width / 2, depth / 2];
  const words = [
    tag(scene.mirror ? "mirror" : "block", [-half[0], -half[1], scene.entry]),
    tag("receiver", bottomRight),
    tag("+x", [half[0] * 1.12, 0, 0]),
    tag("+y", [0, half[1] * 1.12, 0]),
    ...(lamp ? [tag("light", lamp)] : []),
  ];
  const placeTags = (view, w, h) => {
    for (const { span, place } of words) {
      const p = [...place, 1], [x, y, , q] = [0, 1, 2, 3].map((i) => p[0] * view[i] + p[1] * view[4 + i] + p[2] * view[8 + i] + view[12 + i]);
      const seen = q > 0 && Math.abs(x) < q && Math.abs(y) < q && (span.textContent !== "receiver" || shown.receiver);
      span.style.visibility = seen ? "visible" : "hidden";
      // Never over the buttons below, or beyond the sides.
      const [wide, tall] = [span.offsetWidth / 2, span.offsetHeight + 6];
      if (seen) span.style.transform = `translate(${clamp(((x / q + 1) * w) / 2, wide, w - wide)}px, ${Math.min(((1 - y / q) * h) / 2, h - tall)}px) translate(-50%, 6px)`;
    }
  };

  // ---- moving ----
  const still = matchMedia("(prefers-reduced-motion: reduce)");
  const go = (goal) => {
    cancelAnimationFrame(animation);
    const from = { ...camera }, begin = performance.now();
    const turn = ((goal.yaw - from.yaw + 3 * Math.PI) % (2 * Math.PI)) - Math.PI;
    const step = (now) => {
      const t = still.matches ? 1 : clamp((now - begin) / 450, 0, 1), s = t * t * (3 - 2 * t);
      camera = t >= 1 ? goal : {
        yaw: from.yaw + s * turn,
        pitch: from.pitch + s * (goal.pitch - from.pitch),
        distance: from.distance * (goal.distance / from.distance) ** s,
        at: from.at.map((v, k) => v + s * (goal.at[k] - v)),
      };
      draw();
      if (t < 1) animation = requestAnimationFrame(step);
    };
    animation = requestAnimationFrame(step);
  };
  const touchCamera = (change) => {
    cancelAnimationFrame(animation);
    moved = true;
    camera = { ...camera, ...change };
    camera.pitch = clamp(camera.pitch, -1.55, 1.55);
    camera.distance = clamp(camera.distance, 0.02 * size, 12 * size);
    redraw();
  };
  const rotate = (dx, dy) => touchCamera({ yaw: camera.yaw - 0.008 * dx, pitch: camera.pitch + 0.008 * dy });
  const zoom = (factor) => touchCamera({ distance: camera.distance * factor });
  const shift = (dx, dy) => {
    const [right, up] = frameOf(camera);
    const scale = (2 * camera.distance * Math.tan(ANGLE / 2)) / Math.max(canvas.clientHeight, 1);
    touchCamera({ at: add(add(camera.at, right, -dx * scale), up, dy * scale) });
  };

  const pointers = new Map();
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const now = [event.clientX, event.clientY], [dx, dy] = [now[0] - before[0], now[1] - before[1]];
    if (pointers.size === 1) {
      if (event.shiftKey || event.buttons & 6) shift(dx, dy);
      else rotate(dx, dy);
    } else if (pointers.size === 2) {
      const [, other] = [...pointers].find(([id]) => id !== event.pointerId);
      const apart = (p) => Math.hypot(p[0] - other[0], p[1] - other[1]) || 1;
      zoom(apart(before) / apart(now));
      shift(dx / 2, dy / 2);
    }
    pointers.set(event.pointerId, now);
  });
  for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) {
    canvas.addEventListener(name, (event) => pointers.delete(event.pointerId));
  }
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 16 : event.deltaMode === 2 ? 400 : 1;
    zoom(Math.exp(clamp(event.deltaY * lines, -240, 240) * 0.0016));
  }, { passive: false });
  canvas.addEventListener("dblclick", () => reset());
  canvas.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const keys = {
      ArrowLeft: () => (event.shiftKey ? shift(30, 0) : rotate(30, 0)), ArrowRight: () => (event.shiftKey ? shift(-30, 0) : rotate(-30, 0)),
      ArrowUp: () => (event.shiftKey ? shift(0, 30) : rotate(0, 30)), ArrowDown: () => (event.shiftKey ? shift(0, -30) : rotate(0, -30)),
      "+": () => zoom(0.87), "=": () => zoom(0.87), "-": () => zoom(1.15), 0: () => reset(), Home: () => reset(),
    };
    if (!keys[event.key]) return;
    event.preventDefault();
    keys[event.key]();
  });

  // ---- buttons ----
  const relief = stage.querySelector(".relief input"), reliefText = stage.querySelector(".relief output");
  const setRelief = (value) => {
    stretch = value;
    relief.value = value;
    reliefText.value = `×${value}`;
    redraw();
  };
  const setShown = (name, value) => {
    shown[name] = value;
    stage.querySelector(`[data-toggle="${name}"]`).setAttribute("aria-pressed", value);
    redraw();
  };
  const reset = () => {
    setRelief(1);
    setShown("rays", true);
    setShown("receiver", true);
    setShown("matte", false);
    moved = false;
    focus = "bench";
    go(views.bench());
  };
  stage.querySelector('[data-do="reset"]').addEventListener("click", reset);
  for (const button of stage.querySelectorAll("[data-view]")) {
    button.addEventListener("click", () => {
      moved = true;
      focus = button.dataset.view;
      go(views[focus]());
    });
  }
  for (const button of stage.querySelectorAll("[data-toggle]")) {
    button.addEventListener("click", () => setShown(button.dataset.toggle, !shown[button.dataset.toggle]));
  }
  relief.addEventListener("input", () => setRelief(Number(relief.value)));

  canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
  canvas.addEventListener("webglcontextrestored", () => { upload(); redraw(); });
  new ResizeObserver(() => {
    if (!moved) camera = views.bench();
    redraw();
  }).observe(canvas);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);

  document.getElementById("caustic").decode().then(() => {
    upload();
    stage.classList.add("live");
    camera = views.bench();
    draw();
  }).catch((error) => console.error(error));
})();

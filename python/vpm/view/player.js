"use strict";
(() => {
  const scene = JSON.parse(document.getElementById("scene").textContent);
  const get = (id) => document.getElementById(id);
  const bytes = Uint8Array.from(atob(scene.places), (letter) => letter.charCodeAt(0));
  const places = new Int16Array(bytes.buffer);
  const unit = scene.reach / 32767;
  const duration = scene.time[scene.time.length - 1] - scene.time[0];
  const asked = new URLSearchParams(location.hash.slice(1)); // #t=0.3&dark: a moment, for links and pictures
  const hidden = new Set();
  let dark = asked.has("dark") || (!asked.has("light") && matchMedia("(prefers-color-scheme: dark)").matches);
  let now = asked.has("t") ? Math.min(Math.max(Number(asked.get("t")) - scene.time[0] || 0, 0), duration) : 0;
  let playing = duration > 0 && !asked.has("t");
  let speed = 1;
  let dirty = true;

  // ---- vectors
  const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
  const sub = (a, b) => add(a, b, -1);
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const times = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
  const norm = (a) => Math.hypot(a[0], a[1], a[2]);
  const unitOf = (a) => times(a, 1 / Math.max(norm(a), 1e-12));
  const turn = (v, axis, angle) => {
    const c = Math.cos(angle), s = Math.sin(angle);
    return add(add(times(v, c), cross(axis, v), s), axis, dot(axis, v) * (1 - c));
  };
  const across = (v) => {
    const size = v.map(Math.abs), least = size.indexOf(Math.min(...size));
    return unitOf(cross(v, [0, 1, 2].map((i) => (i === least ? 1 : 0))));
  };

  // ---- the camera of vpm.view.camera
  const SLOPE = 12 / 70;
  const home = () => ({ front: scene.front, up: scene.up, centre: scene.centre, closer: 1 });
  let view = home();
  const camera = (aspect) => {
    const slopes = [SLOPE * Math.max(aspect, 1), SLOPE * Math.max(1 / aspect, 1)];
    const away = (slope) => scene.radius / Math.sin(Math.atan(slope));
    const distance = Math.max(away(slopes[0]), away(slopes[1] * scene.stage)) / view.closer;
    const right = unitOf(cross(view.up, view.front));
    return { eye: add(view.centre, view.front, distance), right, up: cross(view.front, right), front: view.front, slopes, distance };
  };
  const matrix = (c) => {
    const near = c.distance * 0.02, far = c.distance + 40 * scene.radius;
    const rows = [times(c.right, 1 / c.slopes[0]), times(c.up, 1 / c.slopes[1]), times(c.front, -1)];
    const [x, y, w] = rows.map((row) => [...row, -dot(row, c.eye)]);
    const z = w.map((entry, i) => (entry * (far + near)) / (far - near) - (i === 3 ? (2 * far * near) / (far - near) : 0));
    return [0, 1, 2, 3].flatMap((i) => [x[i], y[i], z[i], w[i]]);
  };

  // ---- shapes to triangles
  let corners = new Float32Array(10 * 100000), filled = 0;
  const corner = (p, n, colour) => {
    if (filled + 10 > corners.length) {
      const more = new Float32Array(2 * corners.length);
      more.set(corners);
      corners = more;
    }
    corners.set([p[0], p[1], p[2], n[0], n[1], n[2], colour[0], colour[1], colour[2], colour[3]], filled);
    filled += 10;
  };
  const face = (a, b, c, na, nb, nc, colour) => { corner(a, na, colour); corner(b, nb, colour); corner(c, nc, colour); };
  const ring = (p, u, v, radius, sides) => Array.from({ length: sides + 1 }, (_, k) => {
    const angle = (2 * Math.PI * k) / sides, n = add(times(u, Math.cos(angle)), v, Math.sin(angle));
    return [add(p, n, radius), n];
  });
  const disc = (p, edge, normal, colour) => {
    for (let k = 0; k + 1 < edge.length; k++) face(p, edge[k][0], edge[k + 1][0], normal, normal, normal, colour);
  };
  const tube = (path, radius, colour, sides = 16) => {
    const tangents = path.map((_, i) => unitOf(sub(path[Math.min(i + 1, path.length - 1)], path[Math.max(i - 1, 0)])));
    let u = across(tangents[0]), before = null;
    path.forEach((p, i) => {
      u = unitOf(add(u, tangents[i], -dot(u, tangents[i]))); // carried along without a twist
      const edge = ring(p, u, cross(tangents[i], u), radius[i], sides);
      if (before) for (let k = 0; k < sides; k++) {
        const [a, na] = before[k], [b, nb] = before[k + 1], [c, nc] = edge[k], [d, nd] = edge[k + 1];
        face(a, b, c, na, nb, nc, colour);
        face(b, d, c, nb, nd, nc, colour);
      }
      if (sides > 4 && i === 0) disc(p, edge, times(tangents[i], -1), colour);
      if (sides > 4 && i === path.length - 1) disc(p, edge, tangents[i], colour);
      before = edge;
    });
  };
  const sphere = (p, radius, colour, rows = 12) => {
    const at = (i, k) => {
      const a = (Math.PI * i) / rows, b = (Math.PI * k) / rows;
      return [Math.sin(a) * Math.cos(b), Math.sin(a) * Math.sin(b), Math.cos(a)];
    };
    for (let i = 0; i < rows; i++) for (let k = 0; k < 2 * rows; k++) {
      const [a, b, c, d] = [at(i, k), at(i + 1, k), at(i, k + 1), at(i + 1, k + 1)];
      face(add(p, a, radius), add(p, b, radius), add(p, c, radius), a, b, c, colour);
      face(add(p, b, radius), add(p, d, radius), add(p, c, radius), b, d, c, colour);
    }
  };
  const box = ([p, ...middles], colour) => {
    const sides = middles.map((middle) => sub(middle, p));
    for (let i = 0; i < 3; i++) for (const sign of [1, -1]) {
      const n = times(unitOf(sides[i]), sign), m = add(p, sides[i], sign), u = sides[(i + 1) % 3], v = sides[(i + 2) % 3];
      const [a, b, c, d] = [[1, 1], [-1, 1], [1, -1], [-1, -1]].map(([s, t]) => add(add(m, u, s), v, t));
      face(a, b, c, n, n, n, colour);
      face(b, d, c, n, n, n, colour);
    }
  };
  const arrow = (start, end, radius, colour) => {
    const way = sub(end, start), length = norm(way);
    if (length < 1e-3 * radius) return;
    const head = Math.min(6 * radius, 0.6 * length), neck = add(end, unitOf(way), -head), thick = Math.min(radius, 0.25 * length);
    tube([start, neck], [thick, thick], colour, 12);
    tube([neck, end], [2.6 * thick, 0], colour, 16);
  };

  // ---- a moment
  const colourOf = (role) => {
    const text = scene.looks[role][dark ? "dark" : "light"];
    return [1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16) / 255);
  };
  const sampleOf = (t) => {
    let low = 0, high = scene.time.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (scene.time[middle] <= t) low = middle; else high = middle;
    }
    const width = scene.time[high] - scene.time[low];
    return [low, high, width > 0 ? Math.min(Math.max((t - scene.time[low]) / width, 0), 1) : 0];
  };
  const pointsOf = (shape, [low, high, share]) => Array.from({ length: shape.count }, (_, k) => {
    const at = (sample) => shape.first + 3 * (Math.min(sample, shape.samples - 1) * shape.count + k);
    const a = at(low), b = at(high);
    return [0, 1, 2].map((i) => scene.centre[i] + unit * ((1 - share) * places[a + i] + share * places[b + i]));
  });
  const build = () => {
    const moment = sampleOf(scene.time[0] + now);
    filled = 0;
    const shown = scene.shapes.filter((shape) => !hidden.has(shape.role));
    const nets = shown.filter(isNet), clear = shown.filter((shape) => scene.looks[shape.role].solid < 1);
    const solid = shown.filter((shape) => !isNet(shape) && !clear.includes(shape));
    return [nets, solid, clear].map((shapes) => { const first = filled; one(shapes, moment); return [first / 10, (filled - first) / 10]; });
  };
  const isNet = (shape) => shape.role === "floor" || shape.role === "plane";
  const one = (shapes, moment) => {
    for (const shape of shapes) {
      const points = pointsOf(shape, moment), colour = [...colourOf(shape.role), scene.looks[shape.role].solid];
      if (isNet(shape)) points.forEach((p) => corner(p, scene.up, colour));
      else if (shape.form === "tube") tube(points, shape.radius, colour);
      else if (shape.form === "sphere") sphere(points[0], shape.radius, colour);
      else if (shape.form === "box") box(points, colour);
      else arrow(points[0], points[1], shape.radius, colour);
    }
  };

  // ---- WebGL
  const canvas = get("canvas");
  const gl = canvas.getContext("webgl", { alpha: false, antialias: true, preserveDrawingBuffer: true });
  if (!gl) { get("sorry").hidden = false; return; }
  const compiled = (kind, source) => {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    return shader;
  };
  const program = gl.createProgram();
  gl.attachShader(program, compiled(gl.VERTEX_SHADER, `
    attribute vec3 place, normal; attribute vec4 colour; uniform mat4 matrix; varying vec3 n, p; varying vec4 c;
    void main() { n = normal; c = colour; p = place; gl_Position = matrix * vec4(place, 1.0); }`));
  gl.attachShader(program, compiled(gl.FRAGMENT_SHADER, `
    precision mediump float; varying vec3 n, p; varying vec4 c; uniform vec3 up, eye, lamp;
    void main() {
      vec3 m = normalize(n), e = normalize(eye - p);
      if (dot(m, e) < 0.0) m = -m;
      float light = 0.66 + 0.12 * dot(m, up) + 0.30 * max(dot(m, lamp), 0.0);
      float shine = 0.16 * pow(max(dot(m, normalize(lamp + e)), 0.0), 28.0);
      gl_FragColor = vec4(c.rgb * light + shine, c.a);
    }`));
  gl.linkProgram(program);
  gl.useProgram(program);
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  ["place", "normal", "colour"].forEach((name, i) => {
    const where = gl.getAttribLocation(program, name);
    gl.enableVertexAttribArray(where);
    gl.vertexAttribPointer(where, i === 2 ? 4 : 3, gl.FLOAT, false, 40, 12 * i);
  });
  gl.enable(gl.DEPTH_TEST);
  gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
  const give = (name) => gl.getUniformLocation(program, name);
  const draw = () => {
    const ratio = Math.min(devicePixelRatio || 1, 2.5);
    const [width, height] = [Math.round(innerWidth * ratio), Math.round(innerHeight * ratio)];
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    const c = camera(width / height), text = scene.ground[dark ? "dark" : "light"];
    const [nets, solid, clear] = build();
    gl.viewport(0, 0, width, height);
    gl.clearColor(...[1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16) / 255), 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.uniformMatrix4fv(give("matrix"), false, matrix(c));
    gl.uniform3fv(give("up"), scene.up);
    gl.uniform3fv(give("eye"), c.eye);
    gl.uniform3fv(give("lamp"), unitOf(add(add(c.front, c.up, 0.6), c.right, -0.4)));
    gl.bufferData(gl.ARRAY_BUFFER, corners.subarray(0, filled), gl.DYNAMIC_DRAW);
    gl.drawArrays(gl.LINES, ...nets);
    gl.drawArrays(gl.TRIANGLES, ...solid);
    gl.enable(gl.BLEND); // what one sees through comes last, and hides nothing behind it
    gl.depthMask(false);
    gl.drawArrays(gl.TRIANGLES, ...clear);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  };

  // ---- words and controls
  get("title").textContent = scene.title;
  get("subtitle").textContent = [scene.subtitle, `one square is ${scene.grid} m`].filter(Boolean).join(" · ");
  const legend = () => {
    const theme = dark ? "dark" : "light";
    get("roles").replaceChildren(...Object.entries(scene.looks).flatMap(([role, look]) => {
      const square = `one square is ${scene.grid} m`;
      const scale = scene.scales[role] || (role === "floor" || role === "plane" ? square : "");
            const item = document.createElement("li"), button = document.createElement("button"), mark = document.createElement("i");
      const text = document.createElement("span"), small = document.createElement("small");
      mark.style.background = look[theme];
      text.append(look.word, scale ? " " : "", small);
      small.textContent = scale ? `(${scale})` : "";
      item.className = hidden.has(role) ? "off" : "";
      button.append(mark, text);
      button.title = "show or hide";
      button.onclick = () => { if (!hidden.delete(role)) hidden.add(role); legend(); dirty = true; };
      item.append(button);
      return [item];
    }));
    const root = document.documentElement.style, ground = scene.ground[theme];
    root.setProperty("--ground", ground);
    root.setProperty("--veil", ground + "d9");
    root.setProperty("--ink", scene.ink[theme]);
    root.setProperty("--soft", scene.soft[theme]);
    root.colorScheme = theme;
  };
  get("notes").replaceChildren(...scene.notes.map((note) => {
    const line = document.createElement("p");
    line.className = "note";
    line.textContent = note;
    return line;
  }));
  get("legend").open = innerWidth > 900;
  const speeds = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10];
  const wished = duration / 5; // slow enough to see, and no longer than need be
  speed = duration > 4 && duration < 30 ? 1 : speeds.reduce((best, one) => (Math.abs(Math.log(one / wished)) < Math.abs(Math.log(best / wished)) ? one : best), 1);
  for (const one of speeds) {
    const option = document.createElement("option");
    option.value = one;
    option.textContent = `${one}×`;
    option.selected = one === speed;
    get("speed").append(option);
  }
  const digits = Math.max(0, Math.min(4, 2 - Math.floor(Math.log10(Math.max(duration, 1e-3)))));
  const tell = () => {
    get("now").textContent = `${(scene.time[0] + now).toFixed(digits)} s`;
    get("time").value = duration > 0 ? (1000 * now) / duration : 0;
    get("play").textContent = playing ? "❚❚" : "▶";
  };
  const play = () => { if (duration > 0) { if (!playing && now >= duration) now = 0; playing = !playing; tell(); } };
  const step = (share) => { playing = false; now = Math.min(Math.max(now + share * duration, 0), duration); dirty = true; };
  get("controls").hidden = duration <= 0;
  if (duration <= 0) get("controls").style.display = "none";
  get("play").onclick = play;
  get("speed").onchange = (event) => { speed = Number(event.target.value); };
  get("time").oninput = (event) => { playing = false; now = (Number(event.target.value) / 1000) * duration; dirty = true; };
  get("theme").onclick = () => { dark = !dark; legend(); dirty = true; };
  addEventListener("resize", () => { dirty = true; });
  addEventListener("keydown", (event) => {
    if (event.target.closest("select, input")) return;
    if (event.key === " " && !event.target.closest("button, summary")) { event.preventDefault(); play(); }
    if (event.key === "ArrowRight") step(0.005);
    if (event.key === "ArrowLeft") step(-0.005);
  });

  // ---- fingers and mouse: one turns, two move and come closer
  const fingers = new Map();
  const orbit = (dx, dy) => {
    view.front = unitOf(turn(view.front, scene.up, -0.008 * dx));
    const right = unitOf(cross(scene.up, view.front)), tilted = unitOf(turn(view.front, right, -0.008 * dy));
    if (Math.abs(dot(tilted, scene.up)) < 0.995) view.front = tilted;
  };
  const move = (dx, dy) => {
    const c = camera(innerWidth / innerHeight), width = (2 * c.distance * c.slopes[1]) / innerHeight;
    view.centre = add(add(view.centre, c.right, -dx * width), c.up, dy * width);
  };
  canvas.onpointerdown = (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
  };
  canvas.onpointermove = (event) => {
    const before = fingers.get(event.pointerId);
    if (!before) return;
    const after = [event.clientX, event.clientY], dx = after[0] - before[0], dy = after[1] - before[1];
    const other = [...fingers.entries()].find(([id]) => id !== event.pointerId);
    if (other) {
      const span = (p) => Math.hypot(p[0] - other[1][0], p[1] - other[1][1]);
      view.closer = Math.min(Math.max((view.closer * span(after)) / Math.max(span(before), 1), 0.1), 50);
      move(dx / 2, dy / 2);
    } else if (event.shiftKey || event.buttons === 2 || event.buttons === 4) move(dx, dy);
    else orbit(dx, dy);
    fingers.set(event.pointerId, after);
    dirty = true;
  };
  canvas.onpointerup = canvas.onpointercancel = (event) => fingers.delete(event.pointerId);
  canvas.oncontextmenu = (event) => event.preventDefault();
  canvas.ondblclick = () => { view = home(); dirty = true; };
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    view.closer = Math.min(Math.max(view.closer * Math.exp(-0.0015 * event.deltaY), 0.1), 50);
    dirty = true;
  }, { passive: false });

  // ---- time
  let before = null;
  const frame = (clock) => {
    if (playing && before !== null) {
      now += ((clock - before) / 1000) * speed;
      if (now > duration) now = duration > 0 ? now % duration : 0;
      dirty = true;
    }
    before = clock;
    if (dirty) { draw(); tell(); dirty = false; }
    requestAnimationFrame(frame);
  };
  legend();
  draw();
  tell();
  requestAnimationFrame(frame);
})();

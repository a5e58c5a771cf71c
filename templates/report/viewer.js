"use strict";
// Mode shapes in three dimensions on a plain canvas: quadrilaterals, the farthest painted first.
(() => {
  const TURN = 2 * Math.PI, PERIOD = 1600; // ms of a vibration
  const DISTANCE = 5; // of the eye, in radii
  const VIEWS = { perspective: [-0.6, 0.38], front: [0, 0], side: [-Math.PI / 2, 0], top: [0, Math.PI / 2] };
  const VIRIDIS = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];
  const SHADES = 24, LIGHTS = 8;
  const calm = matchMedia("(prefers-reduced-motion: reduce)");

  const COLOURS = Array.from({ length: SHADES * LIGHTS }, (_, i) => {
    const share = 4 * Math.floor(i / LIGHTS) / (SHADES - 1), k = Math.min(3, Math.floor(share));
    const light = 0.55 + 0.45 * (i % LIGHTS) / (LIGHTS - 1);
    const part = (j) => Math.round(light * (VIRIDIS[k][j] + (share - k) * (VIRIDIS[k + 1][j] - VIRIDIS[k][j])));
    return `rgb(${part(0)},${part(1)},${part(2)})`;
  });

  function numbers(text) {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    return Float32Array.from(new Int16Array(bytes.buffer), (value) => value / 32767);
  }

  // x, y (along the axle), z (up) of components r, theta, z at an angle. Theta = 0 stands at the
  // top; of the loaded tyre, where the patch is there, at the bottom.
  function cartesian(out, at, r, t, z, angle, up) {
    const c = up * Math.cos(angle), s = up * Math.sin(angle);
    out[at] = r * s + t * c;
    out[at + 1] = z;
    out[at + 2] = r * c - t * s;
  }

  // Points at rest and their largest displacement, x y z after x y z, angle after angle; the second
  // of a pair is the first, a quarter of a wave farther round.
  function surface(data, mode, second = false) {
    const K = data.points, A = data.angles, place = numbers(data.place), shape = numbers(mode.shape);
    const rest = new Float32Array(3 * K * A), motion = new Float32Array(3 * K * A);
    const angles = data.kind === "loaded" ? numbers(data.angle) : null;
    for (let j = 0; j < A; j++) {
      const angle = TURN * (angles ? angles[j] : j / A);
      const wave = mode.n * angle + (second ? Math.PI / 2 : 0), c = Math.cos(wave), s = Math.sin(wave);
      for (let k = 0; k < K; k++) {
        const at = 3 * (j * K + k);
        if (angles) {
          cartesian(rest, at, place[at], place[at + 1], place[at + 2], angle, -1);
          cartesian(motion, at, shape[at], shape[at + 1], shape[at + 2], angle, -1);
        } else { // u = Re[(a + i b) exp(i n Theta)]
          const u = [0, 1, 2].map((i) => shape[3 * k + i] * c - shape[3 * (K + k) + i] * s);
          cartesian(rest, at, place[k], 0, place[K + k], angle, 1);
          cartesian(motion, at, u[0], u[1], u[2], angle, 1);
        }
      }
    }
    const size = new Float32Array(K * A);
    for (let i = 0; i < size.length; i++) size[i] = Math.hypot(motion[3 * i], motion[3 * i + 1], motion[3 * i + 2]);
    const most = size.reduce((a, b) => Math.max(a, b), 1e-9);
    return { K, A, rest, motion: motion.map((v) => v / most), share: size.map((v) => v / most) };
  }

  // Corners of the quadrilaterals; every second line of points with step 2.
  function quads(shown, step) {
    const found = [], { K, A } = shown;
    for (let j = 0; j < A; j += step) {
      const next = Math.min(j + step, A) % A;
      for (let k = 0; k < K - 1; k += step) {
        const far = Math.min(k + step, K - 1);
        found.push(j * K + k, j * K + far, next * K + far, next * K + k);
      }
    }
    return new Uint32Array(found);
  }

  function paint(canvas, shown, corners, turn, tilt, motion, zoom = 1) {
    const context = canvas.getContext("2d"), { width, height } = canvas;
    const count = shown.rest.length / 3, n = corners.length / 4;
    const x = new Float32Array(count), y = new Float32Array(count), d = new Float32Array(count);
    const ct = Math.cos(turn), st = Math.sin(turn), cu = Math.cos(tilt), su = Math.sin(tilt);
    const scale = 0.4 * zoom * Math.min(width, height);
    for (let i = 0; i < count; i++) {
      const px = shown.rest[3 * i] + motion * shown.motion[3 * i];
      const py = shown.rest[3 * i + 1] + motion * shown.motion[3 * i + 1];
      const pz = shown.rest[3 * i + 2] + motion * shown.motion[3 * i + 2];
      const across = px * ct + py * st, away = py * ct - px * st;
      const up = pz * cu + away * su;
      d[i] = away * cu - pz * su;
      const near = scale * DISTANCE / (DISTANCE + d[i]);
      x[i] = width / 2 + near * across;
      y[i] = height / 2 - near * up;
    }
    const depth = new Float32Array(n), order = new Uint32Array(n);
    for (let q = 0; q < n; q++) {
      order[q] = q;
      for (let i = 4 * q; i < 4 * q + 4; i++) depth[q] += d[corners[i]];
    }
    order.sort((a, b) => depth[b] - depth[a]);
    context.clearRect(0, 0, width, height);
    context.lineWidth = Math.max(0.7, width / 900);
    context.lineJoin = "round";
    for (const q of order) {
      const [a, b, c, e] = corners.subarray(4 * q, 4 * q + 4);
      // how far the quadrilateral faces the eye, from its diagonals
      const ux = x[c] - x[a], uy = y[c] - y[a], ud = scale * (d[c] - d[a]);
      const vx = x[e] - x[b], vy = y[e] - y[b], vd = scale * (d[e] - d[b]);
      const nx = uy * vd - ud * vy, ny = ud * vx - ux * vd, nd = ux * vy - uy * vx;
      const light = Math.abs(nd) / (Math.hypot(nx, ny, nd) || 1);
      const share = (shown.share[a] + shown.share[b] + shown.share[c] + shown.share[e]) / 4;
      const colour = (l) => COLOURS[Math.min(SHADES - 1, Math.floor(share * SHADES)) * LIGHTS + l];
      const l = Math.min(LIGHTS - 1, Math.floor(light * LIGHTS));
      context.beginPath();
      context.moveTo(x[a], y[a]);
      context.lineTo(x[b], y[b]);
      context.lineTo(x[c], y[c]);
      context.lineTo(x[e], y[e]);
      context.closePath();
      context.fillStyle = colour(l);
      context.strokeStyle = colour(Math.max(0, l - 3));
      context.fill();
      context.stroke();
    }
  }

  function sharp(canvas, least = 1) { // as many pixels as the screen has, more for paper
    const ratio = Math.max(least, Math.min(2, window.devicePixelRatio || 1));
    const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
    if (width && (canvas.width !== width || canvas.height !== height)) Object.assign(canvas, { width, height });
    return width > 0;
  }

  function viewer(figure) {
    const data = JSON.parse(document.getElementById(figure.dataset.shapes).textContent);
    const find = (what) => figure.querySelector(what);
    const canvas = find(".stage canvas"), play = find(".play"), title = find(".shown");
    const range = find(".most"), zoom = find(".zoom"), second = find(".second");
    let [turn, tilt] = VIEWS.perspective, phase = 0.25, before = 0, slow = 0, step = 1, chosen = 0;
    let playing = !calm.matches, seen = false, shown, corners;

    const draw = () => {
      if (sharp(canvas)) paint(canvas, shown, corners, turn, tilt, range.value / 100 * Math.sin(TURN * phase), zoom.value / 100);
    };
    const frame = (now) => {
      if (!playing || !seen) { before = 0; return; }
      if (before) phase = (phase + Math.min(100, now - before) / PERIOD) % 1;
      before = now;
      const start = performance.now();
      draw();
      slow = performance.now() - start > 45 ? slow + 1 : 0;
      if (slow > 8 && step === 1) corners = quads(shown, step = 2); // a slow machine: fewer, larger ones
      requestAnimationFrame(frame);
    };
    const state = (now) => {
      playing = now;
      if (!playing) phase = 0.25; // at rest in its largest motion, where the shape is seen
      play.textContent = playing ? "Pause" : "Play";
      figure.dataset.playing = String(playing);
      draw();
      if (playing) requestAnimationFrame(frame);
    };
    const look = (name) => {
      [turn, tilt] = VIEWS[name];
      for (const button of figure.querySelectorAll("[data-view]")) {
        button.setAttribute("aria-pressed", String(button.dataset.view === name));
      }
      draw();
    };
    const rotate = (across, up) => {
      turn += across;
      tilt = Math.max(-Math.PI / 2, Math.min(Math.PI / 2, tilt + up));
      for (const button of figure.querySelectorAll("[data-view]")) button.setAttribute("aria-pressed", "false");
      draw();
    };

    const buttons = data.modes.map((mode, number) => {
      const button = document.createElement("button"), small = document.createElement("canvas");
      const name = document.createElement("strong");
      button.type = "button";
      name.textContent = `${mode.name} ${mode.hertz}`;
      button.append(small, name, mode.words);
      button.addEventListener("click", () => choose(number));
      find(".gallery").append(button);
      return button;
    });
    const thumbnails = () => buttons.forEach((button, number) => {
      const small = button.querySelector("canvas"), still = surface(data, data.modes[number]);
      if (sharp(small, 2)) paint(small, still, quads(still, 2), ...VIEWS.perspective, 0.14);
    });
    const choose = (number) => {
      const mode = data.modes[number];
      const isSecond = second.getAttribute("aria-pressed") === "true";
      chosen = number;
      second.hidden = !mode.n;
      shown = surface(data, mode, isSecond);
      corners = quads(shown, step);
      title.textContent = `${mode.name} ${mode.hertz}, ${mode.words}${mode.n && isSecond ? ", second of the pair" : ""}`;
      buttons.forEach((button, k) => button.setAttribute("aria-pressed", String(k === number)));
      draw();
    };

    play.addEventListener("click", () => state(!playing));
    range.addEventListener("input", draw);
    zoom.addEventListener("input", draw);
    const nearer = (by) => { zoom.value = zoom.value * by; draw(); };
    second.addEventListener("click", () => {
      second.setAttribute("aria-pressed", String(second.getAttribute("aria-pressed") !== "true"));
      choose(chosen);
    });
    for (const button of figure.querySelectorAll("[data-view]")) {
      button.addEventListener("click", () => look(button.dataset.view));
    }
    let held = null;
    canvas.addEventListener("pointerdown", (event) => {
      held = [event.clientX, event.clientY];
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!held) return;
      rotate((held[0] - event.clientX) / 120, (event.clientY - held[1]) / 120);
      held = [event.clientX, event.clientY];
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => { held = null; });
    canvas.addEventListener("keydown", (event) => {
      const by = { ArrowLeft: [0.12, 0], ArrowRight: [-0.12, 0], ArrowUp: [0, -0.12], ArrowDown: [0, 0.12] }[event.key];
      if (by) rotate(...by);
      else if (event.key === "+" || event.key === "-") nearer(event.key === "+" ? 1.2 : 1 / 1.2);
      else if (event.key === " ") state(!playing);
      else return;
      event.preventDefault();
    });
    calm.addEventListener("change", () => state(!calm.matches));
    new ResizeObserver(draw).observe(canvas);
    new IntersectionObserver(([entry]) => {
      seen = entry.isIntersecting;
      if (seen && playing) requestAnimationFrame(frame);
    }).observe(canvas);
    choose(Math.max(0, data.modes.findIndex((mode) => mode.n === 2)));
    look("perspective");
    state(playing);
    thumbnails();
    new ResizeObserver(thumbnails).observe(find(".gallery"));
  }

  document.querySelectorAll(".viewer").forEach(viewer);
  const cut = new ResizeObserver((seen) => seen.forEach(({ target }) => {
    target.classList.toggle("cut", target.scrollWidth > target.clientWidth + 1);
  }));
  document.querySelectorAll(".wide").forEach((each) => cut.observe(each));
  addEventListener("beforeprint", () => document.querySelectorAll("details").forEach((each) => { each.open = true; }));
})();

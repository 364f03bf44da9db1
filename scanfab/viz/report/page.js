"use strict";
// Balls on a 2D canvas: far ones first, each a shaded disk drawn once for each colour. Cut open, the
// plane through the middle that faces the eye cuts them, and scan lines lie in it.
(function () {
  const DISK = 96;
  const START = { turn: 0.5, tilt: 0.35, zoom: 1.3 };
  const FINEST = 6, COARSEST = 0.4;
  const LINE_ANGLE = Math.PI / 6;
  const KEPT = "#000000", DROPPED = "#D55E00", RV = "#0072B2", TEXT = "#222222";

  function shaded(colour) {
    const disk = document.createElement("canvas");
    disk.width = disk.height = DISK;
    const pen = disk.getContext("2d");
    const half = DISK / 2;
    pen.beginPath();
    pen.arc(half, half, half - 1, 0, 2 * Math.PI);
    pen.fillStyle = colour;
    pen.fill();
    const light = pen.createRadialGradient(0.7 * half, 0.6 * half, 0.1 * half, half, half, half);
    light.addColorStop(0, "rgba(255,255,255,0.55)");
    light.addColorStop(0.45, "rgba(255,255,255,0)");
    light.addColorStop(1, "rgba(0,0,0,0.5)");
    pen.fillStyle = light;
    pen.fill();
    return disk;
  }

  // of "#rrggbb", as much darker as a shade says: it tells clumps that touch one another apart
  function tinted(colour, shade) {
    const parts = [1, 3, 5].map((at) => Math.round(shade * parseInt(colour.slice(at, at + 2), 16)));
    return "#" + parts.map((part) => part.toString(16).padStart(2, "0")).join("");
  }

  // 1, 2 or 5 times a power of ten, not above the value
  function rounded(value) {
    const power = Math.pow(10, Math.floor(Math.log10(value)));
    return [5, 2, 1].map((step) => step * power).find((step) => step <= value * (1 + 1e-9));
  }

  const dot = (one, other) => one[0] * other[0] + one[1] * other[1] + one[2] * other[2];
  const sum = (a, one, b, other) => one.map((part, i) => a * part + b * other[i]);

  // where the line through a place along a unit vector enters and leaves a window
  function span(window, place, along) {
    const [xx, yy, zz, xy, xz, yz] = window.form;
    const rows = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    const image = rows.map((row) => dot(row, along));
    const a = dot(along, image), b = dot(place, image);
    const c = dot(place, rows.map((row) => dot(row, place))) - window.level;
    if (a < 1e-9 && c > 0) return [0, 0];
    const root = Math.sqrt(b * b - a * c);
    let enters = a < 1e-9 ? -Infinity : (-b - root) / a, leaves = a < 1e-9 ? Infinity : (-b + root) / a;
    for (const [x, y, z, distance] of window.planes) {
      const steep = dot([x, y, z], along), rest = distance - dot([x, y, z], place);
      if (Math.abs(steep) < 1e-9 && rest < 0) return [0, 0];
      if (steep >= 1e-9) leaves = Math.min(leaves, rest / steep);
      if (steep <= -1e-9) enters = Math.max(enters, rest / steep);
    }
    return [enters, leaves];
  }

  // void pieces of parallel lines among disks [u, v, radius]: [u, v, u, v, whether it is kept];
  // right and up are unit vectors of the plane that they lie in
  function cutLines(disks, data, right, up) {
    const mean = data.spheres.reduce((sum, ball) => sum + ball[3], 0) / data.spheres.length;
    const reach = data.rv, step = Math.max(2.5 * mean, reach / 40);
    const cos = Math.cos(LINE_ANGLE), sin = Math.sin(LINE_ANGLE);
    const found = [];
    for (let offset = -reach + step / 2; offset < reach; offset += step) {
      const chords = [];
      for (const [u, v, radius] of disks) {
        const half = Math.sqrt(radius * radius - Math.pow(cos * v - sin * u - offset, 2));
        const middle = cos * u + sin * v;
        if (half > 0) chords.push([middle - half, middle + half]);
      }
      const through = sum(-sin * offset, right, cos * offset, up);
      const [enters, leaves] = span(data.window, through, sum(cos, right, sin, up));
      if (!(enters < leaves)) continue;
      chords.push([-Infinity, enters], [leaves, Infinity]);
      chords.sort((one, other) => one[0] - other[0]);
      let solid = chords.length ? chords[0][1] : 0;
      for (const [from, to] of chords) {
        if (from > solid) {
          const at = (t) => [cos * t - sin * offset, sin * t + cos * offset];
          found.push([...at(solid), ...at(from), from - solid >= data.cutoff]);
        }
        solid = Math.max(solid, to);
      }
    }
    return found;
  }

  function start(canvas, data, key) {
    const pen = canvas.getContext("2d");
    const ofKinds = (make) => data.kinds.map((kind) => data.shades.map((shade) => make(kind, shade)));
    const looks = ofKinds((kind, shade) => shaded(tinted(kind.colour, shade)));
    const pales = ofKinds((kind, shade) => tinted(kind.pale, shade));
    const shown = data.kinds.map(() => true);
    const start = { ...START, ...data.start };
    const state = { ...start, cut: true };
    let waiting = false;
    // canvas pixels a CSS pixel, and canvas pixels a unit of the data
    let dense = 1, scale = 1, place = null, right = null, up = null;

    function look() {
      const ct = Math.cos(state.turn), st = Math.sin(state.turn);
      const ci = Math.cos(state.tilt), si = Math.sin(state.tilt);
      scale = state.zoom * 0.36 * canvas.height / 1000;
      // to the right, up, and towards the eye
      place = (x, y, z) => {
        const away = -st * x + ct * y;
        return [ct * x + st * y, ci * z + si * away, si * z - ci * away];
      };
      right = [ct, st, 0];
      up = [-si * st, si * ct, ci];
    }

    function draw() {
      waiting = false;
      look();
      const balls = [], disks = [], solid = [];
      for (const [x, y, z, r, kind, shade = 0] of data.spheres) {
        const [u, v, depth] = place(x, y, z);
        const met = Math.abs(depth) < r ? Math.sqrt(r * r - depth * depth) : 0;
        if (met > 0) solid.push([u, v, met]);
        if (!shown[kind]) continue;
        if (!state.cut || depth < 0) balls.push([u, v, r, looks[kind][shade], depth]);
        if (met > 0) disks.push([u, v, met, pales[kind][shade]]);
      }
      balls.sort((one, other) => one[4] - other[4]);
      pen.setTransform(1, 0, 0, 1, 0, 0);
      pen.fillStyle = "#ffffff";
      pen.fillRect(0, 0, canvas.width, canvas.height);
      pen.setTransform(scale, 0, 0, -scale, canvas.width / 2, canvas.height / 2);
      for (const [u, v, r, ball] of balls) {
        // upright, as the light comes from above
        pen.save();
        pen.translate(u, v);
        pen.scale(1, -1);
        pen.drawImage(ball, -r, -r, 2 * r, 2 * r);
        pen.restore();
      }
      if (state.cut) {
        disks.forEach(drawDisk);
        cutLines(solid, data, right, up).forEach(drawPiece);
      }
      drawWindow();
      pen.setTransform(dense, 0, 0, dense, 0, 0);
      drawAxes();
      drawScale();
    }

    function drawDisk([u, v, radius, colour]) {
      pen.beginPath();
      pen.arc(u, v, radius, 0, 2 * Math.PI);
      pen.fillStyle = colour;
      pen.fill();
      pen.strokeStyle = "rgba(0,0,0,0.35)";
      pen.lineWidth = dense / scale;
      pen.stroke();
    }

    function drawPiece([u, v, s, t, kept]) {
      pen.strokeStyle = kept ? KEPT : DROPPED;
      pen.lineWidth = 3 * dense / scale;
      pen.beginPath();
      pen.moveTo(u, v);
      pen.lineTo(s, t);
      pen.stroke();
    }

    function drawWindow() {
      pen.strokeStyle = RV;
      pen.lineWidth = 2 * dense / scale;
      pen.setLineDash([8, 5].map((part) => part * dense / scale));
      pen.beginPath();
      for (let step = 0; step < 360; step++) {
        const cos = Math.cos(step * Math.PI / 180), sin = Math.sin(step * Math.PI / 180);
        const end = span(data.window, [0, 0, 0], sum(cos, right, sin, up))[1];
        pen.lineTo(cos * end, sin * end);
      }
      pen.closePath();
      pen.stroke();
      pen.setLineDash([]);
    }

    // x, y, z and the loading axis, in the lower left corner, in CSS pixels
    function drawAxes() {
      const left = 50, low = canvas.height / dense - 50, length = 32;
      pen.font = "13px system-ui, sans-serif";
      pen.textAlign = "center";
      pen.textBaseline = "middle";
      for (const [name, x, y, z] of data.axes) {
        const [right, up] = place(x, y, z);
        pen.strokeStyle = TEXT;
        pen.lineWidth = 1.5;
        pen.beginPath();
        pen.moveTo(left, low);
        pen.lineTo(left + length * right, low - length * up);
        pen.stroke();
        write(name, left + 1.35 * length * right, low - 1.35 * length * up);
      }
    }

    // with a white edge, to be read upon grains
    function write(text, x, y) {
      pen.strokeStyle = "#ffffff";
      pen.lineWidth = 3;
      pen.strokeText(text, x, y);
      pen.fillStyle = TEXT;
      pen.fillText(text, x, y);
    }

    // a bar with its length in the dump's unit, in the lower right corner
    function drawScale() {
      const unit = scale / dense * 1000 / data.size;
      const length = rounded(110 / unit);
      const right = canvas.width / dense - 20, low = canvas.height / dense - 24;
      pen.strokeStyle = TEXT;
      pen.lineWidth = 3;
      pen.beginPath();
      pen.moveTo(right - length * unit, low);
      pen.lineTo(right, low);
      pen.stroke();
      write(String(Number(length.toPrecision(1))), right - length * unit / 2, low - 12);
    }

    function redraw() {
      if (!waiting) {
        waiting = true;
        requestAnimationFrame(draw);
      }
    }

    function rotate(dx, dy) {
      state.turn += dx;
      state.tilt = Math.max(-Math.PI / 2, Math.min(Math.PI / 2, state.tilt + dy));
      redraw();
    }

    function zoom(factor) {
      state.zoom = Math.max(COARSEST, Math.min(FINEST, state.zoom * factor));
      redraw();
    }

    function reset() {
      Object.assign(state, start);
      redraw();
    }

    function fit() {
      dense = window.devicePixelRatio || 1;
      const box = canvas.getBoundingClientRect();
      if (box.width === 0) return;
      canvas.width = Math.round(box.width * dense);
      canvas.height = Math.round(box.height * dense);
      draw();
    }

    listen(canvas, rotate, zoom, reset);
    controls(key, data, shown, state, redraw, reset);
    new ResizeObserver(fit).observe(canvas);
    fit();
  }

  function listen(canvas, rotate, zoom, reset) {
    let last = null;
    canvas.addEventListener("pointerdown", (event) => {
      if (event.pointerType === "touch") return;
      last = [event.clientX, event.clientY];
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (last === null) return;
      rotate(-0.01 * (event.clientX - last[0]), 0.01 * (event.clientY - last[1]));
      last = [event.clientX, event.clientY];
    });
    for (const name of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(name, () => { last = null; });
    }

    // two fingers turn and pinch; one scrolls the page
    let fingers = null;
    function pair(touches) {
      const [one, other] = touches;
      const dx = other.clientX - one.clientX, dy = other.clientY - one.clientY;
      return {
        x: (one.clientX + other.clientX) / 2,
        y: (one.clientY + other.clientY) / 2,
        apart: Math.max(Math.hypot(dx, dy), 1),
      };
    }
    canvas.addEventListener("touchstart", (event) => {
      fingers = event.touches.length === 2 ? pair(event.touches) : null;
      if (fingers) event.preventDefault();
    }, { passive: false });
    canvas.addEventListener("touchmove", (event) => {
      if (!fingers || event.touches.length !== 2) return;
      event.preventDefault();
      const now = pair(event.touches);
      rotate(-0.01 * (now.x - fingers.x), 0.01 * (now.y - fingers.y));
      zoom(now.apart / fingers.apart);
      fingers = now;
    }, { passive: false });
    canvas.addEventListener("touchend", () => { fingers = null; });

    // the wheel scrolls the page, until the view is clicked
    canvas.addEventListener("wheel", (event) => {
      if (document.activeElement !== canvas) return;
      event.preventDefault();
      zoom(Math.exp(-0.001 * event.deltaY));
    }, { passive: false });

    const keys = {
      ArrowLeft: () => rotate(0.1, 0),
      ArrowRight: () => rotate(-0.1, 0),
      ArrowUp: () => rotate(0, -0.1),
      ArrowDown: () => rotate(0, 0.1),
      "+": () => zoom(1.1),
      "=": () => zoom(1.1),
      "-": () => zoom(1 / 1.1),
      r: reset,
      Escape: () => canvas.blur(),
    };
    canvas.addEventListener("keydown", (event) => {
      if (event.key in keys && !event.ctrlKey && !event.metaKey && !event.altKey) {
        event.preventDefault();
        keys[event.key]();
      }
    });
  }

  function controls(key, data, shown, state, redraw, reset) {
    function box(text, colour, checked, change) {
      const label = document.createElement("label");
      const input = document.createElement("input");
      input.type = "checkbox";
      input.checked = checked;
      input.addEventListener("change", () => { change(input.checked); redraw(); });
      label.append(input);
      if (colour) {
        const dot = document.createElement("span");
        dot.style.background = colour;
        label.append(dot);
      }
      label.append(" " + text + " ");
      key.append(label);
    }
    data.kinds.forEach((kind, number) => {
      if (data.spheres.some((sphere) => sphere[4] === number)) {
        box(kind.name, kind.colour, true, (on) => { shown[number] = on; });
      }
    });
    box("cut open", null, state.cut, (on) => { state.cut = on; });
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = "reset";
    button.addEventListener("click", reset);
    key.append(button);
  }

  for (const canvas of document.querySelectorAll("canvas.view")) {
    const number = canvas.id.slice("view-".length);
    const data = JSON.parse(document.getElementById("data-" + number).textContent);
    start(canvas, data, document.getElementById("key-" + number));
  }
})();

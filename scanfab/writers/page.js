"use strict";
// Spheres on a 2D canvas: far ones first, each a shaded disk drawn once for each colour.
(function () {
  const DISK = 96;

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

  function start(canvas, data, key) {
    const pen = canvas.getContext("2d");
    const disks = data.kinds.map((kind) => shaded(kind.colour));
    const shown = data.kinds.map(() => true);
    const state = { turn: 0.5, tilt: 0.35, zoom: 1.3, cut: false };
    let waiting = false;

    function draw() {
      waiting = false;
      const ct = Math.cos(state.turn), st = Math.sin(state.turn);
      const ci = Math.cos(state.tilt), si = Math.sin(state.tilt);
      const scale = state.zoom * 0.36 * canvas.height / 1000;
      const cx = canvas.width / 2, cy = canvas.height / 2;
      // screen x, screen y, and depth, which grows towards the eye
      function place(x, y, z) {
        const side = ct * x + st * y, away = -st * x + ct * y;
        return [cx + scale * side, cy - scale * (ci * z + si * away), si * z - ci * away];
      }
      const items = [];
      for (const [x, y, z, r, kind] of data.spheres) {
        if (!shown[kind]) continue;
        const at = place(x, y, z);
        if (state.cut && at[2] > 0) continue;
        items.push([at[2], at, scale * r, kind]);
      }
      for (const piece of data.pieces) {
        const a = place(piece[0], piece[1], piece[2]), b = place(piece[3], piece[4], piece[5]);
        items.push([(a[2] + b[2]) / 2, a, b, piece[6] ? "#000000" : "#D55E00"]);
      }
      items.sort((one, other) => one[0] - other[0]);
      pen.fillStyle = "#ffffff";
      pen.fillRect(0, 0, canvas.width, canvas.height);
      for (const [, at, size, look] of items) {
        if (typeof look === "number") {
          pen.drawImage(disks[look], at[0] - size, at[1] - size, 2 * size, 2 * size);
        } else {
          pen.strokeStyle = look;
          pen.lineWidth = 5;
          pen.beginPath();
          pen.moveTo(at[0], at[1]);
          pen.lineTo(size[0], size[1]);
          pen.stroke();
        }
      }
      if (data.rv !== null) {
        pen.strokeStyle = "#0072B2";
        pen.lineWidth = 3;
        pen.setLineDash([12, 8]);
        pen.beginPath();
        pen.arc(cx, cy, scale * data.rv, 0, 2 * Math.PI);
        pen.stroke();
        pen.setLineDash([]);
      }
      drawAxes(place(0, 0, 0), place);
    }

    function drawAxes(origin, place) {
      pen.font = "26px system-ui, sans-serif";
      pen.textAlign = "center";
      pen.textBaseline = "middle";
      const length = 70, left = 100, low = canvas.height - 100;
      [["1", 1, 0, 0], ["2", 0, 1, 0], ["axis", 0, 0, 1]].forEach(([name, x, y, z]) => {
        const tip = place(x, y, z);
        const long = length / (state.zoom * 0.36 * canvas.height / 1000);
        const dx = (tip[0] - origin[0]) * long, dy = (tip[1] - origin[1]) * long;
        pen.strokeStyle = pen.fillStyle = "#333333";
        pen.lineWidth = 3;
        pen.beginPath();
        pen.moveTo(left, low);
        pen.lineTo(left + dx, low + dy);
        pen.stroke();
        pen.fillText(name, left + 1.35 * dx, low + 1.35 * dy);
      });
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

    let last = null;
    canvas.addEventListener("pointerdown", (event) => {
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
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      state.zoom = Math.max(0.4, Math.min(6, state.zoom * Math.exp(-0.001 * event.deltaY)));
      redraw();
    }, { passive: false });
    const steps = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] };
    canvas.addEventListener("keydown", (event) => {
      if (event.key in steps) {
        event.preventDefault();
        rotate(...steps[event.key]);
      }
    });

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
    box("cut open", null, false, (on) => { state.cut = on; });
    draw();
  }

  for (const canvas of document.querySelectorAll("canvas.view")) {
    const number = canvas.id.slice("view-".length);
    const data = JSON.parse(document.getElementById("data-" + number).textContent);
    start(canvas, data, document.getElementById("key-" + number));
  }
})();

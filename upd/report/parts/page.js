"use strict";
(async function () {
  // Plotly and the data of the page are packed; where they cannot be unpacked the static figures stay as they are.
  if (!window.DecompressionStream) return;

  async function textOf(id) {
    // Seven bits a letter.
    const text = document.getElementById(id).textContent, bytes = new Uint8Array((text.length * 7) >> 3);
    for (let k = 0, n = 0, held = 0, bits = 0; k < text.length; k++) {
      held = (held << 7) | (text.charCodeAt(k) & 127);
      bits += 7;
      if (bits >= 8) { bits -= 8; bytes[n++] = held >> bits; }
    }
    return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
  }

  const library = document.createElement("script");
  library.textContent = await textOf("plotly");
  document.body.append(library);
  if (!window.Plotly) return;
  const root = document.documentElement;
  const page = JSON.parse(await textOf("page-data"));
  const touch = window.matchMedia("(pointer: coarse)").matches;
  const font = { family: getComputedStyle(document.body).fontFamily, size: 12, color: "#1d2329" };
  // Buttons are named one by one: the default ones include sending the data away.
  const config = { responsive: true, displaylogo: false, plotlyServerURL: "", modeBarButtons: [["toImage", "zoom2d", "pan2d", "resetScale2d"]] };
  const config3d = Object.assign({}, config, { modeBarButtons: [["toImage", "orbitRotation", "pan3d", "resetCameraDefault3d"]] });
  root.classList.add("js");

  // ------------------------------------------------------------------ charts
  const drawn = [];

  // Under a map, or under coloured points.
  function hasBar(figure) {
    return figure.data.some((t) => t.colorbar || (t.marker && t.marker.colorbar));
  }

  // A legend takes at most this part of a chart's height, beyond it scrolls; room for two lines of it.
  const share = 0.2, twoLines = 44;

  function heightOf(figure, width) {
    const inner = Math.max(width - 90, 200) / figure.wide;
    const bar = hasBar(figure) ? 75 : 0, legend = figure.layout.showlegend ? twoLines : 0;
    return Math.round(Math.min(Math.max(inner, bar ? 110 : 230), 440) + 90 + bar + legend);
  }

  function layoutOf(figure, width) {
    // Below the drawing, where no bar of colours stands.
    const bar = hasBar(figure), at = bar ? { y: 1, yanchor: "top" } : { y: 0, yanchor: "bottom" };
    return Object.assign({
      height: heightOf(figure, width), font: font, paper_bgcolor: "#fff", plot_bgcolor: "#fff", dragmode: touch ? false : "zoom",
      margin: { l: 60, r: 16, t: 34, b: bar ? 125 : 52 },
      legend: Object.assign({ orientation: "h", x: 0, xanchor: "left", yref: "container", maxheight: share, tracegroupgap: 0, font: { size: 11 } }, at),
      hoverlabel: { font: { family: font.family, size: 12 } },
    }, JSON.parse(JSON.stringify(figure.layout)));
  }

  function dataOf(figure) {
    const placed = (bar) => Object.assign({}, bar, { yref: "container", y: 0.02, yanchor: "bottom", lenmode: "fraction", len: 0.9, outlinewidth: 0 });
    return figure.data.map(function (trace) {
      if (trace.colorbar) return Object.assign({}, trace, { colorbar: placed(trace.colorbar) });
      if (trace.marker && trace.marker.colorbar) return Object.assign({}, trace, { marker: Object.assign({}, trace.marker, { colorbar: placed(trace.marker.colorbar) }) });
      return trace;
    });
  }

  function drawChart(place, figure) {
    return Plotly.react(place, dataOf(figure), layoutOf(figure, place.clientWidth), config);
  }

  function element(tag, name, text) {
    const made = document.createElement(tag);
    if (name) made.className = name;
    if (text !== undefined) made.textContent = text;
    return made;
  }

  function addChart(live, group, heading) {
    const box = element("div", "chart"), head = element("div", "chart-head"), place = element("div", "plot"), note = element("p", "chart-note");
    if (group.title !== heading) head.append(element("span", "chart-title", group.title));
    box.append(head, place, note);
    live.append(box);
    const state = { place: place, figure: group.charts[0].figure };
    function show(k) {
      state.figure = group.charts[k].figure;
      note.textContent = group.charts[k].note;
      return drawChart(place, state.figure);
    }
    if (group.charts.length > 1) {
      const choice = element("select");
      choice.setAttribute("aria-label", group.title + ": case");
      group.charts.forEach((chart, k) => choice.append(new Option(chart.case, k)));
      choice.addEventListener("change", () => show(Number(choice.value)));
      head.append(choice);
    } else if (group.charts[0].case) {
      head.append(element("span", "none", group.charts[0].case));
    }
    drawn.push(state);
    return () => show(0);
  }

  // What is folded is drawn when it is opened, for then it has a width.
  function whenSeen(panel, draw) {
    const fold = panel.closest("details.fold");
    if (!fold || fold.open) return draw();
    fold.addEventListener("toggle", draw, { once: true });
    return Promise.resolve();
  }

  function addPanel(panel) {
    const groups = page.panels[panel.dataset.panel], live = panel.querySelector(".live");
    // The place must have its final width before anything is drawn in it.
    panel.classList.add("drawn");
    if (groups.length > 1) panel.classList.add("wide");
    panel.querySelector("details.static").open = false;
    const draws = groups.map((group) => addChart(live, group, panel.querySelector("h3").textContent));
    return Promise.all(draws.map((draw) => draw()));
  }

  function addPanels() {
    const panels = Array.from(document.querySelectorAll(".panel[data-panel]")).filter((panel) => page.panels[panel.dataset.panel]);
    return Promise.all(panels.map((panel) => whenSeen(panel, () => addPanel(panel))));
  }

  // ------------------------------------------------------------------ three dimensions
  const kinds = { f4: Float32Array, i2: Int16Array, u1: Uint8Array, u2: Uint16Array, u4: Uint32Array };

  function unpack(packed) {
    const text = atob(packed.bdata), bytes = new Uint8Array(text.length);
    for (let k = 0; k < text.length; k++) bytes[k] = text.charCodeAt(k);
    return new kinds[packed.dtype](bytes.buffer);
  }

  function part(values, k, n) { return values.subarray(k * n, (k + 1) * n); }

  function hasWebGL() {
    try {
      return Boolean(document.createElement("canvas").getContext("webgl"));
    } catch (fault) {
      return false;
    }
  }

  function unpacked(surface) {
    if (!surface.ready) {
      surface.bodies.forEach(function (b) { b.xyz = unpack(b.points); b.ijk = unpack(b.triangles); });
      surface.fields.forEach(function (f) { f.arrays = f.values.map((v) => v && unpack(v)); });
      surface.moved = surface.motions.map((motion) => motion.map(unpack));
      surface.ready = true;
    }
    return surface;
  }

  // Where the pressure is, with as much again around it; null when there is none.
  function nearBox(surface, field) {
    if (!field || field.quantity !== "pressure") return null;
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    surface.bodies.forEach(function (b, k) {
      const values = field.arrays[k];
      if (!values) return;
      for (let p = 0; p < b.n; p++) {
        if (!(values[p] > 0)) continue;
        for (let c = 0; c < 3; c++) { low[c] = Math.min(low[c], b.xyz[c * b.n + p]); high[c] = Math.max(high[c], b.xyz[c * b.n + p]); }
      }
    });
    if (low[0] > high[0]) return null;
    const around = 0.75 * Math.max(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
    return { low: low.map((v) => v - around), high: high.map((v) => v + around), size: 2 * around };
  }

  function trianglesIn(body, box) {
    const m = body.ijk.length / 3, n = body.n, kept = [];
    const inside = (p) => [0, 1, 2].every((c) => body.xyz[c * n + p] >= box.low[c] && body.xyz[c * n + p] <= box.high[c]);
    for (let t = 0; t < m; t++) if (inside(body.ijk[t]) && inside(body.ijk[m + t]) && inside(body.ijk[2 * m + t])) kept.push(t);
    return [0, 1, 2].map((c) => Uint32Array.from(kept, (t) => body.ijk[c * m + t]));
  }

  // Points no face uses would still count for the size of the drawing.
  function compacted(trace) {
    const number = new Map();
    ["i", "j", "k"].forEach((key) => trace[key].forEach(function (p) { if (!number.has(p)) number.set(p, number.size); }));
    const used = Uint32Array.from(number.keys());
    ["x", "y", "z", "intensity"].forEach(function (key) { if (trace[key]) trace[key] = Float32Array.from(used, (p) => trace[key][p]); });
    ["i", "j", "k"].forEach(function (key) { trace[key] = trace[key].map((p) => number.get(p)); });
    return trace;
  }

  // Faces without pressure stay grey.
  const pale = [[0, "#dde1e5"], [0.004, "#440154"], [0.13, "#482878"], [0.25, "#3e4989"], [0.38, "#31688e"], [0.5, "#26828e"],
    [0.63, "#1f9e89"], [0.75, "#35b779"], [0.88, "#6ece58"], [0.95, "#b5de2b"], [1, "#fde725"]];

  function bodyTrace(surface, field, k, factor, apart, last, box) {
    const body = surface.bodies[k], n = body.n, m = body.ijk.length / 3;
    const triangles = box ? trianglesIn(body, box) : [0, 1, 2].map((c) => part(body.ijk, c, m));
    const closer = box ? Math.min(1, box.size / surface.span) : 1;
    const u = field && field.motion !== null ? surface.moved[field.motion][k] : null;
    const reach = closer * factor * surface.reach / surface.levels;
    const axis = function (c) {
      const out = new Float32Array(part(body.xyz, c, n));
      const shift = apart ? closer * surface.apart[k][c] : 0;
      for (let p = 0; p < n; p++) out[p] += shift + (u ? reach * u[c * n + p] : 0);
      return out;
    };
    const trace = {
      type: "mesh3d", name: body.name, x: axis(0), y: axis(1), z: axis(2),
      i: triangles[0], j: triangles[1], k: triangles[2],
      flatshading: true, lighting: { ambient: 0.65, diffuse: 0.5, specular: 0.05, roughness: 0.9 }, color: "#d4d8dc", hoverinfo: "name",
    };
    const values = field && field.arrays[k];
    if (!values) return trace;
    const unit = field.unit || "of the largest";
    return Object.assign(trace, {
      intensity: values, colorscale: field.quantity === "pressure" ? pale : "Viridis", cmin: 0, cmax: field.top || 1, showscale: last,
      colorbar: { orientation: "h", thickness: 12, len: 0.8, y: -0.02, yanchor: "top", title: { text: field.quantity + ", " + unit, side: "bottom" } },
      hoverinfo: "all", hovertemplate: field.quantity + ": %{intensity:.4g} " + unit + "<br>x, y, z: %{x:.4g}, %{y:.4g}, %{z:.4g} mm<extra>%{fullData.name}</extra>",
    });
  }

  function addView() {
    const panel = document.getElementById("view3d");
    if (!panel || !hasWebGL()) return Promise.resolve();
    const choice = document.getElementById("view-field"), range = document.getElementById("view-scale"), apart = document.getElementById("view-apart"), near = document.getElementById("view-near");
    const place = document.getElementById("view-plot"), told = document.getElementById("view-factor");
    const still = page.surfaces.every((s) => s.motions.length === 0), whole = page.surfaces.every((s) => s.apart.every((o) => o[2] === 0));
    range.parentElement.hidden = still;
    apart.parentElement.hidden = whole;
    let camera = { eye: { x: -1.0, y: -1.9, z: 1.0 }, projection: { type: "orthographic" } };
    function show() {
      const option = choice.selectedOptions[0];
      const surface = unpacked(page.surfaces[Number(option.dataset.surface)]);
      const field = surface.fields[Number(choice.value)] || null;
      const factor = range.value / 50;
      const box = near.checked ? nearBox(surface, field) : null;
      near.parentElement.hidden = !nearBox(surface, field);
      const shown = surface.bodies.map((b, k) => k).filter((k) => field && field.arrays[k]);
      const traces = surface.bodies.map((b, k) => bodyTrace(surface, field, k, factor, apart.checked, k === shown[0], box)).map((trace) => (box ? compacted(trace) : trace));
      const closer = box ? Math.min(1, box.size / surface.span) : 1;
      told.textContent = field && field.motion !== null ? (field.largest_mm > 0 ? "× " + Number((closer * factor * surface.reach / field.largest_mm).toPrecision(2)).toLocaleString("en") : "") : "";
      const axis = { visible: false };
      const now = place._fullLayout && place._fullLayout.scene && place._fullLayout.scene._scene;
      if (now) camera = now.getCamera();
      const layout = {
        height: Math.min(560, Math.max(340, 0.75 * place.clientWidth)), margin: { l: 0, r: 0, t: 0, b: 60 }, font: font, paper_bgcolor: "#fff",
        scene: { aspectmode: "data", xaxis: axis, yaxis: axis, zaxis: axis, camera: camera, dragmode: "orbit" },
        hoverlabel: { font: { family: font.family, size: 12 } },
      };
      return Plotly.react(place, traces, layout, config3d);
    }
    [choice, range, apart, near].forEach((control) => control.addEventListener("input", show));
    return whenSeen(panel, () => show().then(() => panel.classList.add("drawn")));
  }

  // ------------------------------------------------------------------ the rest of the page
  function addCopy(button) {
    const text = button.parentElement.nextElementSibling;
    button.addEventListener("click", function () {
      const done = () => { button.textContent = "Copied"; };
      const byHand = () => { getSelection().selectAllChildren(text); };
      if (navigator.clipboard) navigator.clipboard.writeText(text.textContent).then(done, byHand); else byHand();
    });
  }

  // On paper everything is open and still.
  const closed = [];
  window.addEventListener("beforeprint", function () {
    document.querySelectorAll("details:not([open])").forEach((d) => { closed.push(d); d.open = true; });
  });
  window.addEventListener("afterprint", function () { closed.splice(0).forEach((d) => { d.open = false; }); });

  let waiting = 0;
  window.addEventListener("resize", function () {
    clearTimeout(waiting);
    waiting = setTimeout(() => drawn.filter((state) => state.place.clientWidth).forEach((state) => drawChart(state.place, state.figure)), 150);
  });

  document.querySelectorAll("button.copy").forEach(addCopy);
  addPanels().then(addView).then(() => root.classList.add("ready"));
})();

"use strict";
// Draws the report's data: every chart over one time, which is zoomed and pointed at once for all of them and the map.
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const view = { from: 0, to: data.duration_s, at: null };
  const charts = [];
  const LEFT = 46, RIGHT = 8, TOP = 6, BOTTOM = 20;

  const svg = (name, attributes = {}, text = null) => {
    const made = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    if (text !== null) made.textContent = text;
    return made;
  };
  const html = (name, attributes = {}, text = "") => {
    const made = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    made.textContent = text;
    return made;
  };
  const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
  const summed = (steps, unit) => {
    let last = 0;
    return steps.map((step) => (step === null ? NaN : (last += step) * unit));
  };
  const clock = (s, fine = false) => {
    const parts = [Math.floor(s / 3600), Math.floor(s / 60) % 60, Math.floor(s) % 60].map((part) => String(part).padStart(2, "0"));
    return parts.join(":").replace(/^00:/, "") + (fine ? "." + (Math.floor(s * 10) % 10) : "");
  };
  /** A round step (1, 2 or 5 times a power of ten) that divides a range in about so many parts. */
  const roundStep = (range, parts) => {
    const raw = Math.max(range, 1e-9) / parts, power = 10 ** Math.floor(Math.log10(raw));
    return power * ([1, 2, 5].find((n) => n * power >= raw) || 10);
  };
  const timeStep = (range, parts) =>
    [0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400, 43200, 86400].find((s) => s >= range / parts) || roundStep(range, parts);
  /** Index of the last time that is not after t; -1 before all. */
  const before = (times, t) => {
    let low = 0, high = times.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (times[middle] <= t) low = middle + 1; else high = middle;
    }
    return low - 1;
  };

  // --- charts over time

  const decode = (curve) => ({ ...curve, t: summed(curve.t, 0.01), v: summed(curve.v, curve.step) });

  /** The part of a curve that is seen, one lowest and one highest point for each column of pixels. */
  const path = (curve, x, y, columns) => {
    const first = Math.max(before(curve.t, view.from), 0);
    const last = Math.min(before(curve.t, view.to) + 1, curve.t.length - 1);
    const every = Math.max(1, Math.floor((last - first) / (2 * columns)) * 2);
    const out = [];
    let pen = "M", lastY = null;
    const put = (index) => {
      const px = x(curve.t[index]).toFixed(1), py = y(curve.v[index]).toFixed(1);
      if (curve.style === "step" && pen === "L") out.push("L" + px + " " + lastY);
      out.push(pen + px + " " + py);
      pen = "L";
      lastY = py;
    };
    let low = -1, high = -1;
    const flush = () => {
      if (low >= 0) put(Math.min(low, high));
      if (low !== high) put(Math.max(low, high));
      low = high = -1;
    };
    for (let index = first; index <= last; index++) {
      const value = curve.v[index];
      if (Number.isNaN(value)) {
        flush();
        pen = "M";
        continue;
      }
      if (low < 0 || value < curve.v[low]) low = index;
      if (high < 0 || value > curve.v[high]) high = index;
      if ((index - first) % every === every - 1) flush();
    }
    flush();
    return out.join("");
  };

  const ends = (panel) => {
    let low = panel.low === null ? Infinity : panel.low, high = panel.high === null ? -Infinity : panel.high;
    for (const curve of panel.curves) {
      const last = Math.min(before(curve.t, view.to) + 1, curve.t.length - 1);
      for (let index = Math.max(before(curve.t, view.from), 0); index <= last; index++) {
        if (panel.low === null && curve.v[index] < low) low = curve.v[index];
        if (panel.high === null && curve.v[index] > high) high = curve.v[index];
      }
    }
    if (!Number.isFinite(low)) low = Math.min(0, high);
    if (!Number.isFinite(high)) high = low + 1;
    const room = Math.max((high - low) * 0.06, 1e-6);
    return [panel.low === null ? low - room : low, panel.high === null ? Math.max(high + room, low + 1e-3) : high];
  };

  const STYLES = { line: { "stroke-width": 1.4 }, step: { "stroke-width": 1.4 }, wide: { "stroke-width": 3.2, "stroke-opacity": 0.55 }, dash: { "stroke-width": 1.4, "stroke-dasharray": "6 4" } };

  const axes = (box, x, width, height, last) => {
    const step = timeStep(view.to - view.from, clamp(width / 90, 3, 10));
    for (let t = Math.ceil(view.from / step) * step; t <= view.to + 1e-6; t += step) {
      box.append(svg("line", { x1: x(t), x2: x(t), y1: TOP, y2: height - BOTTOM, class: "grid" }));
      if (last && x(t) < width - 20) box.append(svg("text", { x: x(t), y: height - 5, "text-anchor": "middle" }, clock(t, step < 1)));
    }
  };

  const frame = (host, height, label) => {
    const width = Math.max(host.clientWidth, 200);
    const box = svg("svg", { width, height, viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": label });
    const x = (t) => LEFT + ((t - view.from) / (view.to - view.from)) * (width - LEFT - RIGHT);
    return { box, x, width, time: (px) => clamp(view.from + ((px - LEFT) / (width - LEFT - RIGHT)) * (view.to - view.from), 0, data.duration_s) };
  };

  const drawPanel = (host, chart, panel, last) => {
    const height = last ? 160 : 144;
    const { box, x, width, time } = frame(host, height, `${chart.title}: ${panel.label}`);
    const [low, high] = ends(panel);
    const y = (v) => TOP + ((high - clamp(v, low - (high - low), high + (high - low))) / (high - low)) * (height - TOP - BOTTOM);
    const clip = `clip${charts.indexOf(chart)}-${chart.panels.indexOf(panel)}`;
    box.append(svg("clipPath", { id: clip }));
    box.firstChild.append(svg("rect", { x: LEFT, y: TOP - 2, width: width - LEFT - RIGHT, height: height - TOP - BOTTOM + 4 }));
    for (const [start, end, , colour] of panel.bands)
      if (end >= view.from && start <= view.to)
        box.append(svg("rect", { x: x(start), y: TOP, width: Math.max(x(Math.max(end, start + 1)) - x(start), 1), height: height - TOP - BOTTOM, fill: colour, "fill-opacity": 0.35, "clip-path": `url(#${clip})` }));
    axes(box, x, width, height, last);
    const step = roundStep(high - low, 4), digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    for (let v = Math.ceil(low / step) * step; v <= high + 1e-9; v += step) {
      box.append(svg("line", { x1: LEFT, x2: width - RIGHT, y1: y(v), y2: y(v), class: "grid" }));
      box.append(svg("text", { x: LEFT - 5, y: clamp(y(v) + 4, 12, height - BOTTOM + 4), "text-anchor": "end" }, v.toFixed(digits).replace("-0", v === 0 ? "0" : "-0")));
    }
    for (const curve of [...panel.curves].sort((a, b) => (b.style === "wide") - (a.style === "wide")))
      box.append(svg("path", { d: path(curve, x, y, width), fill: "none", stroke: curve.colour, "clip-path": `url(#${clip})`, ...STYLES[curve.style] }));
    return finish(box, height, x, time);
  };

  const drawRows = (host, chart) => {
    const ROW = 26, height = TOP + ROW * chart.rows.length + BOTTOM;
    const { box, x, width, time } = frame(host, height, chart.title);
    axes(box, x, width, height, true);
    chart.rows.forEach((row, number) => {
      const y = TOP + ROW * number;
      for (const [start, end, value, colour] of row.spans) {
        if (end < view.from || start > view.to) continue;
        const a = Math.max(x(start), LEFT), b = Math.min(x(end), width - RIGHT);
        box.append(svg("rect", { x: a, y: y + 2, width: Math.max(b - a, 1.5), height: ROW - 4, fill: colour }));
        if (b - a > 7.5 * value.length + 8) box.append(svg("text", { x: (a + b) / 2, y: y + 17, "text-anchor": "middle", class: "state" }, value));
      }
      box.append(svg("text", { x: LEFT - 5, y: y + 17, "text-anchor": "end" }, row.label.split(" ")[0]));
    });
    return finish(box, height, x, time);
  };

  /** The cursor, and what pointers do: point, drag to zoom, two fingers to zoom. */
  const finish = (box, height, x, time) => {
    const cursor = svg("line", { y1: TOP, y2: height - BOTTOM, class: "cursor", visibility: "hidden" });
    const chosen = svg("rect", { y: TOP, height: height - TOP - BOTTOM, class: "chosen", visibility: "hidden" });
    box.append(chosen, cursor);
    const down = new Map();
    let pinched = null;
    const of = (event) => event.clientX - box.getBoundingClientRect().left;
    box.addEventListener("pointerdown", (event) => {
      down.set(event.pointerId, { start: of(event), now: of(event), t: time(of(event)) });
      box.setPointerCapture(event.pointerId);
      pinched = down.size === 2 ? [...down.values()].map((one) => one.t) : null;
    });
    box.addEventListener("pointermove", (event) => {
      const one = down.get(event.pointerId);
      if (one) one.now = of(event);
      if (pinched) return;
      point(time(of(event)));
      if (one && event.pointerType === "mouse") {
        const [a, b] = [one.start, one.now].sort((p, q) => p - q);
        for (const [key, value] of Object.entries({ x: a, width: b - a, visibility: "visible" })) chosen.setAttribute(key, value);
      }
    });
    const up = (event) => {
      const one = down.get(event.pointerId);
      if (pinched && down.size === 2) {
        const [a, b] = [...down.values()], [ta, tb] = pinched;
        const rate = (tb - ta) / (b.now - a.now || 1), from = ta - (a.now - LEFT) * rate;
        if (rate > 0) zoom(from, from + (box.clientWidth - LEFT - RIGHT) * rate);
        pinched = null;
      } else if (one && event.type === "pointerup" && event.pointerType === "mouse" && Math.abs(one.now - one.start) > 6)
        zoom(time(Math.min(one.start, one.now)), time(Math.max(one.start, one.now)));
      else if (one && event.type === "pointerup") point(time(one.now));
      chosen.setAttribute("visibility", "hidden");
      down.delete(event.pointerId);
    };
    box.addEventListener("pointerup", up);
    box.addEventListener("pointercancel", up);
    box.addEventListener("dblclick", () => zoom(0, data.duration_s));
    box.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && !event.metaKey) return; // without a key the wheel belongs to the page
      event.preventDefault();
      scale(event.deltaY > 0 ? 1.4 : 1 / 1.4, time(of(event)));
    }, { passive: false });
    return { box, cursor: () => {
      const seen = view.at !== null && view.at >= view.from && view.at <= view.to;
      cursor.setAttribute("visibility", seen ? "visible" : "hidden");
      if (seen) for (const key of ["x1", "x2"]) cursor.setAttribute(key, x(view.at));
    } };
  };

  const legend = (panel) => {
    const line = html("div", { class: "legend" });
    line.append(html("b", {}, panel.label));
    panel.shown = panel.curves.map((curve) => {
      const item = html("span", {}), mark = html("i", { class: curve.style }), value = html("output");
      mark.style.borderColor = curve.colour;
      item.append(mark, document.createTextNode(curve.label + " "), value);
      line.append(item);
      return value;
    });
    return line;
  };

  const valueAt = (curve, t) => {
    const index = Math.max(before(curve.t, t), 0);
    return Number.isNaN(curve.v[index]) ? "–" : curve.v[index].toFixed(clamp(-Math.floor(Math.log10(curve.step)) - 1, 0, 3));
  };
  const stateAt = (spans, t) => (spans.findLast(([start]) => start <= t) || spans[0])[2];

  const build = (host, content) => {
    const chart = { ...content, host, panels: content.panels.map((panel) => ({ ...panel, curves: panel.curves.map(decode) })) };
    charts.push(chart);
    chart.parts = chart.panels.map((panel) => {
      const place = html("div", { class: "panel" });
      host.append(legend(panel), place);
      return place;
    });
    if (chart.rows.length) {
      chart.told = html("div", { class: "legend" });
      chart.told.append(...(chart.values = chart.rows.map((row) => html("span", {}, row.label))));
      chart.parts.push(html("div", { class: "panel" }));
      host.append(chart.told, chart.parts[0]);
    }
  };
  const redraw = (chart) => {
    chart.drawn = chart.parts.map((place, number) => {
      const made = chart.rows.length ? drawRows(place, chart) : drawPanel(place, chart, chart.panels[number], number === chart.panels.length - 1);
      place.replaceChildren(made.box);
      return made;
    });
  };

  // --- the one time of all

  const bar = document.getElementById("time"), slider = bar.querySelector("input"), told = bar.querySelector("output");
  const mode = () => { const last = before(data.modes.map(([start]) => start), view.at); return last < 0 ? "" : data.modes[last][1]; };
  const point = (t) => {
    view.at = t;
    slider.value = t;
    const text = `${clock(t, true)} ${mode()}`;
    told.textContent = text;
    slider.setAttribute("aria-valuetext", text);
    for (const chart of charts) {
      for (const made of chart.drawn) made.cursor();
      for (const panel of chart.panels) panel.shown.forEach((value, number) => (value.textContent = valueAt(panel.curves[number], t)));
      chart.rows.forEach((row, number) => (chart.values[number].textContent = `${row.label}: ${stateAt(row.spans, t)}`));
    }
    if (map) map.cursor();
  };
  const zoom = (from, to) => {
    const least = Math.min(1, data.duration_s), width = clamp(to - from, least, data.duration_s);
    view.from = clamp(from, 0, data.duration_s - width);
    view.to = view.from + width;
    draw();
  };
  const scale = (factor, about) => {
    const middle = about ?? clamp(view.at ?? (view.from + view.to) / 2, view.from, view.to);
    zoom(middle - (middle - view.from) * factor, middle + (view.to - middle) * factor);
  };
  const draw = () => {
    charts.forEach(redraw);
    if (map) map.draw();
    slider.max = data.duration_s;
    bar.querySelector("[data-do=whole]").disabled = view.to - view.from >= data.duration_s;
    if (view.at !== null) point(view.at);
  };
  const ACTIONS = { in: () => scale(0.5), out: () => scale(2), whole: () => zoom(0, data.duration_s) };
  for (const button of bar.querySelectorAll("button")) button.addEventListener("click", () => ACTIONS[button.dataset.do]());
  slider.addEventListener("input", () => {
    const t = Number(slider.value);
    if (t < view.from || t > view.to) zoom(t - (view.to - view.from) / 2, t + (view.to - view.from) / 2);
    point(t);
  });

  // --- the map

  const DEPTHS = ["#fde725", "#5ec962", "#21918c", "#3b528b", "#440154"];
  const TINTS = ["#b9c99a", "#8fc3ea", "#b5d9f3", "#d3e8f8", "#e6f2fb", "#f3f9fd"];
  const mix = (share) => {
    const at = clamp(share, 0, 1) * (DEPTHS.length - 1), low = Math.min(Math.floor(at), DEPTHS.length - 2);
    const rgb = (text) => [1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16));
    const [a, b] = [rgb(DEPTHS[low]), rgb(DEPTHS[low + 1])];
    return `rgb(${a.map((part, i) => Math.round(part + (b[i] - part) * (at - low))).join(",")})`;
  };
  const tinted = (chart) => {
    const canvas = html("canvas", { width: chart.rows[0].length, height: chart.rows.length }), pen = canvas.getContext("2d");
    chart.rows.forEach((row, y) => [...row].forEach((cell, x) => {
      if (cell === "-") return;
      pen.fillStyle = TINTS[Number(cell)];
      pen.fillRect(x, y, 1, 1);
    }));
    return canvas.toDataURL();
  };
  const mapLegend = (content) => {
    const line = html("div", { class: "legend" });
    const add = (mark, text) => { const item = html("span"); item.append(mark, document.createTextNode(text)); line.append(item); };
    const stroke = (colour, style) => { const mark = html("i", { class: style }); mark.style.borderColor = colour; return mark; };
    const box = (colour) => { const mark = html("i", { class: "box" }); mark.style.background = colour; return mark; };
    for (const track of content.tracks) add(stroke(track.name === "truth" ? "#8c959f" : "#0969da", track.name === "truth" ? "wide" : "line"), `track (${track.name})`);
    if (content.points.length) add(stroke("#8250df", "dash"), "plan");
    if (content.polygons.length || content.circles.length) { add(stroke("#1a7f37", "dash"), "fence, stay inside"); add(stroke("#cf222e", "dash"), "fence, keep out"); }
    if (content.actions.length) add(html("i", { class: "cross" }, "✕"), "failsafe action");
    if (content.dots) {
      const mark = html("i", { class: "box ramp" });
      mark.style.background = `linear-gradient(90deg,${DEPTHS.join(",")})`;
      add(mark, `${content.dots.name} ${content.dots.low.toFixed(1)} to ${content.dots.high.toFixed(1)} m`);
    }
    if (content.chart) {
      add(html("b"), `chart ${content.chart.name}, m below datum:`);
      const ends = content.chart.tints_m;
      add(box(TINTS[0]), "dries");
      ends.forEach((end, number) => add(box(TINTS[number + 1]), number + 1 < ends.length ? `${end} to ${ends[number + 1]}` : `over ${end}`));
    }
    return line;
  };

  const buildMap = (host, content) => {
    const [west, south, east, north] = content.box;
    const tracks = content.tracks.map((track) => ({ ...track, t: summed(track.t, 0.01), x: summed(track.x, 0.01), y: summed(track.y, 0.01) }));
    const main = tracks[tracks.length - 1], image = content.chart ? tinted(content.chart) : null;
    const place = html("div", { class: "map" }), tools = html("div", { class: "tools" });
    const look = { x: (west + east) / 2, y: (south + north) / 2, zoom: 1 };
    let made, boat, perMetre = 1, width = 0, height = 0;
    const X = (x) => width / 2 + (x - look.x) * perMetre, Y = (y) => height / 2 - (y - look.y) * perMetre;
    const fit = () => Object.assign(look, { x: (west + east) / 2, y: (south + north) / 2, zoom: 1 });
    const line = (points, attributes) => made.append(svg("polyline", { points: points.map(([x, y]) => `${X(x).toFixed(1)},${Y(y).toFixed(1)}`).join(" "), fill: "none", ...attributes }));
    const between = (track, from, to) => {
      const out = [];
      for (let index = Math.max(before(track.t, from), 0); index < track.t.length && track.t[index] <= to; index++) out.push([track.x[index], track.y[index]]);
      return out;
    };
    const text = (x, y, words, attributes) => made.append(svg("text", { x, y, class: "halo", ...attributes }, words));
    const FENCE = (keep) => ({ stroke: keep ? "#1a7f37" : "#cf222e", "stroke-width": 1.6, "stroke-dasharray": "7 4" });

    const scaleBar = () => {
      const most = (width * 0.3) / perMetre, power = 10 ** Math.floor(Math.log10(most));
      const fits = power * [5, 2, 1].find((n) => n * power <= most);
      const y = height - 14, x = 14, end = x + fits * perMetre;
      made.append(svg("path", { d: `M${x} ${y - 5}V${y}H${end}V${y - 5}`, class: "scale" }));
      text((x + end) / 2, y - 6, fits >= 1000 ? `${fits / 1000} km` : `${fits} m`, { "text-anchor": "middle", class: "halo scale-text" });
      made.append(svg("path", { d: `M${width - 22} 34V12M${width - 28} 20L${width - 22} 11L${width - 16} 20`, class: "scale" }));
      text(width - 22, 48, "N", { "text-anchor": "middle" });
    };
    const drawMap = () => {
      width = Math.max(place.clientWidth, 200);
      height = Math.round(Math.min(width * (width < 600 ? 1 : 0.62), 640));
      perMetre = Math.min(width / (east - west), height / (north - south)) * look.zoom;
      made = svg("svg", { width, height, viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": `Map of the track; 0, 0 is ${content.origin}` });
      place.style.touchAction = look.zoom > 1 ? "none" : "pan-y";
      if (image) {
        const { west: w, north: n, cell, rows } = content.chart;
        made.append(svg("image", { href: image, x: X(w), y: Y(n), width: rows[0].length * cell * perMetre, height: rows.length * cell * perMetre, preserveAspectRatio: "none", style: "image-rendering:pixelated" }));
      }
      for (const [corners, keep] of content.polygons) line([...corners, corners[0]], FENCE(keep));
      for (const [x, y, radius, keep] of content.circles) made.append(svg("circle", { cx: X(x), cy: Y(y), r: radius * perMetre, fill: "none", ...FENCE(keep) }));
      if (content.dots) {
        const { low, high, points } = content.dots;
        for (const [x, y, depth] of points) made.append(svg("circle", { cx: X(x), cy: Y(y), r: 4, fill: mix((depth - low) / (high - low)), "fill-opacity": 0.55 }));
      }
      for (const track of tracks) {
        const style = track.name === "truth" ? { stroke: "#8c959f", "stroke-width": 3.4 } : { stroke: "#0969da", "stroke-width": 1.6 };
        line(between(track, 0, data.duration_s), { ...style, "stroke-opacity": view.to - view.from < data.duration_s ? 0.25 : 0.9 });
        if (view.to - view.from < data.duration_s) line(between(track, view.from, view.to), style);
      }
      // The plan lies over the track, or the two would be one where the boat did as it was told.
      for (const loiter of content.loiters) for (const colour of ["#fff", "#8250df"]) line(loiter, { stroke: colour, "stroke-width": 1.5, "stroke-dasharray": "5 5", "stroke-opacity": 0.9 });
      line(content.points.filter(([, , label]) => label !== "rally"), { stroke: "#8250df", "stroke-width": 1.5, "stroke-dasharray": "2 4" });
      for (const [x, y, label] of content.points) {
        made.append(svg("circle", { cx: X(x), cy: Y(y), r: 4, fill: "#8250df", stroke: "#fff" }));
        text(X(x) + 7, Y(y) - 6, label, { fill: "#6639ba" });
      }
      if (main) {
        const end = main.t.length - 1;
        made.append(svg("circle", { cx: X(main.x[0]), cy: Y(main.y[0]), r: 6, fill: "#1a7f37", stroke: "#fff" }), svg("rect", { x: X(main.x[end]) - 5, y: Y(main.y[end]) - 5, width: 10, height: 10, fill: "#cf222e", stroke: "#fff" }));
        text(X(main.x[0]) + 9, Y(main.y[0]) + 16, "start", {});
        text(X(main.x[end]) + 9, Y(main.y[end]) + 16, "end", {});
      }
      content.actions.forEach(([x, y, value, t], number) => {
        text(X(x), Y(y) + 5, "✕", { "text-anchor": "middle", class: "halo action" });
        if (number < 12) text(X(x) + 10, Y(y) - 8, `${value}, ${clock(t)}`, { class: "halo action" });
      });
      scaleBar();
      boat = svg("circle", { r: 7, class: "boat", visibility: "hidden" });
      made.append(boat);
      place.replaceChildren(made, tools);
      cursor();
    };
    const cursor = () => {
      const index = main && view.at !== null ? Math.max(before(main.t, view.at), 0) : -1;
      boat.setAttribute("visibility", index < 0 ? "hidden" : "visible");
      if (index >= 0) { boat.setAttribute("cx", X(main.x[index])); boat.setAttribute("cy", Y(main.y[index])); }
    };
    const nearest = (px, py) => {
      let best = -1, least = 30 * 30;
      for (let index = 0; main && index < main.t.length; index++) {
        const away = (X(main.x[index]) - px) ** 2 + (Y(main.y[index]) - py) ** 2;
        if (away < least && main.t[index] >= view.from && main.t[index] <= view.to) [best, least] = [index, away];
      }
      return best;
    };
    /** One pointer points, or moves the map when it is zoomed into; two zoom. */
    const listen = () => {
      const held = new Map();
      const of = (event) => { const box = place.getBoundingClientRect(); return [event.clientX - box.left, event.clientY - box.top]; };
      const apart = ([[ax, ay], [bx, by]]) => Math.max(Math.hypot(ax - bx, ay - by), 1);
      place.addEventListener("pointerdown", (event) => { if (!tools.contains(event.target)) held.set(event.pointerId, of(event)); });
      place.addEventListener("pointermove", (event) => {
        const [px, py] = of(event), last = held.get(event.pointerId);
        if (last && held.size === 2) {
          const was = apart([...held.values()]);
          held.set(event.pointerId, [px, py]);
          closer(apart([...held.values()]) / was, [px, py]);
        } else if (last && look.zoom > 1) {
          Object.assign(look, { x: look.x - (px - last[0]) / perMetre, y: look.y + (py - last[1]) / perMetre });
          held.set(event.pointerId, [px, py]);
          drawMap();
        } else {
          const index = nearest(px, py);
          if (index >= 0) point(main.t[index]);
        }
      });
      for (const kind of ["pointerup", "pointercancel", "pointerleave"]) place.addEventListener(kind, (event) => held.delete(event.pointerId));
      place.addEventListener("wheel", (event) => {
        if (!event.ctrlKey && !event.metaKey) return;
        event.preventDefault();
        closer(event.deltaY > 0 ? 1 / 1.4 : 1.4, of(event));
      }, { passive: false });
    };
    const closer = (factor, [px, py] = [width / 2, height / 2]) => {
      const x = look.x + (px - width / 2) / perMetre, y = look.y - (py - height / 2) / perMetre;
      const next = clamp(look.zoom * factor, 0.5, 200), share = look.zoom / next;
      Object.assign(look, { x: x - (x - look.x) * share, y: y - (y - look.y) * share, zoom: next });
      drawMap();
    };
    const buttons = [["+", "closer", () => closer(1.6)], ["−", "farther", () => closer(1 / 1.6)], ["fit", "the whole track", () => { fit(); drawMap(); }]];
    for (const [sign, meaning, act] of buttons) {
      const button = html("button", { type: "button", "aria-label": `map: ${meaning}`, title: meaning }, sign);
      button.addEventListener("click", act);
      tools.append(button);
    }
    listen();
    host.append(mapLegend(content), place, html("p", { class: "soft" }, `0, 0 is ${content.origin}`));
    return { draw: drawMap, cursor };
  };

  // --- start

  let map = null;
  for (const host of document.querySelectorAll("[data-chart]")) build(host, data.charts[Number(host.dataset.chart)]);
  const mapHost = document.querySelector("[data-map]");
  if (mapHost && data.map) map = buildMap(mapHost, data.map);
  bar.hidden = false;
  draw();
  point(0);
  let wide = window.innerWidth;
  window.addEventListener("resize", () => { if (window.innerWidth !== wide) { wide = window.innerWidth; draw(); } });
})();
